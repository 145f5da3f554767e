"""``--altitude auto``: the altitude with the shortest mission, among few that are planned."""

import dataclasses
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.altitude import GRID, REFINED, least, limits_m
from mavplan.cli.tables import altitude_line, totals
from mavplan.comparison import compare
from mavplan.errors import InputError
from mavplan.fleet.make import plan_fleet
from mavplan.plan import make_plan
from mavplan.plan_file import document, dumps, summary
from mavplan.planners import PLANNERS
from mavplan.radio import planning_channel
from mavplan.scenario import Service, load_scenario
from mavplan.scenario.sections import FenceOptions
from mavplan.scenario.write import scenario_toml, users_csv
from mavplan.sorties.make import plan_sorties
from mavplan.stored_plan import parse_plan
from tests.support import make_scenario
from tests.terrain.hills import ridge

XY_M = [(900, 0), (1500, 600), (-800, 400), (200, -700)]


def sought(scenario, low=40.0, high=90.0, **vehicle):
    vehicle = dataclasses.replace(scenario.vehicle, altitude_min_m=low, altitude_max_m=high, **vehicle)
    planner = dataclasses.replace(scenario.planner, time_limit_s=0.5)
    return dataclasses.replace(scenario, vehicle=vehicle, planner=planner, search_altitude=True)


@given(st.integers(1, 150), st.integers(0, 150), st.integers(-20, 200), st.floats(0.1, 5), st.floats(0.1, 5))
def test_the_bottom_of_one_valley_is_found_or_nearly(low, span, bottom, down, up):
    high, asked = low + span, []

    def value(number):
        asked.append(number)
        return down * (bottom - number) if number < bottom else up * (number - bottom)

    found = least(value, low, high)
    assert low <= found <= high
    assert len(asked) <= GRID + REFINED
    best = min(range(low, high + 1), key=value)
    assert abs(found - best) <= max(1, span // 40)


@given(st.lists(st.one_of(st.floats(0, 10), st.just(float("inf"))), min_size=1, max_size=60))
def test_what_is_found_is_no_worse_than_anything_that_was_tried(values):
    tried = []

    def value(number):
        tried.append(number)
        return values[number]

    found = least(value, 0, len(values) - 1)
    assert values[found] == min(values[number] for number in tried)


@pytest.mark.parametrize("planner", PLANNERS)
def test_the_plan_is_at_the_best_of_the_altitudes_tried_and_says_so(planner):
    plan = make_plan(sought(make_scenario(XY_M, planner=planner, clusters=2)))
    chosen = plan.altitude
    assert plan.scenario.vehicle.altitude_m == chosen.chosen_m
    assert not plan.scenario.search_altitude
    assert chosen.objective == ("tour_m" if planner == "length" else "mission_s")
    values = {tried.altitude_m: tried.value for tried in chosen.tried}
    assert min(values.values()) == values[chosen.chosen_m]
    assert {40.0, 90.0} <= set(values)
    assert all(float(at).is_integer() for at in values)
    heights = [item.alt_m for item in plan.built.mission.items if item.has_position and item.alt_m]
    assert set(heights) == {chosen.chosen_m}
    assert altitude_line(chosen) in totals(plan)
    if planner not in ("length", "time"):
        again = make_plan(dataclasses.replace(plan.scenario, planner=plan.scenario.planner))
        asked = again.forecast.flight_s + float(again.holds.asked_s.sum())
        assert asked == pytest.approx(values[chosen.chosen_m], abs=1e-3)


def test_margins_are_in_the_radius_of_every_altitude():
    scenario = sought(make_scenario(XY_M, clusters=2, position_error_m=2.0))
    radio = dataclasses.replace(scenario.radio, fade_margin_db=3.0)
    plan = make_plan(dataclasses.replace(scenario, radio=radio, service=Service(user_error_m=5.0)))
    assert plan.trajectory.radius_m == planning_channel(plan.scenario).radius_m
    assert plan.trajectory.radius_m < make_plan(scenario).trajectory.radius_m
    # (γ0/γth)^(1/α) less the errors, and the altitude: equation (4) by hand.
    slant_m = 10 ** ((20 - 3 - 70 + 105.3045 - 3) / 20) - 2 - 5
    assert plan.trajectory.radius_m == pytest.approx(
        (slant_m**2 - plan.altitude.chosen_m**2) ** 0.5, rel=1e-9
    )


def test_higher_is_better_where_a_hill_hides_users():
    scenario = make_scenario([(800, 0), (810, 0), (805, 0), (1160, 0)], clusters=1)
    scenario = dataclasses.replace(
        scenario, terrain=ridge(top_m=645.0, base_m=600.0, at_m=970.0, width_m=60.0)
    )
    plan = make_plan(sought(scenario, 31.0, 150.0))
    values = {tried.altitude_m: tried.value for tried in plan.altitude.tried}
    assert plan.altitude.chosen_m > 31.0
    assert values[plan.altitude.chosen_m] < values[31.0]


def test_fence_radio_and_clearance_bound_what_is_tried():
    scenario = sought(make_scenario(XY_M), 20.5, 500.0)
    assert limits_m(scenario) == (21, 412)  # the radio reaches the ground from below 412.3 m
    fenced = dataclasses.replace(scenario, fence_options=FenceOptions(max_alt_rel_m=60.5))
    assert limits_m(fenced) == (21, 60)
    assert limits_m(dataclasses.replace(scenario, terrain=ridge()))[0] == 30
    with pytest.raises(InputError) as raised:
        make_plan(sought(make_scenario(XY_M), 413.0, 500.0))
    assert [problem.code for problem in raised.value.problems] == ["no-altitude"]


def test_where_no_altitude_has_a_plan_the_fault_of_the_lowest_is_raised():
    scenario = sought(make_scenario([(900, 0)], demand_mbit=1e9))
    with pytest.raises(InputError) as raised:
        make_plan(scenario)
    assert [problem.code for problem in raised.value.problems] == ["hold-too-long"]


def test_a_fleet_steps_up_from_the_chosen_altitude_and_stays_below_the_greatest():
    made = plan_fleet(sought(make_scenario(XY_M, demand_mbit=100.0, clusters=4)), 2, altitude_step_m=15.0)
    chosen = made.plans[0].altitude
    assert chosen.high_m == 75.0
    heights = [plan.scenario.vehicle.altitude_m for plan in made.plans]
    assert heights == [chosen.chosen_m + 15.0 * n for n in range(len(heights))]


def test_sorties_fly_at_the_altitude_of_the_flight_that_is_cut():
    made = plan_sorties(sought(make_scenario(XY_M, demand_mbit=100.0, clusters=4, endurance_s=600.0)))
    assert len(made.plans) > 1
    assert {plan.scenario.vehicle.altitude_m for plan in made.plans} == {made.whole.altitude.chosen_m}
    assert all(plan.altitude == made.whole.altitude for plan in made.plans)


def test_compare_seeks_an_altitude_for_each_planner():
    found = compare(sought(make_scenario(XY_M, clusters=2), 60.0, 62.0))
    assert all(60 <= row.altitude_m <= 62 for row in found.rows)
    assert [row.altitude_m for row in found.rows] == [plan.altitude.chosen_m for plan in found.plans]


def test_the_file_holds_what_was_tried_and_is_read_back_at_the_chosen_altitude():
    plan = make_plan(sought(make_scenario(XY_M, clusters=2), 50.0, 55.0))
    told = summary(plan)["altitude"]
    assert told["chosen_m"] == plan.altitude.chosen_m
    assert len(told["tried"]) == 6
    assert document(plan)["scenario"]["vehicle"]["altitude_m"] == plan.altitude.chosen_m
    assert parse_plan(dumps(plan), "plan").scenario.vehicle.altitude_m == plan.altitude.chosen_m
    json.dumps(told, allow_nan=False)


HEAD = 'users = "users.csv"\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600.0\n[vehicle]\n'


def load(folder, vehicle):
    (folder / "users.csv").write_text("name,lat_deg,lon_deg\na,46.51,7.5\n")
    (folder / "scenario.toml").write_text(HEAD + vehicle)
    return load_scenario(folder / "scenario.toml")


def test_auto_is_read_from_a_file_and_written_again(tmp_path):
    found = load(tmp_path, 'altitude_m = "auto"\naltitude_max_m = 80\n')
    assert found.search_altitude
    assert (found.vehicle.altitude_min_m, found.vehicle.altitude_max_m) == (30.0, 80.0)
    (tmp_path / "again.toml").write_text(scenario_toml(found, "again.csv", "again"))
    (tmp_path / "again.csv").write_text(users_csv(found.users))
    again = load_scenario(tmp_path / "again.toml")
    assert again.search_altitude
    assert again.vehicle == found.vehicle
    assert not load(tmp_path, "altitude_m = 80\n").search_altitude


@pytest.mark.parametrize(
    ("vehicle", "code"),
    [
        ('altitude_m = "high"\n', "out-of-range"),
        ('altitude_m = "auto"\naltitude_min_m = 200\n', "altitudes"),
        ('altitude_m = "auto"\naltitude_min_m = 0\n', "out-of-range"),
        ('altitude_m = "auto"\naltitude_min_m = 5000\naltitude_max_m = 6000\n', "no-coverage"),
    ],
)
def test_what_is_wrong_with_an_altitude_is_said(tmp_path, vehicle, code):
    with pytest.raises(InputError) as raised:
        load(tmp_path, vehicle)
    assert code in [problem.code for problem in raised.value.problems]
