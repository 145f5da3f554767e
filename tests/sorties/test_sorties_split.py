"""Cutting a plan into sorties: budgets, order and the optimum, against brute force over the real forecast."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.geofence import Fence, FenceCircle
from mavplan.plan import make_plan
from mavplan.sorties.make import plan_sorties
from mavplan.sorties.split import split, with_caution
from mavplan.sorties.ways import Budget, Ways, budget_of
from tests.support import HOME, make_scenario

STOPS = st.lists(
    st.tuples(st.integers(-2000, 2000), st.integers(-2000, 2000)), min_size=1, max_size=6, unique=True
)


def scenario_of(xy_m, autopilot="ardupilot", **vehicle):
    return make_scenario(xy_m, autopilot=autopilot, mass_kg=2.5, **vehicle)


def brute(ways, holds_s, budget):
    """The fewest consecutive sorties, then the least time, over every way to cut."""
    count, best = len(holds_s), None
    for cuts in itertools.product([False, True], repeat=count - 1):
        borders = [0, *(i + 1 for i, here in enumerate(cuts) if here), count]
        groups = [list(range(a, b)) for a, b in itertools.pairwise(borders)]
        costs = [ways.flight(group, [holds_s[i] for i in group]) for group in groups]
        if all(budget.allows(cost) for cost in costs):
            found = len(groups), sum(cost.seconds for cost in costs)
            best = found if best is None else min(best, found)
    return best


@settings(max_examples=40)
@given(STOPS, st.lists(st.integers(1, 200), min_size=6, max_size=6), st.floats(1.001, 2.0))
def test_no_other_cut_has_fewer_sorties_or_less_time(stops_m, holds_s, room):
    stops_m = np.array(stops_m, dtype=float)
    holds_s = [float(hold_s) for hold_s in holds_s[: len(stops_m)]]
    ways = Ways(scenario_of(stops_m), stops_m)
    most = max(ways.flight([i], [holds_s[i]]).wh for i in range(len(ways)))
    budget = Budget(wh=most * room)
    found = split(ways, holds_s, budget, AUTOPILOTS["ardupilot"])
    assert [stop for leaf in found for stop in leaf.stops] == list(range(len(ways)))
    costs = [ways.flight(list(leaf.stops), list(leaf.holds_s)) for leaf in found]
    assert all(budget.allows(cost) for cost in costs)
    count, seconds = brute(ways, holds_s, budget)
    assert len(found) == count
    assert sum(cost.seconds for cost in costs) == pytest.approx(seconds, abs=1e-6)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("zones", [False, True])
def test_the_ways_add_up_to_the_forecast_of_the_mission(autopilot, zones):
    xy_m = [(900, 100), (1500, -700), (-300, 1400), (-1200, -900)]
    scenario = scenario_of(xy_m, autopilot, position_error_m=0.0)
    scenario = dataclasses.replace(
        scenario,
        planner=dataclasses.replace(scenario.planner, clusters=4),
        wind=type(scenario.wind)(4.0, 250.0),
    )
    if zones:
        lat_e7, lon_e7 = round((HOME.lat_deg + 0.004) * 1e7), round((HOME.lon_deg + 0.004) * 1e7)
        zone = FenceCircle(False, lat_e7, lon_e7, 250.0, "mast")
        scenario = dataclasses.replace(scenario, no_fly=Fence((), (zone,)))
    plan = make_plan(scenario)
    ways = Ways(scenario, plan.trajectory.stops_m)
    found = ways.flight(list(range(len(ways))), plan.holds.stored_s.tolist())
    assert found.seconds == pytest.approx(plan.forecast.mission_s, abs=0.02)
    assert found.wh == pytest.approx(plan.forecast.used_wh, abs=0.005)


def test_a_hold_longer_than_a_battery_is_split_and_the_pieces_add_up():
    stops_m = np.array([(500.0, 0.0), (800.0, 300.0), (900.0, -200.0)])
    ways = Ways(scenario_of(stops_m), stops_m)
    budget = Budget(seconds=600.0)
    holds_s = [20.0, 1500.0, 30.0]
    found = split(ways, holds_s, budget, AUTOPILOTS["ardupilot"])
    assert all(budget.allows(ways.flight(list(leaf.stops), list(leaf.holds_s))) for leaf in found)
    held = np.zeros(3)
    for leaf in found:
        held[list(leaf.stops)] += leaf.holds_s
    assert held.tolist() == holds_s
    longest = 600.0 - ways.flight([1], [0.0]).seconds
    full = int(1500.0 // int(longest))
    assert [leaf for leaf in found if leaf.stops == (1,) and leaf.holds_s == (float(int(longest)),)]
    # What is left of it flies with its neighbours.
    assert len(found) == full + 1


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@given(hold=st.integers(1, 60000), seconds=st.floats(200, 900))
@settings(max_examples=60)
def test_the_pieces_of_a_hold_are_stored_and_never_less_than_it_as_float32(autopilot, hold, seconds):
    rules = AUTOPILOTS[autopilot]
    stops_m = np.array([(100.0, 0.0)])
    ways = Ways(scenario_of(stops_m, autopilot), stops_m)
    hold_s = (
        round(max(hold * rules.hold_step_s / 10, rules.min_hold_s) / rules.hold_step_s) * rules.hold_step_s
    )
    budget = Budget(seconds=seconds)
    found = split(ways, [round(hold_s, 6)], budget, rules)
    assume(found is not None)
    pieces = [piece for leaf in found for piece in leaf.holds_s]
    assert sum(np.float64(np.float32(piece)) for piece in pieces) >= np.float64(np.float32(hold_s))
    assert sum(pieces) <= hold_s + 2 * rules.hold_step_s
    for piece in pieces:
        assert piece >= rules.min_hold_s
        assert abs(piece / rules.hold_step_s - round(piece / rules.hold_step_s)) < 1e-6
        assert budget.allows(ways.flight([0], [piece]))


def test_a_user_that_no_sortie_serves_is_an_error_that_says_what_would_do():
    scenario = scenario_of([(300, 0), (2600, 0)], battery_wh=30.0)
    scenario = dataclasses.replace(scenario, planner=dataclasses.replace(scenario.planner, clusters=2))
    with pytest.raises(InputError) as raised:
        plan_sorties(scenario)
    (problem,) = raised.value.problems
    assert problem.code == "beyond-battery"
    assert "u1" in problem.message
    assert "home nearer" in problem.message
    # What it names does: both are served then.
    enough_wh = float(problem.message.split("battery_wh = ")[1].split(")")[0])
    vehicle = dataclasses.replace(scenario.vehicle, battery_wh=enough_wh + 0.1)
    made = plan_sorties(dataclasses.replace(scenario, vehicle=vehicle))
    assert {name for plan in made.plans for name in plan.scenario.users.names} == {"u0", "u1"}


def test_sorties_without_a_battery_are_an_error():
    with pytest.raises(InputError) as raised:
        plan_sorties(make_scenario([(300, 0)]))
    assert [problem.code for problem in raised.value.problems] == ["no-battery"]


def test_the_caution_is_less_than_what_the_battery_gives():
    budget = budget_of(scenario_of([(0, 0)], battery_wh=100.0, endurance_s=1000.0).vehicle)
    assert budget == Budget(800.0, 80.0)
    careful = with_caution(budget)
    assert 0.999 * 800 < careful.seconds < 800
    assert 0.999 * 80 < careful.wh < 80
