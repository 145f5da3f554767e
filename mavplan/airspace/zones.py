"""No-fly zones in the plane, and what is kept from them."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mavplan.geo import LocalPlane
from mavplan.mission.fence_geometry import PlaneArea, PlanePolygon, plane_areas
from mavplan.mission.geofence import Fence
from mavplan.scenario.model import Bools, Floats

TURN_CLEARANCE_M = 5.0
"""Kept on top where a leg turns: corners are cut by up to 2 m; how far a fast vehicle overshoots one is a guess."""
ROUNDING_M = 0.1
"""Kept on top for 1e-7 degrees (1 cm) and arithmetic, so that what is planned passes the check of the mission."""
TOUCHING_M = 0.02
"""So far into what is closed a leg may reach that only touches it."""
CIRCLE_SIDES = 32
MITRE_LIMIT = 2.0

Shape = Any
"""A shapely geometry; shapely's own types say no more."""


@dataclass(frozen=True, eq=False)
class KeepOut:
    """All zones of a scenario.

    Attributes
    ----------
    labels
        What each zone is called.
    zones
        The zones as they are.
    closed
        Where neither a stop nor a leg may be: the zones and their margins.
    core
        The same less what may be touched, prepared for many questions.
    corners_m
        (V, 2) places at which a leg may turn on its way round.
    """

    labels: tuple[str, ...]
    zones: tuple[Shape, ...]
    closed: Shape
    core: Shape
    corners_m: Floats

    def crossed(self, start_m: ArrayLike, end_m: ArrayLike) -> Bools:
        """Return (N,) which of the straight legs between (N, 2) and (N, 2) lie partly in what is closed."""
        import shapely

        ends = np.stack(np.broadcast_arrays(start_m, end_m), axis=-2).reshape(-1, 2, 2)
        crossed: NDArray[np.bool_] = shapely.intersects(self.core, shapely.linestrings(ends))
        return crossed

    def holds(self, points_m: Floats) -> Bools:
        """Return (N,) which points lie in what is closed."""
        import shapely

        inside: NDArray[np.bool_] = shapely.intersects(self.core, shapely.points(points_m))
        return inside

    def zones_on(self, shape: Shape) -> list[str]:
        """Return the labels of the zones that a shape meets."""
        return [label for label, zone in zip(self.labels, self.zones, strict=True) if zone.intersects(shape)]


def keep_out(zones: Fence, plane: LocalPlane, margin_m: float) -> KeepOut:
    """Return the zones in the plane.

    Parameters
    ----------
    zones
        Areas to stay out of.
    plane
        Of the scenario.
    margin_m
        What is kept from every border; of a circle 0.7 % of its radius on top, as the check of missions has it.
    """
    import shapely

    areas = plane_areas(zones, plane)
    shapes = tuple(_shape(area) for area in areas)
    kept = [margin_m + area.slack_m + ROUNDING_M for area in areas]
    closed = shapely.union_all([_grown(shape, by) for shape, by in zip(shapes, kept, strict=True)])
    turning = shapely.union_all(
        [_grown(shape, by + TURN_CLEARANCE_M) for shape, by in zip(shapes, kept, strict=True)]
    )
    core = closed.buffer(-TOUCHING_M)
    corners = shapely.get_coordinates(turning.simplify(TOUCHING_M))
    shapely.prepare(core)
    free = ~shapely.intersects(core, shapely.points(corners))
    return KeepOut(
        tuple(area.label for area in areas), shapes, closed, core, np.unique(corners[free], axis=0)
    )


def _shape(area: PlaneArea) -> Shape:
    """Return a zone as a polygon; a circle as one about it."""
    import shapely

    if isinstance(area, PlanePolygon):
        return shapely.make_valid(shapely.Polygon(area.ring_m))
    angles = 2 * math.pi * np.arange(CIRCLE_SIDES) / CIRCLE_SIDES
    radius_m = area.radius_m / math.cos(math.pi / CIRCLE_SIDES)
    return shapely.Polygon(area.centre_m + radius_m * np.column_stack([np.cos(angles), np.sin(angles)]))


def _grown(shape: Shape, by_m: float) -> Shape:
    return shape.buffer(by_m, join_style="mitre", mitre_limit=MITRE_LIMIT)
