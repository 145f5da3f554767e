"""What a flight is made of: the mission, the plan beside it with its users and its energy, or neither."""

import dataclasses
import json

import pytest

from mavplan.cli.fly_setup import read_flight
from mavplan.errors import InputError
from mavplan.formats import write_mission
from mavplan.formats.beside import plan_path
from mavplan.mission.forecast import forecast_mission
from mavplan.mission.model import Command, Frame, MissionItem
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from tests.link.harness import make_mission
from tests.support import make_scenario


def planned(folder, **vehicle):
    """A plan of four users, written as mavplan plan does."""
    plan = make_plan(make_scenario([(0, 300), (50, 320), (300, 300), (0, -300)], clusters=3, **vehicle))
    path = folder / "rescue.plan"
    write_mission(plan.built.mission, path)
    plan_path(path).write_text(dumps(plan), encoding="utf-8")
    return path, plan


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_plan_beside_a_mission_tells_who_is_served_where_and_how_long_it_takes(tmp_path, autopilot):
    path, plan = planned(tmp_path, autopilot=autopilot)
    flight = read_flight(path, None, None)
    assert [stop.hold_s for stop in flight.route.stops] == plan.holds.stored_s.tolist()
    assert [stop.users for stop in flight.route.stops] == [
        tuple(
            name
            for n, name in enumerate(plan.scenario.users.names)
            if plan.trajectory.assignment.stop[n] == m
        )
        for m in range(len(plan.built.stop_items))
    ]
    assert flight.route.mission_s == pytest.approx(plan.forecast.mission_s, abs=0.1)
    assert (flight.battery_wh, flight.needed_wh) == (None, None)
    assert flight.warnings == ()


def test_battery_and_mass_give_what_the_flight_takes_with_its_reserve(tmp_path):
    path, plan = planned(tmp_path, battery_wh=100.0, mass_kg=2.0, reserve_fraction=0.2)
    flight = read_flight(path, None, None)
    assert flight.battery_wh == 100.0
    assert flight.needed_wh == pytest.approx(plan.forecast.used_wh + 20.0, abs=0.01)


def test_a_mission_alone_is_flown_without_names(tmp_path):
    path = tmp_path / "px4.plan"
    write_mission(make_mission("px4", 2), path)
    flight = read_flight(path, None, None)
    assert [stop.users for stop in flight.route.stops] == [(), ()]
    assert flight.warnings == ()
    assert flight.route.mission_s == pytest.approx(
        forecast_mission(flight.mission, rules=flight.rules).mission_s, abs=1e-6
    )


@pytest.mark.parametrize("change", ["hold", "broken"])
def test_a_plan_that_is_not_this_missions_is_a_warning_and_not_used(tmp_path, change):
    path, _ = planned(tmp_path, battery_wh=100.0, mass_kg=2.0)
    beside = plan_path(path)
    content = json.loads(beside.read_text("utf-8"))
    if change == "hold":
        content["stops"][1]["hold_s"] += 5
    else:
        content["stops"] = "none"
    beside.write_text(json.dumps(content), encoding="utf-8")
    flight = read_flight(path, None, None)
    assert all(stop.users == () for stop in flight.route.stops)
    assert flight.needed_wh is None
    assert {problem.severity for problem in flight.warnings} == {"warning"}


def test_a_mission_of_no_known_firmware_is_bad_input(tmp_path):
    path = tmp_path / "any.waypoints"
    write_mission(make_mission("px4", 2), path)
    with pytest.raises(InputError, match="--autopilot says it"):
        read_flight(path, None, None)
    assert read_flight(path, "px4", None).rules.name == "px4"


def test_a_mission_that_jumps_wants_to_be_told_how_long_to_watch(tmp_path):
    mission = make_mission("px4", 2)
    jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (2.0, 1.0, 0.0, 0.0))
    path = tmp_path / "jumps.plan"
    write_mission(dataclasses.replace(mission, items=(*mission.items[:-1], jump, mission.items[-1])), path)
    with pytest.raises(InputError, match="--timeout"):
        read_flight(path, None, None)
    assert read_flight(path, None, 600.0).route.jumps
