"""What stands round a flight on its map: no-fly zones, the areas of the fence, rally points. In metres from home."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.mission.fence_geometry import PlaneArea, PlanePolygon, plane_areas
from mavplan.scenario.model import Floats, Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ZONE, FENCE, RALLY = "#C1121F", "#7B3294", "#E69F00"
ZONE_LABEL, EXCLUSION_LABEL, FENCE_LABEL, RALLY_LABEL = (
    "no-fly zone",
    "fence: stay out",
    "fence: stay in",
    "rally point",
)
BEYOND = 0.35
"""How far a map grows for what stands round the flight: this part of its longer side, on each side."""
CIRCLE_SIDES = 128


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Outlines (K, 2) in metres, closed, and rally points (R, 2)."""

    zones_m: tuple[Floats, ...]
    exclusions_m: tuple[Floats, ...]
    inclusions_m: tuple[Floats, ...]
    rally_m: Floats

    def framed(self, flown_m: Floats) -> Floats:
        """Return (K, 2) points that a map must hold: what is flown, and what stands round it as far as it is near."""
        low, high = flown_m.min(axis=0), flown_m.max(axis=0)
        beyond_m = BEYOND * max(float((high - low).max()), 1.0)
        outlines = [*self.zones_m, *self.exclusions_m, *self.inclusions_m]
        around = np.vstack([self.rally_m, *outlines])
        near = ((around >= low - beyond_m) & (around <= high + beyond_m)).all(axis=1)
        return np.vstack([flown_m, around[near]])


def surroundings(scenario: Scenario) -> Surroundings:
    """Return what stands round the flights of a scenario, in metres from its home."""
    plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    zones = plane_areas(scenario.no_fly, plane) if scenario.no_fly else []
    fence = plane_areas(scenario.fence, plane) if scenario.fence else []
    rally = scenario.rally
    return Surroundings(
        zones_m=tuple(_outline_m(area) for area in zones),
        exclusions_m=tuple(_outline_m(area) for area in fence if not area.inclusion),
        inclusions_m=tuple(_outline_m(area) for area in fence if area.inclusion),
        rally_m=plane.to_xy_m(
            [point.lat_e7 / 1e7 for point in rally], [point.lon_e7 / 1e7 for point in rally]
        ).reshape(-1, 2),
    )


def draw_surroundings(ax: "Axes", around: Surroundings) -> "Axes":
    """Draw zones hatched, fences as outlines, rally points; what lies beyond the axes' limits is left out."""
    import shapely
    from matplotlib.patches import Polygon

    (west, east), (south, north) = ax.get_xlim(), ax.get_ylim()
    frame = shapely.box(west, south, east, north)
    for outlines, label, hatch in (
        (around.zones_m, ZONE_LABEL, "////"),
        (around.exclusions_m, EXCLUSION_LABEL, "...."),
    ):
        shown = [ring for ring in outlines if frame.intersects(shapely.Polygon(ring).buffer(0))]
        for number, ring in enumerate(shown):
            area = Polygon(
                ring, facecolor=(*_rgb(ZONE), 0.08), edgecolor=ZONE, hatch=hatch, linewidth=1.0, zorder=0.5,
                label=label if number == 0 else "_nolegend_",
            )  # fmt: skip
            ax.add_artist(area)  # no part of the limits: a zone may reach far beyond the map
    shown = [ring for ring in around.inclusions_m if frame.intersects(shapely.LinearRing(ring))]
    for number, ring in enumerate(shown):
        label = FENCE_LABEL if number == 0 else "_nolegend_"
        fence = Polygon(
            ring, facecolor="none", edgecolor=FENCE, linewidth=1.4, linestyle="-.", zorder=1, label=label
        )
        ax.add_artist(fence)
    points = around.rally_m
    near = points[
        (points[:, 0] >= west) & (points[:, 0] <= east) & (points[:, 1] >= south) & (points[:, 1] <= north)
    ]
    if len(near):
        ax.scatter(
            near[:, 0], near[:, 1], s=70, color=RALLY, marker="P", edgecolors="black", linewidths=0.6, zorder=5,
            label=RALLY_LABEL,
        )  # fmt: skip
    return ax


def _outline_m(area: PlaneArea) -> Floats:
    """Return the outline of an area, closed."""
    if isinstance(area, PlanePolygon):
        return np.vstack([area.ring_m, area.ring_m[:1]])
    angles = 2 * math.pi * np.arange(CIRCLE_SIDES + 1) / CIRCLE_SIDES
    return np.asarray(area.centre_m + area.radius_m * np.column_stack([np.cos(angles), np.sin(angles)]))


def _rgb(colour: str) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    return to_rgb(colour)
