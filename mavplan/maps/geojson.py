"""GeoJSON (RFC 7946): points of home, stops and users, the path as a line, the fence's polygons."""

import itertools
from typing import Any

from mavplan.json_layout import laid_out
from mavplan.maps.content import PlanMap
from mavplan.mission.geofence import FencePolygon


def to_geojson(content: PlanMap) -> str:
    """Return the map as a FeatureCollection; property ``kind`` tells its features apart.

    A height in a GeoJSON position is above the WGS84 ellipsoid, which is not known here: those of stops stand as
    properties, above home.
    """
    features = [
        _point("home", content.home.lat_deg, content.home.lon_deg, alt_amsl_m=content.home.alt_amsl_m)
    ]
    line = [_position(place.lat_deg, place.lon_deg) for place in content.path]
    if len(line) > 1:
        features.append(_feature("path", {"type": "LineString", "coordinates": line}))
    for stop in content.stops:
        place = stop.place
        features.append(
            _point(
                "stop",
                place.lat_deg,
                place.lon_deg,
                number=stop.number,
                alt_rel_m=place.alt_rel_m,
                hold_s=stop.hold_s,
                users=list(stop.users),
                **({"name": stop.name} if stop.name else {}),
            )
        )
    for user in content.users:
        features.append(
            _point(
                "user",
                user.lat_deg,
                user.lon_deg,
                name=user.name,
                demand_mbit=user.demand_mbit,
                stop=user.stop,
                via="d2d" if user.d2d else "air",
                mate=user.mate or None,
            )
        )
    features += _fence(content)
    for point in content.rally:
        features.append(
            _point(
                "rally", point.lat_e7 / 1e7, point.lon_e7 / 1e7, alt_rel_m=point.alt_rel_m, name=point.name
            )
        )
    collection = {"type": "FeatureCollection", "name": content.title, "features": features}
    return laid_out(collection)


def _fence(content: PlanMap) -> list[dict[str, Any]]:
    """Return polygons as such, circles as their centre with a radius: GeoJSON has none."""
    found = []
    for label, area in content.fence.labelled() if content.fence else ():
        side = "inclusion" if area.inclusion else "exclusion"
        if isinstance(area, FencePolygon):
            ring = [_position(lat / 1e7, lon / 1e7) for lat, lon in (*area.vertices_e7, area.vertices_e7[0])]
            if _is_clockwise(ring):
                ring.reverse()
            geometry = {"type": "Polygon", "coordinates": [ring]}
            found.append(_feature("fence", geometry, name=label, side=side))
        else:
            at = (area.lat_e7 / 1e7, area.lon_e7 / 1e7)
            found.append(_point("fence", *at, name=label, side=side, radius_m=area.radius_m))
    return found


def _is_clockwise(ring: list[list[float]]) -> bool:
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in itertools.pairwise(ring))
    return area < 0


def _position(lat_deg: float, lon_deg: float) -> list[float]:
    return [round(lon_deg, 7), round(lat_deg, 7)]


def _point(kind: str, lat_deg: float, lon_deg: float, **properties: Any) -> dict[str, Any]:
    return _feature(kind, {"type": "Point", "coordinates": _position(lat_deg, lon_deg)}, **properties)


def _feature(kind: str, geometry: dict[str, Any], **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}
