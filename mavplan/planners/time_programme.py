"""The hover programme of many plans at once: min Σ t with Aᵀ·t ≥ b, t ≥ 0, each far too small for a solver's door.

Solved through its dual, max b·y with A·y ≤ 1, y ≥ 0, by the simplex method on tableaus side by side: y = 0 is
feasible, so there is no first phase. The final row gives the holds t, the final right-hand side the prices y.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.scenario.model import Floats

TOLERANCE = 1e-9
"""Reduced costs and pivots nearer to 0 than this count as 0; all figures are of order one."""

MOST_PIVOTS = 400

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
        _solve(rates, needs_s, slice(first, min(first + step, batch)), found)
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


def _solve(rates: Floats, needs_s: Floats, part: slice, into: Hover) -> None:
    """Solve some of the programmes."""
    batch, stops, users = rates[part].shape
    # Rows: a constraint for each stop, then the reduced costs. Columns: the nonbasic variables, then the right side.
    tableau = np.empty((batch, stops + 1, users + 1))
    tableau[:, :stops, :users] = rates[part]
    tableau[:, stops, :users] = -np.maximum(needs_s[part], 0.0)
    tableau[:, :stops, users], tableau[:, stops, users] = 1.0, 0.0
    # Which variable each row and column stands for: prices are 0 … N − 1, holds N … N + M − 1.
    in_row = np.tile(np.arange(users, users + stops), (batch, 1))
    in_column = np.tile(np.arange(users), (batch, 1))
    in_rows, in_columns = np.zeros((batch, users + stops)), np.zeros((batch, users + stops))
    total = np.full(batch, np.inf)
    index = np.arange(batch)
    for _ in range(MOST_PIVOTS):
        entering = tableau[:, stops, :users].argmin(axis=1)
        here = np.arange(len(index))
        done = tableau[here, stops, entering] >= -TOLERANCE
        if done.any():
            at = index[done]
            total[at] = tableau[done, stops, users]
            in_rows[at[:, None], in_row[done]] = tableau[done, :stops, users]
            in_columns[at[:, None], in_column[done]] = tableau[done, stops, :users]
            tableau, index = tableau[~done], index[~done]
            in_row, in_column, entering = in_row[~done], in_column[~done], entering[~done]
            here = here[: len(index)]
        if not len(index):
            break
        column = tableau[here, :, entering].copy()
        usable = column[:, :stops] > TOLERANCE
        ratio = np.where(usable, tableau[:, :stops, users] / np.where(usable, column[:, :stops], 1.0), np.inf)
        leaving = ratio.argmin(axis=1)
        bounded = usable[here, leaving]
        if not bounded.all():
            tableau, index, column = tableau[bounded], index[bounded], column[bounded]
            in_row, in_column = in_row[bounded], in_column[bounded]
            entering, leaving, here = entering[bounded], leaving[bounded], here[: len(index)]
        pivot = column[here, leaving]
        row = tableau[here, leaving] / pivot[:, None]
        row[here, entering] = 1.0 / pivot
        column[here, leaving] = 0.0
        tableau[here, :, entering] = 0.0
        tableau -= column[:, :, None] * row[:, None, :]
        tableau[here, leaving] = row
        in_row[here, leaving], in_column[here, entering] = in_column[here, entering], in_row[here, leaving]
    into.total_s[part] = total
    # A price has its value in its row, a hold as the reduced cost of its column; wherever else they stand they are 0.
    into.prices[part] = in_rows[:, :users]
    into.holds_s[part] = in_columns[:, users:]
