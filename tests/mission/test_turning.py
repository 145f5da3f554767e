"""Points that are flown through: ArduPilot's rule stepped through time as its code does, PX4's recorded corner."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.mission.flight_law import ARDUPILOT_LAW, LAWS, PX4_LAW
from mavplan.mission.forecast import forecast, leg_time_s
from mavplan.mission.motion import rest_to_rest
from mavplan.mission.phases import Vehicle
from mavplan.mission.turning import spared

BOTH = list(AUTOPILOTS.values())
DEGREES = [0.0, 5.0, 20.0, 45.0, 90.0, 120.0, 180.0]


def corner(turn_deg, lengths_m=(100.0, 100.0)):
    """Two legs that turn by so much at the point between them."""
    turn = math.radians(turn_deg)
    return [
        (0.0, lengths_m[0]),
        (lengths_m[1] * math.sin(turn), lengths_m[0] + lengths_m[1] * math.cos(turn)),
    ]


def legs_of(rules, turn_deg, speed_m_s, *, lengths_m=(100.0, 100.0), through=True):
    """Leg times of a mission round one corner."""
    points = corner(turn_deg, lengths_m)
    holds = [None if through else 0.0, 5.0]
    return forecast(points, holds, rules=rules, altitude_m=30, speed_m_s=speed_m_s).legs_s


def blended_start_s(turn_deg, speed_m_s, lengths_m):
    """How long before the end of its leg ArduPilot begins the next: at the first millisecond that its rule allows."""
    law, turn = ARDUPILOT_LAW, math.radians(turn_deg)
    one, other = (
        rest_to_rest(length_m, speed_m_s, law.acceleration_m_s2, law.jerk_m_s3) for length_m in lengths_m
    )
    inward, outward = np.array([0.0, 1.0]), np.array([math.sin(turn), math.cos(turn)])
    for left_s in np.arange(min(float(one.ramp_s), float(other.ramp_s)), 0, -0.001):
        half = left_s / 2
        place = other.way_m(half) * outward - one.way_m(half) * inward
        speed = other.speed_m_s(half) * outward + one.speed_m_s(half) * inward
        pull = other.acceleration_at(half) * outward - one.acceleration_at(half) * inward
        if (
            math.hypot(*place) < law.turn_radius_m
            and math.hypot(*speed) < speed_m_s + 1e-6
            and math.hypot(*pull) < law.turn_acceleration_m_s2
        ):
            return float(left_s)
    return 0.0


class TestArduPilot:
    @pytest.mark.parametrize("speed_m_s", [3.0, 10.0])
    @pytest.mark.parametrize("turn_deg", DEGREES)
    @pytest.mark.parametrize("lengths_m", [(100.0, 100.0), (15.0, 200.0)])
    def test_the_next_leg_begins_when_its_code_would_begin_it(self, turn_deg, speed_m_s, lengths_m):
        stopping = legs_of(ARDUPILOT, turn_deg, speed_m_s, lengths_m=lengths_m, through=False)
        passing = legs_of(ARDUPILOT, turn_deg, speed_m_s, lengths_m=lengths_m)
        gained = sum(stopping) - sum(passing) - ARDUPILOT_LAW.settle_s
        assert gained == pytest.approx(blended_start_s(turn_deg, speed_m_s, lengths_m), abs=0.003)

    def test_a_right_angle_saves_four_seconds_and_the_settling(self):
        """j·t³/6·√2 = 2 m half-way: t = 2.04 s, on either side."""
        stopping, passing = (legs_of(ARDUPILOT, 90, 10.0, through=through) for through in (False, True))
        half_s = (6 * 2.0 / math.sqrt(2)) ** (1 / 3)
        assert stopping[0] - passing[0] == pytest.approx(half_s + ARDUPILOT_LAW.settle_s, abs=1e-6)
        assert stopping[1] - passing[1] == pytest.approx(half_s, abs=1e-6)


class TestPX4:
    def test_a_right_angle_is_passed_at_the_recorded_speed(self):
        """1.68 m/s was the least of the recording at its first waypoint, asked 5 m/s."""
        vehicle = Vehicle(PX4)
        legs = vehicle.motion([100.0, 150.0], [5.0, 5.0])
        found = spared(
            legs,
            np.array([(0.0, 100.0), (150.0, 0.0)]),
            np.full(2, 5.0),
            np.array([True, False]),
            vehicle.law,
        )
        assert 5.0 * math.sqrt(found.last[0]) == pytest.approx(1.68, abs=0.06)
        assert found.first[1] == found.last[0] == found.settle[0]

    def test_straight_back_is_a_stop_and_a_turn(self):
        there, back = legs_of(PX4, 180, 5.0, through=False)
        assert legs_of(PX4, 180, 5.0) == pytest.approx((there, back + PX4_LAW.turn_wait_s))

    def test_a_next_point_within_the_radius_makes_it_stop(self):
        near = legs_of(PX4, 0, 5.0, lengths_m=(100.0, 1.9))
        assert near == pytest.approx(legs_of(PX4, 0, 5.0, lengths_m=(100.0, 1.9), through=False))


@pytest.mark.parametrize("rules", BOTH)
@pytest.mark.parametrize("speed_m_s", [3.0, 10.0])
def test_straight_on_is_one_long_leg(rules, speed_m_s):
    whole = float(leg_time_s(200.0, rules=rules, speed_m_s=speed_m_s))
    # PX4 would near its speed a little longer on the one long leg.
    assert sum(legs_of(rules, 0, speed_m_s)) == pytest.approx(whole, abs=1e-6 if rules is ARDUPILOT else 0.7)


@pytest.mark.parametrize("rules", BOTH)
def test_the_sharper_the_turn_the_longer_it_takes(rules):
    times = [sum(legs_of(rules, turn_deg, 10.0)) for turn_deg in DEGREES]
    assert times == sorted(times)
    assert times[0] < times[-1]


@pytest.mark.parametrize("rules", BOTH)
def test_the_last_point_before_a_return_is_a_stop(rules):
    """Neither autopilot flies on into a return or a landing."""
    for end in ("rtl", "land", "stay"):
        turned, stopped = (
            forecast([(0, 100)], [hold_s], rules=rules, altitude_m=30, speed_m_s=5, end=end)
            for hold_s in (None, 0.0)
        )
        assert turned.legs_s == stopped.legs_s


@given(
    st.sampled_from(BOTH),
    st.sampled_from([1, 10]),
    st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=2, max_size=8),
    st.floats(1, 12),
    st.sampled_from([None, 0.0, 2.0]),
)
def test_flying_through_is_no_slower_than_stopping_and_turning_nor_faster_than_the_speed(
    rules, grid_m, places, speed_m_s, acceleration
):
    points = [(grid_m * east, grid_m * north) for east, north in places]

    def fly(hold_s):
        holds = [hold_s] * (len(points) - 1) + [1.0]
        return forecast(
            points, holds, rules=rules, altitude_m=30, speed_m_s=speed_m_s, acceleration_m_s2=acceleration
        )

    passing, stopping = fly(None).legs_s, fly(0.0).legs_s
    lengths_m = np.hypot(*np.diff([(0, 0), *points], axis=0).T)
    # PX4 stops within its radius, but passes the point itself: it may then take longer for a metre.
    radius_s = 2.0 / min(speed_m_s, 10.0)
    for length_m, one, other in zip(lengths_m, passing, stopping, strict=True):
        if grid_m > 1:
            assert one <= other + LAWS[rules.name].turn_wait_s + radius_s + 0.05
        assert one >= length_m / min(speed_m_s, 10.0) - radius_s - 1e-9
