"""A scenario moved to another home: everything keeps its place in metres east and north, and its height above home."""

from dataclasses import replace

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.mission.geofence import Fence, FenceCircle, RallyPoint
from mavplan.scenario import Home, Scenario


def moved(scenario: Scenario, home: Home) -> Scenario:
    """Return the scenario about another home."""
    old, new = (LocalPlane(place.lat_deg, place.lon_deg) for place in (scenario.home, home))

    def places_e7(places):
        lat, lon = np.array(places, dtype=float).reshape(-1, 2).T / 1e7
        lat_e7, lon_e7 = new.to_e7(old.to_xy_m(lat, lon))
        return tuple(zip(lat_e7.tolist(), lon_e7.tolist(), strict=True))

    def circle(area: FenceCircle):
        ((lat_e7, lon_e7),) = places_e7([(area.lat_e7, area.lon_e7)])
        return replace(area, lat_e7=lat_e7, lon_e7=lon_e7)

    def fence(areas: Fence | None):
        if areas is None:
            return None
        polygons = tuple(replace(area, vertices_e7=places_e7(area.vertices_e7)) for area in areas.polygons)
        return Fence(polygons, tuple(circle(area) for area in areas.circles))

    def rally(point: RallyPoint):
        ((lat_e7, lon_e7),) = places_e7([(point.lat_e7, point.lon_e7)])
        return replace(point, lat_e7=lat_e7, lon_e7=lon_e7)

    lat_deg, lon_deg = new.to_lat_lon_deg(scenario.users.xy_m)
    return replace(
        scenario,
        home=home,
        users=replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg),
        fence=fence(scenario.fence),
        no_fly=fence(scenario.no_fly),
        rally=tuple(rally(point) for point in scenario.rally),
    )
