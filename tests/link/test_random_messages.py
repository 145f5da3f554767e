"""Whatever a link brings, in whatever order: no session crashes, hangs or raises anything but its own typed errors."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from mavplan.errors import MavplanError
from mavplan.link.codec import Codec
from mavplan.link.connection import Connection
from mavplan.link.download_session import DownloadSession
from mavplan.link.protocol import Address
from mavplan.link.upload_session import UploadSession
from mavplan.link.vehicle import drive
from tests.link.harness import make_mission
from tests.link.script import VEHICLE, heartbeat, said

byte = st.sampled_from([0, 1, 190, 255]) | st.integers(0, 255)
target = st.sampled_from([255, 0, 1, 254])
component = st.sampled_from([190, 0, 1])
kind = st.sampled_from([0, 0, 0, 1, 2, 255])
seq = st.integers(0, 9) | st.integers(0, 65_535)
number = st.floats(width=32)

messages = st.one_of(
    st.builds(common.MAVLink_mission_request_message, target, component, seq, kind),
    st.builds(common.MAVLink_mission_request_int_message, target, component, seq, kind),
    st.builds(common.MAVLink_mission_ack_message, target, component, st.integers(0, 20), kind),
    st.builds(common.MAVLink_mission_count_message, target, component, seq, kind),
    st.builds(
        common.MAVLink_mission_item_int_message,
        *(target, component, seq, byte, seq, byte, byte),
        *(number, number, number, number),
        *(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1)),
        *(number, kind),
    ),
    st.builds(common.MAVLink_mission_current_message, seq, seq, st.integers(0, 9), byte),
    st.builds(common.MAVLink_mission_clear_all_message, target, component, kind),
    st.builds(common.MAVLink_heartbeat_message, byte, st.sampled_from([3, 12, 8]), byte, seq, byte, byte),
    st.builds(common.MAVLink_statustext_message, byte, st.binary(max_size=50), seq, byte),
    st.builds(common.MAVLink_timesync_message, st.integers(0, 2**60), st.integers(0, 2**60)),
    st.builds(common.MAVLink_system_time_message, st.integers(0, 2**60), st.integers(0, 2**32 - 1)),
    st.builds(common.MAVLink_home_position_message, *(st.integers(-(2**31), 2**31 - 1),) * 3, *(number,) * 3,
              st.just([1, 0, 0, 0]), *(number,) * 3),
)  # fmt: skip
addresses = st.sampled_from(
    [VEHICLE, VEHICLE, VEHICLE, Address(2, 1), Address(254, 190), Address(255, 190), Address(1, 100)]
)
happenings = st.lists(st.tuples(st.floats(0, 3), addresses, messages), max_size=60)


def sessions(deadline_s=100.0):
    return [
        UploadSession(make_mission("ardupilot", 2), now=0.0, deadline_s=deadline_s, system=1),
        UploadSession(make_mission("px4", 2), now=0.0, deadline_s=deadline_s, system=1),
        DownloadSession(now=0.0, deadline_s=deadline_s, system=1),
    ]


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2), happenings)
def test_random_messages_at_random_times_end_in_a_typed_outcome_in_time(which, heard):
    session = sessions()[which]
    session.receive(heartbeat(autopilot=12 if which == 1 else 3), 0.0)
    codec, now = Codec(), 0.0
    for wait_s, by, message in heard:
        now += wait_s
        session.tick(now)
        session.receive(said(message, by), now)
        for sent in session.to_send():
            codec.encode(sent)
    ticks = 0
    while not session.done:
        ticks += 1
        assert ticks < 20_000, "the session asks for time but does not move"
        now = max(session.next_timer(), now + 1e-6)
        session.tick(now)
        session.to_send()
    assert session.error is None or isinstance(session.error, MavplanError)
    assert now <= 100.0 + 1e-3 or not heard or session.error is not None


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2), st.lists(st.binary(max_size=300), max_size=20))
def test_random_bytes_do_no_harm(which, chunks):
    session, codec = sessions()[which], Codec()
    for step, chunk in enumerate(chunks):
        for message in codec.decode(chunk, step * 0.3):
            session.receive(message, step * 0.3)
        session.tick(step * 0.3)


class Interrupting(Connection):
    """A vehicle that is heard, and a user who then presses Ctrl-C."""

    def __init__(self, heartbeats):
        self.heartbeats, self.written = heartbeats, []

    def read(self, timeout_s):
        if not self.heartbeats:
            raise KeyboardInterrupt
        self.heartbeats -= 1
        return Codec(VEHICLE).encode(common.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3))

    def write(self, data):
        self.written.append(data)

    def close(self):
        pass


def test_ctrl_c_in_the_middle_is_an_outcome_and_before_a_vehicle_was_found_it_is_passed_on():
    import time

    session = UploadSession(make_mission("ardupilot", 1), now=time.monotonic(), deadline_s=60.0, system=1)
    drive(session, Interrupting(1))
    assert "interrupted" in str(session.error)
    session = UploadSession(make_mission("ardupilot", 1), now=time.monotonic(), deadline_s=60.0, system=1)
    with pytest.raises(KeyboardInterrupt):
        drive(session, Interrupting(0))
