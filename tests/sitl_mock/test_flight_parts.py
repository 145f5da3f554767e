"""The parts a flight is made of, against authorities outside: pyproj's geodesics, numbers of the paper, plain sums."""

import itertools
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_mock.flight.air import Wander, Wind
from sitl_mock.flight.ardupilot_legs import Limits, leg
from sitl_mock.flight.curves import Pieces, s_curve
from sitl_mock.flight.earth import Tangent
from sitl_mock.flight.power import electric_w, rotor_w
from sitl_mock.flight.px4_legs import corner_speed, flown_speed, level_leg, radius_speed, vertical_leg
from sitl_mock.flight.verticals import ardupilot_descent, ardupilot_takeoff, px4_descent, px4_takeoff

metres = st.floats(0.05, 5000)


@given(
    st.floats(-75, 75),
    st.floats(-179, 179),
    st.floats(0, 360),
    st.floats(0, 10_000),
    st.floats(0, 360),
    st.floats(1, 9000),
)
@settings(max_examples=60, deadline=None)
def test_distances_on_the_plane_are_geodesic_within_a_decimetre_at_10_km(
    lat: float, lon: float, azimuth: float, out_m: float, onward: float, apart_m: float
) -> None:
    """From home and between two places both far from home; and the way back to degrees is exact."""
    from pyproj import Geod

    geod = Geod(ellps="WGS84")
    plane = Tangent(round(lat * 1e7), round(lon * 1e7))
    lon1, lat1, _ = geod.fwd(round(lon * 1e7) / 1e7, round(lat * 1e7) / 1e7, azimuth, out_m)
    lon2, lat2, _ = geod.fwd(lon1, lat1, onward, apart_m)
    one, two = plane.metres(lat1 * 1e7, lon1 * 1e7), plane.metres(lat2 * 1e7, lon2 * 1e7)
    assert math.hypot(*one) == pytest.approx(out_m, abs=0.1)
    assert math.dist(one, two) == pytest.approx(apart_m, abs=0.1)
    back = plane.degrees_e7(*one)
    assert back[0] == pytest.approx(lat1 * 1e7, abs=1)
    assert (back[1] - lon1 * 1e7 + 1.8e9) % 3.6e9 - 1.8e9 == pytest.approx(0, abs=1)


@given(metres, st.floats(0.3, 20), st.floats(0.5, 5), st.floats(0.3, 5))
def test_an_s_curve_ends_where_it_should_and_keeps_its_limits(
    length: float, speed: float, accel: float, jerk: float
) -> None:
    curve = s_curve(length, speed, accel, jerk)
    assert curve.length_m == pytest.approx(length, rel=1e-6)
    assert curve.speed_m_s == pytest.approx(0, abs=1e-6)
    step = curve.end_s / 200
    speeds = [curve.at(n * step)[1] for n in range(201)]
    assert max(speeds) <= speed + 1e-6
    assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) <= accel * step + 1e-6
    travelled = sum((a + b) / 2 * step for a, b in itertools.pairwise(speeds))
    assert travelled == pytest.approx(length, rel=0.02)


def _is_smooth(curve: object, jump: float = 0.3) -> bool:
    """Its speed is the slope of its distance, and does not jump."""
    end = curve.end_s  # type: ignore[attr-defined]
    step = max(end / 3000, 1e-3)
    for n in range(int(end / step) - 1):
        (s0, v0), (s1, v1) = curve.at(n * step), curve.at((n + 1) * step)  # type: ignore[attr-defined]
        if abs((s1 - s0) / step - (v0 + v1) / 2) > 0.1 + abs(v1 - v0) or abs(v1 - v0) > jump + 5 * step:
            return False
    return True


@given(metres, st.floats(1, 10), st.floats(0, 0.9), st.floats(-0.4, 0.2))
@settings(max_examples=40, deadline=None)
def test_an_ardupilot_leg_goes_to_its_place_smoothly(
    length: float, speed: float, swing: float, rest: float
) -> None:
    curve, finish_s = leg(length, length, speed, 2.5, swing, rest)
    assert _is_smooth(curve)
    assert abs(curve.at(finish_s)[0] - length) < 0.95
    assert curve.at(finish_s + 30)[0] == pytest.approx(length + rest, abs=0.01)


@given(metres, st.sampled_from([1.0, 3.06, 5.03, 7.9, 10.0]), st.floats(0, 1))
@settings(max_examples=40, deadline=None)
def test_a_px4_leg_goes_to_its_place_smoothly(length: float, speed: float, start: float) -> None:
    """Whatever speed it brings along; within the radius by `when`, at rest near the place at the end."""
    start_speed = start * speed if length > 60 else 0.0
    curve = level_leg(length, speed, start_speed, radius_speed(speed), 2.0)
    assert _is_smooth(curve)
    assert abs(curve.length_m - length) < 2.0
    assert curve.at(curve.when(max(length - 2.0, 0.0)))[0] >= length - 2.01


@given(st.floats(-200, 200))
@settings(max_examples=40, deadline=None)
def test_px4_changes_its_height_from_rest_to_rest(height: float) -> None:
    curve = vertical_leg(height)
    assert curve.length_m == pytest.approx(abs(height), abs=0.01)
    assert _is_smooth(curve)


@given(st.floats(0.3, 300))
@settings(max_examples=60, deadline=None)
def test_takeoffs_and_landings_end_at_their_heights(height: float) -> None:
    for curve, done_s in (ardupilot_takeoff(height, 2.5, 3.15), px4_takeoff(height, 3.85)):
        assert _is_smooth(curve)
        assert 0 <= height - curve.at(done_s)[0] <= 0.67
        assert curve.length_m == pytest.approx(height, abs=0.02 + height * 0.001)
    for down in (ardupilot_descent(height, 1.5), px4_descent(height)):
        assert _is_smooth(down, jump=0.4)
        assert down.length_m == pytest.approx(height, abs=0.01)


@pytest.mark.parametrize("speed", [0.0, 5.0, 10.0, 15.0, 20.0, 30.0])
def test_the_power_is_that_of_equation_12(speed: float) -> None:
    """Written out once more, with the values of table I."""
    v0, tip = 4.03, 120.0
    by_hand = (
        79.86 * (1 + 3 * speed**2 / tip**2)
        + 88.63 * ((1 + speed**4 / (4 * v0**4)) ** 0.5 - speed**2 / (2 * v0**2)) ** 0.5
        + 0.5 * 0.6 * 1.225 * 0.05 * 0.503 * speed**3
    )
    assert rotor_w(speed) == pytest.approx(by_hand)


def test_the_papers_two_best_speeds_come_out() -> None:
    """Least power at 10.2 m/s, least energy a metre at 18.3 m/s: figure 2 of the paper."""
    speeds = [n / 100 for n in range(100, 3000)]
    assert min(speeds, key=rotor_w) == pytest.approx(10.2, abs=0.1)
    assert min(speeds, key=lambda v: rotor_w(v) / v) == pytest.approx(18.3, abs=0.1)


def test_the_papers_hover_power_follows_from_its_parameters() -> None:
    """P0 = δ/8·ρ·s·A·Ω³·R³ and Pi = (1+k)·W^1.5/√(2ρA); v0 = √(W/(2ρA))."""
    density, solidity, disc, blade, rotation, profile, weight, correction = (
        1.225,
        0.05,
        0.503,
        0.4,
        300.0,
        0.012,
        20.0,
        0.1,
    )
    assert profile / 8 * density * solidity * disc * rotation**3 * blade**3 == pytest.approx(79.86, abs=0.05)
    assert (1 + correction) * weight**1.5 / math.sqrt(2 * density * disc) == pytest.approx(88.63, abs=0.05)
    assert math.sqrt(weight / (2 * density * disc)) == pytest.approx(4.03, abs=0.01)


def test_climbing_costs_more_than_hovering_and_mass_in_proportion() -> None:
    """20 N times Vc, and an induced velocity of −Vc/2 + √((Vc/2)² + v0²) in place of v0, 1.1 times the ideal power."""
    induced = -2.5 / 2 + math.sqrt(1.25**2 + 4.03**2)
    more = 20 * 2.5 - 1.1 * 20 * (4.03 - induced)
    assert rotor_w(0, 2.5) - rotor_w(0) == pytest.approx(more, abs=0.1)
    assert electric_w(4.0, 7.0, 1.0) == pytest.approx(2 * electric_w(2.0, 7.0, 1.0))
    assert rotor_w(3.0, -2.0) == rotor_w(3.0)


def test_limits_along_a_slope_are_the_tightest() -> None:
    limits = Limits(10.0, 2.5, 1.5, 2.5)
    assert limits.along((1.0, 0.0, 0.0)) == (10.0, 2.5)
    assert limits.along((0.0, 0.0, 1.0)) == (2.5, 1.0)
    assert limits.along((0.0, 0.0, -1.0)) == (1.5, 1.0)
    speed, accel = limits.along((0.6, 0.0, 0.8))
    assert (speed, accel) == (pytest.approx(3.125), pytest.approx(1.25))


def test_corner_speeds_are_px4s_rule() -> None:
    """√(a·d·tan(α/2)): straight on without limit, a right angle √6, back the same way 0."""
    assert corner_speed(1.0, 2.0) == math.inf
    assert corner_speed(0.0, 2.0) == pytest.approx(math.sqrt(6))
    assert corner_speed(-1.0, 2.0) == pytest.approx(0, abs=1e-6)
    assert [flown_speed(v) for v in (3.0, 8.0, 12.0, 20.0)] == pytest.approx(
        [3.06, 7.9, 10.0, 10.0], abs=0.01
    )


@given(st.integers(0, 1000), st.floats(0, 1e5))
def test_a_hovering_vehicle_wanders_smoothly_and_not_far(seed: int, time: float) -> None:
    wander = Wander(0.5, 0.2, random.Random(seed))
    off, speed = wander.at(time)
    later, _ = wander.at(time + 0.01)
    assert math.hypot(off[0], off[1]) < 0.9
    assert abs(off[2]) < 0.37
    assert all(abs(b - a - 0.01 * v) < 1e-3 for a, b, v in zip(off, later, speed, strict=True))


def test_wind_limits_the_speed_over_ground() -> None:
    """Head wind, tail wind, and across: what is left of 11.8 m/s through the air."""
    wind = Wind(6.0, 0.0)
    assert wind.fastest((1.0, 0.0, 0.0)) == pytest.approx(5.8)
    assert wind.fastest((-1.0, 0.0, 0.0)) == pytest.approx(17.8)
    assert wind.fastest((0.0, 1.0, 0.0)) == pytest.approx(math.sqrt(11.8**2 - 36))
    assert wind.fastest((0.0, 0.0, 1.0)) == math.inf
    with pytest.raises(ValueError, match="0 to 100"):
        Wind(-1.0)


def test_pieces_tell_when_they_have_come_so_far() -> None:
    curve = Pieces().poly(10, 1.0).poly(5)
    assert curve.when(50) == pytest.approx(10)
    assert curve.when(75) == pytest.approx(12.5)
    assert curve.when(1e9) == pytest.approx(15)
