"""What to do about an error, where that is not said by the error itself: the line that begins with ``hint:``."""

import difflib
import errno
from collections.abc import Iterator
from pathlib import Path

import click

from mavplan.errors import InputError, NoLinkError, Problem, SilentLinkError

MADE_BY = {
    ".toml": "'mavplan init FOLDER' writes a scenario to start from",
    ".plan": "'mavplan plan SCENARIO -o {}' writes one",
    ".waypoints": "'mavplan plan SCENARIO -o {}' writes one",
    ".json": "'mavplan plan' writes it beside the mission",
    ".tlog": "'mavplan fly' records one",
}
"""Which command makes a file that is missing."""


def remedies(error: Exception) -> Iterator[str]:
    """Yield what may help."""
    if isinstance(error, SilentLinkError):
        yield "is the vehicle on, and is its link at that place? 'mavplan sim' starts one to try things on"
    elif isinstance(error, NoLinkError):
        yield from _for_a_link(error)
    elif isinstance(error, click.MissingParameter) and error.param is not None and error.param.name == "conn":
        yield "say where the vehicle is, as in --conn udp:0.0.0.0:14550, or set MAVPLAN_CONN"
    elif isinstance(error, InputError):
        found = (_for_a_file(problem) for problem in error.problems)
        yield from dict.fromkeys(hint for hint in found if hint is not None)


def _for_a_link(error: NoLinkError) -> Iterator[str]:
    """Yield what to do where the system itself refuses a connection."""
    number = getattr(error.__cause__, "errno", None)
    if number == errno.EADDRINUSE:
        yield "another ground station or another mavplan listens there: end it, or give this one another port"
    elif number == errno.ECONNREFUSED:
        yield "nothing listens there: is the vehicle's link or the simulator running? 'mavplan sim' starts one"
    elif number in {errno.EACCES, errno.EPERM}:
        yield "serial ports are often for a group: 'sudo usermod -a -G dialout $USER', then log in again"
    elif number == errno.ENOENT:
        from serial.tools.list_ports import comports

        there = ", ".join(port.device for port in comports())
        yield (
            f"serial ports here: {there}"
            if there
            else "there is no serial port here: is the radio plugged in?"
        )


def _for_a_file(problem: Problem) -> str | None:
    """Return what to do where a path is a folder or leads nowhere."""
    path = Path(problem.where)
    try:
        if not problem.where or problem.code not in {"missing-file", "not-readable", "unreadable"}:
            return None
        if path.is_dir():
            inside = path / "scenario.toml"
            return f"did you mean {inside}?" if inside.is_file() else None
        if path.exists() or not path.parent.is_dir():
            return None
        there = [entry.name for entry in path.parent.iterdir() if entry.suffix.lower() == path.suffix.lower()]
    except (OSError, ValueError):
        return None
    near = difflib.get_close_matches(path.name, there, 1)
    if near:
        return f"did you mean {path.with_name(near[0])}?"
    hint = MADE_BY.get(path.suffix.lower())
    return None if hint is None else hint.format(path)
