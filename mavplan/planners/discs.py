"""The nearest point of an intersection of equal discs: closed form, no solver."""

import itertools
import math

import numpy as np

from mavplan.scenario.model import Floats

TOLERANCE_M = 1e-9
"""A point this far outside a disc counts as inside: vertices of the intersection are computed, and rounded."""

Point = tuple[float, float]


def project_on_discs(point_m: Floats, centres_m: Floats, radius_m: float) -> Floats:
    """Return the point nearest to ``point_m`` that lies within ``radius_m`` of every centre.

    The nearest point of a convex set in the plane is decided by at most two of the discs (a basis). So: project on
    the basis, look for the disc violated most, put it to the basis, drop what is no longer needed. The distance to
    ``point_m`` grows with every round, hence no basis comes twice.

    Parameters
    ----------
    point_m
        (2,) metres.
    centres_m
        (N, 2) metres, N ≥ 0; the discs must have a point in common.
    radius_m
        Radius of all of them.

    Raises
    ------
    ArithmeticError
        The discs have no point in common.
    """
    if not len(centres_m):
        return point_m
    x, y = centres_m[:, 0], centres_m[:, 1]
    start: Point = (float(point_m[0]), float(point_m[1]))
    found, basis = start, list[Point]()
    for _ in range(len(centres_m) + 64):
        away_squared = (x - found[0]) ** 2 + (y - found[1]) ** 2
        worst = int(away_squared.argmax())
        if away_squared[worst] <= (radius_m + TOLERANCE_M) ** 2:
            return np.array(found)
        found, basis = _project_on_few(start, [*basis, (float(x[worst]), float(y[worst]))], radius_m)
    raise ArithmeticError("the discs have no point in common")


def _project_on_few(start: Point, centres: list[Point], radius_m: float) -> tuple[Point, list[Point]]:
    """Return the projection on up to three discs, of which it violates one at least, and the ones that decide it."""
    allowed_m = radius_m + TOLERANCE_M
    best, best_m, basis = start, math.inf, list[Point]()

    def offer(candidate: Point, deciders: list[Point]) -> None:
        nonlocal best, best_m, basis
        away_m = math.dist(candidate, start)
        if away_m < best_m and all(math.dist(candidate, centre) <= allowed_m for centre in centres):
            best, best_m, basis = candidate, away_m, deciders

    for centre in centres:
        away_m = math.dist(start, centre)
        if away_m > radius_m:
            share = radius_m / away_m
            on_circle = (
                centre[0] + share * (start[0] - centre[0]),
                centre[1] + share * (start[1] - centre[1]),
            )
            offer(on_circle, [centre])
    if basis:
        return best, basis
    for one, other in itertools.combinations(centres, 2):
        for crossing in _crossings(one, other, radius_m):
            offer(crossing, [one, other])
    if not basis:
        raise ArithmeticError("the discs have no point in common")
    return best, basis


def _crossings(one: Point, other: Point, radius_m: float) -> list[Point]:
    """Return where two circles of equal radius meet; circles that just fail to touch meet between their centres."""
    apart_m = math.dist(one, other)
    if apart_m == 0.0 or apart_m > 2 * (radius_m + TOLERANCE_M):
        return []
    middle = ((one[0] + other[0]) / 2, (one[1] + other[1]) / 2)
    height = math.sqrt(max(radius_m**2 - apart_m**2 / 4, 0.0)) / apart_m
    dx, dy = height * (other[1] - one[1]), height * (one[0] - other[0])
    return [(middle[0] + dx, middle[1] + dy), (middle[0] - dx, middle[1] - dy)]
