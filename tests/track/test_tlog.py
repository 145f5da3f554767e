"""The ``.tlog`` format: what is written is what others read, and a damaged log gives its good frames."""

import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from mavplan.track.tlog import TlogFrames, record
from tests.link.recordings import frames_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
START_US = 1_700_000_000_000_000


def frame(number, system=1, version=2):
    """A position as a vehicle sends it, told from others by its time."""
    mavlink = common.MAVLink(None, srcSystem=system, srcComponent=1)
    message = mavlink.global_position_int_encode(number * 200, 474_000_000, 85_000_000, 0, 1000, 0, 0, 0, 0)
    return bytes(message.pack(mavlink, force_mavlink1=version == 1))


def log(count=5):
    """Records of so many positions, 0.2 s apart."""
    return [record(START_US + number * 200_000, frame(number)) for number in range(count)]


def times(data):
    """When the good frames of a log came, in its microseconds from the first."""
    return [found.time_us - START_US for found in TlogFrames(data)]


def test_what_is_recorded_is_what_pymavlink_reads(tmp_path):
    path = tmp_path / "flight.tlog"
    path.write_bytes(b"".join(log()))
    reader = mavutil.mavlink_connection(str(path))
    read = [reader.recv_match() for _ in range(5)]
    assert [message.time_boot_ms for message in read] == [0, 200, 400, 600, 800]
    assert [round((message._timestamp - START_US / 1e6) * 1e3) for message in read] == [0, 200, 400, 600, 800]
    assert reader.recv_match() is None


def test_a_frame_comes_back_as_it_was_recorded():
    (found,) = TlogFrames(record(START_US, frame(3, system=7)))
    assert (found.time_us, found.message_id, found.system, found.component) == (START_US, 33, 7, 1)
    assert frame(3, system=7)[10:-2] == found.payload


def test_mavlink_1_and_signed_frames_are_read():
    signing = common.MAVLink(None, srcSystem=1, srcComponent=1)
    signing.signing.secret_key = bytes(32)
    signing.signing.sign_outgoing = True
    signed = bytes(signing.heartbeat_encode(2, 3, 0, 0, 0).pack(signing))
    assert signed[2] & 1
    data = record(START_US, frame(1, version=1)) + record(START_US + 1, signed) + log(3)[2]
    assert [found.message_id for found in TlogFrames(data)] == [33, 0, 33]


@pytest.mark.skipif(not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here")
def test_every_recorded_frame_is_found_but_those_of_unknown_messages():
    for path in sorted(CAPTURES.glob("*.tlog")):
        known = [
            raw for _, raw in frames_of(path) if int.from_bytes(raw[7:10], "little") in common.mavlink_map
        ]
        reader = TlogFrames(path.read_bytes())
        assert len(list(reader)) == len(known) > 0
        assert (reader.losses.skipped_bytes, reader.losses.cut_bytes) == (0, 0)


def test_a_cut_end_costs_only_the_cut_record():
    whole = b"".join(log())
    for cut in range(1, len(log()[4])):
        reader = TlogFrames(whole[:-cut])
        assert len(list(reader)) == 4
        assert reader.losses.cut_bytes == len(log()[4]) - cut
        assert reader.losses.skipped_bytes == 0


def test_garbage_between_records_costs_no_record():
    records = log()
    for garbage in (
        b"\x00" * 300,
        bytes(range(256)),
        b"\xfd" * 500,
        b"\xfe\xfd" * 100,
        frame(9),
        frame(9)[:-3],
    ):
        reader = TlogFrames(records[0] + garbage + b"".join(records[1:]))
        found = [one.time_us - START_US for one in reader]
        assert [when for when in found if when in range(0, 1_000_000, 200_000)] == list(
            range(0, 1_000_000, 200_000)
        )
        assert reader.losses.stretches <= 1


def test_a_damaged_record_costs_itself():
    records = log()
    for at in range(8, len(records[2])):
        broken = bytearray(records[2])
        broken[at] ^= 0x55
        reader = TlogFrames(records[0] + records[1] + bytes(broken) + records[3] + records[4])
        assert [one.time_us - START_US for one in reader] == [0, 200_000, 600_000, 800_000]
        # A damaged number may be that of a message nobody knows: such a frame is stepped over without a word.
        assert reader.losses.skipped_bytes in (0, len(broken))


def test_a_damaged_length_near_the_end_hides_no_good_record():
    records = log()
    broken = bytearray(records[3])
    broken[9] = 255
    assert times(records[0] + bytes(broken) + records[4]) == [0, 800_000]


def test_many_markers_without_a_frame_take_a_moment():
    began = time.perf_counter()
    for garbage in (b"\xfd" * 200_000, b"\xfe" * 200_000, b"\xfd" + bytes(1_000_000)):
        assert not list(TlogFrames(garbage))
    assert time.perf_counter() - began < 10


@settings(max_examples=80)
@given(st.binary(max_size=300), st.integers(0, 4), st.binary(max_size=40))
def test_any_bytes_before_a_record_leave_the_others_alone(garbage, place, tail):
    records = log()
    data = b"".join(records[:place]) + garbage + b"".join(records[place:]) + tail
    reader = TlogFrames(data)
    found = {one.time_us - START_US for one in reader if one.message_id == 33}
    # Garbage may by chance claim the record behind it (an unknown message), never those before it.
    assert set(range(0, place * 200_000, 200_000)) <= found
    assert len(found & set(range(0, 1_000_000, 200_000))) >= 5 - 2
    assert (
        reader.losses.skipped_bytes + reader.losses.cut_bytes
        <= len(garbage) + len(tail) + len(records[0]) * 2
    )
