"""What a vehicle says of itself: heartbeat, version, commands, streams, parameters."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import ARDUPILOT, PX4
from sitl_mock.wire import Encoder, Splitter, message_id

from .rig import (
    LAT_E7,
    LON_E7,
    NAN,
    Rig,
    command,
    count,
    good_mission,
    heartbeat,
    item,
    kinds,
    request,
    request_list,
)

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def said(rig: Rig, seconds: float, name: str) -> list[tuple[float, object, object]]:
    start = rig.now
    rig.run(seconds)
    return [each for each in rig.heard if each[2].get_type() == name and each[0] > start]


@BOTH
def test_the_heartbeat_comes_every_second_to_everybody(firmware: str) -> None:
    """From system 1, component 1, a quadrotor, MAVLink 2."""
    rig = Rig(firmware)
    beats = said(rig, 10.0, "HEARTBEAT")
    assert [at for at, _, _ in beats] == [float(n) for n in range(1, 11)]
    assert {link for _, link, _ in beats} == {None}
    beat = beats[0][2]
    assert (beat.get_srcSystem(), beat.get_srcComponent(), beat.type) == (1, 1, 2)
    assert beat.autopilot == {"ardupilot": 3, "px4": 12}[firmware]
    assert all(frame[0] == 0xFD for frame in rig.frames)


@BOTH
@pytest.mark.parametrize("asking", [command(520, 1), command(512, 148)])
def test_autopilot_version_comes_on_either_command(firmware: str, asking: object) -> None:
    """Behind an ACK 0, with the MISSION_INT capability."""
    answers = Rig(firmware).send(asking)
    assert [answer.get_type() for answer in answers] == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
    assert answers[0].result == 0
    assert answers[1].capabilities & 4


@BOTH
def test_a_command_it_cannot_do_is_unsupported_and_not_pretended(firmware: str) -> None:
    """Result 3, and nothing changes."""
    rig = Rig(firmware)
    for number in (2600, 31000):
        (answer,) = rig.send(command(number, 1))
        assert (answer.command, answer.result) == (number, 3)
        assert (answer.target_system, answer.target_component) == (255, 190)
    assert not rig.vehicle.vehicle.armed


@BOTH
def test_a_command_for_another_system_is_not_answered(firmware: str) -> None:
    """Nor for another component."""
    rig = Rig(firmware)
    for target in ((2, 1), (1, 154)):
        assert rig.send(mavlink.MAVLink_command_long_message(*target, 520, 0, 1, 0, 0, 0, 0, 0, 0)) == []


@BOTH
def test_home_and_position_are_told_where_home_is_known(firmware: str) -> None:
    """On request; not before there is a home."""
    rig = Rig(firmware)
    rig.send(command(512, 242), command(512, 33))
    told = {message.get_type(): message for _, _, message in rig.heard}
    assert told["HOME_POSITION"].latitude == LAT_E7
    assert told["HOME_POSITION"].altitude == 10_000
    assert (told["GLOBAL_POSITION_INT"].lon, told["GLOBAL_POSITION_INT"].relative_alt) == (LON_E7, 0)
    lost = Rig(firmware, home=None)
    lost.send(command(512, 242), command(512, 33))
    lost.run(5)
    assert not {message.get_type() for _, _, message in lost.heard} & {"HOME_POSITION", "GLOBAL_POSITION_INT"}


def test_ardupilot_sends_hardly_anything_unasked() -> None:
    """HEARTBEAT and TIMESYNC."""
    rig = Rig("ardupilot")
    rig.send(heartbeat())
    rig.run(30)
    assert {message.get_type() for _, _, message in rig.heard} == {"HEARTBEAT", "TIMESYNC"}


def test_px4_streams_to_who_has_spoken() -> None:
    """Position, home, mission and battery; to nobody before."""
    rig = Rig("px4")
    assert {m.get_type() for _, m in rig.run(5, telemetry=True)} == {"HEARTBEAT"}
    rig.send(heartbeat())
    streamed = {m.get_type() for _, m in rig.run(5, telemetry=True)}
    assert streamed >= {
        "GLOBAL_POSITION_INT",
        "HOME_POSITION",
        "MISSION_CURRENT",
        "EXTENDED_SYS_STATE",
        "BATTERY_STATUS",
    }


@BOTH
def test_an_interval_is_honoured_on_the_link_that_asked(firmware: str) -> None:
    """SET_MESSAGE_INTERVAL: 5 Hz, told back, and off again."""
    rig = Rig(firmware)
    assert rig.send(command(511, 42, 200_000))[0].result == 0
    rig.send(heartbeat(), link="radio")
    heard = said(rig, 2.0, "MISSION_CURRENT")
    assert len([1 for _, link, _ in heard if link == "gcs"]) == 10
    assert len([1 for _, link, _ in heard if link == "radio"]) <= 2
    assert rig.send(command(510, 42))[1].interval_us == 200_000
    rig.send(command(511, 42, -1))
    assert not [1 for _, link, _ in said(rig, 2.0, "MISSION_CURRENT") if link == "gcs"]


@BOTH
def test_an_interval_for_an_unknown_message_fails(firmware: str) -> None:
    """Result 4, NaN too."""
    rig = Rig(firmware)
    for number in (12345, NAN, -1.0, float("inf")):
        assert rig.send(command(511, number, 1e6))[0].result == 4
        assert rig.send(command(512, number))[0].result == 4


def test_a_data_stream_is_honoured_by_ardupilot() -> None:
    """REQUEST_DATA_STREAM: position at 4 Hz, and off."""
    rig = Rig("ardupilot")
    rig.send(mavlink.MAVLink_request_data_stream_message(1, 1, 6, 4, 1))
    assert len(said(rig, 2.0, "GLOBAL_POSITION_INT")) == 8
    rig.send(mavlink.MAVLink_request_data_stream_message(1, 1, 6, 4, 0))
    assert said(rig, 2.0, "GLOBAL_POSITION_INT") == []


def test_ardupilots_mission_current() -> None:
    """Total is the count without home; state 1 empty, 2 uploaded, 3 flown, 5 finished."""
    rig = Rig("ardupilot")

    def now() -> tuple[int, int]:
        rig.send(command(512, 42))
        message = rig.heard[-1][2]
        return message.total, message.mission_state

    assert now() == (0, 1)
    rig.upload(good_mission("ardupilot"))
    assert now() == (4, 2)
    rig.vehicle.vehicle.mission_running = True
    assert now() == (4, 3)
    rig.vehicle.vehicle.mission_running, rig.vehicle.vehicle.mission_finished = False, True
    assert now() == (4, 5)


@BOTH
def test_timesync_is_answered_and_ping_by_px4_only(firmware: str) -> None:
    """The time sent comes back."""
    rig = Rig(firmware)
    rig.send(mavlink.MAVLink_timesync_message(0, 12345))
    assert rig.heard[-1][2].ts1 == 12345
    answers = rig.send(mavlink.MAVLink_ping_message(99, 7, 0, 0))
    assert [(a.seq, a.target_system) for a in answers] == ([(7, 255)] if firmware == "px4" else [])


def parameter(rig: Rig, name: bytes) -> float:
    (answer,) = rig.send(mavlink.MAVLink_param_request_read_message(1, 1, name, -1))
    return float(answer.param_value)


def test_ardupilots_fence_parameters_are_the_measured_defaults() -> None:
    """FENCE_ENABLE 0, FENCE_TYPE 7, 100 m and 150 m."""
    rig = Rig("ardupilot")
    values = [
        parameter(rig, name) for name in (b"FENCE_ENABLE", b"FENCE_TYPE", b"FENCE_ALT_MAX", b"FENCE_RADIUS")
    ]
    assert values == [0, 7, 100, 150]


@BOTH
def test_the_parameter_list_is_whole_and_numbered(firmware: str) -> None:
    """Each index once, the same count in all."""
    answers = Rig(firmware).send(mavlink.MAVLink_param_request_list_message(1, 1))
    assert [answer.param_index for answer in answers] == list(range(len(answers)))
    assert {answer.param_count for answer in answers} == {len(answers)}


@BOTH
def test_a_parameter_that_is_set_is_told_back(firmware: str) -> None:
    """A float one; an unknown one is not answered."""
    rig = Rig(firmware)
    name = {"ardupilot": b"FENCE_RADIUS", "px4": b"MPC_XY_CRUISE"}[firmware]
    (answer,) = rig.send(mavlink.MAVLink_param_set_message(1, 1, name, 7.5, 9))
    assert answer.param_value == 7.5
    assert parameter(rig, name) == 7.5
    assert rig.send(mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH", 7.5, 9)) == []


def test_px4s_integer_parameters_travel_as_bytes() -> None:
    """GF_ACTION 2 is the float with the bits of 2."""
    import struct

    assert struct.pack("<f", parameter(Rig("px4"), b"GF_ACTION")) == struct.pack("<i", 2)


@BOTH
def test_at_its_measured_pace_each_answer_takes_its_time(firmware: str) -> None:
    """About 180 items a second for ArduPilot, 2,200 for PX4."""
    fw = {"ardupilot": ARDUPILOT, "px4": PX4}[firmware]
    rig = Rig(firmware, item_pace_s=fw.item_pace_s)
    assert rig.send(count(2)) == []
    assert [(at, m.seq) for at, m in rig.run(fw.item_pace_s)] == [(fw.item_pace_s, 0)]
    assert rig.send(item(0, 22)) == []
    assert kinds([m for _, m in rig.run(fw.item_pace_s)])[0].endswith(" 1")


@BOTH
def test_capacity_can_be_given(firmware: str) -> None:
    """COUNT above it: ACK 4."""
    rig = Rig(firmware, capacity=5)
    assert kinds(rig.send(count(6)))[0] == "ACK 4"
    assert kinds(rig.send(count(5)))[0].startswith("REQUEST")


@BOTH
def test_a_download_by_floats_has_float_items(firmware: str) -> None:
    """MISSION_REQUEST is answered with MISSION_ITEM and the old frames."""
    rig = Rig(firmware)
    rig.upload(good_mission(firmware))
    rig.send(request_list(), request(0))
    (answer,) = rig.send(mavlink.MAVLink_mission_request_message(1, 1, 1, 0))
    assert answer.get_type() == "MISSION_ITEM"
    assert answer.frame == 3
    assert answer.x == pytest.approx(37.4, abs=1e-5)


@BOTH
def test_two_links_are_parsed_apart(firmware: str) -> None:
    """A frame that comes in halves on one link is not disturbed by another link's bytes."""
    rig = Rig(firmware)
    frame = Encoder(255, 190).encode(count(2))
    rig.vehicle.receive(frame[:9], "a", rig.now)
    rig.vehicle.receive(b"\xfd\x01garbage", "b", rig.now)
    rig.vehicle.receive(frame[9:], "a", rig.now)
    assert [link for link, out in rig.vehicle.to_send() if message_id(out) in {40, 51}] == ["a"]


@BOTH
def test_a_forgotten_link_gets_nothing_more(firmware: str) -> None:
    """Neither streams nor texts."""
    rig = Rig(firmware)
    rig.send(heartbeat(), command(511, 42, 100_000))
    rig.vehicle.forget("gcs")
    assert {link for at, link, _ in rig.heard if at > 0} == set()
    rig.run(5)
    assert {link for at, link, _ in rig.heard if at > 0} == {None}


@pytest.mark.parametrize(
    "wrong",
    [
        {"system_id": 0},
        {"system_id": 256},
        {"capacity": -1},
        {"home": (91.0, 0.0, 0.0)},
        {"home": (NAN, 0.0, 0.0)},
    ],
)
def test_an_impossible_vehicle_is_refused(wrong: dict[str, object]) -> None:
    """ValueError with the value."""
    with pytest.raises(ValueError, match=r"\d|nan"):
        Autopilot(PX4, **wrong)  # type: ignore[arg-type]


def test_frames_survive_any_cutting() -> None:
    """The splitter gives the same frames for a stream in one piece and byte by byte, and drops what is between."""
    encoder = Encoder(1, 1)
    frames = [encoder.encode(count(n)) for n in range(5)]
    stream = b"noise".join(frames)
    whole, bytewise = Splitter(), Splitter()
    assert whole.feed(stream) == frames
    assert [frame for n in range(len(stream)) for frame in bytewise.feed(stream[n : n + 1])] == frames


@BOTH
def test_a_late_tick_sends_one_heartbeat_and_not_all_that_were_missed(firmware: str) -> None:
    """A process that was stopped for a minute does not flood its peers."""
    rig = Rig(firmware)
    rig.now = 60.5
    rig.vehicle.tick(60.5)
    rig.vehicle.tick(60.6)
    assert len(rig.vehicle.to_send()) == 1
    assert rig.vehicle.next_timer() == 61.5
