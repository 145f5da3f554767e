"""The air: a steady wind, gusts, and the slow wandering of a hovering vehicle. All chance comes from a seed."""

import math
import random
from dataclasses import dataclass

from sitl_mock.flight.body import Part, Vector
from sitl_mock.flight.curves import Pieces

AIRSPEED_M_S = 11.8
"""The most a vehicle makes through the air: a head wind of 6 m/s was measured to leave 5.8 m/s."""
GUST_OUT_M_S, GUST_BACK_M_S, GUST_STAYS_S, GUST_RAMP_S = 12.0, 6.0, 8.0, 2.0
FOREVER_S = 1e7


@dataclass(frozen=True, slots=True)
class Wind:
    """A steady wind.

    Attributes
    ----------
    speed_m_s
        Its speed.
    from_deg
        Where it comes from: 0 is north, 90 is east.
    """

    speed_m_s: float = 0.0
    from_deg: float = 0.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.speed_m_s <= 100.0 and -360.0 <= self.from_deg <= 360.0):
            raise ValueError(
                f"wind {self.speed_m_s:g} m/s from {self.from_deg:g} degrees: 0 to 100 m/s from -360 to 360"
            )

    @property
    def vector(self) -> Vector:
        """Where the air goes, in metres per second."""
        towards = math.radians(self.from_deg + 180.0)
        return self.speed_m_s * math.cos(towards), self.speed_m_s * math.sin(towards), 0.0

    def fastest(self, direction: Vector) -> float:
        """Return the greatest speed over ground along a direction, at least a crawl."""
        level = math.hypot(direction[0], direction[1])
        if self.speed_m_s == 0 or level < 1e-6:
            return math.inf
        wind = self.vector
        along = (wind[0] * direction[0] + wind[1] * direction[1]) / level
        across = math.sqrt(max(self.speed_m_s**2 - along**2, 0.0))
        return max(math.sqrt(max(AIRSPEED_M_S**2 - across**2, 0.0)) + along, 0.05) / level

    def carries(self, t_s: float) -> Part | None:
        """Return how it carries the vehicle away from `t_s` on, if it is stronger than the vehicle."""
        excess = self.speed_m_s - AIRSPEED_M_S
        if excess <= 0:
            return None
        n, e, u = self.vector
        way = (n / self.speed_m_s, e / self.speed_m_s, u)
        return Part(t_s, way, Pieces().ramp(excess, 4.0).poly(FOREVER_S))


def gust(t_s: float, metres: float, chance: random.Random) -> Part:
    """Return a gust that pushes the vehicle away, holds it there and lets it come back."""
    towards = chance.uniform(0.0, 2 * math.pi)
    out = min(GUST_OUT_M_S, metres / (2 * GUST_RAMP_S))
    back = min(GUST_BACK_M_S, metres / (2 * GUST_RAMP_S))
    curve = Pieces()
    for speed, stays_s in ((out, GUST_STAYS_S), (-back, 0.0)):
        ramps_m = abs(speed) * GUST_RAMP_S
        curve.ramp(speed, GUST_RAMP_S).poly((metres - ramps_m) / abs(speed)).ramp(0.0, GUST_RAMP_S)
        curve.poly(stays_s)
    return Part(t_s, (math.cos(towards), math.sin(towards), 0.0), curve)


class Wander:
    """A smooth, bounded, seeded function of time: how a vehicle that hovers is off its place.

    Parameters
    ----------
    level_m, height_m
        About how far, on level and in height; at most 1.8 times as much.
    chance
        Where the phases come from.
    """

    PERIODS_S = ((7.3, 0.4), (17.9, 0.6), (41.0, 0.8))

    def __init__(self, level_m: float, height_m: float, chance: random.Random) -> None:
        self._axes = [
            [
                (size * part, 2 * math.pi / period, chance.uniform(0, 2 * math.pi))
                for period, part in self.PERIODS_S
            ]
            for size in (level_m / math.sqrt(2), level_m / math.sqrt(2), height_m)
        ]

    def at(self, t_s: float) -> tuple[Vector, Vector]:
        """Return how far off and how fast."""
        off = [sum(size * math.sin(rate * t_s + phase) for size, rate, phase in axis) for axis in self._axes]
        speed = [
            sum(size * rate * math.cos(rate * t_s + phase) for size, rate, phase in axis)
            for axis in self._axes
        ]
        return (off[0], off[1], off[2]), (speed[0], speed[1], speed[2])
