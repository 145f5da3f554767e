"""MAVLink 2 signing, with pymavlink's own signing as the authority in both directions."""

import io
import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from mavplan.errors import InputError
from mavplan.link.codec import Codec
from mavplan.link.protocol import GROUND, Address, heartbeat, mission_count, mission_request
from mavplan.link.signing import (
    EPOCH_S,
    MAX_TIMESTAMP,
    OLD,
    RESERVE,
    UNITS_PER_S,
    Signature,
    Signing,
    timestamp_now,
)

KEY = bytes(range(1, 33))
OTHER_KEY = bytes(range(2, 34))
NOW = 40_000_000_000_000
VEHICLE = Address(1, 1)
TO = Address(1, 1)


def clock():
    return NOW


def signing(key=KEY, **options):
    return Signing(key, **{"clock": clock, **options})


def pymavlink_end(key=KEY, timestamp=NOW, link_id=0):
    """Pymavlink's own MAVLink with its own signing, as a vehicle."""
    end = common.MAVLink(io.BytesIO(), srcSystem=1, srcComponent=1)
    end.signing.secret_key = key
    end.signing.timestamp = timestamp
    end.signing.link_id = link_id
    end.signing.sign_outgoing = True
    return end


def vehicle_frame(end, seq=3):
    return bytes(mission_request(GROUND, seq, 0).pack(end))


def test_what_we_sign_pymavlink_takes_for_rightly_signed():
    codec, end = Codec(signing=signing(link_id=7)), pymavlink_end()
    for count in range(1, 50):
        got = end.decode(bytearray(codec.encode(mission_count(TO, count, 0))))
        assert (got.count, got.get_signed(), got.get_link_id()) == (count, True, 7)
    assert end.signing.goodsig_count == 49


def test_pymavlink_refuses_what_we_sign_with_another_key():
    codec, end = Codec(signing=signing(OTHER_KEY)), pymavlink_end()
    with pytest.raises(common.MAVError, match="signature"):
        end.decode(bytearray(codec.encode(heartbeat())))


def test_what_pymavlink_signs_we_take_and_what_others_sign_or_nobody_we_drop_and_count():
    ours = signing()
    codec = Codec(signing=ours)
    good, wrong = pymavlink_end(), pymavlink_end(OTHER_KEY)
    plain = common.MAVLink(None, srcSystem=1, srcComponent=1)
    stream = (
        vehicle_frame(good) + vehicle_frame(wrong) * 3 + vehicle_frame(plain) * 2 + vehicle_frame(good, 4)
    )
    assert [message.seq for message in codec.decode(stream, 0.0)] == [3, 4]
    assert ours.dropped == {Signature.WRONG: 3, Signature.MISSING: 2}
    assert ours.dropped_words() == "2 frames without a signature and 3 with a wrong signature were dropped"


def test_mavlink_1_cannot_be_signed_and_is_dropped():
    ours = signing()
    old = common.MAVLink(None, srcSystem=1, srcComponent=1)
    frame = common.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3).pack(old, force_mavlink1=True)
    assert Codec(signing=ours).decode(bytes(frame), 0.0) == []
    assert ours.dropped == {Signature.MISSING: 1}
    assert ours.dropped_words() == "1 frame without a signature was dropped"


def test_a_radios_own_status_is_believed_unsigned_but_not_wrongly_signed():
    status = common.MAVLink_radio_status_message(200, 190, 100, 40, 40, 0, 0)
    radio = common.MAVLink(None, srcSystem=51, srcComponent=68)
    ours = signing()
    codec = Codec(signing=ours)
    assert len(codec.decode(bytes(status.pack(radio)), 0.0)) == 1
    assert codec.decode(bytes(status.pack(pymavlink_end(OTHER_KEY))), 0.0) == []


def test_a_replayed_frame_and_an_older_one_are_dropped_in_their_own_stream_only():
    ours = signing()
    codec, end, other_link = Codec(signing=ours), pymavlink_end(), pymavlink_end(link_id=1)
    first, second = vehicle_frame(end, 1), vehicle_frame(end, 2)
    same_stamp_elsewhere = vehicle_frame(other_link, 9)
    found = codec.decode(second + first + second + same_stamp_elsewhere + same_stamp_elsewhere, 0.0)
    assert [message.seq for message in found] == [2, 9]
    assert ours.dropped == {Signature.OLD: 3}


@pytest.mark.parametrize(("behind", "taken"), [(0, True), (OLD, True), (OLD + 1, False), (-OLD * 1000, True)])
def test_more_than_a_minute_behind_is_refused_and_ahead_is_not(behind, taken):
    found = Codec(signing=signing()).decode(vehicle_frame(pymavlink_end(timestamp=NOW - behind)), 0.0)
    assert bool(found) is taken


def test_our_stamps_grow_past_all_that_was_sent_accepted_or_kept():
    kept = []
    ours = signing(last=NOW + 100, keep=kept.append)
    codec, end = Codec(signing=ours), pymavlink_end(timestamp=NOW + 5_000)

    def stamp():
        return int.from_bytes(codec.encode(heartbeat())[-12:-6], "little")

    assert [stamp(), stamp()] == [NOW + 101, NOW + 102]
    codec.decode(vehicle_frame(end), 0.0)
    assert stamp() == NOW + 5_001
    assert kept == [NOW + 101 + RESERVE]
    codec.decode(vehicle_frame(pymavlink_end(timestamp=NOW + 3 * RESERVE)), 0.0)
    assert stamp() == NOW + 3 * RESERVE + 1
    assert all(later > earlier for earlier, later in itertools.pairwise(kept))
    assert kept[-1] > NOW + 3 * RESERVE + 1


def test_a_forged_stamp_does_not_shut_the_vehicle_out():
    ours = signing()
    codec = Codec(signing=ours)
    codec.decode(vehicle_frame(pymavlink_end(OTHER_KEY, timestamp=NOW + 10**9)), 0.0)
    assert len(codec.decode(vehicle_frame(pymavlink_end()), 0.0)) == 1
    assert ours.timestamp == NOW


def test_used_up_stamps_are_an_error_and_not_an_overflow():
    ours = signing(last=MAX_TIMESTAMP - 10)
    with pytest.raises(InputError, match="used up"):
        Codec(signing=ours).encode(heartbeat())


def test_the_clock_counts_ten_microseconds_since_2015():
    import datetime

    begin = datetime.datetime(2015, 1, 1, tzinfo=datetime.UTC)
    assert begin.timestamp() == EPOCH_S
    seconds = (datetime.datetime.now(datetime.UTC) - begin).total_seconds()
    assert abs(timestamp_now() / UNITS_PER_S - seconds) < 10


@given(st.data())
def test_a_frame_that_is_changed_anywhere_is_not_believed(data):
    """Also where the checksum is made right again, as a forger would."""
    frame = bytearray(vehicle_frame(pymavlink_end()))
    at = data.draw(st.integers(1, len(frame) - 1))
    frame[at] ^= data.draw(st.integers(1, 255))
    if data.draw(st.booleans()) and frame[1] + 25 == len(frame) and 3 <= at < len(frame) - 15:
        crc = common.x25crc(
            bytes(frame[1:-15]) + bytes([common.MAVLink_mission_request_int_message.crc_extra])
        ).crc
        frame[-15:-13] = crc.to_bytes(2, "little")
    ours = signing()
    assert Codec(signing=ours).decode(bytes(frame), 0.0) == []
    assert ours.judge(bytes(frame)) is not Signature.GOOD


@given(st.binary(max_size=80))
def test_no_bytes_make_the_judge_fail(frame):
    assert signing().judge(b"\xfd" + frame) is not Signature.GOOD


def test_the_key_is_neither_shown_nor_sent():
    ours = signing()
    codec = Codec(signing=ours)
    sent = b"".join(codec.encode(message) for message in [heartbeat(), mission_count(TO, 3, 0)] * 50)
    assert KEY not in sent
    assert KEY[:8] not in sent
    assert common.MAVLINK_MSG_ID_SETUP_SIGNING not in {
        message.get_msgId() for message in Codec().decode(sent, 0.0)
    }
    assert repr(KEY)[2:-1] not in repr(ours)
    assert KEY.hex() not in repr(ours)


def test_a_key_of_another_length_is_none():
    with pytest.raises(ValueError, match="32 bytes"):
        Signing(b"short")


def test_without_a_key_signed_frames_are_read_and_counted():
    codec = Codec()
    assert len(codec.decode(vehicle_frame(pymavlink_end()), 0.0)) == 1
    assert codec.signed == 1


def test_a_vehicle_whose_clock_is_days_behind_is_heard_as_soon_as_it_has_heard_us():
    """An autopilot without GPS counts on from its last flight, until a greater stamp comes."""
    codec, end = Codec(signing=signing()), pymavlink_end(timestamp=NOW - 1000 * OLD)
    assert codec.decode(vehicle_frame(end), 0.0) == []
    end.decode(bytearray(codec.encode(heartbeat())))
    assert len(codec.decode(vehicle_frame(end), 0.0)) == 1


@given(st.binary(max_size=400))
def test_noise_is_no_message_and_hides_no_signed_frame(noise):
    codec = Codec(signing=signing())
    assert codec.decode(noise, 0.0) == []
    end = pymavlink_end()
    found = codec.decode(vehicle_frame(end), 10.0)
    for _ in range(30):
        found += codec.decode(vehicle_frame(end), 20.0)
    assert found
