"""Motion along a line, in closed form: how far and how fast at any time.

A `Curve` is a row of pieces. In a piece the jerk is constant, or the speed nears another one exponentially. Nothing is
integrated in steps, so a curve costs the same whether it lasts a second or an hour.
"""

import math
from bisect import bisect_right
from typing import Protocol


class Curve(Protocol):
    """Distance and speed by time; before 0 nothing has moved, after `end_s` nothing moves any more."""

    end_s: float

    def at(self, t_s: float) -> tuple[float, float]:
        """Return metres and metres per second."""


class Pieces:
    """A curve put together piece by piece, each beginning where and as fast as the one before it ended.

    Parameters
    ----------
    speed_m_s
        At time 0.
    """

    def __init__(self, speed_m_s: float = 0.0) -> None:
        self._starts: list[float] = []
        self._pieces: list[tuple[float, float, float, float, float, float]] = []
        self.end_s = 0.0
        self.length_m = 0.0
        self.speed_m_s = speed_m_s

    def poly(self, duration_s: float, accel: float = 0.0, jerk: float = 0.0) -> "Pieces":
        """Add a piece of constant jerk that begins with this acceleration."""
        return self._add(duration_s, (self.length_m, self.speed_m_s, accel, jerk, 0.0, 0.0))

    def near(self, speed_m_s: float, tau_s: float, duration_s: float) -> "Pieces":
        """Add a piece in which the speed nears another one by the factor e in `tau_s`."""
        return self._add(duration_s, (self.length_m, self.speed_m_s, 0.0, 0.0, speed_m_s, tau_s))

    def ramp(self, speed_m_s: float, duration_s: float) -> "Pieces":
        """Add a change of speed without a jump in the acceleration."""
        change, half = speed_m_s - self.speed_m_s, duration_s / 2
        if duration_s <= 0:
            return self
        jerk = change / half**2
        return self.poly(half, 0.0, jerk).poly(half, jerk * half, -jerk)

    def _add(self, duration_s: float, piece: tuple[float, float, float, float, float, float]) -> "Pieces":
        if duration_s > 0:
            self._starts.append(self.end_s)
            self._pieces.append(piece)
            self.end_s += duration_s
            self.length_m, self.speed_m_s = _along(piece, duration_s)
        return self

    def at(self, t_s: float) -> tuple[float, float]:
        """Return metres and metres per second."""
        if t_s <= 0 or not self._starts:
            return 0.0, self._pieces[0][1] if self._pieces and t_s == 0 else 0.0
        if t_s >= self.end_s:
            return self.length_m, 0.0
        index = bisect_right(self._starts, t_s) - 1
        return _along(self._pieces[index], t_s - self._starts[index])

    def when(self, length_m: float) -> float:
        """Return when it first has come so far; its end where it never does."""
        low = high = 0.0
        for start, end in zip(self._starts, [*self._starts[1:], self.end_s], strict=False):
            low, high = start, end
            if self.at(end)[0] >= length_m:
                break
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if self.at(middle)[0] < length_m else (low, middle)
        return high


def _along(piece: tuple[float, float, float, float, float, float], t_s: float) -> tuple[float, float]:
    s, v, accel, jerk, final, tau = piece
    if tau > 0:
        left = math.exp(-t_s / tau)
        return s + final * t_s + (v - final) * tau * (1 - left), final + (v - final) * left
    return (
        s + t_s * (v + t_s * (accel / 2 + t_s * jerk / 6)),
        v + t_s * (accel + t_s * jerk / 2),
    )


def s_curve(length_m: float, speed_m_s: float, accel: float, jerk: float) -> Pieces:
    """Return the fastest way from rest to rest with these limits of speed, acceleration and jerk."""
    if length_m <= 0:
        return Pieces()
    top = accel * accel / jerk
    peak = (math.sqrt((accel / jerk) ** 2 + 4 * length_m / accel) - accel / jerk) * accel / 2
    if peak < top:
        peak = (length_m * math.sqrt(jerk) / 2) ** (2 / 3)
    peak = min(peak, speed_m_s)
    bend = accel / jerk if peak >= top else math.sqrt(peak / jerk)
    straight = peak / accel - bend if peak >= top else 0.0
    held = jerk * bend
    curve = Pieces()
    curve.poly(bend, 0.0, jerk).poly(straight, held).poly(bend, held, -jerk)
    curve.poly(max(length_m - 2 * curve.length_m, 0.0) / peak)
    curve.poly(bend, 0.0, -jerk).poly(straight, -held).poly(bend, -held, jerk)
    return curve


def brake(speed_m_s: float, decel: float) -> Pieces:
    """Return the way to a stop."""
    return Pieces(speed_m_s).poly(speed_m_s / decel, -decel)
