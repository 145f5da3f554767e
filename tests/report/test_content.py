"""A report says what the plan says: the same stops, users, seconds and items as the plan and the wire have them."""

import dataclasses

import numpy as np
import pytest

from mavplan.bounds import Bound
from mavplan.formats import plan as plan_format
from mavplan.geo import LocalPlane
from mavplan.hover import hold_times
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.wire import to_wire
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.report.content import proved, report_content
from mavplan.scenario import load_scenario
from mavplan.stored_plan import parse_plan
from tests.airspace.test_no_fly import box, with_zones
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
    assert f"no plan takes less than {plan.trajectory.bound.bound:,.1f} s" in content.proved


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


def test_what_is_received_on_the_way_counts_and_is_shown_apart():
    scenario = make_scenario([[300, 0], [900, 100], [1500, -200]], demand_mbit=20.0, planner="time")
    plan, content = report_of(scenario)
    assert plan.holds.in_flight_bit is not None
    assert content.in_flight
    for user, passing_bit in zip(content.users, plan.holds.in_flight_bit, strict=True):
        assert user.in_flight_mbit == pytest.approx(passing_bit / 1e6, abs=1e-5)
        assert user.gets_mbit >= user.demand_mbit - 1e-5
    assert any(user.in_flight_mbit > 1.0 for user in content.users)


def test_a_bound_is_told_with_its_gap_or_as_proved():
    assert proved(None) == ""
    assert proved(Bound("path_m", 100.0, 100.0)) == "Proved: no path is shorter."
    assert proved(Bound("tour_m", 200.0, 190.0)) == (
        "Proved: no path with its way home is shorter than 190 m, this one has 200 m (gap 5.0%)."
    )
    assert "no plan takes less than 90.0 s, this one 100.0 s" in proved(Bound("mission_s", 100.0, 90.0))


def test_the_way_home_round_a_zone_is_not_counted_as_the_planners_path():
    scenario = with_zones(make_scenario([[0, 2000]]), box(-300, 500, 200, 900, "lake"))
    plan, content = report_of(scenario)
    assert content.length_m == pytest.approx(plan.trajectory.length_m, abs=0.1)
    assert content.back_m > np.linalg.norm(plan.trajectory.path_m[-1])
    assert [area.label for area in content.areas if not area.inclusion] == ["lake"]
    assert any("lake: a failsafe's return flies straight" in text for text in content.warnings)


def test_zones_keep_the_scenarios_names_behind_a_file_that_has_none():
    plan, _ = report_of(with_zones(make_scenario([[0, 2000]]), box(-300, 500, 200, 900, "lake")))
    read_back = plan_format.loads(plan_format.dumps(plan.built.mission), "x.plan")
    assert [area.name for area in read_back.fence.polygons] == [""]
    content = report_content(read_back, parse_plan(dumps(plan), "x"), "x")
    assert [area.label for area in content.areas] == ["lake"]


def test_vehicles_with_homes_of_their_own_stand_on_one_map(valley):
    plan, _ = valley
    plane = LocalPlane(plan.scenario.home.lat_deg + 0.01, plan.scenario.home.lon_deg)
    stored = parse_plan(dumps(plan), "x")
    own = report_content(plan.built.mission, stored, "x")
    moved = report_content(plan.built.mission, stored, "x", plane=plane)
    assert moved.home_m[1] == pytest.approx(-1111.5, abs=2)
    assert moved.length_m == own.length_m
    assert [user.gets_mbit for user in moved.users] == [user.gets_mbit for user in own.users]
    for one, other in zip(own.stops, moved.stops, strict=True):
        assert (other.x_m, other.y_m - moved.home_m[1]) == pytest.approx((one.x_m, one.y_m), abs=0.5)


def test_the_comparison_has_this_plans_own_figures_first_and_ways_home(valley):
    plan, content = valley
    first = content.comparison[0]
    assert first.chosen
    assert first.length_m == pytest.approx(plan.trajectory.length_m, abs=0.1)
    assert first.joint_index == pytest.approx(plan.joint_index, abs=1e-5)
    assert first.mission_s == content.mission_s
    for row in content.comparison:
        assert row.flown_m > row.length_m
