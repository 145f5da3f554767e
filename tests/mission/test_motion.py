"""Legs from rest to rest against the same motion found another way: bisection, and integrating speed step by step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.energy import rotor_of
from mavplan.mission.motion import Legs, rest_to_rest, s_curve_time_s, trapezoid_time_s

LIMITS = [(2.5, 1.0), (3.0, 4.0), (2.0, math.inf), (math.inf, math.inf)]


@given(
    st.floats(0, 1e5),
    st.floats(0, 1e5),
    st.floats(0.1, 50),
    st.floats(0.1, 20),
    st.floats(0.1, 20),
)
def test_an_s_curve_grows_with_distance_and_obeys_its_limits(one_m, other_m, v, a, j):
    """Never faster than the speed or the acceleration alone allow, never decreasing with the distance."""
    near, far = sorted((one_m, other_m))
    times = s_curve_time_s([near, far], v, a, j)
    assert times[0] <= times[1] * (1 + 1e-9) + 1e-9
    assert np.all(times >= trapezoid_time_s([near, far], v, a) * (1 - 1e-9) - 1e-9)


@given(st.floats(0.01, 3000), st.floats(0.5, 30), st.floats(0.5, 10), st.floats(0.5, 10))
def test_an_s_curve_covers_its_distance(distance_m, v, a, j):
    """The peak speed is found by bisection on the distance of the two ramps, not by the formula's closed form."""

    def ramp_s(speed):
        return speed / a + a / j if speed >= a * a / j else 2 * math.sqrt(speed / j)

    low, high = 0.0, v
    if v * ramp_s(v) > distance_m:
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if middle * ramp_s(middle) < distance_m else (low, middle)
    peak = high
    expected = 2 * ramp_s(peak) + max(distance_m - peak * ramp_s(peak), 0.0) / v
    assert float(s_curve_time_s(distance_m, v, a, j)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("a", "j"), LIMITS)
@pytest.mark.parametrize("distance_m", [0.5, 5.0, 20.0, 50.0, 300.0])
def test_speed_way_and_acceleration_are_one_motion(distance_m, a, j):
    """The way is the integral of the speed, the speed that of the acceleration, and two ramps and a plateau the leg."""
    leg = rest_to_rest(distance_m, 10.0, a, j)
    times = np.linspace(0, float(leg.ramp_s), 20_001)
    speeds, ways = leg.speed_m_s(times), leg.way_m(times)
    middles = (times[1:] + times[:-1]) / 2
    step = times[1] - times[0]
    assert np.cumsum(leg.speed_m_s(middles)) * step == pytest.approx(ways[1:], abs=1e-6)
    if not math.isinf(a):
        assert np.cumsum(leg.acceleration_at(middles)) * step == pytest.approx(speeds[1:], abs=1e-6)
        assert leg.acceleration_at(times).max() <= a * (1 + 1e-12)
        assert float(leg.speed_m_s(0.0)) == 0
    assert speeds.max() <= 10.0 * (1 + 1e-12)
    assert float(leg.speed_m_s(leg.ramp_s)) == pytest.approx(float(leg.peak_m_s))
    assert 2 * ways[-1] + float(leg.plateau_s * leg.peak_m_s) == pytest.approx(distance_m)


@pytest.mark.parametrize(("a", "j"), LIMITS)
def test_the_mean_over_a_ramp_is_that_of_a_thousand_times_finer_steps(a, j):
    legs = rest_to_rest([1.0, 20.0, 300.0], 10.0, a, j)
    power = rotor_of(2.0).power_w
    shares = (np.arange(64_000) + 0.5) / 64_000
    for at, mean in enumerate(legs.ramp_mean(power)):
        one = Legs(
            legs.peak_m_s[at], legs.ramp_s[at], legs.plateau_s[at], legs.acceleration_m_s2, legs.jerk_m_s3
        )
        assert mean == pytest.approx(power(one.speed_m_s(one.ramp_s * shares)).mean(), rel=1e-4)


def test_each_leg_has_its_own_speed():
    both = rest_to_rest([100.0, 100.0], [5.0, 10.0], 2.5, 1.0)
    alone = [float(s_curve_time_s(100.0, speed, 2.5, 1.0)) for speed in (5.0, 10.0)]
    assert both.time_s.tolist() == pytest.approx(alone)


@pytest.mark.parametrize(("a", "j"), LIMITS)
def test_no_way_takes_no_time(a, j):
    leg = rest_to_rest([0.0], 10.0, a, j)
    assert leg.time_s.tolist() == leg.peak_m_s.tolist() == leg.way_m(1.0).tolist() == [0.0]
