"""Scales for drawings: round steps, and the marks that stand on them."""

import math
from collections.abc import Callable

STEPS = (1.0, 2.0, 5.0, 10.0)
CLOCK_STEPS_S = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14_400, 43_200, 86_400)
"""Seconds between marks of a time axis, as clocks divide them."""


def round_step(span: float, most: int) -> float:
    """Return a step of 1, 2 or 5 times a power of ten that cuts a span into at most so many parts.

    Parameters
    ----------
    span
        Positive.
    most
        At least 1.
    """
    least = span / most
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * step for step in STEPS if power * step >= least * (1 - 1e-9))


def clock_step_s(span_s: float, most: int) -> float:
    """Return the same for seconds, in steps of a clock; above a day in whole days."""
    fitting = (step for step in CLOCK_STEPS_S if step * most >= span_s)
    return float(next(fitting, 86_400 * math.ceil(span_s / most / 86_400)))


def marks(span: float, most: int, step_of: Callable[[float, int], float] = round_step) -> list[float]:
    """Return the marks from 0 to the end of a span."""
    if span <= 0:
        return [0.0]
    step = step_of(span, most)
    return [step * number for number in range(math.floor(span / step * (1 + 1e-9)) + 1)]
