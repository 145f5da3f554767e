"""Small linear programmes, thousands in a row: HiGHS by its own binding, without what SciPy looks at beforehand.

For a programme of a hundred columns SciPy's door takes longer than the simplex method behind it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mavplan.scenario.model import Floats


@dataclass(frozen=True, eq=False)
class Optimum:
    """What a linear programme comes to.

    Attributes
    ----------
    x
        (n,) where it is least.
    value
        What it comes to there.
    """

    x: Floats
    value: float


def least(cost: Floats, matrix: Floats, limits: Floats, low: Floats, high: Floats) -> Optimum | None:
    """Return the least cost·x with matrix·x ≤ limits and low ≤ x ≤ high; None where HiGHS does not end with one.

    Parameters
    ----------
    cost, low, high
        (n,)
    matrix, limits
        (m, n) and (m,), mostly zeros.
    """
    import highspy

    column, row = np.nonzero(matrix.T)
    programme: Any = highspy.HighsLp()
    programme.num_row_, programme.num_col_ = matrix.shape
    programme.col_cost_, programme.col_lower_, programme.col_upper_ = cost, low, high
    programme.row_lower_, programme.row_upper_ = np.full(len(limits), -np.inf), limits
    entries = programme.a_matrix_
    entries.format_ = highspy.MatrixFormat.kColwise
    entries.start_ = np.searchsorted(column, np.arange(len(cost) + 1)).astype(np.int32)
    entries.index_, entries.value_ = row.astype(np.int32), matrix[row, column]
    make_solver: Any = highspy.Highs  # untyped
    solver = make_solver()
    solver.setOptionValue("output_flag", False)
    # Off is faster; on is more, where figures are far apart. HiGHS refuses a number of threads where it has another in
    # this process already; 0 takes what there is.
    for presolve, threads in (("off", 1), ("off", 0), ("on", 0)):
        solver.setOptionValue("presolve", presolve)
        solver.setOptionValue("threads", threads)
        solver.passModel(programme)
        solver.run()
        if solver.getModelStatus() == highspy.HighsModelStatus.kOptimal:
            return Optimum(np.array(solver.getSolution().col_value), float(solver.getObjectiveValue()))
    return None
