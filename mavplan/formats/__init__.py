"""Mission files: `read_mission` and `write_mission` choose the format by the file's suffix (`FORMATS`).

One file a format: `plan` (with `plan_reader` and `plan_areas`) and `waypoints`; what they share is in `values`.
`atomic` puts files in their place, `checks` looks at written files with other people's eyes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mavplan.errors import InputError, Problem
from mavplan.formats import plan, waypoints
from mavplan.formats.atomic import atomic_write, write_all
from mavplan.mission.model import Mission

__all__ = [
    "FORMATS",
    "MissionFormat",
    "atomic_write",
    "format_of",
    "read_mission",
    "read_text",
    "write_all",
    "write_mission",
]


@dataclass(frozen=True, slots=True)
class MissionFormat:
    """One mission file format.

    Attributes
    ----------
    suffix, title
        Of its files; the name people use.
    dumps
        Mission to text; raises `InputError`.
    loads
        Text and the name to use in messages to mission; raises `InputError`.
    warnings
        What the format cannot say of a mission as it is meant.
    """

    suffix: str
    title: str
    dumps: Callable[[Mission], str]
    loads: Callable[[str, str], Mission]
    warnings: Callable[[Mission], tuple[Problem, ...]]


FORMATS: dict[str, MissionFormat] = {
    found.suffix: found
    for found in (
        MissionFormat(".plan", "QGroundControl plan", plan.dumps, plan.loads, plan.warnings),
        MissionFormat(".waypoints", "QGC WPL 110", waypoints.dumps, waypoints.loads, waypoints.warnings),
    )
}
"""The formats that can be read and written, by suffix in lower case."""


def format_of(path: Path | str) -> MissionFormat:
    """Return the format that a file's suffix says.

    Raises
    ------
    InputError
        No format has this suffix.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        known = " and ".join(f"{found.suffix} ({found.title})" for found in FORMATS.values())
        found = f'"{suffix}" is not a format of mission files' if suffix else "a mission file needs a suffix"
        raise InputError([Problem(str(path), f"{found}: there are {known}", "format")])
    return FORMATS[suffix]


def read_mission(path: Path | str) -> Mission:
    """Return the mission in a file.

    Parameters
    ----------
    path
        The suffix says the format.

    Returns
    -------
    Mission
        Its ``warnings`` tell what was left out of it.

    Raises
    ------
    InputError
        The file cannot be read, or all that is wrong in it.
    """
    mission_format = format_of(path)
    return mission_format.loads(read_text(path), str(path))


def read_text(path: Path | str) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError
        It cannot be read, or is no UTF-8 text.
    """
    try:
        return Path(path).read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        found = f"byte {error.start} is not UTF-8 text: this is no mission file"
        raise InputError([Problem(str(path), found, "not-text")]) from error
    except OSError as error:
        message = f"cannot be read: {error.strerror or error}"
        raise InputError([Problem(str(path), message, "not-readable")]) from error


def write_mission(mission: Mission, path: Path | str) -> tuple[Problem, ...]:
    """Write a mission to a file, whole or not at all.

    Parameters
    ----------
    mission
        What to write.
    path
        The suffix says the format.

    Returns
    -------
    tuple of Problem
        Warnings: what the format cannot say as it is meant.

    Raises
    ------
    InputError
        The suffix is not known, the mission cannot stand in the format, or the file cannot be written.
    """
    mission_format = format_of(path)
    atomic_write(path, mission_format.dumps(mission))
    return mission_format.warnings(mission)
