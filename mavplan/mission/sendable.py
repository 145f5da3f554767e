"""What a firmware would silently change or choke on, found before a byte is sent: `wire_problems`.

Each limit is measured behaviour of ArduCopter 4.7.0-dev or PX4 of August 2025, unless a comment says otherwise.
"""

import math
from collections.abc import Iterator

from mavplan.errors import InputError, Problem
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Command, Frame, ListCommand, Mission, MissionItem

UNUSED_PARAMS: dict[int, frozenset[int]] = {
    Command.NAV_WAYPOINT: frozenset(),
    Command.NAV_LOITER_UNLIM: frozenset({1, 2}),
    Command.NAV_LOITER_TIME: frozenset(),
    Command.NAV_RETURN_TO_LAUNCH: frozenset({1, 2, 3, 4}),
    Command.NAV_LAND: frozenset({3}),
    Command.NAV_TAKEOFF: frozenset({2, 3}),
    Command.NAV_DELAY: frozenset(),
    Command.DO_JUMP: frozenset({3, 4}),
    Command.DO_CHANGE_SPEED: frozenset({4}),
}
"""Parameters (1 to 4) that MAVLink leaves empty for a multirotor: a NaN there means nothing and is sent as 0."""

WHOLE_ON_ARDUPILOT: dict[int, dict[int, tuple[int, int]]] = {
    Command.NAV_LOITER_UNLIM: {3: (-65_535, 65_535)},
    Command.NAV_LAND: {1: (0, 65_535)},
    Command.NAV_TAKEOFF: {1: (0, 65_535)},
    Command.NAV_DELAY: {2: (-128, 127), 3: (-128, 127), 4: (-128, 127)},
    Command.DO_CHANGE_SPEED: {1: (0, 255)},
}
"""Parameters that ArduPilot keeps as small integers, by AP_Mission's layout of a stored item, and their ranges."""

HOLD_COMMANDS = frozenset({Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME})
POSITION_FRAMES = frozenset(
    {Frame.GLOBAL, Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_INT, Frame.GLOBAL_RELATIVE_ALT_INT}
)
RELATIVE_FRAMES = frozenset({Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT})
TERRAIN_FRAMES = frozenset({Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT})
BEFORE_TAKEOFF = frozenset({Command.DO_CHANGE_SPEED})

MAX_LAT_E7 = 900_000_000
MAX_LON_E7 = 1_800_000_000
MAX_COUNT = 65_535
"""MISSION_COUNT.count is a uint16."""
MAX_ARDUPILOT_ALT_M = 83_000.0
MAX_ARDUPILOT_PARAM = 65_535.0
"""Kept as uint16 or smaller in several commands; a far larger number has stopped the simulator."""
MAX_HEADING_DEG = 360.0
MAX_PARAM = 1e9
"""Far beyond anything meant, far below the end of float32."""


def wire_problems(mission: Mission, rules: AutopilotRules) -> list[Problem]:
    """Find everything in a mission that this firmware would change without a word, refuse or fly wrongly.

    Parameters
    ----------
    mission
        Any mission, also one read from a stranger's file.
    rules
        The firmware it is meant for.

    Returns
    -------
    list of Problem
        Empty if the mission can be sent. ``where`` names the item by its number on the wire.
    """
    problems = list(_home_problems(mission))
    if not mission.items:
        return [*problems, Problem("mission", "has no items: there is nothing to upload", "empty")]
    count = len(mission.items) + int(rules.home_on_wire)
    if count > MAX_COUNT:
        problems.append(Problem("mission", f"has {count} items; MAVLink can number {MAX_COUNT}", "too-many"))
    problems += _takeoff_problems(mission, rules)
    for index, item in enumerate(mission.items):
        where = item_name(item, index, rules)
        problems += (Problem(where, message, code) for message, code in _item_problems(item, mission, rules))
    return problems


def check_sendable(mission: Mission, rules: AutopilotRules, source: str = "") -> None:
    """Raise what `wire_problems` finds.

    Parameters
    ----------
    mission, rules
        As there.
    source
        The file that the mission is from, named in front of every problem.

    Raises
    ------
    InputError
        All problems at once.
    """
    if problems := wire_problems(mission, rules):
        at = f"{source}, " if source else ""
        raise InputError(
            Problem(f"{at}{problem.where}", problem.message, problem.code) for problem in problems
        )


def item_name(item: MissionItem, index: int, rules: AutopilotRules) -> str:
    """Return for instance ``item 3 (NAV_LOITER_TIME)``, numbered as on the wire."""
    return f"item {index + int(rules.home_on_wire)} ({command_name(item.command)})"


def command_name(command: int) -> str:
    """Return the MAV_CMD's name without its prefix, or ``command 112``."""
    for known in (Command, ListCommand):
        if command in known.__members__.values():
            return known(command).name
    return f"command {command}"


def _home_problems(mission: Mission) -> Iterator[Problem]:
    home = mission.home
    for message, code in _place_problems(home.lat_e7, home.lon_e7):
        yield Problem("home", message, code)
    if not math.isfinite(home.alt_amsl_m) or abs(home.alt_amsl_m) >= MAX_ARDUPILOT_ALT_M:
        yield Problem("home", f"altitude {home.alt_amsl_m} m is none", "altitude")


def _takeoff_problems(mission: Mission, rules: AutopilotRules) -> Iterator[Problem]:
    first = next((i for i, item in enumerate(mission.items) if item.command not in BEFORE_TAKEOFF), None)
    if first is None or mission.items[first].command != Command.NAV_TAKEOFF:
        where = item_name(mission.items[first or 0], first or 0, rules)
        yield Problem(
            where,
            f"comes first where NAV_TAKEOFF must: {rules.title} does not fly a mission from the ground without it",
            "takeoff-first",
        )
    for index, item in enumerate(mission.items):
        if item.command != Command.NAV_TAKEOFF:
            continue
        ground_m = 0.0 if item.frame in RELATIVE_FRAMES else mission.home.alt_amsl_m
        if item.frame in POSITION_FRAMES and item.alt_m <= ground_m:
            yield Problem(
                item_name(item, index, rules),
                f"climbs to {item.alt_m:g} m, which is not above the ground at {ground_m:g} m",
                "takeoff-altitude",
            )


def _item_problems(item: MissionItem, mission: Mission, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    if item.command not in UNUSED_PARAMS:
        known = ", ".join(command.name for command in Command)
        yield f"is not a command of mavplan's missions ({known})", "command"
        return
    if item.has_position:
        yield from _position_problems(item, rules)
    elif item.lat_e7 or item.lon_e7 or item.alt_m:
        yield "brings a position, which this command has not: it would be dropped", "position-dropped"
    yield from _param_problems(item, rules)
    if item.command in HOLD_COMMANDS:
        yield from _hold_problems(item, rules)
    if item.command == Command.DO_JUMP:
        yield from _jump_problems(item, mission)


def _position_problems(item: MissionItem, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    if item.frame in TERRAIN_FRAMES:
        yield "is in a terrain frame: without terrain data on the vehicle it cannot be armed", "terrain-frame"
    elif item.frame not in POSITION_FRAMES:
        yield (
            f"is in frame {item.frame}; positions go in frame 0 (above sea level) or 3 (above home)",
            "frame",
        )
    yield from _place_problems(item.lat_e7, item.lon_e7)
    # ArduPilot takes 0, 0 for "here" where it climbs and where it lands; elsewhere, and on PX4, it is flown to or
    # silently replaced.
    here_is_meant = rules.name == "ardupilot" and item.command in {Command.NAV_TAKEOFF, Command.NAV_LAND}
    if item.lat_e7 == 0 and item.lon_e7 == 0 and not here_is_meant:
        yield f"is at latitude 0, longitude 0: {rules.title} would take that for a place", "at-zero"
    if not math.isfinite(item.alt_m):
        yield f"has the altitude {item.alt_m}", "altitude"
    elif abs(item.alt_m) >= MAX_ARDUPILOT_ALT_M:
        yield f"has the altitude {item.alt_m:g} m; below {MAX_ARDUPILOT_ALT_M:g} m is allowed", "altitude"


def _place_problems(lat_e7: int, lon_e7: int) -> Iterator[tuple[str, str]]:
    if abs(lat_e7) > MAX_LAT_E7:
        yield f"has the latitude {lat_e7 / 1e7:g}; -90 to 90 is allowed", "latitude"
    if abs(lon_e7) > MAX_LON_E7:
        yield f"has the longitude {lon_e7 / 1e7:g}; -180 to 180 is allowed", "longitude"


def _param_problems(item: MissionItem, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    limit = MAX_ARDUPILOT_PARAM if rules.name == "ardupilot" else MAX_PARAM
    for number, value in enumerate(item.params, start=1):
        if number == 1 and item.command in HOLD_COMMANDS:
            continue
        if math.isnan(value):
            yield from _nan_problems(item, number, rules)
        elif abs(value) > limit:
            yield f"has param{number} = {value:g}; at most {limit:g} is allowed", "param-range"
        elif number == 4 and item.has_position and abs(value) > MAX_HEADING_DEG:
            yield f"has param4 = {value:g}; a heading is -360 to 360", "heading"
        elif rules.name == "ardupilot" and (kept := WHOLE_ON_ARDUPILOT.get(item.command, {}).get(number)):
            low, high = kept
            if value != int(value) or not low <= value <= high:
                yield (
                    f"has param{number} = {value:g}; ArduPilot keeps whole numbers {low} to {high}",
                    "param-whole",
                )


def _nan_problems(item: MissionItem, number: int, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    # "No heading wanted": both firmwares take it as param4 of a position, but ArduPilot not in LOITER_TIME.
    heading = number == 4 and item.has_position
    refused = rules.name == "ardupilot" and item.command == Command.NAV_LOITER_TIME
    if number in UNUSED_PARAMS[item.command] or (heading and not refused):
        return
    yield f"has NaN in param{number}: {rules.title} needs a number there", "nan"


def _hold_problems(item: MissionItem, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    hold_s = item.params[0]
    passing = item.command == Command.NAV_WAYPOINT and hold_s == 0
    if passing:
        return
    if math.isnan(hold_s):
        yield f"has a hold of NaN: {rules.title} does not stop for that, or refuses it", "hold-nan"
    elif not rules.min_hold_s <= hold_s <= rules.max_hold_s:
        yield (
            f"has a hold of {hold_s:g} s; {rules.title} keeps {rules.min_hold_s:g} to {rules.max_hold_s:g} s",
            "hold-range",
        )
    elif rules.hold_step_s >= 1 and hold_s % rules.hold_step_s:
        yield (
            f"has a hold of {hold_s:g} s; {rules.title} would cut it to {math.floor(hold_s)} s: round it up",
            "hold-fraction",
        )


def _jump_problems(item: MissionItem, mission: Mission) -> Iterator[tuple[str, str]]:
    target, repeats = item.params[:2]
    if not (target == int(target) and 0 <= target < len(mission.items) if math.isfinite(target) else False):
        yield (
            f"jumps to item {target:g} of {len(mission.items)} (counted from 0), which is none",
            "jump-target",
        )
    if math.isfinite(repeats) and (repeats != int(repeats) or not -1 <= repeats <= 32_767):
        yield f"repeats {repeats:g} times; -1 (for ever) to 32767, whole, is allowed", "jump-repeats"
