"""How ArduCopter gets from place to place: S-curves that its body follows a little late, fitted to a recording.

The target runs along an S-curve; the vehicle lags behind it, swings over the end and settles. A leg is finished
0.9 s after the S-curve alone would be, whatever its length (0.73 to 1.0 s measured).
"""

import math
from dataclasses import dataclass

from sitl_mock.flight.body import Vector
from sitl_mock.flight.curves import Pieces, s_curve

FASTEST_M_S = 10.0
"""Above this a higher speed changes nothing."""
JERK = 1.0
START_LAG_S = 0.35
"""From the order to move to the first movement."""
SWING_S = 0.6
"""From the farthest point of the swing over the end to "finished"."""
FINISH_LAG_S = 0.9
THROUGH_LAG_S = 0.3
"""More lag at the end of a leg that is flown through."""
MIDDLE_LAG_S = 0.6
"""How late the vehicle is in the middle of a leg of 100 m or more."""
FALLS_BEHIND_S, MAKES_UP_S = 10.0, 5.0
"""How long it takes to become so late, and to make up for it at the end."""
SETTLE_S = 1.1
CORNER_STEP_S = 0.05
BRAKING = 2.5
RISE_ACCEL = 1.0
"""Vertical acceleration of a leg."""

TAKEOFF_DELAY_S = 3.15
"""From the start to the first movement: the motors spool up."""
TAKEOFF_RISE, TAKEOFF_SLOW = 1.02, 0.565
TAKEOFF_LEFT_M = 0.04
"""It is done so far below its height."""
LAND_SLOW_FROM_M = 11.4
LAND_SLOW_M_S = 0.5
LAND_RAMP_S = 1.2


class Followed:
    """A leg as flown: an S-curve, late, with a swing over its end that settles.

    Parameters
    ----------
    length_m
        From the beginning to the place meant.
    target
        The S-curve to the end of the swing.
    delay_s
        Before anything moves.
    arrive_s
        At the farthest point of the swing.
    swing_m, rest_m
        How far beyond the place the swing goes, and where it settles.
    """

    def __init__(
        self,
        length_m: float,
        target: Pieces,
        delay_s: float,
        arrive_s: float,
        swing_m: float,
        rest_m: float,
    ) -> None:
        self._length_m, self._target = length_m, target
        self._delay_s, self._arrive_s = delay_s, arrive_s
        self._swing_m, self._rest_m = swing_m, rest_m
        self._late_s = MIDDLE_LAG_S * min(1.0, length_m / 100.0)
        self.end_s = arrive_s + (12 * SETTLE_S if swing_m or rest_m else 0.0)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return metres and metres per second."""
        if t_s <= self._delay_s:
            return 0.0, 0.0
        if t_s < self._arrive_s:
            span, gone = self._arrive_s - self._delay_s, t_s - self._delay_s
            rate = self._target.end_s / span
            falls_s, makes_up_s = min(FALLS_BEHIND_S, span * 0.5), min(MAKES_UP_S, span * 0.4)
            behind, slower = _bend(gone / falls_s)
            made_up, faster = _bend((gone - span + makes_up_s) / makes_up_s)
            s, v = self._target.at(rate * gone - self._late_s * (behind - made_up))
            return s, v * (rate - self._late_s * (slower / falls_s - faster / makes_up_s))
        x = (t_s - self._arrive_s) / SETTLE_S
        left = math.exp(-x)
        swing = self._swing_m - self._rest_m
        return (
            self._length_m + self._rest_m + swing * (1 + x) * left,
            -swing * x * left / SETTLE_S if x < 12 else 0.0,
        )


def _bend(x: float) -> tuple[float, float]:
    """Return a smooth way from 0 to 1 and its slope."""
    return (x * x * (3 - 2 * x), 6 * x * (1 - x)) if 0 < x < 1 else (float(x >= 1), 0.0)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a leg may do: metres per second level, up and down; metres per second squared level."""

    level: float
    up: float
    down: float
    accel: float

    def along(self, direction: Vector) -> tuple[float, float]:
        """Return speed and acceleration along a direction."""
        level, rise = math.hypot(direction[0], direction[1]), direction[2]
        speeds, accels = [], []
        if level > 1e-6:
            speeds.append(self.level / level)
            accels.append(self.accel / level)
        if abs(rise) > 1e-6:
            speeds.append((self.up if rise > 0 else self.down) / abs(rise))
            accels.append(RISE_ACCEL / abs(rise))
        return max(min(speeds), 0.05), min(accels)


def leg(
    length_m: float, flown_m: float, speed: float, accel: float, swing_m: float, rest_m: float
) -> tuple[Followed, float]:
    """Return a leg from rest to rest and when it is finished.

    Parameters
    ----------
    length_m, flown_m
        From the place of the last leg, which sets the time; from where the vehicle really is.
    speed, accel
        Greatest.
    swing_m, rest_m
        See `Followed`.
    """
    finish_s = s_curve(length_m, speed, accel, JERK).end_s + FINISH_LAG_S
    target = s_curve(flown_m + swing_m, speed, accel, JERK)
    return Followed(flown_m, target, START_LAG_S, finish_s - SWING_S, swing_m, rest_m), finish_s


def overlap_s(
    first: Pieces,
    second: Pieces,
    turn: tuple[Vector, Vector],
    radius_m: float,
    speed: float,
    accel: float,
) -> float:
    """Return how long before the end of one leg the next one begins where it is flown through.

    The next leg may begin as soon as the sum of both, half-way through, is within the radius, no faster than
    `speed` and bends no harder than twice the acceleration: the rule of ArduPilot's SCurve.

    Parameters
    ----------
    first, second
        The S-curves of both legs.
    turn
        Their directions.
    radius_m, speed, accel
        Of the waypoint; the lower speed of both legs; along the legs.
    """
    (an, ae, au), (bn, be, bu) = turn
    left = min(first.end_s, second.end_s) / 2
    while left > 0:
        half = left / 2
        s1, v1 = first.at(first.end_s - half)
        s2, v2 = second.at(half)
        back = first.length_m - s1
        off = math.hypot(bn * s2 - an * back, be * s2 - ae * back, bu * s2 - au * back)
        through = math.hypot(an * v1 + bn * v2, ae * v1 + be * v2)
        step = 0.01
        slow = (v1 - first.at(first.end_s - half + step)[1]) / step
        fast = (second.at(half + step)[1] - v2) / step
        bend = math.hypot(bn * fast - an * slow, be * fast - ae * slow)
        if off < radius_m and through <= speed + 1e-6 and bend < 2 * accel:
            return left
        left -= CORNER_STEP_S
    return 0.0
