"""Times of whole plans against the forecast and the hover programme, and moves that only better them."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.hover import hold_times
from mavplan.inflight import received_in_flight
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.forecast import forecast
from mavplan.planners import plan_trajectory
from mavplan.planners.ordering import from_origin
from mavplan.planners.time_moves import (
    candidate_places,
    detours_m,
    inserted,
    merged,
    reordered,
    with_another,
    with_one_instead,
    with_one_less,
)
from mavplan.planners.time_nearby import Nearby
from mavplan.planners.time_polish import polish
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.time_search import TimeSearch
from mavplan.planners.trajectory import assign
from mavplan.radio import planning_channel
from tests.support import make_scenario, user_fields


def problem_of(scenario, *, in_flight=False, alone=False):
    channel = planning_channel(scenario)
    return TimeProblem.of(
        scenario.users, channel, scenario.vehicle, scenario.service, in_flight=in_flight, alone=alone
    )


def scattered(seed, users=14, **options):
    rng = np.random.default_rng(seed)
    return make_scenario(rng.uniform(-300, 1500, (users, 2)), clusters=4, **options)


@settings(max_examples=30)
@given(
    users=user_fields(),
    demand_mbit=st.floats(0, 300),
    mode=st.sampled_from(["broadcast", "tdma"]),
    end=st.sampled_from(["rtl", "land", "stay"]),
    acceleration=st.sampled_from([None, 0.0, 1.5]),
    autopilot=st.sampled_from(["ardupilot", "px4"]),
)
def test_a_plans_time_is_forecast_and_hover_programme(users, demand_mbit, mode, end, acceleration, autopilot):
    pairs = [(one, mate) for one, mate in enumerate(users.mate) if one < mate]
    scenario = make_scenario(
        users.xy_m,
        pairs=pairs,
        demand_mbit=demand_mbit,
        clusters=3,
        mode=mode,
        end=end,
        acceleration_m_s2=acceleration,
        autopilot=autopilot,
    )
    trajectory, rules = plan_trajectory(scenario), AUTOPILOTS[autopilot]
    problem = problem_of(scenario)
    times = problem.times(trajectory.stops_m[None])
    asked_s = hold_times(scenario, trajectory, rules).asked_s
    assert times.hover_s[0] == pytest.approx(asked_s.sum(), abs=1e-5, rel=1e-6)
    assert times.holds_s[0].sum() == pytest.approx(times.hover_s[0])
    flown = forecast(
        trajectory.stops_m,
        asked_s,
        rules=rules,
        altitude_m=100.0,
        speed_m_s=10.0,
        acceleration_m_s2=acceleration,
        end=end,
    )
    assert problem.takeoff_s + times.flight_s[0] == pytest.approx(flown.flight_s, abs=1e-6)


@pytest.mark.parametrize(("acceleration", "off_s"), [(0.0, 2e-3), (None, 0.15), (0.4, 3.0)])
def test_in_flight_service_is_nearly_the_exact_integral(acceleration, off_s):
    scenario = scattered(5, acceleration_m_s2=acceleration)
    trajectory, channel = plan_trajectory(scenario), planning_channel(scenario)
    bits = received_in_flight(
        scenario.users.xy_m, trajectory, channel, scenario.vehicle, AUTOPILOTS["ardupilot"]
    )
    problem = problem_of(scenario, in_flight=True)
    stops = trajectory.stops_m[None]
    found = problem.passing_s(stops)[0]
    best_bit_s = channel.radio.bandwidth_hz * channel.air_rate(np.zeros(1))[0]
    assert found == pytest.approx(bits / best_bit_s, abs=off_s)


def test_a_user_whom_no_stop_reaches_is_its_mates_business_or_nobodys():
    scenario = make_scenario([[600, 0], [600, 600], [600, -700]], pairs=[(0, 1)], demand_mbit=20.0)
    problem = problem_of(scenario)
    reached = np.array([[True, False, True], [True, False, False]])
    wants = problem.wants(reached, None)
    need = problem.need_s[0]
    assert wants[0] == pytest.approx([2 * need, 0.0, need])
    assert np.isinf(wants[1, 2])


def test_in_flight_alone_serves_whom_it_gives_enough_and_only_where_it_may():
    scenario = make_scenario([[600, 100], [900, 0]], demand_mbit=20.0, acceleration_m_s2=0.0)
    reached, passing = np.array([[False, True]]), np.array([[10.0, 1.0]])
    assert problem_of(scenario, in_flight=True, alone=True).wants(reached, passing)[0, 0] == 0.0
    assert np.isinf(problem_of(scenario, in_flight=True).wants(reached, passing)[0, 0])
    assert np.isinf(problem_of(scenario, in_flight=True, alone=True).wants(reached, passing / 10)[0, 0])


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("end", ["rtl", "stay"])
@pytest.mark.parametrize("in_flight", [False, True])
def test_polishing_never_makes_a_plan_worse_and_mostly_better(mode, end, in_flight):
    better = []
    for seed in range(3):
        scenario = scattered(seed, mode=mode, end=end, demand_mbit=30.0)
        problem = problem_of(scenario, in_flight=in_flight and mode == "broadcast")
        stops = plan_trajectory(scenario).stops_m
        before = float(problem.times(stops[None]).total_s[0])
        moved, after = polish(problem, stops)
        assert float(problem.times(moved[None]).total_s[0]) == pytest.approx(after)
        assert after <= before + 1e-9
        better.append(after < 0.99 * before)
    assert any(better)


def test_a_lone_stop_is_polished_to_where_way_and_hover_balance():
    scenario = make_scenario([[900, 0]], demand_mbit=300.0, end="stay", acceleration_m_s2=0.0)
    problem = problem_of(scenario)
    _, found = polish(problem, np.array([[700.0, 150.0]]), steps=60, tolerance=1e-9)
    along = np.linspace(0, 900, 90_001)
    rate = planning_channel(scenario).air_rate(900 - along)
    times = along / 10 + np.where(900 - along <= problem.channel.radius_m, 300.0 / rate, np.inf)
    assert found == pytest.approx(times.min(), rel=1e-4)


def test_moves_keep_what_they_do_not_move():
    scenario = scattered(1)
    problem = problem_of(scenario)
    stops = plan_trajectory(scenario).stops_m
    places = candidate_places(problem, np.random.default_rng(0))
    count = len(stops)
    without = with_one_less(stops)
    assert without.shape == (count, count - 1, 2)
    for gone in range(count):
        np.testing.assert_array_equal(without[gone], np.delete(stops, gone, axis=0))
    where = np.arange(len(places)) % (count + 1)
    for k, plan in enumerate(inserted(stops, places, where)):
        np.testing.assert_array_equal(plan, np.insert(stops, where[k], places[k], axis=0))
    np.testing.assert_allclose(merged(stops)[0][0], (stops[0] + stops[1]) / 2)
    for plan in with_one_instead(problem, stops, places[:5]):
        assert sum(any((stop == old).all() for old in stops) for stop in plan) >= count - 1
    for plan in reordered(problem, stops[::-1]):
        assert sorted(map(tuple, plan)) == sorted(map(tuple, stops))
        assert problem.flight_s(plan) < problem.flight_s(stops[::-1])


@pytest.mark.parametrize("end", ["rtl", "stay"])
def test_a_detour_is_what_the_way_grows_by(end):
    scenario = scattered(2, end=end, acceleration_m_s2=0.0)
    problem = problem_of(scenario)
    stops = plan_trajectory(scenario).stops_m
    places = scenario.users.xy_m[:3]
    found = detours_m(problem, stops, places)
    for k, place in enumerate(places):
        for at in range(len(stops) + 1):
            grown = problem.flight_s(np.insert(stops, at, place, axis=0)) - problem.flight_s(stops)
            assert found[k, at] / 10.0 == pytest.approx(float(grown), abs=1e-9)


def test_users_on_one_spot_are_no_trouble():
    scenario = make_scenario([[800, 0]] * 5, demand_mbit=10.0)
    problem = problem_of(scenario)
    assert len(candidate_places(problem, np.random.default_rng(0))) == 1
    path = from_origin(np.array([[800.0, 0.0]]))
    assert assign(scenario.users, path[1:], problem.channel, d2d=True).served.all()
    doubled = dataclasses.replace(problem, need_s=2 * problem.need_s)
    assert doubled.times(path[None, 1:]).hover_s == pytest.approx(2 * problem.times(path[None, 1:]).hover_s)


@settings(max_examples=20)
@given(users=user_fields(), seed=st.integers(0, 2**32 - 1), tdma=st.booleans())
def test_the_best_neighbour_is_the_best_of_all(users, seed, tdma):
    rng = np.random.default_rng(seed)
    mode = "tdma" if tdma else "broadcast"
    problem = problem_of(make_scenario(users.xy_m, demand_mbit=20.0, clusters=2, mode=mode, end="stay"))
    stops = users.xy_m + rng.uniform(-50.0, 50.0, users.xy_m.shape)
    plans = np.concatenate(
        [with_one_instead(problem, stops, candidate_places(problem, rng)[:60]), stops[None]]
    )
    rates = problem.rates(plans)
    np.testing.assert_array_equal(problem.rates_of_many(plans), rates)
    here = problem.times(stops[None])
    times = problem.times(plans).total_s
    found = TimeSearch(problem, rng).best_of(plans, Nearby(problem, stops), float(here.total_s[0]) - 1e-6)
    if found is None:
        assert times.min() >= here.total_s[0] - 1e-6
    else:
        assert found[1] == pytest.approx(times.min())
        assert problem.times(found[0][None]).total_s[0] == pytest.approx(times.min())


@settings(max_examples=30)
@given(
    users=user_fields(),
    seed=st.integers(0, 2**32 - 1),
    mode=st.sampled_from(["broadcast", "tdma"]),
    in_flight=st.booleans(),
    all_served=st.booleans(),
)
def test_plans_near_one_hover_as_long_as_by_themselves(users, seed, mode, in_flight, all_served):
    rng = np.random.default_rng(seed)
    pairs = [(one, mate) for one, mate in enumerate(users.mate) if one < mate]
    scenario = make_scenario(users.xy_m, pairs=pairs, demand_mbit=20.0, clusters=2, mode=mode, end="rtl")
    problem = problem_of(scenario, in_flight=in_flight)
    stops = np.concatenate([users.xy_m, users.xy_m[:1]]) + rng.uniform(-50.0, 50.0, (len(users) + 1, 2))
    nearby = Nearby(problem, stops if all_served else stops[: len(users) // 2 + 1])
    places = candidate_places(problem, rng)[:40]
    groups = [reordered(problem, stops), with_one_instead(problem, stops, places), with_one_less(stops)]
    groups += [with_another(problem, stops, places), merged(stops), rng.uniform(-900, 900, (3, 4, 2))]
    for plans in groups:
        alone = problem.times(plans)
        able = np.isfinite(alone.total_s)
        rates = problem.rates(plans[able])
        total_s = nearby.total_s(
            alone.flight_s[able], plans[able], rates, problem.wants_of(plans[able], rates)
        )
        assert total_s == pytest.approx(alone.total_s[able], abs=1e-6)
