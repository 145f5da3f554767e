"""Sorties over real ground: within the battery, everybody served in one of them, as few as any cut in that order."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest

from mavplan.errors import InputError
from mavplan.fleet.make import plan_fleet
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.planners.pinned import pins_of
from mavplan.scenario.sections import PinnedStop
from mavplan.sorties.make import plan_sorties
from mavplan.sorties.over_ground import over_some
from mavplan.stored_plan import parse_plan
from tests.flown import fly
from tests.support import make_scenario
from tests.terrain.hills import ridge, terrain_of

XY_M = [
    (900, 100),
    (1400, -300),
    (300, 1100),
    (-600, 900),
    (-1300, 200),
    (-900, -800),
    (200, -1200),
    (1000, -1100),
]
MASS_KG = 2.0


def over(terrain, endurance_s, xy_m=XY_M, **more):
    scenario = make_scenario(
        xy_m,
        demand_mbit=60.0,
        clusters=6,
        altitude_m=60.0,
        endurance_s=endurance_s,
        mass_kg=MASS_KG,
        **more,
    )
    return dataclasses.replace(scenario, terrain=terrain)


def rough(seed, most_m=120.0):
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(0, most_m, (9, 9))
    at = np.linspace(0, 8, 201)
    rows = np.array([np.interp(at, np.arange(9), row) for row in coarse])
    heights = np.array([np.interp(at, np.arange(9), column) for column in rows.T]).T
    return terrain_of(heights - heights[100, 100] + 600.0)


@functools.cache
def cut(number, autopilot="ardupilot", mode="broadcast"):
    terrain = ridge(top_m=760.0) if number == 0 else rough(number)
    scenario = over(terrain, 620.0, autopilot=autopilot, mode=mode, pairs=[(0, 1)])
    return scenario, plan_sorties(scenario)


@pytest.mark.parametrize(
    "case",
    [(0,), (1, "px4"), (2, "ardupilot", "tdma"), (3, "px4", "tdma")],
    ids=["ridge", "rough", "tdma", "px4"],
)
def test_each_comes_home_with_its_reserve_and_everybody_is_served_by_one(case):
    scenario, found = cut(*case)
    assert len(found.plans) > 1
    assert found.not_served == ()
    names = [name for plan in found.plans for name in plan.scenario.users.names]
    assert sorted(names) == sorted(scenario.users.names)
    for number, plan in enumerate(found.plans, start=1):
        assert (plan.part.number, plan.part.of) == (number, len(found.plans))
        assert plan.scenario.vehicle.end == "rtl"
        assert plan.forecast.mission_s <= 620.0 * (1 - scenario.vehicle.reserve_fraction)
        # What the holds bring over the links as the ground leaves them.
        by_air = plan.scenario.users.demand_bit.copy()
        d2d, mate = plan.trajectory.assignment.d2d, plan.scenario.users.mate
        by_air[mate[d2d]] += by_air[d2d]
        by_air[d2d] = 0.0
        rates = scenario.radio.bandwidth_hz * plan.links.rates_bit_s_hz
        held_s = plan.holds.stored_s.astype(np.float32)
        if scenario.service.mode == "broadcast":
            assert (rates @ held_s >= by_air - 1.0).all()
        else:
            seconds = by_air / np.maximum(rates.max(axis=1), 1e-9)
            assert held_s.sum() >= seconds.sum() - 1e-3
        assert not plan.warnings or all(problem.severity == "warning" for problem in plan.warnings)
        stored = parse_plan(dumps(plan), "x.mavplan.json")
        assert stored.scenario.users.names == plan.scenario.users.names


def test_no_cut_of_the_stops_in_their_order_takes_fewer():
    scenario, found = cut(0)
    whole = make_plan(scenario)
    stops = len(whole.trajectory.stops_m)
    usable_s = 620.0 * (1 - scenario.vehicle.reserve_fraction)

    @functools.cache
    def lasts(first, end):
        plan = over_some(whole, np.arange(first, end), "waypoint+loiter")
        return plan is not None and plan.forecast.mission_s <= usable_s

    fewest = next(
        count + 1
        for count in range(stops)
        for inner in itertools.combinations(range(1, stops), count)
        if all(lasts(first, end) for first, end in itertools.pairwise((0, *inner, stops)))
    )
    assert len(found.plans) == fewest


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_mock_flies_a_sortie_in_the_time_that_was_forecast(autopilot):
    _, found = cut(1, autopilot)
    plan = found.plans[-1]
    flown = fly(plan.built.mission, plan.rules, MASS_KG)
    assert flown.seconds == pytest.approx(plan.forecast.mission_s, rel=0.05)


def test_one_battery_that_does_it_flies_the_plan_as_it_is():
    scenario = over(ridge(), 36_000.0)
    found = plan_sorties(scenario)
    assert found.plans == (found.whole,)


def test_where_fewer_are_allowed_those_are_flown_that_serve_the_most_weighted_demand():
    scenario, everybody = cut(0)
    count = len(everybody.plans)
    assert len(plan_sorties(scenario, most=count).plans) == count
    last = everybody.plans[-1].scenario.users.names
    priority = np.array([50.0 if name in last else 1.0 for name in scenario.users.names])
    weighted = dataclasses.replace(scenario, users=dataclasses.replace(scenario.users, priority=priority))
    for most in range(1, count):
        found = plan_sorties(weighted, most=most)
        served = [name for plan in found.plans for name in plan.scenario.users.names]
        assert len(found.plans) == most
        assert set(last) <= set(served)
        assert sorted([*served, *found.not_served]) == sorted(scenario.users.names)
        assert set(found.not_served) <= set(found.rest.users.names)
        assert all(plan.part.not_served == found.not_served for plan in found.plans)


def test_a_stop_that_no_sortie_serves_is_left_over_where_others_may_be():
    far = over(ridge(top_m=760.0, size=401), 620.0, xy_m=[*XY_M, (4200, 0)])
    with pytest.raises(InputError, match="no sortie serves u8"):
        plan_sorties(far)
    found = plan_sorties(far, most=9)
    assert found.not_served == ("u8",)


def test_every_stop_that_no_sortie_serves_is_named():
    scenario = over(ridge(top_m=760.0), 260.0)
    with pytest.raises(InputError, match="no sortie serves") as raised:
        plan_sorties(scenario)
    assert len(raised.value.problems) > 1
    assert {problem.code for problem in raised.value.problems} == {"beyond-battery"}
    weak = dataclasses.replace(
        scenario, vehicle=dataclasses.replace(scenario.vehicle, endurance_s=None, battery_wh=15.0)
    )
    with pytest.raises(InputError, match=r"take [\d.]+ Wh, a battery gives"):
        plan_sorties(weak)


def test_pinned_stops_are_flown_whoever_is_served():
    scenario, _ = cut(0)
    pins = tuple(
        PinnedStop(name=name, lat_deg=lat_deg, lon_deg=7.5, hold_s=30.0)
        for name, lat_deg in (("tent", 46.509), ("barn", 46.49))
    )
    pinned = dataclasses.replace(scenario, stops=pins)

    def held_s(plans):
        at = [zip(pins_of(pinned).at(p.trajectory.stops_m), p.holds.stored_s, strict=True) for p in plans]
        return sorted((pin, hold_s) for pairs in at for pin, hold_s in pairs if pin >= 0)

    found = plan_sorties(pinned)
    assert [pin for pin, _ in held_s(found.plans)] == [0, 1]
    assert min(hold_s for _, hold_s in held_s(found.plans)) >= 30.0
    with_pins = sum(bool(plan.scenario.stops) for plan in found.plans)
    assert [pin for pin, _ in held_s(plan_sorties(pinned, most=with_pins).plans)] == [0, 1]
    assert with_pins == 2
    with pytest.raises(InputError, match="take 2 sorties, more than the 1") as raised:
        plan_sorties(pinned, most=1)
    assert [problem.code for problem in raised.value.problems] == ["stops-sorties"]


def test_a_pinned_stop_beyond_the_battery_is_an_error_whoever_else_is_served():
    scenario, _ = cut(0)
    far = PinnedStop(name="far", lat_deg=46.5, lon_deg=7.5 - 2900 / 76_600, hold_s=400.0)
    with pytest.raises(InputError) as raised:
        plan_sorties(dataclasses.replace(scenario, stops=(far,)), most=9)
    assert [(p.code, p.where) for p in raised.value.problems] == [("stop-alone", "far")]


def test_a_pinned_stop_without_users_takes_those_behind_it_along():
    scenario, _ = cut(0)
    # The first of all, a few metres from home: nobody is served there alone.
    here = PinnedStop(name="here", lat_deg=46.5, lon_deg=7.5001, hold_s=5.0, order="first")
    pinned = dataclasses.replace(scenario, stops=(here,))
    for most in (None, 9):
        found = plan_sorties(pinned, most=most)
        assert [len(plan.scenario.stops) for plan in found.plans].count(1) == 1
        assert not found.not_served


def test_a_fleet_flies_sorties_over_ground_in_rounds():
    scenario = over(ridge(top_m=760.0, size=401), 580.0)
    fleet = plan_fleet(scenario, 2, sorties=True)
    assert max(plan.part.rounds for plan in fleet.plans) > 1
    names = [name for plan in fleet.plans for name in plan.scenario.users.names]
    assert sorted(names) == sorted(scenario.users.names)
    for plan in fleet.plans:
        assert plan.forecast.mission_s <= 580.0 * (1 - scenario.vehicle.reserve_fraction)
        assert plan.links is not None
