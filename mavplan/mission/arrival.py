"""How much later than its S-curve a leg begins, and when its hold begins: ArduPilot settles, PX4 is still braking.

PX4's hold begins within its acceptance radius, while the speed still follows the greatest one from which it can stop in
the way that is left (computeMaxSpeedFromDistance, src/lib/mathlib/math/TrajMath.hpp). It comes to most of its speed at
once and nears the rest over many seconds, as recorded.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mavplan.mission.flight_law import FlightLaw
from mavplan.mission.motion import Legs

Floats = NDArray[np.float64]

STEP_S = 0.01
TABLE_STEPS = 128
"""Distances at which the way of a leg is followed step by step; between them times lie on straight lines."""


def start_lag_s(legs: Legs, law: FlightLaw) -> Floats:
    """Return what L legs lose at their beginning against their S-curve."""
    neared = 1 - np.exp(-legs.plateau_s / law.nearing_s) if law.nearing_s else 0.0
    return np.where(legs.peak_m_s > 0, law.start_lag_s + law.nearing_loss_s * neared, 0.0)


def end_lag_s(legs: Legs, distance_m: Floats, speed_m_s: Floats, law: FlightLaw) -> Floats:
    """Return how long after the end of their S-curve the holds of L legs begin; less than 0 where it is before."""
    if law.arrival_radius_m == 0:
        return np.where(distance_m > 0, law.settle_s, 0.0)
    arrived = np.empty_like(distance_m)
    for speed in np.unique(speed_m_s):
        own = speed_m_s == speed
        ways_m, times_s = _arrivals(float(speed), law)
        beyond_m = np.maximum(distance_m[own] - ways_m[-1], 0.0)
        arrived[own] = np.interp(distance_m[own], ways_m, times_s) + beyond_m / speed
    return arrived - legs.time_s


@lru_cache(maxsize=64)
def _arrivals(speed_m_s: float, law: FlightLaw) -> tuple[Floats, Floats]:
    """Return distances, from the acceptance radius to where full speed is flown, and the times from rest until it.

    The speed follows the greatest one from which the vehicle can stop, as fast as acceleration and jerk let it.
    """
    a, j, radius_m = law.acceleration_m_s2, law.jerk_m_s3, law.arrival_radius_m
    # It can stop from v in (v² + b·v)/(2a), b = 4a²/j.
    b = 4 * a * a / j
    ramp_m = speed_m_s * (speed_m_s / a + a / j) / 2
    full_m = 1.2 * (ramp_m + (speed_m_s**2 + b * speed_m_s) / (2 * a))
    ways_m = radius_m + np.linspace(0.0, full_m, TABLE_STEPS)
    left_m, times_s = ways_m.copy(), np.zeros(TABLE_STEPS)
    speed, pull = np.zeros(TABLE_STEPS), np.zeros(TABLE_STEPS)
    while (moving := left_m > radius_m).any():
        allowed = np.minimum(speed_m_s, (np.sqrt(b * b + 8 * a * left_m) - b) / 2)
        # Where the speed would come to if the acceleration went to 0 from here on.
        coming = speed + pull * np.abs(pull) / (2 * j)
        wanted = np.clip((allowed - coming) / STEP_S, -j, j)
        pull = np.clip(pull + wanted * STEP_S, -a, a)
        gained_m = np.maximum(speed + pull * STEP_S, 0.0) * STEP_S
        # Of the last step, the part until the radius.
        times_s += (
            np.where(moving, np.minimum((left_m - radius_m) / np.maximum(gained_m, 1e-12), 1.0), 0) * STEP_S
        )
        speed, left_m = gained_m / STEP_S, left_m - gained_m
    return ways_m, times_s
