"""Simplex tableaux that are changed under way, against HiGHS on what they stand for in the end."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from mavplan.planners.linear_programme import least
from mavplan.planners.simplex import NOTHING, Tableaux


def drawn(rng, batch):
    """Matrices with gaps but no empty column, gains above and at 0."""
    rows, columns = int(rng.integers(2, 8)), int(rng.integers(1, 20))
    matrix = rng.uniform(0.2, 1.0, (batch, rows, columns)) * (rng.random((batch, rows, columns)) < 0.5)
    matrix[:, 0] = np.where(matrix.any(axis=1), matrix[:, 0], 0.5)
    return matrix, np.maximum(rng.uniform(-5.0, 30.0, (batch, columns)), 0.0)


def most(matrix, gain):
    solved = linprog(-gain, A_ub=matrix, b_ub=np.ones(len(matrix)))
    return -solved.fun if solved.status == 0 else None


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_is_changed_under_way_ends_at_the_best_of_what_it_has_become(seed):
    rng = np.random.default_rng(seed)
    matrix, gain = drawn(rng, 6)
    batch, rows, columns = matrix.shape
    tableaux = Tableaux.of(matrix, gain)
    assert tableaux.maximise().all()
    assert tableaux.value == pytest.approx([most(*one) for one in zip(matrix, gain, strict=True)])
    extra = rng.uniform(0.0, 1.0, (batch, columns)) * (rng.random((batch, columns)) < 0.7)
    longer = tableaux.with_constraint(extra)
    matrix = np.concatenate([matrix, extra[:, None]], axis=1)
    assert longer.make_feasible().all()
    assert longer.value == pytest.approx([most(*one) for one in zip(matrix, gain, strict=True)])
    gone = rng.integers(-1, rows, batch)
    able = longer.without(np.where(gone < 0, NOTHING, columns + gone))
    gain = np.maximum(rng.uniform(-5.0, 30.0, (batch, columns)), 0.0)
    longer.set_gain(gain)
    able &= longer.maximise()
    for k in range(batch):
        left = np.delete(matrix[k], gone[k], axis=0) if gone[k] >= 0 else matrix[k]
        wanted = most(left, gain[k])
        if able[k]:
            assert longer.value[k] == pytest.approx(wanted, abs=1e-7)
        else:
            assert not left.any(axis=0).all(), "what is bounded is brought to its end"


def test_two_constraints_can_go_and_the_values_are_those_of_what_is_left():
    tableaux = Tableaux.of(
        np.array([[[1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [0.0, 4.0]]]), np.array([[3.0, 1.0]])
    )
    assert tableaux.maximise().all()
    assert tableaux.value == pytest.approx([3 / 2 + 1 / 4])
    assert tableaux.without(np.array([3])).all()
    assert tableaux.without(np.array([5])).all()
    assert tableaux.maximise().all()
    assert tableaux.value == pytest.approx([3.0 + 1.0])
    assert tableaux.values()[0][0, :2] == pytest.approx([1.0, 1.0])


def test_a_constraint_that_alone_held_a_variable_cannot_go():
    tableaux = Tableaux.of(np.array([[[1.0, 0.0], [0.0, 1.0]]]), np.array([[1.0, 1.0]]))
    tableaux.maximise()
    assert tableaux.without(np.array([2])).tolist() == [False]


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_linear_programme_comes_to_what_it_does_by_scipys_door(seed):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(8, 5)) * (rng.random((8, 5)) < 0.6)
    cost, limits, low, high = (
        rng.normal(size=5),
        rng.uniform(0.0, 2.0, 8),
        np.full(5, -1.0),
        rng.uniform(0, 3, 5),
    )
    found = least(cost, matrix, limits, low, high)
    solved = linprog(cost, A_ub=matrix, b_ub=limits, bounds=np.column_stack([low, high]))
    assert found is not None
    assert found.value == pytest.approx(solved.fun)
    assert cost @ found.x == pytest.approx(found.value)
    assert (matrix @ found.x <= limits + 1e-7).all()


def test_a_linear_programme_without_an_end_or_an_answer_is_none():
    one = np.ones(1)
    assert least(-one, np.zeros((1, 1)), one, 0 * one, np.inf * one) is None
    assert least(one, np.ones((1, 1)), -one, 0 * one, one) is None


def test_highs_with_other_threads_in_the_same_process_is_no_matter():
    """HiGHS keeps its threads for the whole process and refuses to run with another number of them."""
    code = (
        "import highspy, numpy as np\n"
        "from mavplan.planners.linear_programme import least\n"
        "other, one = highspy.Highs(), np.ones(1)\n"
        "other.setOptionValue('output_flag', False)\n"
        "other.setOptionValue('threads', 3)\n"
        "other.addVar(0.0, 1.0)\n"
        "other.run()\n"
        "print(least(-one, np.ones((1, 1)), one, 0 * one, 9 * one).value)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.split() == ["-1.0"]
