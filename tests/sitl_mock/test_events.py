"""PX4's events: why a mission cannot be flown, numbers and repeats."""

import struct
from pathlib import Path
from typing import Any

import pytest

from sitl_mock.events import FORMATS, REQUEST, EventBuffer, EventMessage, event_id
from sitl_mock.signing import make_signing
from sitl_mock.wire import Encoder, Parser

from .rig import Rig, clear, good_mission, heartbeat, item
from .test_recordings import messages, recorded

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
ERROR, UNSUPPORTED = 0x63, 0x43


@pytest.fixture
def rig() -> Rig:
    return Rig("px4")


def events(rig: Rig, seconds: float = 1.4) -> list[tuple[int, int, int, bytes]]:
    """Id, number, levels and arguments of each event to the station in the next seconds."""
    said = rig.run(seconds)
    return [
        (m.id, m.sequence, m.log_levels, m.arguments.rstrip(b"\0"))
        for _, m in said
        if m.get_type() == "EVENT"
    ]


def ask(first: int, last: int, system: int = 1) -> Any:
    return EventMessage(REQUEST, (first, last, system, 1))


@pytest.mark.skipif(not CAPTURES.is_dir(), reason=f"no recordings of real autopilots at {CAPTURES}")
def test_ids_and_payloads_are_as_recorded() -> None:
    """The landing of the recorded flight: the mock's event of that name, number and time has the same payload."""
    landed = [
        (m, frame)
        for _, m, frame in messages(recorded("px4_flight_full"))
        if m.get_type() == "EVENT" and m.id == event_id("commander_landing_detected")
    ]
    ((message, frame),) = landed
    buffer = EventBuffer()
    while (made := buffer.add("commander_landing_detected", 0x66, b"", 0.0)).sequence != message.sequence:
        pass
    made.event_time_boot_ms = message.event_time_boot_ms
    assert Encoder(1, 1).encode(made)[10:-2] == frame[10:-2]


@pytest.mark.parametrize(
    ("bad", "name", "levels", "arguments"),
    [
        ([item(0, 16), item(1, 22)], "navigator_mis_takeoff_not_first", ERROR, b""),
        ([item(0, 22, z=0.0), item(1)], "navigator_mis_takeoff_too_low", ERROR, struct.pack("<f", 0.0)),
        ([item(0, 22, 0, z=9.0), item(1)], "navigator_mis_takeoff_too_low", ERROR, struct.pack("<f", 10.0)),
        ([item(0, 21), item(1)], "navigator_mis_starts_w_landing", ERROR, b""),
        (
            [item(0, 22), item(1, 112, 2, p1=1.0)],
            "navigator_mis_unsup_cmd",
            UNSUPPORTED,
            struct.pack("<HH", 2, 112),
        ),
    ],
)
def test_an_infeasible_mission_is_told_in_an_event(
    rig: Rig, bad: list[Any], name: str, levels: int, arguments: bytes
) -> None:
    """One event after the ACK; its number is the first one after 65,525."""
    rig.upload(bad)
    assert events(rig) == [(event_id(name), 65_526, levels, arguments.rstrip(b"\0"))]


def test_each_thing_that_is_wrong_has_an_event_of_its_own(rig: Rig) -> None:
    """A low take-off, a command that is not flown, and a fence that is breached."""
    rig.send(heartbeat())
    rig.upload([item(0, 5003, 5, p1=50.0, x=375_000_000, kind=1)], 1)
    rig.upload([item(0, 22, z=0.0), item(1), item(2, 112, 2, p1=1.0)])
    names = ("navigator_mis_takeoff_too_low", "navigator_mis_unsup_cmd", "navigator_mis_geofence_violation")
    assert [found[0] for found in events(rig)] == [event_id(name) for name in names]


def test_a_feasible_mission_has_none(rig: Rig) -> None:
    """Nor has one that is sent again, for it is not judged again."""
    rig.upload(good_mission("px4"))
    assert events(rig) == []
    bad = [item(0, 22, z=0.0), item(1)]
    rig.upload(bad)
    assert len(events(rig)) == 1
    rig.upload(bad)
    assert events(rig) == []
    rig.send(clear())
    assert events(rig) == []


def test_the_last_number_is_told_at_the_first_heartbeat_and_every_three_seconds(rig: Rig) -> None:
    """Flag 1 says that there was no event yet."""
    rig.send(heartbeat())
    told = [m for _, _, m in rig.heard if m.get_type() == "CURRENT_EVENT_SEQUENCE"]
    assert [(m.sequence, m.flags) for m in told] == [(65_525, 1)]
    rig.upload([item(0, 22, z=0.0), item(1)])
    said = [(round(at), m) for at, m in rig.run(9.5, telemetry=True) if m.get_type().startswith("CURRENT_E")]
    assert [at for at, _ in said] == [3, 6, 9]
    assert [(m.sequence, m.flags) for _, m in said] == [(65_526, 0)] * 3


def test_events_are_sent_again_where_they_are_asked_for(rig: Rig) -> None:
    """Each to everybody; of one that is not kept the vehicle says which is the oldest that is."""
    rig.upload([item(0, 22, z=0.0), item(1)])
    rig.run(1.0)
    (event,) = rig.send(ask(65_526, 65_526))
    assert (event.get_type(), event.id) == ("EVENT", event_id("navigator_mis_takeoff_too_low"))
    assert (event.destination_system, event.destination_component) == (0, 0)
    gone, again = rig.send(ask(65_525, 65_526))
    assert gone.get_type() == "RESPONSE_EVENT_ERROR"
    assert (gone.sequence, gone.sequence_oldest_available, gone.target_system) == (65_525, 65_526, 255)
    assert again.sequence == 65_526
    assert rig.send(ask(65_526, 65_526, system=2)) == []


def test_twenty_are_kept_and_a_longer_request_is_answered_by_its_end() -> None:
    """As PX4's buffer does."""
    buffer = EventBuffer()
    for _ in range(30):
        buffer.add("x", ERROR, b"", 1.0)
    latest = buffer.current().sequence
    assert latest == (65_525 + 30) % 65_536
    answers = buffer.answer(65_526, latest, 255, 190)
    assert [a.get_type() for a in answers] == ["RESPONSE_EVENT_ERROR"] + ["EVENT"] * 20
    assert answers[0].sequence_oldest_available == answers[1].sequence


def test_after_a_reboot_the_numbers_begin_anew(rig: Rig) -> None:
    """And the mission is judged again."""
    rig.upload([item(0, 22, z=0.0), item(1)])
    rig.run(1.0)
    rig.vehicle.reboot(rig.now)
    rig.run(1.5)
    rig.send(heartbeat())
    (event,) = rig.send(ask(65_526, 65_526))
    assert event.event_time_boot_ms < 2_000


def test_ardupilot_has_no_events() -> None:
    """It answers no request for one."""
    rig = Rig("ardupilot")
    rig.send(heartbeat())
    assert rig.send(ask(1, 5)) == []
    assert not [m for _, m in rig.run(7.0, telemetry=True) if m.get_type() == "CURRENT_EVENT_SEQUENCE"]


def test_with_a_key_an_event_is_believed_only_with_its_signature() -> None:
    """Its messages are none of pymavlink's, which checks signatures itself."""
    key = bytes(range(32))
    unsigned = Encoder(1, 1).encode(ask(1, 2))
    signed = Encoder(1, 1, make_signing(key, 1_000)).encode(ask(1, 2))
    other = Encoder(1, 1, make_signing(bytes(32), 1_000)).encode(ask(1, 2))
    read = [len(Parser(make_signing(key, 0)).feed(frame)) for frame in (unsigned, signed, other)]
    assert read == [0, 1, 0]


def test_every_field_travels_and_a_wrong_byte_is_no_message() -> None:
    """Of all four messages."""
    for number, (name, _, _, fields) in FORMATS.items():
        values = tuple(bytes(range(40)) if field == "arguments" else 5 for field in fields.split())
        frame = Encoder(1, 1).encode(EventMessage(number, values))
        (message,) = Parser().feed(frame)
        assert message.get_type() == name
        assert tuple(getattr(message, field) for field in fields.split()) == values
        spoilt = frame[:12] + bytes([frame[12] ^ 1]) + frame[13:]
        assert Parser().feed(spoilt) == []
