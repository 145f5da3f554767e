"""A plan read back is the plan that was written; a damaged one is refused in sentences."""

import contextlib
import copy
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.plan import make_plan
from mavplan.plan_file import document, dumps, fingerprint
from mavplan.scenario import load_scenario
from mavplan.stored_plan import parse_plan, read_plan
from tests.support import make_scenario

GALLERY = Path(__file__).resolve().parents[1] / "missions"


@cache
def written():
    """A plan of four users, one of them served by D2D, with its text."""
    plan = make_plan(
        make_scenario([(0, 500), (150, 900), (900, 900), (0, -700)], pairs=[(0, 1)], demand_mbit=20.0)
    )
    return plan, dumps(plan)


def edited(change):
    """The written plan's text after a change to its content."""
    data = json.loads(written()[1])
    change(data)
    return json.dumps(data)


def refused(text):
    """What is said about a text that is no plan."""
    with pytest.raises(InputError) as caught:
        parse_plan(text, "x.mavplan.json")
    return str(caught.value)


@pytest.mark.parametrize("name", ["valley", "coast", "hppp60"])
def test_a_plan_read_back_holds_the_scenario_it_was_made_from(name):
    plan = make_plan(load_scenario(GALLERY / name / "scenario.toml"))
    stored = parse_plan(dumps(plan), name)
    assert fingerprint(stored.scenario) == document(plan)["scenario_sha256"]
    np.testing.assert_allclose(stored.scenario.users.xy_m, plan.scenario.users.xy_m, atol=1e-9)
    np.testing.assert_array_equal(stored.stop_of, plan.trajectory.assignment.stop)
    np.testing.assert_array_equal(stored.d2d, plan.trajectory.assignment.d2d)
    np.testing.assert_array_equal(stored.hold_s, plan.holds.stored_s)
    assert [stop.items for stop in stored.stops] == list(plan.built.stop_items)
    assert stored.autopilot == plan.rules.name
    assert stored.mission_s == pytest.approx(plan.forecast.mission_s, abs=0.1)


def test_a_tdma_schedule_comes_back():
    plan = make_plan(make_scenario([(0, 500), (100, 500), (900, 900)], mode="tdma"))
    stored = parse_plan(dumps(plan), "x")
    assert stored.scenario.service.mode == "tdma"
    assert [(slot.stop, slot.user) for slot in stored.schedule] == [
        (slot.stop, slot.user) for slot in plan.holds.schedule
    ]
    np.testing.assert_allclose(
        [slot.duration_s for slot in stored.schedule],
        [slot.duration_s for slot in plan.holds.schedule],
        rtol=0,
        atol=1e-9,  # a hundredth of a bit at 10 Mbit/s: needs are met to a bit
    )


def test_whether_the_plan_counts_on_what_is_received_in_flight_is_known():
    scenario = make_scenario([(0, 500), (900, 900)])
    assert not parse_plan(dumps(make_plan(scenario)), "x").in_flight
    counting = replace(scenario, service=replace(scenario.service, in_flight=True))
    assert parse_plan(dumps(make_plan(counting)), "x").in_flight
    expecting = edited(lambda data: data["users"][0].update(in_flight_mbit=3.5))
    assert parse_plan(expecting, "x").in_flight


def test_a_mission_files_name_stands_for_the_plan_beside_it(tmp_path):
    (tmp_path / "x.mavplan.json").write_text(written()[1])
    assert read_plan(tmp_path / "x.plan").label == read_plan(tmp_path / "x.mavplan.json").label


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_plan(tmp_path / "x.mavplan.json")


def test_keys_that_are_not_known_are_left_alone():
    def change(data):
        data["energy_wh"] = 12.5
        data["users"][0]["phone"] = "x"
        data["stops"][0]["forecast"] = {"leg_s": 3}
        data["scenario"]["vehicle"]["rotors"] = 4
        data["scenario"]["tide"] = {"height_m": 3}

    stored = parse_plan(edited(change), "x")
    assert fingerprint(stored.scenario) == document(written()[0])["scenario_sha256"]


def test_everything_that_is_wrong_is_said_at_once():
    def change(data):
        data["users"][0]["lat_deg"] = "north"
        data["stops"][0]["hold_s"] = -1
        del data["users"][1]["mate"]
        data["scenario"]["radio"] = 5

    assert refused(edited(change)).splitlines() == [
        "x.mavplan.json, stops[0].hold_s: found -1; it should be greater than or equal to 0",
        'x.mavplan.json, users[0].lat_deg: found "north"; it should be a valid number',
        "x.mavplan.json, users[1].mate: is missing",
        "x.mavplan.json, scenario.radio: found 5; it should be an object",
    ]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: data["users"][0].update(stop=9), "users[0].stop: found 9; there are"),
        (lambda data: data["users"][0].update(mate="u3"), 'users[0].mate: "u3" is no user whose mate is'),
        (lambda data: data["users"][0].update(name="u3"), "users: two of them have the same name"),
        (lambda data: data["stop_items"].pop(), "stop_items: there are"),
        (lambda data: data["stop_items"][1].update(first=0), "do not follow item"),
        (lambda data: data["schedule"].append({"stop": 0, "user": "x", "start_s": 0, "duration_s": 1}), "schedule[0]"),
        (lambda data: data.update(version=2), "has version 2 of the format; 1 can be read"),
        (lambda data: data.update(format="QGC"), "is no plan of mavplan"),
    ],
)  # fmt: skip
def test_parts_that_do_not_fit_together_are_refused(change, said):
    assert said in refused(edited(change))


@pytest.mark.parametrize("text", ["", "[]", "{}", "nul", '{"format": NaN}', "[" * 100_000, "\ud800"])
def test_what_is_no_plan_is_refused(text):
    assert refused(text).startswith("x.mavplan.json: is no")


def _places(value, path=()):
    """Every place in nested content."""
    yield path
    children = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    )
    for key, child in children:
        yield from _places(child, (*path, key))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_no_damage_to_a_plan_makes_anything_but_a_plan_or_an_input_error(data):
    content = json.loads(written()[1])
    path = data.draw(st.sampled_from([place for place in _places(content) if place]))
    junk = data.draw(
        st.one_of(
            st.none(),
            st.booleans(),
            st.integers(),
            st.floats(),
            st.text(max_size=5),
            st.just([]),
            st.just({}),
        )
    )
    damaged = copy.deepcopy(content)
    inside = damaged
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = junk
    with contextlib.suppress(InputError):
        stored = parse_plan(json.dumps(damaged), "x")
        assert len(stored.stop_of) == len(stored.scenario.users)
        assert np.all(stored.stop_of < len(stored.stops))
