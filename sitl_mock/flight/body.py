"""Where the vehicle is: a sum of motions along lines, each with its own beginning.

A leg, a braking and a push of the wind simply add up, so a vehicle can brake while it already turns to the next
place, and every position is in closed form: nothing has to be stepped through.
"""

import math
from dataclasses import dataclass

from sitl_mock.flight.curves import Curve, brake

Vector = tuple[float, float, float]
"""North, east, up; metres or metres per second."""

STILL_M_S = 0.02


@dataclass(frozen=True, slots=True)
class Part:
    """One motion along a line."""

    start_s: float
    direction: Vector
    curve: Curve

    @property
    def end_s(self) -> float:
        """When it is over."""
        return self.start_s + self.curve.end_s


def unit(vector: Vector) -> Vector:
    """Return the direction of a vector; of none: up."""
    length = math.hypot(*vector)
    return (0.0, 0.0, 1.0) if length == 0 else (vector[0] / length, vector[1] / length, vector[2] / length)


def minus(a: Vector, b: Vector) -> Vector:
    """Return ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def plus(a: Vector, b: Vector, times: float = 1.0) -> Vector:
    """Return ``a + times b``."""
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]


class Body:
    """A vehicle's motion.

    Parameters
    ----------
    place
        Where it stands at first.
    """

    def __init__(self, place: Vector = (0.0, 0.0, 0.0)) -> None:
        self._anchor = place
        self._parts: list[Part] = []
        self._pushes: list[Part] = []

    def at(self, t_s: float, *, pushed: bool = True) -> tuple[Vector, Vector]:
        """Return place and velocity; `pushed`: with what the wind does to it."""
        n, e, u = self._anchor
        vn = ve = vu = 0.0
        for part in [*self._parts, *self._pushes] if pushed else self._parts:
            s, v = part.curve.at(t_s - part.start_s)
            dn, de, du = part.direction
            n, e, u = n + s * dn, e + s * de, u + s * du
            vn, ve, vu = vn + v * dn, ve + v * de, vu + v * du
        return (n, e, u), (vn, ve, vu)

    def add(self, part: Part) -> None:
        """Add a motion."""
        self._parts.append(part)

    def push(self, part: Part) -> None:
        """Add a motion that the vehicle does not want; it stays when others are dropped."""
        self._pushes.append(part)

    def off_m(self, t_s: float) -> float:
        """Return how far the wind holds it from where it wants to be."""
        n = e = u = 0.0
        for part in self._pushes:
            s, _ = part.curve.at(t_s - part.start_s)
            n, e, u = n + s * part.direction[0], e + s * part.direction[1], u + s * part.direction[2]
        return math.hypot(n, e, u)

    def pushed_until_s(self) -> float:
        """Return when the last push is over."""
        return max((part.end_s for part in self._pushes), default=-math.inf)

    def rest(self, t_s: float, place: Vector | None = None) -> Vector:
        """Drop all motions: it stands here, or at `place`; return how fast it was."""
        here, velocity = self.at(t_s, pushed=False)
        self._anchor, self._parts = place or here, []
        self._pushes = [part for part in self._pushes if part.end_s > t_s]
        return velocity

    def crash(self, t_s: float) -> None:
        """Drop all motions and pushes: it falls from where it really is."""
        here, _ = self.at(t_s)
        self._anchor, self._parts, self._pushes = here, [], []

    def stop(self, t_s: float, decel: float) -> Vector:
        """Drop all motions and brake; return where it comes to rest."""
        velocity = self.rest(t_s)
        speed = math.hypot(*velocity)
        if speed < STILL_M_S:
            return self._anchor
        part = Part(t_s, unit(velocity), brake(speed, decel))
        self.add(part)
        return plus(self._anchor, part.direction, speed * speed / (2 * decel))
