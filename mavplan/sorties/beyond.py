"""Users whom no battery reaches, whatever the plan: left out before it is made, so that it is not made for them."""

import numpy as np

from mavplan.geo import LocalPlane
from mavplan.scenario.checks import reach_of
from mavplan.scenario.model import Bools, Scenario

SURE = 1e-4
"""Too far away is who is further than the reach by this part of it: distances in the plane are not quite those on
Earth."""


def within_reach(scenario: Scenario, most: int | None) -> tuple[Scenario, Bools]:
    """Return the scenario of the users who can be served with the endurance, and (N,) who cannot.

    As the scenario's reader looks at it: straight out, and back where the mission returns, from the nearest home; a
    user's mate may be near enough for both. Where that is nobody, and where a pinned stop is above one who is too far
    away, they stay in, for the planner to say what is wrong; everybody where ``most`` sorties is None: all are served.
    """
    users = scenario.users
    reach = reach_of(scenario.vehicle, scenario.radio, scenario.d2d, scenario.service)
    if reach is None or most is None:
        return scenario, np.zeros(len(users), dtype=np.bool_)
    here = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    lat_deg = [scenario.home.lat_deg, *(vehicle.lat_deg for vehicle in scenario.vehicles)]
    lon_deg = [scenario.home.lon_deg, *(vehicle.lon_deg for vehicle in scenario.vehicles)]
    offset_m = users.xy_m[:, None] - here.to_xy_m(lat_deg, lon_deg)
    near_m = np.hypot(offset_m[..., 0], offset_m[..., 1]).min(axis=1)
    beyond = reach.beyond(near_m / (1 + SURE), users.mate)
    beyond &= ~users.named({stop.user for stop in scenario.stops if stop.user is not None})
    if beyond.all() or not beyond.any():
        return scenario, np.zeros(len(users), dtype=np.bool_)
    near = users.some(np.flatnonzero(~beyond), users.demand_bit)
    return scenario.with_some(near), beyond
