"""In-flight service against vehicles moved in small steps, against a closed form, and against what holds always."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.cli.tables import totals
from mavplan.hover import broadcast_rates, hold_times
from mavplan.inflight import integrate, received_in_flight
from mavplan.mission.autopilots import ARDUPILOT, PX4
from mavplan.mission.flight_law import LAWS
from mavplan.mission.phases import Vehicle as Flyer
from mavplan.plan import make_plan
from mavplan.plan_file import summary
from mavplan.planners import plan_trajectory
from mavplan.planners.trajectory import Trajectory, assign
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio, Service, Vehicle, load_scenario
from mavplan.scenario.checks import check_service
from mavplan.scenario.report import Report
from tests.support import make_scenario, make_users

STEPS = 280_000


def flown(path_m, users_m, channel, stops=None):
    """A trajectory through these points, all of them stops unless said otherwise."""
    path = np.array(path_m, dtype=float)
    stop_at = np.arange(1, len(path)) if stops is None else np.array(stops)
    users = make_users(users_m)
    return Trajectory(
        "made", 0, path, stop_at, np.empty((0, 2)), assign(users, path[stop_at], channel, d2d=False), 400.0
    )


def bits(path_m, users_m, *, radio=None, altitude_m=100.0, rules=ARDUPILOT, stops=None, **vehicle):
    channel = Channel(radio or Radio(), altitude_m, D2D())
    users = np.array(users_m, dtype=float).reshape(-1, 2)
    flight = Vehicle(altitude_m=altitude_m, **vehicle)
    return received_in_flight(users, flown(path_m, users, channel, stops), channel, flight, rules)


def moved_in_steps(path_m, users_m, channel, speed_profile):
    """Sum rate times time over small steps; ``speed_profile(d)`` gives the times and places of a leg's steps."""
    total = np.zeros(len(users_m))
    for start, end in itertools.pairwise(path_m):
        distance = np.linalg.norm(np.subtract(end, start))
        step_s, place = speed_profile(distance)
        at = np.asarray(start) + np.outer(place / distance, np.subtract(end, start))
        for n, user in enumerate(users_m):
            away = np.linalg.norm(at - user, axis=1)
            snr = channel.gamma0 / (channel.altitude_m**2 + away**2) ** (channel.radio.path_loss_exponent / 2)
            rate = channel.radio.bandwidth_hz * np.log2(1 + snr)
            # The part of a step that is inside, where it crosses the border.
            inside = (channel.radius_m - away) / np.maximum(np.abs(np.gradient(away)), 1e-12) + 0.5
            total[n] += (step_s * rate * np.clip(inside, 0.0, 1.0)).sum()
    return total


def trapezoid(speed, a):
    """Step time and mid-step places of a leg, written out from d/v + v/a."""

    def profile(distance):
        peak = min(speed, np.sqrt(distance * a))
        ramp = peak / a
        total = 2 * ramp + (distance - peak * ramp) / peak
        t = (np.arange(STEPS) + 0.5) * total / STEPS
        rising, falling = a * t**2 / 2, distance - a * (total - t) ** 2 / 2
        place = np.where(t < ramp, rising, np.where(t > total - ramp, falling, peak * (t - ramp / 2)))
        return total / STEPS, place

    return profile


def s_curve(speed, a, j):
    """Step times and places of a leg whose jerk is summed up three times; the leg reaches its speed."""

    def profile(distance):
        ramp = speed / a + a / j
        lasts = np.array([a / j, speed / a - a / j, a / j, distance / speed - ramp, 0, 0, 0])
        lasts[4:] = lasts[:3]
        step = np.repeat(lasts / (STEPS // 7), STEPS // 7)
        jerk = np.repeat([j, 0, -j, 0, -j, 0, j], STEPS // 7)
        velocity_rate = np.cumsum(jerk * step) - jerk * step / 2
        velocity = np.cumsum(velocity_rate * step) - velocity_rate * step / 2
        return step, np.cumsum(velocity * step) - velocity * step / 2

    return profile


PATH = [(0.0, 0.0), (700.0, 100.0), (900.0, 650.0)]
USERS = [(300.0, 250.0), (0.0, 0.0), (900.0, 660.0), (820.0, 300.0), (350.0, -330.0), (-100.0, 2000.0)]


@pytest.mark.parametrize("exponent", [2.0, 2.7, 4.0])
def test_with_an_acceleration_it_is_a_trapezoid_moved_in_steps(exponent):
    radio = Radio(path_loss_exponent=exponent, ref_gain_db=-70.0 + (exponent - 2) * 25)
    channel = Channel(radio, 100.0, D2D())
    expected = moved_in_steps(PATH, USERS, channel, trapezoid(12.0, 0.8))
    found = bits(PATH, USERS, radio=radio, speed_m_s=12.0, acceleration_m_s2=0.8)
    assert found == pytest.approx(expected, rel=1e-6, abs=1.0)
    assert found[-1] == 0.0
    assert (found[:-1] > 1e6).sum() >= 4


@pytest.mark.parametrize("rules", [ARDUPILOT, PX4])
def test_without_an_acceleration_it_is_the_autopilots_law_moved_in_steps(rules):
    law = LAWS[rules.name]
    channel = Channel(Radio(), 100.0, D2D())
    expected = moved_in_steps(PATH, USERS, channel, s_curve(9.0, law.acceleration_m_s2, law.jerk_m_s3))
    assert bits(PATH, USERS, rules=rules, speed_m_s=9.0) == pytest.approx(expected, rel=1e-6, abs=1.0)


def chord_bits(half_m, aside_m, speed, gamma0, height):
    """B·∫ log2(1 + γ0/(x² + a²)) dx/v over a chord, α = 2, by ∫ ln(x² + A) = x·ln(x² + A) − 2x + 2√A·atan(x/√A)."""

    def part(a):
        return half_m * np.log(half_m**2 + a) - 2 * half_m + 2 * np.sqrt(a) * np.arctan(half_m / np.sqrt(a))

    square = height**2 + aside_m**2
    return 1e6 * 2 * (part(square + gamma0) - part(square)) / np.log(2) / speed


@pytest.mark.parametrize("height", [1.0, 20.0, 100.0, 350.0])
def test_at_one_speed_past_a_user_it_is_the_closed_form(height):
    channel = Channel(Radio(), height, D2D())
    aside = 0.3 * channel.radius_m
    half = np.sqrt(channel.radius_m**2 - aside**2)
    found = bits(
        [(0, 0), (4000, 0)], [(2000, aside)], altitude_m=height, acceleration_m_s2=0.0, speed_m_s=7.0
    )
    assert found[0] == pytest.approx(chord_bits(half, aside, 7.0, channel.gamma0, height), rel=1e-9)


def test_nobody_beyond_the_radius_receives_anything():
    radius = Channel(Radio(), 100.0, D2D()).radius_m
    assert bits([(0, 0), (2000, 0)], [(1000, radius + 0.01), (2000 + radius + 0.01, 0)]).tolist() == [
        0.0,
        0.0,
    ]
    assert (bits([(0, 0), (2000, 0)], [(1000, radius - 0.01), (2000 + radius - 0.01, 0)]) > 0).all()


def test_a_speed_beyond_the_autopilots_limit_is_counted_as_planned():
    at_10, at_20 = (bits(PATH, USERS, speed_m_s=v, acceleration_m_s2=0.0) for v in (10.0, 20.0))
    np.testing.assert_allclose(at_20, at_10 / 2)


def test_a_point_that_is_only_turned_at_is_passed_at_full_speed_and_its_corner_cut():
    through = bits(PATH, USERS, stops=[2], acceleration_m_s2=1.0)
    at_once = bits(PATH, USERS, acceleration_m_s2=0.0)
    assert (through <= at_once + 1.0).all()
    best_bit_s = 1e6 * np.log2(1 + Channel(Radio(), 100.0, D2D()).gamma0 / 100.0**2)
    assert (at_once - through <= best_bit_s * 4.0 / 10.0).all()  # two metres of either leg at 10 m/s
    assert (through[:4] < at_once[:4] - 1e5).any()


@settings(max_examples=40)
@given(
    path=st.lists(st.tuples(st.floats(-2000, 2000), st.floats(-2000, 2000)), min_size=1, max_size=6),
    speed=st.floats(1.0, 20.0),
    acceleration=st.one_of(st.none(), st.floats(0.1, 10.0)),
)
def test_brakes_only_add_and_no_leg_gives_more_than_its_time_at_the_best_rate(path, speed, acceleration):
    users = np.random.default_rng(1).uniform(-1500, 1500, (12, 2))
    points = [(0.0, 0.0), *path]
    at_once = bits(points, users, speed_m_s=speed, acceleration_m_s2=0.0)
    braking = bits(points, users, speed_m_s=speed, acceleration_m_s2=acceleration)
    channel = Channel(Radio(), 100.0, D2D())
    best_bit_s = 1e6 * float(channel.air_rate(np.zeros(1))[0])
    length = np.linalg.norm(np.diff(np.array(points), axis=0), axis=1).sum()
    assert (at_once <= braking * (1 + 1e-9) + 1e-3).all()
    assert (at_once <= best_bit_s * length / speed * (1 + 1e-9)).all()


def test_integrals_of_peaks_and_steps_are_right():
    centre, width = np.array([0.3, 0.5, 0.9]), np.array([1e-3, 0.1, 1e-2])

    def peak(which, x):
        return 1 / (1 + ((x - centre[which, None]) / width[which, None]) ** 2)

    found = integrate(peak, np.zeros(3), np.ones(3))
    exact = width * (np.arctan((1 - centre) / width) + np.arctan(centre / width))
    assert found == pytest.approx(exact, rel=1e-7)
    step = integrate(lambda _, x: (x > 0.7071).astype(float), np.zeros(1), np.ones(1))
    assert step == pytest.approx([0.2929], abs=1e-6)


def counted(scenario, counts):
    return dataclasses.replace(scenario, service=dataclasses.replace(scenario.service, in_flight=counts))


@settings(max_examples=15)
@given(seed=st.integers(0, 1000), demand_mbit=st.floats(0.1, 300.0), clusters=st.integers(1, 6))
def test_what_is_received_in_flight_need_not_be_hovered_for(seed, demand_mbit, clusters):
    rng = np.random.default_rng(seed)
    scenario = make_scenario(rng.uniform(0, 1500, (12, 2)), demand_mbit=demand_mbit, clusters=clusters)
    trajectory = plan_trajectory(scenario)
    without = hold_times(counted(scenario, False), trajectory, PX4)
    holds = hold_times(counted(scenario, True), trajectory, PX4)
    assert without.in_flight_bit is None
    assert holds.asked_s.sum() <= without.asked_s.sum() + 1e-6
    channel = Channel(scenario.radio, 100.0, scenario.d2d)
    hovering = broadcast_rates(scenario.users, trajectory.stops_m, channel) @ holds.stored_s
    assert (holds.in_flight_bit + hovering >= demand_mbit * 1e6 - 1.0).all()


@settings(max_examples=60)
@given(
    legs_m=st.lists(st.floats(0.5, 150.0), min_size=1, max_size=6),
    speed_m_s=st.sampled_from([2.0, 5.0, 10.0, 12.0]),
    rules=st.sampled_from([ARDUPILOT, PX4]),
)
def test_no_second_counts_in_flight_and_in_the_hold_too(legs_m, speed_m_s, rules):
    """PX4's hold begins metres before the stop: from then on service is the hold's."""
    path = np.array([(0.0, 0.0), *zip(np.cumsum(legs_m), np.zeros(len(legs_m)), strict=True)])
    received = bits(path, path[1:], rules=rules, speed_m_s=speed_m_s)
    flight_s = Flyer(rules).legs(np.diff(path, axis=0), speed_m_s)[0].sum()
    best_bit_s = Radio().bandwidth_hz * Channel(Radio(), 100.0, D2D()).air_rate(np.zeros(1))[0]
    assert (received <= best_bit_s * flight_s * (1 + 1e-9)).all()


def test_enough_received_in_flight_leaves_no_hold():
    scenario = counted(make_scenario([(500.0, 0.0)], demand_mbit=20.0), True)
    trajectory = flown([(0, 0), (900, 0)], [(500.0, 0.0)], Channel(Radio(), 100.0, D2D()))
    assert hold_times(scenario, trajectory, PX4).asked_s.tolist() == [0.0]


def test_the_plan_says_what_each_user_receives_in_flight():
    scenario = make_scenario([(500.0, 0.0), (900.0, 800.0)], demand_mbit=300.0)
    assert "in_flight_mbit" not in summary(make_plan(scenario))["users"][0]
    plan = make_plan(counted(scenario, True))
    shown = [user["in_flight_mbit"] for user in summary(plan)["users"]]
    assert shown == pytest.approx(plan.holds.in_flight_bit / 1e6)
    received = f"{plan.holds.in_flight_bit.sum() / 1e6:,.0f}"
    assert totals(plan)[-1] == f"in flight: {received} of 600 Mbit are received on the way"


def test_one_at_a_time_nothing_is_counted_in_flight():
    scenario = make_scenario([(500.0, 0.0), (900.0, 0.0)], mode="tdma")
    trajectory = plan_trajectory(scenario)
    forced = dataclasses.replace(scenario, service=Service(mode="tdma", in_flight=True))
    np.testing.assert_array_equal(
        hold_times(forced, trajectory, PX4).asked_s, hold_times(scenario, trajectory, PX4).asked_s
    )
    report = Report()
    check_service(forced.service, "x.toml", report)
    assert [str(problem) for problem in report.problems()] == [
        'x.toml, [service] in_flight: found true with mode = "tdma"; in flight only a broadcast is counted: '
        'false, or mode = "broadcast"'
    ]


def test_the_key_is_read_from_the_scenario(tmp_path):
    (tmp_path / "users.csv").write_text("lat_deg,lon_deg\n46.501,7.5\n")
    home = "users = 'users.csv'\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600.0\n"
    for text, expected in (("", None), ("in_flight = true", True), ("in_flight = false", False)):
        (tmp_path / "scenario.toml").write_text(f"{home}[service]\n{text}\n")
        assert load_scenario(tmp_path / "scenario.toml").service.in_flight is expected
