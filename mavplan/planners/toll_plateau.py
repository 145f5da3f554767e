"""How high a sum of rates, each paid by its user's price, rises anywhere in the plane: proved by cells.

Σ_n (α_n + β_n·ρ(‖w − w_n‖)) over the users within R of w. In a square it is at most the sum in which every user that
any place of the square reaches is as near as the nearest of them. Squares are cut in four until that is enough.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.radio import REACH_TOLERANCE_M, Channel
from mavplan.scenario.model import Floats

FIRST_CELL, LAST_CELL = 1 / 4, 1e-6
"""Sides of the squares at the beginning and at the end, in units of R."""

MOST_CELLS = 300_000
"""Squares at most in one round: where there are more the sum is taken as it then stands."""

CELLS_AT_ONCE = 1_000_000
"""Pairs of square and user that are held in memory together."""

PEAKS = 60
"""Places above what was asked that are told, the highest."""


@dataclass(frozen=True, eq=False)
class Plateau:
    """The greatest sum that may be anywhere, and places where it is above what was asked.

    Attributes
    ----------
    most
        Proved: nowhere is the sum greater.
    peaks_m
        (P, 2) places where it is greater than what was asked.
    """

    most: float
    peaks_m: Floats


@dataclass(frozen=True, eq=False)
class Payers:
    """Users with a price.

    Attributes
    ----------
    users_m, flat, steep
        (N, 2), (N,) α and β, not negative.
    channel
        Rates and R.
    """

    users_m: Floats
    flat: Floats
    steep: Floats
    channel: Channel

    @property
    def reach_m(self) -> float:
        """R, with its tolerance."""
        return self.channel.radius_m + REACH_TOLERANCE_M

    def sums(self, middles_m: Floats, side_m: float) -> tuple[Floats, Floats]:
        """Return (C,) what the sum is at most in squares, and what it is in their middles."""
        best = float(self.channel.air_rate(np.zeros(1))[0])
        most, here = np.empty(len(middles_m)), np.empty(len(middles_m))
        at_once = max(1, CELLS_AT_ONCE // len(self.users_m))
        for first in range(0, len(middles_m), at_once):
            rows = slice(first, first + at_once)
            apart = np.abs(middles_m[rows, None] - self.users_m)
            for side, found in ((side_m, most), (0.0, here)):
                away = np.sqrt((np.maximum(apart - side / 2, 0.0) ** 2).sum(axis=2))
                pays = self.flat + self.steep * (self.channel.air_rate(away) / best)
                found[rows] = np.where(away <= self.reach_m, pays, 0.0).sum(axis=1)
        return most, here


def highest_sum(payers: Payers, asked: float, touch: float) -> Plateau:
    """Return a proof that the sum is nowhere above ``asked``, or how far above it may be.

    Parameters
    ----------
    asked
        What the sum is wanted not to exceed.
    touch
        Share by which the greatest sum may be told too high.
    """
    paying = np.flatnonzero((payers.flat > 0) | (payers.steep > 0))
    if not len(paying):
        return Plateau(0.0, np.empty((0, 2)))
    payers = Payers(payers.users_m[paying], payers.flat[paying], payers.steep[paying], payers.channel)
    side = FIRST_CELL * payers.reach_m
    low = payers.users_m.min(axis=0) - payers.reach_m
    counts = np.ceil((payers.users_m.max(axis=0) + payers.reach_m - low) / side).astype(np.int64)
    grid = np.stack(np.meshgrid(np.arange(counts[0]), np.arange(counts[1]), indexing="ij"), axis=-1)
    middles = low + (grid.reshape(-1, 2) + 0.5) * side
    quarters = np.array([(-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)])
    settled, reached = 0.0, 0.0
    peaks, heights = [np.empty((0, 2))], [np.empty(0)]
    while len(middles):
        most, here = payers.sums(middles, side)
        reached = max(reached, float(here.max()))
        peaks.append(middles[here > asked])
        heights.append(here[here > asked])
        above = most > max(asked, reached) * (1 + touch)
        if side <= LAST_CELL * payers.reach_m or above.sum() > MOST_CELLS:
            above[:] = False
        settled = max(settled, float(most[~above].max(initial=0.0)))
        middles = (middles[above][:, None] + quarters * side).reshape(-1, 2)
        side /= 2
    found, height = np.concatenate(peaks), np.concatenate(heights)
    return Plateau(settled, found[np.argsort(-height, kind="stable")[:PEAKS]])
