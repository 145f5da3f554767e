"""A scenario that is moved keeps its shape."""

import numpy as np
import pytest

from mavplan.geo import LocalPlane, geodesic_distance_m
from mavplan.plan import make_plan
from mavplan.scenario import Home, load_scenario
from tests.test_gallery import EXAMPLES, GALLERY

from .moved import moved


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("home", [Home(-35.363262, 149.165237, 584.0), Home(47.397742, 8.545594, 488.0)])
def test_the_plan_of_a_moved_scenario_is_the_same_plan_elsewhere(name, home):
    scenario = load_scenario(GALLERY / name / "scenario.toml")
    there = moved(scenario, home)
    back = LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(there.users.lat_deg, there.users.lon_deg)
    assert np.abs(back - scenario.users.xy_m).max() < 0.01
    one, other = make_plan(scenario), make_plan(there)
    assert other.trajectory.length_m == pytest.approx(one.trajectory.length_m, abs=0.01)
    first = other.built.mission.items[other.built.stop_items[0].first]
    away_m = float(geodesic_distance_m(home.lat_deg, home.lon_deg, first.lat_deg, first.lon_deg))
    assert away_m == pytest.approx(np.linalg.norm(one.trajectory.stops_m[0]), abs=0.05)
