"""Recorded flights of real autopilots, flown again by the mock: same messages, same order, same times."""

from bisect import bisect
from functools import cache
from itertools import groupby
from typing import Any

import pytest

from .test_recordings import CAPTURES, Replay, messages, recorded

pytestmark = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason=f"no recordings of real autopilots at {CAPTURES}"
)

PX4_FLIGHTS = ["px4_flight", "px4_flight_full"]
NOT_OF_THE_FLIGHT = ("EKF3", "SIM Hit", "[logger]", "Flight plan")
HOLD_S = 8.0


@cache
def real(name: str) -> list[tuple[float, bytes]]:
    return recorded(name)


@cache
def mock(name: str) -> list[tuple[float, bytes]]:
    return Replay(name).said


def boot_clock(name: str) -> Any:
    """The vehicle's own clock at a time of the recording: PX4's simulation ran 1 % slower than the recorder's clock."""
    positions = [
        (t, m.time_boot_ms / 1000)
        for t, m, _ in messages(real(name))
        if m.get_type() == "GLOBAL_POSITION_INT"
    ]
    offset = positions[0][1] - positions[0][0]

    def at(time: float) -> float:
        index = min(max(bisect([t for t, _ in positions], time), 1), len(positions) - 1)
        (t0, b0), (t1, b1) = positions[index - 1], positions[index]
        return b0 + (time - t0) * (b1 - b0) / (t1 - t0) - offset

    return at


def vehicle_said(frames: list[tuple[float, bytes]]) -> list[tuple[float, Any]]:
    return [(t, m) for t, m, frame in messages([each for each in frames if each[1][5] == 1])]


def reached(frames: list[tuple[float, bytes]]) -> dict[int, float]:
    """When each item was first reported, in the order of the reports."""
    first: dict[int, float] = {}
    for time, message in vehicle_said(frames):
        if message.get_type() == "MISSION_ITEM_REACHED":
            first.setdefault(message.seq, time)
    return first


def texts(frames: list[tuple[float, bytes]]) -> list[str]:
    said = [m.text.strip() for _, m in vehicle_said(frames) if m.get_type() == "STATUSTEXT"]
    return [text for text in said if text and not text.startswith(NOT_OF_THE_FLIGHT)]


def text_at(frames: list[tuple[float, bytes]], beginning: str) -> float:
    return next(
        t for t, m in vehicle_said(frames) if m.get_type() == "STATUSTEXT" and m.text.startswith(beginning)
    )


@pytest.mark.parametrize("name", ["ardupilot_flight_loiter", *PX4_FLIGHTS])
def test_items_are_reported_reached_in_the_recorded_order(name: str) -> None:
    """Which numbers, in which order; those that the firmware never reports too."""
    assert list(reached(mock(name))) == list(reached(real(name)))


def test_ardupilot_says_the_recorded_texts() -> None:
    assert texts(mock("ardupilot_flight_loiter")) == texts(real("ardupilot_flight_loiter"))


def test_px4_says_the_recorded_texts() -> None:
    """But for the height above the landing place, which its drifting estimate had a metre off."""

    def said(frames: list[tuple[float, bytes]]) -> list[str]:
        return [text.split("(")[0] for text in texts(frames)]

    assert said(mock("px4_flight_full")) == said(real("px4_flight_full"))


def test_ardupilot_flies_each_leg_in_the_recorded_time() -> None:
    """Within 0.7 s a leg; the hold of 8 s within 0.1 s; all in all 187.6 s within 1 s."""
    was, now = reached(real("ardupilot_flight_loiter")), reached(mock("ardupilot_flight_loiter"))
    for before, after in ((1, 2), (3, 5), (5, 6)):
        assert now[after] - now[before] == pytest.approx(was[after] - was[before], abs=0.7)
    assert now[3] - now[2] == pytest.approx(was[3] - was[2], abs=0.1)
    assert now[1] == pytest.approx(was[1], abs=0.7)
    assert now[7] == pytest.approx(was[7], abs=1.0)


@pytest.mark.parametrize("name", ["ardupilot_flight_loiter", "px4_flight_full"])
def test_modes_and_mission_states_follow_each_other_as_recorded(name: str) -> None:
    """HEARTBEAT's modes and system status, MISSION_CURRENT and EXTENDED_SYS_STATE, each as it changes."""
    fields = {
        "HEARTBEAT": ("base_mode", "custom_mode", "system_status"),
        "MISSION_CURRENT": ("seq", "total", "mission_state", "mission_mode"),
        "EXTENDED_SYS_STATE": ("landed_state",),
    }

    def changes(frames: list[tuple[float, bytes]], kind: str) -> list[tuple[int, ...]]:
        told = [m for _, m in vehicle_said(frames) if m.get_type() == kind]
        return [key for key, _ in groupby(tuple(getattr(m, field) for field in fields[kind]) for m in told)]

    for kind in fields:
        was, now = changes(real(name), kind), changes(mock(name), kind)
        if kind == "HEARTBEAT":
            # The mock is up already; PX4's recording ends before the next heartbeat on the ground.
            was = [each for each in was if each[2]]
            now = [each for each in now if each in was]
        if kind == "MISSION_CURRENT":
            # What is shown in the second between upload and start depends on when it is shown.
            was, now = ([each for each in told if each[2] >= 3] for told in (was, now))
        if was and now:
            assert now == was, kind


@pytest.mark.parametrize("name", PX4_FLIGHTS)
def test_px4_flies_each_leg_in_the_recorded_time(name: str) -> None:
    """Within 5 %, hold and take-off taken out; the landing too."""
    clock = boot_clock(name)
    was = {seq: clock(time) for seq, time in reached(real(name)).items()}
    now = reached(mock(name))
    legs = [(0, 1, 0.0), (1, 2, HOLD_S), (2, 4, HOLD_S), (4, 6, HOLD_S)]
    for before, after, hold_s in legs:
        took = was[after] - was[before] - hold_s
        assert now[after] - now[before] - hold_s == pytest.approx(took, rel=0.05)
    for beginning, end in (("Returning", "RTL: land"), ("RTL: land", "Disarmed")):
        took = clock(text_at(real(name), end)) - clock(text_at(real(name), beginning))
        assert text_at(mock(name), end) - text_at(mock(name), beginning) == pytest.approx(took, rel=0.05)
    started = clock(text_at(real(name), "Armed"))
    assert now[0] - text_at(mock(name), "Armed") == pytest.approx(was[0] - started, abs=1.0)


@pytest.mark.parametrize("name", ["ardupilot_flight_loiter", "px4_flight_full"])
def test_the_mock_is_where_the_real_vehicle_was(name: str) -> None:
    """At every moment of the flight, within 12 m (PX4's legs may be 5 % off) or 7 m, and near the same height."""
    clock = boot_clock(name)
    px4 = name.startswith("px4")
    stretch = [(0.0, 0.0)]
    was, now = reached(real(name)), reached(mock(name))
    stretch += [(clock(time), now[seq]) for seq, time in was.items()]
    assert stretch == sorted(stretch)
    replay = Replay(name)
    assert replay.vehicle.vehicle.home is not None
    tangent = replay.vehicle.pilot.tangent
    track = _mock_track(name)
    for time, message in vehicle_said(real(name)):
        if message.get_type() != "GLOBAL_POSITION_INT" or not 20 < clock(time) < (176 if px4 else 185):
            continue
        index = min(max(bisect([real_s for real_s, _ in stretch], clock(time)), 1), len(stretch) - 1)
        (r0, m0), (r1, m1) = stretch[index - 1], stretch[index]
        there = track(m0 + (clock(time) - r0) * (m1 - m0) / (r1 - r0))
        n, e = tangent.metres(message.lat, message.lon)
        assert abs(n - there[0]) + abs(e - there[1]) < (12 if px4 else 7), f"{name} at {time:.1f} s"
        assert message.alt / 1000 - 10.1 == pytest.approx(there[2], abs=3.0), f"{name} at {time:.1f} s"


def _mock_track(name: str) -> Any:
    """Places of the mock's flight at any time: it is flown again and asked on the way."""
    from sitl_mock.autopilot import Autopilot
    from sitl_mock.firmware import FIRMWARES

    from .test_recordings import HOME, STATION

    vehicle = Autopilot(FIRMWARES[name.split("_", maxsplit=1)[0]], home=HOME)
    station = [frame for frame in real(name) if frame[1][5] == STATION]
    vehicle.tick(-1.0)

    def at(time: float) -> tuple[float, float, float]:
        while station and station[0][0] <= time:
            when, frame = station.pop(0)
            while (timer := vehicle.next_timer()) is not None and timer < when:
                vehicle.tick(timer)
            vehicle.receive(frame, "station", when)
        while (timer := vehicle.next_timer()) is not None and timer <= time:
            vehicle.tick(timer)
        return vehicle.pilot.body.at(time)[0]

    return at
