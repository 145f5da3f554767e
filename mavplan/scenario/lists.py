"""Reading fence areas, no-fly zones and rally points: lists of tables, every problem noted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from mavplan.geo import E7
from mavplan.mission.geofence import Fence, FenceArea, FenceCircle, FencePolygon, RallyPoint, area_faults
from mavplan.scenario.reference import AREA_KEYS, AREA_LISTS, LISTED, NO_FLY_KEYS, keys_of
from mavplan.scenario.report import Report, key_name, listed, nearest, shown
from mavplan.scenario.sections import FleetVehicle, PinnedStop
from mavplan.scenario.validate import sound_values
from mavplan.scenario.zones_file import read_zones


@dataclass(frozen=True, slots=True)
class ListedThings:
    """What the lists hold; ``sound`` is whether nothing in them had a problem."""

    fence: Fence | None
    no_fly: Fence | None
    rally: tuple[RallyPoint, ...]
    vehicles: tuple[FleetVehicle, ...]
    stops: tuple[PinnedStop, ...]
    sound: bool


def read_lists(data: dict[str, Any], folder: Path, label: str, report: Report) -> ListedThings:
    """Return the fence areas, no-fly zones, rally points, vehicles and pinned stops of a scenario.

    Parameters
    ----------
    data
        The whole file.
    folder
        Where it lies; the files of zones stand relative to it.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    before = report.count
    table = data.get("fence", {})
    areas: list[FenceArea] = []
    for name in AREA_LISTS if isinstance(table, dict) else ():  # else a problem of the section
        for place, entry in _tables(table.get(name, []), f"fence.{name}", label, report):
            area = _area(entry, name == "inclusion", place, label, report)
            areas += [area] if area is not None else []
    rally = [
        point
        for place, entry in _tables(data.get("rally", []), "rally", label, report)
        if (point := _rally(entry, f"{label}, {place}", report)) is not None
    ]
    zones = [
        zone
        for place, entry in _tables(data.get("no_fly", []), "no_fly", label, report)
        for zone in _zones(entry, place, folder, label, report)
    ]
    vehicles = _vehicles(data.get("vehicles", []), label, report)
    stops = _stops(data.get("stops", []), label, report)
    return ListedThings(_fence(areas), _fence(zones), tuple(rally), vehicles, stops, report.count == before)


def _vehicles(found: Any, label: str, report: Report) -> tuple[FleetVehicle, ...]:
    """Return the vehicles of a fleet, names and system ids distinct."""
    vehicles: list[FleetVehicle] = []
    for place, entry in _tables(found, "vehicles", label, report):
        values = _values("vehicles", entry, f"{label}, {place}", report)
        if values is None:
            continue
        vehicle = FleetVehicle(**{**values, "name": _printable(values.get("name", "")) or place})
        _note_same(("name", "system"), vehicle, vehicles, "another vehicle", f"{label}, {place}", report)
        vehicles.append(vehicle)
    return tuple(vehicles)


def _stops(found: Any, label: str, report: Report) -> tuple[PinnedStop, ...]:
    """Return the pinned stops, names and orders distinct, each with a place or a user."""
    stops: list[PinnedStop] = []
    for place, entry in _tables(found, "stops", label, report):
        values = _values("stops", entry, f"{label}, {place}", report)
        if values is None:
            continue
        at = [key for key in ("lat_deg", "lon_deg") if key in values]
        if ("user" in values and at) or ("user" not in values and len(at) < 2):
            message = "a pinned stop has either lat_deg and lon_deg or user, the name of a user to stop above"
            report.error(f"{label}, {place}", message, "stop-place")
            continue
        number = place.removeprefix("[[stops]] ")
        name = _printable(values.get("name", "")) or _printable(values.get("user", "")) or f"pinned {number}"
        stop = PinnedStop(**{**values, "name": name})
        _note_same(("name", "order", "user"), stop, stops, "another pinned stop", f"{label}, {place}", report)
        stops.append(stop)
    return tuple(stops)


def _note_same(
    keys: Sequence[str], thing: object, others: Sequence[object], other: str, where: str, report: Report
) -> None:
    """Note what a thing has in common with others from which it must differ in each of these keys."""
    for key in keys:
        value = getattr(thing, key)
        if value is not None and value in [getattr(one, key) for one in others]:
            message = f"found {shown(value)}, which {other} has too; they must differ"
            report.error(f"{where} {key}", message, "duplicate")


def _fence(areas: list[FenceArea]) -> Fence | None:
    fence = Fence(
        polygons=tuple(area for area in areas if isinstance(area, FencePolygon)),
        circles=tuple(area for area in areas if isinstance(area, FenceCircle)),
    )
    return fence or None


def _zones(
    entry: dict[str, Any], place: str, folder: Path, label: str, report: Report
) -> list[FencePolygon] | list[FenceArea]:
    """Return the zones of one ``[[no_fly]]``: one area, or all polygons of a file."""
    where = f"{label}, {place}"
    for key in entry:
        if key not in NO_FLY_KEYS:
            report.error(
                f"{where} {key_name(key)}", f"is not known{_remedy(key, NO_FLY_KEYS)}", "unknown-key"
            )
    name = entry.get("name", "")
    if not isinstance(name, str):
        report.error(f"{where} name", f"found {shown(name)}; allowed is text", "wrong-type")
        name = ""
    area = {key: entry[key] for key in AREA_KEYS if key in entry}
    if "file" not in entry:
        found = _area(area, False, place, label, report)
        return [] if found is None else [replace(found, name=_printable(name) or place)]
    if area or not isinstance(entry["file"], str) or not entry["file"].strip():
        message = "a zone is either drawn here or in the file that is named here"
        report.error(where, message, "area")
        return []
    return read_zones(folder / entry["file"], _printable(name) or place, report)


def _tables(found: Any, name: str, label: str, report: Report) -> list[tuple[str, dict[str, Any]]]:
    """Return each table of a list with its place, for instance ``[[rally]] 2``."""
    if isinstance(found, list) and all(isinstance(entry, dict) for entry in found):
        return [(f"[[{name}]] {number}", entry) for number, entry in enumerate(found, start=1)]
    message = f"found {shown(found)}; allowed is a list of tables, each headed [[{name}]]"
    report.error(f"{label}, {name}", message, "wrong-type")
    return []


def _remedy(key: str, known: tuple[str, ...]) -> str:
    like = nearest(key, known)
    return f"; nearest is {like}" if like else f"; known are {listed(known)}"


def _area(entry: dict[str, Any], inclusion: bool, place: str, label: str, report: Report) -> FenceArea | None:
    where = f"{label}, {place}"
    for key in entry:
        if key not in AREA_KEYS:
            report.error(f"{where} {key_name(key)}", f"is not known{_remedy(key, AREA_KEYS)}", "unknown-key")
    given = [key for key in AREA_KEYS if key in entry]
    if len(given) != 1:
        found = "both are there" if given else "neither is there"
        report.error(where, f"{found}; an area is either polygon_deg or circle", "area")
        return None
    if given == ["polygon_deg"]:
        vertices = _vertices(entry["polygon_deg"], f"{where} polygon_deg", report)
        return _sound(FencePolygon(inclusion, vertices, place), where, report) if vertices else None
    table = entry["circle"]
    if not isinstance(table, dict):
        allowed = "{ lat_deg = …, lon_deg = …, radius_m = … }"
        report.error(f"{where} circle", f"found {shown(table)}; allowed is {allowed}", "wrong-type")
        return None
    values = _values("fence.circle", table, f"{where} circle", report)
    if values is None:
        return None
    circle = FenceCircle(inclusion, *_place_e7(values), float(values["radius_m"]), place)
    return _sound(circle, where, report)


Area = TypeVar("Area", FencePolygon, FenceCircle)


def _sound(area: Area, where: str, report: Report) -> Area | None:
    faults = list(area_faults(area))
    for message, code in faults:
        report.error(where, message, code)
    return None if faults else area


def _vertices(found: Any, where: str, report: Report) -> tuple[tuple[int, int], ...] | None:
    """Return the vertices of a polygon; None if there are none, or any of them is no place."""
    if not isinstance(found, list) or not found:
        message = f"found {shown(found)}; allowed is a list of vertices: [[lat, lon], [lat, lon], …]"
        report.error(where, message, "wrong-type")
        return None
    places: list[tuple[int, int]] = []
    for number, pair in enumerate(found, start=1):
        vertex = f"{where} vertex {number}"
        if not isinstance(pair, list) or len(pair) != 2:
            words = f"a list of {len(pair)}" if isinstance(pair, list) else shown(pair)
            report.error(vertex, f"found {words}; allowed is [latitude, longitude]", "wrong-type", where)
            continue
        values = _values("fence.vertex", dict(zip(("lat_deg", "lon_deg"), pair, strict=True)), vertex, report)
        places += [_place_e7(values)] if values is not None else []
    return tuple(places) if len(places) == len(found) else None


def _rally(entry: dict[str, Any], where: str, report: Report) -> RallyPoint | None:
    values = _values("rally", entry, where, report)
    if values is None:
        return None
    return RallyPoint(*_place_e7(values), float(values["alt_rel_m"]), _printable(values.get("name", "")))


def _printable(name: str) -> str:
    """Return a name as messages may show it."""
    return "".join(character if character.isprintable() else " " for character in name[:60]).strip()


def _values(kind: str, table: dict[str, Any], where: str, report: Report) -> dict[str, Any] | None:
    """Return the checked values of a table, None with the problems noted."""
    before, keys = report.count, keys_of(kind)
    good = sound_values(LISTED[kind], keys, table, where, report, lambda key: _remedy(key, tuple(keys)))
    return good if report.count == before else None


def _place_e7(values: dict[str, Any]) -> tuple[int, int]:
    return round(values["lat_deg"] * E7), round(values["lon_deg"] * E7)
