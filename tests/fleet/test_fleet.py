"""Fleets: users divided, nobody slower than one vehicle, and no two vehicles in one place at one time."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.fleet import divide as fleet_divide
from mavplan.fleet.divide import divide
from mavplan.fleet.make import plan_fleet
from mavplan.fleet.timeline import Timeline, meeting, timeline
from mavplan.geo import LocalPlane, geodesic_distance_m
from mavplan.mission.geofence import Fence, FenceCircle
from mavplan.plan import make_plan
from mavplan.plan_file import document, dumps
from mavplan.planners import PLANNERS
from mavplan.scenario import Scenario, Vehicle, load_scenario
from mavplan.scenario.sections import D2D, FleetVehicle, PlannerOptions
from mavplan.sorties.ways import Ways
from mavplan.stored_plan import parse_plan
from mavplan.workers.crew import lending
from tests.support import HOME, make_scenario, user_fields

GALLERY = Path(__file__).resolve().parents[2] / "missions"
SEPARATION_M = 50.0


def closest_at_one_height_m(plans, vertical_m):
    """The least distance over the ground of any two in the air at the same height, every 0.37 s."""
    plane = LocalPlane(plans[0].scenario.home.lat_deg, plans[0].scenario.home.lon_deg)
    least = np.inf
    for one, other in itertools.combinations(plans, 2):
        lines = [timeline(plan, plane) for plan in (one, other)]
        starts = [plan.part.start_s for plan in (one, other)]
        begin = max(starts)
        end = min(line.time_s[-1] + start for line, start in zip(lines, starts, strict=True))
        moments = np.arange(begin, min(end, begin + 5000), 0.37)
        first, second = (line.at(moments - start) for line, start in zip(lines, starts, strict=True))
        level = np.abs(first[:, 2] - second[:, 2]) < vertical_m - 1e-3
        apart = np.hypot(*(first[:, :2] - second[:, :2]).T)[level]
        least = min(least, apart.min(initial=np.inf))
    return least


def hold_together(fleet, scenario, step_m=0.0):
    assert fleet.longest_s <= fleet.single.forecast.mission_s + 1e-6
    names = [name for plan in fleet.plans for name in plan.scenario.users.names]
    assert sorted(names) == sorted(scenario.users.names)
    for plan in fleet.plans:
        assert plan.trajectory.assignment.served.all()
    for n, mate in enumerate(scenario.users.mate.tolist()):
        if mate >= 0:
            pair = {scenario.users.names[n], scenario.users.names[mate]}
            assert any(pair <= set(plan.scenario.users.names) for plan in fleet.plans)
    vertical_m = min(step_m, 10.0) if step_m else 10.0
    assert closest_at_one_height_m(fleet.plans, vertical_m) >= SEPARATION_M - 0.01


@settings(max_examples=12)
@given(
    user_fields(most=10),
    st.integers(2, 4),
    st.sampled_from([0.0, 8.0, 20.0]),
    st.sampled_from(["rtl", "land"]),
)
def test_no_two_meet_and_none_is_slower_than_one_vehicle(users, count, step_m, end):
    scenario = Scenario(
        home=HOME,
        users=users,
        d2d=D2D(matching="given", link="ideal"),
        vehicle=Vehicle(position_error_m=0.0, end=end),
        planner=PlannerOptions(clusters=3),
    )
    fleet = plan_fleet(scenario, count, separation_m=SEPARATION_M, altitude_step_m=step_m)
    hold_together(fleet, scenario, step_m)


def test_one_vehicle_is_the_ordinary_plan():
    scenario = load_scenario(GALLERY / "valley" / "scenario.toml")
    (plan,) = plan_fleet(scenario, 1).plans
    assert dumps(plan) == dumps(make_plan(scenario))


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("planner", PLANNERS)
def test_every_planners_fleet_is_done_sooner_and_its_plans_can_be_read(planner, autopilot):
    scenario = load_scenario(GALLERY / "valley" / "scenario.toml")
    scenario = dataclasses.replace(
        scenario,
        vehicle=dataclasses.replace(scenario.vehicle, autopilot=autopilot),
        planner=dataclasses.replace(scenario.planner, name=planner, time_limit_s=1.0),
    )
    fleet = plan_fleet(scenario, 2)
    hold_together(fleet, scenario)
    assert len(fleet.plans) == 2
    assert fleet.longest_s < 0.8 * fleet.single.forecast.mission_s
    for number, plan in enumerate(fleet.plans, start=1):
        assert document(plan)["part"]["number"] == number
        assert parse_plan(dumps(plan), "x").scenario.users.names == plan.scenario.users.names


def test_a_fleet_leads_round_no_fly_zones():
    scenario = load_scenario(GALLERY / "valley" / "scenario.toml")
    lat_e7, lon_e7 = round((scenario.home.lat_deg + 0.006) * 1e7), round(scenario.home.lon_deg * 1e7)
    zone = FenceCircle(False, lat_e7, lon_e7, 150.0, "mast")
    scenario = dataclasses.replace(scenario, no_fly=Fence((), (zone,)))
    fleet = plan_fleet(scenario, 3, altitude_step_m=12.0)
    hold_together(fleet, scenario, 12.0)


def test_vehicles_with_homes_of_their_own_start_there():
    scenario = make_scenario([(-2000, 0), (-2200, 300), (2000, 0), (2300, -200)], clusters=4)
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    lat_deg, lon_deg = plane.to_lat_lon_deg(scenario.users.xy_m)
    homes = plane.to_lat_lon_deg([(2100.0, 0.0), (-2100.0, 0.0)])
    vehicles = tuple(
        FleetVehicle(lat, lon, 600.0, name, system)
        for lat, lon, name, system in zip(
            *(part.tolist() for part in homes), ("east", "west"), (7, 8), strict=True
        )
    )
    users = dataclasses.replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg)
    scenario = dataclasses.replace(scenario, users=users, vehicles=vehicles)
    fleet = plan_fleet(scenario, 2)
    hold_together(fleet, scenario)
    assert [(plan.part.name, plan.part.system) for plan in fleet.plans] == [("east", 7), ("west", 8)]
    assert [set(plan.scenario.users.names) for plan in fleet.plans] == [{"u2", "u3"}, {"u0", "u1"}]
    for plan, at in zip(fleet.plans, vehicles, strict=True):
        home = plan.built.mission.home
        away = geodesic_distance_m(home.lat_e7 / 1e7, home.lon_e7 / 1e7, at.lat_deg, at.lon_deg)
        assert float(away) < 0.02
        # Nobody crosses to the other side.
        assert plan.trajectory.length_m < 1000
    with pytest.raises(InputError) as raised:
        plan_fleet(scenario, 3)
    assert [problem.code for problem in raised.value.problems] == ["too-few-vehicles"]


@settings(max_examples=10)
@given(
    st.lists(
        st.tuples(st.integers(-2000, 2000), st.integers(-2000, 2000)), min_size=1, max_size=5, unique=True
    )
)
def test_the_division_is_near_the_best_of_all(stops_m):
    stops_m = np.array(stops_m, dtype=float)
    ways, count = Ways(make_scenario(stops_m), stops_m), len(stops_m)
    holds_s = [10.0 * (n + 1) for n in range(count)]

    def shortest(stops):
        orders = itertools.permutations(stops) if stops else ()
        return min((ways.flight(list(o), [holds_s[i] for i in o]).seconds for o in orders), default=0.0)

    best = min(
        max(shortest([i for i in range(count) if crew[i] == v]) for v in (0, 1))
        for crew in itertools.product((0, 1), repeat=count)
    )
    parts = divide([ways, ways], holds_s, [list(range(count))])
    assert sorted(itertools.chain(*parts)) == list(range(count))
    found = max(ways.flight(part, [holds_s[i] for i in part]).seconds for part in parts if part)
    assert best - 1e-6 <= found <= 1.25 * best


@given(
    st.lists(st.tuples(*[st.integers(-100, 100)] * 3), min_size=2, max_size=5),
    st.lists(st.tuples(*[st.integers(-100, 100)] * 3), min_size=2, max_size=5),
    st.integers(0, 30),
)
def test_a_meeting_is_found_where_fine_samples_show_one(one, other, start_s):
    lines = [Timeline(np.arange(len(c)) * 10.0, np.array(c, dtype=float)) for c in (one, other)]
    found = meeting(*lines, 0.0, float(start_s), separation_m=20.0, vertical_m=10.0)
    end = min(lines[0].time_s[-1], lines[1].time_s[-1] + start_s)
    moments = np.arange(start_s, end, 0.05)
    between = lines[0].at(moments) - lines[1].at(moments - start_s)
    close = (np.hypot(between[:, 0], between[:, 1]) < 20.0) & (np.abs(between[:, 2]) < 10.0 - 1e-3)
    if close.any():
        assert found is not None
        assert found.second <= moments[close.argmax()] + 1e-6
    if found is not None:
        at = np.array([found.second])
        there = lines[0].at(at) - lines[1].at(at - start_s)
        assert np.hypot(there[0, 0], there[0, 1]) <= 20.0 + 1e-6
        assert abs(there[0, 2]) <= 10.0


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_long_order_is_cut_nearly_as_evenly_as_the_dynamic_programme_does(count, monkeypatch):
    rng = np.random.default_rng(count)
    places_m = rng.uniform(-3000, 3000, (40, 2))
    ways = Ways(make_scenario(places_m), places_m)
    holds_s = rng.uniform(0, 60, 40).tolist()
    order = np.argsort(places_m[:, 0]).tolist()

    def longest_s(pieces):
        return max(ways.flight(piece, [holds_s[stop] for stop in piece]).seconds for piece in pieces if piece)

    best = fleet_divide._pieces(ways, holds_s, order, count)
    monkeypatch.setattr(fleet_divide, "MOST_CUT", 10)
    found = fleet_divide._pieces(ways, holds_s, order, count)
    assert [stop for piece in found for stop in piece] == order
    assert len(found) == count
    assert longest_s(best) - 1e-6 <= longest_s(found) <= 1.1 * longest_s(best)


def test_vehicles_planned_by_two_processes_have_the_same_plans():
    scenario = make_scenario(
        np.random.default_rng(1).uniform(-2000, 2000, (12, 2)), planner="length", end="rtl"
    )
    here = plan_fleet(scenario, 2)
    with lending(2):
        there = plan_fleet(scenario, 2)
    assert len(here.plans) == 2
    for one, other in zip(here.plans, there.plans, strict=True):
        assert one.scenario.users.names == other.scenario.users.names
        np.testing.assert_array_equal(one.trajectory.path_m, other.trajectory.path_m)
        assert one.trajectory.bound.bound == other.trajectory.bound.bound
        assert document(one) == document(other)
