"""How much longer service takes from afar: a convex curve below 1/ρ(δ), ρ the rate at a distance over the best rate."""

from dataclasses import dataclass

import numpy as np

from mavplan.radio import REACH_TOLERANCE_M, Channel
from mavplan.scenario.model import Floats

KNOTS = 600
"""Of the curve, from 0 to R."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A convex, piecewise linear ĝ with ĝ(δ) ≤ 1/ρ(δ) for 0 ≤ δ ≤ R.

    Attributes
    ----------
    knots_m, values
        (K,) distances from 0 to R, with the tolerance of `Channel.reaches`, and ĝ there.
    slopes
        (K − 1,) of the pieces, rising, not negative.
    """

    knots_m: Floats
    values: Floats
    slopes: Floats

    @classmethod
    def of(cls, channel: Channel) -> "Curve":
        """Return the curve of a channel: the convex hull from below, of values that are reached a knot earlier."""
        knots = np.linspace(0.0, channel.radius_m + REACH_TOLERANCE_M, KNOTS + 1)
        slowness = channel.air_rate(np.zeros(1))[0] / channel.air_rate(knots)
        # 1/ρ rises, so between two knots it is at least its value at the first; a chord between values taken one knot
        # earlier stays below that.
        early = np.concatenate([slowness[:1], slowness[:-1]])
        kept = [0]
        for k in range(1, len(knots)):
            while len(kept) > 1 and _rise(knots, early, kept[-2], kept[-1]) >= _rise(
                knots, early, kept[-1], k
            ):
                kept.pop()
            kept.append(k)
        values = early[kept]
        return cls(knots[kept], values, np.diff(values) / np.diff(knots[kept]))

    @property
    def radius_m(self) -> float:
        """R, with its tolerance."""
        return float(self.knots_m[-1])

    def at(self, distance_m: Floats) -> Floats:
        """Return ĝ; beyond R as at R."""
        return np.asarray(np.interp(distance_m, self.knots_m, self.values))

    def conjugate(self, pull: Floats, weight: Floats) -> Floats:
        """Return max over 0 ≤ δ ≤ R of pull·δ − weight·ĝ(δ), for pulls and weights that are not negative."""
        least = np.searchsorted(self.slopes, pull / np.maximum(weight, 1e-300))
        return np.asarray(pull * self.knots_m[least] - weight * self.values[least])


def _rise(x: Floats, y: Floats, i: int, j: int) -> float:
    return float((y[j] - y[i]) / (x[j] - x[i]))
