"""``[terrain]`` against the rest of a scenario: what it asks, and whether the ground is known where it must be."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.mission.fence_geometry import PlanePolygon, plane_areas
from mavplan.scenario.model import Floats, Scenario
from mavplan.scenario.report import Report, figure
from mavplan.scenario.sections import Service, TerrainOptions
from mavplan.terrain.grid import Terrain

MAX_HOME_OFF_M = 10.0
"""Home and the ground there may differ by so much; beyond, one of the two is wrong or above something else."""

MARGIN_M = 500.0
"""Of ground that is read beyond what is reached from the users."""


def check_terrain(
    options: TerrainOptions, altitude_m: float, service: Service, label: str, report: Report
) -> None:
    """Note what a section asks that cannot be; the altitude is the greatest that may be flown."""
    if options.file is None:
        message = 'is missing; name the terrain: file = "N46E007.hgt", or a list of files'
        report.error(f"{label}, [terrain] file", message, "missing-key")
        return
    if options.clearance_m > altitude_m:
        message = (
            f"found {figure(options.clearance_m)}; at the stops at most {figure(altitude_m)} m ([vehicle] altitude_m) "
            "is flown above the ground, and that is the most that can be kept"
        )
        report.error(f"{label}, [terrain] clearance_m", message, "clearance")
    if service.in_flight:
        message = "found true with [terrain]; nothing is counted in flight there, as the ground may hide users: false"
        report.error(f"{label}, [service] in_flight", message, "no-in-flight")


def ground_of(
    scenario: Scenario, places: Sequence[str], folder: Path, label: str, report: Report
) -> Terrain | None:
    """Return the ground round home and the users; None with problems noted.

    Parameters
    ----------
    scenario
        Everything else of it.
    places
        Where each user stands in its file, for messages.
    folder
        The files of the terrain stand relative to it.
    label
        What to call the scenario, for messages.
    report
        Takes the problems.
    """
    from mavplan.terrain.read import read_terrain

    plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    where = f"{label}, [terrain]"
    terrain = read_terrain(scenario.terrain_options, folder, plane, _box_m(scenario, plane), where, report)
    if terrain is None:
        return None
    users = scenario.users
    heights_m = terrain.height_m(users.xy_m)
    for n in np.flatnonzero(np.isnan(heights_m)).tolist():
        message = f"{users.names[n]} stands where {terrain.label} has no height"
        report.error(places[n], message, "not-covered")
    homes = [("[home]", np.zeros(2), scenario.home.alt_amsl_m)]
    for number, (at, (place_m,)) in enumerate(
        ((at, plane.to_xy_m(at.lat_deg, at.lon_deg)) for at in scenario.vehicles), start=1
    ):
        homes.append((f"[[vehicles]] {at.name or number}", place_m, at.alt_amsl_m))
    for name, place_m, home_m in homes:
        _check_home(terrain, place_m, home_m, f"{label}, {name}", report)
    return terrain


def _check_home(terrain: Terrain, place_m: Floats, home_m: float, where: str, report: Report) -> None:
    """Note a home of which the ground is not known, or is not as high as it is said to be."""
    ground_m = float(terrain.height_m(place_m[None])[0])
    if np.isnan(ground_m):
        report.error(where, f"lies where {terrain.label} has no height", "not-covered")
    elif abs(home_m - ground_m) > MAX_HOME_OFF_M:
        message = (
            f"found {figure(home_m)}; {terrain.label} has {ground_m:,.1f} m ({terrain.datum}) there, and more than "
            f"{MAX_HOME_OFF_M:g} m apart one of the two is wrong: a height of a GPS receiver may be above the "
            "ellipsoid, and not above sea level"
        )
        report.error(f"{where} alt_amsl_m", message, "home-height")


def _box_m(scenario: Scenario, plane: LocalPlane) -> tuple[float, float, float, float]:
    """Return what holds the homes, everything in reach of the users, and the no-fly zones that a leg may lead round."""
    from mavplan.radio import planning_channel

    homes_m = [plane.to_xy_m(at.lat_deg, at.lon_deg) for at in scenario.vehicles]
    places = np.vstack([np.zeros((1, 2)), *homes_m, scenario.users.xy_m])
    grown_m = planning_channel(scenario).radius_m + MARGIN_M
    low, high = places.min(axis=0) - grown_m, places.max(axis=0) + grown_m
    for area in plane_areas(scenario.no_fly, plane) if scenario.no_fly else ():
        if isinstance(area, PlanePolygon):
            west_south, east_north = area.ring_m.min(axis=0), area.ring_m.max(axis=0)
        else:
            west_south, east_north = area.centre_m - area.radius_m, area.centre_m + area.radius_m
        if (west_south <= high).all() and (east_north >= low).all():
            low, high = np.minimum(low, west_south - MARGIN_M), np.maximum(high, east_north + MARGIN_M)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
