"""A mission held against the ground: what every leg keeps, how high it is flown, what a failsafe's return would hit."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.geo import Floats, LocalPlane
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.build import USUAL_HEIGHT_LIMIT_M, BuiltMission
from mavplan.mission.fence_check import Leg, flown_legs
from mavplan.mission.flight_law import LAWS
from mavplan.mission.model import Mission
from mavplan.mission.sendable import command_name
from mavplan.scenario.model import Scenario
from mavplan.terrain.altitudes import least_clearance_m
from mavplan.terrain.grid import Ground, Terrain

ROUNDING_M = 0.05
"""Places in 1e-7 degrees and altitudes in centimetres may cost so much."""

FAILSAFE_M = 10.0
"""Nearer to the ground than this a straight return is as good as into it: terrain data are no better."""

DRAWN_FROM_M, DRAWN_PARTS = 1.0, 60
"""Of a leg at least so long the ground is drawn, in at most so many parts."""

PX4_RETURN_M = 60.0
"""RTL_RETURN_ALT; near home PX4 returns lower (RTL_CONE_ANG)."""


@dataclass(frozen=True, eq=False)
class OverLeg:
    """A leg over the ground, altitudes of its ends above sea level."""

    leg: Leg
    ground: Ground
    start_alt_m: float
    end_alt_m: float

    @property
    def least_m(self) -> float:
        """What it keeps above the ground at least."""
        return least_clearance_m(self.ground, self.start_alt_m, self.end_alt_m)[0]

    @property
    def most_m(self) -> float:
        """How high above the ground it is flown at most, where it passes middles of cells."""
        at, ground_m = self.ground.at[::2], self.ground.top_m[::2]
        return float((self.start_alt_m + at * (self.end_alt_m - self.start_alt_m) - ground_m).max())


def held_against_ground(
    built: BuiltMission, scenario: Scenario, terrain: Terrain, rules: AutopilotRules
) -> BuiltMission:
    """Return a mission with what is to be known of it over the ground.

    Raises
    ------
    InputError
        Every leg that comes too near to the ground, and every item above the fence's height.
    """
    legs = legs_over(built.mission, terrain, built.stop_names)
    problems = [
        *clearance_faults(legs, scenario.terrain_options.clearance_m),
        *_fence_faults(built, scenario.fence_options.max_alt_rel_m),
    ]
    if problems:
        raise InputError(problems)
    noticed = (*height_warnings(built, legs, rules), *straight_return_warnings(built, terrain, rules))
    return replace(built, warnings=(*built.warnings, *noticed))


def _fence_faults(built: BuiltMission, limit_m: float | None) -> Iterator[Problem]:
    for index, item in enumerate(built.mission.items):
        if limit_m is not None and item.alt_m > limit_m:
            name = built.stop_names.get(index, f"item {index + 1} ({command_name(item.command)})")
            message = (
                f"is flown {item.alt_m:,.1f} m above home; [fence] max_alt_rel_m = {limit_m:g} is the limit"
            )
            yield Problem(name, message, "fence-height")


def legs_over(mission: Mission, terrain: Terrain, names: Mapping[int, str]) -> list[OverLeg]:
    """Return the legs of a mission that lead from one place to another; a return to launch's is not among them."""
    plane = LocalPlane(mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7)
    home_m = terrain.home_m
    found = []
    for leg in flown_legs(mission, names):
        start, end = leg.start, leg.end
        if leg.returning or (start.lat_e7, start.lon_e7) == (end.lat_e7, end.lon_e7):
            continue
        ends = plane.to_xy_m([start.lat_e7 / 1e7, end.lat_e7 / 1e7], [start.lon_e7 / 1e7, end.lon_e7 / 1e7])
        ground = terrain.under(ends[0], ends[1])
        found.append(OverLeg(leg, ground, home_m + start.alt_rel_m, home_m + end.alt_rel_m))
    return found


def ground_under(mission: Mission, terrain: Terrain) -> Iterator[tuple[int, Floats]]:
    """Yield an item's index and the ground above home under the way to it, at even distances, highest of their part."""
    plane = LocalPlane(mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7)
    home_m = terrain.home_m
    at_m = np.zeros(2)
    for index, item in enumerate(mission.items):
        if not item.has_position:
            continue
        place_m: Floats = plane.to_xy_m(item.lat_deg, item.lon_deg)[0]
        if np.linalg.norm(place_m - at_m) > DRAWN_FROM_M:
            ground = terrain.under(at_m, place_m)
            parts = min(len(ground.at) // 2, DRAWN_PARTS)
            highest = np.interp(np.linspace(0, 1, parts + 1), ground.at[::2], ground.top_m[::2])
            np.maximum.at(highest, np.rint(ground.at[::2] * parts).astype(np.int64), ground.top_m[::2])
            yield index, highest - home_m
        at_m = place_m


def clearance_faults(legs: list[OverLeg], clearance_m: float) -> Iterator[Problem]:
    """Yield an error for each leg that comes too near to the ground, or under which it is not known."""
    for over in legs:
        if not over.least_m >= clearance_m - ROUNDING_M:
            message = f"keeps {over.least_m:,.1f} m above the ground, {clearance_m:g} m are to be kept"
            yield Problem(over.leg.name, message, "clearance")


def height_warnings(built: BuiltMission, legs: list[OverLeg], rules: AutopilotRules) -> Iterator[Problem]:
    """Yield what to know of heights: far above the ground, below home."""
    highest = max(legs, key=lambda over: over.most_m, default=None)
    if highest is not None and highest.most_m > USUAL_HEIGHT_LIMIT_M:
        message = (
            f"is up to {highest.most_m:,.0f} m above the ground, and many countries ask for a permit above "
            f"{USUAL_HEIGHT_LIMIT_M:g} m"
        )
        yield Problem(highest.leg.name, message, "height-limit", "warning")
    items = built.mission.items
    low = [n for n, stop in enumerate(built.stop_items, start=1) if items[stop.first].alt_m < 0]
    if low:
        words = ': PX4 says "Waypoint below home" and flies it' if rules.name == "px4" else ""
        yield Problem(named(low), f"below home, at a negative altitude{words}", "below-home", "warning")


def straight_return_warnings(
    built: BuiltMission, terrain: Terrain, rules: AutopilotRules
) -> Iterator[Problem]:
    """Yield a warning that names the stops from which a failsafe's return would come too near to the ground."""
    mission = built.mission
    return_m = max(LAWS[rules.name].return_height_m, PX4_RETURN_M if rules.name == "px4" else 0.0)
    plane = LocalPlane(mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7)
    home_m = terrain.home_m
    low = []
    for number, stop in enumerate(built.stop_items, start=1):
        item = mission.items[stop.first]
        place: Floats = plane.to_xy_m(item.lat_deg, item.lon_deg)[0]
        level_m = home_m + max(item.alt_m, return_m)
        if not least_clearance_m(terrain.under(place, np.zeros(2)), level_m, level_m)[0] >= FAILSAFE_M:
            low.append(number)
    if low:
        message = (
            f"a failsafe's return from there flies straight home at {return_m:g} m above home or at the stop's own "
            f"altitude if that is higher, and would come within {FAILSAFE_M:g} m of the ground or hit it: "
            "set the vehicle's return altitude higher"
        )
        yield Problem(named(low), message, "failsafe-ground", "warning")


def named(stops: list[int]) -> str:
    """Return ``stop 3`` or ``stops 3, 4 and 5 more``."""
    more = f" and {len(stops) - 12} more" if len(stops) > 12 else ""
    return f"{'stop' if len(stops) == 1 else 'stops'} {', '.join(map(str, stops[:12]))}{more}"
