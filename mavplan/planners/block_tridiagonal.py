"""Symmetric positive definite block tridiagonal systems of 2 by 2 blocks, many at once.

A block is (3, ...): the entries xx, xy and yy of a symmetric matrix. All blocks here are symmetric, those beside the
diagonal too. Few systems are solved faster as one band matrix by LAPACK, many by elimination side by side.
"""

from typing import Protocol

import numpy as np

from mavplan.scenario.model import Floats

FEW = 150
"""Systems up to which the band matrix is faster."""


class Factors(Protocol):
    """A factored system."""

    def solve(self, right: Floats) -> Floats:
        """Return the solutions (2, K, B) for right-hand sides (2, K, B)."""


def factored(diagonal: Floats, beside: Floats) -> Factors:
    """Return the factors of B systems with K blocks on the diagonal.

    Parameters
    ----------
    diagonal
        (3, K, B) blocks on the diagonal.
    beside
        (3, K − 1, B) the *negative* of the block that couples row i with row i + 1.
    """
    if diagonal.shape[2] <= FEW:
        band = Band(diagonal, beside)
        if band.positive:
            return band
    return BlockTridiagonal(diagonal, beside)


class Band:
    """Cholesky factors of all systems as one band matrix; parameters as `factored`.

    Attributes
    ----------
    positive
        Whether the matrix is positive definite as it rounds; else nothing can be solved.
    """

    def __init__(self, diagonal: Floats, beside: Floats) -> None:
        from scipy.linalg.lapack import dpbtrf

        _, rows, batch = diagonal.shape
        # Upper band storage, a system after the other, each with x and y of its rows in turn.
        band = np.zeros((4, batch, rows, 2))
        band[3, :, :, 0], band[3, :, :, 1] = diagonal[0].T, diagonal[2].T
        band[2, :, :, 1] = diagonal[1].T
        xx, xy, yy = beside.transpose(0, 2, 1)
        band[2, :, 1:, 0] = band[0, :, 1:, 1] = -xy
        band[1, :, 1:, 0], band[1, :, 1:, 1] = -xx, -yy
        self._factor, info = dpbtrf(band.reshape(4, -1), overwrite_ab=True)
        self.positive = info == 0

    def solve(self, right: Floats) -> Floats:
        """Return the solutions (2, K, B) for right-hand sides (2, K, B)."""
        from scipy.linalg.lapack import dpbtrs

        _, rows, batch = right.shape
        found, _ = dpbtrs(self._factor, np.ascontiguousarray(right.transpose(2, 1, 0)).reshape(-1))
        return np.ascontiguousarray(found.reshape(batch, rows, 2).transpose(2, 1, 0))


class BlockTridiagonal:
    """Factors of B systems by block elimination from the first row to the last; parameters as `factored`."""

    def __init__(self, diagonal: Floats, beside: Floats) -> None:
        rows = diagonal.shape[1]
        self._inverse = np.empty_like(diagonal)
        # E·S⁻¹ of each row but the last, by its columns and by its rows: E couples with the next row.
        self._columns = np.empty((2, 2, *beside.shape[1:]))
        here = diagonal[:, 0]
        for row in range(rows):
            xx, xy, yy = here
            inverse = self._inverse[:, row]
            inverse[0], inverse[1], inverse[2] = yy, -xy, xx
            inverse /= xx * yy - xy * xy
            if row + 1 < rows:
                block = beside[:, row]
                first, second = self._columns[0, :, row], self._columns[1, :, row]
                np.add(block[:2] * inverse[0], block[1:] * inverse[1], out=first)
                np.add(block[:2] * inverse[1], block[1:] * inverse[2], out=second)
                here = diagonal[:, row + 1].copy()
                here[:2] -= first * block[0] + second * block[1]
                here[2] -= first[1] * block[1] + second[1] * block[2]

    def solve(self, right: Floats) -> Floats:
        """Return the solutions (2, K, B) for right-hand sides (2, K, B)."""
        rows = right.shape[1]
        first, second = self._columns
        swept = right.copy()
        for row in range(1, rows):
            above = swept[:, row - 1]
            swept[:, row] += first[:, row - 1] * above[0] + second[:, row - 1] * above[1]
        found: Floats = self._inverse[:2] * swept[0] + self._inverse[1:] * swept[1]
        # The blocks are symmetric: S⁻¹·E is the transpose of E·S⁻¹.
        upper, lower = self._columns[:, 0], self._columns[:, 1]
        for row in range(rows - 2, -1, -1):
            below = found[:, row + 1]
            found[:, row] += upper[:, row] * below[0] + lower[:, row] * below[1]
        return found
