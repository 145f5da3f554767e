"""What every command prints with: lines, tables and progress to people, one object to scripts, problems to stderr.

Whether a person or a script reads is the command line's `Mode`; the commands say what there is, and it goes where it
is wanted.
"""

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TextIO

import click

from mavplan.errors import ExitCode, InputError, Problem
from mavplan.progress import Progress

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console
    from rich.table import Table

PIPE_WIDTH = 120
"""Columns of a table that goes to a file or a pipe."""


@dataclass(slots=True)
class Mode:
    """Who reads what one run of the command line says.

    Attributes
    ----------
    quiet, verbose
        Only errors; also what is being done, and when.
    as_json
        Standard output is one object.
    streams
        Standard output is a file that was asked for with ``-o -``.
    volume_from
        How strong a setting said quiet or verbose: 0 a file's, 1 the environment's, 2 the command line's.
    said
        Problems that were told so far.
    answered
        The object has been printed.
    """

    quiet: bool = False
    verbose: bool = False
    as_json: bool = False
    streams: bool = False
    volume_from: int = 0
    said: list[Problem] = field(default_factory=list)
    answered: bool = False
    began_s: float = field(default_factory=time.monotonic)

    @property
    def shows(self) -> bool:
        """Whether lines and tables for a person go to standard output."""
        return not (self.quiet or self.as_json or self.streams)


def mode() -> Mode:
    """Return the mode of the command that runs."""
    context = click.get_current_context(silent=True)
    return (context and context.find_object(Mode)) or Mode()


def tell(line: str = "") -> None:
    """Print a line for a person; a terminal that is narrower gets it broken between words."""
    if not mode().shows:
        return
    width = terminal_width()
    if is_terminal(sys.stdout) and len(line) > width:
        import textwrap

        line = textwrap.fill(
            line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
        )
    click.echo(line)


def tell_written(paths: "Iterable[Path]") -> None:
    """Tell which files there are now."""
    tell(f"written: {', '.join(str(path) for path in paths)}")


def note(doing: str, of: Mode | None = None) -> None:
    """Tell, where it is wanted, what is being done from now on, and how long the command has been running."""
    now = of or mode()
    if now.verbose:
        click.echo(f"{time.monotonic() - now.began_s:8.2f} s  {printable(doing)}", err=True)


def tell_next(*command: "str | Path", why: str = "") -> None:
    """Tell the person at a terminal which command comes next."""
    if mode().shows and is_terminal(sys.stdout):
        words = " ".join(quoted(str(part)) for part in command)
        click.secho(f"next: {words}{f'   {why}' if why else ''}", dim=True, color=colour())


def quoted(word: str) -> str:
    """Return a word as a shell takes it; capitals that stand for something of the reader's own stay bare."""
    import shlex

    return printable(shlex.quote(word))


def answer(document: Mapping[str, Any] | Callable[[], Mapping[str, Any]]) -> None:
    """Print the one object for scripts, if that is wanted, with the warnings that were told."""
    now = mode()
    if not now.as_json:
        return
    warnings = [str(problem) for problem in now.said if problem.severity == "warning"]
    _print_object({"warnings": warnings, **(document() if callable(document) else document)})
    now.answered = True


def answer_failure(error: Exception, code: ExitCode) -> None:
    """Print the one object for scripts where a command ended before it had one."""
    problems = error.problems if isinstance(error, InputError) else ()
    message = error.format_message() if isinstance(error, click.ClickException) else str(error)
    warnings = [str(problem) for problem in mode().said if problem.severity == "warning"]
    told = {
        "warnings": warnings,
        "outcome": code.name.lower(),
        "exit_code": int(code),
        "message": message,
        "problems": problem_objects(problems),
    }
    _print_object(told)


def _print_object(document: Mapping[str, Any]) -> None:
    import json

    # Half a character, as a broken file name has it, is JSON only as an escape.
    text = json.dumps(document, ensure_ascii=False, allow_nan=False)
    click.echo(text.encode("utf-8", "backslashreplace"))


def print_table(table: "Table") -> None:
    """Print a table for a person as wide as the terminal: closer where that is narrow, but no figure is cut."""
    if not mode().shows:
        return
    console = stdout()
    if _least_width(table, console) > console.width:
        table.padding = (0, 0, 0, 1)
        console.width = max(_least_width(table, console), console.width)
    if is_terminal(sys.stdout):
        console.print(table)
        return
    with console.capture() as captured:
        console.print(table)
    tell("\n".join(line.rstrip() for line in captured.get().splitlines()))


def _least_width(table: "Table", console: "Console") -> int:
    """Return how many columns a table takes, those with figures whole."""
    from rich.cells import cell_len
    from rich.measure import Measurement

    for column in table.columns:
        if column.no_wrap:
            lines = [line for cell in (column.header, *column.cells) for line in str(cell).splitlines()]
            column.min_width = max(map(cell_len, lines), default=0)
    return Measurement.get(console, console.options.update_width(10 * PIPE_WIDTH), table).minimum


def stdout() -> "Console":
    """Return the console for results; of fixed width when piped."""
    from rich.console import Console

    width = terminal_width() if is_terminal(sys.stdout) else PIPE_WIDTH
    return Console(width=width, highlight=False, markup=False)


def terminal_width() -> int:
    """Return the columns of the terminal, or what COLUMNS says."""
    import shutil

    return shutil.get_terminal_size().columns


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal; one that was closed before we started is none."""
    return stream is not None and stream.isatty()


def colour() -> bool | None:
    """Return whether colours are wanted, whatever reads; None: on terminals."""
    if os.environ.get("NO_COLOR"):
        return False
    return True if os.environ.get("FORCE_COLOR") else None


def stderr() -> "Console":
    """Return the console for progress."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, markup=False)


def printable(text: str) -> str:
    """Return the text without control characters, which could command a terminal; new lines stay."""
    return "".join(char if char == "\n" or char.isprintable() else "�" for char in text)


def say_problems(problems: Iterable[Problem]) -> None:
    """Print each problem on a line of standard error; a warning only where it is wanted."""
    now = mode()
    for problem in problems:
        now.said.append(problem)
        if problem.severity == "error" or not now.quiet:
            say(problem.severity, str(problem))


def say(severity: str, message: str) -> None:
    """Print one line of standard error that begins with ``error:`` or ``warning:``."""
    tint = "red" if severity == "error" else "yellow"
    click.secho(f"{severity}: ", nl=False, err=True, fg=tint, color=colour())
    click.echo(printable(message), err=True)


def say_hint(message: str) -> None:
    """Tell on standard error what may help."""
    if not mode().quiet:
        click.echo(f"hint: {printable(message)}", err=True)


@contextmanager
def progress(label: str) -> Iterator[Progress]:
    """Give a function of (done, to do) that moves a progress bar on standard error, if that is a terminal.

    Until it is called the bar moves to and fro, with the time gone by.
    """
    note(label)
    if not is_terminal(sys.stderr) or mode().quiet:
        yield lambda _done, _todo: None
        return
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    began_s = time.monotonic()
    last_done, last_s = 0.0, began_s

    class Left(ProgressColumn):
        """The part done and the time left, worked out each time that it is shown; the time gone by before that."""

        def render(self, task: Task) -> Text:
            now_s = time.monotonic()
            if not last_done:
                return Text(stopwatch(now_s - began_s))
            left_s = time_left_s(last_done, last_s - began_s, now_s - last_s)
            return Text(f"{last_done:.0%}, {stopwatch(left_s)} left")

    columns = (TextColumn("{task.description}"), BarColumn(), Left())
    with Progress(*columns, console=stderr(), transient=True) as bar:
        task = bar.add_task(label, total=None)

        def move(done: int, todo: int) -> None:
            nonlocal last_done, last_s
            last_done, last_s = min(done / todo, 1.0) if todo > 0 else 0.0, time.monotonic()
            bar.update(task, completed=done, total=todo)

        yield move


def time_left_s(done: float, taken_s: float, since_s: float) -> float:
    """Return how long it will take yet, at the pace until now.

    Parameters
    ----------
    done
        The part done, above 0.
    taken_s, since_s
        What it took, and how long ago it was done.
    """
    return max(taken_s * (1.0 - done) / done - since_s, 0.0)


def stopwatch(seconds: float) -> str:
    """Return ``12:34``, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def clock(seconds: float) -> str:
    """Return ``12 min 34 s``."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def counted(number: int, thing: str) -> str:
    """Return ``1 stop``, ``2 stops``."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def plain_table(title: str | None = None) -> "Table":
    """Return a table without lines, as every list of results is printed."""
    from rich.table import Table

    return Table(title=title, title_justify="left", box=None, pad_edge=False)


def problem_objects(problems: Sequence[Problem]) -> list[dict[str, str]]:
    """Return problems as scripts get them."""
    return [
        {
            "severity": problem.severity,
            "code": problem.code,
            "where": problem.where,
            "message": problem.message,
        }
        for problem in problems
    ]
