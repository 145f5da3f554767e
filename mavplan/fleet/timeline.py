"""Where a planned vehicle is at every moment of its forecast, and where two of them come too close. Pure.

Between the moments of the forecast a vehicle is taken to move evenly: from rest and to rest it really lags by some tens
of metres, which the separation has to cover.
"""

import math
from dataclasses import dataclass

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.mission.flight_law import LAWS
from mavplan.mission.model import Command
from mavplan.plan import Plan
from mavplan.scenario.model import Floats

AT_HOME_M = 0.5
ROUNDING_M = 1e-6

FOREVER_S = 1e7
"""Until then a vehicle is where its mission leaves it, if that is not its home."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Corners of a flight in time and space. Before the first and behind the last the vehicle is in nobody's way.

    Attributes
    ----------
    time_s
        (P,) not falling, from the start of the vehicle's mission.
    place_m
        (P, 3) metres east, north in a plane that all vehicles share, and above mean sea level.
    anywhere_between
        Over real ground height changes along a leg, and not evenly: the vehicle is taken to be anywhere between the
        heights at the ends of its leg.
    """

    time_s: Floats
    place_m: Floats
    anywhere_between: bool = False

    def heights_m(self, moments_s: Floats) -> Floats:
        """Return (T, 2) the least and the greatest height on the leg flown at each moment."""
        legs = np.clip(np.searchsorted(self.time_s, moments_s, side="right") - 1, 0, len(self.time_s) - 2)
        ends = np.stack([self.place_m[legs, 2], self.place_m[legs + 1, 2]], axis=1)
        return np.sort(ends, axis=1)

    def at(self, moments_s: Floats) -> Floats:
        """Return (T, 3) places at moments between the first corner and the last."""
        return np.column_stack(
            [np.interp(moments_s, self.time_s, self.place_m[:, axis]) for axis in range(3)]
        )


def timeline(plan: Plan, plane: LocalPlane) -> Timeline:
    """Return the timeline of a plan in a plane that all share."""
    mission, home = plan.built.mission, plan.built.mission.home
    terrain = plan.scenario.terrain
    # Over real ground heights are counted from the ground at home, as the terrain has it.
    ground_m = home.alt_amsl_m if terrain is None else terrain.home_m
    (home_xy,) = plane.to_xy_m([home.lat_e7 / 1e7], [home.lon_e7 / 1e7])
    law = LAWS[plan.rules.name]
    here, height_m, clock_s = np.asarray(home_xy), 0.0, 0.0
    corners = [(0.0, *here, ground_m)]

    def add(seconds: float, xy: Floats, above_m: float) -> None:
        nonlocal clock_s, here, height_m
        clock_s, here, height_m = clock_s + seconds, xy, above_m
        corners.append((clock_s, *xy, ground_m + above_m))

    for item, found in zip(mission.items, plan.forecast.items, strict=True):
        part = found.seconds
        match item.command:
            case Command.NAV_TAKEOFF:
                add(part.total, here, item.alt_m)
            case Command.NAV_WAYPOINT | Command.NAV_LOITER_TIME | Command.NAV_LOITER_UNLIM:
                (there,) = plane.to_xy_m([item.lat_deg], [item.lon_deg])
                add(part.total - part.hover, np.asarray(there), item.alt_m)
                add(part.hover, here, height_m)
            case Command.NAV_RETURN_TO_LAUNCH:
                add(part.climb, here, max(height_m, law.return_height_m))
                add(part.cruise, np.asarray(home_xy), height_m)
                add(part.hover, here, height_m)
                add(part.descent, here, 0.0)
            case Command.NAV_LAND:
                (there,) = plane.to_xy_m([item.lat_deg], [item.lon_deg])
                add(part.cruise, np.asarray(there), height_m)
                add(part.descent, here, 0.0)
    if height_m > 0 or math.dist(here, home_xy) > AT_HOME_M:
        add(FOREVER_S, here, height_m)
    every = np.array(corners)
    return Timeline(every[:, 0], every[:, 1:], terrain is not None)


@dataclass(frozen=True)
class Meeting:
    """Two vehicles too close: when, on the clock of the fleet, and how far apart over the ground."""

    second: float
    apart_m: float


def meeting(
    one: Timeline,
    other: Timeline,
    one_start_s: float,
    other_start_s: float,
    *,
    separation_m: float,
    vertical_m: float,
) -> Meeting | None:
    """Return the first moment at which two vehicles are closer than the separation at the same height; None if none.

    Parameters
    ----------
    one, other
        Their flights, in one plane.
    one_start_s, other_start_s
        When each starts.
    separation_m
        Over the ground.
    vertical_m
        From this difference on heights are not the same.
    """
    first_s, second_s = one.time_s + one_start_s, other.time_s + other_start_s
    begin_s, end_s = max(first_s[0], second_s[0]), min(first_s[-1], second_s[-1])
    moments_s = np.unique(np.concatenate([first_s, second_s, [begin_s, end_s]]))
    moments_s = moments_s[(moments_s >= begin_s) & (moments_s <= end_s)]
    if begin_s >= end_s:
        return None
    between = one.at(moments_s - one_start_s) - other.at(moments_s - other_start_s)
    if one.anywhere_between or other.anywhere_between:
        middle_s = (moments_s[:-1] + moments_s[1:]) / 2
        low, high = one.heights_m(middle_s - one_start_s).T
        other_low, other_high = other.heights_m(middle_s - other_start_s).T
        level = np.maximum(low - other_high, other_low - high) < vertical_m - ROUNDING_M
        from_, to = np.where(level, 0.0, 2.0), np.where(level, 1.0, -1.0)
    else:
        from_, to = _level(between, vertical_m)
    near_from, near_to = _near(between, separation_m)
    from_, to = np.maximum(from_, near_from), np.minimum(to, near_to)
    close = np.flatnonzero(from_ < to)
    if not len(close):
        return None
    piece, share = int(close[0]), float(from_[close[0]])
    there = between[piece] + share * (between[piece + 1] - between[piece])
    second = float(moments_s[piece] + share * (moments_s[piece + 1] - moments_s[piece]))
    return Meeting(second, math.hypot(there[0], there[1]))


def _level(between_m: Floats, vertical_m: float) -> tuple[Floats, Floats]:
    """Return from which part of each piece to which heights are the same; where never, to lies before from."""
    start, change = between_m[:-1, 2], np.diff(between_m[:, 2])
    limit_m = vertical_m - ROUNDING_M
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (-limit_m - start) / change, (limit_m - start) / change
    still = np.abs(change) < ROUNDING_M
    always = np.abs(start) < limit_m
    from_ = np.where(still, np.where(always, 0.0, 2.0), np.minimum(one, other))
    to = np.where(still, np.where(always, 1.0, -1.0), np.maximum(one, other))
    return np.maximum(from_, 0.0), np.minimum(to, 1.0)


def _near(between_m: Floats, separation_m: float) -> tuple[Floats, Floats]:
    """Return from which part of each piece to which the two are closer over the ground than the separation."""
    start, change = between_m[:-1, :2], np.diff(between_m[:, :2], axis=0)
    # |start + s·change|² = separation², a quadratic in s.
    a = (change**2).sum(axis=1)
    b = (start * change).sum(axis=1)
    c = (start**2).sum(axis=1) - separation_m**2
    still = a < ROUNDING_M**2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    never = np.where(still, c >= 0, b**2 <= a * c)
    safe = np.where(still, 1.0, a)
    from_ = np.where(never, 2.0, np.where(still, 0.0, (-b - root) / safe))
    to = np.where(never, -1.0, np.where(still, 1.0, (-b + root) / safe))
    return np.maximum(from_, 0.0), np.minimum(to, 1.0)
