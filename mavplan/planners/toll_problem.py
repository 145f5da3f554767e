"""Paths that pay by the metre and a toll for how far they stay from users: what has to be passed, and what it costs."""

from dataclasses import dataclass, field

import numpy as np

from mavplan.planners.toll_curve import Curve
from mavplan.scenario.model import Floats, Ints

ROUNDING_M = 1e-3
"""A path that comes within R but for this reaches a user: it is only met on the way, no proof rests on it."""


@dataclass(frozen=True, eq=False)
class TollProblem:
    """What has to be passed, and what it costs to stay away from it.

    Attributes
    ----------
    members
        (Q, 2) the users that may stand for each requirement, twice the same where there is one.
    places_m
        (N, 2) users.
    fixed, weights
        (Q, 2) constant and factor of each member's toll: fixed + weight·ĝ(δ).
    curve
        ĝ, up to R.
    leg_cost, end_cost
        Of a metre, and of a metre of the way back to the origin; None where the path ends anywhere.
    """

    members: Ints
    places_m: Floats
    fixed: Floats
    weights: Floats
    curve: Curve
    leg_cost: float
    end_cost: float | None

    def __post_init__(self) -> None:
        least = self.fixed + self.weights * self.curve.values[0]
        object.__setattr__(self, "least", least.min(axis=1))

    least: Floats = field(init=False)
    """(Q,) the least that each requirement can pay."""

    def way_cost(self, points_m: Floats) -> float:
        """Return what a path from the origin through points (K, 2) costs by the metre."""
        path = np.vstack([np.zeros(2), points_m])
        cost = self.leg_cost * float(np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1)).sum())
        return cost if self.end_cost is None else cost + self.end_cost * float(np.hypot(*path[-1]))

    def tolls_along(self, points_m: Floats) -> tuple[Floats, Floats]:
        """Return (Q, 2) tolls along a path through points (K, 2), as at R where it stays beyond, and how far beyond."""
        away = distances_m(points_m, self.places_m)[self.members]
        beyond = np.maximum(away - self.curve.radius_m - ROUNDING_M, 0.0)
        return self.fixed + self.weights * self.curve.at(away), beyond


def distances_m(points_m: Floats, places_m: Floats) -> Floats:
    """Return (N,) how near a path from the origin through points (K, 2) comes to places (N, 2): not on its way back."""
    path = np.vstack([np.zeros((1, 2)), points_m])
    start, step = path[:-1], np.diff(path, axis=0)
    if not len(step):
        return np.asarray(np.sqrt((places_m**2).sum(axis=1)))
    x = places_m[:, :1] - start[:, 0]
    y = places_m[:, 1:] - start[:, 1]
    squared = np.maximum((step**2).sum(axis=1), 1e-12)
    along = np.clip((x * step[:, 0] + y * step[:, 1]) / squared, 0.0, 1.0)
    x -= along * step[:, 0]
    y -= along * step[:, 1]
    return np.asarray(np.sqrt((x * x + y * y).min(axis=1)))


def reaching_all(problem: TollProblem, points_m: Floats) -> Floats:
    """Return points (K, 2) with others among them until the path reaches a member of each requirement.

    The farthest is reached first, by the shortest way out from the leg that is nearest to it.
    """
    radius_m = problem.curve.radius_m
    for _ in range(len(problem.members)):
        away = distances_m(points_m, problem.places_m)[problem.members]
        lacking = away.min(axis=1) - radius_m
        most = int(lacking.argmax())
        if lacking[most] <= ROUNDING_M:
            break
        centre = problem.places_m[problem.members[most, away[most].argmin()]]
        path = np.vstack([np.zeros((1, 2)), points_m])
        ahead = np.vstack([path[1:], path[-1:]])
        step = ahead - path
        squared = np.maximum((step**2).sum(axis=1), 1e-12)
        along = np.clip(((centre - path) * step).sum(axis=1) / squared, 0.0, 1.0)
        outward = path + along[:, None] * step - centre
        leg = int((outward**2).sum(axis=1).argmin())
        place = centre + outward[leg] * (radius_m / float(np.hypot(*outward[leg])))
        points_m = np.insert(points_m, leg, place, axis=0)
    return points_m
