"""The close-enough travelling salesman: a path from its start that comes within R of what is required.

Problem and answer as data, and which places a path leaves out of reach. The search is in `path_search`.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.planners.cover_candidates import COVER_SLACK_M, Requirements, requirements_of
from mavplan.scenario.model import Bools, Floats, Ints

CELLS_AT_ONCE = 500_000
"""Pairs of leg and place that are held in memory together."""


@dataclass(frozen=True, eq=False)
class PathProblem:
    """What has to be reached from where.

    Attributes
    ----------
    required
        Each requirement is met by a path that comes within the radius of any of its places.
    radius_m
        R, greater than 0.
    start_m, end_m
        (2,) where the path begins and ends; None: it may end anywhere.
    """

    required: Requirements
    radius_m: float
    start_m: Floats
    end_m: Floats | None

    @property
    def returns(self) -> bool:
        """Whether the path ends where it begins: then each is as good flown backwards."""
        return self.end_m is not None and bool((self.end_m == self.start_m).all())

    def path_m(self, points_m: Floats) -> Floats:
        """Return (..., L + 1, 2) the path through points (..., K, 2), from start to end."""
        ends = [self.start_m] if self.end_m is None else [self.start_m, self.end_m]
        shape = (*points_m.shape[:-2], 1, 2)
        first, *last = (np.broadcast_to(end, shape) for end in ends)
        return np.concatenate([first, points_m, *last], axis=-2)

    def without_met(self) -> "PathProblem":
        """Return the problem of the requirements that the path does not meet as it begins or ends, each once."""
        ends = self.path_m(np.empty((0, 2)))
        unmet = self.required.unmet(ends, self.radius_m)
        choices = self.required.choices[unmet]
        alone = choices[:, 0] == choices[:, 1]
        implied = ~alone & np.isin(choices, choices[alone, 0]).any(axis=1)
        return PathProblem(self.required.part(unmet[~implied]), self.radius_m, self.start_m, self.end_m)

    def away_m(self, points_m: Floats) -> Floats:
        """Return (B, Q) how far each requirement is from each path through points (B, K, 2): its nearest place."""
        places = self.required.places_m
        path = self.path_m(points_m)
        away = np.empty((len(path), len(places)))
        at_once = max(1, CELLS_AT_ONCE // (path.shape[1] * max(1, len(places))))
        for first in range(0, len(path), at_once):
            rows = slice(first, first + at_once)
            away[rows] = _distance_m(path[rows], places)
        nearest: Floats = away[:, self.required.choices].min(axis=2)
        return nearest

    def part_away_m(self, requirements: Ints, points_m: Floats) -> Floats:
        """Return how far these requirements are from the path through points (K, 2)."""
        part = PathProblem(self.required.part(requirements), self.radius_m, self.start_m, self.end_m)
        away: Floats = part.away_m(points_m[None])[0]
        return away

    def unmet(self, away_m: Floats) -> Bools:
        """Return which of these distances leave a requirement unmet."""
        return np.greater(away_m, self.radius_m + COVER_SLACK_M)


def path_problem(
    xy_m: Floats, radius_m: float, *, returns: bool, mate: Ints | None = None, home_m: Floats | None = None
) -> PathProblem:
    """Return the problem of a path from home that reaches each user, or with ``mate`` one of each pair.

    Parameters
    ----------
    xy_m
        (N, 2) users.
    returns
        Whether the path ends at home; else it ends anywhere.
    home_m
        (2,) by default the origin.
    """
    home = np.zeros(2) if home_m is None else home_m
    return PathProblem(requirements_of(xy_m, mate), radius_m, home, home if returns else None)


@dataclass(frozen=True, eq=False)
class FoundPath:
    """A path that meets all requirements.

    Attributes
    ----------
    sequence
        Places in the order in which their discs are touched.
    points_m
        (K, 2) where.
    length_m
        Length from start to end.
    """

    sequence: tuple[int, ...]
    points_m: Floats
    length_m: float


def _distance_m(path_m: Floats, places_m: Floats) -> Floats:
    """Return (B, P) the distance of each place to each of B paths (B, S, 2)."""
    begin, along = path_m[:, :-1, None], np.diff(path_m, axis=1)[:, :, None]
    if not along.shape[1]:
        return np.asarray(np.linalg.norm(places_m - path_m, axis=2))
    x, y = places_m[:, 0] - begin[..., 0], places_m[:, 1] - begin[..., 1]
    u, v = along[..., 0], along[..., 1]
    squared = np.maximum(u * u + v * v, np.finfo(float).tiny)
    share = np.clip((x * u + y * v) / squared, 0.0, 1.0)
    x -= share * u
    y -= share * v
    return np.asarray(np.sqrt((x * x + y * y).min(axis=1)))
