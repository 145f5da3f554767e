"""A trajectory over real ground: everybody served, every leg clear, each point with its altitude above home. Pure."""

from dataclasses import dataclass, replace

import numpy as np

from mavplan.airspace.routes import Routes
from mavplan.airspace.zones import keep_out
from mavplan.errors import InputError, Problem
from mavplan.geo import LocalPlane
from mavplan.mission.build import Heights
from mavplan.planners.ordering import ORIGIN_M
from mavplan.planners.pinned import pins_of
from mavplan.planners.trajectory import Trajectory
from mavplan.radio import planning_channel
from mavplan.scenario.model import Floats, Scenario
from mavplan.terrain.altitudes import kept_altitudes_m, over_ground, unknown_legs
from mavplan.terrain.grid import Terrain
from mavplan.terrain.service import Links, serve_all


@dataclass(frozen=True, eq=False)
class OverGround:
    """A trajectory with altitudes.

    Attributes
    ----------
    trajectory
        With bends among its points.
    back_m
        Where the way back turns, the place above home not among them; None where there is none.
    takeoff_m
        Where the take-off ends, above home.
    heights
        Everything behind it, above home.
    links
        Who is heard from which stop.
    """

    trajectory: Trajectory
    back_m: Floats | None
    takeoff_m: float
    heights: Heights
    links: Links


def fly_over(
    trajectory: Trajectory, scenario: Scenario, terrain: Terrain, back_m: Floats | None, plane: LocalPlane
) -> OverGround:
    """Return a trajectory that serves everybody and keeps clear of the ground.

    Parameters
    ----------
    trajectory
        As it was planned in the plane, round the no-fly zones.
    scenario
        Its altitude is above the ground, at every stop and turning point and above home.
    terrain
        The ground.
    back_m
        (B, 2) where the way back turns for the zones.
    plane
        Of the scenario.

    Raises
    ------
    InputError
        Users whom nobody can serve, and legs under which the ground is not known.
    """
    vehicle = scenario.vehicle
    returns = vehicle.end == "rtl"
    home_m = terrain.home_m
    _check_known(terrain, trajectory.path_m, len(trajectory.path_m))

    def altitudes_m(places_m: Floats) -> Floats:
        above_home_m = kept_altitudes_m(terrain.height_m(places_m) + vehicle.altitude_m - home_m)
        return home_m + np.array(above_home_m, dtype=np.float64)

    out = None
    if scenario.no_fly is not None:
        out = keep_out(scenario.no_fly, plane, scenario.fence_options.margin_m)
    served = serve_all(
        trajectory,
        scenario.users,
        planning_channel(scenario),
        altitudes_m,
        terrain,
        back_m=np.zeros((0, 2)) if back_m is None else back_m,
        returns=returns,
        closed=(lambda places: np.zeros(len(places), dtype=bool)) if out is None else out.holds,
        route=(lambda _start, _end: []) if out is None else Routes(out).between,
        pins=pins_of(scenario),
    )
    found = served.trajectory
    way_back = np.vstack([served.back_m, ORIGIN_M[None]]) if returns else np.zeros((0, 2))
    path = np.vstack([found.path_m, way_back])
    _check_known(terrain, path, len(found.path_m))
    climbing = over_ground(terrain, path, altitudes_m(path), scenario.terrain_options.clearance_m)
    alt_rel_m = kept_altitudes_m(climbing.alt_m - home_m)
    last = int(climbing.given[len(found.path_m) - 1])
    ground_m = float(terrain.height_m(found.path_m[-1:])[0])
    return OverGround(
        replace(found, path_m=climbing.path_m[: last + 1], stop_at=climbing.given[found.stop_at]),
        climbing.path_m[last + 1 : -1] if returns else None,
        alt_rel_m[0],
        Heights(
            alt_rel_m[1 : last + 1],
            alt_rel_m[last + 1 : -1] if returns else (),
            alt_rel_m[-1],
            kept_altitudes_m([ground_m - home_m])[0],
        ),
        served.links,
    )


def _check_known(terrain: Terrain, path_m: Floats, outward: int) -> None:
    """Raise an `InputError` that names the legs under which the ground is not known; the way back begins behind."""
    problems = []
    for leg, place_m in unknown_legs(terrain, path_m):
        name = f"leg {leg + 1}" if leg < outward - 1 else "the way back"
        where = f"{place_m[0]:,.0f} m east and {place_m[1]:,.0f} m north of home"
        message = f"{terrain.label} has no height under it, {where}: give the tile that has"
        problems.append(Problem(name, message, "not-covered"))
    if problems:
        raise InputError(problems)
