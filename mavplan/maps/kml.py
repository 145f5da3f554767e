"""KML 2.2 and KMZ, for Google Earth and its kin (https://docs.ogc.org/is/12-007r2/12-007r2.html)."""

import io
import math
import zipfile
from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element

from mavplan.maps.content import MappedStop, MappedUser, Place, PlanMap
from mavplan.maps.xml_writing import add, document
from mavplan.mission.geofence import FenceCircle

_NAMESPACE = "http://www.opengis.net/kml/2.2"
_STYLES = {"home": "ff2c8a00", "stop": "ff0045d6", "air": "ffb4771f", "d2d": "ff9467bd", "rally": "ff8c564b"}
"""Colours as KML has them: alpha, blue, green, red."""
_CIRCLE_POINTS = 72
_MEAN_RADIUS_M = 6_371_008.8
"""Of the Earth (IUGG); a drawn circle is 0.3 % off at most by it."""
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The same plan is the same archive, whenever it is written."""


def to_kml(content: PlanMap) -> str:
    """Return the map as KML: stops and path at their height above the sea, users on the ground, the fence as areas."""
    root = Element("kml", xmlns=_NAMESPACE)
    top = add(root, "Document")
    add(top, "name", content.title)
    _add_styles(top)
    _add_point(top, "Home", "home", content.home.lon_deg, content.home.lat_deg)
    flight = add(top, "Folder")
    add(flight, "name", "Flight")
    _add_path(flight, content.path)
    for stop in content.stops:
        _add_stop(flight, stop)
    if content.users:
        people = add(top, "Folder")
        add(people, "name", "Users")
        for user in content.users:
            _add_user(people, user)
    if content.radius_m is not None:
        reach = add(top, "Folder")
        add(reach, "name", f"Coverage, {content.radius_m:,.0f} m")
        for stop in content.stops:
            ring = circle_deg(stop.place.lat_deg, stop.place.lon_deg, content.radius_m)
            _add_area(reach, stop.title, "coverage", ring)
    _add_fence(top, content)
    return document(root)


def to_kmz(content: PlanMap) -> bytes:
    """Return the map as KMZ: the KML, packed."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", _EPOCH), to_kml(content), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def circle_deg(lat_deg: float, lon_deg: float, radius_m: float) -> list[tuple[float, float]]:
    """Return a closed ring of (latitude, longitude) at a distance from a place, on a sphere."""
    lat, arc = math.radians(lat_deg), radius_m / _MEAN_RADIUS_M
    ring = []
    for step in range(_CIRCLE_POINTS):
        bearing = 2 * math.pi * step / _CIRCLE_POINTS
        to_lat = math.asin(math.sin(lat) * math.cos(arc) + math.cos(lat) * math.sin(arc) * math.cos(bearing))
        east = math.atan2(
            math.sin(bearing) * math.sin(arc) * math.cos(lat),
            math.cos(arc) - math.sin(lat) * math.sin(to_lat),
        )
        ring.append((math.degrees(to_lat), (lon_deg + math.degrees(east) + 540) % 360 - 180))
    return [*ring, ring[0]]


def _add_styles(top: Element) -> None:
    for name, colour in _STYLES.items():
        style = add(top, "Style", id=name)
        add(add(style, "IconStyle"), "color", colour)
    path = add(top, "Style", id="path")
    line = add(path, "LineStyle")
    add(line, "color", "ff0045d6")
    add(line, "width", 3)
    for name, colour in (("coverage", "330045d6"), ("inclusion", "2200aa00"), ("exclusion", "550000d0")):
        style = add(top, "Style", id=name)
        add(add(style, "LineStyle"), "color", "ff" + colour[2:])
        add(add(style, "PolyStyle"), "color", colour)


def _add_point(
    parent: Element, name: str, style: str, lon_deg: float, lat_deg: float, alt_amsl_m: float | None = None
) -> Element:
    mark = add(parent, "Placemark")
    add(mark, "name", name)
    add(mark, "styleUrl", f"#{style}")
    point = add(mark, "Point")
    if alt_amsl_m is not None:
        add(point, "altitudeMode", "absolute")
    height = "" if alt_amsl_m is None else f",{alt_amsl_m:.2f}"
    add(point, "coordinates", f"{lon_deg:.7f},{lat_deg:.7f}{height}")
    return mark


def _add_data(mark: Element, values: Iterable[tuple[str, object]]) -> None:
    extended = Element("ExtendedData")
    for name, value in values:
        add(add(extended, "Data", name=name), "value", value)
    mark.insert(2, extended)  # KML wants it before the geometry


def _add_stop(parent: Element, stop: MappedStop) -> None:
    place = stop.place
    mark = _add_point(parent, stop.title, "stop", place.lon_deg, place.lat_deg, place.alt_amsl_m)
    values: list[tuple[str, object]] = [("hold_s", f"{stop.hold_s:g}"), ("alt_rel_m", f"{place.alt_rel_m:g}")]
    if stop.users:
        values.append(("users", ", ".join(stop.users)))
    _add_data(mark, values)


def _add_user(parent: Element, user: MappedUser) -> None:
    mark = _add_point(parent, user.name, "d2d" if user.d2d else "air", user.lon_deg, user.lat_deg)
    values: list[tuple[str, object]] = [
        ("demand_mbit", f"{user.demand_mbit:g}"),
        ("stop", user.stop),
        ("via", "d2d" if user.d2d else "air"),
    ]
    _add_data(mark, [*values, ("mate", user.mate)] if user.mate else values)


def _add_path(parent: Element, path: Sequence[Place]) -> None:
    mark = add(parent, "Placemark")
    add(mark, "name", "Path")
    add(mark, "styleUrl", "#path")
    line = add(mark, "LineString")
    add(line, "altitudeMode", "absolute")
    add(line, "coordinates", " ".join(f"{p.lon_deg:.7f},{p.lat_deg:.7f},{p.alt_amsl_m:.2f}" for p in path))


def _add_area(parent: Element, name: str, style: str, ring: Sequence[tuple[float, float]]) -> None:
    mark = add(parent, "Placemark")
    add(mark, "name", name)
    add(mark, "styleUrl", f"#{style}")
    border = add(add(add(mark, "Polygon"), "outerBoundaryIs"), "LinearRing")
    add(border, "coordinates", " ".join(f"{lon:.7f},{lat:.7f}" for lat, lon in ring))


def _add_fence(top: Element, content: PlanMap) -> None:
    if content.fence:
        fence = add(top, "Folder")
        add(fence, "name", "Fence")
        for label, area in content.fence.labelled():
            if isinstance(area, FenceCircle):
                ring = circle_deg(area.lat_e7 / 1e7, area.lon_e7 / 1e7, area.radius_m)
            else:
                ring = [(lat / 1e7, lon / 1e7) for lat, lon in (*area.vertices_e7, area.vertices_e7[0])]
            _add_area(fence, label, "inclusion" if area.inclusion else "exclusion", ring)
    for number, point in enumerate(content.rally, start=1):
        name = f"Rally point {number}" + (f" ({point.name})" if point.name else "")
        _add_point(top, name, "rally", point.lon_e7 / 1e7, point.lat_e7 / 1e7)
