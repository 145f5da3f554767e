"""Stops on a path that reaches everybody in passing: the fewest, then each where its slowest user is served fastest."""

from dataclasses import dataclass

import numpy as np

from mavplan.planners.cover_candidates import (
    COVER_SLACK_M,
    CoverInstance,
    Requirements,
    cover_instance,
    reduce_instance,
    requirements_of,
)
from mavplan.planners.cover_search import exact_cover, greedy_cover
from mavplan.radio import Channel
from mavplan.scenario.model import UNPAIRED, Floats, Ints, Users

EXACT_REQUIREMENTS = 600
"""Above so many, after reduction, stops are chosen greedily."""

EXACT_S = 5.0
"""For the fewest stops; along a path the programme is nearly always solved at once."""

PLACES_OF_A_STOP = 65
"""Between its neighbours, from which a stop's own is chosen."""

SWEEPS = 3
"""Rounds in which stops are moved one after the other."""

CELLS_AT_ONCE = 500_000
"""Pairs of leg and user that are held in memory together."""


def stops_on_path(users: Users, channel: Channel, path_m: Floats) -> Floats:
    """Return stops (M, 2) in the order of the path, from which each user or its mate is reached.

    The path through them is no longer than the given one.

    Parameters
    ----------
    path_m
        (S + 1, 2) polyline that comes within R of each user or its mate.
    """
    line = _Line.of(path_m)
    required = requirements_of(users.xy_m, users.mate)
    at_m = _fewest(required, channel.radius_m, line)
    return line.points_m(_placed(users, channel, line, at_m))


@dataclass(frozen=True, eq=False)
class _Line:
    """A polyline measured along itself: ``at_m`` (S + 1,) is where its points are."""

    path_m: Floats
    at_m: Floats

    @classmethod
    def of(cls, path_m: Floats) -> "_Line":
        steps = np.linalg.norm(np.diff(path_m, axis=0), axis=1)
        return cls(path_m, np.concatenate(([0.0], np.cumsum(steps))))

    def points_m(self, at_m: Floats) -> Floats:
        """Return (..., 2) the points at these lengths."""
        x, y = (np.interp(at_m, self.at_m, self.path_m[:, axis]) for axis in (0, 1))
        return np.stack((x, y), axis=-1)

    def within(self, places_m: Floats, radius_m: float) -> Floats:
        """Return sorted lengths at which the line begins or ends to be within the radius of a place, and its corners.

        What is within reach changes nowhere else.
        """
        found = [self.at_m]
        begin, along = self.path_m[:-1], np.diff(self.path_m, axis=0)
        steps = np.diff(self.at_m)
        legs = np.flatnonzero(steps > 0.0)
        at_once = max(1, CELLS_AT_ONCE // max(1, len(legs)))
        heading = along[legs] / steps[legs, None]
        for first in range(0, len(places_m), at_once):
            offset = places_m[first : first + at_once, None] - begin[legs]
            foot = (offset * heading).sum(axis=2)
            half_squared = radius_m**2 - ((offset - foot[..., None] * heading) ** 2).sum(axis=2)
            half = np.sqrt(np.maximum(half_squared, 0.0))
            for end in (foot - half, foot + half):
                inside = (half_squared > 0.0) & (end > 0.0) & (end < steps[legs])
                found.append((self.at_m[legs] + end)[inside])
        return np.unique(np.concatenate(found))


def _fewest(required: Requirements, radius_m: float, line: _Line) -> Floats:
    """Return where stops are (M,), sorted, as few as meet all requirements."""
    at_m = line.within(required.places_m, radius_m)
    instance = reduce_instance(cover_instance(required, line.points_m(at_m), radius_m))
    chosen = _cover(instance)
    # What is left after reduction are rows of the candidates: found again by their coordinates.
    where = {point.tobytes(): at for point, at in zip(line.points_m(at_m), at_m.tolist(), strict=True)}
    return np.sort([where[point.tobytes()] for point in instance.centres_m[chosen]])


def _cover(instance: CoverInstance) -> Ints:
    if instance.covers.shape[1] <= EXACT_REQUIREMENTS:
        chosen, _ = exact_cover(instance.covers, time_limit_s=EXACT_S)
        if chosen is not None:
            return chosen
    return greedy_cover(instance.covers)


def _placed(users: Users, channel: Channel, line: _Line, at_m: Floats) -> Floats:
    """Return the stops moved along the line, each to where the slowest of those that only it reaches waits least.

    Users are reached from it alone if no other stop reaches them or their mates.
    """
    from scipy.spatial import KDTree

    at_m = at_m.copy()
    reach_m = channel.radius_m + COVER_SLACK_M
    tree = KDTree(users.xy_m)
    near: list[Ints] = [
        np.asarray(found, dtype=np.int64) for found in tree.query_ball_point(line.points_m(at_m), reach_m)
    ]
    times = np.bincount(np.concatenate(near), minlength=len(users))
    mate = np.where(users.mate == UNPAIRED, np.arange(len(users)), users.mate)
    demand_bit = np.maximum(users.demand_bit, 1.0)
    demand_bit = np.where(users.mate == UNPAIRED, demand_bit, demand_bit + demand_bit[mate])
    for _ in range(SWEEPS):
        for stop in range(len(at_m)):
            times[near[stop]] -= 1
            alone = near[stop][(times[near[stop]] == 0) & (times[mate[near[stop]]] == 0)]
            low = at_m[stop - 1] if stop else 0.0
            high = at_m[stop + 1] if stop + 1 < len(at_m) else line.at_m[-1]
            tried = np.append(np.linspace(low, high, PLACES_OF_A_STOP), at_m[stop])
            points = line.points_m(tried)
            wait_s = np.full((2, len(alone), len(tried)), np.inf)
            for row, members in zip(wait_s, (alone, mate[alone]), strict=True):
                away_m = np.linalg.norm(users.xy_m[members, None] - points, axis=2)
                reached = away_m <= reach_m
                row[reached] = (demand_bit[members, None] / channel.air_rate(away_m))[reached]
            at_m[stop] = tried[int(wait_s.min(axis=0).max(axis=0, initial=0.0).argmin())]
            near[stop] = np.asarray(tree.query_ball_point(line.points_m(at_m[stop]), reach_m), dtype=np.int64)
            times[near[stop]] += 1
    return at_m
