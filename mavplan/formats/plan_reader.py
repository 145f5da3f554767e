"""Reads a ``.plan``: every problem of a file in one pass, each with its place.

Takes what QGroundControl itself saves from simple items, and refuses by name what a `Mission` cannot hold.
Keys that are not known are left alone.
"""

import json
import math
from typing import Any

from mavplan.errors import InputError, Problem
from mavplan.formats import plan_areas, values
from mavplan.formats.json_values import is_number, is_whole, shown
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import (
    NAN,
    POSITION_COMMANDS,
    Autopilot,
    Command,
    Frame,
    HomePosition,
    Mission,
    MissionItem,
)

FRAME_OF_MODE = {1: Frame.GLOBAL_RELATIVE_ALT, 2: Frame.GLOBAL, 4: Frame.GLOBAL_TERRAIN_ALT}
"""The frame that each altitude mode of QGroundControl stands for."""
ALTITUDE_KEYS = ("AltitudeMode", "Altitude", "AMSLAltAboveTerrain")

_NO_HOME = HomePosition(0, 0, 0.0)


class PlanReader:
    """One pass over one file; ``name`` is what messages call it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.problems: list[Problem] = []
        self.warnings: list[Problem] = []

    def read(self, text: str) -> Mission:
        """Return the mission; see `mavplan.formats.plan.loads`."""
        document = self._parse(text)
        mission = self._document(document) if document is not None else None
        if self.problems or mission is None:
            raise InputError(self.problems)
        return mission

    def _parse(self, text: str) -> dict[str, Any] | None:
        try:
            document = json.loads(
                text.removeprefix("\ufeff"), parse_constant=_refuse_constant, object_pairs_hook=_no_duplicates
            )
        except (ValueError, RecursionError) as error:
            reason = "brackets are nested too deeply" if isinstance(error, RecursionError) else str(error)
            self._add("", f"is not JSON: {reason}", "not-json")
            return None
        if not isinstance(document, dict):
            self._add("", "is not a plan: a JSON object is expected", "not-a-plan")
            return None
        return document

    def _document(self, document: dict[str, Any]) -> Mission | None:
        if document.get("fileType") != "Plan":
            found = document.get("fileType")
            self._add("fileType", f'found {shown(found)}, a mission file says "Plan"', "file-type")
        self._version(document, "version", 1)
        fence = self._list_section(document, "geoFence")
        rally = self._list_section(document, "rallyPoints")
        if fence.get("breachReturn") is not None:
            found = "the point to return to is left out: multirotors do not use it"
            self.warnings.append(Problem(self._where("geoFence.breachReturn"), found, "left-out", "warning"))
        mission = self._section(document, "mission")
        if mission is None:
            return None
        self._version(mission, "mission.version", 2)
        autopilot = self._autopilot(mission)
        home = self._home(mission)
        items = self._items(mission, autopilot)
        return Mission(
            items=items,
            home=home,
            autopilot=autopilot,
            mav_type=self._vehicle_type(mission),
            cruise_speed_m_s=self._speed(mission, "cruiseSpeed"),
            hover_speed_m_s=self._speed(mission, "hoverSpeed"),
            fence=plan_areas.read_fence(fence, self._add),
            rally=plan_areas.read_rally(rally, self._add),
            warnings=tuple(self.warnings),
        )

    def _section(self, document: dict[str, Any], key: str) -> dict[str, Any] | None:
        section = document.get(key)
        if isinstance(section, dict):
            return section
        wrong = "is missing" if key not in document else "is not an object"
        self._add(key, f"this section {wrong}; ground stations refuse such a file", "section")
        return None

    def _list_section(self, document: dict[str, Any], key: str) -> dict[str, Any]:
        section = self._section(document, key)
        if section is None:
            return {}
        self._version(section, f"{key}.version", 2)
        return section

    def _version(self, section: dict[str, Any], place: str, wanted: int) -> None:
        found = section.get("version")
        if isinstance(found, bool) or found != wanted:
            self._add(place, f"found {shown(found)}, only version {wanted} is known", "version")

    def _autopilot(self, mission: dict[str, Any]) -> Autopilot | None:
        found = mission.get("firmwareType")
        for name, rules in AUTOPILOTS.items():
            if found == rules.mav_autopilot:
                return name
        if isinstance(found, bool) or found != 0:
            allowed = "3 (ArduPilot), 12 (PX4) or 0 (not said)"
            self._add("mission.firmwareType", f"found {shown(found)}, allowed are {allowed}", "firmware")
        return None

    def _vehicle_type(self, mission: dict[str, Any]) -> int:
        found = mission.get("vehicleType", 2)
        if is_number(found) and found in range(256):
            return int(found)
        self._add(
            "mission.vehicleType", f"found {shown(found)}, a MAV_TYPE from 0 to 255 is expected", "number"
        )
        return 2

    def _speed(self, mission: dict[str, Any], key: str) -> float:
        found = mission.get(key, 10)
        if is_number(found) and 0 <= found <= 1000:
            return float(found)
        self._add(
            f"mission.{key}", f"found {shown(found)}, metres a second from 0 to 1000 are expected", "number"
        )
        return 10.0

    def _home(self, mission: dict[str, Any]) -> HomePosition:
        place = "mission.plannedHomePosition"
        found = mission.get("plannedHomePosition")
        if not (isinstance(found, list) and len(found) == 3):
            self._add(
                place, "three numbers are expected: latitude, longitude, metres above sea level", "home"
            )
            return _NO_HOME
        numbers = [self._finite(value, f"{place}[{k}]") for k, value in enumerate(found)]
        lat_deg, lon_deg, alt_m = numbers
        if lat_deg is None or lon_deg is None or alt_m is None:
            return _NO_HOME
        self._keep(values.lat_problem(lat_deg, self._where(f"{place}[0]")))
        self._keep(values.lon_problem(lon_deg, self._where(f"{place}[1]")))
        self._keep(values.home_alt_problem(alt_m, self._where(f"{place}[2]")))
        return HomePosition(values.to_e7(lat_deg), values.to_e7(lon_deg), alt_m)

    def _items(self, mission: dict[str, Any], autopilot: Autopilot | None) -> tuple[MissionItem, ...]:
        found = mission.get("items")
        if not isinstance(found, list):
            self._add("mission.items", "a list of items is expected", "section")
            return ()
        if not 0 < len(found) <= values.MAX_ITEMS:
            self._add("mission.items", f"{len(found)} items; 1 to {values.MAX_ITEMS} can be flown", "count")
        index_of_id = self._jump_ids(found)
        items = (
            self._item(entry, f"mission.items[{index}]", autopilot, index_of_id)
            for index, entry in enumerate(found)
        )
        return tuple(item for item in items if item is not None)

    def _jump_ids(self, entries: list[Any]) -> dict[int, int]:
        """Return the index of the item with each doJumpId: DO_JUMP names its target by it, as QGroundControl does."""
        index_of_id: dict[int, int] = {}
        for index, entry in enumerate(entries):
            if not isinstance(entry, dict) or "doJumpId" not in entry:
                continue
            found, place = entry["doJumpId"], f"mission.items[{index}].doJumpId"
            if not is_whole(found) or found < 1:
                self._add(place, f"found {shown(found)}, a whole number from 1 is expected", "jump-id")
            elif int(found) in index_of_id:
                first = index_of_id[int(found)]
                self._add(
                    place, f"{found} is used before by mission.items[{first}]: each is unique", "jump-id"
                )
            else:
                index_of_id[int(found)] = index
        return index_of_id

    def _item(
        self, entry: Any, place: str, autopilot: Autopilot | None, index_of_id: dict[int, int]
    ) -> MissionItem | None:
        if not isinstance(entry, dict):
            self._add(place, "an object is expected", "item")
            return None
        if entry.get("type") != "SimpleItem":
            found = entry.get("complexItemType", entry.get("type"))
            found = f"{shown(found)} is not a SimpleItem"
            self._add(
                place, f"{found}; mavplan takes no ComplexItems: save it as waypoints first", "complex-item"
            )
            return None
        command = self._whole(entry, "command", place)
        frame = self._whole(entry, "frame", place)
        params = self._params(entry, place)
        autocontinue = entry.get("autoContinue")
        if not isinstance(autocontinue, bool):
            self._add(
                f"{place}.autoContinue", f"found {shown(autocontinue)}, true or false is expected", "item"
            )
        if command is None or frame is None:
            return None
        wrong = values.command_problem(command, self._where(f"{place}.command"))
        self._keep(wrong)
        if wrong is not None or params is None:
            return None
        self._keep(values.frame_problem(command, frame, self._where(f"{place}.frame")))
        has_position = command in POSITION_COMMANDS
        lat_deg, lon_deg, alt_m = self._position(params, place) if has_position else (0.0, 0.0, 0.0)
        first = self._jump_target(params[0], place, index_of_id) if command == Command.DO_JUMP else params[0]
        item = MissionItem(
            command=command,
            frame=frame,
            params=(first, params[1], params[2], params[3]),
            lat_e7=values.to_e7(lat_deg),
            lon_e7=values.to_e7(lon_deg),
            alt_m=alt_m,
            autocontinue=bool(autocontinue),
        )
        for number in range(1, 5):
            where = self._where(f"{place}.params[{number - 1}]")
            self._keep(values.param_problem(item, number, autopilot, where))
        if not has_position:
            return values.normal_item(item)
        self._keep(values.nowhere_problem(item, autopilot, self._where(f"{place}.params[4]")))
        self._altitude_mode(entry, frame, alt_m, place)
        return values.normal_item(item) if frame in values.FRAME_IN_FILE else None

    def _params(self, entry: dict[str, Any], place: str) -> list[float] | None:
        """Return seven numbers, NaN for null; None if they cannot be taken."""
        found = entry.get("params")
        if not isinstance(found, list) or len(found) != 7:
            count = len(found) if isinstance(found, list) else "no"
            self._add(f"{place}.params", f"{count} values; exactly seven are expected", "params")
            return None
        numbers: list[float] = []
        for k, value in enumerate(found):
            number = NAN if value is None else self._finite(value, f"{place}.params[{k}]")
            if number is not None:
                numbers.append(number)
        return numbers if len(numbers) == 7 else None

    def _position(self, params: list[float], place: str) -> tuple[float, float, float]:
        missing = False
        for k in (4, 5, 6):
            if math.isnan(params[k]):
                missing = True
                what = ("latitude", "longitude", "altitude")[k - 4]
                self._add(f"{place}.params[{k}]", f"null: this command needs a {what}", "position")
        if missing:
            return 0.0, 0.0, 0.0
        lat_deg, lon_deg, alt_m = params[4:7]
        self._keep(values.lat_problem(lat_deg, self._where(f"{place}.params[4]")))
        self._keep(values.lon_problem(lon_deg, self._where(f"{place}.params[5]")))
        self._keep(values.alt_problem(alt_m, self._where(f"{place}.params[6]")))
        return lat_deg, lon_deg, alt_m

    def _jump_target(self, jump_id: float, place: str, index_of_id: dict[int, int]) -> float:
        if jump_id in index_of_id:
            return float(index_of_id[int(jump_id)])
        self._add(f"{place}.params[0]", f"DO_JUMP goes to doJumpId {jump_id:g}, which no item has", "jump")
        return 0.0

    def _altitude_mode(self, entry: dict[str, Any], frame: int, alt_m: float, place: str) -> None:
        """Refuse what QGroundControl and the other readers would fly at different altitudes."""
        given = [key for key in ALTITUDE_KEYS if key in entry]
        if not given:
            return
        if len(given) < len(ALTITUDE_KEYS):
            missing = " and ".join(key for key in ALTITUDE_KEYS if key not in entry)
            self._add(place, f"{missing} missing: all three altitude keys or none of them", "altitude-keys")
            return
        mode, altitude = entry["AltitudeMode"], entry["Altitude"]
        meant = FRAME_OF_MODE.get(mode) if is_whole(mode) else None
        if meant is None or frame not in values.FRAME_IN_FILE:
            return
        if values.FRAME_IN_FILE[Frame(frame)] != meant:
            self._add(f"{place}.AltitudeMode", f"{mode} contradicts frame {frame}", "altitude-mode")
        elif not is_number(altitude) or abs(altitude - alt_m) > 0.01:
            found = f"{shown(altitude)} contradicts params[6], which is {alt_m:g}"
            self._add(f"{place}.Altitude", found, "altitude-mode")

    def _whole(self, entry: dict[str, Any], key: str, place: str) -> int | None:
        found = entry.get(key)
        if found is not None and is_whole(found):
            return int(found)
        self._add(f"{place}.{key}", f"found {shown(found)}, a whole number is expected", "number")
        return None

    def _finite(self, value: Any, place: str) -> float | None:
        if is_number(value):
            return float(value)
        self._add(place, f"found {shown(value)}, a finite number is expected", "number")
        return None

    def _where(self, place: str) -> str:
        return f"{self.name}, {place}" if place else self.name

    def _add(self, place: str, message: str, code: str) -> None:
        self.problems.append(Problem(self._where(place), message, code))

    def _keep(self, problem: Problem | None) -> None:
        if problem is not None:
            self.problems.append(problem)


def _refuse_constant(token: str) -> float:
    raise ValueError(f"the token {token} is not a number in JSON; null stands for it")


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f'the key "{twice}" stands twice in one object')
    return result
