"""Fleets whose batteries do not last, in rounds of sorties; and fleets over real ground."""

import dataclasses
import itertools

import numpy as np
import pytest

from mavplan.errors import InputError, Problem
from mavplan.fleet import rounds
from mavplan.fleet.make import longest_s, plan_fleet
from mavplan.fleet.timeline import Timeline, meeting, timeline
from mavplan.geo import LocalPlane
from mavplan.hover import DEMAND_TOLERANCE_BIT, broadcast_rates
from mavplan.mission.model import Command
from mavplan.plan import make_plan
from mavplan.plan_file import document, dumps
from mavplan.planners import PLANNERS
from mavplan.radio import planning_channel
from mavplan.scenario.sections import FleetVehicle
from mavplan.sorties.make import plan_sorties
from mavplan.stored_plan import parse_plan
from tests.fleet.test_fleet import SEPARATION_M, closest_at_one_height_m
from tests.support import HOME, make_scenario
from tests.terrain.hills import ridge

XY_M = [(1500, 300), (1400, -500), (-1500, 200), (-1300, -600), (200, 1600), (-300, -1500)]


def tired(planner="tloaik", endurance_s=700.0, **more):
    scenario = make_scenario(
        XY_M, demand_mbit=120.0, clusters=6, planner=planner, endurance_s=endurance_s, mass_kg=2.0, **more
    )
    return dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, time_limit_s=0.5))


def rounds_of(plans):
    ordered = sorted(plans, key=lambda plan: plan.part.round)
    return [list(found) for _, found in itertools.groupby(ordered, key=lambda plan: plan.part.round)]


@pytest.mark.parametrize("step_m", [0.0, 15.0])
@pytest.mark.parametrize("planner", PLANNERS)
def test_every_sortie_is_home_with_its_reserve_and_no_two_of_a_round_meet(planner, step_m):
    scenario = tired(planner)
    fleet = plan_fleet(scenario, 2, separation_m=SEPARATION_M, altitude_step_m=step_m, sorties=True)
    usable_s = 700.0 * (1 - scenario.vehicle.reserve_fraction)
    assert max(plan.part.rounds for plan in fleet.plans) > 1
    assert fleet.longest_s <= fleet.single_s + 1e-6
    for plan in fleet.plans:
        assert plan.forecast.mission_s <= usable_s
        assert plan.scenario.vehicle.end == "rtl"
    for found in rounds_of(fleet.plans):
        assert min(plan.part.start_s for plan in found) == 0.0
        assert closest_at_one_height_m(found, min(step_m, 10.0) if step_m else 10.0) >= SEPARATION_M - 0.01
    # All demands are met, each part at its own stops.
    received = dict.fromkeys(scenario.users.names, 0.0)
    for plan in fleet.plans:
        for name, bits in zip(
            plan.scenario.users.names, plan.scenario.users.demand_bit.tolist(), strict=True
        ):
            received[name] += bits
        if plan.holds.in_flight_bit is None:
            rates = broadcast_rates(
                plan.scenario.users, plan.trajectory.stops_m, planning_channel(plan.scenario)
            )
            got_bit = rates @ plan.holds.stored_s.astype(np.float32)
            assert (got_bit >= plan.scenario.users.demand_bit - 2 * DEMAND_TOLERANCE_BIT).all()
    for name, bits in zip(scenario.users.names, scenario.users.demand_bit.tolist(), strict=True):
        assert received[name] == pytest.approx(bits, abs=10.0)


def test_rounds_are_counted_one_after_the_other_and_parts_say_which_they_are():
    fleet = plan_fleet(tired(), 2, sorties=True)
    parts = [plan.part for plan in fleet.plans]
    assert sorted({part.round for part in parts}) == list(range(1, parts[0].rounds + 1))
    assert len({(part.number, part.round) for part in parts}) == len(parts)
    assert {part.rounds for part in parts} == {max(part.round for part in parts)}
    ends = [
        max(plan.part.start_s + plan.forecast.mission_s for plan in found) for found in rounds_of(fleet.plans)
    ]
    assert longest_s(fleet.plans) == pytest.approx(sum(ends))
    for plan in fleet.plans:
        assert document(plan)["part"]["round"] == plan.part.round
        assert parse_plan(dumps(plan), "x").part == plan.part


def test_where_one_battery_does_it_a_fleet_with_sorties_is_a_fleet():
    scenario = tired(endurance_s=5000.0)
    with_sorties, without = (plan_fleet(scenario, 2, sorties=sorties) for sorties in (True, False))
    assert [dumps(plan) for plan in with_sorties.plans] == [dumps(plan) for plan in without.plans]


def test_one_vehicle_with_sorties_flies_those_of_the_plan_alone():
    scenario = tired()
    fleet = plan_fleet(scenario, 1, sorties=True)
    alone = plan_sorties(scenario)
    assert [plan.forecast.mission_s for plan in fleet.plans] == [p.forecast.mission_s for p in alone.plans]
    assert fleet.single_s == alone.total_s


def with_homes_on_the_plane(scenario, homes_m):
    """Vehicles a, b … that start at places (east, north) of home."""
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    lat_deg, lon_deg = plane.to_lat_lon_deg(scenario.users.xy_m)
    users = dataclasses.replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg)
    homes = zip(*(part.tolist() for part in plane.to_lat_lon_deg(homes_m)), strict=True)
    vehicles = tuple(
        FleetVehicle(lat, lon, 600.0, name) for (lat, lon), name in zip(homes, "ab", strict=True)
    )
    return dataclasses.replace(scenario, users=users, vehicles=vehicles)


def test_a_fleet_flies_where_one_vehicle_reaches_nobody_with_its_battery():
    scenario = make_scenario(
        [(-1900, 0), (-1800, 300), (5200, 0), (5100, -200)], demand_mbit=60.0, clusters=4, endurance_s=700.0
    )
    scenario = with_homes_on_the_plane(scenario, [(0.0, 0.0), (5000.0, 0.0)])
    fleet = plan_fleet(scenario, 2, sorties=True)
    assert fleet.single_s == float("inf")
    assert {plan.part.name for plan in fleet.plans} == {"a", "b"}
    with pytest.raises(InputError) as raised:
        plan_fleet(dataclasses.replace(scenario, vehicles=scenario.vehicles[:1]), 1, sorties=True)
    assert {problem.code for problem in raised.value.problems} == {"beyond-battery"}


def lost_bit(scenario, not_served):
    users = scenario.users
    return sum(users.weighted_bit[users.names.index(name)] for name in not_served)


@pytest.mark.parametrize("step_m", [0.0, 15.0])
@pytest.mark.parametrize("most", [1, 2])
def test_with_few_sorties_each_the_fleet_serves_the_most_it_can(most, step_m):
    scenario = tired()
    weights = np.array([1.0, 1.0, 5.0, 1.0, 1.0, 3.0])
    scenario = dataclasses.replace(scenario, users=dataclasses.replace(scenario.users, priority=weights))
    fleet = plan_fleet(scenario, 2, altitude_step_m=step_m, sorties=True, most=most)
    usable_s = 700.0 * (1 - scenario.vehicle.reserve_fraction)
    flown = [(plan.part.number, plan.part.round) for plan in fleet.plans]
    assert len(set(flown)) == len(flown) <= 2 * most
    assert max(round_ for _, round_ in flown) <= most
    assert all(plan.forecast.mission_s <= usable_s for plan in fleet.plans)
    served = [name for plan in fleet.plans for name in plan.scenario.users.names]
    assert set(served) | set(fleet.not_served) == set(scenario.users.names)
    assert not set(served) & set(fleet.not_served)
    assert {plan.part.not_served for plan in fleet.plans} == {fleet.not_served}
    # As much as one vehicle with as many batteries, and more than with its own.
    alone = [lost_bit(scenario, plan_sorties(scenario, most=n).not_served) for n in (most, 2 * most)]
    lost = lost_bit(scenario, fleet.not_served)
    assert lost <= (alone[1] if step_m == 0 else alone[0])
    assert lost < alone[0]
    if fleet.not_served:
        assert fleet.rest.users.names == fleet.not_served
        assert fleet.single_s == np.inf
    else:
        assert fleet.rest is None


def test_a_vehicle_whose_sortie_serves_nobody_stays_on_the_ground():
    scenario = with_homes_on_the_plane(
        make_scenario(
            [(-600, 0), (-500, 300), (5200, 0)],
            demand_mbit=[60.0, 60.0, 9000.0],
            clusters=3,
            endurance_s=700.0,
        ),
        [(0.0, 0.0), (5000.0, 0.0)],
    )
    known = Problem("scenario.toml", "key not used", "unused", "warning")
    scenario = dataclasses.replace(
        scenario, vehicle=dataclasses.replace(scenario.vehicle, end="land"), warnings=(known,)
    )
    fleet = plan_fleet(scenario, 2, sorties=True, most=1)
    assert [plan.part.name for plan in fleet.plans] == ["a"]
    assert fleet.plans[0].scenario.warnings[0] == known
    assert fleet.rest.vehicle.end == "land"
    assert fleet.not_served == fleet.rest.users.names == ("u2",)
    assert [(problem.where, problem.code) for problem in fleet.said] == [("vehicle b", "idle-vehicle")]
    assert "it would serve nobody" in fleet.said[0].message
    users = dataclasses.replace(scenario.users, demand_bit=np.full(3, 9e9))
    with pytest.raises(InputError) as raised:
        plan_fleet(dataclasses.replace(scenario, users=users), 2, sorties=True, most=1)
    assert {problem.code for problem in raised.value.problems} == {"beyond-battery"}


def test_who_counts_for_nothing_is_served_where_there_is_a_vehicle_for_it():
    scenario = make_scenario([(-1500, 0), (1600, 0)], demand_mbit=60.0, clusters=2, endurance_s=640.0)
    users = dataclasses.replace(scenario.users, priority=np.array([1.0, 0.0]))
    scenario = dataclasses.replace(scenario, users=users)
    assert plan_sorties(scenario, most=1).not_served == ("u1",)
    fleet = plan_fleet(scenario, 2, sorties=True, most=1)
    assert not fleet.not_served
    assert len(fleet.plans) == 2


@pytest.mark.parametrize("first_flies", [True, False])
def test_what_is_told_of_the_scenario_is_told_by_the_first_flight_whoever_flies_it(first_flies):
    xy_m = [(-600, 0), (-500, 300), (5200, 0)] if first_flies else [(5200, 0), (5100, 200)]
    scenario = with_homes_on_the_plane(make_scenario(xy_m, clusters=2), [(0.0, 0.0), (5000.0, 0.0)])
    known = Problem("scenario.toml", "key not used", "unused", "warning")
    fleet = plan_fleet(dataclasses.replace(scenario, warnings=(known,)), 2)
    assert [plan.part.name for plan in fleet.plans] == (["a", "b"] if first_flies else ["b"])
    assert [problem for plan in fleet.plans for problem in plan.scenario.warnings] == [known]


def test_what_is_wrong_beside_the_battery_is_an_error_of_the_fleet_too(monkeypatch):
    outside = Problem("stop 1", "lies outside the fence", "fence-breach")

    def cut_or_refused(plan, _hover, most):
        if plan.scenario.users.names == ("u2",):
            raise InputError([outside])
        return plan_sorties(plan.scenario, most=most)

    scenario = make_scenario([(-600, 0), (-500, 300), (900, 0)], clusters=2, endurance_s=700.0)
    parts = [
        dataclasses.replace(scenario, users=scenario.users.some(np.array(which), scenario.users.demand_bit))
        for which in ([0, 1], [2])
    ]
    monkeypatch.setattr(rounds, "sorties_of", cut_or_refused)
    with pytest.raises(InputError) as raised:
        rounds.cut_each([make_plan(part) for part in parts], "hold", 1)
    assert [problem.code for problem in raised.value.problems] == ["fence-breach"]


def test_rounds_need_a_battery():
    tireless = dataclasses.replace(tired(), vehicle=dataclasses.replace(tired().vehicle, endurance_s=None))
    with pytest.raises(InputError) as raised:
        plan_fleet(tireless, 2, sorties=True)
    assert [problem.code for problem in raised.value.problems] == ["no-battery"]


def over(terrain, xy_m=XY_M, **more):
    scenario = make_scenario(xy_m, demand_mbit=60.0, clusters=5, altitude_m=60.0, **more)
    return dataclasses.replace(scenario, terrain=terrain)


def with_homes(scenario, terrain, homes_m):
    """Vehicles that start at places (east, north) of home, on the ground there."""
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    lat_deg, lon_deg = plane.to_lat_lon_deg(scenario.users.xy_m)
    users = dataclasses.replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg)
    places = zip(*(part.tolist() for part in plane.to_lat_lon_deg(homes_m)), strict=True)
    heights_m = terrain.height_m(np.array(homes_m)).tolist()
    vehicles = tuple(
        FleetVehicle(lat, lon, height_m, name)
        for (lat, lon), height_m, name in zip(places, heights_m, "abc", strict=True)
    )
    return dataclasses.replace(scenario, users=users, vehicles=vehicles)


def least_above_ground_m(plan, terrain):
    """The least height of a mission's legs above the ground, sampled every few metres from its items alone."""
    plane, home = LocalPlane(HOME.lat_deg, HOME.lon_deg), plan.built.mission.home
    (home_m,) = plane.to_xy_m([home.lat_e7 / 1e7], [home.lon_e7 / 1e7])
    ground_m = float(terrain.height_m(home_m[None])[0])
    points = []
    for item in plan.built.mission.items:
        if item.command == Command.NAV_TAKEOFF:
            points.append([*home_m, ground_m + item.alt_m])
        elif item.command in (Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME):
            (place_m,) = plane.to_xy_m([item.lat_deg], [item.lon_deg])
            points.append([*place_m, ground_m + item.alt_m])
    line = np.vstack([np.linspace(one, other, 200) for one, other in itertools.pairwise(np.array(points))])
    return float((line[:, 2] - terrain.height_m(line[:, :2])).min())


HOMES_M = [(0.0, 0.0), (700.0, 400.0), (-900.0, -1200.0)]


@pytest.mark.parametrize("homes", [False, True], ids=["one home", "homes"])
@pytest.mark.parametrize("step_m", [0.0, 20.0])
def test_over_terrain_no_two_meet_whatever_their_height_on_a_leg(step_m, homes):
    terrain = ridge(top_m=720.0, size=401)
    scenario = over(terrain)
    if homes:
        scenario = with_homes(scenario, terrain, HOMES_M)
    fleet = plan_fleet(scenario, 3, separation_m=SEPARATION_M, altitude_step_m=step_m)
    for plan in fleet.plans:
        assert least_above_ground_m(plan, terrain) >= scenario.terrain_options.clearance_m - 0.1
    if homes:
        heights_m = dict(zip("abc", terrain.height_m(np.array(HOMES_M)).tolist(), strict=True))
        assert max(heights_m.values()) - min(heights_m.values()) > 50
        for plan in fleet.plans:
            assert plan.built.mission.home.alt_amsl_m == pytest.approx(heights_m[plan.part.name])
    assert len(fleet.plans) > 1
    assert fleet.longest_s <= fleet.single_s + 1e-6
    names = sorted(name for plan in fleet.plans for name in plan.scenario.users.names)
    assert names == sorted(scenario.users.names)
    for number, plan in enumerate(fleet.plans):
        assert plan.trajectory.assignment.served.all()
        assert plan.links is not None
        assert number == 0 or plan.scenario.vehicle.altitude_m >= 60.0
    # By brute sampling: two that are nearer over the ground than the separation are on legs that lie apart in height.
    vertical_m = min(step_m, 10.0) if step_m else 10.0
    plane = LocalPlane(HOME.lat_deg, HOME.lon_deg)
    for one, other in itertools.combinations(fleet.plans, 2):
        lines = [timeline(plan, plane) for plan in (one, other)]
        starts = [plan.part.start_s for plan in (one, other)]
        begin, end = max(starts), min(line.time_s[-1] + at for line, at in zip(lines, starts, strict=True))
        for moment in np.arange(begin + 0.01, end, 0.7):
            places = [line.at(np.array([moment - at]))[0] for line, at in zip(lines, starts, strict=True)]
            if np.hypot(*(places[0] - places[1])[:2]) >= SEPARATION_M - 0.01:
                continue
            spans = []
            for line, at in zip(lines, starts, strict=True):
                leg = max(row for row in range(len(line.time_s) - 1) if line.time_s[row] <= moment - at)
                spans.append(sorted(line.place_m[leg : leg + 2, 2].tolist()))
            assert max(spans[0][0] - spans[1][1], spans[1][0] - spans[0][1]) >= vertical_m - 1e-3


def test_on_legs_whose_heights_overlap_two_are_level_all_along():
    def line(heights_m, x_m):
        return Timeline(
            np.array([0.0, 10.0]), np.array([[x_m, 0.0, heights_m[0]], [x_m, 100.0, heights_m[1]]]), True
        )

    apart = {"separation_m": 50.0, "vertical_m": 10.0}
    # Evenly flown they would be 25 m apart in height at every moment; over real ground nobody knows.
    assert meeting(line((0, 30), 0.0), line((25, 55), 20.0), 0.0, 0.0, **apart) is not None
    assert meeting(line((0, 30), 0.0), line((40, 70), 20.0), 0.0, 0.0, **apart) is None
    assert meeting(line((0, 30), 0.0), line((25, 55), 60.0), 0.0, 0.0, **apart) is None


def test_far_users_whose_sorties_are_one_vehicles_are_dealt_out_to_both():
    # One place that takes several batteries, and users on the other side: cut alone, one vehicle would fly it all.
    scenario = make_scenario(
        [(2000, 0), (-1700, 0), (-1600, 500)],
        demand_mbit=[2000.0, 100.0, 100.0],
        clusters=3,
        endurance_s=800.0,
    )
    fleet = plan_fleet(scenario, 2, sorties=True)
    assert {plan.part.number for plan in fleet.plans} == {1, 2}
    assert fleet.longest_s < 0.9 * fleet.single_s
    first = [plan for plan in fleet.plans if plan.part.round == 1]
    assert len(first) == 2
    assert sum(len(plan.scenario.warnings) for plan in fleet.plans) == len(scenario.warnings)
