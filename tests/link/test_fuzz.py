"""A radio that forges: bytes cut, doubled, swapped and changed, and frames whose fields lie under a good checksum.

Neither the sessions nor the mock vehicle may crash, hang, raise anything but their own typed errors, or keep what they
cannot use. What a session claims is not asked here: a liar with good checksums can make it believe anything.
"""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from mavplan.errors import MavplanError
from mavplan.link.clear_session import ClearSession
from mavplan.link.codec import Codec
from mavplan.link.download_session import DownloadSession
from mavplan.link.info_session import InfoSession
from mavplan.link.protocol import heartbeat
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession
from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.wire import Parser, frame_size, message_id
from tests.link.fenced import fenced
from tests.link.harness import HOME, LINK, Radio, make_mission, make_network, run, settle, upload
from tests.link.script import VEHICLE, said

DEADLINE_S = 40.0
LARGEST_FRAME = 280
WORKS = {
    "upload": lambda now, firmware: UploadSession(fenced(firmware, 2), now=now, deadline_s=DEADLINE_S),
    "verify": lambda now, firmware: VerifySession(make_mission(firmware, 2), now=now, deadline_s=DEADLINE_S),
    "download": lambda now, firmware: DownloadSession(now=now, deadline_s=DEADLINE_S),
    "clear": lambda now, firmware: ClearSession((0, 1, 2), now=now, deadline_s=DEADLINE_S),
    "info": lambda now, firmware: InfoSession(now=now, deadline_s=DEADLINE_S),
}
FIRMWARE = st.sampled_from(["ardupilot", "px4"])


def forged(frame: bytes, chance: random.Random) -> bytes:
    """The same kind of frame with other fields (or of another sender) and the checksum to match."""
    kind = message_id(frame)
    known = common.mavlink_map.get(kind)
    if frame[0] != 0xFD or known is None:
        return frame
    body = bytearray(frame[1:-2])
    strange = [0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)]
    first = 9 if chance.random() < 0.9 else 4  # now and then the sender too
    for _ in range(chance.choice([1, 1, 2, 4])):
        if len(body) > first:
            at = chance.randrange(first, len(body))
            end = min(len(body), at + chance.choice([1, 2, 4]))
            body[at:end] = bytes(chance.choice(strange) for _ in range(end - at))
    body[6:9] = kind.to_bytes(3, "little")
    crc = common.x25crc(bytes(body) + bytes([known.crc_extra])).crc
    return frame[:1] + bytes(body) + crc.to_bytes(2, "little")


def torn(frame: bytes, chance: random.Random) -> bytes:
    """Bytes lost, changed, put in or doubled, as on a serial line."""
    at, to = sorted(chance.randrange(len(frame) + 1) for _ in range(2))
    put = chance.choice([b"", chance.randbytes(to - at), frame[at:to] * 2, b"\xfd", b"\xfe\xff", bytes(9)])
    return frame[:at] + put + frame[to:]


class Forger(Radio):
    """Changes what passes, each way; the rest of the faults come as usual."""

    def __init__(self, firmware, seed, share, faults=""):
        home = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, HOME.alt_amsl_m)
        super().__init__(Autopilot(FIRMWARES[firmware], home=home), parse_faults(faults), seed)
        self.chance, self.share = random.Random(seed), share

    def changed(self, frame):
        if self.chance.random() >= self.share:
            return frame
        return self.chance.choice([forged, forged, torn])(frame, self.chance)

    def _deliver(self, frame, link, now):
        self.autopilot.receive(self.changed(frame), link, now)
        self._collect(now)

    def to_send(self):
        return [(link, self.changed(frame)) for link, frame in super().to_send()]


@pytest.mark.parametrize("work", WORKS)
@settings(max_examples=40, deadline=None)
@given(FIRMWARE, st.integers(0, 2**32), st.sampled_from([0.02, 0.1, 0.3, 0.9]), st.booleans())
def test_whatever_a_forger_changes_on_the_way_the_end_is_typed_and_in_time(work, firmware, seed, share, poor):
    network = Forger(firmware, seed, share, "drop=0.1,dup=0.1,reorder=0.1" if poor else "")
    ended = run(WORKS[work](network.clock_s, firmware), network)
    assert ended.error is None or isinstance(ended.error, MavplanError)
    assert ended.ended_s <= DEADLINE_S + 1e-3
    assert len(network.to_send()) < 1000
    settle(network, 30.0)


@settings(max_examples=80, deadline=None)
@given(FIRMWARE, st.integers(0, 2**32))
def test_a_vehicle_under_a_storm_of_forged_frames_takes_a_mission_afterwards(firmware, seed):
    """Unless a value killed it that kills the real one."""
    chance = random.Random(seed)
    dialogue = [frame for _, frame in upload(fenced(firmware, 2), make_network(firmware)).sent]
    network = make_network(firmware)
    vehicle, now = network.autopilot, network.clock_s
    for _ in range(150):
        now += chance.choice([0.0, 0.0, 0.01, 0.3, 2.0])
        frame = chance.choice([forged, forged, torn])(chance.choice(dialogue), chance)
        vehicle.receive(frame, chance.choice([LINK, LINK, "another link"]), now)
        told = b"".join(frame for _, frame in vehicle.to_send())
        assert len(Parser().feed(told)) == count_frames(told)
    if vehicle.killed_by is not None:
        assert vehicle.next_timer() is None
        return
    network.clock_s = now + 20.0
    vehicle.tick(network.clock_s)
    session = UploadSession(make_mission(firmware, 2), now=network.clock_s, deadline_s=60.0, system=1)
    session._home = None
    ended = run(session, network)
    assert ended.error is None or "home" in str(ended.error), ended.error


def count_frames(data: bytes) -> int:
    found = at = 0
    while at < len(data):
        at += frame_size(data[at : at + 3])
        found += 1
    return found


chunks = st.lists(
    st.binary(max_size=60)
    | st.binary(max_size=12).map(lambda rest: b"\xfd" + rest)
    | st.binary(max_size=12).map(lambda rest: b"\xfe" + rest),
    max_size=30,
)


@settings(max_examples=300, deadline=None)
@given(chunks, st.lists(st.floats(0, 0.3), min_size=30, max_size=30))
def test_random_bytes_leave_no_heap_and_a_good_frame_behind_them_is_found(pieces, waits):
    """At the latest half a second later: an unfinished frame is given up then."""
    codec, now = Codec(), 0.0
    for piece, wait_s in zip(pieces, waits, strict=False):
        codec.decode(piece, now)
        now += wait_s
        assert len(codec._buffer) <= LARGEST_FRAME + 60
    good = Codec(VEHICLE).encode(heartbeat())
    found = codec.decode(good, now)
    for later_s in (0.6, 1.2, 1.8):
        found += codec.decode(good[:0], now + later_s)
    assert any(message.get_type() == "HEARTBEAT" for message in found)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 400))
def test_a_stream_cut_anywhere_gives_the_same_messages_in_order(seed, size):
    """Where nothing is damaged, however the bytes come in pieces."""
    chance = random.Random(seed)
    station = Codec(VEHICLE)
    sent = [heartbeat(), *(said(common.MAVLink_mission_ack_message(255, 190, n, 0)) for n in range(16))]
    chance.shuffle(sent)
    stream, codec = b"".join(station.encode(message) for message in sent), Codec()
    got = [
        message
        for at in range(0, len(stream), size)
        for message in codec.decode(stream[at : at + size], 0.001 * at)
    ]
    assert [message.to_dict() for message in got] == [message.to_dict() for message in sent]


def test_a_forged_frame_is_a_good_frame():
    """Else the forger would only be one more way of losing frames."""
    chance, frame = (
        random.Random(1),
        Codec(VEHICLE).encode(said(common.MAVLink_mission_ack_message(255, 190, 3, 0))),
    )
    read = [message for _ in range(100) for message in Codec().decode(forged(frame, chance), 0.0)]
    assert len(read) == 100
    assert len({(message.type, message.target_system, message.get_srcSystem()) for message in read}) > 20
