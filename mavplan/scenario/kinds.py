"""What kind of users file it is: by its content, and by the ending of its name only where the content is plain text."""

import io
import zipfile
from enum import Enum

from mavplan.scenario.report import Report, figure, listed, shown

MAX_UNPACKED_BYTES = 256 * 1024 * 1024
MAX_ENTRIES = 10_000
MAX_RATIO = 300
"""A zip archive that grows by more than this was made to fill memories; office files grow 5 to 30 times."""
RATIO_FROM_BYTES = 1024 * 1024
"""Smaller entries may grow as they like."""


class Kind(Enum):
    """A users file's format; the value is what people call it."""

    TEXT = "CSV"
    GEOJSON = "GeoJSON"
    KML = "KML"
    KMZ = "KMZ"
    GPX = "GPX"
    XLSX = "XLSX"


ENDINGS: dict[str, Kind] = {
    ".csv": Kind.TEXT,
    ".tsv": Kind.TEXT,
    ".txt": Kind.TEXT,
    ".geojson": Kind.GEOJSON,
    ".json": Kind.GEOJSON,
    ".kml": Kind.KML,
    ".kmz": Kind.KMZ,
    ".gpx": Kind.GPX,
    ".xlsx": Kind.XLSX,
}
"""Kinds by the ending of a file's name."""

_OFFICE_97 = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"


def kind_of(data: bytes, ending: str, label: str, report: Report) -> Kind | None:
    """Return the format of a users file, or None with a problem noted.

    Parameters
    ----------
    data
        Its content.
    ending
        Of its name, with the dot.
    label
        What to call it in problems.
    report
        Takes the problem of a file that is nothing that can be read, and a warning where name and content differ.
    """
    named = ENDINGS.get(ending.lower())
    try:
        found = _kind_of_zip(data) if data.startswith(b"PK\x03\x04") else _kind_of_text(data)
    except _NotReadError as fault:
        report.error(label, str(fault), "file-type")
        return None
    if found is None:
        # Nothing that only one format begins with: JSON cut off, or a table.
        found = named if named is Kind.GEOJSON else Kind.TEXT
    if named is not None and found is not named:
        message = f"is {found.value} by its content, whatever its name: it is read as {found.value}"
        report.warning(label, message, "file-type")
    return found


class _NotReadError(Exception):
    """The content is something that is not read; the message is the clause that says so."""


def _kind_of_text(data: bytes) -> Kind | None:
    """Return the format that the first characters show, if they show one."""
    head = data[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    lower = head.lower()
    if head.startswith(_OFFICE_97):
        raise _NotReadError("is an Excel 97 file (.xls); save it as .xlsx or .csv")
    if head.startswith((b"{", b"[")):
        return Kind.GEOJSON
    if not head.startswith(b"<"):
        return None
    for name, kind in ((b"kml", Kind.KML), (b"gpx", Kind.GPX)):
        if b"<" + name in lower or b":" + name + b" " in lower:
            return kind
    if b"<html" in lower or b"<!doctype html" in lower:
        raise _NotReadError("is a web page; save the data itself, not the page that shows it")
    raise _NotReadError("is XML, but neither KML nor GPX")


def _kind_of_zip(data: bytes) -> Kind:
    """Return what a zip archive is, its directory looked at, nothing unpacked."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
        raise _NotReadError(f"is a damaged zip archive: {error}") from None
    unpacked = sum(entry.file_size for entry in entries)
    if len(entries) > MAX_ENTRIES or unpacked > MAX_UNPACKED_BYTES:
        raise _NotReadError(
            f"unpacks to {figure(unpacked)} bytes in {figure(len(entries))} files; at most "
            f"{figure(MAX_UNPACKED_BYTES)} bytes in {figure(MAX_ENTRIES)} files are read"
        )
    for entry in entries:
        if entry.file_size > max(RATIO_FROM_BYTES, MAX_RATIO * max(entry.compress_size, 1)):
            raise _NotReadError(
                f"grows more than {MAX_RATIO} times when unpacked ({shown(entry.filename)}): it is not read"
            )
        if entry.flag_bits & 0x1:
            raise _NotReadError("is encrypted; save it without a password")
    names = [entry.filename for entry in entries]
    if "xl/workbook.xml" in names:
        return Kind.XLSX
    if any(name.lower().endswith(".kml") for name in names):
        return Kind.KMZ
    if "content.xml" in names and "mimetype" in names:
        raise _NotReadError("is an OpenDocument file; save it as .xlsx or .csv")
    raise _NotReadError(f"is a zip archive of {listed(names, 3)}; unpack it and name the users file in it")
