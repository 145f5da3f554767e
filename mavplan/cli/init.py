"""``mavplan init``: a commented scenario and its users, to start from."""

from importlib.resources import files
from pathlib import Path

import click

from mavplan.cli.new_folder import make_folder
from mavplan.formats.atomic import write_all

TEMPLATE = ("scenario.toml", "users.csv")
"""The files that are written."""


@click.command("init", short_help="Write a commented scenario to start from.")
@click.argument("folder", type=click.Path(path_type=Path), default=Path())
def init_command(folder: Path) -> None:
    """Write a commented scenario.toml and a users.csv of made-up users into FOLDER (default: this one).

    Nothing that is there already is overwritten.

    \b
    mavplan init rescue
    """
    from mavplan.cli.console import answer, tell, tell_written

    scenario, users = written = write_template(folder)
    tell_written(written)
    tell(f"next: put your own home and radio into {scenario} and your users into {users}, then")
    tell(f"  mavplan plan {scenario}")
    answer({"written": [str(path) for path in written]})


def write_template(folder: Path) -> tuple[Path, Path]:
    """Write the `TEMPLATE` into a folder, made where it is not there, and return the files.

    Raises
    ------
    InputError
        Something is in the way.
    """
    targets = make_folder(folder, TEMPLATE)
    write_all(zip(targets, map(template_text, TEMPLATE), strict=True))
    scenario, users = targets
    return scenario, users


def template_text(name: str) -> str:
    """Return the content of one of the `TEMPLATE` files."""
    return (files("mavplan") / "template" / name).read_text(encoding="utf-8")
