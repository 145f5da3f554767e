"""The motion law that both autopilots follow: legs from rest to rest with a limit on speed, acceleration and jerk.

An S-curve, or a trapezoid where the jerk has no limit. Which limits an autopilot has is in
`mavplan.mission.flight_law`; that a turning point is no rest, in `mavplan.mission.turning`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

RAMP_NODES = 64
"""Points at which the power of a ramp is looked at; a thousandth of it is not missed."""


def trapezoid_time_s(distance_m: ArrayLike, speed_m_s: float, acceleration_m_s2: float) -> Floats:
    """Return the time from rest to rest with a limit on speed and acceleration.

    Parameters
    ----------
    distance_m
        Any shape, not negative.
    speed_m_s
        Positive.
    acceleration_m_s2
        0 or infinity reach speed at once.

    Returns
    -------
    ndarray
        Seconds, same shape: d/v + v/a where d ≥ v²/a, else 2·√(d/a).
    """
    return rest_to_rest(distance_m, speed_m_s, acceleration_m_s2).time_s


def s_curve_time_s(
    distance_m: ArrayLike, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float
) -> Floats:
    """Return the time from rest to rest with a limit on speed, acceleration and jerk.

    Reaching a speed v takes t(v) = v/a + a/j where v ≥ a²/j, else 2·√(v/j), over v·t(v)/2. A leg of at least
    v·t(v) takes d/v + t(v); a shorter one 2·t(u) with the peak speed u that fits it, u·t(u) = d.

    Parameters
    ----------
    distance_m
        Any shape, not negative.
    speed_m_s, acceleration_m_s2, jerk_m_s3
        Positive limits.

    Returns
    -------
    ndarray
        Seconds, same shape.
    """
    return rest_to_rest(distance_m, speed_m_s, acceleration_m_s2, jerk_m_s3).time_s


@dataclass(frozen=True, eq=False)
class Legs:
    """Straight legs from rest to rest: up a ramp, on at the peak speed, down the same ramp. Arrays of one shape.

    Attributes
    ----------
    peak_m_s
        Greatest speed; 0 for a leg of no length.
    ramp_s
        From rest to the peak, and from the peak to rest.
    plateau_s
        At the peak.
    acceleration_m_s2, jerk_m_s3
        The limits; infinite where there is none.
    """

    peak_m_s: Floats
    ramp_s: Floats
    plateau_s: Floats
    acceleration_m_s2: float
    jerk_m_s3: float

    @property
    def time_s(self) -> Floats:
        """From rest to rest."""
        return np.asarray(2 * self.ramp_s + self.plateau_s)

    def speed_m_s(self, since_s: ArrayLike) -> Floats:
        """Return the speed a time after the beginning of the ramp up; the peak beyond it."""
        since = np.clip(np.asarray(since_s, dtype=np.float64), 0.0, self.ramp_s)
        until = self.ramp_s - since
        if math.isinf(self.jerk_m_s3):
            steady = np.asarray(self.ramp_s > 0)
            return np.where(steady, self.peak_m_s * since / np.where(steady, self.ramp_s, 1.0), self.peak_m_s)
        bent = self._bent_s
        straight = self.jerk_m_s3 * bent * (since - bent / 2)
        late = self.peak_m_s - self.jerk_m_s3 * until**2 / 2
        return np.where(since < bent, self.jerk_m_s3 * since**2 / 2, np.where(until < bent, late, straight))

    def way_m(self, since_s: ArrayLike) -> Floats:
        """Return the way from the beginning of the ramp up, of a time up to its end."""
        since = np.clip(np.asarray(since_s, dtype=np.float64), 0.0, self.ramp_s)
        until = self.ramp_s - since
        if math.isinf(self.jerk_m_s3):
            return np.asarray(since * self.speed_m_s(since) / 2)
        bent, j = self._bent_s, self.jerk_m_s3
        # Of the straight part, the parabola through its beginning; of the last, what is missing to the whole ramp.
        straight = j * bent * (since**2 - bent * since + bent**2 / 3) / 2
        late = self.peak_m_s * self.ramp_s / 2 - self.peak_m_s * until + j * until**3 / 6
        return np.where(since < bent, j * since**3 / 6, np.where(until < bent, late, straight))

    def acceleration_at(self, since_s: ArrayLike) -> Floats:
        """Return the acceleration a time after the beginning of the ramp up; 0 at its end."""
        since = np.clip(np.asarray(since_s, dtype=np.float64), 0.0, self.ramp_s)
        until = self.ramp_s - since
        if math.isinf(self.jerk_m_s3):
            return np.where(until > 0, self.acceleration_m_s2, 0.0)
        return np.asarray(self.jerk_m_s3 * np.minimum(np.minimum(since, until), self._bent_s))

    def ramp_mean(self, power_w: Callable[[ArrayLike], Floats]) -> Floats:
        """Return the mean of a function of speed over the time of a ramp; its value at the peak where there is none."""
        shares = (np.arange(RAMP_NODES) + 0.5) / RAMP_NODES
        peak_m_s, ramp_s = np.asarray(self.peak_m_s)[..., None], np.asarray(self.ramp_s)[..., None]
        sampled = replace(self, peak_m_s=peak_m_s, ramp_s=ramp_s)
        return np.asarray(power_w(sampled.speed_m_s(ramp_s * shares)).mean(axis=-1))

    @property
    def _bent_s(self) -> Floats:
        """How long the acceleration grows, and how long it falls again."""
        a, j = self.acceleration_m_s2, self.jerk_m_s3
        return np.minimum(a / j, np.sqrt(self.peak_m_s / j))


def rest_to_rest(
    distance_m: ArrayLike,
    speed_m_s: ArrayLike,
    acceleration_m_s2: float = math.inf,
    jerk_m_s3: float = math.inf,
) -> Legs:
    """Return how legs are flown from rest to rest.

    Parameters
    ----------
    distance_m, speed_m_s
        Not negative, and positive; of one shape, or either a number.
    acceleration_m_s2, jerk_m_s3
        Limits; an acceleration of 0 or infinity reaches speed at once.

    Returns
    -------
    Legs
    """
    distance, speed = np.broadcast_arrays(
        np.asarray(distance_m, dtype=np.float64), np.asarray(speed_m_s, dtype=np.float64)
    )
    a, j = acceleration_m_s2, jerk_m_s3
    if a == 0 or math.isinf(a):
        at_once = np.where(distance > 0, speed, 0.0)
        return Legs(at_once, np.zeros(distance.shape), distance / speed, math.inf, math.inf)
    if math.isinf(j):
        peak = np.minimum(np.sqrt(distance * a), speed)
        ramp = peak / a
    else:
        knee = a / j
        with_plateau = (np.sqrt(knee**2 + 4 * distance / a) - knee) * a / 2
        without_plateau = np.cbrt(distance**2 * j / 4)
        peak = np.minimum(np.where(distance >= 2 * a**3 / j**2, with_plateau, without_plateau), speed)
        ramp = np.where(peak >= a * knee, peak / a + knee, 2 * np.sqrt(peak / j))
    plateau = np.maximum(distance - peak * ramp, 0.0) / speed
    return Legs(peak, ramp, plateau, a, j)
