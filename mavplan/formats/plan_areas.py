"""The ``geoFence`` and ``rallyPoints`` sections of a ``.plan``: to JSON and back, every problem with its place."""

from collections.abc import Callable
from typing import Any, TypeVar

from mavplan.formats import values
from mavplan.formats.json_values import is_number, is_whole, shown
from mavplan.mission.geofence import (
    Fence,
    FenceCircle,
    FencePolygon,
    RallyPoint,
    area_faults,
    rally_faults,
)

AREA_VERSION = 1
MAX_AREAS = 1_000
"""More than any vehicle holds; a file with more is no plan of anybody's."""

Area = TypeVar("Area", FencePolygon, FenceCircle)
Add = Callable[[str, str, str], None]
"""Notes a problem: place in the file, message, code."""


def fence_section(fence: Fence | None) -> dict[str, Any]:
    """Return the ``geoFence`` section, which is there also without a fence."""
    fence = fence or Fence()
    return {
        "circles": [
            {
                "circle": {
                    "center": [circle.lat_e7 / 1e7, circle.lon_e7 / 1e7],
                    "radius": values.json_number(circle.radius_m),
                },
                "inclusion": circle.inclusion,
                "version": AREA_VERSION,
            }
            for circle in fence.circles
        ],
        "polygons": [
            {
                "inclusion": polygon.inclusion,
                "polygon": [[lat_e7 / 1e7, lon_e7 / 1e7] for lat_e7, lon_e7 in polygon.vertices_e7],
                "version": AREA_VERSION,
            }
            for polygon in fence.polygons
        ],
        "version": 2,
    }


def rally_section(rally: tuple[RallyPoint, ...]) -> dict[str, Any]:
    """Return the ``rallyPoints`` section, which is there also without any; altitudes above home."""
    points = [[p.lat_e7 / 1e7, p.lon_e7 / 1e7, values.json_number(p.alt_rel_m)] for p in rally]
    return {"points": points, "version": 2}


def read_fence(section: dict[str, Any], add: Add) -> Fence | None:
    """Return the fence of a ``geoFence`` section; None where there is no area, or none that can be taken."""
    polygons = [_polygon(entry, place, add) for entry, place in _entries(section, "geoFence.polygons", add)]
    circles = [_circle(entry, place, add) for entry, place in _entries(section, "geoFence.circles", add)]
    fence = Fence(
        tuple(polygon for polygon in polygons if polygon is not None),
        tuple(circle for circle in circles if circle is not None),
    )
    return fence or None


def read_rally(section: dict[str, Any], add: Add) -> tuple[RallyPoint, ...]:
    """Return the rally points of a ``rallyPoints`` section."""
    points: list[RallyPoint] = []
    for entry, place in _entries(section, "rallyPoints.points", add):
        if not isinstance(entry, list) or len(entry) != 3 or not all(is_number(value) for value in entry):
            allowed = "three numbers are expected: latitude, longitude, metres above home"
            add(place, f"found {shown(entry)}, {allowed}", "rally")
            continue
        lat_deg, lon_deg, alt_m = entry
        if not _is_place(lat_deg, lon_deg, place, add):
            continue
        wrong = values.alt_problem(float(alt_m), place)
        if wrong is not None:
            add(place, wrong.message, wrong.code)
            continue
        point = RallyPoint(values.to_e7(lat_deg), values.to_e7(lon_deg), float(alt_m))
        for message, code in rally_faults(point):
            add(place, message, code)
        points.append(point)
    return tuple(points)


def _entries(section: dict[str, Any], path: str, add: Add) -> list[tuple[Any, str]]:
    """Return what a list of a section holds, each with its place; a list that is missing is empty."""
    found = section.get(path.rpartition(".")[2], [])
    if not isinstance(found, list):
        add(path, f"found {shown(found)}, a list is expected", "section")
        return []
    if len(found) > MAX_AREAS:
        add(path, f"{len(found):,} entries; at most {MAX_AREAS:,} are taken", "count")
        return []
    return [(entry, f"{path}[{k}]") for k, entry in enumerate(found)]


def _inclusion(entry: Any, place: str, add: Add) -> bool | None:
    """Return on which side of an area to stay; None with the problem noted."""
    if not isinstance(entry, dict):
        add(place, f"found {shown(entry)}, an object is expected", "fence")
        return None
    version, inclusion = entry.get("version"), entry.get("inclusion")
    if not is_whole(version) or version != AREA_VERSION:
        add(f"{place}.version", f"found {shown(version)}, only version {AREA_VERSION} is known", "version")
    if not isinstance(inclusion, bool):
        add(f"{place}.inclusion", f"found {shown(inclusion)}, true or false is expected", "fence")
        return None
    return inclusion


def _polygon(entry: Any, place: str, add: Add) -> FencePolygon | None:
    inclusion = _inclusion(entry, place, add)
    if inclusion is None:
        return None
    found = entry.get("polygon")
    if not isinstance(found, list):
        add(f"{place}.polygon", f"found {shown(found)}, a list of vertices is expected", "fence")
        return None
    vertices = [_vertex(pair, f"{place}.polygon[{k}]", add) for k, pair in enumerate(found)]
    if None in vertices:
        return None
    kept = tuple(vertex for vertex in vertices if vertex is not None)
    return _sound(FencePolygon(inclusion, kept), place, add)


def _circle(entry: Any, place: str, add: Add) -> FenceCircle | None:
    inclusion = _inclusion(entry, place, add)
    if inclusion is None:
        return None
    found = entry.get("circle")
    if not isinstance(found, dict):
        add(f"{place}.circle", f"found {shown(found)}, an object is expected", "fence")
        return None
    centre = _vertex(found.get("center"), f"{place}.circle.center", add)
    radius_m = found.get("radius")
    if radius_m is None or not is_number(radius_m):
        add(f"{place}.circle.radius", f"found {shown(radius_m)}, a number of metres is expected", "fence")
        return None
    if centre is None:
        return None
    return _sound(FenceCircle(inclusion, *centre, float(radius_m)), place, add)


def _vertex(pair: Any, place: str, add: Add) -> tuple[int, int] | None:
    if not isinstance(pair, list) or len(pair) != 2 or not all(is_number(value) for value in pair):
        add(place, f"found {shown(pair)}, two numbers are expected: latitude, longitude", "fence")
        return None
    lat_deg, lon_deg = pair
    return (values.to_e7(lat_deg), values.to_e7(lon_deg)) if _is_place(lat_deg, lon_deg, place, add) else None


def _is_place(lat_deg: float, lon_deg: float, place: str, add: Add) -> bool:
    wrong = [values.lat_problem(lat_deg, place), values.lon_problem(lon_deg, place)]
    for problem in wrong:
        if problem is not None:
            add(place, problem.message, problem.code)
    return wrong == [None, None]


def _sound(area: Area, place: str, add: Add) -> Area | None:
    faults = list(area_faults(area))
    for message, code in faults:
        add(place, message, code)
    return None if faults else area
