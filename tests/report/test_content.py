"""A report says what the plan says: the same stops, users, seconds and items as the plan and the wire have them."""

import dataclasses

import numpy as np
import pytest

from mavplan.hover import hold_times
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.wire import to_wire
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.report.content import report_content
from mavplan.scenario import load_scenario
from mavplan.stored_plan import parse_plan
from tests.support import make_scenario
from tests.test_gallery import GALLERY


def report_of(scenario):
    plan = make_plan(scenario)
    return plan, report_content(plan.built.mission, parse_plan(dumps(plan), "x"), "x")


def test_figures_are_the_plans(valley):
    plan, content = valley
    assert content.mission_s == pytest.approx(plan.forecast.mission_s, abs=0.05)
    assert content.length_m == pytest.approx(plan.trajectory.length_m, abs=0.1)
    assert content.back_m == pytest.approx(np.linalg.norm(plan.trajectory.path_m[-1]), abs=0.1)
    assert content.used_wh == pytest.approx(plan.forecast.used_wh, abs=0.01)
    assert content.radius_m == plan.trajectory.radius_m
    assert content.demand_mbit == pytest.approx(plan.scenario.users.demand_bit.sum() / 1e6)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_items_have_the_numbers_they_have_on_the_wire(autopilot):
    scenario = load_scenario(GALLERY / "valley/scenario.toml")
    vehicle = dataclasses.replace(scenario.vehicle, autopilot=autopilot)
    plan, content = report_of(dataclasses.replace(scenario, vehicle=vehicle))
    wire = {item.seq: item for item in to_wire(plan.built.mission, AUTOPILOTS[autopilot])}
    for row in content.items:
        if row.lat_deg is not None:
            assert (round(row.lat_deg * 1e7), round(row.lon_deg * 1e7)) == (wire[row.seq].x, wire[row.seq].y)
    for stop in content.stops:
        numbers = [int(number) for number in stop.items.split("–")]
        assert max(wire[number].param1 for number in numbers) == np.float32(stop.hold_s)
        assert {row.stop for row in content.items if row.seq in numbers} == {stop.number}


def test_every_user_gets_what_it_needs_and_stands_with_its_stop(valley):
    _, content = valley
    for n, user in enumerate(content.users):
        assert user.gets_mbit >= user.demand_mbit - 1e-5, user
        assert n in content.stops[user.stop - 1].users
    relayed = [user for user in content.users if user.d2d]
    assert [user.name for user in relayed] == ["Last barn"]
    assert relayed[0].mate == "Valley head"
    assert content.pairs
    assert all(content.users[a].mate == content.users[b].name for a, b in content.pairs)


def test_what_users_receive_on_the_way_counts_and_the_bound_is_told():
    scenario = load_scenario(GALLERY / "valley/scenario.toml")
    planner = dataclasses.replace(scenario.planner, name="time", time_limit_s=1.0)
    plan, content = report_of(dataclasses.replace(scenario, planner=planner))
    assert content.in_flight
    assert plan.holds.in_flight_bit.max() > 1e6
    for user in content.users:
        assert user.gets_mbit >= user.demand_mbit - 1e-5
    assert content.least_s == pytest.approx(plan.trajectory.bound.bound, abs=0.01)
    assert content.least_s <= content.mission_s


def test_one_at_a_time_counts_a_user_its_own_turns_only():
    scenario = make_scenario([[0, 0], [50, 0]], mode="tdma", demand_mbit=20.0)
    _, content = report_of(scenario)
    assert [user.gets_mbit for user in content.users] == pytest.approx([20.0, 20.0], rel=1e-5)


def test_the_profile_goes_from_the_ground_to_the_ground_in_the_missions_time(valley):
    _, content = valley
    times = [time_s for time_s, _ in content.profile]
    assert times == sorted(times)
    assert content.profile[0] == (0.0, 0.0)
    assert content.profile[-1] == (pytest.approx(content.mission_s), 0.0)
    assert max(height for _, height in content.profile) == 100.0


def test_holds_begin_in_order_and_do_not_overlap(valley):
    _, content = valley
    for one, other in zip(content.stops, content.stops[1:], strict=False):
        assert one.arrival_s + one.hold_s < other.arrival_s


def test_the_comparison_has_every_planner_and_marks_this_one(valley):
    _, content = valley
    assert [row.planner for row in content.comparison if row.chosen] == ["tloaik"]
    assert {row.planner for row in content.comparison} >= {"tloaik", "stoaik", "boaik", "sbw"}


def test_a_plan_that_stays_has_no_way_back():
    scenario = make_scenario([[300, 0], [900, 100]], end="stay")
    plan, content = report_of(scenario)
    assert content.back_m == 0.0
    assert content.profile[-1][1] == scenario.vehicle.altitude_m
    rules = AUTOPILOTS[scenario.vehicle.autopilot]
    assert [stop.hold_s for stop in content.stops] == hold_times(
        scenario, plan.trajectory, rules
    ).stored_s.tolist()
