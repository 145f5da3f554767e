"""A mission stops only where somebody is served."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.hover import hold_times
from mavplan.idle_stops import without_idle_stops
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.plan import make_plan
from mavplan.planners import plan_trajectory
from mavplan.planners.trajectory import NO_STOP
from tests.support import make_scenario

RULES = AUTOPILOTS["ardupilot"]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), clusters=st.integers(2, 9), planner=st.sampled_from(["tloaik", "boaik"]))
def test_everybody_keeps_stop_link_and_hold_and_the_path_is_no_longer(seed, clusters, planner):
    users_m = np.random.default_rng(seed).uniform(0, 2500, (14, 2))
    scenario = make_scenario(users_m, planner=planner, clusters=clusters)
    before = plan_trajectory(scenario)
    after = without_idle_stops(scenario, before, RULES)
    assert set(after.assignment.stop.tolist()) - {NO_STOP} <= set(range(len(after.stop_at)))
    np.testing.assert_array_equal(
        after.stops_m[after.assignment.stop], before.stops_m[before.assignment.stop]
    )
    np.testing.assert_array_equal(after.assignment.rate_bit_s_hz, before.assignment.rate_bit_s_hz)
    assert after.length_m <= before.length_m + 1e-9
    asked_s = [float(hold_times(scenario, flown, RULES).asked_s.sum()) for flown in (before, after)]
    assert asked_s[1] == pytest.approx(asked_s[0], rel=1e-6, abs=1e-6)
    served = np.zeros(len(after.stop_at), dtype=bool)
    served[after.assignment.stop] = True
    assert (served | (hold_times(scenario, after, RULES).asked_s > 0)).all()


def test_a_cluster_stop_that_is_nobodys_is_left_out_of_the_mission():
    """Both users are out of reach of the stop of their cluster between them: each gets one of its own."""
    scenario = make_scenario([[0, 2000], [1000, 2000]], clusters=1)
    before = plan_trajectory(scenario)
    assert len(before.stop_at) == 3
    plan = make_plan(scenario)
    assert len(plan.trajectory.stop_at) == 2
    assert all(plan.holds.asked_s > 0)
    benchmark = make_plan(make_scenario([[0, 2000], [1000, 2000]], planner="sbw"))
    assert len(benchmark.trajectory.stop_at) == len(plan_trajectory(benchmark.scenario).stop_at)
