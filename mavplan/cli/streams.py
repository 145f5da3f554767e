"""``-``: a scenario from standard input, one file to standard output."""

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from mavplan.cli.console import is_terminal, mode
from mavplan.errors import InputError

if TYPE_CHECKING:
    from mavplan.scenario.model import Scenario

_Command = TypeVar("_Command", bound=Callable[..., object])

DASH = Path("-")
STDIN = "standard input"
STEM = "mission"
"""What a file made of a scenario without a name is called."""
BINARY = (".kmz", ".png", ".pdf")


def format_option(*kinds: str) -> Callable[[_Command], _Command]:
    """Give a decorator that adds ``--format``, for ``-o -``, to a command."""
    words = "What -o - writes to standard output."
    return click.option("--format", "kind", type=click.Choice(kinds), help=words)


def read_scenario(path: Path, *, all_served: bool = True) -> "Scenario":
    """Return the scenario in a file, or on standard input, whose files stand relative to the working folder.

    Parameters
    ----------
    all_served
        As `mavplan.scenario.load_scenario` takes it.

    Raises
    ------
    InputError
        As `mavplan.scenario.load_scenario`.
    """
    from mavplan.scenario.toml import MAX_BYTES, load_scenario, scenario_of

    if path != DASH:
        return load_scenario(path, all_served=all_served)
    if is_terminal(sys.stdin):
        click.echo("reading the scenario from standard input, to its end (Ctrl-D)", err=True)
    return scenario_of(sys.stdin.buffer.read(MAX_BYTES + 1), Path(), STDIN, all_served=all_served)


def stem_of(path: Path) -> str:
    """Return the name that files made of an input get."""
    return STEM if path == DASH else path.stem


def named_outputs(outputs: Sequence[Path], kind: str | None) -> tuple[Path, ...]:
    """Return the outputs, ``-`` as a name with the suffix that ``--format`` says; see `is_stdout`.

    Raises
    ------
    InputError
        ``-`` without a format or twice, a format without ``-``, ``-`` beside ``--json``, or bytes for a terminal.
    """
    if DASH not in outputs:
        if kind is not None:
            raise InputError("--format says what -o - is; the format of a file is said by its suffix")
        return tuple(outputs)
    if kind is None:
        raise InputError("-o -: standard output has no suffix; say with --format what is to be written")
    if outputs.count(DASH) > 1:
        raise InputError("-o -: standard output takes one file; leave the others out or name them")
    claim_stdout(f".{kind}")
    return tuple(Path(f"-.{kind}") if path == DASH else path for path in outputs)


def claim_stdout(suffix: str) -> None:
    """Keep standard output for a file.

    Raises
    ------
    InputError
        It is wanted for something else, or is a terminal that would show bytes.
    """
    if mode().as_json:
        raise InputError("-o - and --json both want standard output; leave one out")
    if suffix in BINARY and is_terminal(sys.stdout):
        raise InputError(f"-o -: {suffix} is not text: send it into a file or a pipe, not to a terminal")
    mode().streams = True


def is_stdout(path: Path) -> bool:
    """Return whether this is the name that stands for standard output."""
    return str(path).startswith("-.") and path.stem == "-"


def write_outputs_of(contents: Iterable[tuple[Path, str | bytes]]) -> None:
    """Write files, whole and all or none; then what is for standard output."""
    from mavplan.formats.atomic import write_all

    pairs = list(contents)
    write_all((path, content) for path, content in pairs if not is_stdout(path))
    for path, content in pairs:
        if is_stdout(path):
            click.echo(content.encode("utf-8") if isinstance(content, str) else content, nl=False)
