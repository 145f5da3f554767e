"""What both mission formats share: which items may stand in a file, and how numbers are written and read."""

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal

from mavplan.errors import Problem
from mavplan.mission.geofence import Fence, area_faults, rally_faults, rally_label
from mavplan.mission.model import (
    POSITION_COMMANDS,
    Autopilot,
    Command,
    Frame,
    HomePosition,
    Mission,
    MissionItem,
)

MAX_ITEMS = 65_534
"""MISSION_COUNT holds 16 bits, and home takes one place on the way to ArduPilot."""
MAX_HOLD_S = 65_535.0
"""ArduPilot keeps holds modulo 65,536."""
MAX_PARAM = 1e6
"""A param1 of 5e9 crashed a simulated ArduPilot; no parameter of ours comes near a million."""
MAX_ALT_M = 83_000.0
"""ArduPilot refuses more; far above anything a multirotor reaches."""
MAX_HOME_ALT_M = 9_000.0
"""Above the highest ground on Earth."""
NOWHERE_E7 = 2**31 - 1
"""Stands for degrees so large that they are no integer of 1e-7; a reader has told the problem."""

HOLD_COMMANDS = frozenset({Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME})
"""Commands whose param1 is a hold in seconds."""

FRAME_IN_FILE = {
    Frame.GLOBAL: Frame.GLOBAL,
    Frame.GLOBAL_INT: Frame.GLOBAL,
    Frame.GLOBAL_RELATIVE_ALT: Frame.GLOBAL_RELATIVE_ALT,
    Frame.GLOBAL_RELATIVE_ALT_INT: Frame.GLOBAL_RELATIVE_ALT,
    Frame.GLOBAL_TERRAIN_ALT: Frame.GLOBAL_TERRAIN_ALT,
    Frame.GLOBAL_TERRAIN_ALT_INT: Frame.GLOBAL_TERRAIN_ALT,
}
"""Frames of positions, and the one of each pair of equal meaning that ground stations use in files."""


def normal_item(item: MissionItem) -> MissionItem:
    """Return the item as `Mission` holds it: the file's frame of each pair; bare commands in MISSION with zeros."""
    if not item.has_position:
        return replace(item, frame=Frame.MISSION, lat_e7=0, lon_e7=0, alt_m=0.0)
    return replace(item, frame=FRAME_IN_FILE[Frame(item.frame)])


def command_problem(command: int, where: str) -> Problem | None:
    """Return what is wrong with a command: only those of `Command` may stand in a mission of ours."""
    if command in Command.__members__.values():
        return None
    known = ", ".join(f"{member.name} ({member.value})" for member in Command)
    return Problem(where, f"command {command} is not one that mavplan handles; it handles {known}", "command")


def frame_problem(command: int, frame: int, where: str) -> Problem | None:
    """Return what is wrong with an item's frame; bare commands may stand in any."""
    if command in POSITION_COMMANDS and frame not in FRAME_IN_FILE:
        allowed = "0 (above sea level), 3 (above home) or 10 (above terrain)"
        return Problem(where, f"frame {frame} is not one of a position: {allowed}", "frame")
    if command not in POSITION_COMMANDS and frame not in Frame.__members__.values():
        return Problem(where, f"frame {frame} is not known: 2 for a command without a position", "frame")
    return None


def param_problem(item: MissionItem, number: int, autopilot: Autopilot | None, where: str) -> Problem | None:
    """Return what is wrong with param1 to param4 (``number`` 1 to 4) of an item."""
    value = item.params[number - 1]
    if math.isnan(value):
        if autopilot == "ardupilot" and (
            (number == 1 and item.command in HOLD_COMMANDS) or item.command == Command.NAV_LOITER_TIME
        ):
            return Problem(where, "no value (NaN), which ArduPilot refuses here: give a number", "param")
        return None
    if not abs(value) <= MAX_PARAM:
        return Problem(where, f"{value:g} is out of range: -1e6 to 1e6", "param")
    if number == 1 and item.command in HOLD_COMMANDS and not 0 <= value <= MAX_HOLD_S:
        return Problem(where, f"a hold of {value:g} s is out of range: 0 to {MAX_HOLD_S:g} s", "hold")
    return None


def lat_problem(lat_deg: float, where: str) -> Problem | None:
    """Return what is wrong with a latitude in degrees."""
    if not -90 <= lat_deg <= 90:
        return Problem(where, f"latitude {lat_deg!r} is out of range: -90 to 90 degrees", "latitude")
    return None


def lon_problem(lon_deg: float, where: str) -> Problem | None:
    """Return what is wrong with a longitude in degrees."""
    if not -180 <= lon_deg <= 180:
        return Problem(where, f"longitude {lon_deg!r} is out of range: -180 to 180 degrees", "longitude")
    return None


def alt_problem(alt_m: float, where: str) -> Problem | None:
    """Return what is wrong with an altitude in metres."""
    if not abs(alt_m) < MAX_ALT_M:
        return Problem(where, f"altitude {alt_m!r} is out of range: less than {MAX_ALT_M:g} m", "altitude")
    return None


def home_alt_problem(alt_amsl_m: float, where: str) -> Problem | None:
    """Return what is wrong with the altitude of home above mean sea level in metres."""
    if not -500 <= alt_amsl_m <= MAX_HOME_ALT_M:
        allowed = f"-500 to {MAX_HOME_ALT_M:g} m above sea level"
        return Problem(where, f"home altitude {alt_amsl_m!r} is out of range: {allowed}", "altitude")
    return None


def mission_problems(mission: Mission) -> Iterator[Problem]:
    """Yield what keeps a mission from being written in any format; a mission that a reader gave has nothing."""
    yield from _home_problems(mission.home)
    yield from _list_problems(mission)
    if not mission.items:
        yield Problem("mission", "there are no items", "empty")
    if len(mission.items) > MAX_ITEMS:
        found = (
            f"{len(mission.items)} items are more than the {MAX_ITEMS} that MAVLink can carry: "
            "--hover hold makes one item of a stop, --vehicles and --sorties several missions"
        )
        yield Problem("mission", found, "too-many")
    for index, item in enumerate(mission.items):
        where = f"item {index}"
        wrong = [command_problem(item.command, where), frame_problem(item.command, item.frame, where)]
        wrong += [
            param_problem(item, number, mission.autopilot, f"{where}, param{number}")
            for number in range(1, 5)
        ]
        if item.has_position:
            wrong += [lat_problem(item.lat_deg, where), lon_problem(item.lon_deg, where)]
            wrong += [alt_problem(item.alt_m, where)]
        wrong += [jump_problem(item, len(mission.items), where)]
        wrong += [nowhere_problem(item, mission.autopilot, where)]
        yield from (problem for problem in wrong if problem is not None)


def _list_problems(mission: Mission) -> Iterator[Problem]:
    for label, area in (mission.fence or Fence()).labelled():
        yield from (Problem(label, message, code) for message, code in area_faults(area))
    for number, point in enumerate(mission.rally, start=1):
        label = rally_label(number, point)
        yield from (Problem(label, message, code) for message, code in rally_faults(point))
        wrong = alt_problem(point.alt_rel_m, label) if math.isfinite(point.alt_rel_m) else None
        if wrong is not None:
            yield wrong


def jump_problem(item: MissionItem, count: int, where: str) -> Problem | None:
    """Return what is wrong with the target of a DO_JUMP, an index from 0 over ``count`` items."""
    target = item.params[0]
    if item.command == Command.DO_JUMP and target not in range(count):
        return Problem(where, "DO_JUMP goes to an item that does not exist", "jump")
    return None


def nowhere_problem(item: MissionItem, autopilot: Autopilot | None, where: str) -> Problem | None:
    """Return a problem if PX4 would fly to latitude 0, longitude 0, where ArduPilot means "here"."""
    if autopilot == "px4" and item.has_position and item.lat_e7 == 0 and item.lon_e7 == 0:
        found = "latitude and longitude are both 0, and PX4 would fly there: give the place"
        return Problem(where, found, "position")
    return None


def _home_problems(home: HomePosition) -> Iterator[Problem]:
    wrong = (
        lat_problem(home.lat_e7 / 1e7, "home"),
        lon_problem(home.lon_e7 / 1e7, "home"),
        home_alt_problem(home.alt_amsl_m, "home"),
    )
    yield from (problem for problem in wrong if problem is not None)


def json_number(value: float) -> float | int | None:
    """Return a JSON number: null for NaN, whole numbers without a point."""
    if math.isnan(value):
        return None
    return int(value) if value == int(value) else value


def decimal_text(value: float) -> str:
    """Return a number as the shortest decimal that reads back the same, without exponent, whole ones bare."""
    text = format(Decimal(repr(float(value))), "f")
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def degrees_text(e7: int) -> str:
    """Return 1e-7 degrees as degrees with seven decimals, exactly."""
    whole, part = divmod(abs(e7), 10_000_000)
    return f"{'-' if e7 < 0 else ''}{whole}.{part:07d}"


def to_e7(degrees: float) -> int:
    """Return degrees as the nearest integer of 1e-7 degrees; cutting off would lose up to 1.1 cm."""
    scaled = degrees * 1e7
    return round(scaled) if math.isfinite(scaled) else NOWHERE_E7
