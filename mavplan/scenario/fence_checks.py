"""Checks of fence and rally points beyond single values: against home, altitude and each other."""

import math
from collections.abc import Iterator

from mavplan.geo import LocalPlane, geodesic_distance_m
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.geofence import FenceArea, FencePolygon, RallyPoint
from mavplan.scenario.checks import MAX_DISTANCE_M, too_far
from mavplan.scenario.lists import ListedThings
from mavplan.scenario.report import Report, figure
from mavplan.scenario.sections import FenceOptions, Home, Vehicle

ALTITUDE_LIMIT = {"ardupilot": "FENCE_ALT_MAX", "px4": "GF_MAX_VER_DIST"}
"""The parameter that limits a vehicle's height above home."""


def check_fence_places(
    things: ListedThings, options: FenceOptions, home: Home, label: str, report: Report
) -> None:
    """Note areas and rally points far from home, and home or rally points that are not well within the fence."""
    for place, lat_e7, lon_e7 in _places(things):
        lat_deg, lon_deg = lat_e7 / 1e7, lon_e7 / 1e7
        far_m = float(geodesic_distance_m(home.lat_deg, home.lon_deg, lat_deg, lon_deg))
        if far_m > MAX_DISTANCE_M:
            message = too_far(f"{figure(lat_deg)}, {figure(lon_deg)}", far_m, lat_deg, lon_deg, home)
            report.error(f"{label}, {place}", message, "too-far")
            return  # a swap is one slip of the pen, and says nothing about the rest
    if things.fence is None and things.no_fly is None:
        return
    from mavplan.mission.fence_check import place_breaches
    from mavplan.mission.fence_geometry import plane_areas

    plane = LocalPlane(home.lat_deg, home.lon_deg)
    areas = [area for fence in (things.fence, things.no_fly) if fence for area in plane_areas(fence, plane)]
    home_e7 = (round(home.lat_deg * 1e7), round(home.lon_deg * 1e7))
    places = [(f"{label}, [home]", home_e7)]
    places += [
        (f"{label}, {_rally_place(number)}", (point.lat_e7, point.lon_e7))
        for number, point in enumerate(things.rally, start=1)
    ]
    for problem in place_breaches(places, areas, plane, options.margin_m):
        report.add(problem)


def _places(things: ListedThings) -> Iterator[tuple[str, int, int]]:
    areas: list[FenceArea] = []
    for fence in (things.fence, things.no_fly):
        areas += (*fence.polygons, *fence.circles) if fence else ()
    for area in areas:
        if isinstance(area, FencePolygon):
            yield from ((area.name, lat_e7, lon_e7) for lat_e7, lon_e7 in area.vertices_e7)
        else:
            yield area.name, area.lat_e7, area.lon_e7
    for number, point in enumerate(things.rally, start=1):
        yield _rally_place(number), point.lat_e7, point.lon_e7


def _rally_place(number: int) -> str:
    return f"[[rally]] {number}"


def check_heights(
    rally: tuple[RallyPoint, ...], options: FenceOptions, vehicle: Vehicle, label: str, report: Report
) -> None:
    """Note heights above the fence's limit, and rally altitudes that the autopilot would not store as they are."""
    for where, message, code in height_faults(rally, options, vehicle):
        report.error(f"{label}, {where}", message, code)
    if options.max_alt_rel_m is not None:
        message = (
            "holds for the plan only: neither a file nor the vehicle's fence carries it; on the vehicle set "
            f"{ALTITUDE_LIMIT[vehicle.autopilot]}"
        )
        report.warning(f"{label}, [fence] max_alt_rel_m", message, "not-carried")


def height_faults(
    rally: tuple[RallyPoint, ...], options: FenceOptions, vehicle: Vehicle
) -> Iterator[tuple[str, str, str]]:
    """Yield place in the scenario, message and code of every height that may not be, for this autopilot."""
    from mavplan.mission.fence_wire import rally_altitude_faults
    from mavplan.mission.flight_law import LAWS

    rules = AUTOPILOTS[vehicle.autopilot]
    limit_m = math.inf if options.max_alt_rel_m is None else options.max_alt_rel_m
    over = f"; [fence] max_alt_rel_m = {figure(limit_m)} is the limit"
    for number, point in enumerate(rally, start=1):
        where = f"{_rally_place(number)} alt_rel_m"
        yield from ((where, message, code) for message, code in rally_altitude_faults(point, rules))
        if point.alt_rel_m > limit_m:
            yield where, f"found {figure(point.alt_rel_m)}{over}", "fence-height"
    where, return_m = "[vehicle] altitude_m", LAWS[vehicle.autopilot].return_height_m
    if vehicle.altitude_m > limit_m:
        yield where, f"found {figure(vehicle.altitude_m)}{over}", "fence-height"
    elif vehicle.end == "rtl" and return_m > limit_m:
        found = f"with default parameters {rules.title} returns at {figure(return_m)} m or higher"
        yield where, f"{found}{over}", "fence-height"
