"""Straight up and straight down: take-off and landing of both firmwares, fitted to recordings."""

import math

from sitl_mock.flight import ardupilot_legs as ardu
from sitl_mock.flight import px4_legs as px4
from sitl_mock.flight.curves import Pieces

FALL_M_S = 12.0
FALL_ACCEL = 9.81


def ardupilot_takeoff(height_m: float, up_m_s: float, delay_s: float) -> tuple[Pieces, float]:
    """Return a climb from rest and when it counts as done."""
    curve = Pieces().poly(delay_s)
    if height_m <= 0:
        return curve, curve.end_s
    top = min(up_m_s, math.sqrt(2 * height_m / (1 / ardu.TAKEOFF_RISE + 1 / ardu.TAKEOFF_SLOW)))
    curve.poly(top / ardu.TAKEOFF_RISE, ardu.TAKEOFF_RISE)
    slow_m = top * top / (2 * ardu.TAKEOFF_SLOW)
    curve.poly((height_m - curve.length_m - slow_m) / top)
    curve.poly(top / ardu.TAKEOFF_SLOW, -ardu.TAKEOFF_SLOW)
    return curve, curve.when(height_m - min(ardu.TAKEOFF_LEFT_M, height_m / 2))


def ardupilot_descent(height_m: float, down_m_s: float) -> Pieces:
    """Return a landing from this height above the ground."""
    curve = Pieces()
    slow_m = (down_m_s + ardu.LAND_SLOW_M_S) / 2 * ardu.LAND_RAMP_S
    fast_m = height_m - max(ardu.LAND_SLOW_FROM_M, slow_m) - down_m_s**2 / 2
    if fast_m > 0:
        curve.poly(down_m_s, 1.0).poly(fast_m / down_m_s).ramp(ardu.LAND_SLOW_M_S, ardu.LAND_RAMP_S)
    else:
        curve.ramp(ardu.LAND_SLOW_M_S, min(1.0, height_m))
    return curve.poly(max(height_m - curve.length_m, 0.0) / ardu.LAND_SLOW_M_S)


def px4_takeoff(height_m: float, delay_s: float) -> tuple[Pieces, float]:
    """Return a climb from rest and when it counts as done."""
    curve = Pieces().poly(delay_s)
    if height_m <= 0:
        return curve, curve.end_s
    slow, fast, rate = px4.TAKEOFF_SLOW_M_S, px4.TAKEOFF_FAST_M_S, px4.TAKEOFF_NEARING
    top = min(slow, rate * height_m / 2)
    curve.ramp(top, 2 * min(height_m, 0.7) / 2 / top)
    slow_end = min(px4.TAKEOFF_SLOW_M, height_m - top / rate)
    curve.poly((slow_end - curve.length_m) / top)
    left = height_m - curve.length_m
    rise_m = (slow + fast) / 2 * 1.2
    if slow_end >= px4.TAKEOFF_SLOW_M and left > rise_m + fast / rate:
        curve.ramp(fast, 1.2).poly((left - rise_m - fast / rate) / fast)
    elif left > slow / rate:
        curve.poly((left - slow / rate) / slow)
    curve.near(0.0, 1 / rate, 8 / rate)
    return curve, curve.when(height_m - min(px4.TAKEOFF_LEFT_M, height_m / 2))


def px4_descent(height_m: float) -> Pieces:
    """Return a landing from this height above the ground."""
    curve = Pieces()
    fast, slow, crawl = px4.LAND_FAST_M_S, px4.LAND_M_S, px4.LAND_CRAWL_M_S
    if height_m > px4.LAND_SLOW_FROM_M + 0.5:
        curve.ramp(fast, 0.6).poly((height_m - px4.LAND_SLOW_FROM_M - curve.length_m) / fast)
        decel = (fast**2 - slow**2) / (2 * (px4.LAND_SLOW_FROM_M - px4.LAND_SLOW_TO_M))
        curve.poly((fast - slow) / decel, -decel)
    elif height_m > px4.LAND_CRAWL_FROM_M + 0.3:
        curve.ramp(slow, 0.4)
    curve.poly(max(height_m - px4.LAND_CRAWL_FROM_M - curve.length_m, 0.0) / slow)
    if curve.speed_m_s == 0:
        curve.ramp(crawl, 0.2)
    curve.speed_m_s = crawl
    return curve.poly(max(height_m - curve.length_m, 0.0) / crawl)


def fall(height_m: float, sink_m_s: float) -> Pieces:
    """Return a fall without thrust, as fast as the air lets it."""
    top = min(FALL_M_S, math.sqrt(sink_m_s**2 + 2 * FALL_ACCEL * max(height_m, 0.0)))
    curve = Pieces(max(sink_m_s, 0.0))
    curve.poly(max(top - curve.speed_m_s, 0.0) / FALL_ACCEL, FALL_ACCEL)
    return curve.poly(max(height_m - curve.length_m, 0.0) / max(top, 0.1))
