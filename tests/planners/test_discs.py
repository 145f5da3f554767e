"""The projection on an intersection of equal discs: against SciPy's SLSQP, and at the corners of its domain."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import minimize

from mavplan.planners.discs import TOLERANCE_M, project_on_discs

R = 100.0
metres = st.floats(-300, 300, allow_nan=False).map(lambda value: round(value, 4))
point = st.tuples(metres, metres).map(np.array)


@given(centres=st.lists(point, min_size=1, max_size=8), start=point)
def test_no_feasible_point_found_otherwise_is_nearer(centres, start):
    # Moved together until they have the origin in common.
    centres = np.array(centres)
    centres = centres * min(1.0, 0.99 * R / max(np.linalg.norm(centres, axis=1).max(), 1e-9))
    found = project_on_discs(start, centres, R)
    assert (np.linalg.norm(centres - found, axis=1) <= R + 2 * TOLERANCE_M).all()
    rival = minimize(
        lambda w: ((w - start) ** 2).sum() / R**2,
        np.zeros(2),
        jac=lambda w: 2 * (w - start) / R**2,
        method="SLSQP",
        constraints={
            "type": "ineq",
            "fun": lambda w: 1 - ((w - centres) ** 2).sum(axis=1) / R**2,
            "jac": lambda w: -2 * (w - centres) / R**2,
        },
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assume(rival.success)
    feasible = (np.linalg.norm(centres - rival.x, axis=1) <= R + TOLERANCE_M).all()
    if feasible:
        assert np.linalg.norm(found - start) <= np.linalg.norm(rival.x - start) + 1e-6


def test_a_point_inside_every_disc_stays():
    start = np.array([3.0, 4.0])
    assert (project_on_discs(start, np.array([[0.0, 0], [10, 0]]), R) == start).all()


def test_from_outside_one_disc_the_nearest_point_is_on_its_circle():
    np.testing.assert_allclose(project_on_discs(np.array([300.0, 0]), np.zeros((1, 2)), R), [R, 0])


def test_between_two_discs_it_is_their_crossing():
    centres = np.array([[-60.0, 0], [60, 0]])
    np.testing.assert_allclose(project_on_discs(np.array([0.0, 500]), centres, R), [0, 80], atol=1e-9)


def test_coincident_discs_are_one():
    np.testing.assert_allclose(project_on_discs(np.array([0.0, 300]), np.zeros((5, 2)), R), [0, R])


def test_discs_that_just_touch_leave_one_point():
    centres = np.array([[-R, 0], [R, 0]])
    np.testing.assert_allclose(project_on_discs(np.array([50.0, 50]), centres, R), [0, 0], atol=1e-4)


def test_discs_without_a_common_point_are_refused():
    with pytest.raises(ArithmeticError, match="no point in common"):
        project_on_discs(np.zeros(2), np.array([[-200.0, 0], [200, 0]]), R)


def test_without_discs_nothing_holds_the_point():
    start = np.array([7.0, 8.0])
    assert (project_on_discs(start, np.empty((0, 2)), R) == start).all()
