"""95 % confidence intervals of a mean, and of a ratio of two means over the same draws."""

import math
from dataclasses import dataclass

import numpy as np

from mavplan.scenario.model import Floats

LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """An estimate and its confidence interval at `LEVEL`; the ends are None where one draw says nothing of them."""

    value: float
    low: float | None
    high: float | None

    @property
    def half_width(self) -> float | None:
        """Half of the interval's width: what stands behind a ±."""
        return None if self.low is None or self.high is None else (self.high - self.low) / 2


def mean_interval(values: Floats) -> Interval:
    """Return the mean of N ≥ 1 independent draws with Student's interval, N − 1 degrees of freedom."""
    mean = float(np.mean(values))
    return _around(mean, values - mean)


def ratio_of_means_interval(numerator: Floats, denominator: Floats) -> Interval:
    """Return Σy/Σx of N ≥ 1 pairs of draws, with the interval of the delta method.

    To first order ȳ/x̄ = r + mean(y − r·x)/x̄, so its variance is that of the mean of the residuals (y − r·x)/x̄.
    W. G. Cochran, Sampling Techniques, 3rd ed., 1977, section 2.11.

    Parameters
    ----------
    numerator, denominator
        (N,) y and x of the same draws; x of positive mean.
    """
    scale = float(np.mean(denominator))
    ratio = float(np.mean(numerator)) / scale
    return _around(ratio, (numerator - ratio * denominator) / scale)


def _around(value: float, residuals: Floats) -> Interval:
    """Return the interval whose width is that of the mean of residuals about 0."""
    from scipy.special import stdtrit

    count = len(residuals)
    if count < 2:
        return Interval(value, None, None)
    deviation = math.sqrt(float(residuals @ residuals) / (count - 1))
    half = float(stdtrit(count - 1, 0.5 + LEVEL / 2)) * deviation / math.sqrt(count)
    return Interval(value, value - half, value + half)
