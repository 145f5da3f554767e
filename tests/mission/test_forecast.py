"""The forecast against measured flights and against the law that planner.md writes down.

Measured figures: ArduCopter 4.7.0-dev of July 2025 and PX4 main of 2025-08-18 in simulation, stop to stop.
"""

import math
import struct
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4, AutopilotRules
from mavplan.mission.flight_law import s_curve_time_s, trapezoid_time_s
from mavplan.mission.forecast import Forecast, forecast, leg_time_s

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
BOTH = list(AUTOPILOTS.values())


def forecast_of(rules: AutopilotRules, **changes: Any) -> Forecast:
    """One stop 150 m north at 30 m, 10 m/s, held 8 s."""
    arguments: dict[str, Any] = {
        "stops_m": [(0.0, 150.0)],
        "holds_s": [8.0],
        "rules": rules,
        "altitude_m": 30.0,
        "speed_m_s": 10.0,
    }
    return forecast(**(arguments | changes))


class TestMeasuredFigures:
    @pytest.mark.parametrize(
        ("distance_m", "speed_m_s", "measured_s"),
        [
            (20, 10, 9.5),
            (50, 10, 12.8),
            (100, 10, 17.3),
            (150, 10, 22.4),
            (300, 10, 37.5),
            (50, 5, 15.2),
            (150, 5, 35.2),
            (150, 3, 54.3),
        ],
    )
    def test_ardupilot_legs_within_2_percent(
        self, distance_m: float, speed_m_s: float, measured_s: float
    ) -> None:
        """Short legs that never reach their speed, and long ones."""
        expected = float(leg_time_s(distance_m, rules=ARDUPILOT, speed_m_s=speed_m_s))
        assert expected == pytest.approx(measured_s, rel=0.02)

    def test_ardupilot_take_off_and_return_within_2_percent(self) -> None:
        """Take-off to 30 m takes 18.3 s; RTL from 150 m away at 30 m takes 65 s until it disarms."""
        found = forecast_of(ARDUPILOT)
        assert found.takeoff_s == pytest.approx(18.3, rel=0.02)
        assert found.end_s == pytest.approx(65.0, rel=0.02)

    def test_px4_take_off_to_30_m_takes_20_to_22_s(self) -> None:
        """As measured over several flights."""
        assert 20 <= forecast_of(PX4).takeoff_s <= 22

    def test_px4_reference_flight_within_5_percent(self) -> None:
        """Start 13.3, take-off done 35.2, first stop 60.2, then 8 s holds until 103.6, 144.1, 176.2, landed 244.5 s."""
        found = forecast(
            [(0, 100), (150, 100), (230, -20)],
            [0, 8, 8],
            rules=PX4,
            altitude_m=30,
            speed_m_s=5,
        )
        assert found.takeoff_s == pytest.approx(35.2 - 13.3, rel=0.05)
        measured = (60.2 - 35.2, 103.6 - 60.2 - 8, 144.1 - 103.6 - 8)
        assert found.legs_s == pytest.approx(measured, rel=0.05)
        fast = leg_time_s(math.hypot(120, 100), rules=PX4, speed_m_s=8)
        assert float(fast) == pytest.approx(176.2 - 144.1 - 8, rel=0.05)
        back = forecast_of(PX4, stops_m=[(110, -120)])
        assert back.end_s == pytest.approx(244.5 - 176.2, rel=0.05)

    @pytest.mark.parametrize("rules", BOTH)
    def test_a_speed_beyond_the_default_limit_changes_nothing(self, rules: AutopilotRules) -> None:
        """About 10 m/s is what both fly then; with a given acceleration too."""
        for acceleration in (None, 0.0, 2.0):
            asked = forecast_of(rules, speed_m_s=15.0, acceleration_m_s2=acceleration)
            assert asked == forecast_of(rules, speed_m_s=10.0, acceleration_m_s2=acceleration)


def recorded(name: str) -> Iterator[tuple[float, Any]]:
    """Messages of a recording with the vehicle's own clock in seconds."""
    path = CAPTURES / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not on this machine")
    from pymavlink.dialects.v20 import common

    parser = common.MAVLink(None)
    parser.robust_parsing = True
    data, start, clock_s = path.read_bytes(), 0, math.nan
    while start < len(data):
        size = 20 + data[start + 9] + (13 if data[start + 10] & 1 else 0)
        message = parser.decode(bytearray(data[start + 8 : start + size]))
        start += size
        if message.get_type() == "GLOBAL_POSITION_INT":
            clock_s = message.time_boot_ms / 1000
        yield clock_s, message


def first_reached(name: str) -> tuple[dict[int, float], dict[str, float], float]:
    """When each item was first reported reached, when each text came, and the wall clock of the recording's start."""
    reached: dict[int, float] = {}
    texts: dict[str, float] = {}
    for clock_s, message in recorded(name):
        if message.get_type() == "MISSION_ITEM_REACHED":
            reached.setdefault(message.seq, clock_s)
        if message.get_type() == "STATUSTEXT":
            texts.setdefault(message.text.strip(), clock_s)
    return reached, texts, struct.unpack(">Q", (CAPTURES / name).read_bytes()[:8])[0] / 1e6


class TestRecordings:
    def test_ardupilot_flight_phase_by_phase(self) -> None:
        """Take-off, three legs (the last at 5 m/s) and the return within 3 %, the whole flight within 1 %."""
        reached, texts, _ = first_reached("ardupilot_flight_loiter.tlog")
        start = texts["Mission: 1 Takeoff"]
        times = [start, reached[1], reached[2], reached[3], reached[5], reached[6], reached[7]]
        takeoff, leg_1, hold, leg_2, leg_3, end = (after - before for before, after in pairwise(times))
        assert hold == pytest.approx(8.0, abs=0.3)
        fast = forecast([(0, 150), (150, 150)], [8, 8], rules=ARDUPILOT, altitude_m=30, speed_m_s=10)
        slow = forecast([(150, 0)], [8], rules=ARDUPILOT, altitude_m=30, speed_m_s=5, home_xy=(150, 150))
        back = forecast_of(ARDUPILOT, stops_m=[(150, 0)])
        assert fast.takeoff_s == pytest.approx(takeoff, rel=0.03)
        assert fast.legs_s == pytest.approx((leg_1, leg_2 - 8), rel=0.03)
        assert slow.legs_s == pytest.approx((leg_3 - 8,), rel=0.03)
        assert back.end_s == pytest.approx(end, rel=0.03)
        whole = fast.takeoff_s + sum(fast.legs_s) + sum(slow.legs_s) + back.end_s + 24
        assert whole == pytest.approx(times[-1] - start, rel=0.01)

    @pytest.mark.parametrize("name", ["px4_flight.tlog", "px4_flight_full.tlog"])
    def test_px4_flight_phase_by_phase(self, name: str) -> None:
        """Take-off, four legs (the last at 8 m/s) and the return within 5 %, the whole flight within 2 %."""
        reached, texts, _ = first_reached(name)
        start = texts["Executing Mission"]
        times = [start, reached[0], reached[1], reached[2], reached[4], reached[6], texts["Landing detected"]]
        takeoff, leg_1, leg_2, leg_3, leg_4, end = (after - before for before, after in pairwise(times))
        stops = [(0, 100), (150, 100), (230, -20)]
        slow = forecast(stops, [0, 8, 8], rules=PX4, altitude_m=30, speed_m_s=5)
        fast = forecast([(110, -120)], [8], rules=PX4, altitude_m=30, speed_m_s=8, home_xy=(230, -20))
        back = forecast_of(PX4, stops_m=[(110, -120)])
        assert slow.takeoff_s == pytest.approx(takeoff, rel=0.05)
        assert slow.legs_s == pytest.approx((leg_1, leg_2 - 8, leg_3 - 8), rel=0.05)
        assert fast.legs_s == pytest.approx((leg_4 - 8,), rel=0.05)
        assert back.end_s == pytest.approx(end, rel=0.05)
        whole = slow.takeoff_s + sum(slow.legs_s) + sum(fast.legs_s) + back.end_s + 24
        assert whole == pytest.approx(times[-1] - start, rel=0.02)


class TestGivenAcceleration:
    @pytest.mark.parametrize("rules", BOTH)
    def test_the_law_of_the_paper(self, rules: AutopilotRules) -> None:
        """d/v + v/a if d ≥ v²/a, else 2·√(d/a): 8 m/s and 2 m/s² turn over at 32 m."""
        legs = leg_time_s([0, 2, 8, 32, 80], rules=rules, speed_m_s=8.0, acceleration_m_s2=2.0)
        assert legs.tolist() == pytest.approx([0, 2, 4, 8, 14])

    @pytest.mark.parametrize("rules", BOTH)
    def test_no_acceleration_is_at_once(self, rules: AutopilotRules) -> None:
        """a = 0: d/v."""
        legs = leg_time_s([0, 10, 80], rules=rules, speed_m_s=8.0, acceleration_m_s2=0.0)
        assert legs.tolist() == pytest.approx([0, 1.25, 10])


class TestWholeMissions:
    @pytest.mark.parametrize("rules", BOTH)
    def test_parts_add_up(self, rules: AutopilotRules) -> None:
        """Flight is take-off, legs and end; the mission adds the holds; the first leg starts at home."""
        found = forecast_of(rules, stops_m=[(0, 40), (30, 0)], holds_s=np.array([3.0, 5.5]), home_xy=(0, 10))
        assert found.hover_s == 8.5
        assert found.flight_s == pytest.approx(found.takeoff_s + sum(found.legs_s) + found.end_s)
        assert found.mission_s == pytest.approx(found.flight_s + 8.5)
        expected = leg_time_s([30, 50], rules=rules, speed_m_s=10.0)
        assert found.legs_s == pytest.approx(tuple(expected))

    @pytest.mark.parametrize("rules", BOTH)
    def test_stops_at_the_same_place_cost_no_flight(self, rules: AutopilotRules) -> None:
        """WAYPOINT and LOITER_TIME at one place cost nothing over the loiter alone."""
        assert forecast_of(rules, stops_m=[(0, 0), (0, 0)], holds_s=[1, 1]).legs_s == (0.0, 0.0)

    @pytest.mark.parametrize("rules", BOTH)
    def test_staying_ends_at_once_and_landing_is_a_return_without_the_way(
        self, rules: AutopilotRules
    ) -> None:
        """At the same height the way down is the same; only the way home and its pauses are missing."""
        assert forecast_of(rules, end="stay").end_s == 0
        land, back = forecast_of(rules, end="land"), forecast_of(rules)
        assert 0 < land.end_s < back.end_s

    def test_a_low_mission_climbs_before_it_returns(self) -> None:
        """ArduPilot returns at 15 m, so the way down from 5 m is that from 15 m."""
        low, high = forecast_of(ARDUPILOT, altitude_m=5.0), forecast_of(ARDUPILOT, altitude_m=15.0)
        assert low.end_s > high.end_s

    @pytest.mark.parametrize("rules", BOTH)
    def test_no_stops_is_a_take_off_and_a_landing(self, rules: AutopilotRules) -> None:
        """Nothing between, and no crash."""
        found = forecast_of(rules, stops_m=np.empty((0, 2)), holds_s=[])
        assert found.legs_s == ()
        assert found.mission_s == pytest.approx(found.takeoff_s + found.end_s)

    def test_stops_and_holds_must_fit(self) -> None:
        """A fault of the caller."""
        with pytest.raises(ValueError, match="1 stops and 2 holds"):
            forecast_of(PX4, holds_s=[1, 2])


class TestMotionLaw:
    @given(
        st.floats(0, 1e5),
        st.floats(0, 1e5),
        st.floats(0.1, 50),
        st.floats(0.1, 20),
        st.floats(0.1, 20),
    )
    def test_s_curve_grows_with_distance_and_obeys_its_limits(
        self, one_m: float, other_m: float, v: float, a: float, j: float
    ) -> None:
        """Never faster than the speed or the acceleration alone allow, never decreasing with the distance."""
        near, far = sorted((one_m, other_m))
        times = s_curve_time_s([near, far], v, a, j)
        assert times[0] <= times[1] * (1 + 1e-9) + 1e-9
        assert np.all(times >= trapezoid_time_s([near, far], v, a) * (1 - 1e-9) - 1e-9)

    @given(st.floats(0.01, 3000), st.floats(0.5, 30), st.floats(0.5, 10), st.floats(0.5, 10))
    def test_s_curve_covers_its_distance(self, distance_m: float, v: float, a: float, j: float) -> None:
        """Integrating the jerk over the time that the formula gives ends at the distance, by another way.

        The peak speed is found by bisection on the distance of the two ramps, not by the formula's closed form.
        """

        def ramp_s(speed: float) -> float:
            return speed / a + a / j if speed >= a * a / j else 2 * math.sqrt(speed / j)

        low, high = 0.0, v
        if v * ramp_s(v) > distance_m:
            for _ in range(200):
                middle = (low + high) / 2
                low, high = (middle, high) if middle * ramp_s(middle) < distance_m else (low, middle)
        peak = high
        expected = 2 * ramp_s(peak) + max(distance_m - peak * ramp_s(peak), 0.0) / v
        assert float(s_curve_time_s(distance_m, v, a, j)) == pytest.approx(expected, rel=1e-6)

    def test_shapes_are_kept(self) -> None:
        """A matrix of distances gives a matrix of times, as planners want it."""
        distances = np.arange(6.0).reshape(2, 3)
        for acceleration in (None, 0.0, 2.0):
            times = leg_time_s(distances, rules=PX4, speed_m_s=5.0, acceleration_m_s2=acceleration)
            assert times.shape == (2, 3)
