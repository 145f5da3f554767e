"""Pinned stops: in every planner's plan, at their places, in their order, and everybody is still served."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.fleet.make import plan_fleet
from mavplan.geo import LocalPlane
from mavplan.mission.geofence import Fence, FenceCircle
from mavplan.plan import make_plan, plan_along
from mavplan.plan_file import document, dumps
from mavplan.planners import PLANNERS, plan_trajectory
from mavplan.planners.ordering import path_length_m
from mavplan.planners.pinned import pins_of
from mavplan.planners.pinned_order import Ranks, inserted, is_kept, nearest_first, shortened
from mavplan.planners.trajectory import assign
from mavplan.proof.pinned import pinned_faults
from mavplan.radio import planning_channel
from mavplan.scenario import PinnedStop
from mavplan.scenario.sections import FleetVehicle
from mavplan.sorties.make import plan_sorties
from mavplan.stored_plan import parse_plan
from tests.support import HOME, make_scenario
from tests.terrain.hills import ridge

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)


def pin(x_m, y_m, name, **more):
    lat_deg, lon_deg = PLANE.to_lat_lon_deg(np.array([[x_m, y_m]]))
    return PinnedStop(float(lat_deg[0]), float(lon_deg[0]), name=name, **more)


def above(scenario, number, **more):
    """A stop above a user; the users of the tests have their places in metres alone."""
    return dataclasses.replace(
        pin(*scenario.users.xy_m[number], "", **more), user=f"u{number}", name=f"u{number}"
    )


def with_stops(scenario, *stops):
    return dataclasses.replace(scenario, stops=stops)


def limited(scenario, seconds=0.3):
    return dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, time_limit_s=seconds))


METRES = st.integers(-2500, 2500)
PLACES = st.lists(st.tuples(METRES, METRES), min_size=1, max_size=6, unique=True)
RANKS = st.lists(st.sampled_from([None, 1, 2, 3, "first", "last"]), min_size=1, max_size=4)


@settings(max_examples=6, deadline=None)
@pytest.mark.parametrize("planner", [name for name in PLANNERS if name != "time"])
@given(PLACES, st.lists(st.tuples(METRES, METRES), min_size=4, max_size=4, unique=True), RANKS, st.booleans())
def test_every_planner_stops_at_every_pinned_place_in_order(planner, xy_m, places, orders, returns):
    orders = [order for at, order in enumerate(orders) if order is None or order not in orders[:at]]
    scenario = make_scenario(xy_m, planner=planner, clusters=2, end="rtl" if returns else "stay")
    stops = [
        pin(*place, f"p{n}", order=order)
        for n, (place, order) in enumerate(zip(places, orders, strict=False))
    ]
    scenario = limited(with_stops(scenario, *stops))
    found = plan_trajectory(scenario)
    pins = pins_of(scenario)
    rows = pins.at(found.stops_m)
    assert sorted(rows[rows >= 0].tolist()) == list(range(len(stops)))
    assert is_kept(np.where(rows >= 0, pins.rank[rows], np.nan))
    assert found.assignment.served.all()


def test_time_stops_at_pinned_places_and_its_bound_stays_below():
    scenario = make_scenario([(900, 0), (1500, 600), (-800, 400)], planner="time", demand_mbit=20.0)
    free = make_plan(limited(scenario))
    pinned = make_plan(
        limited(with_stops(scenario, pin(0, -900, "p", order="last", hold_s=40), above(scenario, 2, order=1)))
    )
    assert pinned.pinned_names[-1] == "p"
    assert "u2" in pinned.pinned_names
    assert pinned.holds.stored_s[-1] >= 40
    assert pinned.trajectory.bound.plan >= free.trajectory.bound.bound - 1e-6
    assert pinned.trajectory.bound.bound <= pinned.trajectory.bound.plan
    assert pinned.trajectory.assignment.served.all()


def test_the_proof_of_length_holds_with_pinned_stops():
    scenario = make_scenario([(900, 0), (1500, 600), (-800, 400)], planner="length")
    free = plan_trajectory(limited(scenario))
    found = plan_trajectory(limited(with_stops(scenario, pin(0, -900, "p"))))
    assert found.bound.bound == pytest.approx(free.bound.bound, rel=1e-6)
    assert found.bound.plan >= free.bound.plan - 1e-6
    assert found.bound.plan == pytest.approx(path_length_m(np.vstack([found.path_m, np.zeros(2)])))


@given(st.lists(st.tuples(METRES, METRES), min_size=2, max_size=6, unique=True), st.data(), st.booleans())
@settings(max_examples=40, deadline=None)
def test_orders_keep_the_ranks_and_moves_never_make_the_path_longer(places, data, returns):
    rank = np.full(len(places), np.nan)
    for number, value in enumerate(
        data.draw(st.permutations([-np.inf, 1.0, 2.0, np.inf]))[: len(places) - 1]
    ):
        rank[number] = value if data.draw(st.booleans()) else np.nan
    places, ranks = np.array(places, dtype=float), Ranks(~np.isnan(rank), rank)

    def length(order):
        ends = [np.zeros(2), *places[order], *([np.zeros(2)] if returns else [])]
        return path_length_m(np.array(ends))

    for order in (nearest_first(places, ranks), inserted(places, ranks, returns=returns)):
        assert sorted(order.tolist()) == list(range(len(places)))
        assert is_kept(rank[order])
    order = inserted(places, ranks, returns=returns)
    shorter = order[shortened(places[order], ranks.taken(order), returns=returns)]
    assert is_kept(rank[shorter])
    assert length(shorter) <= length(order) + 1e-6
    if len(places) <= 5:
        kept = [p for p in map(list, itertools.permutations(range(len(places)))) if is_kept(rank[p])]
        assert min(map(length, kept)) <= length(shorter) + 1e-6 <= 1.35 * min(map(length, kept)) + 1e-5


def test_a_planned_stop_that_a_pinned_one_makes_superfluous_is_left_out():
    scenario = make_scenario([(1000, 0), (1000, 200)], planner="tloaik", clusters=1)
    assert len(plan_trajectory(with_stops(scenario, pin(1000, 90, "near"))).stops_m) == 1


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
def test_the_least_hold_is_kept_and_a_named_user_gets_all_it_needs_at_its_stop(mode):
    scenario = make_scenario(
        [(1000, 0), (1100, 0), (0, 900)], demand_mbit=[50, 300, 5], mode=mode, clusters=2
    )
    plan = make_plan(
        with_stops(scenario, above(scenario, 1, order="last"), pin(-500, 0, "marker", hold_s=77.5))
    )
    holds = dict(zip(plan.pinned_names, plan.holds.stored_s.tolist(), strict=True))
    assert holds["marker"] == 78.0
    best_bit_s = plan.trajectory.assignment.rate_bit_s_hz[1] * scenario.radio.bandwidth_hz
    assert holds["u1"] >= 300e6 / best_bit_s - 1e-6
    assert plan.pinned_names[-1] == "u1"


def test_a_pinned_hold_serves_who_is_in_reach_and_is_not_held_twice():
    scenario = make_scenario([(1000, 0)], demand_mbit=20.0)
    free = make_plan(scenario)
    plan = make_plan(with_stops(scenario, pin(1000, 10, "p", hold_s=500)))
    assert plan.holds.hover_s == 500
    assert free.holds.hover_s < 100


def test_a_pinned_stop_in_a_zone_is_an_error_and_others_are_left_where_they_are():
    scenario = make_scenario([(1000, 0), (-700, 0)], clusters=2)
    lat, lon = PLANE.to_e7(np.array([[500.0, 500.0]]))
    zone = Fence((), (FenceCircle(False, int(lat[0]), int(lon[0]), 100.0, "field"),))
    scenario = dataclasses.replace(scenario, no_fly=zone)
    with pytest.raises(InputError) as raised:
        make_plan(with_stops(scenario, pin(500, 560, "marker")))
    assert [problem.code for problem in raised.value.problems] == ["stop-in-zone"]
    plan = make_plan(with_stops(scenario, pin(800, 800, "beyond", order="first")))
    assert plan.pinned_names[0] == "beyond"


def test_over_terrain_pinned_stops_stay_and_the_last_stays_the_last():
    scenario = make_scenario([(1200, 0), (-900, 0), (800, 300)], clusters=1, altitude_m=60.0)
    scenario = dataclasses.replace(
        scenario,
        terrain=ridge(top_m=760.0),
        stops=(pin(0, 300, "end", order="last"), pin(0, -300, "begin", order="first")),
    )
    plan = make_plan(scenario)
    assert plan.pinned_names[0] == "begin"
    assert plan.pinned_names[-1] == "end"
    assert plan.trajectory.assignment.served.all()


def sorties_scenario(**vehicle):
    scenario = make_scenario(
        [(1500, 0), (0, 1500), (-1500, 0), (0, -1500)], demand_mbit=100.0, clusters=4, **vehicle
    )
    stops = (
        pin(-1400, 100, "p2", order=2, hold_s=60),
        above(scenario, 3, order=1),
        pin(1200, 0, "end", order="last"),
    )
    return with_stops(scenario, *stops)


def test_sorties_keep_the_order_and_every_part_is_checked_by_itself():
    made = plan_sorties(sorties_scenario(endurance_s=900.0))
    assert len(made.plans) > 1
    names = [name for plan in made.plans for name in plan.pinned_names if name]
    assert list(dict.fromkeys(names)) == ["u3", "p2", "end"]
    held = sum(
        hold_s
        for plan in made.plans
        for name, hold_s in zip(plan.pinned_names, plan.holds.stored_s.tolist(), strict=True)
        if name == "p2"
    )
    assert held >= 60
    for plan in made.plans:
        stored = parse_plan(dumps(plan), "part")
        assert list(pinned_faults(stored, plan.built.mission)) == []


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("usable_s", [500.0, 560.0, 640.0])
def test_one_sortie_flies_every_pinned_stop_and_serves_the_most_that_fits_beside_them(mode, usable_s):
    xy_m = [(900, 0), (0, 1000), (-900, 300), (700, 700)]
    scenario = make_scenario(xy_m, demand_mbit=[60, 30, 90, 20], clusters=4, mode=mode)
    scenario = with_stops(
        scenario, pin(400, -300, "marker", hold_s=20, order="first"), above(scenario, 3, order="last")
    )
    vehicle = dataclasses.replace(scenario.vehicle, endurance_s=usable_s / 0.8)
    scenario = dataclasses.replace(scenario, vehicle=vehicle)
    made = plan_sorties(scenario, most=1)
    (plan,) = made.plans
    assert made.not_served
    assert made.rest.stops == ()
    assert plan.forecast.mission_s <= usable_s
    assert (plan.pinned_names[0], plan.pinned_names[-1]) == ("marker", "u3")
    assert plan.holds.stored_s[0] >= 20
    assert list(pinned_faults(parse_plan(dumps(plan), "part"), plan.built.mission)) == []
    # Against every choice of users over the same stops, those that are pinned always among them.
    whole, best = made.whole, 0.0
    pinned = [stop for stop, name in enumerate(whole.pinned_names) if name]
    for size in range(1, 5):
        for some in itertools.combinations(range(4), size):
            part = dataclasses.replace(
                scenario, users=scenario.users.some(np.array(some), scenario.users.demand_bit)
            )
            stops = sorted({*(int(whole.trajectory.assignment.stop[n]) for n in some), *pinned})
            path = np.vstack([np.zeros(2), whole.trajectory.stops_m[stops]])
            flown = dataclasses.replace(
                whole.trajectory,
                path_m=path,
                stop_at=np.arange(1, len(path)),
                assignment=assign(part.users, path[1:], planning_channel(part), d2d=True),
            )
            if plan_along(part, flown).forecast.mission_s <= usable_s:
                best = max(best, float(part.users.demand_bit.sum()))
    assert float(plan.scenario.users.demand_bit.sum()) >= best * (1 - 1e-9)


def test_pinned_stops_beyond_one_sortie_are_an_error_that_names_the_battery():
    scenario = make_scenario([(300, 0)], demand_mbit=20.0, endurance_s=550.0)
    with pytest.raises(InputError) as raised:
        plan_sorties(with_stops(scenario, pin(1400, 0, "p", hold_s=5), pin(-1400, 0, "q")), most=1)
    assert [problem.code for problem in raised.value.problems] == ["beyond-battery"]
    with pytest.raises(InputError) as raised:
        plan_sorties(with_stops(scenario, pin(5000, 0, "far")), most=1)
    assert ["(far)" in problem.where for problem in raised.value.problems] == [True]


def test_a_sortie_to_a_pinned_stop_alone_is_an_error_that_names_it():
    scenario = make_scenario([(600, 0)], demand_mbit=20.0, endurance_s=600.0)
    with pytest.raises(InputError) as raised:
        plan_sorties(with_stops(scenario, pin(-1500, 0, "far", hold_s=5)))
    assert [(problem.where, problem.code) for problem in raised.value.problems] == [("far", "stop-alone")]


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.tuples(METRES, METRES), min_size=2, max_size=7, unique=True),
    st.lists(st.tuples(METRES, METRES), min_size=1, max_size=3, unique=True),
    st.sampled_from([0.0, 15.0]),
)
def test_a_fleet_flies_to_every_pinned_stop_once_and_a_named_user_is_served_at_its_own(xy_m, places, step_m):
    scenario = make_scenario(xy_m, demand_mbit=60.0, clusters=3)
    stops = [pin(*place, f"p{n}", hold_s=11.0) for n, place in enumerate(places)]
    made = plan_fleet(with_stops(scenario, *stops, above(scenario, 1)), 2, altitude_step_m=step_m)
    named = [(name, plan) for plan in made.plans for name in plan.pinned_names if name]
    assert sorted(name for name, _ in named) == sorted(["u1", *(stop.name for stop in stops)])
    assert all("u1" in plan.scenario.users.names for name, plan in named if name == "u1")
    for plan in made.plans:
        assert plan.trajectory.assignment.served.all()
        assert list(pinned_faults(parse_plan(dumps(plan), "part"), plan.built.mission)) == []


def test_a_fleet_refuses_what_is_kept_within_one_flight():
    scenario = make_scenario([(600, 0), (700, 0), (0, 800)], pairs=[(0, 1)])
    for stops, count in (
        ([pin(0, 500, "p", order=1), pin(0, -500, "q", order="last")], 2),
        ([above(scenario, 0), above(scenario, 1)], 2),
    ):
        with pytest.raises(InputError) as raised:
            plan_fleet(with_stops(scenario, *stops), 2)
        assert [problem.code for problem in raised.value.problems] == ["fleet-stops"] * count


def test_vehicles_from_homes_of_their_own_find_pinned_stops_in_their_planes():
    lat_deg, lon_deg = (part.tolist() for part in PLANE.to_lat_lon_deg([(2000.0, 0.0), (-2000.0, 500.0)]))
    scenario = make_scenario([(1500, 0), (1700, 300), (-1500, 0), (-1800, 200)], demand_mbit=60.0, clusters=4)
    user_lat, user_lon = PLANE.to_lat_lon_deg(scenario.users.xy_m)
    users = dataclasses.replace(scenario.users, lat_deg=user_lat, lon_deg=user_lon)
    vehicles = tuple(FleetVehicle(lat_deg[n], lon_deg[n], 600.0, name) for n, name in enumerate("ab"))
    scenario = dataclasses.replace(scenario, users=users, vehicles=vehicles)
    made = plan_fleet(with_stops(scenario, pin(1600, 500, "east"), pin(-1600, -300, "west")), 2)
    assert [[name for name in plan.pinned_names if name] for plan in made.plans] == [["east"], ["west"]]
    for plan in made.plans:
        assert list(pinned_faults(parse_plan(dumps(plan), "part"), plan.built.mission)) == []


@pytest.fixture(scope="module")
def pinned_plan():
    scenario = make_scenario([(1000, 0), (0, 900)], demand_mbit=50.0, clusters=2)
    stops = (
        pin(500, 500, "a", order=1, hold_s=20),
        above(scenario, 1, order=2),
        pin(0, -300, "z", order="last"),
    )
    return make_plan(with_stops(scenario, *stops))


def test_the_plans_file_names_its_pinned_stops_and_reads_back(pinned_plan):
    data = document(pinned_plan)
    assert [stop.get("name", "") for stop in data["stops"]] == list(pinned_plan.pinned_names)
    stored = parse_plan(dumps(pinned_plan), "plan")
    assert stored.scenario.stops == pinned_plan.scenario.stops
    assert [stop.name for stop in stored.stops] == list(pinned_plan.pinned_names)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda data: data["scenario"]["stops"]["pinned"][0].update(lat_deg=46.6), "pinned-place"),
        (lambda data: data["scenario"]["stops"]["pinned"][0].update(hold_s=500.0), "pinned-hold"),
        (lambda data: data["scenario"]["stops"]["pinned"][0].update(order=3), "pinned-order"),
        (lambda data: data["scenario"]["stops"]["pinned"][0].update(order="last"), "pinned-order"),
        (lambda data: data["scenario"]["stops"]["pinned"][2].update(order="first"), "pinned-order"),
        (lambda data: data["users"][1].update(demand_mbit=5000.0), "pinned-hold"),
    ],
)
def test_what_a_mission_does_not_keep_is_found(pinned_plan, change, code):
    data = json.loads(dumps(pinned_plan))
    change(data)
    stored = parse_plan(json.dumps(data), "plan")
    assert code in [problem.code for problem in pinned_faults(stored, pinned_plan.built.mission)]
    clean = parse_plan(dumps(pinned_plan), "plan")
    assert list(pinned_faults(clean, pinned_plan.built.mission)) == []
