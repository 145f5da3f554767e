"""The planner of the least mission time: against one-dimensional optima, the paper's planners and its own bound."""

import dataclasses
import importlib

import numpy as np
import pytest

from mavplan.bounds.time import from_json, proved_time_s
from mavplan.bounds.time_case import TimeCase
from mavplan.plan import make_plan
from mavplan.planners import plan_trajectory, time_bound, time_search
from mavplan.planners.time_search import TimeSearch
from mavplan.radio import planning_channel
from mavplan.scenario import Service, Wind
from tests.support import make_scenario, mission_s_of

module = importlib.import_module("mavplan.planners.least_time")


@pytest.fixture(autouse=True)
def brief(monkeypatch):
    """A short search: what holds for the planner holds for it too."""
    for room, name, value in (
        (module, "ROUNDS", 2),
        (module, "ROUNDS_IN_FLIGHT", 2),
        (module, "ROUNDS_A_STOP", 0),
        (module, "NEARER", (1.0, 0.7)),
        (module, "FROM_BOUND", 2),
        (time_search, "STARTS", 2),
        (time_bound, "ROUNDS", 3),
        (time_bound, "MOST_NODES", 6_000),
    ):
        monkeypatch.setattr(room, name, value)


def at_once(xy_m, *, in_flight=False, planner="time", **options):
    """A scenario of a vehicle that needs no time to gather speed and stays at its last stop."""
    options = {"acceleration_m_s2": 0.0, "end": "stay", "clusters": 3, **options}
    scenario = make_scenario(xy_m, planner=planner, **options)
    counts = in_flight and scenario.service.mode == "broadcast"
    return dataclasses.replace(scenario, service=dataclasses.replace(scenario.service, in_flight=counts))


def scattered(seed, users=10, **options):
    rng = np.random.default_rng(seed)
    return at_once(rng.uniform(0, 1600, (users, 2)), seed=seed, **options)


def test_a_lone_user_is_served_from_where_way_and_hover_balance():
    scenario = at_once([[900, 0]], demand_mbit=300.0)
    found = plan_trajectory(scenario)
    channel = planning_channel(scenario)
    along = np.linspace(0, 900, 90_001)
    times = along / 10 + 300.0 / channel.air_rate(900 - along)
    best = times[900 - along <= channel.radius_m].min()
    flight_and_hover = mission_s_of(scenario, found) - make_plan(scenario).forecast.takeoff_s
    assert flight_and_hover == pytest.approx(best, rel=1e-4)
    assert found.bound.gap < 2e-3


def test_users_at_hand_are_served_without_any_way():
    found = plan_trajectory(at_once([[100, 0], [0, -100]], demand_mbit=0.0))
    assert found.length_m == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("in_flight", [False, True])
@pytest.mark.parametrize("clusters", [3, "auto"])
def test_it_is_never_longer_than_the_papers_planners_with_the_same_service(in_flight, clusters):
    for seed, options in enumerate(
        ({}, {"end": "rtl", "acceleration_m_s2": None}, {"demand_mbit": 120.0, "autopilot": "px4"})
    ):
        scenario = scattered(seed, in_flight=in_flight, clusters=clusters, **options)
        least_s = mission_s_of(scenario, plan_trajectory(scenario))
        for name in ("tloaik", "stoaik", "boaik"):
            other = dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, name=name))
            # In flight a table stands for the integral while plans are compared.
            assert least_s <= mission_s_of(scenario, plan_trajectory(other)) + 1e-2


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("end", ["rtl", "land", "stay"])
def test_everybody_is_served_and_the_bound_is_not_above_the_plan(mode, end):
    for seed, acceleration in enumerate((0.0, None)):
        scenario = scattered(seed, mode=mode, end=end, acceleration_m_s2=acceleration, in_flight=True)
        found = plan_trajectory(scenario)
        assert found.assignment.served.all()
        assert found.bound.objective == "mission_s"
        assert 0 < found.bound.bound <= found.bound.plan
        assert found.bound.plan == pytest.approx(mission_s_of(scenario, found), rel=2e-3)
        assert found.bound.gap < 0.3


def test_one_at_a_time_the_plan_is_the_best_there_is():
    for seed in range(3):
        assert plan_trajectory(scattered(seed, users=7, mode="tdma")).bound.gap < 5e-3


def test_a_mate_is_served_through_the_other_where_that_is_shorter():
    xy = [[700, 0], [700, 1200], [900, 100], [1400, 0]]
    alone = plan_trajectory(at_once(xy))
    paired = plan_trajectory(at_once(xy, pairs=[(0, 1)]))
    assert paired.assignment.d2d.tolist() == [False, True, False, False]
    assert paired.bound.plan < alone.bound.plan - 40
    assert paired.bound.gap < 0.1


def test_in_flight_service_shortens_the_mission():
    for seed in range(2):
        with_it = plan_trajectory(scattered(seed, in_flight=True, demand_mbit=40.0))
        without = plan_trajectory(scattered(seed, demand_mbit=40.0))
        assert with_it.bound.plan < 0.95 * without.bound.plan


def test_in_flight_is_counted_where_the_scenario_does_not_say():
    scenario = make_scenario([[900, 0], [900, 900]], planner="time")
    assert make_plan(scenario).holds.in_flight_bit is not None
    silent = dataclasses.replace(scenario, service=Service(in_flight=False))
    assert make_plan(silent).holds.in_flight_bit is None


def test_the_same_seed_gives_the_same_plan_and_another_may_not():
    one, again = (plan_trajectory(scattered(3, users=20)) for _ in range(2))
    np.testing.assert_array_equal(one.path_m, again.path_m)
    assert one.bound.bound == again.bound.bound


@pytest.mark.parametrize("in_flight", [False, True])
def test_without_any_time_there_is_a_plan_a_bound_and_a_note(in_flight):
    scenario = scattered(1, in_flight=in_flight)
    hurried = dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, time_limit_s=0.0))
    found = plan_trajectory(hurried)
    assert found.assignment.served.all()
    assert found.bound.bound > 0
    assert [note.code for note in found.notes] == ["not-proved"]
    assert plan_trajectory(scenario).notes == ()


def test_wind_against_every_leg_makes_the_least_time_longer():
    still = scattered(0, acceleration_m_s2=None)
    windy = dataclasses.replace(still, wind=Wind(speed_m_s=8.0))
    calm, blown = plan_trajectory(still), plan_trajectory(windy)
    assert blown.bound.bound > calm.bound.bound
    assert blown.bound.plan > calm.bound.plan


def test_the_plan_says_what_is_proved_of_the_mission_as_it_is_written():
    plan = make_plan(scattered(2, acceleration_m_s2=None, end="rtl"))
    bound = plan.trajectory.bound
    assert bound.plan == pytest.approx(plan.forecast.flight_s + plan.holds.asked_s.sum())
    assert bound.bound <= bound.plan <= plan.forecast.mission_s + 1e-9


@pytest.mark.parametrize("users", [1, 2, 3])
def test_a_bound_that_rests_on_service_alone_is_proved_too(users):
    """The way is nothing beside such demands, so its metres count for nothing in the proof."""
    scenario = scattered(users, users, demand_mbit=3000.0, end="rtl", in_flight=True)
    found = plan_trajectory(scenario)
    certificate = from_json(found.bound.certificate(None))
    assert certificate.share == pytest.approx(1.0)
    case = TimeCase.of(
        scenario.users,
        planning_channel(scenario),
        scenario.vehicle,
        scenario.service,
        wind=None,
        in_flight=True,
    )
    assert proved_time_s(certificate, case) == pytest.approx(found.bound.bound, rel=1e-3)
    assert found.bound.gap < 0.5


def test_a_search_keeps_the_best_plan_it_was_given(monkeypatch):
    scenario = scattered(4)

    class Idle(TimeSearch):
        def _improved(self, stops_m, total_s, keep_going, *, descended=False):
            return stops_m, np.inf

    monkeypatch.setattr(module, "TimeSearch", Idle)
    found = plan_trajectory(scenario)
    for name in ("tloaik", "stoaik", "boaik"):
        other = dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, name=name))
        assert mission_s_of(scenario, found) <= mission_s_of(scenario, plan_trajectory(other)) + 1e-6
