"""A plan's stops and holds become a `Mission` that one autopilot flies as meant. No files, no link."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from mavplan.errors import InputError, Problem
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem

End = Literal["rtl", "land", "stay"]
Hover = Literal["loiter", "hold", "waypoint+loiter"]
ENDS: tuple[End, ...] = ("rtl", "land", "stay")
HOVERS: tuple[Hover, ...] = ("waypoint+loiter", "loiter", "hold")

USUAL_HEIGHT_LIMIT_M = 120.0
"""Height above ground that rules for open operations allow in many countries (EU 2019/947, UAS.OPEN.010)."""


@dataclass(frozen=True, slots=True)
class StopItems:
    """Where one stop stands among the items of a mission, counted from 0 without home.

    Attributes
    ----------
    first
        The item that flies there.
    hold
        The item that holds; the same one where a stop is a single item.
    """

    first: int
    hold: int


@dataclass(frozen=True, slots=True)
class Heights:
    """Altitudes above home where they are not all the same: over real ground.

    Attributes
    ----------
    points_m
        Of each stop or turning point.
    back_m
        Of each place where the way back turns.
    above_home_m
        Where the way back ends and the landing begins.
    land_m
        Of the ground at the last stop.
    """

    points_m: Sequence[float]
    back_m: Sequence[float]
    above_home_m: float
    land_m: float


@dataclass(frozen=True, slots=True)
class BuiltMission:
    """A mission, its stops among its items in flying order, and what the user should know about it."""

    mission: Mission
    stop_items: tuple[StopItems, ...]
    warnings: tuple[Problem, ...]

    @property
    def stop_names(self) -> dict[int, str]:
        """``stop 3`` by the index of each item of a stop that messages may name."""
        numbered = list(enumerate(self.stop_items, start=1))
        return {item: f"stop {number}" for number, stop in numbered for item in (stop.first, stop.hold)}


def build_mission(
    *,
    home: HomePosition,
    stops_e7: Sequence[tuple[int, int]],
    holds_s: Sequence[float | None],
    rules: AutopilotRules,
    altitude_m: float,
    speed_m_s: float,
    end: End = "rtl",
    hover: Hover = "waypoint+loiter",
    back_e7: Sequence[tuple[int, int]] | None = None,
    heights: Heights | None = None,
) -> BuiltMission:
    """Return the mission that visits the stops in their order and holds at each.

    The speed item stands where it acts on the first leg and takes no MISSION_ITEM_REACHED from a stop: the item before
    it gets none of its own. Before TAKEOFF on ArduPilot; after it on PX4, which wants TAKEOFF first, so that there
    the speed item's number also says that take-off is done. On PX4 the last hold before a return to launch is told by
    the number of the return.

    Parameters
    ----------
    home
        Where it takes off.
    stops_e7
        Latitude and longitude of each stop or turning point, 1e-7 degrees, in flying order.
    holds_s
        Seconds at each stop, in steps that the autopilot stores; None: a point that is only turned at, no stop.
    rules
        The autopilot.
    altitude_m
        Of all stops, above home; with ``heights`` of the take-off.
    speed_m_s
        Between stops.
    end
        ``rtl`` returns and lands at home, ``land`` lands at the last stop, ``stay`` hovers there until the battery
        failsafe.
    hover
        What a stop is made of: a waypoint and a timed loiter, the loiter alone, or a waypoint with a hold.
    back_e7
        Where the way back turns, for a vehicle that must not fly straight: with ``rtl`` it flies along these places to
        above home and lands there, for a return to launch is straight. None: it may.
    heights
        Altitudes where they are not all the same.

    Returns
    -------
    BuiltMission

    Raises
    ------
    InputError
        Something is out of range; all problems at once.
    """
    problems = tuple(_problems(home, stops_e7, holds_s, rules, altitude_m, speed_m_s, end, hover))
    if problems:
        raise InputError(problems)
    if heights is None:
        heights = Heights([altitude_m] * len(stops_e7), [altitude_m] * len(back_e7 or ()), altitude_m, 0.0)
    take_off = _position(Command.NAV_TAKEOFF, 0.0, rules, (home.lat_e7, home.lon_e7), altitude_m)
    speed = MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (1.0, float(speed_m_s), -1.0, 0.0))
    items = [take_off, speed] if rules.name == "px4" else [speed, take_off]
    stop_items = []
    for place, alt_m, hold_s in zip(stops_e7, heights.points_m, holds_s, strict=True):
        if hold_s is None:
            items.append(_position(Command.NAV_WAYPOINT, 0.0, rules, place, alt_m))
            continue
        stop = _stop(hover, _stored(hold_s, rules), rules, place, alt_m)
        stop_items.append(StopItems(len(items), len(items) + len(stop) - 1))
        items += stop
    if end == "rtl" and back_e7 is not None:
        items += _way_home(back_e7, home, rules, heights)
    else:
        items.append(_end(end, rules, stops_e7[-1], heights))
    mission = Mission(
        items=tuple(items),
        home=home,
        autopilot=rules.name,
        cruise_speed_m_s=float(speed_m_s),
        hover_speed_m_s=float(speed_m_s),
    )
    warnings = (
        *_warnings(home, stops_e7[0], rules, altitude_m, speed_m_s, end),
        *_capacity(len(items) + rules.home_on_wire, rules),
    )
    return BuiltMission(mission, tuple(stop_items), warnings)


def _position(
    command: Command, param1: float, rules: AutopilotRules, place: tuple[int, int], alt_m: float
) -> MissionItem:
    # param4 is the heading: on PX4 NaN leaves the nose along the track, ArduPilot refuses NaN in a timed loiter.
    params = (param1, 0.0, 0.0, rules.loiter_param4)
    lat_e7, lon_e7 = int(place[0]), int(place[1])
    return MissionItem(command, Frame.GLOBAL_RELATIVE_ALT, params, lat_e7, lon_e7, float(alt_m))


def _stop(
    hover: Hover, hold_s: float, rules: AutopilotRules, place: tuple[int, int], alt_m: float
) -> list[MissionItem]:
    if hover == "hold":
        return [_position(Command.NAV_WAYPOINT, hold_s, rules, place, alt_m)]
    loiter = _position(Command.NAV_LOITER_TIME, hold_s, rules, place, alt_m)
    if hover == "loiter":
        return [loiter]
    return [_position(Command.NAV_WAYPOINT, 0.0, rules, place, alt_m), loiter]


def _end(end: End, rules: AutopilotRules, place: tuple[int, int], heights: Heights) -> MissionItem:
    match end:
        case "land":
            return _position(Command.NAV_LAND, 0.0, rules, place, heights.land_m)
        case "stay":
            return _position(Command.NAV_LOITER_UNLIM, 0.0, rules, place, heights.points_m[-1])
    return MissionItem(Command.NAV_RETURN_TO_LAUNCH, Frame.MISSION)


def _way_home(
    back_e7: Sequence[tuple[int, int]], home: HomePosition, rules: AutopilotRules, heights: Heights
) -> list[MissionItem]:
    above_home = (home.lat_e7, home.lon_e7)
    turns = zip((*back_e7, above_home), (*heights.back_m, heights.above_home_m), strict=True)
    way = [_position(Command.NAV_WAYPOINT, 0.0, rules, place, alt_m) for place, alt_m in turns]
    return [*way, _position(Command.NAV_LAND, 0.0, rules, above_home, 0.0)]


def _steps(hold_s: float, rules: AutopilotRules) -> int:
    return round(hold_s / rules.hold_step_s)


def _stored(hold_s: float, rules: AutopilotRules) -> float:
    """Return the hold without the dust of binary fractions (0.3, not 0.30000000000000004)."""
    return round(_steps(hold_s, rules) * rules.hold_step_s, 6)


def _problems(
    home: HomePosition,
    stops_e7: Sequence[tuple[int, int]],
    holds_s: Sequence[float | None],
    rules: AutopilotRules,
    altitude_m: float,
    speed_m_s: float,
    end: str,
    hover: str,
) -> Iterator[Problem]:
    if not stops_e7:
        yield Problem("mission", "there are no stops", "empty")
    if len(stops_e7) != len(holds_s):
        yield Problem("mission", f"{len(stops_e7)} stops and {len(holds_s)} holds", "count")
    for name, place in (
        ("home", (home.lat_e7, home.lon_e7)),
        *((f"point {n}", s) for n, s in enumerate(stops_e7, start=1)),
    ):
        if abs(place[0]) > 900_000_000 or abs(place[1]) > 1_800_000_000:
            yield Problem(name, f"{place[0] / 1e7}, {place[1] / 1e7} is no place on Earth", "position")
    if not math.isfinite(home.alt_amsl_m):
        yield Problem("home", f"altitude {home.alt_amsl_m} is not a number of metres", "altitude")
    given = (hold_s for hold_s in holds_s if hold_s is not None)
    for number, hold_s in enumerate(given, start=1):
        if not rules.min_hold_s <= hold_s <= rules.max_hold_s:
            allowed = f"{rules.title} stores {rules.min_hold_s:g} to {rules.max_hold_s:g} s"
            yield Problem(f"stop {number}", f"a hold of {hold_s:g} s is out of range: {allowed}", "hold")
        elif abs(hold_s - _steps(hold_s, rules) * rules.hold_step_s) > 1e-6:
            step = f"{rules.title} stores steps of {rules.hold_step_s:g} s"
            yield Problem(f"stop {number}", f"a hold of {hold_s!r} s would be cut off: {step}", "hold")
    if not (0 < altitude_m <= 10_000):
        yield Problem("altitude_m", f"{altitude_m:g} m is out of range: above 0, up to 10000 m", "altitude")
    if not (0 < speed_m_s <= 50):
        yield Problem("speed_m_s", f"{speed_m_s:g} m/s is out of range: above 0, up to 50 m/s", "speed")
    if end not in ENDS:
        yield Problem("end", f'"{end}" is not one of {", ".join(ENDS)}', "choice")
    if hover not in HOVERS:
        yield Problem("hover", f'"{hover}" is not one of {", ".join(HOVERS)}', "choice")


def _capacity(count: int, rules: AutopilotRules) -> Iterator[Problem]:
    """Yield a warning where a mission is longer than what this autopilot was seen to take."""
    if count > rules.measured_items:
        found = (
            f"{count:,} items, and {rules.title} took {rules.measured_items:,} at most when tried: the vehicle "
            "may refuse them; --hover hold makes one item of a stop, --vehicles and --sorties several missions"
        )
        yield Problem("mission", found, "many-items", "warning")


def _warnings(
    home: HomePosition,
    first_e7: tuple[int, int],
    rules: AutopilotRules,
    altitude_m: float,
    speed_m_s: float,
    end: End,
) -> Iterator[Problem]:
    if altitude_m > USUAL_HEIGHT_LIMIT_M:
        found = f"{altitude_m:g} m is more than {USUAL_HEIGHT_LIMIT_M:g} m above home: many countries ask for a permit"
        yield Problem("altitude_m", found, "height-limit", "warning")
    if speed_m_s > rules.default_speed_limit_m_s:
        limit = f"{rules.title} flies about {rules.default_speed_limit_m_s:g} m/s with its default parameters"
        found = f"{speed_m_s:g} m/s is asked, {limit}, and so does the forecast"
        yield Problem("speed_m_s", found, "speed-limit", "warning")
    if end == "land":
        yield Problem("end", "the vehicle lands at the last stop, whatever is there", "end-land", "warning")
    if end == "stay":
        found = "the vehicle hovers at the last stop until its battery failsafe acts or somebody takes over"
        yield Problem("end", found, "end-stay", "warning")
    if math.isfinite(rules.max_first_leg_m):
        from mavplan.geo import geodesic_distance_m

        lat_deg, lon_deg = first_e7[0] / 1e7, first_e7[1] / 1e7
        away_m = float(geodesic_distance_m(home.lat_e7 / 1e7, home.lon_e7 / 1e7, lat_deg, lon_deg))
        if away_m > rules.max_first_leg_m:
            limit = f"{rules.title} objects beyond {rules.max_first_leg_m / 1000:g} km"
            found = f"it lies {away_m / 1000:.1f} km from home, {limit}"
            yield Problem("stop 1", found, "first-stop-far", "warning")
