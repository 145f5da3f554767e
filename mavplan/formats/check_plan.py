"""The rules by which ground stations read a ``.plan``, looked for in a written file.

Made from the readers, not from our writer, and shares nothing with it: QGroundControl's loader (required keys, types,
versions, altitude keys), MAVSDK's importer (versions, both extra sections), Mission Planner's (whole numbers), and
what each firmware refuses once the items reach it.
"""

import json
import math
from typing import Any, NoReturn, TypeGuard

from mavplan.formats.seen import Findings, SeenArea, SeenItem, SeenRally

WITH_POSITION = {16, 17, 19, 21, 22}
DO_JUMP = 177
BARE = {20, 93, DO_JUMP, 178}
FRAME_OF_MODE = {1: 3, 2: 0, 4: 10}
FIRMWARE = {3: "ardupilot", 12: "px4", 0: None}


def check_plan(text: str, name: str) -> Findings:
    """Return what is wrong in the text of a ``.plan``, and what it holds as far as it can be read."""
    findings = Findings(name)
    try:
        document = json.loads(text, parse_constant=_not_json)
    except (ValueError, RecursionError) as error:
        findings.add("", f"is not JSON: {error}", "not-json")
        return findings
    root = _object(findings, document, "")
    _key(findings, root, "", "fileType", str)
    _key(findings, root, "", "groundStation", str)
    if root.get("fileType") != "Plan":
        findings.add("fileType", 'must be "Plan"', "file-type")
    _version(findings, root, "", 1)
    _fence(findings, _object(findings, root.get("geoFence"), "geoFence"))
    _rally(findings, _object(findings, root.get("rallyPoints"), "rallyPoints"))
    _mission(findings, _object(findings, root.get("mission"), "mission"))
    return findings


def _mission(findings: Findings, mission: dict[str, Any]) -> None:
    _version(findings, mission, "mission", 2)
    for key in ("vehicleType", "firmwareType"):
        _key(findings, mission, "mission", key, int)
    for key in ("cruiseSpeed", "hoverSpeed", "globalPlanAltitudeMode"):
        if key in mission:
            _key(findings, mission, "mission", key, int)
    firmware = mission.get("firmwareType")
    if not _is_int(firmware) or firmware not in FIRMWARE:
        found = f"found {firmware!r:.40}, must be 3 (ArduPilot) or 12 (PX4)"
        findings.add("mission.firmwareType", found, "firmware")
    else:
        findings.autopilot = FIRMWARE[firmware]
    findings.says_autopilot = True
    home = mission.get("plannedHomePosition")
    if isinstance(home, list) and len(home) == 3 and all(_is_finite(value) for value in home):
        findings.home = (float(home[0]), float(home[1]), float(home[2]))
    else:
        findings.add(
            "mission.plannedHomePosition", "must be three numbers: latitude, longitude, metres", "home"
        )
    items = mission.get("items")
    if not isinstance(items, list):
        findings.add("mission.items", "must be an array", "type")
        return
    number_of_id = _jump_ids(findings, items)
    for index, entry in enumerate(items):
        place = f"mission.items[{index}]"
        _item(findings, _object(findings, entry, place), place)
    for at, seen in enumerate(findings.items):
        if seen.command == DO_JUMP:
            number = number_of_id.get(seen.param1, 0)
            findings.items[at] = seen._replace(param1=float(number))
            if number not in (0, seen.param1):
                found = (
                    f"goes to id {seen.param1:g}, item {number}: MAVSDK sends {seen.param1:g} as it stands"
                )
                findings.add(seen.place, found, "jump-id", "warning")


def _jump_ids(findings: Findings, items: list[Any]) -> dict[float, int]:
    """Return the number, from 1, of the item with each doJumpId; QGroundControl finds targets by it."""
    number_of_id: dict[float, int] = {}
    for index, entry in enumerate(items):
        place = f"mission.items[{index}].doJumpId"
        jump_id = entry.get("doJumpId") if isinstance(entry, dict) else None
        if not _is_int(jump_id) or jump_id < 1:
            findings.add(place, "must be a whole number from 1", "jump-id")
        elif jump_id in number_of_id:
            findings.add(place, f"{jump_id} is used twice: DO_JUMP would go astray", "jump-id")
        else:
            number_of_id[jump_id] = index + 1
    return number_of_id


def _item(findings: Findings, item: dict[str, Any], place: str) -> None:
    if item.get("type") != "SimpleItem":
        findings.add(f"{place}.type", "must be SimpleItem", "type")
        return
    _key(findings, item, place, "command", int)
    _key(findings, item, place, "frame", int)
    _key(findings, item, place, "autoContinue", bool)
    params, command, frame = item.get("params"), item.get("command"), item.get("frame")
    if not isinstance(params, list) or len(params) != 7:
        findings.add(f"{place}.params", "must be exactly seven values", "params")
        return
    for k, value in enumerate(params):
        if not _is_finite(value) and not (value is None and (k < 4 or command in BARE)):
            allowed = "a number or null" if k < 4 else "a number"
            findings.add(f"{place}.params[{k}]", f"must be {allowed}", "params")
            return
    if not (_is_int(command) and _is_int(frame)):
        return
    if command in WITH_POSITION:
        if frame not in (0, 3, 10):
            findings.add(
                f"{place}.frame", f"{frame} is no frame of a position in a file: 0, 3 or 10", "frame"
            )
        _altitude_keys(findings, item, place, frame, params[6])
    elif any(key in item for key in ("AltitudeMode", "Altitude", "AMSLAltAboveTerrain")):
        findings.add(place, "altitude keys on an item without a position", "altitude-keys")
    numbers = [math.nan if value is None else float(value) for value in params]
    findings.items.append(SeenItem(place, command, frame, *numbers))


def _altitude_keys(findings: Findings, item: dict[str, Any], place: str, frame: int, alt_m: float) -> None:
    given = [key in item for key in ("AltitudeMode", "Altitude", "AMSLAltAboveTerrain")]
    if not any(given):
        return
    if not all(given):
        findings.add(place, "QGroundControl wants all three altitude keys or none of them", "altitude-keys")
        return
    mode, altitude, amsl = item["AltitudeMode"], item["Altitude"], item["AMSLAltAboveTerrain"]
    if not _is_int(mode) or FRAME_OF_MODE.get(mode) != frame:
        wanted = {frame: mode for mode, frame in FRAME_OF_MODE.items()}.get(frame)
        findings.add(
            f"{place}.AltitudeMode", f"{mode} does not fit frame {frame}, {wanted} does", "altitude-mode"
        )
    if not _is_finite(altitude) or altitude != alt_m:
        findings.add(f"{place}.Altitude", f"{altitude} differs from params[6], {alt_m}", "altitude-mode")
    if amsl is not None and not _is_finite(amsl):
        findings.add(f"{place}.AMSLAltAboveTerrain", "must be a number or null", "altitude-keys")


def _fence(findings: Findings, fence: dict[str, Any]) -> None:
    _version(findings, fence, "geoFence", 2)
    for key in ("circles", "polygons"):
        _key(findings, fence, "geoFence", key, list)
        for k, entry in enumerate(_list(fence, key)):
            place = f"geoFence.{key}[{k}]"
            shape = _object(findings, entry, place)
            _version(findings, shape, place, 1)
            _key(findings, shape, place, "inclusion", bool)
            corners, radius = _shape(shape, key)
            if corners is None:
                findings.add(place, "is no circle or polygon that QGroundControl reads", "fence")
            elif isinstance(shape.get("inclusion"), bool):
                findings.areas.append(SeenArea(place, shape["inclusion"], corners, radius))


def _shape(shape: dict[str, Any], key: str) -> tuple[tuple[tuple[float, float], ...] | None, float]:
    """Return corners and radius of an area; no corners for what QGroundControl would not read."""
    found, least, radius = shape.get("polygon"), 3, 0.0
    if key == "circles":
        circle = shape.get("circle")
        circle = circle if isinstance(circle, dict) else {}
        found, least = [circle.get("center")], 1
        given = circle.get("radius")
        if not _is_finite(given) or given <= 0:
            return None, radius
        radius = float(given)
    if not isinstance(found, list) or len(found) < least or not all(_is_place(p, 2) for p in found):
        return None, radius
    return tuple((float(lat), float(lon)) for lat, lon in found), radius


def _rally(findings: Findings, rally: dict[str, Any]) -> None:
    _version(findings, rally, "rallyPoints", 2)
    _key(findings, rally, "rallyPoints", "points", list)
    for k, point in enumerate(_list(rally, "points")):
        place = f"rallyPoints.points[{k}]"
        if _is_place(point, 3):
            findings.rally.append(SeenRally(place, *(float(value) for value in point)))
        else:
            findings.add(place, "must be latitude, longitude, metres above home", "rally")


def _object(findings: Findings, found: Any, place: str) -> dict[str, Any]:
    if isinstance(found, dict):
        return found
    findings.add(place, "this section is missing: an object is expected", "section")
    return {}


def _list(parent: dict[str, Any], key: str) -> list[Any]:
    found = parent.get(key)
    return found if isinstance(found, list) else []


def _key(findings: Findings, parent: dict[str, Any], place: str, key: str, kind: type) -> None:
    found = parent.get(key)
    fits = _is_int(found) if kind is int else isinstance(found, kind)
    if not fits:
        what = {
            int: "a whole number without a point",
            str: "a string",
            bool: "true or false",
            list: "an array",
        }[kind]
        where = f"{place}.{key}" if place else key
        findings.add(where, f"found {found!r:.40}, must be {what}", "type")


def _version(findings: Findings, parent: dict[str, Any], place: str, wanted: int) -> None:
    found = parent.get("version")
    if not _is_int(found) or found != wanted:
        findings.add(
            f"{place}.version" if place else "version", f"found {found!r:.40}, must be {wanted}", "version"
        )


def _is_int(value: Any) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _is_place(value: Any, size: int) -> bool:
    if not isinstance(value, list) or len(value) != size or not all(_is_finite(number) for number in value):
        return False
    return bool(abs(value[0]) <= 90 and abs(value[1]) <= 180)


def _not_json(token: str) -> NoReturn:
    raise ValueError(f"{token} is no JSON number")
