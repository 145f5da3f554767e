"""How PX4's multicopter gets from place to place, fitted to a recording of its SIH quadrotor.

It reaches three quarters of its speed at once and nears the rest over many seconds; it brakes early, enters the
acceptance radius at about 2 m/s, swings a metre over the place and drifts back. Level and vertical motion are
separate; an item is reached when both are near enough.
"""

import math

from sitl_mock.flight.curves import Pieces

ACCEL = 2.5
CORNER_ACCEL = 3.0
AT_ONCE = 0.72
"""Share of the speed that is reached by plain acceleration."""
NEARING_S = 9.0
START_DELAY_S = 0.6
AFTER_TAKEOFF_S = 0.5
"""The first leg begins so much later."""
SWING_M = 0.85
SETTLE_S = 4.0
ALTITUDE_RADIUS_M = 0.8
FASTEST_M_S = 10.0
RISE_M_S, SINK_M_S, RISE_ACCEL = 3.0, 1.5, 2.0

TAKEOFF_DELAY_S = 3.85
TAKEOFF_SLOW_M_S, TAKEOFF_SLOW_M = 1.4, 10.6
"""It rises slowly as far as this."""
TAKEOFF_FAST_M_S = 2.75
TAKEOFF_NEARING = 0.45
"""Speed of rising near the end, by metres left."""
TAKEOFF_LEFT_M = 0.66
LAND_FAST_M_S, LAND_M_S, LAND_CRAWL_M_S = 1.52, 0.62, 0.33
LAND_SLOW_FROM_M, LAND_SLOW_TO_M, LAND_CRAWL_FROM_M = 10.0, 5.0, 0.8


def flown_speed(speed: float) -> float:
    """Return the speed that a commanded one comes to: 3 to 3.06, 8 to 7.9, 12 and more to about 10."""
    return min(speed * (1.04 - 0.0066 * speed), FASTEST_M_S) if speed < 20 else FASTEST_M_S


def radius_speed(speed: float) -> float:
    """Return how fast it enters the acceptance radius of a place where it stops or turns sharply."""
    return min(speed, 1.3 + 0.15 * speed)


def corner_speed(cosine: float, radius_m: float) -> float:
    """Return the greatest speed of a turn: PX4's √(a·d·tan(α/2)), α the angle between the two legs.

    Parameters
    ----------
    cosine
        Of the angle between the directions of the two legs: 1 is straight on.
    radius_m
        Acceptance radius.
    """
    alpha = math.pi - math.acos(max(-1.0, min(1.0, cosine)))
    if alpha > math.pi - 1e-3:
        return math.inf
    return math.sqrt(CORNER_ACCEL * radius_m * math.tan(alpha / 2))


def level_leg(length_m: float, speed: float, start_speed: float, end_speed: float, radius_m: float) -> Pieces:
    """Return a leg that enters the radius around its end at `end_speed` and, left alone, swings over it.

    Parameters
    ----------
    length_m
        To the place.
    speed
        As flown, see `flown_speed`.
    start_speed
        What it brings along from a leg before.
    end_speed
        At the radius.
    radius_m
        Acceptance radius.
    """
    inner = min(radius_m, length_m)
    outer = length_m - inner
    if outer <= 0:
        return _creep(length_m)
    curve = Pieces(start_speed)
    if start_speed < 0.1:
        curve.poly(START_DELAY_S)
    decel = 0.45 + 0.15 * speed
    quick = max(AT_ONCE * speed, start_speed)
    # Too short to reach the quick speed: accelerate and brake only.
    top = math.sqrt(
        max((2 * outer * ACCEL * decel + ACCEL * end_speed**2 + decel * start_speed**2) / (ACCEL + decel), 0)
    )
    if top <= quick:
        top = max(top, start_speed, 0.3)
        end_speed = min(end_speed, top)
        curve.poly((top - start_speed) / ACCEL, ACCEL)
        braking_m = (top**2 - end_speed**2) / (2 * decel)
        curve.poly(max(outer - curve.length_m - braking_m, 0.0) / top)
    else:
        curve.poly((quick - start_speed) / ACCEL, ACCEL)
        curve.near(speed, NEARING_S, _cruise_s(curve, outer, speed, min(end_speed, speed), decel))
    last = min(end_speed, curve.speed_m_s)
    curve.poly((curve.speed_m_s - last) / decel, -decel)
    curve.poly(max(outer - curve.length_m, 0.0) / max(last, 0.3))
    return _arrive(curve, length_m)


def _cruise_s(curve: Pieces, outer_m: float, speed: float, end_speed: float, decel: float) -> float:
    """Return how long it may near its speed before it must brake."""
    v0, left = curve.speed_m_s, outer_m - curve.length_m

    def needs_m(t: float) -> float:
        gone = math.exp(-t / NEARING_S)
        v = speed + (v0 - speed) * gone
        return (
            speed * t + (v0 - speed) * NEARING_S * (1 - gone) + max(v * v - end_speed**2, 0.0) / (2 * decel)
        )

    low, high = 0.0, left / max(min(v0, speed), 0.3)
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if needs_m(middle) < left else (low, middle)
    return low


def arriving(length_m: float, speed: float) -> Pieces:
    """Return the end of a leg: within the radius of its place, at a speed towards it."""
    return _arrive(Pieces(speed), length_m)


def _arrive(curve: Pieces, length_m: float) -> Pieces:
    """Add the way from the radius over the place and back."""
    left = max(length_m - curve.length_m, 0.0)
    v = curve.speed_m_s
    if v > 0.05:
        stop_m = left + SWING_M * min(1.0, v / 1.8)
        curve.poly(2 * stop_m / v, -v * v / (2 * stop_m))
    over = curve.length_m - length_m
    curve.speed_m_s = -over * 0.6 / SETTLE_S
    return curve.near(0.0, SETTLE_S, 6 * SETTLE_S)


def _creep(length_m: float) -> Pieces:
    """Return a move inside the radius: unhurried, without a swing."""
    return (
        Pieces().ramp(0.5, 1.0).ramp(0.0, max(2 * length_m / 0.5 - 1.0, 0.5)) if length_m > 0.3 else Pieces()
    )


def vertical_leg(height_m: float) -> Pieces:
    """Return a change of height, from rest to rest; lengths are positive."""
    speed = RISE_M_S if height_m > 0 else SINK_M_S
    length = abs(height_m)
    top = min(speed, math.sqrt(length * RISE_ACCEL))
    if top < 0.05:
        return Pieces()
    ramp_s = 2 * top / RISE_ACCEL
    curve = Pieces().ramp(top, ramp_s)
    if 2 * curve.length_m > length:
        ramp_s = length / top
        curve = Pieces().ramp(top, ramp_s)
    curve.poly(max(length - 2 * curve.length_m, 0.0) / top)
    return curve.ramp(0.0, ramp_s)
