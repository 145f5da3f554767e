"""The mock vehicle's signing: it hears only what is signed with its key, and signs what pymavlink's extension lacks."""

import hashlib

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES
from sitl_mock.signing import make_signing, read_key

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
STAMP = 36_000_000_000_000


def station(key, timestamp=STAMP):
    """A ground station of pymavlink's."""
    end = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    if key is not None:
        end.signing.secret_key, end.signing.timestamp, end.signing.sign_outgoing = key, timestamp, True
    return end


def vehicle(firmware="px4"):
    return Autopilot(FIRMWARES[firmware], signing=make_signing(KEY, STAMP), telemetry=False)


def ask(mock, end, now=1.0):
    frame = bytes(mavlink.MAVLink_mission_request_list_message(1, 1, 0).pack(end))
    mock.receive(frame, "ground", now)
    return [data for link, data in mock.to_send() if link == "ground"]


@pytest.mark.parametrize(("key", "answers"), [(KEY, True), (OTHER, False), (None, False)])
def test_only_its_own_key_is_answered(key, answers):
    assert bool(ask(vehicle(), station(key))) is answers


def test_a_replayed_frame_is_not_answered_and_a_forged_stamp_shuts_nobody_out():
    mock = vehicle()
    frame = bytes(mavlink.MAVLink_mission_request_list_message(1, 1, 0).pack(station(KEY)))
    assert not ask(mock, station(OTHER, STAMP + 10**9))
    mock.receive(frame, "ground", 1.0)
    assert [link for link, _ in mock.to_send()].count("ground") > 0
    mock.receive(frame, "ground", 2.0)
    assert [link for link, _ in mock.to_send()].count("ground") == 0


def test_every_frame_it_sends_is_signed_also_those_with_fields_that_pymavlink_does_not_know():
    mock, end = vehicle(), station(KEY)
    item = mavlink.MAVLink_mission_item_int_message(
        1, 1, 0, 3, 22, 1, 1, 0, 0, 0, 0, 374_000_000, -1_221_000_000, 30.0, 0
    )
    frames = []
    for now, message in enumerate([mavlink.MAVLink_mission_count_message(1, 1, 1, 0), item], start=1):
        mock.receive(bytes(message.pack(end)), "ground", float(now))
        frames += [frame for _, frame in mock.to_send()]
    for second in range(3, 8):
        mock.tick(float(second))
        frames += [frame for _, frame in mock.to_send()]
    extended = [frame for frame in frames if frame[7] == mavlink.MAVLINK_MSG_ID_MISSION_ACK and frame[1] > 4]
    assert extended, "PX4's ACK carries the checksum of its mission"
    reader = station(KEY, STAMP)
    for frame in frames:
        assert reader.decode(bytearray(frame)).get_signed()
        assert hashlib.sha256(KEY + frame[:-6]).digest()[:6] == frame[-6:]
    assert reader.signing.badsig_count == 0


@pytest.mark.parametrize(
    ("content", "mode", "word"),
    [(KEY, 0o644, "0600"), (KEY[:-1], 0o600, "neither"), (b"z" * 64, 0o600, "neither")],
)
def test_what_is_no_key_is_refused(tmp_path, content, mode, word):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(mode)
    with pytest.raises(ValueError, match=word):
        read_key(str(path))
