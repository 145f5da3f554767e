"""PX4's events: ids from names, messages from bytes, words from arguments, held against a recorded flight."""

import itertools
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.link.codec import Codec
from mavplan.link.event_messages import LAYOUTS, EventMessage, request_event
from mavplan.link.px4_events import BY_ID, MEANINGS, Event, event_id, event_words, reason_words
from tests.link.recordings import frames_of
from tests.link.script import VEHICLE
from tests.sitl_mock.rig import Rig

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
needs_captures = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here"
)
EVENT = 410
ERROR, INFO = 0x63, 0x66


def event(name="", arguments=b"", *, sequence=1, level=3, number=None):
    return Event(
        event_id(name) if number is None else number, sequence, 1.0, level, arguments.ljust(40, b"\0")
    )


def recorded_events(name):
    frames = [frame for _, frame in frames_of(CAPTURES / f"{name}.tlog")]
    return [m for frame in frames for m in Codec().decode(frame, 0.0) if m.get_type() == "EVENT"]


@pytest.mark.parametrize(("text", "fnv1a"), [("", 0x811C9DC5), ("a", 0xE40C292C), ("foobar", 0xBF9CF968)])
def test_an_id_is_the_fnv_1a_hash_of_the_name(text, fnv1a):
    """Vectors of draft-eastlake-fnv."""
    assert event_id(text) == 1 << 24 | fnv1a & 0xFF_FFFF


@needs_captures
def test_the_ids_of_a_recorded_flight_are_those_of_its_events_names():
    """From arming to disarming, in this order, once each."""
    flight = [
        "commander_armed_by",
        "mission_execute",
        "commander_takeoff_detected",
        "mission_finished_loiter",
        "rtl_land_at_destination",
        "commander_landing_detected",
        "commander_disarmed_by",
    ]
    names = {event_id(name): name for name in flight}
    found = recorded_events("px4_flight_full")
    assert [names[m.id] for m in found if m.id in names] == flight
    sequences = [m.sequence for m in found]
    assert sequences[0] == 65_526
    assert all((b - a) % 65_536 == 1 for a, b in itertools.pairwise(sequences))
    assert {(m.destination_system, m.destination_component) for m in found} == {(0, 0)}
    assert found[0].event_time_boot_ms == 204


@needs_captures
def test_no_event_of_a_recorded_flight_is_taken_for_a_reason():
    """Arming checks and health summaries are warnings and errors, too."""
    found = [
        Event(m.id, m.sequence, m.event_time_boot_ms / 1e3, m.log_levels & 15, bytes(m.arguments))
        for m in recorded_events("px4_flight_full")
    ]
    assert reason_words(found) == ()


@needs_captures
def test_every_recorded_event_is_written_back_byte_for_byte():
    frames = [f for _, f in frames_of(CAPTURES / "px4_flight_full.tlog") if f[7] | f[8] << 8 == EVENT]
    assert len(frames) == 28
    for frame in frames:
        (message,) = Codec().decode(frame, 0.0)
        again = Codec(VEHICLE).encode(message)
        assert again[10:-2] == frame[10:-2]


@needs_captures
def test_the_refused_mission_of_the_recording_is_told_with_its_reason():
    """The recording has no EVENT of it (only MISSION_CURRENT's verdict), so the mock is sent what was sent then."""
    uploads = []
    for _, frame in frames_of(CAPTURES / "px4_upload_download.tlog"):
        for message in Codec().decode(frame, 0.0):
            if message.get_type() == "MISSION_COUNT" and message.get_srcSystem() == 255:
                uploads.append([])
            elif message.get_type() == "MISSION_ITEM_INT" and message.get_srcSystem() == 255:
                uploads[-1].append(message)
    rig = Rig("px4")
    assert rig.upload(uploads[1]).type == 0
    rig.run(1.5)
    frames = [frame for frame in rig.frames if frame[7] | frame[8] << 8 == EVENT]
    (message,) = Codec().decode(frames[0], 0.0)
    words = reason_words([event(number=message.id, arguments=bytes(message.arguments))])
    assert words == ("the take-off is not the first item with a place",)
    (recorded, *_) = recorded_events("px4_flight_full")
    same = ("sequence", "destination_system", "destination_component")
    assert [getattr(message, name) for name in same] == [getattr(recorded, name) for name in same]
    assert len(frames) == 1


def test_a_spoilt_event_is_no_message_and_does_not_hide_the_next_frame():
    frame = Codec(VEHICLE).encode(EventMessage(EVENT, (event_id("x"), 5, 6, 0, 0, ERROR, bytes(40))))
    for at in range(1, len(frame)):
        spoilt = bytearray(frame)
        spoilt[at] ^= 0x40
        found = Codec().decode(bytes(spoilt) + frame * 9, 0.0)
        assert 8 <= len(found) <= 9
        assert {message.sequence for message in found} == {6}


def test_the_four_messages_travel():
    for number, layout in LAYOUTS.items():
        values = tuple(bytes(range(40)) if name == "arguments" else 7 for name in layout.fields)
        (message,) = Codec().decode(Codec(VEHICLE).encode(EventMessage(number, values)), 0.0)
        assert message.get_type() == layout.name
        assert message.get_msgId() == number
        assert tuple(getattr(message, name) for name in layout.fields) == values
    asked = request_event(VEHICLE, 65_535, 2)
    assert (asked.first_sequence, asked.last_sequence, asked.target_system) == (65_535, 2, 1)


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("navigator_mis_unsup_cmd", struct.pack("<HH", 3, 112), "item 2 is command 112, which it does not fly"),
        ("navigator_mis_takeoff_too_low", struct.pack("<f", 5.4), "the take-off is too low; it must be above 5.4 m"),
        ("navigator_mis_takeoff_too_low", b"", "the take-off is too low; it must be above 0.0 m"),
        ("navigator_mis_geofence_violation", struct.pack("<h", 2), "item 1 breaches the vehicle's geofence"),
        (
            "navigator_mis_first_wp_too_far",
            struct.pack("<II", 12_345, 10_000),
            "the first waypoint is 12,345 m away, more than 10,000 m (MIS_DIST_1WP)",
        ),
        (
            "navigator_mis_wp_gate_too_close",
            struct.pack("<ff", 0.01, 0.05),
            "a waypoint and a gate are 0.010 m apart, at least 0.050 m are needed",
        ),
    ],
)  # fmt: skip
def test_words_have_the_arguments_in_them_and_items_by_their_number_on_the_wire(name, arguments, words):
    assert event_words(event(name, arguments)) == words


@given(st.sampled_from(sorted(MEANINGS)), st.binary(max_size=40))
def test_whatever_the_arguments_are_there_are_words(name, arguments):
    said = event_words(event(name, arguments))
    assert said
    assert said.isprintable()


def test_ids_do_not_collide():
    assert len(BY_ID) == len(MEANINGS)


def test_what_decides_comes_alone_then_warnings_then_unknown_numbers():
    far = event("navigator_mis_first_wp_too_far")
    low = event("navigator_mis_takeoff_too_low")
    strange = event(number=0x01ABCDEF)
    assert reason_words([far, strange, low, low]) == (event_words(low),)
    assert reason_words([strange, far]) == (event_words(far),)
    assert reason_words([strange]) == ("it sent event 0x01abcdef, whose meaning is not known here",)
    assert reason_words([event(number=0x01ABCDEF, level=6)]) == ()
    assert reason_words([]) == ()
