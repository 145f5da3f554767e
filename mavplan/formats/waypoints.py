"""The text format ``.waypoints`` (QGC WPL 110) of Mission Planner, MAVProxy and QGroundControl: a `Mission` and back.

Field by field in docs/mission-files.md. The file does not say which autopilot it is for, has no fence and no rally
points, and its first line after the header is always home.
"""

import math
import re
from typing import NamedTuple

from mavplan.errors import InputError, Problem
from mavplan.formats import values
from mavplan.mission.model import NAN, Command, Frame, HomePosition, Mission, MissionItem

HEADER = "QGC WPL 110"
FIELDS = (
    *("sequence", "current", "frame", "command", "param1", "param2", "param3", "param4"),
    *("latitude", "longitude", "altitude", "autocontinue"),
)

_NO_HOME = HomePosition(0, 0, 0.0)
_WHOLE = re.compile(r"[+-]?[0-9]{1,9}", re.ASCII)
_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,4})?", re.ASCII)


def dumps(mission: Mission) -> str:
    """Return a mission as the text of a ``.waypoints`` file.

    Parameters
    ----------
    mission
        NaN is written as 0, for there are readers that take no NaN; `warnings` tells where that changes a flight.

    Raises
    ------
    InputError
        An item or home cannot stand in the file, for instance an altitude above terrain, which QGroundControl
        would read from this format as above sea level; all problems at once.
    """
    problems = list(values.mission_problems(mission))
    problems += [
        Problem(
            f"item {index}", "altitudes above terrain cannot stand in .waypoints: write a .plan", "terrain"
        )
        for index, item in enumerate(mission.items)
        if item.has_position and item.frame in (Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT)
    ]
    if problems:
        raise InputError(problems)
    home = MissionItem(
        Command.NAV_WAYPOINT,
        Frame.GLOBAL,
        lat_e7=mission.home.lat_e7,
        lon_e7=mission.home.lon_e7,
        alt_m=mission.home.alt_amsl_m,
    )
    lines = [
        _line(sequence, values.normal_item(item)) for sequence, item in enumerate((home, *mission.items))
    ]
    return "\n".join((HEADER, *lines, ""))


def loads(text: str, name: str) -> Mission:
    """Return the mission in the text of a ``.waypoints`` file.

    Takes what other programs write: spaces for tabs, CRLF, comments and blank lines.

    Parameters
    ----------
    text
        The whole file.
    name
        What messages call it, usually its path.

    Returns
    -------
    Mission
        ``autopilot`` is None: this format does not say.

    Raises
    ------
    InputError
        Every problem that was found, each with its line.
    """
    problems: list[Problem] = []
    header, *lines = text.removeprefix("\ufeff").splitlines() or [""]
    if header.split() != HEADER.split():
        raise InputError([_header_problem(header, name)])
    rows: list[_Row | None] = []
    for number, line in enumerate(lines, start=2):
        if line.strip() and not line.lstrip().startswith("#"):
            rows.append(_row(line, f"{name}, line {number}", problems))
    problems += _sequence_problems(rows)
    home = _home(rows[0], problems) if rows and rows[0] else _NO_HOME
    items = [_item(row, len(rows) - 1, problems) for row in rows[1:] if row]
    if len(rows) < 2:
        problems.append(Problem(name, "there are no items after home", "empty"))
    if problems:
        raise InputError(problems)
    return Mission(items=tuple(items), home=home)


def warnings(mission: Mission) -> tuple[Problem, ...]:
    """Return what this format cannot say as it is meant, as warnings."""
    found: list[Problem] = []
    turned = [
        index for index, item in enumerate(mission.items) if item.has_position and math.isnan(item.params[3])
    ]
    if turned and mission.autopilot != "ardupilot":
        message = "param4 NaN (nose along the track) is written as 0: PX4 will turn the nose north; a .plan keeps it"
        found.append(Problem(_which(turned), message, "nose-north", "warning"))
    stopped = [index for index, item in enumerate(mission.items) if not item.autocontinue]
    if stopped:
        message = "autocontinue off is written as on: PX4 will not wait there; a .plan keeps it"
        found.append(Problem(_which(stopped), message, "autocontinue", "warning"))
    for where, there in (("fence areas", mission.fence), ("rally points", mission.rally)):
        if there:
            message = f"{where} cannot stand in this format and are left out; a .plan keeps them"
            found.append(Problem("", message, "left-out", "warning"))
    return tuple(found)


def _which(indices: list[int]) -> str:
    return f"item {indices[0]}" if len(indices) == 1 else f"items {indices[0]} to {indices[-1]}"


def _line(sequence: int, item: MissionItem) -> str:
    params = [0.0 if math.isnan(value) else value for value in item.params]
    if item.command == Command.DO_JUMP:
        params[0] += 1  # targets are counted with home
    fields = [str(sequence), "1" if sequence == 0 else "0", str(int(item.frame)), str(int(item.command))]
    fields += [values.decimal_text(value) for value in params]
    fields += [values.degrees_text(item.lat_e7), values.degrees_text(item.lon_e7)]
    fields += [values.decimal_text(item.alt_m), "1"]
    return "\t".join(fields)


class _Row(NamedTuple):
    """One line of a file, numbers read, meaning not yet looked at."""

    where: str
    sequence: int
    frame: int
    command: int
    params: tuple[float, float, float, float]
    lat_deg: float
    lon_deg: float
    alt_m: float
    autocontinue: int


def _header_problem(header: str, name: str) -> Problem:
    where = f"{name}, line 1"
    if header.split()[:2] == ["QGC", "WPL"]:
        found = f'"{header.strip()[:40]}": only version 110 has a home line, write the file as "{HEADER}"'
        return Problem(where, found, "version")
    return Problem(
        where, f'found "{header.strip()[:40]}", a mission file begins with "{HEADER}"', "not-a-mission"
    )


def _row(line: str, where: str, problems: list[Problem]) -> _Row | None:
    fields = line.split()
    if len(fields) != len(FIELDS):
        problems.append(Problem(where, f"{len(fields)} fields; exactly {len(FIELDS)} are expected", "fields"))
        return None
    before = len(problems)
    whole = {k: _whole(fields[k], f"{where}, {FIELDS[k]}", problems) for k in (0, 1, 2, 3, 11)}
    number = [_number(fields[k], k < 8, f"{where}, {FIELDS[k]}", problems) for k in range(4, 11)]
    for k in (1, 11):
        if whole[k] not in (0, 1):
            problems.append(
                Problem(f"{where}, {FIELDS[k]}", f"found {fields[k]}, 0 or 1 is expected", "number")
            )
    if len(problems) > before:
        return None
    params = (number[0], number[1], number[2], number[3])
    return _Row(where, whole[0], whole[2], whole[3], params, number[4], number[5], number[6], whole[11])


def _whole(text: str, where: str, problems: list[Problem]) -> int:
    if _WHOLE.fullmatch(text):
        return int(text)
    problems.append(Problem(where, f"found {text[:40]}, a whole number is expected", "number"))
    return 0


def _number(text: str, may_be_nan: bool, where: str, problems: list[Problem]) -> float:
    if may_be_nan and text.lower() == "nan":
        return NAN
    if _NUMBER.fullmatch(text) and math.isfinite(float(text)):
        return float(text)
    problems.append(Problem(where, f"found {text[:40]}, a finite number is expected", "number"))
    return 0.0


def _sequence_problems(rows: list[_Row | None]) -> list[Problem]:
    """Return the gaps in the numbering, each once; beside a line that could not be read nothing is known."""
    problems: list[Problem] = []
    before: int | None = -1
    for row in rows:
        if row and before is not None and row.sequence != before + 1:
            found = f"found {row.sequence}, {before + 1} is expected here"
            problems.append(Problem(f"{row.where}, sequence", found, "sequence"))
        before = row.sequence if row else None
    return problems


def _home(row: _Row, problems: list[Problem]) -> HomePosition:
    # Mission Planner has written 0 as the command of home; all readers take it as the waypoint that it is.
    if row.command not in (0, Command.NAV_WAYPOINT) or row.frame not in (Frame.GLOBAL, Frame.GLOBAL_INT):
        found = f"command {row.command} in frame {row.frame}, home is expected here: command 16 in frame 0"
        problems.append(Problem(row.where, found, "home"))
    wrong = (
        values.lat_problem(row.lat_deg, f"{row.where}, latitude"),
        values.lon_problem(row.lon_deg, f"{row.where}, longitude"),
        values.home_alt_problem(row.alt_m, f"{row.where}, altitude"),
    )
    problems += [problem for problem in wrong if problem is not None]
    return HomePosition(values.to_e7(row.lat_deg), values.to_e7(row.lon_deg), row.alt_m)


def _item(row: _Row, count: int, problems: list[Problem]) -> MissionItem:
    params = row.params
    if row.command == Command.DO_JUMP:
        params = (params[0] - 1, *params[1:])
    item = MissionItem(
        command=row.command,
        frame=row.frame,
        params=params,
        lat_e7=values.to_e7(row.lat_deg),
        lon_e7=values.to_e7(row.lon_deg),
        alt_m=row.alt_m,
        autocontinue=row.autocontinue == 1,
    )
    wrong = [
        values.command_problem(row.command, f"{row.where}, command"),
        values.frame_problem(row.command, row.frame, f"{row.where}, frame"),
        *(values.param_problem(item, k, None, f"{row.where}, param{k}") for k in range(1, 5)),
        values.jump_problem(item, count, f"{row.where}, param1"),
    ]
    if item.has_position:
        wrong += [
            values.lat_problem(row.lat_deg, f"{row.where}, latitude"),
            values.lon_problem(row.lon_deg, f"{row.where}, longitude"),
            values.alt_problem(row.alt_m, f"{row.where}, altitude"),
        ]
    problems += [problem for problem in wrong if problem is not None]
    return item if wrong[0] or wrong[1] else values.normal_item(item)
