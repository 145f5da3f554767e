"""Users from KML and KMZ: a placemark with a point a user, longitude first, WGS84."""

import io
import lzma
import zipfile
import zlib
from xml.etree.ElementTree import Element

from mavplan.scenario.report import Report, listed
from mavplan.scenario.table import Row, Table
from mavplan.scenario.xml_reading import child, elements, local_name, text_of

_SHAPES = frozenset(
    {"Point", "LineString", "LinearRing", "Polygon", "MultiGeometry", "Model", "Track", "MultiTrack"}
)

NETWORK_LINK = "has a NetworkLink, which takes places from elsewhere; save the places themselves in the file"

_ZIP_FAULTS = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, ValueError, RuntimeError, EOFError)


def read_kml(data: bytes, label: str, report: Report) -> Table | None:
    """Return the placemarks of a KML document.

    Its name and each entry of its ExtendedData are columns. A NetworkLink, which would bring places from elsewhere, is
    refused; heights are not read.

    Parameters
    ----------
    data
        Content of the file.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    rows: list[Row] = []
    columns: dict[str, None] = {"name": None}
    noted = report.count
    for element in elements(data, frozenset({"Placemark", "NetworkLink"}), label, report):
        if local_name(element) == "NetworkLink":
            report.error(label, NETWORK_LINK, "network-link")
            continue
        number = len(rows) + 1
        cells = _cells(element)
        columns.update(dict.fromkeys(cells))
        rows.append(Row(number, cells, _position(element, f"{label}, placemark {number:,}", report)))
    if not rows and report.count > noted:
        return None
    return Table(label, "placemark", "data", tuple(columns), rows, has_geometry=True)


def read_kmz(data: bytes, label: str, report: Report) -> Table | None:
    """Return the placemarks of the KML document in a KMZ archive; sizes have been looked at already.

    Parameters as for `read_kml`.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [name for name in archive.namelist() if name.lower().endswith(".kml")]
            root = [name for name in names if "/" not in name]
            if not names or (len(root) != 1 and len(names) != 1):
                message = f"holds {listed(names, 5) if names else 'no KML'}; one KML document is expected"
                report.error(label, message, "file-type")
                return None
            document = archive.read(root[0] if len(root) == 1 else names[0])
    except _ZIP_FAULTS as error:
        report.error(label, f"is a damaged zip archive: {error}", "syntax")
        return None
    return read_kml(document, label, report)


def _cells(placemark: Element) -> dict[str, object]:
    cells: dict[str, object] = {}
    for element in placemark.iter():
        match local_name(element):
            case "Data":
                cells[str(element.get("name", ""))] = text_of(child(element, "value"))
            case "SimpleData":
                cells[str(element.get("name", ""))] = text_of(element)
    # The placemark's own name is what a map shows; data of that name gives way to it.
    cells["name"] = text_of(child(placemark, "name")) or cells.get("name", "")
    return cells


def _position(placemark: Element, place: str, report: Report) -> tuple[object, object] | None:
    """Return latitude and longitude as found, of the only point there is."""
    shapes = [element for element in placemark.iter() if local_name(element) in _SHAPES]
    points = [element for element in shapes if local_name(element) == "Point"]
    others = [local_name(e) for e in shapes if local_name(e) not in {"Point", "MultiGeometry"}]
    if len(points) != 1 or others:
        found = f"a {others[0]}" if others else f"{len(points):,} points" if points else "no place"
        report.error(place, f"has {found}; allowed is one Point a user", "geometry")
        return None
    parts = text_of(child(points[0], "coordinates")).split(",")
    if len(parts) not in {2, 3}:
        message = f"its coordinates are {listed([','.join(parts)])}; allowed is longitude,latitude"
        report.error(place, message, "geometry")
        return None
    return parts[1], parts[0]
