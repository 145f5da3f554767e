"""PX4's way to its acceptance radius against another way to step through it, and the recorded rise of its speed."""

import math

import numpy as np
import pytest

from mavplan.mission.arrival import end_lag_s, start_lag_s
from mavplan.mission.autopilots import ARDUPILOT, PX4
from mavplan.mission.flight_law import ARDUPILOT_LAW, PX4_LAW
from mavplan.mission.forecast import leg_time_s
from mavplan.mission.motion import rest_to_rest

A, J, RADIUS_M = 3.0, 4.0, 2.0


def stepped_s(distance_m, speed_m_s, step_s=0.002):
    """Time to the radius: the jerk is full one way or the other, whichever leads the speed to the allowed one."""
    way = speed = pull = clock = 0.0
    while way < distance_m - RADIUS_M:
        # PX4: vel_final² = vel² - 2·a·(x - vel·2·a/j), solved for vel with vel_final 0.
        delay = 4 * A * A / J
        allowed = min(speed_m_s, (-delay + math.sqrt(delay**2 + 8 * A * (distance_m - way))) / 2)
        coming = speed + pull * abs(pull) / (2 * J)
        jerk = 0.0
        if abs(coming - allowed) > 1e-3:
            jerk = J if coming < allowed else -J
        elif pull:
            jerk = -math.copysign(min(J, abs(pull) / step_s), pull)
        pull = max(-A, min(A, pull + jerk * step_s))
        speed = max(speed + pull * step_s, 0.0)
        way += speed * step_s
        clock += step_s
    return clock


@pytest.mark.parametrize("speed_m_s", [1.0, 3.0, 5.0, 10.0])
@pytest.mark.parametrize("distance_m", [1.0, 2.5, 5.0, 10.0, 20.0, 40.0, 90.0, 150.0])
def test_a_leg_ends_when_the_radius_is_reached(speed_m_s, distance_m):
    legs = rest_to_rest(np.array([distance_m]), speed_m_s, A, J)
    found = legs.time_s + end_lag_s(legs, np.array([distance_m]), np.array([speed_m_s]), PX4_LAW)
    assert float(found[0]) == pytest.approx(stepped_s(distance_m, speed_m_s), abs=0.05)


def test_each_leg_has_its_own_speed():
    distance, speed = np.array([50.0, 50.0, 8.0]), np.array([3.0, 9.0, 9.0])
    legs = rest_to_rest(distance, speed, A, J)
    alone = [
        float(end_lag_s(rest_to_rest(d, v, A, J), np.array([d]), np.array([v]), PX4_LAW)[0])
        for d, v in zip(distance, speed, strict=True)
    ]
    assert end_lag_s(legs, distance, speed, PX4_LAW).tolist() == pytest.approx(alone)


def test_px4_nears_its_speed_as_recorded():
    """Asked 8 m/s, seconds after 6.07 m/s: 4 → 6.77, 8 → 7.46, 13 → 7.7. What is lost by then is what is forecast."""
    recorded = [
        (0, 6.07),
        (1, 6.11),
        (2, 6.33),
        (3, 6.53),
        (4, 6.77),
        (5, 7.02),
        (6, 7.2),
        (7, 7.33),
        (8, 7.46),
        (9, 7.38),
        (10, 7.39),
        (11, 7.57),
        (12, 7.6),
        (13, 7.7),
        (14, 7.72),
        (15, 7.82),
        (16, 7.86),
    ]
    times, speeds = np.array(recorded).T
    lost_s = np.trapezoid(1 - speeds / 7.9, times)
    legs = rest_to_rest(np.array([8.0 * 16 + 35]), 8.0, A, J)
    assert float(start_lag_s(legs, PX4_LAW)[0]) - PX4_LAW.start_lag_s == pytest.approx(lost_s, abs=0.3)


def test_ardupilot_settles_the_same_after_every_leg():
    legs = rest_to_rest(np.array([0.0, 5.0, 300.0]), 10.0, 2.5, 1.0)
    late_s = start_lag_s(legs, ARDUPILOT_LAW) + end_lag_s(
        legs, np.array([0.0, 5.0, 300.0]), np.full(3, 10.0), ARDUPILOT_LAW
    )
    assert late_s.tolist() == [0.0, 0.85, 0.85]


def test_within_its_radius_px4_is_there_at_once():
    assert float(leg_time_s(1.9, rules=PX4, speed_m_s=5.0)) == pytest.approx(PX4_LAW.start_lag_s)
    assert float(leg_time_s(1.9, rules=ARDUPILOT, speed_m_s=5.0)) > 2


@pytest.mark.parametrize("rules", [ARDUPILOT, PX4], ids=["ardupilot", "px4"])
def test_a_longer_leg_never_takes_less(rules):
    for speed_m_s in (0.5, 2.0, 7.3, 10.0):
        times = leg_time_s(np.linspace(0, 400, 4001), rules=rules, speed_m_s=speed_m_s)
        assert (np.diff(times) >= -1e-9).all()
