"""How far a place or a leg keeps from the border of a fence area, in the local plane. Pure; numpy only.

Both autopilots look at a polygon in latitude and longitude, so its sides are straight there and not in the plane:
sides are cut into pieces short enough that the difference is below 3 cm anywhere up to 85 degrees of latitude.
Legs are straight in the plane.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mavplan.geo import LocalPlane
from mavplan.mission.geofence import Fence, FencePolygon

Floats = NDArray[np.float64]

PIECE_M = 250.0
MAX_PIECES = 400
AT_ONCE = 500_000
"""Pairs of leg and side that are looked at together: some tens of megabytes."""
SPHERE_SHARE = 0.007
"""Autopilots measure a radius on a sphere (PX4 of 6371.0 km, ArduPilot of 6378.1 km); the ellipsoid's radii of
curvature lie between 6335.4 and 6399.6 km, so that their metre differs from ours by up to 0.7 %."""


@dataclass(frozen=True, eq=False)
class PlanePolygon:
    """A polygon in the plane; ``ring_m`` (K, 2) metres east and north, not closed."""

    label: str
    inclusion: bool
    ring_m: Floats

    @property
    def slack_m(self) -> float:
        """How much the autopilot's own border may lie off ours: nothing, both take it in degrees."""
        return 0.0

    def clearance_m(self, starts_m: ArrayLike, ends_m: ArrayLike) -> Floats:
        """Return how far legs keep from the border on the allowed side.

        Parameters
        ----------
        starts_m, ends_m
            (N, 2) metres east and north; the same for a place.

        Returns
        -------
        ndarray
            (N,) metres: negative for a leg wholly beyond the border, 0 for one that crosses it.
        """
        starts, ends = (np.asarray(points, dtype=np.float64) for points in (starts_m, ends_m))
        nexts = np.roll(self.ring_m, -1, axis=0)
        found = np.empty(len(starts))
        at_once = max(1, AT_ONCE // len(nexts))
        for first in range(0, len(starts), at_once):
            some = slice(first, first + at_once)
            away_m = segment_distance_m(starts[some, None], ends[some, None], self.ring_m, nexts).min(axis=1)
            allowed = contains(self.ring_m, starts[some]) == self.inclusion
            found[some] = np.where(allowed, away_m, -away_m)
        return found


@dataclass(frozen=True, eq=False)
class PlaneCircle:
    """A circle in the plane; ``centre_m`` (2,) metres east and north."""

    label: str
    inclusion: bool
    centre_m: Floats
    radius_m: float

    @property
    def slack_m(self) -> float:
        """How much the autopilot's own border may lie off ours."""
        return SPHERE_SHARE * self.radius_m

    def clearance_m(self, starts_m: ArrayLike, ends_m: ArrayLike) -> Floats:
        """Return how far legs keep from the border on the allowed side; as for `PlanePolygon`.

        A leg that crosses the border has a clearance of at most 0.
        """
        starts, ends = (np.asarray(points, dtype=np.float64) for points in (starts_m, ends_m))
        if not self.inclusion:
            return _point_distance_m(self.centre_m, starts, ends) - self.radius_m
        furthest_m = np.maximum(*(np.hypot(*(points - self.centre_m).T) for points in (starts, ends)))
        return np.asarray(self.radius_m - furthest_m)


PlaneArea = PlanePolygon | PlaneCircle


def plane_areas(fence: Fence, plane: LocalPlane) -> list[PlaneArea]:
    """Return the areas of a fence in the plane, in their order."""
    areas: list[PlaneArea] = []
    for label, area in fence.labelled():
        if isinstance(area, FencePolygon):
            areas.append(PlanePolygon(label, area.inclusion, _ring_m(area, plane)))
        else:
            centre_m = plane.to_xy_m(area.lat_e7 / 1e7, area.lon_e7 / 1e7)[0]
            areas.append(PlaneCircle(label, area.inclusion, centre_m, area.radius_m))
    return areas


def _ring_m(area: FencePolygon, plane: LocalPlane) -> Floats:
    corners = np.array(area.vertices_e7, dtype=np.float64) / 1e7
    nexts = np.roll(corners, -1, axis=0)
    corners_m = plane.to_xy_m(corners[:, 0], corners[:, 1])
    lengths_m = np.hypot(*(np.roll(corners_m, -1, axis=0) - corners_m).T)
    pieces = np.clip(np.ceil(lengths_m / PIECE_M), 1, MAX_PIECES).astype(np.int64)
    points = [
        start + (end - start) * np.arange(count)[:, None] / count
        for start, end, count in zip(corners, nexts, pieces.tolist(), strict=True)
    ]
    ring = np.concatenate(points)
    return plane.to_xy_m(ring[:, 0], ring[:, 1])


def contains(ring_m: Floats, points_m: Floats) -> NDArray[np.bool_]:
    """(N,) whether points (N, 2) lie in a polygon (K, 2): an odd number of sides cross the ray east of them."""
    x, y = ring_m.T
    x_next, y_next = np.roll(x, -1), np.roll(y, -1)
    at_x, at_y = points_m[:, :1], points_m[:, 1:]
    crosses = (y > at_y) != (y_next > at_y)
    rise = np.where(y_next == y, 1.0, y_next - y)  # a side without rise is never crossed
    east = x + (at_y - y) * (x_next - x) / rise > at_x
    return np.asarray(np.count_nonzero(crosses & east, axis=1) % 2 == 1)


def segment_distance_m(start_m: Floats, end_m: Floats, from_m: Floats, to_m: Floats) -> Floats:
    """Return the distances between segments, 0 where they cross.

    Parameters
    ----------
    start_m, end_m, from_m, to_m
        Ends of the one and of the other, broadcast over all but the last axis.
    """
    ends = (
        _point_distance_m(start_m, from_m, to_m),
        _point_distance_m(end_m, from_m, to_m),
        _point_distance_m(from_m, start_m, end_m),
        _point_distance_m(to_m, start_m, end_m),
    )
    nearest = np.minimum.reduce(ends)
    one = _turn(start_m, end_m, from_m) * _turn(start_m, end_m, to_m)
    other = _turn(from_m, to_m, start_m) * _turn(from_m, to_m, end_m)
    return np.where((one < 0) & (other < 0), 0.0, nearest)


def _turn(a: Floats, b: Floats, c: Floats) -> Floats:
    first, second = b - a, c - a
    turn: Floats = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return turn


def _point_distance_m(point_m: Floats, from_m: Floats, to_m: Floats) -> Floats:
    """Return the distances from points to segments, broadcast over all but the last axis."""
    along = to_m - from_m
    length2 = (along**2).sum(axis=-1)
    scaled = ((point_m - from_m) * along).sum(axis=-1) / np.where(length2 > 0, length2, 1.0)
    foot = from_m + np.clip(scaled, 0.0, 1.0)[..., None] * along
    away = point_m - foot
    return np.asarray(np.hypot(away[..., 0], away[..., 1]))
