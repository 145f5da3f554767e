"""ArduCopter's manners in flight, as measured: times of legs and holds, what arms it, what its modes do."""

import itertools

import pytest
from pymavlink.dialects.v20 import common as mavlink

from .pilot_rig import (
    DELAY,
    JUMP,
    LAND,
    PLANE,
    RETURN,
    UNLIM,
    PilotRig,
    Row,
    results,
    speed,
    stop,
    takeoff,
    waypoint,
)
from .rig import clear, command, item, kinds

LEGS = [
    (10, 20, 9.5),
    (10, 50, 12.8),
    (10, 100, 17.3),
    (10, 150, 22.4),
    (10, 300, 37.5),
    (5, 50, 15.2),
    (5, 150, 35.2),
    (3, 150, 54.3),
]
"""Speed in m/s, metres from stop to stop, seconds."""


def flown(*rows: Row, **options: object) -> PilotRig:
    rig = PilotRig("ardupilot", **options)
    rig.load(*rows)
    rig.start()
    rig.fly()
    return rig


@pytest.mark.parametrize(("metres_per_second", "metres", "seconds"), LEGS)
def test_a_leg_from_stop_to_stop_takes_the_measured_time(
    metres_per_second: float, metres: float, seconds: float
) -> None:
    rig = flown(takeoff(), speed(metres_per_second), stop(metres, 0, 5), RETURN)
    reached = rig.reached()
    assert reached[3] - reached[2] - 5 == pytest.approx(seconds, abs=0.3)


def test_takeoff_climb_and_return_take_the_measured_times() -> None:
    """Take-off to 30 m 18.3 s; 30 m straight up 16.2 s; return from 150 m at 30 m 65 s to disarm."""
    rig = flown(takeoff(), waypoint(0, 0, 1, height=60), waypoint(0, 0, 1), waypoint(150, 0, 1), RETURN)
    reached = rig.reached()
    assert reached[1] == pytest.approx(18.3, abs=0.3)
    assert reached[2] - reached[1] - 1 == pytest.approx(16.2, abs=0.3)
    assert reached[5] - reached[4] == pytest.approx(65, abs=1)


@pytest.mark.parametrize("seconds", [1, 8, 30])
def test_a_hold_is_exact_and_begins_when_the_leg_is_finished(seconds: int) -> None:
    """Half a metre from the place, still swinging; mean and greatest distance as measured."""
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), waypoint(100, 0), stop(100, 0, seconds), RETURN)
    rig.start()
    rig.until(lambda: 2 in rig.reached(), 0.05)
    arrived = rig.reached()[2]
    assert 0.2 < rig.off(100, 0) < 0.9
    away = []
    while 3 not in rig.reached() and rig.now < 600:
        rig.run(0.05)
        away.append(rig.off(100, 0))
    assert rig.reached()[3] - arrived == pytest.approx(seconds, abs=0.05)
    assert max(away) < 0.9
    assert sum(away) / len(away) < 0.75


def test_someone_who_watches_two_metres_sees_more_than_the_hold() -> None:
    """10.3 to 10.6 s were measured for a hold of 8 s, from the first moment within 2 m to the report."""
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(150, 0), RETURN)
    rig.start()
    rig.until(lambda: rig.off(150, 0) <= 2, 0.02)
    arrived = rig.now
    rig.until(lambda: 2 in rig.reached(), 0.02)
    assert 10.2 < rig.now - arrived < 11.1


def test_waypoint_and_loiter_at_one_place_cost_what_either_costs() -> None:
    """174.7 s each for three stops of 8 s, as measured."""
    places = [(150, 0), (150, 150), (0, 150)]
    ends = []
    for kind in range(3):
        rows = [
            [waypoint(n, e), stop(n, e)] if kind == 0 else [stop(n, e)] if kind == 1 else [waypoint(n, e, 8)]
            for n, e in places
        ]
        ends.append(max(flown(takeoff(), *itertools.chain(*rows), RETURN).reached().values()))
    assert ends == pytest.approx([174.7] * 3, abs=1.5)


def test_a_waypoint_without_hold_is_flown_through() -> None:
    """Straight on without slowing down; around a corner near its radius of 2 m, faster than stopping."""
    straight, bent, whole = (
        flown(takeoff(), *rows, stop(*end, 1), RETURN)
        for rows, end in (
            ([waypoint(100, 0)], (200, 0)),
            ([waypoint(100, 0)], (100, 100)),
            ([], (200, 0)),
        )
    )
    reached = straight.reached()
    assert max(reached.values()) == pytest.approx(max(whole.reached().values()), abs=1.0)
    corner = bent.reached()
    assert 28.0 < corner[3] - corner[1] - 1 < 34.6 - 2
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), waypoint(100, 0), stop(100, 100, 1), RETURN)
    rig.start()
    nearest = 1e9
    while 3 not in rig.reached() and rig.now < 600:
        rig.run(0.1)
        nearest = min(nearest, rig.off(100, 0))
    assert nearest < 2.3


def test_only_the_do_item_behind_an_item_is_reported() -> None:
    rig = flown(takeoff(), speed(8), stop(50, 0, 1), speed(5), stop(50, 50, 1), RETURN)
    assert list(rig.reached()) == [2, 4, 5, 6]


def test_a_change_of_speed_acts_from_the_next_leg_on_and_not_on_the_return() -> None:
    """Before take-off too; 3 m/s over 150 m take 54.3 s, the return its usual 65 s."""
    rig = flown(speed(3), takeoff(), stop(150, 0, 1), RETURN)
    reached = rig.reached()
    assert list(reached) == [1, 2, 3, 4]
    assert reached[3] - reached[2] - 1 == pytest.approx(54.3, abs=0.7)
    assert reached[4] - reached[3] == pytest.approx(65, abs=1)


def test_arming_in_auto_is_refused_and_auto_alone_stays_on_the_ground() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0), RETURN)
    assert results(rig.send(command(176, 1, 3))) == [0]
    assert results(rig.send(command(400, 1))) == [4]
    assert rig.texts()[-1] == "Arm: Auto mode not armable"
    rig.send(command(176, 1, 4))
    assert results(rig.send(command(400, 1))) == [0]
    assert results(rig.send(command(176, 1, 3))) == [0]
    rig.run(9.9)
    assert rig.state.armed
    rig.run(0.2)
    assert not rig.state.armed
    assert rig.place()[2] == 0


def test_it_cannot_be_armed_for_42_seconds_after_power_on() -> None:
    rig = PilotRig("ardupilot", boot_time_s=2.0, armable_s=42.0)
    rig.run(2.5)
    rig.send(command(176, 1, 4))
    assert results(rig.send(command(400, 1))) == [4]
    rig.run(40)
    assert results(rig.send(command(400, 1))) == [0]


def test_a_mission_without_takeoff_is_refused_when_armed_on_the_ground() -> None:
    rig = PilotRig("ardupilot")
    rig.load(stop(50, 0), RETURN)
    rig.send(command(176, 1, 4))
    rig.send(command(400, 1))
    assert results(rig.send(command(300))) == [4]
    assert "Auto: Missing Takeoff Cmd" in rig.texts()


def test_disarmed_mission_start_is_accepted_whatever_there_is() -> None:
    rig = PilotRig("ardupilot")
    assert results(rig.send(command(300))) == [0]
    rig.load(stop(50, 0), RETURN)
    assert results(rig.send(command(300))) == [0]
    assert not rig.state.armed


def test_leaving_auto_in_a_hold_and_coming_back_flies_the_whole_hold_again() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0, 20), RETURN)
    rig.start()
    rig.until(lambda: rig.now >= 30 and rig.off(50, 0) < 0.7, 0.1)
    rig.run(10)
    rig.send(command(176, 1, 17))
    rig.run(5)
    assert rig.off(50, 0) < 1
    rig.send(command(176, 1, 3))
    back = rig.now
    rig.fly()
    assert 20 <= rig.reached()[2] - back < 23  # the way back to the place comes first


def test_brake_and_guided_hold_their_place_and_loiter_sinks() -> None:
    """Nobody holds the throttle stick of the mock, so it is down."""
    for mode, sinks in ((17, False), (4, False), (5, True)):
        rig = PilotRig("ardupilot")
        rig.load(takeoff(), stop(300, 0), RETURN)
        rig.start()
        rig.run(30)
        assert results(rig.send(command(176, 1, mode))) == [0]
        rig.run(8)
        here = rig.place()
        rig.run(10)
        assert rig.off(*here[:2]) < 0.1
        assert (rig.place()[2] < here[2] - 5) == sinks
        assert rig.state.armed


def test_clearing_is_refused_in_auto_but_an_empty_upload_is_taken_and_it_hovers() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0), stop(100, 0), RETURN)
    rig.start()
    rig.run(25)
    assert kinds(rig.send(clear())) == ["ACK 1"]
    rig.clear_by_count()
    rig.run(60)
    assert list(rig.reached()) == [1, 2]
    assert rig.off(50, 0) < 1.0
    assert rig.place()[2] > 25
    assert rig.state.armed


def test_an_upload_in_flight_takes_effect_item_by_item() -> None:
    """The item being flown is flown to its end, the next one is the new one."""
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0), stop(100, 0), RETURN)
    rig.start()
    rig.run(22)
    rig.load(takeoff(), stop(0, 50), stop(0, 100, 60), RETURN)
    rig.until(lambda: 2 in rig.reached(), 0.1)
    assert rig.off(50, 0) < 1
    rig.run(40)
    assert rig.off(0, 100) < 1


def test_the_state_of_the_mission_is_told_in_mission_current() -> None:
    """1 none, 2 uploaded, 3 flown, 5 finished; the number is 0 again at the end."""
    rig = PilotRig("ardupilot")
    rig.run(1)
    rig.load(takeoff(10), stop(20, 0, 1), RETURN)
    rig.run(1)
    rig.start()
    rig.fly()
    rig.run(1)
    told = [(message.mission_state, message.seq) for _, message in rig.of("MISSION_CURRENT")]
    assert [key for key, _ in itertools.groupby(told)] == [
        (1, 0),
        (2, 0),
        (3, 1),
        (3, 2),
        (3, 3),
        (5, 0),
    ]
    assert rig.of("MISSION_CURRENT")[-1][1].total == 3


def test_nothing_is_told_unasked() -> None:
    """Only HEARTBEAT, STATUSTEXT, TIMESYNC and the items reached."""
    rig = PilotRig("ardupilot")
    rig.load(takeoff(10), stop(20, 0, 1), RETURN)
    rig.send(command(511, 33, -1), command(511, 42, -1))
    rig.heard.clear()
    rig.start()
    rig.fly()
    assert {message.get_type() for _, _, message in rig.heard} == {
        "HEARTBEAT",
        "STATUSTEXT",
        "TIMESYNC",
        "MISSION_ITEM_REACHED",
        "COMMAND_ACK",
    }


def test_land_unlimited_hold_delay_and_jump_are_flown() -> None:
    """A jump of one repeat flies two items twice; a delay waits; a landing ends disarmed; an unlimited hold stays."""
    rows = [
        takeoff(10),
        stop(20, 0, 1),
        (DELAY, 0.0, 0.0, 0.0, 3.5),
        (JUMP, 0.0, 0.0, 1.0, 2.0),
        (LAND, 20.0, 20.0, 0.0, 0.0),
    ]
    rig = flown(*rows)
    numbers = [message.seq for _, message in rig.of("MISSION_ITEM_REACHED")]
    assert numbers == [1, 2, 3, 2, 3, 5]
    assert rig.off(20, 20) < 1
    assert not rig.state.armed
    assert rig.place()[2] == 0
    stays = PilotRig("ardupilot")
    stays.load(takeoff(10), (UNLIM, 30.0, 0.0, 10.0, 0.0), RETURN)
    stays.start()
    stays.run(500)
    assert stays.off(30, 0) < 1
    assert list(stays.reached()) == [1]
    stays.send(command(20))
    stays.fly()
    assert not stays.state.armed
    assert stays.off(0, 0) < 1


def test_a_mission_is_flown_again_from_its_beginning() -> None:
    rig = flown(takeoff(10), stop(20, 0, 1), RETURN)
    rig.heard.clear()
    rig.start()
    rig.fly()
    assert list(rig.reached()) == [1, 2, 3]
    assert not rig.state.armed


def test_a_mission_outside_the_fence_is_accepted_and_turns_home_in_flight() -> None:
    """FENCE_ENABLE set and a polygon uploaded; the circle and the height are out of the way."""
    rig = PilotRig("ardupilot")
    corners = [PLANE.degrees_e7(n, e) for n, e in ((-100, -100), (60, -100), (60, 100), (-100, 100))]
    assert (
        rig.upload([item(n, 5001, 0, p1=4, x=x, y=y, kind=1) for n, (x, y) in enumerate(corners)], 1).type
        == 0
    )
    rig.pilot.parameters.put("FENCE_ENABLE", 1)
    rig.load(takeoff(), stop(150, 0), RETURN)
    rig.start()
    farthest = 0.0
    while rig.state.armed and rig.now < 300:
        rig.run(0.5)
        farthest = max(farthest, rig.place()[0])
    assert 60 < farthest < 95
    assert list(rig.reached()) == [1]
    assert rig.off(0, 0) < 1
    assert any("Polygon fence breached" in text for text in rig.texts())


def test_pause_hovers_within_auto_and_continue_flies_the_item_again() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(200, 0, 1), RETURN)
    rig.start()
    rig.run(30)
    assert results(rig.send(command(193, 0))) == [0]
    rig.run(15)
    here = rig.place()
    rig.run(20)
    assert rig.off(*here[:2]) < 0.1
    assert rig.state.custom_mode == 3
    assert results(rig.send(command(193, 1))) == [0]
    rig.fly()
    assert list(rig.reached()) == [1, 2, 3]


def test_it_goes_on_with_another_item_at_once() -> None:
    """By message and by command; an item that does not exist is refused."""
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(200, 0, 1), stop(0, 50, 1), RETURN)
    rig.start()
    rig.run(25)
    assert results(rig.send(command(224, 9))) == [4]
    assert results(rig.send(command(224, 3))) == [0]
    rig.fly()
    assert list(rig.reached()) == [1, 3, 4]


def test_set_mode_is_taken_as_a_message_too_and_an_unknown_mode_refused() -> None:
    rig = PilotRig("ardupilot")
    rig.send(mavlink.MAVLink_set_mode_message(1, 1, 4))
    assert rig.state.custom_mode == 4
    assert results(rig.send(command(176, 1, 99))) == [4]
    assert rig.state.custom_mode == 4


def test_disarming_in_flight_is_refused_unless_forced_and_then_it_falls() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(200, 0, 1), RETURN)
    rig.start()
    rig.run(30)
    assert results(rig.send(command(400, 0))) == [4]
    assert results(rig.send(command(400, 0, 21196))) == [0]
    rig.run(10)
    assert rig.place()[2] == 0
    assert not rig.state.armed


def test_a_reboot_in_the_air_brings_it_down_and_it_stands_where_it_fell() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(200, 0, 60), RETURN)
    rig.start()
    rig.run(60)
    rig.vehicle.reboot(rig.now)  # type: ignore[union-attr]
    rig.run(5)
    rig.pilot = rig.vehicle.pilot  # type: ignore[union-attr]
    assert not rig.state.armed
    assert rig.place()[2] == 0
    assert rig.off(200, 0) < 2
    rig.send(command(176, 1, 4))
    assert results(rig.send(command(400, 1))) == [4]
    rig.run(45)
    assert results(rig.send(command(400, 1))) == [0]
    assert rig.off(200, 0) < 2


def test_another_item_before_it_has_left_the_ground_is_flown_from_the_ground() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0, 1), RETURN)
    rig.start()
    rig.run(1)
    rig.send(command(224, 2))
    rig.run(60)
    assert rig.state.flying or not rig.state.armed
    assert 2 in rig.reached()


def test_a_mode_change_before_it_has_left_the_ground_breaks_the_takeoff_off() -> None:
    rig = PilotRig("ardupilot")
    rig.load(takeoff(), stop(50, 0, 1), RETURN)
    rig.start()
    rig.run(1)
    rig.send(command(176, 1, 17))
    rig.run(9)
    assert rig.place()[2] == 0
    assert rig.state.armed
    rig.run(2)
    assert not rig.state.armed


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_flight_goes_from_event_to_event(firmware: str) -> None:
    """Six minutes: a few wake-ups a second, not hundreds."""
    rig = PilotRig(firmware, battery_wh=200.0)
    rig.load(takeoff(), *(stop(20 + n, 40, 20) for n in range(15)), RETURN)
    rig.send(command(511, 33, 1e6), command(511, 42, 1e6))
    rig.start()
    wakes, began = 0, rig.now
    while rig.state.armed:
        timer = rig.vehicle.next_timer()
        assert timer is not None
        rig.vehicle.tick(timer)
        rig.vehicle.to_send()
        rig.now = timer
        wakes += 1
    assert rig.now - began > 300
    assert wakes / (rig.now - began) < 12
