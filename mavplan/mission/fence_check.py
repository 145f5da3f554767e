"""Whether a mission keeps to a fence: every place, every leg, and the way back. Pure.

Nothing is moved: what would breach the fence is said, with the stop or leg and the area.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.errors import Problem
from mavplan.geo import Floats, LocalPlane, geodesic_distance_m
from mavplan.mission.fence_geometry import PlaneArea, plane_areas
from mavplan.mission.geofence import Fence, RallyPoint, rally_label
from mavplan.mission.model import NAN, Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.sendable import RELATIVE_FRAMES, command_name

DEFAULT_MARGIN_M = 3.0
"""Vehicles were measured up to 1.5 m beyond a stop and 0.7 m off it in a hold; twice that."""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A place that is flown to; altitude above home, NaN where only the terrain would tell."""

    name: str
    lat_e7: int
    lon_e7: int
    alt_rel_m: float


@dataclass(frozen=True, slots=True)
class Leg:
    """From one place to the next. ``returning``: a return to launch flies it, at its own height."""

    start: Waypoint
    end: Waypoint
    returning: bool = False

    @property
    def name(self) -> str:
        """``leg from stop 2 to stop 3``, or ``return from stop 3 to home``."""
        return f"{'return' if self.returning else 'leg'} from {self.start.name} to {self.end.name}"


def flown_legs(mission: Mission, names: Mapping[int, str] | None = None) -> list[Leg]:
    """Return every leg that a mission may fly, jumps followed, each once.

    A return to launch ends at home, or at a rally point that is nearer: both ways are returned then.

    Parameters
    ----------
    mission
        With its home; the first leg begins there.
    names
        What to call the place of an item, by its index; else for instance ``item 3 (NAV_WAYPOINT)``.
    """
    known = names or {}
    home = _home(mission.home)
    legs: dict[Leg, None] = {}
    seen: set[tuple[Waypoint, int]] = set()
    todo = [(home, 0)]
    while todo:
        at, index = todo.pop()
        if (at, index) in seen or index >= len(mission.items):
            continue
        seen.add((at, index))
        item = mission.items[index]
        if item.command == Command.DO_JUMP and item.params[0] in range(len(mission.items)):
            todo.append((at, int(item.params[0])))
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            legs.update(dict.fromkeys(Leg(at, end, returning=True) for end in return_places(mission, at)))
            at = home
        elif item.has_position and not _is_here(item, mission):
            name = known.get(index, f"item {index + 1} ({command_name(item.command)})")
            there = Waypoint(name, item.lat_e7, item.lon_e7, _alt_rel_m(item, mission.home))
            legs[Leg(at, there)] = None
            at = there
        todo.append((at, index + 1))
    return list(legs)


def return_places(mission: Mission, at: Waypoint) -> list[Waypoint]:
    """Return where a return to launch from a place may end: home, and the nearest rally point if it is nearer.

    Both autopilots take the nearer one; ArduPilot a rally point only within RALLY_LIMIT_KM, 300 m by default.
    """
    home = _home(mission.home)
    if not mission.rally:
        return [home]
    away_m = [_apart_m(at, point.lat_e7, point.lon_e7) for point in mission.rally]
    nearest = min(range(len(away_m)), key=away_m.__getitem__)
    if away_m[nearest] >= _apart_m(at, home.lat_e7, home.lon_e7):
        return [home]
    return [home, _rally(nearest + 1, mission.rally[nearest])]


def mission_breaches(
    mission: Mission,
    *,
    fence: Fence | None = None,
    margin_m: float = DEFAULT_MARGIN_M,
    names: Mapping[int, str] | None = None,
) -> list[Problem]:
    """Return where a mission would leave a fence, or come nearer to its border than the margin.

    Parameters
    ----------
    mission
        What is flown; its rally points are looked at too.
    fence
        The fence; None takes the mission's own.
    margin_m
        Distance to keep. Of a circle 0.7 % of the radius is kept on top, for autopilots measure it on a sphere.
    names
        As for `flown_legs`.

    Returns
    -------
    list of Problem
        Codes ``fence-breach`` and ``fence-margin``; empty where there is no fence.
    """
    fence = fence if fence is not None else mission.fence
    if not fence:
        return []
    plane = LocalPlane(mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7)
    areas = plane_areas(fence, plane)
    legs = flown_legs(mission, names)
    rally = [_rally(number, point) for number, point in enumerate(mission.rally, start=1)]
    ends = itertools.chain.from_iterable((leg.start, leg.end) for leg in legs)
    places: dict[tuple[int, int], Waypoint] = {}
    for place in (_home(mission.home), *ends, *rally):
        places.setdefault((place.lat_e7, place.lon_e7), place)
    flown: dict[tuple[tuple[int, int], tuple[int, int]], Leg] = {}
    for leg in legs:
        flown.setdefault(((leg.start.lat_e7, leg.start.lon_e7), (leg.end.lat_e7, leg.end.lon_e7)), leg)
    moved = [leg for (start, end), leg in flown.items() if start != end]
    return [
        *_place_breaches(list(places.values()), areas, plane, margin_m),
        *_leg_breaches(moved, areas, plane, margin_m),
    ]


def place_breaches(
    places: Sequence[tuple[str, tuple[int, int]]],
    areas: Sequence[PlaneArea],
    plane: LocalPlane,
    margin_m: float,
) -> list[Problem]:
    """Return what is wrong with places (name, 1e-7 degrees), as `mission_breaches` would say it."""
    found = [Waypoint(name, *place_e7, 0.0) for name, place_e7 in places]
    return list(_place_breaches(found, areas, plane, margin_m))


def _place_breaches(
    places: Sequence[Waypoint], areas: Sequence[PlaneArea], plane: LocalPlane, margin_m: float
) -> Iterator[Problem]:
    at_m = _xy_m(places, plane)
    for place, clear in zip(places, _clearances_m(areas, at_m, at_m), strict=True):
        for area, clear_m in zip(areas, clear, strict=True):
            if math.isnan(clear_m):
                yield Problem(
                    place.name, f"is no place that {area.label} can be held against", "fence-breach"
                )
            elif clear_m <= 0:
                side = "outside" if area.inclusion else "inside"
                yield Problem(place.name, f"lies {-clear_m:,.1f} m {side} {area.label}", "fence-breach")
            elif clear_m < margin_m + area.slack_m:
                yield Problem(place.name, f"lies {_near(clear_m, area, margin_m)}", "fence-margin")


def _leg_breaches(
    legs: Sequence[Leg], areas: Sequence[PlaneArea], plane: LocalPlane, margin_m: float
) -> Iterator[Problem]:
    starts_m, ends_m = _xy_m([leg.start for leg in legs], plane), _xy_m([leg.end for leg in legs], plane)
    of_legs = _clearances_m(areas, starts_m, ends_m)
    of_ends = zip(_clearances_m(areas, starts_m, starts_m), _clearances_m(areas, ends_m, ends_m), strict=True)
    for leg, clear, (at_start, at_end) in zip(legs, of_legs, of_ends, strict=True):
        for area, clear_m, *ends in zip(areas, clear, at_start, at_end, strict=True):
            if not min(ends) > 0:
                continue  # a leg from or to a place that is wrong itself says nothing new about that area
            if clear_m <= 0:
                verb = "leaves" if area.inclusion else "crosses"
                yield Problem(leg.name, f"{verb} {area.label}", "fence-breach")
            elif clear_m < margin_m + area.slack_m <= min(ends):
                yield Problem(leg.name, f"comes {_near(clear_m, area, margin_m)}", "fence-margin")


def _xy_m(places: Sequence[Waypoint], plane: LocalPlane) -> Floats:
    return plane.to_xy_m([place.lat_e7 / 1e7 for place in places], [place.lon_e7 / 1e7 for place in places])


def _clearances_m(areas: Sequence[PlaneArea], starts_m: Floats, ends_m: Floats) -> list[list[float]]:
    """Return for each leg its clearance from each area."""
    with np.errstate(invalid="ignore"):  # latitude 91 has no place in the plane, and its clearance is NaN
        by_area = [area.clearance_m(starts_m, ends_m).tolist() for area in areas]
    return [list(of_leg) for of_leg in zip(*by_area, strict=True)]


def _near(clear_m: float, area: PlaneArea, margin_m: float) -> str:
    kept = f"{margin_m + area.slack_m:,.1f} m are to be kept"
    return f"within {clear_m:,.1f} m of the border of {area.label}; {kept}"


def _home(home: HomePosition) -> Waypoint:
    return Waypoint("home", home.lat_e7, home.lon_e7, 0.0)


def _rally(number: int, point: RallyPoint) -> Waypoint:
    return Waypoint(rally_label(number, point), point.lat_e7, point.lon_e7, point.alt_rel_m)


def _is_here(item: MissionItem, mission: Mission) -> bool:
    """Whether ArduPilot takes latitude 0, longitude 0 for the place where the vehicle is."""
    nowhere = item.lat_e7 == 0 and item.lon_e7 == 0
    return nowhere and mission.autopilot != "px4" and item.command in {Command.NAV_TAKEOFF, Command.NAV_LAND}


def _alt_rel_m(item: MissionItem, home: HomePosition) -> float:
    if math.isfinite(item.alt_m) and item.frame in RELATIVE_FRAMES:
        return item.alt_m
    if math.isfinite(item.alt_m) and item.frame in {Frame.GLOBAL, Frame.GLOBAL_INT}:
        return item.alt_m - home.alt_amsl_m
    return NAN  # always this one: another NaN would make the same place another key


def _apart_m(at: Waypoint, lat_e7: int, lon_e7: int) -> float:
    return float(geodesic_distance_m(at.lat_e7 / 1e7, at.lon_e7 / 1e7, lat_e7 / 1e7, lon_e7 / 1e7))
