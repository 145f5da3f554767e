"""The same flight in four kinds of log is the same track; what is damaged or foreign is told, never a traceback."""

import contextlib
import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import DFReader
from pyulog import ULog

from mavplan.errors import InputError
from mavplan.track.read import parse_track, read_track
from tests.track.logs import fly, to_bin, to_csv, to_tlog, to_ulg, ulg_begin

STOPS = [(100.0, 50.0), (-60.0, 200.0)]
HOLDS = [8.0, 5.0]
FLIGHT = fly(STOPS, HOLDS)
PX4_FLIGHT = fly(STOPS, HOLDS, autopilot="px4")
LOGS = {
    ".tlog": (FLIGHT, to_tlog(FLIGHT)),
    ".bin": (FLIGHT, to_bin(FLIGHT)),
    ".ulg": (PX4_FLIGHT, to_ulg(PX4_FLIGHT)),
    ".csv": (FLIGHT, to_csv(FLIGHT)),
}


def refused(data, suffix=""):
    """What is said about a log that cannot be used."""
    with pytest.raises(InputError) as caught:
        parse_track(data, "x", suffix)
    return str(caught.value)


@pytest.mark.parametrize("suffix", LOGS)
def test_the_same_flight_comes_out_of_every_kind_of_log(suffix):
    flight, data = LOGS[suffix]
    track = parse_track(data, "x")
    lat_deg, lon_deg = flight.lat_lon_deg
    np.testing.assert_allclose(track.time_s, flight.time_s, atol=1e-3)
    np.testing.assert_allclose(track.lat_deg, lat_deg, atol=1e-7)
    np.testing.assert_allclose(track.lon_deg, lon_deg, atol=1e-7)
    np.testing.assert_allclose(track.alt_rel_m, flight.xyz_m[:, 2], atol=2e-3)
    assert [event.seq for event in track.reached] == [seq for _, seq in flight.reached]
    np.testing.assert_allclose(
        [event.time_s for event in track.reached], [time_s for time_s, _ in flight.reached], atol=0.11
    )
    (armed,) = track.armed
    np.testing.assert_allclose(armed, flight.armed_s, atol=1.01)
    (air,) = track.in_air
    assert air.from_s == pytest.approx(20 + 2 / 2.5, abs=0.2)
    assert track.notes == ()


@pytest.mark.parametrize(
    ("suffix", "autopilot"), [(".tlog", "ardupilot"), (".bin", "ardupilot"), (".ulg", "px4")]
)
def test_the_autopilot_and_when_it_flew_its_mission_are_known(suffix, autopilot):
    flight, data = LOGS[suffix]
    track = parse_track(data, "x")
    assert track.autopilot == autopilot
    (mission,) = track.in_mission
    np.testing.assert_allclose(mission, flight.armed_s, atol=1.01)


def test_csv_knows_no_autopilot_and_may_not_know_arming():
    track = parse_track(to_csv(FLIGHT, armed=False, reached=False), "x")
    assert (track.autopilot, track.armed, track.in_mission, track.reached) == (None, None, None, ())
    assert track.air_s == pytest.approx(parse_track(to_csv(FLIGHT), "x").air_s)


def test_items_are_reached_in_a_simulation_at_ten_times_the_speed_when_they_were():
    track = parse_track(to_tlog(FLIGHT, speedup=10.0), "x")
    np.testing.assert_allclose(
        [event.time_s for event in track.reached], [time_s for time_s, _ in FLIGHT.reached], atol=0.11
    )


def test_pymavlinks_reader_finds_the_same_in_an_onboard_log(tmp_path):
    path = tmp_path / "x.bin"
    path.write_bytes(LOGS[".bin"][1])
    reader = DFReader.DFReader_binary(str(path))
    try:
        found = []
        while (message := reader.recv_match(type=["POS"])) is not None:
            found.append((message.TimeUS / 1e6, message.Lat, message.Lng, message.RelHomeAlt))
    finally:
        reader.close()
    track = parse_track(path.read_bytes(), "x")
    ours = np.column_stack([track.time_s, track.lat_deg, track.lon_deg, track.alt_rel_m])
    np.testing.assert_allclose(ours, found, atol=1e-9)


def test_the_ulog_of_these_tests_is_one_to_pyulog():
    log = ULog(io.BytesIO(LOGS[".ulg"][1]))
    assert not log.file_corruption
    assert len(log.get_dataset("vehicle_global_position").data["lat"]) == len(PX4_FLIGHT.time_s)


@pytest.mark.parametrize("suffix", LOGS)
def test_the_content_decides_and_not_the_name(suffix, tmp_path):
    path = tmp_path / "log.txt"
    path.write_bytes(LOGS[suffix][1])
    assert len(read_track(path)) == len(LOGS[suffix][0].time_s)


@pytest.mark.parametrize("suffix", LOGS)
def test_a_log_cut_in_the_middle_gives_what_was_before(suffix):
    flight, data = LOGS[suffix]
    track = parse_track(data[: len(data) // 2], "x")
    whole = parse_track(data, "x")
    assert 0.3 * len(flight.time_s) < len(track) < 0.8 * len(flight.time_s)
    np.testing.assert_array_equal(track.time_s, whole.time_s[: len(track)])
    assert track.reached == whole.reached[: len(track.reached)]


@pytest.mark.parametrize("suffix", [".tlog", ".bin"])
def test_garbage_in_a_log_is_told_and_left_out(suffix):
    flight, data = LOGS[suffix]
    middle = data.index(b"\xfd" if suffix == ".tlog" else b"\xa3\x95\x81", len(data) // 2) - 8 * (
        suffix == ".tlog"
    )
    track = parse_track(data[:middle] + b"\xa3\x95\x00" * 100 + data[middle:], "x")
    assert len(track) == len(flight.time_s)
    assert [note.code for note in track.notes] == ["damaged"]


def test_an_empty_file_a_picture_and_a_page_are_refused():
    assert refused(b"") == "x: is empty"
    assert refused(b"\x89PNG\r\n\x1a\n" + bytes(100)).startswith(
        "x: is none of the logs that can be read: .tlog"
    )
    assert refused(
        b"<html>", ".tlog"
    ) == "x: holds no whole MAVLink frame: it is empty, cut at once or no tlog\n" + (
        "x: the last 6 bytes are an unfinished record: the log was cut there"
    )
    assert "pyulog cannot read it" in refused(b"ULog\x01\x12\x35")
    assert refused(b"name,lat_deg\nx,3\n") == (
        "x: has no column time_s, lon_deg, alt_rel_m; a track needs time_s, lat_deg, lon_deg, alt_rel_m"
    )


def test_a_log_without_positions_says_so():
    silent = replace(SHORT_FLIGHT, reached=(), current=())
    heartbeats = b"".join(
        data[at : at + 29]
        for data in [to_tlog(silent)]
        for at in range(len(data))
        if data[at + 8 : at + 10] == b"\xfd\x09"
    )
    assert "no vehicle in it tells its position" in refused(heartbeats)
    assert "holds no position of the vehicle" in refused(b"time_s,lat_deg,lon_deg,alt_rel_m\n1,0,0,5\n")


def test_a_missing_file_and_a_folder_are_said(tmp_path):
    for path, said in ((tmp_path / "x.tlog", "there is no such file"), (tmp_path, "is a folder")):
        with pytest.raises(InputError, match=said):
            read_track(path)


def test_lines_without_a_position_are_counted():
    good = to_csv(FLIGHT).splitlines()
    track = parse_track(b"\n".join([*good[:50], b"x,,,1,1,", *good[50:]]), "x")
    assert len(track) == len(FLIGHT.time_s)
    assert [str(note) for note in track.notes] == [
        "x: 1 lines hold no position in numbers (the first is line 51) and are left out"
    ]


def test_positions_that_are_no_place_are_left_out():
    good = to_csv(FLIGHT).splitlines()
    bad = [b"3.05,0,0,5,0,", b"3.06,91,8,5,0,", b"3.07,46,8,1e9,0,"]
    track = parse_track(b"\n".join([*good[:32], *bad, *good[32:]]), "x")
    assert len(track) == len(FLIGHT.time_s)
    assert track.notes[0].code == "bad-positions"


def nested_ulog():
    """A log of 300 bytes whose formats, flattened, would fill the memory."""
    from tests.track.logs import _ulg_message

    begin = b"ULog\x01\x12\x35\x01" + bytes(8)
    for outer, inner in zip("abcdef", ["b", "c", "d", "e", "f", "uint8_t"], strict=True):
        begin += _ulg_message("F", f"{outer}:uint64_t timestamp;{inner}[60000] x;".encode())
    return begin + _ulg_message("A", b"\0\0\0a")


def test_a_ulog_that_would_fill_the_memory_is_refused():
    assert "pyulog cannot read it (ValueError)" in refused(nested_ulog())


def test_a_ulog_over_which_pyulog_goes_without_end_is_given_up():
    damaged = ulg_begin()[:100] + b"\xff\xff" + ulg_begin()[100:]
    assert any(
        "ReadTooOftenError" in refused(damaged[:cut] + damaged[-30:]) for cut in range(90, len(damaged))
    )


@pytest.mark.parametrize("suffix", LOGS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_no_damage_to_a_log_makes_anything_but_a_track_or_an_input_error(suffix, data):
    content = bytearray(SHORT[suffix])
    for _ in range(data.draw(st.integers(1, 8))):
        place = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["byte", "cut", "insert", "repeat"])):
            case "byte":
                content[place] = data.draw(st.integers(0, 255))
            case "cut":
                del content[place : place + data.draw(st.integers(1, 300))]
            case "insert":
                content[place:place] = data.draw(st.binary(max_size=50))
            case "repeat":
                content[place:place] = content[: data.draw(st.integers(1, 2000))]
        content = content or bytearray(b"x")
    with contextlib.suppress(InputError):
        track = parse_track(bytes(content), "x", suffix)
        assert np.all(np.diff(track.time_s) > 0)
        assert np.all(np.abs(track.lat_deg) <= 90)
        assert np.all(np.isfinite(track.alt_rel_m))
        assert all(span.length_s >= 0 for span in (*(track.armed or ()), *track.in_air))


SHORT_FLIGHT = fly([(20.0, 0.0)], [2.0], height_m=20.0, start_s=2.0, hz=2.0)
SHORT = {
    ".tlog": to_tlog(SHORT_FLIGHT),
    ".bin": to_bin(SHORT_FLIGHT),
    ".ulg": to_ulg(fly([(20.0, 0.0)], [2.0], height_m=20.0, start_s=2.0, hz=2.0, autopilot="px4")),
    ".csv": to_csv(SHORT_FLIGHT),
}
