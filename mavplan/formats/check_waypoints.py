"""The rules by which ground stations read a ``.waypoints`` file, looked for in a written file.

Made from the readers, not from our writer, and shares nothing with it: QGroundControl (tabs, exactly twelve fields, no
comment, no blank line, terrain frames lost), Mission Planner (stops at command 0, no NaN), MAVSDK's text importer (LF),
pymavlink (version 110 only, sends the file as it is).
"""

import math

from mavplan.formats.seen import Findings, SeenItem

TITLES = "sequence current frame command param1 param2 param3 param4 latitude longitude altitude autocontinue"


def check_waypoints(text: str, name: str) -> Findings:
    """Return what is wrong in the text of a ``.waypoints`` file, and what it holds as far as it can be read."""
    findings = Findings(name)
    if "\r" in text:
        findings.add("", "carriage returns: MAVSDK's reader takes line feeds only", "line-ends")
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.endswith("\n"):
        findings.add("", "does not end with a line feed", "line-ends")
    lines = text.removesuffix("\n").split("\n")
    if lines[0] != "QGC WPL 110":
        findings.add("line 1", f'found "{lines[0][:40]}", must be "QGC WPL 110"', "version")
    for sequence, line in enumerate(lines[1:]):
        _line(findings, line, sequence, f"line {sequence + 2}")
    if len(lines) < 2:
        findings.add("", "has no home line", "home")
    return findings


def _line(findings: Findings, line: str, sequence: int, place: str) -> None:
    if not line.strip() or line.startswith("#"):
        findings.add(place, "a blank line or a comment: QGroundControl calls such a file corrupted", "fields")
        return
    fields = line.split("\t")
    if len(fields) != 12:
        findings.add(place, f"{len(fields)} fields between tabs, must be exactly 12", "fields")
        return
    values: list[float] = []
    for k, (title, field) in enumerate(zip(TITLES.split(), fields, strict=True)):
        values.append(_value(findings, field, k in (0, 1, 2, 3, 11), f"{place}, {title}"))
    if any(math.isnan(value) for value in values):
        return
    _flags(findings, values, sequence, place)
    _frame_and_command(findings, int(values[2]), int(values[3]), place)
    for k in (8, 9):
        decimals = len(fields[k].partition(".")[2])
        if decimals < 7 and values[k] != 0:
            found = f"{decimals} decimals are up to {11.1 * 10 ** (5 - decimals) / 2:.2g} m off: 7 are needed"
            findings.add(f"{place}, {TITLES.split()[k]}", found, "decimals")
    if sequence == 0:
        _home(findings, values, place)
    else:
        findings.items.append(SeenItem(place, int(values[3]), int(values[2]), *values[4:11]))


def _flags(findings: Findings, values: list[float], sequence: int, place: str) -> None:
    if values[0] != sequence:
        findings.add(f"{place}, sequence", f"found {values[0]:g}, must be {sequence}", "sequence")
    if values[1] != (1 if sequence == 0 else 0):
        findings.add(
            f"{place}, current", f"found {values[1]:g}, must be 1 on home's line, 0 below", "current"
        )
    if values[11] != 1:
        findings.add(f"{place}, autocontinue", f"found {values[11]:g}, must be 1", "autocontinue")


def _frame_and_command(findings: Findings, frame: int, command: int, place: str) -> None:
    if command == 0:
        findings.add(f"{place}, command", "command 0: Mission Planner stops reading here", "command-0")
    if frame in (10, 11):
        found = f"frame {frame}: QGroundControl reads it from this format as above sea level"
        findings.add(f"{place}, frame", found, "terrain")
    elif frame not in (0, 2, 3):
        findings.add(f"{place}, frame", f"frame {frame} is not one that files use: 0, 2 or 3", "frame")


def _home(findings: Findings, values: list[float], place: str) -> None:
    findings.home = (values[8], values[9], values[10])
    if values[2] != 0 or values[3] != 16 or any(values[4:8]):
        findings.add(place, "must be home: frame 0, command 16, four zeros", "home")


def _value(findings: Findings, field: str, whole: bool, place: str) -> float:
    plain = field.removeprefix("-")
    digits = plain if whole else plain.replace(".", "", 1)
    if digits.isascii() and digits.isdigit() and math.isfinite(float(field)):
        return float(field)
    kind = "a whole number" if whole else "a plain decimal number"
    findings.add(place, f'found "{field[:40]}", must be {kind}', "number")
    return math.nan
