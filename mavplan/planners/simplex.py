"""Simplex tableaux side by side: many linear programmes of one size, each far too small for a solver's door.

Each is max b·y with A·y ≤ 1, y ≥ 0. Rows are a constraint each and then the reduced costs, columns the variables that
are 0 and then the right side. Variables are numbered: y from 0, then the slacks of the constraints.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavplan.scenario.model import Bools, Floats, Ints

TOLERANCE = 1e-9
"""Reduced costs and pivots nearer to 0 than this count as 0; all figures are of order one."""

MOST_PIVOTS = 400

NOTHING = -1
"""Stands where a row has been taken out, and for no variable."""

Choice = tuple[Ints, Ints, Bools, Bools]
"""Rows and columns to pivot on, (B,) each, and which programmes are done, and which lead nowhere."""


@dataclass(eq=False)
class Tableaux:
    """B programmes under way.

    Attributes
    ----------
    cells
        (B, M + 1, N + 1)
    in_row, in_column
        (B, M) and (B, N) which variable stands where.
    """

    cells: Floats
    in_row: Ints
    in_column: Ints

    @classmethod
    def of(cls, matrix: Floats, gain: Floats) -> "Tableaux":
        """Return the tableaux at y = 0, which is feasible, of A (B, M, N) and b (B, N)."""
        batch, rows, columns = matrix.shape
        cells = np.empty((batch, rows + 1, columns + 1))
        cells[:, :rows, :columns] = matrix
        cells[:, rows, :columns] = -gain
        cells[:, :rows, columns], cells[:, rows, columns] = 1.0, 0.0
        in_row = np.tile(np.arange(columns, columns + rows), (batch, 1))
        return cls(cells, in_row, np.tile(np.arange(columns), (batch, 1)))

    @property
    def value(self) -> Floats:
        """(B,) what b·y comes to."""
        return self.cells[:, -1, -1]

    def taken(self, which: Ints | Bools) -> "Tableaux":
        """Return copies of some of them."""
        return Tableaux(self.cells[which], self.in_row[which], self.in_column[which])

    def values(self) -> tuple[Floats, Floats]:
        """Return (B, N + M) the values of the variables in rows, and the reduced costs of those in columns; else 0."""
        batch, rows, columns = len(self.cells), self.in_row.shape[1], self.in_column.shape[1]
        at = np.arange(batch)[:, None]
        of_row, of_column = np.zeros((2, batch, columns + rows + 1))  # the last for `NOTHING`
        of_row[at, self.in_row] = self.cells[:, :-1, -1]
        of_column[at, self.in_column] = self.cells[:, -1, :-1]
        return of_row[:, :-1], of_column[:, :-1]

    def pivot(self, row: Ints, column: Ints) -> None:
        """Let the variables of a row and a column, (B,) each, change places."""
        cells, here = self.cells, np.arange(len(self.cells))
        factor = cells[here, :, column]
        by = factor[here, row]
        new = cells[here, row] / by[:, None]
        new[here, column] = 1.0 / by
        factor[here, row] = 0.0
        cells[here, :, column] = 0.0
        cells -= factor[:, :, None] * new[:, None, :]
        cells[here, row] = new
        self.in_row[here, row], self.in_column[here, column] = (
            self.in_column[here, column],
            self.in_row[here, row],
        )

    def maximise(self) -> Bools:
        """Pivot from feasible tableaux to the best; return (B,) which were brought there."""
        return self._pivoted(_rising)

    def make_feasible(self) -> Bools:
        """Pivot from tableaux that would be the best to those that are feasible too; return (B,) which were."""
        return self._pivoted(_becoming_feasible)

    def without(self, slack: Ints) -> Bools:
        """Take the constraints with these slacks (B,) out, none where it is `NOTHING`; return (B,) whether it could be.

        They stay feasible, but need not be the best. Rows are left empty.
        """
        able, asked = np.ones(len(slack), dtype=bool), slack != NOTHING
        tight = np.flatnonzero(asked & (self.in_column == slack[:, None]).any(axis=1))
        if len(tight):
            # The slack may be below 0 from now on: it goes down until another variable is 0, and then for good.
            part, here = self.taken(tight), np.arange(len(tight))
            column = (part.in_column == slack[tight][:, None]).argmax(axis=1)
            row, limited = _least_ratio(part.cells[:, :-1, -1], -part.cells[here, :-1, column])
            part = part.taken(limited)
            part.pivot(row[limited], column[limited])
            self._put(tight[limited], part)
            able[tight[~limited]] = False
        out, row = np.nonzero((self.in_row == slack[:, None]) & asked[:, None])
        self.cells[out, row] = 0.0
        self.in_row[out, row] = NOTHING
        return able

    def with_constraint(self, entries: Floats) -> "Tableaux":
        """Return them with one more constraint each, entries (B, N)·y ≤ 1, that need not be kept yet."""
        row = self._by_columns(entries)
        row[:, -1] += 1.0
        slack = np.full((len(row), 1), self.in_column.shape[1] + self.in_row.shape[1])
        joined = np.concatenate([self.cells[:, :-1], row[:, None], self.cells[:, -1:]], axis=1)
        return Tableaux(joined, np.concatenate([self.in_row, slack], axis=1), self.in_column.copy())

    def set_gain(self, gain: Floats) -> None:
        """Let b be this (B, N) from now on: they stay feasible, but need not be the best."""
        self.cells[:, -1] = -self._by_columns(gain)

    def _by_columns(self, entries: Floats) -> Floats:
        """Return (B, N + 1) entries (B, N)·y by the variables in columns, and last less its value."""
        none = np.zeros((len(entries), self.in_row.shape[1] + 1))
        of = np.concatenate([entries, none], axis=1)  # slacks and `NOTHING`, the last, have no part in it
        found: Floats = -np.matmul(np.take_along_axis(of, self.in_row, axis=1)[:, None], self.cells[:, :-1])[
            :, 0
        ]
        found[:, :-1] += np.take_along_axis(of, self.in_column, axis=1)
        return found

    def _put(self, which: Ints, others: "Tableaux") -> None:
        self.cells[which], self.in_row[which], self.in_column[which] = (
            others.cells,
            others.in_row,
            others.in_column,
        )

    def _pivoted(self, choose: Callable[["Tableaux"], Choice]) -> Bools:
        """Pivot on what is chosen until none is left; return (B,) which were done by then."""
        ended = np.zeros(len(self.cells), dtype=bool)
        at, left = np.arange(len(ended)), self
        for _ in range(MOST_PIVOTS):
            row, column, done, stuck = choose(left)
            ready = done | stuck
            if ready.any():
                ended[at[done]] = True
                if left is not self:
                    self._put(at[done], left.taken(done))
                at, row, column, left = at[~ready], row[~ready], column[~ready], left.taken(~ready)
            if not len(at):
                break
            left.pivot(row, column)
        return ended


def _rising(tableaux: Tableaux) -> Choice:
    """Bring in the variable that b·y rises by most; the first to reach 0 for it goes out."""
    cells, here = tableaux.cells, np.arange(len(tableaux.cells))
    column = cells[:, -1, :-1].argmin(axis=1)
    done = cells[here, -1, column] >= -TOLERANCE
    row, bounded = _least_ratio(cells[:, :-1, -1], cells[here, :-1, column])
    return row, column, done, ~done & ~bounded


def _becoming_feasible(tableaux: Tableaux) -> Choice:
    """Take out the variable furthest below 0; that comes in which keeps all reduced costs at 0 or more."""
    cells, here = tableaux.cells, np.arange(len(tableaux.cells))
    row = cells[:, :-1, -1].argmin(axis=1)
    done = cells[here, row, -1] >= -TOLERANCE
    column, bounded = _least_ratio(cells[:, -1, :-1], -cells[here, row, :-1])
    return row, column, done, ~done & ~bounded


def _least_ratio(over: Floats, under: Floats) -> tuple[Ints, Bools]:
    """Return (B,) where over / under (B, K) is least among those of which ``under`` is above 0, and if any is."""
    usable = under > TOLERANCE
    ratio = np.where(usable, over / np.where(usable, under, 1.0), np.inf)
    at = ratio.argmin(axis=1)
    return at, usable[np.arange(len(at)), at]
