"""``mavplan init``: a commented scenario and its users, to start from."""

from importlib.resources import files
from pathlib import Path

import click

from mavplan.errors import InputError, Problem
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
    targets = {folder / name: template_text(name) for name in TEMPLATE}
    in_the_way = [
        Problem(str(path), "is there already and is not overwritten; name another folder", "exists")
        for path in targets
        if path.exists() or path.is_symlink()
    ]
    if in_the_way:
        raise InputError(in_the_way)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"the folder cannot be made: {error.strerror or error}"
        raise InputError([Problem(str(folder), message, "no-folder")]) from error
    write_all(targets.items())
    scenario, users = targets
    return scenario, users


def template_text(name: str) -> str:
    """Return the content of one of the `TEMPLATE` files."""
    return (files("mavplan") / "template" / name).read_text(encoding="utf-8")
