"""No-fly zones from a file that somebody else drew: the polygons of GeoJSON or KML, in their order."""

import json
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from mavplan.geo import E7
from mavplan.mission.geofence import FencePolygon, area_faults
from mavplan.scenario.files import decode, json_fault, read_bytes
from mavplan.scenario.kinds import Kind, kind_of
from mavplan.scenario.report import Report, shown
from mavplan.scenario.users_geojson import is_wgs84
from mavplan.scenario.users_kml import NETWORK_LINK
from mavplan.scenario.xml_reading import child, elements, local_name, text_of

MAX_BYTES = 16 * 1024 * 1024
MAX_ZONES = 1000

Ring = list[tuple[float, float]]
"""Latitude and longitude of each corner, degrees."""


def read_zones(path: Path, place: str, report: Report) -> list[FencePolygon]:
    """Return every polygon of a file as a zone to stay out of; a hole in one counts as part of it, with a warning.

    Parameters
    ----------
    path
        GeoJSON or KML.
    place
        Where the scenario names it, for the zones' labels.
    report
        Takes the problems.
    """
    label = str(path)
    data = read_bytes(path, label, MAX_BYTES, report)
    kind = None if data is None else kind_of(data, path.suffix, label, report)
    if data is None or kind is None:
        return []
    before = report.count
    if kind is Kind.GEOJSON:
        rings = _from_geojson(data, label, report)
    elif kind is Kind.KML:
        rings = _from_kml(data, label, report)
    else:
        report.error(label, f"is {kind.value}; zones are read from GeoJSON and KML", "file-type")
        return []
    if not rings and report.count == before:
        report.error(label, "has no polygon in it; a zone is one", "empty")
    if len(rings) > MAX_ZONES:
        report.error(label, f"has {len(rings):,} polygons; at most {MAX_ZONES:,} are read", "too-many")
        return []
    zones = []
    for number, (name, ring) in enumerate(rings, start=1):
        shown_name = _printable(name) or f"{place}, polygon {number}"
        vertices = tuple((round(lat * E7), round(lon * E7)) for lat, lon in ring)
        zone = FencePolygon(False, vertices, shown_name)
        faults = list(area_faults(zone))
        for message, code in faults:
            report.error(f"{label}, polygon {number}", message, code)
        zones += [] if faults else [zone]
    return zones


def _from_geojson(data: bytes, label: str, report: Report) -> list[tuple[str, Ring]]:
    text = decode(data, label, report)
    if text is None:
        return []
    try:
        root = json.loads(text)
    except (ValueError, RecursionError) as error:
        report.error(label, f"is not JSON that can be read: {json_fault(error)}", "syntax")
        return []
    if isinstance(root, dict) and not is_wgs84(root, label, report):
        return []
    features = root.get("features", [root]) if isinstance(root, dict) else []
    found: list[tuple[str, Ring]] = []
    passed_over = 0
    for number, feature in enumerate(features if isinstance(features, list) else [], start=1):
        where = f"{label}, feature {number:,}"
        if not isinstance(feature, dict):
            report.error(where, f"found {shown(feature)}; allowed is a Feature", "not-geojson")
            continue
        geometry = feature.get("geometry", feature)
        if not all(is_wgs84(part, where, report) for part in (feature, geometry) if isinstance(part, dict)):
            continue
        properties = feature.get("properties")
        name = properties.get("name", "") if isinstance(properties, dict) else ""
        kind = geometry.get("type") if isinstance(geometry, dict) else None
        if kind == "GeometryCollection":
            report.error(
                where, "is a GeometryCollection; save its polygons as features of their own", "geometry"
            )
            continue
        if kind not in ("Polygon", "MultiPolygon"):
            passed_over += 1
            continue
        coordinates = geometry.get("coordinates")
        polygons = [coordinates] if kind == "Polygon" else coordinates
        for rings in polygons if isinstance(polygons, list) else []:
            ring = _ring(rings[0]) if isinstance(rings, list) and rings else None
            if ring is None:
                report.error(where, "its corners are not [longitude, latitude] in degrees", "geometry")
                continue
            _note_holes(len(rings) - 1, where, report)
            found.append((str(name), ring))
    if found and passed_over:
        message = f"{passed_over:,} of its features are no polygons, and so no zones"
        report.warning(label, message, "not-used")
    return found


def _ring(found: Any) -> Ring | None:
    """Return a GeoJSON ring, not closed; None where a corner is none."""
    if not isinstance(found, list) or len(found) < 3:
        return None
    ring: Ring = []
    for corner in found:
        numbers = corner[:2] if isinstance(corner, list) and len(corner) >= 2 else []
        if not numbers or not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers):
            return None
        if not all(abs(number) <= 1000 for number in numbers):
            return None
        ring.append((float(numbers[1]), float(numbers[0])))
    return _open(ring)


def _from_kml(data: bytes, label: str, report: Report) -> list[tuple[str, Ring]]:
    found: list[tuple[str, Ring]] = []
    number = 0
    for placemark in elements(data, frozenset({"Placemark", "NetworkLink"}), label, report):
        if local_name(placemark) == "NetworkLink":
            report.error(label, NETWORK_LINK, "network-link")
            continue
        number += 1
        where = f"{label}, placemark {number:,}"
        name = text_of(child(placemark, "name"))
        for polygon in (element for element in placemark.iter() if local_name(element) == "Polygon"):
            ring = _kml_ring(polygon)
            if ring is None:
                report.error(
                    where, "its corners are not longitude,latitude in degrees, three at least", "geometry"
                )
                continue
            _note_holes(sum(local_name(part) == "innerBoundaryIs" for part in polygon), where, report)
            found.append((name, ring))
    return found


def _kml_ring(polygon: Element) -> Ring | None:
    outer = child(polygon, "outerBoundaryIs")
    line = child(outer, "LinearRing") if outer is not None else None
    words = text_of(child(line, "coordinates")).split() if line is not None else []
    try:
        ring = [(float(parts[1]), float(parts[0])) for parts in (word.split(",") for word in words)]
    except (ValueError, IndexError):
        return None
    sound = all(abs(number) <= 1000 for corner in ring for number in corner)
    return _open(ring) if len(ring) >= 3 and sound else None


def _open(ring: Ring) -> Ring:
    return ring[:-1] if ring[0] == ring[-1] else ring


def _note_holes(holes: int, where: str, report: Report) -> None:
    if holes > 0:
        message = "has a hole in it, which counts as part of the zone: nobody flies there either"
        report.warning(where, message, "hole")


def _printable(name: str) -> str:
    return "".join(character if character.isprintable() else " " for character in name[:60]).strip()
