"""Looks at written mission files with other people's eyes: `reader_problems`, `mavsdk_problems`, `pymavlink_problems`.

The rules of each format are in `check_plan` and `check_waypoints`; here is what both have in common: places and values
that no vehicle should get, and the comparison with the mission that was meant. None of it shares code with the
writers, so that it can disagree with them. `foreign` asks MAVSDK and pymavlink themselves.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mavplan.errors import Problem
from mavplan.formats import read_text
from mavplan.formats.check_plan import check_plan
from mavplan.formats.check_waypoints import check_waypoints
from mavplan.formats.foreign import mavsdk_problems, pymavlink_problems
from mavplan.formats.seen import Findings, SeenItem
from mavplan.mission.model import Mission, MissionItem

__all__ = ["mavsdk_problems", "pymavlink_problems", "reader_problems"]

WITH_POSITION = {16, 17, 19, 21, 22}
HOLDING = {16, 19}
FLOWN = WITH_POSITION | {20}
DEGREE_M = 111_000.0
FAR_M = 200_000.0
"""No multirotor flies there; a swapped latitude and longitude does lie there almost everywhere on Earth."""
CONVERTED = {5: 0, 6: 3, 11: 10}


def reader_problems(source: Path | str, mission: Mission | None = None) -> list[Problem]:
    """Return what ground stations and vehicles would make wrong of a written mission file.

    Parameters
    ----------
    source
        A path to a ``.plan`` or ``.waypoints`` file, or, as a string, the text of one.
    mission
        What the file is meant to say. With it every value is compared; without it only what is wrong in itself, or
        wrong beside the rest of the file, can be found.

    Returns
    -------
    list of Problem
        Errors, and as warnings what is right only in rare cases. Empty if all is well.

    Raises
    ------
    InputError
        The path cannot be read.
    """
    if isinstance(source, Path):
        text, name = read_text(source), str(source)
        is_plan = source.suffix.lower() == ".plan"
    else:
        is_plan = not source.lstrip().startswith("QGC")
        text, name = source, ".plan" if is_plan else ".waypoints"
    findings = check_plan(text, name) if is_plan else check_waypoints(text, name)
    if not is_plan and mission is not None:
        findings.autopilot = mission.autopilot
    for item in findings.items:
        _check_item(findings, item)
    _check_first_items(findings)
    _check_places(findings)
    if mission is not None:
        _compare(findings, mission)
    return findings.problems


def _check_item(findings: Findings, item: SeenItem) -> None:
    for number, value in enumerate(item[3:7], start=1):
        if abs(value) > 1e6:
            findings.add(
                item.place, f"param{number} of {value:g} has crashed a vehicle in simulation", "param"
            )
        if math.isnan(value) and findings.autopilot == "ardupilot" and (item.command == 19 or number == 1):
            findings.add(item.place, f"param{number} without a value: ArduPilot refuses the mission", "nan")
    if item.command in HOLDING and not math.isnan(item.param1):
        if not 0 <= item.param1 <= 65_535:
            findings.add(item.place, f"a hold of {item.param1:g} s: ArduPilot keeps it modulo 65536", "hold")
        elif item.param1 != int(item.param1) and findings.autopilot != "px4":
            sure = findings.autopilot == "ardupilot"
            found = f"ArduPilot cuts a hold of {item.param1:g} s off to {int(item.param1)} s"
            findings.add(item.place, found, "fraction", "error" if sure else "warning")
    on_px4 = findings.autopilot == "px4" and findings.says_autopilot
    if on_px4 and item.command not in WITH_POSITION and item.frame != 2:
        findings.add(item.place, f"PX4 takes command {item.command} in frame 2 only", "frame")
    if item.command == 177 and not (item.param1 >= 1 and item.param1 <= len(findings.items)):
        findings.add(item.place, f"DO_JUMP to {item.param1:g}, which does not exist", "jump")


def _check_first_items(findings: Findings) -> None:
    flown = [item for item in findings.items if item.command in FLOWN]
    if not findings.items:
        findings.add("", "has no items", "empty")
        return
    first = flown[0] if flown else None
    if findings.autopilot == "px4" and first is not None and first is not findings.items[0]:
        found = f"command {findings.items[0].command} before take-off: some PX4 reject the mission"
        findings.add(findings.items[0].place, found, "before-takeoff", "warning")
    if first is None or first.command != 22:
        # Known to be refused on PX4; ArduPilot flies such a mission when it is in the air already.
        sure = findings.autopilot == "px4"
        found = (
            "take-off does not come first: PX4 rejects the mission, ArduPilot does not start it on the ground"
        )
        findings.add(findings.items[0].place, found, "no-takeoff", "error" if sure else "warning")
    elif first.frame != 0 and first.alt_m <= 0:
        findings.add(first.place, f"take-off to {first.alt_m:g} m", "no-takeoff")


def _check_places(findings: Findings) -> None:
    lat, lon, alt = findings.home
    if not (abs(lat) <= 90 and abs(lon) <= 180) and not math.isnan(lat + lon):
        findings.add("home", f"{lat}, {lon} is no place on Earth: latitude comes first", "position")
    positions = [item for item in findings.items if item.command in WITH_POSITION]
    for item in positions:
        if not (abs(item.lat_deg) <= 90 and abs(item.lon_deg) <= 180):
            found = f"{item.lat_deg}, {item.lon_deg} is no place on Earth: latitude comes first"
            findings.add(item.place, found, "position")
        elif item.lat_deg == item.lon_deg == 0 and findings.autopilot == "ardupilot":
            continue  # "here", for take-off and landing
        elif not math.isnan(lat) and _apart_m(lat, lon, item.lat_deg, item.lon_deg) > FAR_M:
            swapped = _apart_m(lat, lon, item.lon_deg, item.lat_deg) < FAR_M
            hint = ": longitude stands before latitude" if swapped else ""
            findings.add(item.place, f"lies more than {FAR_M / 1000:g} km from home{hint}", "position")
        if abs(item.alt_m) >= 83_000:
            findings.add(item.place, f"altitude {item.alt_m:g} m", "altitude")
    relative = {item.alt_m for item in positions if item.frame == 3 and item.command != 21}
    if alt in relative and alt != 0:
        found = f"{alt:g} m is also the flight height: home's altitude is that of the ground, above sea level"
        findings.add("home", found, "home-altitude", "warning")


def _apart_m(lat_1: float, lon_1: float, lat_2: float, lon_2: float) -> float:
    """Return a distance good enough to tell a swap: plane, shrunk by latitude, the short way round."""
    east = math.remainder(lon_2 - lon_1, 360) * math.cos(math.radians((lat_1 + lat_2) / 2))
    return math.hypot(lat_2 - lat_1, east) * DEGREE_M


def _compare(findings: Findings, mission: Mission) -> None:
    if findings.says_autopilot and findings.autopilot != mission.autopilot:
        found = f"the file says {findings.autopilot}, the mission is for {mission.autopilot}"
        findings.add("mission.firmwareType", found, "firmware")
    home = mission.home
    if _e7(findings.home[0]) != home.lat_e7 or _e7(findings.home[1]) != home.lon_e7:
        place = f"{home.lat_e7 / 1e7}, {home.lon_e7 / 1e7}"
        findings.add("home", f"stands at {findings.home[0]}, {findings.home[1]}, meant is {place}", "home")
    if not math.isclose(findings.home[2], home.alt_amsl_m, abs_tol=1e-6):
        found = f"altitude {findings.home[2]:g} m above sea level, meant are {home.alt_amsl_m:g} m"
        findings.add("home", found, "home-altitude")
    if findings.says_autopilot:
        _compare_lists(findings, mission)
    if len(findings.items) != len(mission.items):
        found = f"{len(findings.items)} items can be read, meant are {len(mission.items)}"
        findings.add("", found, "count")
        return
    for seen, meant in zip(findings.items, mission.items, strict=True):
        for name, found_value, meant_value in _fields(seen, meant):
            no_nan = not findings.says_autopilot and math.isnan(meant_value) and found_value == 0
            same = found_value == meant_value or (math.isnan(found_value) and math.isnan(meant_value))
            if not same and not no_nan:
                found = f"{name} is {found_value:.10g}, meant is {meant_value:.10g}"
                findings.add(seen.place, found, "differs")


def _compare_lists(findings: Findings, mission: Mission) -> None:
    """Compare fence and rally points, which only a ``.plan`` holds, value by value."""
    areas: list[Any] = []
    if mission.fence is not None:
        areas += [(area.inclusion, area.vertices_e7, 0.0) for area in mission.fence.polygons]
        areas += [
            (area.inclusion, ((area.lat_e7, area.lon_e7),), area.radius_m) for area in mission.fence.circles
        ]
    seen_areas: list[tuple[str, Any]] = [
        (area.place, (area.inclusion, tuple((_e7(x), _e7(y)) for x, y in area.corners_deg), area.radius_m))
        for area in sorted(findings.areas, key=lambda area: area.radius_m > 0)  # polygons first
    ]
    _compare_entries(findings, "geoFence", seen_areas, areas)
    points = [(point.lat_e7, point.lon_e7, point.alt_rel_m) for point in mission.rally]
    seen = [(point.place, (_e7(point.lat_deg), _e7(point.lon_deg), point.alt_m)) for point in findings.rally]
    _compare_entries(findings, "rallyPoints", seen, points)


def _compare_entries(
    findings: Findings, where: str, seen: Sequence[tuple[str, Any]], meant: Sequence[Any]
) -> None:
    if len(seen) != len(meant):
        findings.add(where, f"{len(seen)} entries can be read, meant are {len(meant)}", "count")
        return
    for (place, found), wanted in zip(seen, meant, strict=True):
        if found != wanted:
            findings.add(place, f"{found} stands there, meant is {wanted}"[:200], "differs")


def _fields(seen: SeenItem, meant: MissionItem) -> Iterator[tuple[str, float, float]]:
    yield "command", seen.command, meant.command
    for number, (found_value, meant_value) in enumerate(zip(seen[3:7], meant.params, strict=True), start=1):
        jump = number == 1 and meant.command == 177  # counted with home in both formats
        yield f"param{number}", found_value, meant_value + 1 if jump else meant_value
    if meant.command in WITH_POSITION:
        yield "frame", seen.frame, CONVERTED.get(meant.frame, meant.frame)
        yield "latitude", _e7(seen.lat_deg), meant.lat_e7
        yield "longitude", _e7(seen.lon_deg), meant.lon_e7
        yield "altitude", seen.alt_m, meant.alt_m


def _e7(degrees: float) -> float:
    return math.nan if math.isnan(degrees) else float(round(degrees * 1e7))
