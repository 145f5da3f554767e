"""Hover times against CVXPY and against what every user must receive."""

import itertools

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.hover import broadcast_rates, demand_on_air, hold_times, least_broadcast_holds, near_rates
from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.planners import plan_trajectory
from mavplan.radio import Channel, planning_channel
from mavplan.scenario import Scenario, Vehicle
from tests.support import make_scenario, user_fields


def planned(**options):
    scenario = make_scenario(**options)
    return scenario, plan_trajectory(scenario)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_least_sum_is_that_of_cvxpy(seed):
    rng = np.random.default_rng(seed)
    users, stops = rng.integers(1, 12), rng.integers(1, 6)
    rates = rng.uniform(0, 5e6, (users, stops)) * (rng.random((users, stops)) < 0.6)
    demand = rng.uniform(0, 5e7, users) * (rates.max(axis=1) > 0)
    seconds = cp.Variable(stops, nonneg=True)
    problem = cp.Problem(cp.Minimize(cp.sum(seconds)), [rates / 1e6 @ seconds >= demand / 1e6])
    problem.solve(solver=cp.CLARABEL)
    found = least_broadcast_holds(rates, demand)
    assert found.sum() == pytest.approx(problem.value, rel=1e-6, abs=1e-6)
    assert (rates @ found >= demand * (1 - 1e-6)).all()


def test_of_equally_good_stops_the_earlier_one_hovers():
    np.testing.assert_allclose(
        least_broadcast_holds(np.full((1, 3), 1e6), np.array([5e6])), [5, 0, 0], atol=1e-6
    )


def test_users_in_reach_of_one_stop_share_its_seconds():
    rates = np.array([[2e6], [1e6]])
    np.testing.assert_allclose(least_broadcast_holds(rates, np.array([4e6, 3e6])), [3.0])


@settings(max_examples=60, deadline=None)
@given(
    users=user_fields(),
    demand_mbit=st.floats(0, 500),
    mode=st.sampled_from(["broadcast", "tdma"]),
    autopilot=st.sampled_from(["ardupilot", "px4"]),
    clusters=st.integers(1, 6),
)
def test_what_the_autopilot_stores_meets_every_demand(users, demand_mbit, mode, autopilot, clusters):
    rules = AUTOPILOTS[autopilot]
    pairs = [(one, mate) for one, mate in enumerate(users.mate) if one < mate]
    scenario, trajectory = planned(
        xy_m=users.xy_m, pairs=pairs, demand_mbit=demand_mbit, clusters=clusters, mode=mode
    )
    holds = hold_times(scenario, trajectory, rules)
    stored = holds.stored_s.astype(np.float32).astype(float)
    if autopilot == "ardupilot":
        assert (stored == np.trunc(stored)).all()
    assert (stored >= rules.min_hold_s - 1e-6).all()
    channel = Channel(scenario.radio, 100.0, scenario.d2d)
    demand = demand_on_air(scenario.users, trajectory)
    # Written out, not taken from the code under test: own demand, and that of the mate it relays to.
    for user in range(len(users)):
        own = 0.0 if trajectory.assignment.d2d[user] else demand_mbit * 1e6
        relayed = [m for m in range(len(users)) if trajectory.assignment.d2d[m] and users.mate[m] == user]
        assert demand[user] == own + len(relayed) * demand_mbit * 1e6
    if mode == "broadcast":
        received = broadcast_rates(scenario.users, trajectory.stops_m, channel) @ stored
        assert (received >= demand - 1).all()
    else:
        for stop in range(len(stored)):
            slots = [slot for slot in holds.schedule if slot.stop == stop]
            assert sum(slot.duration_s for slot in slots) <= stored[stop] * (1 + 1e-12)
            for before, after in itertools.pairwise(slots):
                assert after.start_s == pytest.approx(before.start_s + before.duration_s)
        for slot in holds.schedule:
            away = np.linalg.norm(users.xy_m[slot.user] - trajectory.stops_m[slot.stop])
            bits = slot.duration_s * 1e6 * np.log2(1 + channel.gamma0 / (100.0**2 + away**2))
            assert bits == pytest.approx(demand[slot.user], abs=1e-3)


def test_no_demand_means_reached_with_the_least_hold_that_stops():
    scenario, trajectory = planned(xy_m=[[500, 0]], demand_mbit=0.0)
    assert hold_times(scenario, trajectory, ARDUPILOT).stored_s.tolist() == [1.0]
    assert hold_times(scenario, trajectory, PX4).stored_s.tolist() == [0.1]
    assert hold_times(scenario, trajectory, PX4).asked_s.tolist() == [0.0]


def test_a_user_straight_below_needs_its_demand_over_its_rate():
    scenario, trajectory = planned(xy_m=[[500, 0]], demand_mbit=10.0)
    gamma0 = 10 ** ((20 - 70 + 105.3045) / 10)
    seconds = 10e6 / (1e6 * np.log2(1 + gamma0 / 100**2))
    holds = hold_times(scenario, trajectory, ARDUPILOT)
    assert holds.asked_s[0] == pytest.approx(seconds)
    assert holds.stored_s[0] == np.ceil(seconds) == 2.0
    assert holds.surplus_s == pytest.approx(2.0 - seconds)
    assert hold_times(scenario, trajectory, PX4).stored_s[0] == 2.0


def test_where_rounding_up_is_dear_whole_seconds_are_optimised():
    rng = np.random.default_rng(4)
    scenario, trajectory = planned(xy_m=rng.uniform(0, 1500, (40, 2)), clusters=12, demand_mbit=10.0)
    holds = hold_times(scenario, trajectory, ARDUPILOT)
    assert holds.hover_s < np.maximum(np.ceil(holds.asked_s), 1).sum()


def test_a_hold_beyond_what_is_stored_is_refused_with_the_stop_and_the_limit():
    scenario, trajectory = planned(xy_m=[[500, 0]], demand_mbit=1e7)
    with pytest.raises(InputError, match=r"stop 1: needs a hold of .* stores at most 65,535 s"):
        hold_times(scenario, trajectory, ARDUPILOT)


def test_a_higher_vehicle_hovers_longer():
    scenario, trajectory = planned(xy_m=[[500, 0]])
    higher = Scenario(scenario.home, scenario.users, vehicle=Vehicle(altitude_m=300.0))
    low, high = (hold_times(s, trajectory, PX4).hover_s for s in (scenario, higher))
    assert high > low


@given(user_fields(), st.integers(0, 10**6))
def test_near_rates_are_those_of_all_pairs(users, seed):
    scenario = make_scenario(users.xy_m)
    channel = planning_channel(scenario)
    stops_m = np.random.default_rng(seed).uniform(-3000, 3000, (9, 2))
    edge_m = users.xy_m[:1] + np.array([channel.radius_m, 0.0])
    stops_m = np.vstack([stops_m, users.xy_m[:2], edge_m])
    found = near_rates(users, stops_m, channel)
    np.testing.assert_allclose(found.toarray(), broadcast_rates(users, stops_m, channel), rtol=1e-12)
    assert found.has_sorted_indices
