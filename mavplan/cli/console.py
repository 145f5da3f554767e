"""What every command prints with: tables and progress to people, plain text to pipes, problems to standard error."""

import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

import click

from mavplan.errors import Problem

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 120
"""Columns of a table that goes to a file or a pipe."""

LEAST_WIDTH = 104
"""Columns that a table takes at least: a terminal that is narrower breaks its lines, but no figure is cut."""


def stdout() -> "Console":
    """Return the console for results; without colour and of fixed width when piped."""
    from rich.console import Console

    if not is_terminal(sys.stdout):
        return Console(width=PIPE_WIDTH, highlight=False, markup=False)
    return Console(width=max(LEAST_WIDTH, shutil.get_terminal_size().columns), highlight=False, markup=False)


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal; one that was closed before we started is none."""
    return stream is not None and stream.isatty()


def stderr() -> "Console":
    """Return the console for progress."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, markup=False)


def printable(text: str) -> str:
    """Return the text without control characters, which could command a terminal; new lines stay."""
    return "".join(char if char == "\n" or char.isprintable() else "�" for char in text)


def say_problems(problems: Iterable[Problem]) -> None:
    """Print each problem on a line of standard error."""
    for problem in problems:
        click.secho(
            f"{problem.severity}: ", nl=False, err=True, fg="red" if problem.severity == "error" else "yellow"
        )
        click.echo(printable(str(problem)), err=True)


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """Give a function of (done, to do) that moves a progress bar on standard error, if that is a terminal."""
    if not is_terminal(sys.stderr):
        yield lambda _done, _todo: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=stderr(),
        transient=True,
    ) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, todo: bar.update(task, completed=done, total=todo)


def clock(seconds: float) -> str:
    """Return ``12 min 34 s``."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def counted(number: int, thing: str) -> str:
    """Return ``1 stop``, ``2 stops``."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"
