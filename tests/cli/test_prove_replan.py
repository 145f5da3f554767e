"""``mavplan prove`` and ``replan``: tables, JSON, picture and exit code say the same; the rest can be planned again."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.scenario import load_scenario
from mavplan.stored_plan import parse_plan, read_plan
from tests.proof.plans import flight_of, moved, places_m
from tests.track.logs import fly, to_bin, to_csv, to_tlog

GALLERY = Path(__file__).resolve().parents[2] / "missions"


@cache
def planned():
    """The text of the valley's plan."""
    return dumps(make_plan(load_scenario(GALLERY / "valley" / "scenario.toml")))


@cache
def shortened():
    """A flight along it with the third hold cut by half and the sixth stop 200 m off, and its tlog."""
    plan = parse_plan(planned(), "valley")
    holds_s = plan.hold_s.copy()
    holds_s[2] /= 2
    flight = flight_of(plan, holds_s=holds_s, stops_m=moved(places_m(plan), 5, 200.0), hz=2.0)
    return flight, to_tlog(flight)


@pytest.fixture
def valley(tmp_path):
    """The valley's plan, in the present folder."""
    (tmp_path / "valley.mavplan.json").write_text(planned())
    return read_plan(tmp_path / "valley.mavplan.json")


@pytest.fixture
def short_flight(valley, tmp_path):
    """A flight that left users short, in the present folder."""
    flight, data = shortened()
    (tmp_path / "short.tlog").write_bytes(data)
    return flight


@pytest.mark.parametrize(("name", "write"), [("x.tlog", to_tlog), ("x.bin", to_bin), ("x.csv", to_csv)])
def test_a_flight_as_planned_is_proved_from_every_log(mavplan, valley, tmp_path, name, write):
    (tmp_path / name).write_bytes(write(flight_of(valley, hz=10.0 if write is to_csv else 2.0)))
    ran = mavplan("prove", name, "--plan", "valley.plan")
    assert ran.code == 0, ran.err
    assert "12 of 12 users received what they need: 480.0 of 480.0 Mbit" in ran.out
    assert "7 of 7 stops held" in ran.out


def test_a_shortfall_is_named_by_user_and_stop_and_the_exit_code_says_so(mavplan, valley, short_flight):
    ran = mavplan("prove", "short.tlog", "--plan", "valley.mavplan.json")
    assert ran.code == 6
    assert (
        "error: 3 of 12 users did not receive what they need: "
        "Cable car by 90.0 Mbit (stop 6: held 200 m from its place)" in ran.err
    )
    assert "Station" in ran.err
    assert "(stop 3: held 19.0 of 38.0 s)" in ran.err
    assert "9 of 12 users received what they need" in ran.out


def test_json_says_what_the_tables_say(mavplan, valley, short_flight):
    ran = mavplan("prove", "short.tlog", "--plan", "valley.mavplan.json", "--json")
    assert ran.code == 6
    found = json.loads(ran.out)
    assert (found["all_met"], found["users_met"], found["in_flight_counts"], found["landed"]) == (
        False,
        9,
        False,
        True,
    )
    users = {user["name"]: user for user in found["users"]}
    assert users["Cable car"]["short_mbit"] == users["Cable car"]["demand_mbit"] == 90.0
    assert users["Cable car"]["reason"] == "stop 6: held 200 m from its place"
    assert users["Last barn"]["d2d_mbit"] == pytest.approx(10.0)
    assert [stop["held_s"] for stop in found["stops"]] == pytest.approx(
        [8.0, 32.0, 19.0, 4.0, 16.0, 57.0, 26.0], abs=0.1
    )
    assert found["stops"][5]["off_place_m"] == pytest.approx(200.0, abs=0.5)
    for user in found["users"]:
        counted = user["hovering_mbit"] + user["d2d_mbit"]
        assert user["met"] == (counted >= user["demand_mbit"] - 1e-6)
        assert user["short_mbit"] == pytest.approx(
            0 if user["met"] else user["demand_mbit"] - counted, abs=1e-5
        )


def test_in_flight_can_be_counted(mavplan, valley, short_flight):
    ran = mavplan("prove", "short.tlog", "--plan", "valley.plan", "--in-flight", "--json")
    assert ran.code == 6
    short = [user["name"] for user in json.loads(ran.out)["users"] if not user["met"]]
    assert short == ["Station"]


@pytest.mark.parametrize(("suffix", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_a_picture_is_drawn_before_the_verdict(mavplan, valley, short_flight, tmp_path, suffix, magic):
    pytest.importorskip("matplotlib")
    ran = mavplan("prove", "short.tlog", "--plan", "valley.plan", "-o", f"proof.{suffix}")
    assert ran.code == 6
    assert (tmp_path / f"proof.{suffix}").read_bytes().startswith(magic)


UNUSABLE = [
    ("nothing.tlog", (), "nothing.tlog: there is no such file"),
    ("empty.tlog", (), "empty.tlog: is empty"),
    ("short.tlog", ("--system", "9"), "holds no positions of system 9"),
    ("elsewhere.tlog", (), "elsewhere.tlog: is not a flight of valley.mavplan.json"),
    ("two.tlog", (), "holds several vehicles, systems 1, 2: say with --system"),
]


@pytest.mark.parametrize(("track", "args", "said"), UNUSABLE)
def test_what_cannot_be_used_is_said_with_exit_code_2(mavplan, short_flight, tmp_path, track, args, said):
    far = fly([(-3000.0, 0.0), (-3000.0, 2000.0)], [10.0, 10.0], hz=2.0)
    (tmp_path / "empty.tlog").write_bytes(b"")
    (tmp_path / "elsewhere.tlog").write_bytes(to_tlog(far))
    (tmp_path / "two.tlog").write_bytes(shortened()[1] + to_tlog(far, system=2))
    for command in (("prove",), ("replan", "-o", "rest")):
        ran = mavplan(*command, track, "--plan", "valley.plan", *args)
        assert ran.code == 2, ran.out + ran.err
        assert said in ran.err
        assert not (tmp_path / "rest").exists()


def test_a_plan_that_is_none_and_a_picture_that_is_none_are_refused(mavplan, short_flight, tmp_path):
    (tmp_path / "x.json").write_text("{}")
    ran = mavplan("prove", "short.tlog", "--plan", "x.json")
    assert (ran.code, "x.json: is no plan of mavplan" in ran.err) == (2, True)
    ran = mavplan("prove", "short.tlog", "--plan", "valley.plan", "-o", "x.gif")
    assert (ran.code, "is no picture format" in ran.err) == (2, True)


def test_the_rest_of_a_flight_is_a_scenario_that_can_be_planned_flown_and_proved(
    mavplan, valley, short_flight, tmp_path
):
    ran = mavplan("replan", "short.tlog", "--plan", "valley.plan", "-o", "rest")
    assert ran.code == 0, ran.err
    assert "3 users left, 151.2 Mbit in all" in ran.out
    rest = load_scenario(tmp_path / "rest" / "scenario.toml")
    assert rest.users.names == ("Station", "Parish hall", "Cable car")
    assert rest.users.demand_bit[2] == 90e6
    assert (rest.home, rest.radio, rest.vehicle, rest.planner) == (
        valley.scenario.home, valley.scenario.radio, valley.scenario.vehicle, valley.scenario.planner,
    )  # fmt: skip
    assert mavplan("plan", "rest/scenario.toml", "-o", "rest/rest.plan").code == 0
    again = read_plan(tmp_path / "rest" / "rest.mavplan.json")
    (tmp_path / "again.tlog").write_bytes(to_tlog(flight_of(again, hz=2.0)))
    assert mavplan("prove", "again.tlog", "--plan", "rest/rest.plan").code == 0


def test_a_pair_stays_together_where_one_of_it_is_short(mavplan, valley, tmp_path):
    holds_s = valley.hold_s.copy()
    holds_s[6] = 1.0
    (tmp_path / "x.tlog").write_bytes(to_tlog(flight_of(valley, holds_s=holds_s, hz=2.0)))
    ran = mavplan("replan", "x.tlog", "--plan", "valley.plan", "-o", "rest")
    assert ran.code == 0, ran.err
    rest = load_scenario(tmp_path / "rest" / "scenario.toml")
    assert rest.users.names == ("Valley head", "Last barn")
    assert rest.users.mate.tolist() == [1, 0]
    assert rest.d2d.matching == "given"


def test_where_nothing_is_left_nothing_is_written(mavplan, valley, tmp_path):
    (tmp_path / "x.tlog").write_bytes(to_tlog(flight_of(valley, hz=2.0)))
    ran = mavplan("replan", "x.tlog", "--plan", "valley.plan", "-o", "rest")
    assert ran.code == 0, ran.err
    assert ran.out == "all 12 users received what they need: nothing is left, nothing is written\n"
    assert not (tmp_path / "rest").exists()


def test_a_scenario_that_is_there_is_not_overwritten(mavplan, valley, short_flight, tmp_path):
    (tmp_path / "rest").mkdir()
    (tmp_path / "rest" / "users.csv").write_text("mine")
    ran = mavplan("replan", "short.tlog", "--plan", "valley.plan", "-o", "rest")
    assert ran.code == 2
    assert "is there already and is not overwritten" in ran.err
    assert (tmp_path / "rest" / "users.csv").read_text() == "mine"
    assert not (tmp_path / "rest" / "scenario.toml").exists()


def test_a_log_cut_anywhere_gives_a_verdict_or_a_reason_and_never_a_wrong_met(mavplan, valley, tmp_path):
    data = to_tlog(flight_of(valley, hz=1.0))
    for share in np.linspace(0.05, 0.9, 6):
        (tmp_path / "cut.tlog").write_bytes(data[: int(len(data) * share)])
        ran = mavplan("prove", "cut.tlog", "--plan", "valley.plan")
        assert ran.code in (2, 6)
        assert "cut.tlog: " in ran.err
