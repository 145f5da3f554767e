"""Missions for very many users: everybody is served, the same anywhere, quicker than the path alone."""

import dataclasses
import sys

import numpy as np
import pytest

from mavplan.hppp import draw_pairs, draw_users
from mavplan.planners import plan_trajectory, wide_path, wide_time
from mavplan.planners.spread import hands
from mavplan.planners.time_problem import Onward, TimeProblem
from mavplan.planners.time_search import TimeSearch
from mavplan.radio import planning_channel
from tests.support import make_scenario


@pytest.fixture(autouse=True)
def little_effort(monkeypatch):
    monkeypatch.setattr(wide_path, "EFFORTS", (0.1, 0.1, 0.1))
    monkeypatch.setattr(wide_path, "LEAST_ATTEMPTS", 0)
    monkeypatch.setattr(sys.modules["mavplan.planners.least_time"], "TOGETHER", 40)


def scenario_of(count, *, pairs=False, mbit=20.0, mode="broadcast", **vehicle):
    side_m = 2000 * np.sqrt(count / 60)
    xy_m, mate = (draw_pairs if pairs else draw_users)(count, side_m, seed=4)
    couples = [(n, int(m)) for n, m in enumerate(mate) if m > n]
    return make_scenario(xy_m, pairs=couples, demand_mbit=mbit, mode=mode, planner="time", **vehicle)


def mission_s(scenario, stops_m):
    problem = TimeProblem.of(
        scenario.users,
        planning_channel(scenario),
        scenario.vehicle,
        scenario.service,
        in_flight=scenario.service.mode == "broadcast",
        alone=False,
    )
    return float(problem.times(stops_m[None]).total_s[0])


def on_a_short_path(scenario):
    """Stops on a short path, without regard to holds."""
    from mavplan.planners.path_problem import path_problem
    from mavplan.planners.spread import spread_here
    from mavplan.planners.wide_stops import stops_on_long_path

    users, channel = scenario.users, planning_channel(scenario)
    problem = path_problem(
        users.xy_m, channel.radius_m, returns=scenario.vehicle.end == "rtl", mate=users.mate
    )
    points_m = wide_path.wide_path(problem.without_met(), scenario.planner.seed, spread_here)
    return stops_on_long_path(users, channel, problem.path_m(points_m), spread_here)


@pytest.mark.parametrize(
    ("pairs", "mode", "end"),
    [
        (False, "broadcast", "stay"),
        (True, "broadcast", "rtl"),
        (False, "tdma", "rtl"),
        (True, "tdma", "land"),
    ],
)
def test_everybody_is_served_and_sooner_than_on_a_short_path(pairs, mode, end):
    scenario = scenario_of(80, pairs=pairs, mode=mode, end=end)
    found = plan_trajectory(scenario)
    assert found.assignment.served.all()
    assert mission_s(scenario, found.stops_m) < mission_s(scenario, on_a_short_path(scenario))
    assert found.bound is None
    assert [(note.code, note.severity) for note in found.notes] == [("no-bound", "warning")]


def test_of_more_users_everybody_is_served_too_after_brief_searches(monkeypatch):
    scenario = scenario_of(80, pairs=True, end="rtl")
    thorough_s = mission_s(scenario, plan_trajectory(scenario).stops_m)
    monkeypatch.setattr(wide_time, "MANY", 40)
    found = plan_trajectory(scenario)
    assert found.assignment.served.all()
    briefly_s = mission_s(scenario, found.stops_m)
    assert briefly_s < mission_s(scenario, on_a_short_path(scenario))
    assert briefly_s < 1.05 * thorough_s


def test_stretches_may_be_worked_out_in_any_order_and_the_plan_is_the_same():
    def backwards(function, tasks):
        return [function(task) for task in tasks[::-1]][::-1]

    scenario = scenario_of(90)
    here = plan_trajectory(scenario)
    with hands(backwards):
        np.testing.assert_array_equal(plan_trajectory(scenario).path_m, here.path_m)


def test_up_to_the_limit_the_small_planner_plans(monkeypatch):
    scenario = scenario_of(5)
    few = plan_trajectory(scenario)
    assert few.bound is not None
    assert not [note for note in few.notes if note.code == "no-bound"]


def test_a_part_of_a_plan_takes_what_it_takes_in_the_whole():
    """Flight of the part, its way on included, and of the rest are the flight of the whole."""
    scenario = scenario_of(30, acceleration_m_s2=2.0, end="rtl")
    channel = planning_channel(scenario)
    stops_m = np.random.default_rng(0).uniform(-2000, 2000, (7, 2))

    def problem(end, onward=None):
        vehicle = dataclasses.replace(scenario.vehicle, end=end)
        return TimeProblem.of(
            scenario.users, channel, vehicle, scenario.service, in_flight=True, alone=False, onward=onward
        )

    whole = problem("rtl")
    on = Onward(stops_m[3] - stops_m[0], scenario.vehicle.speed_m_s, serves=True)
    home = Onward(-stops_m[3], whole.flyer.law.return_m_s, serves=False)
    parts_s = [
        problem("stay").flight_s(stops_m[:1]),
        problem("stay", on).flight_s(stops_m[1:3] - stops_m[0]),
        problem("stay", home).flight_s(stops_m[4:] - stops_m[3]),
    ]
    assert sum(parts_s) + whole.home_s == pytest.approx(float(whole.flight_s(stops_m)), abs=1e-6)
    moved = dataclasses.replace(problem("stay", on), users_m=scenario.users.xy_m - stops_m[0])
    moved = dataclasses.replace(problem("stay", on), users_m=scenario.users.xy_m - stops_m[0])
    inner = stops_m[1:3] - stops_m[0]
    as_stop = dataclasses.replace(moved, onward=None).passing_s(np.vstack([inner, on.place_m]))
    np.testing.assert_allclose(moved.passing_s(inner), as_stop)
    assert as_stop.sum() > dataclasses.replace(moved, onward=None).passing_s(inner).sum()


def test_a_stretch_is_searched_with_regard_to_where_it_leads_on():
    """A stop is put in behind the last one where the way on makes that the least detour."""
    scenario = scenario_of(2)
    place = np.array([[3000.0, 0.0]])
    onward = Onward(np.array([6000.0, 0.0]), 10.0, serves=False)
    users = dataclasses.replace(scenario.users.some(np.array([0, 1]), scenario.users.demand_bit))
    users = dataclasses.replace(users, xy_m=np.vstack([[1000.0, 0.0], place]))
    problem = TimeProblem.of(
        users, planning_channel(scenario), scenario.vehicle, scenario.service, in_flight=False, onward=onward
    )
    search = TimeSearch(problem, np.random.default_rng(0))
    search.consider([np.array([[1000.0, 0.0]])], lambda: True)
    assert (np.diff(search.best_m[:, 0]) > 0).all()
    assert search.best_m[-1, 0] > 2000
