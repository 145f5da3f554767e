"""Asks other people's readers: MAVSDK's importer of ``.plan`` and pymavlink's loader of ``.waypoints``.

Both are run in this process, without any link. Each returns problems, none if what it read is the mission that was
meant. That they read a file proves its structure; its values are proved by the comparison made here.
"""

import math
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mavplan.errors import Problem
from mavplan.mission.model import Mission, MissionItem

MAV_AUTOPILOT = {"ardupilot": 3, "px4": 12, None: 0}
FILE_FRAME = {5: 0, 6: 3, 11: 10}
LIST_FIELDS = ("command", "vertex count or radius", "latitude", "longitude", "altitude")


def mavsdk_problems(plan_path: Path | str, mission: Mission) -> list[Problem]:
    """Import a ``.plan`` with MAVSDK, as a vehicle of the mission's autopilot, and compare.

    Parameters
    ----------
    plan_path
        The file.
    mission
        What it is meant to say. For ArduPilot MAVSDK puts home in as item 0.

    Returns
    -------
    list of Problem
        MAVSDK's refusal, or each field that differs; a warning where there is no MAVSDK for this machine.
    """
    from pymavlink.dialects.v20 import common

    name = str(plan_path)
    try:
        from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
        from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
    except (
        ImportError,
        OSError,
    ) as error:  # its wheels hold a native library and are not made for every machine
        found = f"MAVSDK cannot be loaded on this machine and was not asked: {error}"
        return [Problem(name, found, "not-asked", "warning")]
    log_subscribe(lambda *_: True)
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with Mavsdk(configuration) as mavsdk:
        # The importer hangs on a system, and a system appears with a heartbeat: one is handed in, no socket opened.
        mavsdk.add_any_connection("raw://")
        vehicle = common.MAVLink(None, srcSystem=1, srcComponent=1)
        heartbeat = vehicle.heartbeat_encode(2, MAV_AUTOPILOT[mission.autopilot], 0, 0, 4)
        mavsdk.pass_received_raw_bytes(heartbeat.pack(vehicle))
        system = mavsdk.first_autopilot(5.0)
        if system is None:
            return [Problem(name, "MAVSDK did not start: try again", "mavsdk")]
        try:
            imported = MissionRaw(system).import_qgroundcontrol_mission(name)
        except MissionRawError as error:
            return [Problem(name, f"MAVSDK refuses it: {error.result.name}", "mavsdk")]
    items = list(imported.mission_items)
    problems: list[Problem] = []
    if mission.autopilot == "ardupilot" and items:
        home = items.pop(0)
        seen = (home.x, home.y, home.z)
        problems += _home_problems(name, "MAVSDK", seen, mission)
    problems += _item_problems(
        name, "MAVSDK", [_from_mavsdk(item) for item in items], mission, nan_is_zero=False
    )
    problems += _list_problems(name, imported.geofence_items, _fence_items(mission))
    problems += _list_problems(name, imported.rally_items, _rally_items(mission))
    return problems


def pymavlink_problems(waypoints_path: Path | str, mission: Mission) -> list[Problem]:
    """Load a ``.waypoints`` file with pymavlink, as MAVProxy does, and compare.

    Parameters
    ----------
    waypoints_path
        The file.
    mission
        What it is meant to say; NaN may stand as 0.

    Returns
    -------
    list of Problem
        pymavlink's refusal, or each field that differs.
    """
    from pymavlink import mavutil, mavwp

    name = str(waypoints_path)
    loader = mavwp.MAVWPLoader(target_system=1, target_component=1)
    with _dialect_as_imported(mavutil.mavlink.WIRE_PROTOCOL_VERSION), warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # the loader leaves a refused file open
        try:
            loader.load(name)
        except (mavwp.MAVWPError, ValueError, UnicodeDecodeError) as error:
            refusal = str(error)
        else:
            refusal = ""
    if refusal:
        return [Problem(name, f"pymavlink refuses it: {refusal}", "pymavlink")]
    items = [_from_pymavlink(item) for item in loader.wpoints]
    if not items:
        return [Problem(name, "pymavlink finds no items", "pymavlink")]
    home = items.pop(0)
    problems = _home_problems(name, "pymavlink", (home.lat_e7, home.lon_e7, home.alt_m), mission)
    return problems + _item_problems(name, "pymavlink", items, mission, nan_is_zero=True)


@contextmanager
def _dialect_as_imported(wire_version: str) -> Iterator[None]:
    """Make MAVLINK20 say what the dialect that mavutil has loaded is; the loader builds its messages by it."""
    before = os.environ.get("MAVLINK20")
    if wire_version.startswith("2"):
        os.environ["MAVLINK20"] = "1"
    else:
        os.environ.pop("MAVLINK20", None)
    try:
        yield
    finally:
        os.environ.pop("MAVLINK20", None)
        if before is not None:
            os.environ["MAVLINK20"] = before


def _from_mavsdk(item: Any) -> MissionItem:
    params = (item.param1, item.param2, item.param3, item.param4)
    return MissionItem(item.command, item.frame, params, item.x, item.y, item.z, bool(item.autocontinue))


def _from_pymavlink(item: Any) -> MissionItem:
    params = (item.param1, item.param2, item.param3, item.param4)
    lat_e7, lon_e7 = round(item.x * 1e7), round(item.y * 1e7)
    return MissionItem(item.command, item.frame, params, lat_e7, lon_e7, item.z, bool(item.autocontinue))


_ListItem = tuple[str, int, float, int, int, float]
"""What it is, command, param1, 1e-7 degrees, metres."""


def _fence_items(mission: Mission) -> list[_ListItem]:
    """Return what MAVSDK should make of a fence: its vertices, then its circles."""
    items: list[_ListItem] = []
    for number, polygon in enumerate(mission.fence.polygons if mission.fence else (), start=1):
        command, count = 5001 if polygon.inclusion else 5002, len(polygon.vertices_e7)
        for lat_e7, lon_e7 in polygon.vertices_e7:
            items.append((f"fence polygon {number}", command, count, lat_e7, lon_e7, 0.0))
    for number, circle in enumerate(mission.fence.circles if mission.fence else (), start=1):
        command = 5003 if circle.inclusion else 5004
        place = (circle.lat_e7, circle.lon_e7)
        items.append((f"fence circle {number}", command, circle.radius_m, *place, 0.0))
    return items


def _rally_items(mission: Mission) -> list[_ListItem]:
    return [
        (f"rally point {number}", 5100, 0.0, point.lat_e7, point.lon_e7, point.alt_rel_m)
        for number, point in enumerate(mission.rally, start=1)
    ]


def _list_problems(name: str, seen: Any, meant: list[_ListItem]) -> list[Problem]:
    """Compare what MAVSDK reads of a fence or of rally points, field by field."""
    if len(seen) != len(meant):
        found = f"MAVSDK reads {len(seen)} fence or rally items, meant are {len(meant)}"
        return [Problem(name, found, "count")]
    problems = []
    for item, (what, *values) in zip(seen, meant, strict=True):
        fields = (item.command, item.param1, item.x, item.y, item.z)
        for field, got, wanted in zip(LIST_FIELDS, fields, values, strict=True):
            if not _close(got, wanted):
                found = f"MAVSDK reads {field} as {got:.10g}, meant is {wanted:.10g}"
                problems.append(Problem(f"{name}, {what}", found, "differs"))
        relative = {5100: {3, 6}}.get(item.command, {0, 5})
        if item.frame not in relative:
            problems.append(Problem(f"{name}, {what}", f"MAVSDK reads frame {item.frame}", "differs"))
    return problems


def _home_problems(name: str, reader: str, seen: tuple[int, int, float], mission: Mission) -> list[Problem]:
    home = mission.home
    if seen[:2] == (home.lat_e7, home.lon_e7) and _close(seen[2], home.alt_amsl_m):
        return []
    meant = f"{home.lat_e7 / 1e7}, {home.lon_e7 / 1e7}, {home.alt_amsl_m:g} m"
    found = f"{reader} reads home as {seen[0] / 1e7}, {seen[1] / 1e7}, {seen[2]:g} m; meant is {meant}"
    return [Problem(name, found, "home")]


def _item_problems(
    name: str, reader: str, items: list[MissionItem], mission: Mission, *, nan_is_zero: bool
) -> list[Problem]:
    if len(items) != len(mission.items):
        found = f"{reader} reads {len(items)} items, meant are {len(mission.items)}"
        return [Problem(name, found, "count")]
    problems = []
    for index, (seen, meant) in enumerate(zip(items, mission.items, strict=True)):
        for field, seen_value, meant_value in _fields(seen, meant):
            if nan_is_zero and math.isnan(meant_value) and seen_value == 0:
                continue
            if not _close(seen_value, meant_value):
                found = f"{reader} reads {field} as {seen_value:.10g}, meant is {meant_value:.10g}"
                problems.append(Problem(f"{name}, item {index}", found, "differs"))
    return problems


def _fields(seen: MissionItem, meant: MissionItem) -> Iterator[tuple[str, float, float]]:
    yield "command", seen.command, meant.command
    for number, (seen_value, meant_value) in enumerate(zip(seen.params, meant.params, strict=True), start=1):
        # Jumps are counted with home in both formats.
        jump = number == 1 and meant.command == 177
        yield f"param{number}", seen_value, meant_value + 1 if jump else meant_value
    if meant.has_position:
        yield "frame", seen.frame, FILE_FRAME.get(meant.frame, meant.frame)
        yield "latitude", seen.lat_e7, meant.lat_e7
        yield "longitude", seen.lon_e7, meant.lon_e7
        yield "altitude", seen.alt_m, meant.alt_m


def _close(seen: float, meant: float) -> bool:
    """Tell whether two values are the same to the 24 bits that MAVLink's floats have; integers exactly."""
    if isinstance(seen, int) and isinstance(meant, int):
        return seen == meant
    if math.isnan(seen) or math.isnan(meant):
        return math.isnan(seen) and math.isnan(meant)
    return math.isclose(seen, meant, rel_tol=2**-23, abs_tol=1e-9)
