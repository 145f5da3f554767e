"""The list before the start: every line by itself, all of it at once, and that nothing is sent before a yes."""

import dataclasses

import pytest

from mavplan.errors import NoLinkError, Problem, RefusedError
from mavplan.flight.phases import Phase
from mavplan.flight.preflight import Limits, battery_check, fence_check, link_loss_check, mission_check
from mavplan.flight.survey import Held
from mavplan.flight.telemetry import Telemetry
from mavplan.link.protocol import Address
from mavplan.link.verify_session import HoldsOtherError
from mavplan.mission.model import Command, Frame, MissionItem
from tests.flight.script import (
    LOITER,
    PX4_HOLD,
    battery,
    beat,
    begin,
    current,
    home_told,
    landed,
    on_the_ground,
    parameter,
    position,
)
from tests.link.harness import HOME, make_mission
from tests.link.script import text

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
MODE = {"ardupilot": LOITER, "px4": PX4_HOLD}


def checked(firmware, mission=None, **changes):
    """A session that has looked at everything, told this instead of what is good."""
    script = begin(mission or make_mission(firmware, 2))
    on_the_ground(script, firmware, MODE[firmware], until=20.0, **changes)
    return script


def verdicts(script):
    return {check.name: check.verdict for check in script.session.checks}


@BOTH
def test_a_vehicle_that_is_ready_gets_a_list_without_a_no_and_nothing_is_sent_to_it(firmware):
    script = checked(firmware)
    assert script.session.phase is Phase.READY
    assert set(verdicts(script).values()) == {"good"}
    assert list(verdicts(script)) == [
        "vehicle", "mission", "home", "position", "battery", "fence", "arming", "link loss", "end",
    ]  # fmt: skip
    script.wait(100.0)
    assert script.doings == []


@BOTH
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("vehicle", {"heartbeat": "armed"}),
        ("vehicle", {"landed": landed(2)}),
        ("home", {"home": None}),
        ("home", {"home": home_told(dataclasses.replace(HOME, lat_e7=HOME.lat_e7 + 60_000))}),
        ("home", {"home": home_told(dataclasses.replace(HOME, alt_amsl_m=HOME.alt_amsl_m - 31))}),
        ("position", {"position": None}),
        ("position", {"position": position(HOME, north_m=600.0)}),
        ("position", {"position": position(HOME, up_m=25.0)}),
        ("position", {"position": position(HOME, speed_m_s=4.0)}),
        ("position", {"position": position(dataclasses.replace(HOME, lat_e7=0, lon_e7=0))}),
        ("battery", {"battery": battery(29)}),
    ],
)
def test_each_line_refuses_by_itself(firmware, name, changes):
    if changes.get("heartbeat") == "armed":
        changes = {"heartbeat": beat(firmware, MODE[firmware], armed=True)}
    script = checked(firmware, **changes)
    assert isinstance(script.session.error, RefusedError)
    assert verdicts(script)[name] == "refused"
    assert f"{name}: " in str(script.session.error)
    assert script.doings == []


@BOTH
def test_everything_is_refused_at_once(firmware):
    script = checked(
        firmware,
        heartbeat=beat(firmware, MODE[firmware], armed=True),
        home=None,
        position=position(HOME, up_m=25.0),
        battery=battery(5),
    )
    refused = [name for name, verdict in verdicts(script).items() if verdict == "refused"]
    assert refused == ["vehicle", "home", "position", "battery"]
    assert all(f"{name}: " in str(script.session.error) for name in refused)


@BOTH
def test_a_mission_that_it_does_not_hold_is_one_line_among_others(firmware):
    script = begin(make_mission(firmware, 2))
    script.session.held = Held(HoldsOtherError("it holds something else"))
    on_the_ground(script, firmware, MODE[firmware], until=20.0, battery=battery(5))
    assert str(script.session.error) == (
        "not armed: mission: it holds something else; --upload sends it first; "
        "battery: 5 %, 16.2 V, less than 30 % (--min-battery)"
    )


def test_a_mission_that_px4_judges_not_flyable_is_refused():
    found = Problem("PX4", "holds this mission but judges it not flyable", "not-flyable", "warning")
    assert mission_check("held", (found,)).verdict == "refused"
    assert mission_check("held").verdict == "good"
    assert mission_check(None).verdict == "refused"


@BOTH
def test_what_a_vehicle_does_not_tell_of_its_battery_is_said_and_does_not_refuse(firmware):
    script = checked(firmware, battery=battery(-1))
    assert script.session.phase is Phase.READY
    assert verdicts(script)["battery"] == "warning"


@BOTH
def test_a_vehicle_that_cannot_be_armed_yet_is_a_warning_with_its_reasons(firmware):
    script = begin(make_mission(firmware, 2))
    script.wait(0.5)
    script.hear(beat(firmware, MODE[firmware]), text("PreArm: GPS not healthy"), text("something else"))
    told = battery(95, health=0)
    told.onboard_control_sensors_present = 0x1000_0000
    on_the_ground(script, firmware, MODE[firmware], until=20.0, battery=told)
    (line,) = [check for check in script.session.checks if check.name == "arming"]
    assert line.verdict == "warning"
    assert "'PreArm: GPS not healthy'" in line.words
    assert "something else" not in line.words


def telemetry(percent):
    found = Telemetry(Address(1, 1))
    found.receive(battery(percent), 0.0)
    return found


@pytest.mark.parametrize(
    ("percent", "needed_wh", "verdict"),
    [
        (100, 80.0, "good"),
        (80, 80.0, "good"),
        (79, 80.0, "refused"),
        (31, 30.9, "good"),
        (29, 1.0, "refused"),
    ],
)
def test_the_battery_is_held_against_what_the_plan_takes(percent, needed_wh, verdict):
    limits = Limits(500.0, 30.0, 30.0, battery_wh=100.0, needed_wh=needed_wh)
    assert battery_check(telemetry(percent), limits).verdict == verdict


def test_a_battery_that_only_battery_status_tells_of_counts():
    from pymavlink.dialects.v20 import common

    from tests.link.script import said

    found = telemetry(-1)
    cells = [4050] * 4 + [65535] * 6
    for percent in (60, 20):
        found.receive(
            said(common.MAVLink_battery_status_message(0, 1, 1, 32767, cells, -1, 0, -1, percent)), 1.0
        )
        assert found.battery.percent == percent
    assert battery_check(found, Limits(500.0, 30.0)).verdict == "refused"


def test_a_fence_that_would_stop_the_mission_refuses_and_one_that_is_idle_is_told():
    breach = Problem("stop 3", "lies 900 m from home", "fence-breach", "warning")
    idle = Problem("fence", "FENCE_ENABLE is 0: it does nothing", "fence-not-in-force", "warning")
    assert fence_check("in force", ("radius",), ("radius",), (breach,)).verdict == "refused"
    assert fence_check("none", (), (), (idle,)).verdict == "warning"
    assert fence_check("not told", None, (), ()).verdict == "warning"
    assert fence_check("in force: radius", ("radius",), (), ()).verdict == "good"


def test_a_radius_in_force_that_the_mission_leaves_refuses_it():
    enabled = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 7.0, "FENCE_ACTION": 1.0, "FENCE_ALT_MAX": 100.0}
    told = {name: parameter(name, value) for name, value in {**enabled, "FENCE_RADIUS": 150.0}.items()}
    script = checked("ardupilot", **told)
    assert verdicts(script)["fence"] == "refused"
    assert "FENCE_RADIUS is 150 m" in str(script.session.error)


def test_what_it_does_without_a_ground_station_is_told():
    assert link_loss_check(0.0, None).verdict == "good"
    assert link_loss_check(1.0, None).words.startswith("the vehicle breaks off its mission")
    assert link_loss_check(None, 2.0).verdict == "warning"
    assert link_loss_check(None, None).verdict == "warning"


def ending(firmware, last):
    mission = make_mission(firmware, 2)
    return dataclasses.replace(mission, items=(*mission.items[:-1], *last))


LAND = MissionItem(
    Command.NAV_LAND, Frame.GLOBAL_RELATIVE_ALT, (0, 0, 0, 0), HOME.lat_e7 + 18_000, HOME.lon_e7, 0
)
STAY = MissionItem(
    Command.NAV_LOITER_UNLIM, Frame.GLOBAL_RELATIVE_ALT, (0,) * 4, HOME.lat_e7 + 18_000, HOME.lon_e7, 30
)


@BOTH
@pytest.mark.parametrize("last", [(LAND,), (STAY,), ()])
def test_an_end_that_does_not_come_home_wants_its_own_yes(firmware, last):
    script = checked(firmware, ending(firmware, last))
    assert [check.name for check in script.session.questions()] == ["end"]
    script.session.approve(script.now)
    assert isinstance(script.session.error, RefusedError)
    assert "no yes to this was given" in str(script.session.error)
    script.wait(60.0)
    assert script.doings == []
    other = checked(firmware, ending(firmware, last))
    other.session.approve(other.now, every_question=True)
    assert other.session.phase is Phase.REWINDING


@BOTH
def test_the_list_is_looked_at_once_more_after_the_yes(firmware):
    script = checked(firmware)
    script.hear(beat(firmware, MODE[firmware], armed=True))
    script.session.approve(script.now)
    script.wait(60.0)
    assert "is armed already" in str(script.session.error)
    assert script.doings == []


@BOTH
def test_a_vehicle_that_was_not_heard_lately_is_not_started(firmware):
    script = checked(firmware)
    script.wait(script.now + 6.0)
    script.session.approve(script.now)
    assert "is not heard for" in str(script.session.error)
    assert script.doings == []


@BOTH
def test_a_link_that_is_lost_before_the_yes_is_no_link(firmware):
    script = checked(firmware)
    script.wait(60.0)
    assert isinstance(script.session.error, NoLinkError)
    assert "it was not armed" in str(script.session.error)


@BOTH
def test_a_vehicle_that_tells_nothing_is_refused_and_not_waited_for_for_ever(firmware):
    script = begin(make_mission(firmware, 2))
    script.hear(beat(firmware, MODE[firmware]))
    for second in range(1, 25):
        script.hear_at(float(second), beat(firmware, MODE[firmware]))
    assert verdicts(script)["home"] == verdicts(script)["position"] == "refused"
    assert script.now < 25.1


def test_another_firmware_than_the_missions_is_refused():
    script = begin(make_mission("px4", 2))
    script.hear(beat("ardupilot", LOITER), current(0, 2))
    script.wait(3.0)
    assert isinstance(script.session.error, RefusedError)
    assert "the mission is for PX4" in str(script.session.error)
