"""The hover programme of many plans at once: min Σ t with Aᵀ·t ≥ b, t ≥ 0, each far too small for a solver's door.

Solved through its dual, max b·y with A·y ≤ 1, y ≥ 0, by simplex tableaux side by side: y = 0 is feasible, so there is
no first phase. The final row gives the holds t, the final right-hand side the prices y.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.planners.simplex import TOLERANCE, Tableaux
from mavplan.scenario.model import Floats

AT_ONCE = 400_000
"""Tableau cells that are worked on together: what the processor's cache holds."""


@dataclass(frozen=True, eq=False)
class Hover:
    """Answers of B programmes with M stops and N users.

    Attributes
    ----------
    total_s
        (B,) least sum of holds; infinite where a user with a need has no rate, or the pivots ran out.
    holds_s
        (B, M) the holds.
    prices
        (B, N) what one more second of need would cost: Σ needs·prices = total, and no stop's A·y is above 1.
    """

    total_s: Floats
    holds_s: Floats
    prices: Floats


def least_hover(rates: Floats, needs_s: Floats) -> Hover:
    """Solve B hover programmes.

    Parameters
    ----------
    rates
        (B, M, N) rates as shares of the best there is, 0 to 1.
    needs_s
        (B, N) seconds that each user needs at the best rate; nothing is needed where it is 0 or less.
    """
    batch, stops, users = rates.shape
    found = Hover(np.empty(batch), np.empty((batch, stops)), np.empty((batch, users)))
    step = max(1, AT_ONCE // ((stops + 1) * (users + 1)))
    for first in range(0, batch, step):
        part = slice(first, min(first + step, batch))
        tableaux = Tableaux.of(rates[part], np.maximum(needs_s[part], 0.0))
        found.total_s[part] = np.where(tableaux.maximise(), tableaux.value, np.inf)
        prices, holds = tableaux.values()
        found.prices[part], found.holds_s[part] = prices[:, :users], holds[:, users:]
    return found


def least_hover_at(prices: Floats, rates: Floats, needs_s: Floats) -> Floats:
    """Return (B,) what the hover of B plans is not below, by prices that are right for a plan near them.

    Parameters
    ----------
    prices
        (N,) of a second of need, y ≥ 0: any with A·y ≤ 1 at all stops of a plan bound its hover, b·y ≤ Σ t. Where one
        stop is new to them, those of the users are lowered that lose least by it; where several are, the others by
        a factor.
    rates, needs_s
        (B, M, N) and (B, N) as for `least_hover`.
    """
    batch, stops, _ = rates.shape
    if not batch or not stops:
        return np.zeros(batch)
    priced = np.flatnonzero(prices > 0)
    needs, prices, rates = np.maximum(needs_s[:, priced], 0.0), prices[priced], rates[:, :, priced]
    load = rates @ prices
    at = rates[np.arange(batch), load.argmax(axis=1)]
    excess = np.maximum(load.max(axis=1) - 1.0, 0.0)
    # What a user's price costs the stop, and what it loses by each part of it: the least first, as in a knapsack.
    taken = at * prices
    loss = np.where(at > 0, needs / np.maximum(at, TOLERANCE), 0.0)
    order = np.argsort(loss, axis=1)
    taken, loss = np.take_along_axis(taken, order, axis=1), np.take_along_axis(loss, order, axis=1)
    before = np.cumsum(taken, axis=1) - taken
    cut = np.clip(excess[:, None] - before, 0.0, taken)
    left_s: Floats = needs @ prices - (cut * loss).sum(axis=1)
    others = np.sort(load, axis=1)[:, -2:-1].max(axis=1, initial=1.0)
    left_s /= others
    return left_s
