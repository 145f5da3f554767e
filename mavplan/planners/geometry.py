"""Plane geometry of the planners: where a point stands to a path, points of circles, places that can be compared."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mavplan.scenario.model import Bools, Floats, Ints

CELLS_AT_ONCE = 1_000_000
"""Pairs of point and segment that are held in memory together."""


@dataclass(frozen=True, eq=False)
class NearestOnPath:
    """The nearest point of a polyline for each of N points.

    Attributes
    ----------
    segment
        (N,) index of its segment; the earlier one where two are as near.
    foot_m
        (N, 2) the point itself, the foot of the perpendicular clamped to the segment.
    distance_m
        (N,) distance to it.
    at_end
        (N,) whether it is the last vertex of the polyline.
    """

    segment: Ints
    foot_m: Floats
    distance_m: Floats
    at_end: Bools


def nearest_on_path(points_m: Floats, path_m: Floats) -> NearestOnPath:
    """Return the nearest point of the polyline ``path_m`` (S + 1, 2), S ≥ 1, for each of ``points_m`` (N, 2)."""
    start, along = path_m[:-1], np.diff(path_m, axis=0)
    squared = (along**2).sum(axis=1)
    segment = np.zeros(len(points_m), dtype=np.int64)
    fraction, distance_m = np.zeros(len(points_m)), np.zeros(len(points_m))
    foot_m = np.zeros((len(points_m), 2))
    rows_at_once = max(1, CELLS_AT_ONCE // len(along))
    for first in range(0, len(points_m), rows_at_once):
        rows = slice(first, first + rows_at_once)
        points = points_m[rows, None, :]
        projected = ((points - start) * along).sum(axis=2)
        # A segment without length is its own start.
        fractions = np.divide(projected, squared, out=np.zeros_like(projected), where=squared > 0).clip(
            0.0, 1.0
        )
        # A foot at the end of a segment is the next one's start to the last bit, so that ties are ties.
        feet = np.where(fractions[:, :, None] == 1.0, path_m[1:], start + fractions[:, :, None] * along)
        distances = np.linalg.norm(points - feet, axis=2)
        best = distances.argmin(axis=1)
        row = np.arange(len(best))
        segment[rows], fraction[rows] = best, fractions[row, best]
        foot_m[rows], distance_m[rows] = feet[row, best], distances[row, best]
    nothing_after = np.cumsum(squared[::-1])[::-1] - squared == 0.0
    return NearestOnPath(
        segment=segment,
        foot_m=foot_m,
        distance_m=distance_m,
        at_end=nothing_after[segment] & ((fraction == 1.0) | (squared[segment] == 0.0)),
    )


def nearest_of(points_m: Floats, places_m: Floats) -> tuple[Floats, Ints]:
    """Return the distance (N,) of each of N points to the nearest of M ≥ 1 places, and its index (N,).

    Of up to four places equally near the one of lowest index.
    """
    from scipy.spatial import KDTree

    found = KDTree(places_m).query(points_m, k=list(range(1, min(len(places_m), 4) + 1)))
    distances_m, indices = np.asarray(found[0], dtype=np.float64), np.asarray(found[1], dtype=np.int64)
    tied = distances_m == distances_m[:, :1]
    return distances_m[:, 0], np.where(tied, indices, len(places_m)).min(axis=1)


def towards(centre_m: Floats, radius_m: float, target_m: Floats) -> Floats:
    """Return the point of the circle that is nearest to ``target_m``."""
    direction = target_m - centre_m
    return centre_m + radius_m * direction / np.linalg.norm(direction)


def least_detour_on_circle(centre_m: Floats, radius_m: float, left_m: Floats, right_m: Floats) -> Floats:
    """Return the point w of a circle with the least ‖w − left‖ + ‖w − right‖, (9) to (12) of the paper.

    The segment from left to right must lie outside the circle. Then the sum, convex over the disc, has its only
    stationary point on the arc that faces the segment, between the directions to its ends, and the derivative of
    (11) changes sign exactly once there: a bracket for Brent's method.

    Parameters
    ----------
    centre_m, left_m, right_m
        (2,) metres.
    radius_m
        Radius of the circle in metres.
    """
    from scipy.optimize import brentq

    to_left, to_right = left_m - centre_m, right_m - centre_m
    left_rad = math.atan2(to_left[1], to_left[0])
    right_rad = math.atan2(to_right[1], to_right[0])
    between_rad = math.remainder(right_rad - left_rad, math.tau)
    left_distance_m, right_distance_m = float(np.hypot(*to_left)), float(np.hypot(*to_right))

    def slope(turn_rad: float) -> float:
        """dL/dθ over the radius, at ``turn_rad`` from the direction to the left end."""

        def one(angle_rad: float, distance_m: float) -> float:
            # R² + d² − 2·R·d·cos, written so that nothing cancels where the point is just outside the circle.
            chord = math.hypot(
                distance_m - radius_m, 2 * math.sqrt(radius_m * distance_m) * math.sin(angle_rad / 2)
            )
            return distance_m * math.sin(angle_rad) / chord

        return one(turn_rad, left_distance_m) + one(turn_rad - between_rad, right_distance_m)

    turn_rad = 0.0
    if slope(0.0) * slope(between_rad) < 0.0:
        turn_rad = brentq(slope, 0.0, between_rad, xtol=1e-14)
    theta = left_rad + turn_rad
    return centre_m + radius_m * np.array([math.cos(theta), math.sin(theta)])


def as_numbers(places_m: Floats) -> NDArray[np.complex128]:
    """Return places (..., 2) as one number each, which can be compared and sorted."""
    found: NDArray[np.complex128] = np.ascontiguousarray(places_m).view(complex)[..., 0]
    return found


def as_places(numbers: NDArray[np.complex128]) -> Floats:
    """Return (K, 2) the places that (K,) numbers of `as_numbers` stand for."""
    return numbers.view(float).reshape(-1, 2)
