"""`Terrain`: heights of the ground above mean sea level, at places and under straight legs. Pure."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

USER_M = 1.5
"""A user's radio is held so high above the ground."""

MOST_SAMPLES = 1_000_000
"""A leg over more cells than this is no leg of a multirotor."""


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground under a straight leg, bounded from above.

    Attributes
    ----------
    at
        (K,) increasing parts of the leg, 0 its beginning and 1 its end.
    top_m
        (K,) metres above sea level. A straight line that is nowhere below these is nowhere below the ground.
    """

    at: Floats
    top_m: Floats


@dataclass(frozen=True, eq=False)
class _Mapped:
    """Two maps one after the other; unlike a closure it can be sent to another process."""

    cells_of: Callable[[Floats], Floats]
    mapped: Callable[[Floats], Floats]

    def __call__(self, places_m: Floats) -> Floats:
        return self.cells_of(self.mapped(places_m))


@dataclass(frozen=True, eq=False)
class Terrain:
    """A window of a height raster; between the middles of its cells heights are bilinear.

    Attributes
    ----------
    heights_m
        (R, C) metres above mean sea level at the middles of cells; NaN where the file has none.
    cells_of
        Takes places (N, 2), metres east and north of home, to columns and rows (N, 2), whole numbers at the middles.
    pitch_m
        Least distance of the middles of two cells.
    label
        The file, for messages.
    datum
        What the heights are above.
    """

    heights_m: NDArray[np.float32]
    cells_of: Callable[[Floats], Floats] = field(repr=False)
    pitch_m: float
    label: str
    datum: str

    def seen_from(self, mapped: Callable[[Floats], Floats]) -> "Terrain":
        """Return the same ground by places round another home; ``mapped`` gives where those are round this one."""
        return replace(self, cells_of=_Mapped(self.cells_of, mapped))

    def height_m(self, places_m: Floats) -> Floats:
        """Return (N,) metres above sea level of (N, 2) places; NaN where the file has none."""
        return self._at_cells(self.cells_of(np.asarray(places_m, dtype=np.float64).reshape(-1, 2)))

    @property
    def home_m(self) -> float:
        """Metres above sea level at home; NaN where the file has none."""
        return float(self.height_m(np.zeros((1, 2)))[0])

    def height_above_home_m(self, places_m: Floats) -> Floats:
        """Return (N,) metres of ground above that at home."""
        return self.height_m(places_m) - self.home_m

    def under(self, start_m: Floats, end_m: Floats) -> Ground:
        """Return the ground under a leg between two places (2,).

        The leg is cut wherever it passes the middle of a row or column; in each piece the ground is a parabola, and
        that lies within its two ends and the point at which its tangents there meet.
        """
        start, way = np.asarray(start_m, dtype=np.float64), np.subtract(end_m, start_m)
        steps = int(np.ceil(np.hypot(*way) / self.pitch_m)) + 1
        if steps > MOST_SAMPLES:
            raise ValueError(f"a leg over {steps} cells")
        even = np.linspace(0.0, 1.0, steps + 1)
        return self._along(even, self.cells_of(start + even[:, None] * way))

    def sees(self, eye_m: Floats, eye_alt_m: Floats, at_m: Floats, alt_m: Floats) -> NDArray[np.bool_]:
        """Return (K,) whether nothing of the ground stands between K pairs of points.

        Parameters
        ----------
        eye_m, at_m
            (K, 2) places, no more than some kilometres apart: the line between is taken as straight over the cells.
        eye_alt_m, alt_m
            (K,) metres above sea level.

        Returns
        -------
        ndarray
            False also where the ground between is not known.
        """
        clear = np.zeros(len(eye_m), dtype=bool)
        ends = np.array([0.0, 1.0])
        for k, cells in enumerate(np.stack([self.cells_of(eye_m), self.cells_of(at_m)], axis=1)):
            ground = self._along(ends, cells)
            line_m = eye_alt_m[k] + ground.at * (alt_m[k] - eye_alt_m[k])
            clear[k] = bool((line_m >= ground.top_m).all())
        return clear

    def _along(self, even: Floats, cells: Floats) -> Ground:
        """Return the ground under a leg that is straight between these parts of it, at these cells."""
        at = np.unique(np.concatenate([even, *(_passed(even, cells[:, axis]) for axis in (0, 1))]))
        along = np.column_stack([np.interp(at, even, cells[:, axis]) for axis in (0, 1)])
        ends_m, middles_m = self._at_cells(along), self._at_cells((along[:-1] + along[1:]) / 2)
        return Ground(
            _between(at, (at[:-1] + at[1:]) / 2),
            _between(ends_m, 2 * middles_m - (ends_m[:-1] + ends_m[1:]) / 2),
        )

    def _at_cells(self, cells: Floats) -> Floats:
        rows, columns = self.heights_m.shape
        column, row = cells.T
        inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
        column, row = np.where(inside, column, 0.0), np.where(inside, row, 0.0)
        left = np.minimum(column.astype(np.int64), max(columns - 2, 0))
        above = np.minimum(row.astype(np.int64), max(rows - 2, 0))
        right, below = np.minimum(left + 1, columns - 1), np.minimum(above + 1, rows - 1)
        east, south = column - left, row - above
        known = self.heights_m
        found = (
            known[above, left].astype(np.float64) * (1 - east) * (1 - south)
            + known[above, right].astype(np.float64) * east * (1 - south)
            + known[below, left].astype(np.float64) * (1 - east) * south
            + known[below, right].astype(np.float64) * east * south
        )
        return np.where(inside, found, np.nan)


def _passed(at: Floats, cell: Floats) -> Floats:
    """Return the parts of a leg at which whole columns, or rows, are passed between its samples."""
    first, last = np.minimum(cell[:-1], cell[1:]), np.maximum(cell[:-1], cell[1:])
    lowest = np.floor(first) + 1
    count = np.maximum(np.ceil(last) - lowest, 0).astype(np.int64)
    piece = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    share = (lowest[piece] + number - cell[piece]) / (cell[piece + 1] - cell[piece])
    passed: Floats = at[piece] + share * (at[piece + 1] - at[piece])
    return passed


def _between(ends: Floats, middles: Floats) -> Floats:
    """Return the ends with what lies between each two of them."""
    every = np.empty(len(ends) + len(middles))
    every[::2], every[1::2] = ends, middles
    return every
