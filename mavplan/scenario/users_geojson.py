"""Users from GeoJSON (RFC 7946): a point feature a user, longitude first, WGS84."""

import json
import re
from collections.abc import Mapping
from typing import Any

from mavplan.scenario.files import json_fault
from mavplan.scenario.report import Report, key_name, shown
from mavplan.scenario.table import Row, Table

_WGS84 = re.compile(
    r"(urn:ogc:def:crs:)?(OGC:[0-9.]*:?CRS84|EPSG:[0-9.]*:?4326)"
    r"|https?://www\.opengis\.net/def/crs/(OGC/[0-9.]+/CRS84|EPSG/[0-9.]+/4326)|(WGS ?84|CRS84)",
    re.IGNORECASE,
)


def read_geojson(text: str, label: str, report: Report) -> Table | None:
    """Return the point features of a GeoJSON file, or None where there is no collection of features.

    Parameters
    ----------
    text
        Content of the file.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    try:
        root = json.loads(text)
    except json.JSONDecodeError as error:
        message = f"is not valid JSON: {error.msg} (column {error.colno})"
        report.error(f"{label}, line {error.lineno:,}", message, "syntax")
        return None
    except (ValueError, RecursionError) as error:
        # A number of thousands of digits, brackets nested without end.
        report.error(label, f"is not JSON that can be read: {json_fault(error)}", "syntax")
        return None
    features = _features_of(root, label, report)
    if features is None:
        return None
    rows: list[Row] = []
    columns: dict[str, None] = {}
    for number, feature in enumerate(features, start=1):
        place = f"{label}, feature {number:,}"
        if not isinstance(feature, dict) or feature.get("type") != "Feature":
            kind = feature.get("type") if isinstance(feature, dict) else feature
            report.error(place, f"found {shown(kind)}; allowed is a Feature", "not-geojson")
            continue
        properties = feature.get("properties")
        if properties is None:
            properties = {}
        if not isinstance(properties, dict):
            report.error(place, f"its properties are {shown(properties)}; allowed is a table", "not-geojson")
            properties = {}
        columns.update(dict.fromkeys(properties))
        position = None
        if is_wgs84(feature, place, report):
            position = _position_of(feature.get("geometry"), place, report)
        rows.append(Row(number, properties, position))
    return Table(label, "feature", "property", tuple(columns), rows, has_geometry=True)


def _features_of(root: Any, label: str, report: Report) -> list[Any] | None:
    kind = root.get("type") if isinstance(root, dict) else None
    if kind == "Feature":
        return [root]
    if kind == "FeatureCollection":
        if not isinstance(root.get("features"), list):
            report.error(label, "its features are missing or no list", "not-geojson")
            return None
        return root["features"] if is_wgs84(root, label, report) else None
    found = shown(root if kind is None else kind)
    report.error(label, f"found {found}; allowed is a FeatureCollection of points", "not-geojson")
    return None


def is_wgs84(holder: Mapping[str, Any], place: str, report: Report) -> bool:
    """Return whether an object is in WGS84: says nothing of its reference system, or says so."""
    crs = holder.get("crs")
    if crs is None:
        return True
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if isinstance(name, str) and _WGS84.fullmatch(name.strip().replace("::", ":")):
        return True
    found = shown(crs if name is None else name)
    message = (
        f"its coordinates are in {found}; allowed is WGS84 (longitude and latitude in degrees, EPSG:4326)"
    )
    report.error(f"{place}, crs", message, "not-wgs84")
    return False


def _position_of(geometry: Any, place: str, report: Report) -> tuple[object, object] | None:
    """Return latitude and longitude of a Point, or of a MultiPoint of one, unchecked."""
    place = f"{place}, geometry"
    if not isinstance(geometry, dict):
        found = "has none" if geometry is None else f"found {shown(geometry)}"
        report.error(place, f"{found}; allowed is a Point", "geometry")
        return None
    if not is_wgs84(geometry, place, report):
        return None
    coordinates = _coordinates_of(geometry)
    if isinstance(coordinates, str):
        report.error(place, coordinates, "geometry")
        return None
    return coordinates[1], coordinates[0]


def _coordinates_of(geometry: dict[str, Any]) -> list[object] | str:
    """Return longitude, latitude and what else there is, or the sentence that says why there is none."""
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if kind == "MultiPoint" and isinstance(coordinates, list):
        if len(coordinates) != 1:
            return f"found a MultiPoint of {len(coordinates):,} points; allowed is one point a user"
        coordinates = coordinates[0]
    elif kind != "Point":
        return f"found {f'a {key_name(kind)}' if isinstance(kind, str) else shown(kind)}; allowed is a Point"
    if not isinstance(coordinates, list) or len(coordinates) < 2:
        return f"its coordinates are {shown(coordinates)}; allowed is longitude and latitude, in this order"
    return coordinates
