"""Who is served where not everybody can be: against every choice, and what is left over."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.plan import make_plan, plan_along
from mavplan.planners import PLANNERS
from mavplan.planners.ordering import from_origin
from mavplan.planners.trajectory import assign
from mavplan.radio import planning_channel
from mavplan.scenario import load_scenario
from mavplan.scenario.write import scenario_toml, users_csv
from mavplan.sorties.make import plan_sorties
from tests.support import make_scenario


def tight(xy_m, demand_mbit, priority, battery_wh, **vehicle):
    scenario = make_scenario(
        xy_m, demand_mbit=demand_mbit, clusters=len(xy_m), mass_kg=2.5, battery_wh=battery_wh, **vehicle
    )
    users = dataclasses.replace(scenario.users, priority=np.array(priority, dtype=float))
    return dataclasses.replace(scenario, users=users)


def value(scenario, names):
    users = scenario.users
    weights = users.priority * users.demand_bit / 1e6
    return sum(weight for weight, name in zip(weights, users.names, strict=True) if name in names)


def best_of_all(scenario, whole=None):
    """The greatest value of any set of users that one flight over the plan's stops serves within the battery."""
    whole, best = make_plan(scenario) if whole is None else whole, 0.0
    for size in range(1, len(scenario.users) + 1):
        for some in itertools.combinations(range(len(scenario.users)), size):
            users = scenario.users.some(np.array(some), scenario.users.demand_bit)
            stops = sorted({int(whole.trajectory.assignment.stop[n]) for n in some})
            path = from_origin(whole.trajectory.stops_m[stops])
            part = dataclasses.replace(scenario, users=users)
            flown = dataclasses.replace(
                whole.trajectory,
                path_m=path,
                stop_at=np.arange(1, len(path)),
                assignment=assign(users, path[1:], planning_channel(part), d2d=True),
            )
            plan = plan_along(part, flown)
            if plan.remaining_fraction >= scenario.vehicle.reserve_fraction:
                best = max(best, value(scenario, users.names))
    return best


@settings(max_examples=8)
@given(
    st.lists(
        st.tuples(st.integers(-1800, 1800), st.integers(-1800, 1800)), min_size=2, max_size=5, unique=True
    ),
    st.lists(st.sampled_from([5, 40, 200]), min_size=5, max_size=5),
    st.lists(st.sampled_from([0, 1, 3]), min_size=5, max_size=5),
    st.floats(0.3, 0.95),
)
def test_one_flight_serves_the_most_weighted_demand_of_all_choices(xy_m, demand_mbit, priority, share):
    count = len(xy_m)
    scenario = tight(xy_m, demand_mbit[:count], priority[:count], 1000.0)
    battery_wh = make_plan(scenario).forecast.used_wh * share / 0.8
    vehicle = dataclasses.replace(scenario.vehicle, battery_wh=battery_wh)
    scenario = dataclasses.replace(scenario, vehicle=vehicle)
    try:
        made = plan_sorties(scenario, most=1)
    except InputError:
        assert best_of_all(scenario) == pytest.approx(0.0)
        return
    (plan,) = made.plans
    assert plan.remaining_fraction >= scenario.vehicle.reserve_fraction
    assert set(plan.scenario.users.names) | set(made.not_served) == set(scenario.users.names)
    assert value(scenario, plan.scenario.users.names) >= best_of_all(scenario) * (1 - 1e-9)


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("planner", PLANNERS)
def test_with_every_planner_one_flight_serves_the_most_weighted_demand_and_is_home_with_its_reserve(
    planner, mode
):
    xy_m = [(900, 300), (1500, -200), (-1100, 400), (-300, -1300), (200, 700)]
    scenario = tight(xy_m, [20, 60, 5, 90, 40], [1, 3, 2, 0.5, 1], 1000.0)
    options = dataclasses.replace(scenario.planner, name=planner, time_limit_s=0.5)
    scenario = dataclasses.replace(
        scenario, planner=options, service=dataclasses.replace(scenario.service, mode=mode)
    )
    for share in (0.45, 0.7):
        battery_wh = make_plan(scenario).forecast.used_wh * share / 0.8
        vehicle = dataclasses.replace(scenario.vehicle, battery_wh=battery_wh)
        small = dataclasses.replace(scenario, vehicle=vehicle)
        made = plan_sorties(small, most=1)
        (plan,) = made.plans
        assert plan.remaining_fraction >= scenario.vehicle.reserve_fraction
        assert made.not_served or planner == "sbw"  # a sortie does not fly the whole snake
        assert value(scenario, plan.scenario.users.names) >= best_of_all(small, made.whole) * (1 - 1e-9)


def test_a_priority_decides_who_is_served_and_the_rest_is_a_scenario(tmp_path):
    west_first = tight([(-1500, 0), (1500, 0)], 20, [2, 1], 60.0)
    east_first = tight([(-1500, 0), (1500, 0)], 20, [1, 2], 60.0)
    for scenario, served, left in ((west_first, "u0", "u1"), (east_first, "u1", "u0")):
        made = plan_sorties(scenario, most=1)
        assert made.plans[0].scenario.users.names == (served,)
        assert made.plans[0].part.not_served == made.not_served == made.rest.users.names == (left,)
        # The rest is a scenario that can be read and planned.
        rest = made.rest
        users = dataclasses.replace(rest.users, lat_deg=np.array([46.5]), lon_deg=np.array([7.51]))
        (tmp_path / "rest.toml").write_text(scenario_toml(rest, "rest.csv", "left over"))
        (tmp_path / "rest.csv").write_text(users_csv(users))
        read = load_scenario(tmp_path / "rest.toml")
        assert read.users.names == (left,)
        assert read.users.priority.tolist() == rest.users.priority.tolist()


def test_two_sorties_serve_what_one_does_not():
    scenario = tight([(-1500, 0), (1500, 0), (0, 1700)], 20, [2, 1, 3], 45.0)
    counts = [len(plan_sorties(scenario, most=most).not_served) for most in (1, 2, 3)]
    assert counts == [2, 1, 0]
    assert plan_sorties(scenario, most=1).plans[0].scenario.users.names == ("u2",)


def test_a_mate_that_relays_is_served_with_whom_it_relays_to_or_neither_is():
    xy_m = [*((10 * n, 0) for n in range(8)), (400, 0), (590, 0), (-2400, 0)]
    scenario = tight(xy_m, [1.0] * 8 + [20.0, 60.0, 90.0], [1.0] * 10 + [5.0], 60.0)
    mate = np.full(11, -1)
    mate[[8, 9]] = 9, 8
    scenario = dataclasses.replace(
        scenario,
        users=dataclasses.replace(scenario.users, mate=mate),
        planner=dataclasses.replace(scenario.planner, clusters=2),
    )
    assert make_plan(scenario).trajectory.assignment.d2d.tolist() == [n == 9 for n in range(11)]
    made = plan_sorties(scenario, most=1)
    served = set(made.plans[0].scenario.users.names)
    assert {"u8", "u9"} <= served or not {"u8", "u9"} & served
    assert made.not_served


def test_many_users_are_chosen_among_within_the_battery_and_nobody_is_lost():
    rng = np.random.default_rng(5)
    xy_m = rng.uniform(-1800, 1800, (24, 2))
    scenario = tight(xy_m, rng.choice([5, 20, 60], 24).astype(float), rng.choice([1, 2, 5], 24), 75.0)
    made = plan_sorties(scenario, most=2)
    assert len(made.plans) == 2
    served = {name for plan in made.plans for name in plan.scenario.users.names}
    assert served | set(made.not_served) == set(scenario.users.names)
    assert not served & set(made.not_served)
    for plan in made.plans:
        assert plan.remaining_fraction >= scenario.vehicle.reserve_fraction
    # More than the plan's first users in its order, which is what a flight that turns back would serve.
    whole = made.whole
    first = set(plan_sorties(scenario).plans[0].scenario.users.names) | set(
        plan_sorties(scenario).plans[1].scenario.users.names
    )
    assert whole.forecast.used_wh > 75.0
    assert value(scenario, served) >= value(scenario, first)
