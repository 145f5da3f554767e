"""Whose frames of a tlog count: the one vehicle's, of one run of its clock; the rest is told."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mavplan.errors import InputError
from mavplan.track.telemetry import read_tlog
from tests.track.logs import fly, to_tlog

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
captured = pytest.mark.skipif(not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here")
FLIGHT = fly([(100.0, 50.0), (-60.0, 200.0)], [8.0, 5.0])
OTHER = fly([(500.0, 500.0)], [20.0], speed_m_s=15.0)


def refused(data, system=None):
    """What is said about a log that cannot be used."""
    with pytest.raises(InputError) as caught:
        read_tlog(data, "x", system)
    return str(caught.value)


def test_with_two_vehicles_in_the_air_one_must_be_named():
    data = to_tlog(FLIGHT, system=1) + to_tlog(OTHER, system=7)
    assert refused(data) == "x: holds several vehicles, systems 1, 7: say with --system which one to use"
    for system, flight in ((1, FLIGHT), (7, OTHER)):
        track = read_tlog(data, "x", system)
        assert (track.system, len(track)) == (system, len(flight.time_s))
    assert refused(data, 3) == "x: holds no positions of system 3; those with positions: 1, 7"


def test_of_two_vehicles_the_only_one_that_was_armed_is_used_and_said():
    parked = replace(OTHER, armed_s=(0.0, 0.0), xyz_m=OTHER.xyz_m * 0.0)
    track = read_tlog(to_tlog(parked, system=1) + to_tlog(FLIGHT, system=7), "x")
    assert track.system == 7
    assert [note.code for note in track.notes] == ["several-vehicles"]


def test_a_ground_station_that_tells_its_own_position_is_no_vehicle():
    from pymavlink.dialects.v20 import common

    from mavplan.track.tlog import record

    ground = common.MAVLink(None, srcSystem=255, srcComponent=190)
    own = ground.global_position_int_encode(5, 470_000_000, 80_000_000, 0, 0, 0, 0, 0, 0).pack(ground)
    track = read_tlog(to_tlog(FLIGHT) + record(1, bytes(own)), "x")
    assert (track.system, track.notes) == (1, ())


def test_only_the_autopilots_component_counts():
    data = to_tlog(FLIGHT) + to_tlog(OTHER, component=191, station=False)
    assert len(read_tlog(data, "x")) == len(FLIGHT.time_s)


def test_the_run_of_the_clock_with_the_flight_is_used_and_the_others_are_told():
    hop = fly([(10.0, 0.0)], [1.0], height_m=10.0)
    for data in (to_tlog(hop) + to_tlog(FLIGHT), to_tlog(FLIGHT) + to_tlog(hop)):
        track = read_tlog(data, "x")
        assert len(track) == len(FLIGHT.time_s)
        assert [event.seq for event in track.reached] == [seq for _, seq in FLIGHT.reached]
        assert [note.code for note in track.notes] == ["restarts"]
        assert "began anew 1 time:" in track.notes[0].message


def test_messages_that_were_overtaken_are_put_in_their_place():
    flight = replace(FLIGHT, time_s=FLIGHT.time_s.copy())
    records = [to_tlog(flight.cut(t, t + 0.95), heartbeats=False, station=False) for t in range(0, 100)]
    bare = replace(flight, reached=(), current=())
    records = [to_tlog(bare.cut(t, t + 0.95), heartbeats=False, station=False) for t in range(0, 100)]
    swapped = [records[n + 1 if n % 2 == 0 else n - 1] for n in range(100)]
    track = read_tlog(b"".join(swapped), "x")
    np.testing.assert_allclose(track.time_s, bare.cut(0, 99.95).time_s, atol=1e-3)
    assert track.notes == ()


def test_a_log_that_begins_and_ends_in_the_air_is_armed_throughout():
    track = read_tlog(to_tlog(replace(FLIGHT, reached=(), current=()).cut(60, 80), heartbeats=True), "x")
    assert track.armed is not None
    assert track.air_s == pytest.approx(20.0, abs=0.1)


@captured
def test_ardupilots_recorded_flight_says_what_the_recording_is_known_to_hold():
    track = read_tlog((CAPTURES / "ardupilot_flight_loiter.tlog").read_bytes(), "x")
    assert (track.autopilot, track.system, track.notes) == ("ardupilot", 1, ())
    reached = {event.seq: event.time_s for event in track.reached}
    assert list(reached) == [1, 2, 3, 5, 6, 7]
    assert reached[3] - reached[2] == pytest.approx(8.002, abs=0.01)
    (armed,) = track.armed
    assert armed.length_s == pytest.approx(187.6, abs=1.5)


@captured
@pytest.mark.parametrize("name", ["px4_flight", "px4_flight_full"])
def test_px4s_recorded_flight_says_what_the_recording_is_known_to_hold(name):
    track = read_tlog((CAPTURES / f"{name}.tlog").read_bytes(), "x")
    assert (track.autopilot, track.system, track.notes) == ("px4", 1, ())
    assert [event.seq for event in track.reached] == [0, 1, 2, 4, 6]
    np.testing.assert_allclose(
        [event.time_s for event in track.reached], [35.2, 60.2, 103.6, 144.1, 176.2], atol=0.06
    )
