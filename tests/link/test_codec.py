"""Bytes to messages on a link that cuts, corrupts and mixes."""

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from mavplan.link.codec import Codec
from mavplan.link.protocol import GROUND, Address, mission_count, mission_request, opaque_id, sender
from tests.link.recordings import frames_of, messages_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
needs_captures = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here"
)
TO = Address(1, 1)


def frames(number=5):
    codec = Codec(Address(1, 1))
    return [codec.encode(mission_request(GROUND, seq, 0)) for seq in range(number)]


def seqs(messages):
    return [message.seq for message in messages if message.get_type() == "MISSION_REQUEST_INT"]


def test_we_speak_mavlink_2_as_system_255_component_190_with_running_numbers():
    codec = Codec()
    first, second = (codec.encode(mission_count(TO, 3, 1)) for _ in range(2))
    assert (first[0], first[4], second[4], first[5], first[6]) == (0xFD, 0, 1, 255, 190)
    (message,) = Codec().decode(first, 0.0)
    assert (message.count, message.mission_type, sender(message)) == (3, 1, GROUND)


@given(st.lists(st.integers(0, 200), max_size=10))
def test_messages_come_out_whole_wherever_the_bytes_are_cut(cuts):
    stream = b"".join(frames())
    edges = sorted({min(cut, len(stream)) for cut in cuts} | {0, len(stream)})
    codec = Codec()
    found = []
    for start, end in itertools.pairwise(edges):
        found += codec.decode(stream[start:end], 0.0)
    assert seqs(found) == [0, 1, 2, 3, 4]
    assert codec.bad == 0


@given(st.data())
@settings(max_examples=300)
def test_a_wrong_byte_costs_only_the_frame_it_is_in(data):
    parts = frames()
    spoilt = data.draw(st.integers(0, 4))
    at = data.draw(st.integers(0, len(parts[spoilt]) - 1))
    wrong = bytearray(parts[spoilt])
    wrong[at] ^= data.draw(st.integers(1, 255))
    parts[spoilt] = bytes(wrong)
    codec = Codec()
    found = codec.decode(b"".join(parts), 0.0)
    found += codec.decode(b"".join(frames()) * 20, 1.0)
    rest = [seq for seq in range(5) if seq != spoilt]
    assert seqs(found)[: len(rest)] == rest


@given(st.binary(max_size=600))
def test_noise_gives_no_message_and_does_not_hide_the_next_frame(noise):
    codec = Codec()
    codec.decode(noise, 0.0)
    found = codec.decode(frames(1)[0], 10.0)
    found += codec.decode(frames(1)[0] * 30, 20.0)
    assert 0 in seqs(found)


def test_a_false_beginning_that_ends_with_a_good_frame_does_not_swallow_it():
    """Six bytes as of a message nobody knows, whose length is just that of the frame behind them."""
    good = frames(1)[0]
    for before in (
        bytes([0xFE, len(good) - 2, 0, 0, 0, 94]),
        bytes([0xFD, len(good) - 2, 0, 0, 1, 1, 1, 0, 0, 9]),
    ):
        for after in (b"", good):
            assert len(seqs(Codec().decode(before + good + after, 0.0))) == 1 + bool(after), before


def test_an_unfinished_frame_is_given_up_after_half_a_second():
    codec = Codec()
    assert codec.decode(bytes([0xFD, 200, 0, 0, 9]), 0.0) == []
    assert codec.decode(frames(1)[0], 0.1) == []  # as far as one can tell, the rest of the first
    assert seqs(codec.decode(b"", 0.7)) == [0]
    assert codec.bad


def test_mavlink_1_is_understood_too():
    old = common.MAVLink(None, srcSystem=1, srcComponent=1)
    frame = common.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3).pack(old, force_mavlink1=True)
    assert [message.get_type() for message in Codec().decode(bytes(frame), 0.0)] == ["HEARTBEAT"]


def test_messages_the_dialect_does_not_know_are_left_out_without_harm():
    event = bytes.fromhex(
        "fd0e000005010 19a0100ef5b1201cc000000f6ff000066ea070b16061820c155".replace(" ", "")
    )
    assert seqs(Codec().decode(event + frames(1)[0], 0.0)) == [0]


@needs_captures
@pytest.mark.parametrize(
    "path", sorted(CAPTURES.glob("*.tlog")) if CAPTURES.is_dir() else [], ids=lambda path: path.stem
)
def test_every_frame_of_a_real_autopilot_is_read_also_as_one_stream(path):
    parts = [frame for _, frame in frames_of(path)]
    codec = Codec()
    found = codec.decode(b"".join(parts), 0.0)
    assert codec.bad == 0
    assert [str(message) for message in found] == [str(message) for message in messages_of(path)]


@needs_captures
def test_px4s_mission_id_is_read_where_pymavlink_does_not_decode_it():
    said = {}
    for message in messages_of(CAPTURES / "px4_upload_download.tlog"):
        if (
            message.get_type() in {"MISSION_ACK", "MISSION_COUNT", "MISSION_CURRENT"}
            and message.get_srcSystem() == 1
        ):
            said.setdefault(message.get_type(), []).append(opaque_id(message))
    # the first ACK, the count of the read-back and the MISSION_CURRENT after it speak of one mission
    assert said["MISSION_ACK"][0] == said["MISSION_COUNT"][0] == said["MISSION_CURRENT"][2] == 0x50ECAEB4
    assert said["MISSION_ACK"][-1] is None  # a refusal has none


@needs_captures
def test_ardupilot_has_no_mission_id():
    acks = [
        m for m in messages_of(CAPTURES / "ardupilot_upload_download.tlog") if m.get_type() == "MISSION_ACK"
    ]
    assert {opaque_id(message) for message in acks} == {None}
