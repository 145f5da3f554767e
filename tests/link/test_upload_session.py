"""From a mission to a verified upload against the mock, on a virtual clock; each test named after what happens."""

import dataclasses

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import InputError, NoLinkError, RefusedError, UncertainError
from mavplan.link.codec import Codec
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Address
from mavplan.link.report import DiffersError
from mavplan.link.upload_session import UploadSession
from mavplan.link.verdict import Judgement
from mavplan.mission.model import Command, Frame, MissionItem
from tests.link.harness import HOME, make_mission, make_network, run, settle, upload

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


@BOTH
def test_a_quiet_line_stores_and_verifies(firmware):
    mission, network = make_mission(firmware), make_network(firmware)
    result = upload(mission, network)
    assert result.verified
    assert result.holds(mission)
    report = result.session.report
    assert (report.items, report.uploads, report.read_backs) == (23 + (firmware == "ardupilot"), 1, 1)
    assert report.judgement is (Judgement.FLYABLE if firmware == "px4" else None)
    assert (report.opaque_id is None) == (firmware == "ardupilot")


@BOTH
@pytest.mark.parametrize(
    "faults",
    [
        "drop=0.3",
        "dup=0.5",
        "reorder=0.5",
        "drop=0.2,dup=0.2,reorder=0.2,corrupt=0.05",
        "first-lost",
        "ack-lost",
        "ack-lost=1",
        "early-ack",
        "delay=300ms",
        "delay=50ms,jitter=200ms",
        "reboot-at=5",
        "reboot-at=2s",
        "second-gcs=read",
    ],
)
def test_a_bad_radio_a_restart_or_another_station_and_still_verified(firmware, faults):
    mission, network = make_mission(firmware), make_network(firmware, faults, seed=3)
    result = upload(mission, network)
    assert result.verified, result.error
    assert result.holds(mission)


@BOTH
def test_nothing_is_said_before_a_vehicle_is_heard_but_heartbeats(firmware):
    result = upload(make_mission(firmware), make_network(firmware, "no-heartbeat"))
    assert isinstance(result.error, NoLinkError)
    assert result.ended_s == pytest.approx(15.0)
    kinds = {message.get_type() for _, frame in result.sent for message in Codec().decode(frame, 0.0)}
    assert kinds == {"HEARTBEAT", "TIMESYNC"}


@BOTH
def test_the_vehicle_dies_in_the_middle_and_that_is_uncertain_in_one_sentence(firmware):
    result = upload(make_mission(firmware), make_network(firmware, "silent-after=7"), deadline_s=12.0)
    assert isinstance(result.error, UncertainError)
    assert result.ended_s <= 12.0
    said = str(result.error)
    assert "had asked for 8 of" in said
    assert ("mixture" in said) == (firmware == "ardupilot")
    assert "\n" not in said


def test_a_vehicle_that_is_gone_for_30_s_is_not_waited_for_longer():
    result = upload(make_mission("px4"), make_network("px4", "silent-after=7"), deadline_s=600.0)
    assert isinstance(result.error, UncertainError)
    assert result.ended_s < 35.0


@BOTH
def test_the_vehicle_stores_something_else_and_stays_by_it_uncertain_with_the_difference(firmware):
    result = upload(make_mission(firmware), make_network(firmware, "alter=3"))
    assert isinstance(result.error, DiffersError)
    assert [(found.seq, found.field) for found in result.error.differences] == [(3, "x")]
    assert result.session._upload.attempts == 2


def test_ardupilot_has_no_room_both_numbers_are_told_and_the_old_mission_is_kept():
    network = make_network("ardupilot", capacity=20)
    old = make_mission("ardupilot", 2)
    assert upload(old, network).verified
    result = upload(make_mission("ardupilot", 10), network)
    assert isinstance(result.error, RefusedError)
    assert "room for 20 items, this mission has 24" in str(result.error)
    assert "keeps its old mission of 8 items" in str(result.error)
    assert result.holds(old)


def test_px4_has_no_room_and_keeps_the_old_mission():
    network = make_network("px4", capacity=20)
    assert upload(make_mission("px4", 2), network).verified
    result = upload(make_mission("px4", 10), network)
    assert isinstance(result.error, RefusedError)
    assert "no room for the 23 items" in str(result.error)
    assert "keeps its old mission of 7 items" in str(result.error)


def refuse_item_3(network, monkeypatch):
    """Let item 3 arrive as a command that no firmware knows, so that the mock refuses it as the firmware does."""
    missions = network.autopilot._missions
    taken = missions.on_item

    def on_item(sender, found, kind, now, *, as_int):
        unknown = dataclasses.replace(found, command=60_000) if found.seq == 3 else found
        return taken(sender, unknown, kind, now, as_int=as_int)

    monkeypatch.setattr(missions, "on_item", on_item)


def test_ardupilot_refuses_an_item_and_the_mixture_is_told(monkeypatch):
    network = make_network("ardupilot")
    assert upload(make_mission("ardupilot", 4, hold_s=99.0), network).verified
    refuse_item_3(network, monkeypatch)
    mission = make_mission("ardupilot", 4)
    result = upload(mission, network)
    assert isinstance(result.error, DiffersError)
    assert "refused item 3 (NAV_WAYPOINT)" in str(result.error)
    assert "do not fly it" in str(result.error)
    assert not result.holds(mission)


def test_px4_refuses_an_item_and_keeps_the_old_mission(monkeypatch):
    network, old = make_network("px4"), make_mission("px4", 1)
    assert upload(old, network).verified
    refuse_item_3(network, monkeypatch)
    result = upload(make_mission("px4", 3), network)
    assert isinstance(result.error, RefusedError)
    assert "refused item 3" in str(result.error)
    assert "keeps its old mission of 5 items" in str(result.error)
    assert result.holds(old)


def test_px4_stores_but_judges_infeasible_is_refused_after_the_read_back():
    """A take-off below home: stored with ACK 0, found unfit a second later."""
    mission = make_mission("px4", 1)
    takeoff = dataclasses.replace(mission.items[0], frame=int(Frame.GLOBAL), alt_m=20.0)
    mission = dataclasses.replace(mission, items=(takeoff, *mission.items[1:]))
    network = make_network("px4", home=(37.4, -122.1, 500.0))
    session = UploadSession(mission, now=network.clock_s, deadline_s=60.0, max_home_height_m=1_000.0)
    result = run(session, network)
    assert isinstance(result.error, RefusedError)
    assert "judges the mission not flyable" in str(result.error)
    assert result.holds(mission)


@BOTH
def test_another_station_writes_after_us_and_that_is_uncertain_not_fought_over(firmware):
    result = upload(make_mission(firmware), make_network(firmware, "second-gcs=upload"))
    assert isinstance(result.error, DiffersError)
    assert "another ground station has written to the vehicle" in str(result.error)
    assert result.session._upload.attempts == 1
    assert len(result.network.stored(0)) == 3


def test_another_station_that_never_ends_is_refused_as_never_started():
    result = upload(make_mission("ardupilot", 1), make_network("ardupilot", "nack=DENIED"), deadline_s=20.0)
    assert isinstance(result.error, RefusedError)
    assert "nothing of it was taken" in str(result.error)


@BOTH
def test_a_vehicle_that_never_answers_the_count_is_uncertain(firmware):
    result = upload(make_mission(firmware, 1), make_network(firmware, "silent-after=1s"), deadline_s=10.0)
    assert isinstance(result.error, UncertainError)


def test_a_booting_ardupilot_without_space_yet_is_waited_for():
    mission, network = make_mission("ardupilot", 1), make_network("ardupilot", boot_time_s=6.0)
    result = upload(mission, network)
    assert result.verified, result.error
    assert result.session._upload.put_off_by == 4


@pytest.mark.parametrize(("mission_for", "vehicle"), [("ardupilot", "px4"), ("px4", "ardupilot")])
def test_a_mission_for_the_other_firmware_is_refused_and_nothing_sent(mission_for, vehicle):
    result = upload(make_mission(mission_for, 1), make_network(vehicle))
    assert isinstance(result.error, RefusedError)
    assert "nothing was sent" in str(result.error)
    assert not [
        1
        for _, frame in result.sent
        for m in Codec().decode(frame, 0.0)
        if m.get_type().startswith("MISSION")
    ]


def test_a_mission_that_does_not_say_its_firmware_is_sent_by_the_vehicles_rules():
    mission = dataclasses.replace(make_mission("ardupilot", 1), autopilot=None)
    result = upload(mission, make_network("ardupilot"))
    assert result.verified
    assert result.session.items[0].command == Command.NAV_WAYPOINT


def test_what_the_vehicle_would_change_is_bad_input_and_nothing_sent():
    mission = make_mission("ardupilot", 1)
    item = MissionItem(
        Command.NAV_LOITER_TIME, Frame.GLOBAL_RELATIVE_ALT, (7.6, 0, 0, 0), 374_000_000, 1, 30.0
    )
    network = make_network("ardupilot")
    result = upload(dataclasses.replace(mission, items=(*mission.items, item)), network)
    assert isinstance(result.error, InputError)
    assert network.stored(0) == ()


def test_an_armed_vehicle_is_not_written_to_unless_allowed():
    network = make_network("ardupilot")
    network.autopilot.vehicle.armed = True
    network.autopilot.vehicle.base_mode |= 0x80
    mission = make_mission("ardupilot", 1)
    result = upload(mission, network)
    assert isinstance(result.error, RefusedError)
    assert "armed" in str(result.error)
    session = UploadSession(mission, now=network.clock_s, deadline_s=60.0, allow_armed=True)
    assert run(session, network).verified


def test_the_second_of_two_vehicles_is_taken_when_chosen():
    network = make_network("ardupilot", system_id=7)
    assert upload(make_mission("ardupilot", 1), network, system=7).session.report.vehicle == Address(7, 1)
    assert isinstance(upload(make_mission("ardupilot", 1), network, system=8).error, NoLinkError)


def test_a_count_of_ours_that_comes_late_does_not_leave_a_truncated_mission_called_verified():
    """The one message that can undo a finished upload: a copy of the count that was held up on its way."""
    mission, network = make_mission("ardupilot", 0), make_network("ardupilot")
    session = UploadSession(mission, now=100.0, deadline_s=60.0)
    copies = []
    straight = network.receive

    def receive(data, sender, now):
        if Codec().decode(data, 0.0)[0].get_type() == "MISSION_COUNT" and not copies:
            copies.append((now + 0.7, data))
        while copies and now >= copies[0][0]:
            straight(copies.pop()[1], sender, now)
            copies.append((float("inf"), b""))
        straight(data, sender, now)

    network.receive = receive
    result = run(session, network)
    settle(network)
    assert result.verified
    assert result.holds(mission)


def test_progress_tells_the_phases_in_order():
    session = UploadSession(make_mission("ardupilot", 1), now=100.0, deadline_s=60.0)
    network = make_network("ardupilot")
    steps: list[Progress] = []
    plain_tick = session.tick

    def tick(now):
        plain_tick(now)
        steps.extend(session.events())

    session.tick = tick
    run(session, network)
    phases = list(dict.fromkeys(step.phase for step in steps))
    assert phases == ["connecting", "uploading", "reading back", "fence in force?"]
    assert max(step.done for step in steps if step.phase == "reading back") == 6


def test_interrupted_in_the_middle_says_what_is_known():
    session = UploadSession(make_mission("ardupilot", 5), now=0.0, deadline_s=60.0, system=1)
    vehicle = Codec(Address(1, 1))
    home = common.MAVLink_home_position_message(
        HOME.lat_e7, HOME.lon_e7, 10_000, 0, 0, 0, [1.0, 0.0, 0.0, 0.0], 0, 0, 0
    )
    for said in (common.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3), home):
        session.receive(Codec().decode(vehicle.encode(said), 0.0)[0], 0.0)
    session.interrupt(1.0)
    assert isinstance(session.error, UncertainError)
    assert str(session.error).startswith("interrupted")


def test_interrupted_before_a_vehicle_was_found_is_nothing_to_report():
    session = UploadSession(make_mission("ardupilot", 5), now=0.0, deadline_s=60.0)
    session.interrupt(1.0)
    assert not session.done
