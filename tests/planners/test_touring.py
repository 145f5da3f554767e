"""Touring discs in a fixed order, against CVXPY with Clarabel, and its dual bound against any path at all."""

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.block_tridiagonal import Band, BlockTridiagonal, factored
from mavplan.planners.touring import dual_bound_m, tour_discs

HOME = np.zeros(2)


def by_cvxpy(centres_m, radius_m, start_m, end_m):
    points = cp.Variable(centres_m.shape)
    rows = [start_m[None], points, *([] if end_m is None else [end_m[None]])]
    path = cp.vstack(rows)
    length = cp.sum(cp.norm(path[1:] - path[:-1], axis=1))
    programme = cp.Problem(cp.Minimize(length), [cp.norm(points - centres_m, axis=1) <= radius_m])
    programme.solve(solver="CLARABEL")
    return programme.value


@pytest.mark.parametrize("end_m", [None, HOME, np.array([900.0, 400.0])], ids=["free", "home", "elsewhere"])
@pytest.mark.parametrize("discs", [1, 2, 5, 12])
@pytest.mark.parametrize("side_m", [400.0, 1000.0, 5000.0])
def test_length_and_bound_enclose_what_clarabel_finds(discs, side_m, end_m):
    rng = np.random.default_rng([discs, int(side_m)])
    centres = rng.uniform(-side_m, side_m, (4, discs, 2))
    found = tour_discs(centres, 300.0, HOME, end_m)
    for row in range(4):
        exact = by_cvxpy(centres[row], 300.0, HOME, end_m)
        assert found.length_m[row] == pytest.approx(exact, rel=2e-6, abs=2e-3)
        assert found.bound_m[row] == pytest.approx(exact, rel=2e-6, abs=2e-3)
        assert found.bound_m[row] <= found.length_m[row]


def test_points_stay_in_their_discs_and_duals_in_the_unit_ball():
    centres = np.random.default_rng(1).uniform(0, 2000, (50, 9, 2))
    found = tour_discs(centres, 300.0, HOME)
    assert np.linalg.norm(found.points_m - centres, axis=2).max() <= 300.0
    assert np.linalg.norm(found.duals, axis=2).max() <= 1.0


def test_the_bound_is_what_its_duals_prove():
    centres = np.random.default_rng(2).uniform(0, 2000, (6, 7, 2))
    for end_m in (None, HOME):
        found = tour_discs(centres, 250.0, HOME, end_m)
        for row in range(6):
            proved = dual_bound_m(centres[row], 250.0, HOME, end_m, found.duals[row])
            assert proved == pytest.approx(found.bound_m[row], rel=1e-12)


coordinate = st.floats(-3000, 3000, allow_nan=False)
places = st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=8)


@settings(deadline=None)
@given(places, st.floats(1, 800), st.booleans())
def test_discs_that_meet_lie_on_each_other_or_hold_home_are_no_trouble(centres, radius_m, closed):
    discs = np.array([*centres, centres[0], centres[-1]])[None]
    found = tour_discs(discs, radius_m, HOME, HOME if closed else None)
    assert np.linalg.norm(found.points_m - discs, axis=2).max() <= radius_m * (1 + 1e-12)
    gap = (found.length_m - found.bound_m) / (found.length_m + radius_m)
    assert -1e-9 <= gap[0] < 1e-5


@settings(deadline=None)
@given(places, st.integers(0, 2**32 - 1))
def test_no_path_through_the_discs_is_shorter_than_any_duals_say(centres, seed):
    rng = np.random.default_rng(seed)
    discs = np.array(centres)
    away = rng.normal(size=discs.shape)
    points = discs + 300.0 * away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1.0)
    duals = rng.normal(size=discs.shape)
    duals /= np.maximum(np.linalg.norm(duals, axis=1, keepdims=True), 1.0)
    length = np.linalg.norm(np.diff(np.vstack([HOME, points]), axis=0), axis=1).sum()
    assert dual_bound_m(discs, 300.0, HOME, None, duals) <= length + 1e-9


def test_a_problem_is_left_where_its_bound_reaches_the_cutoff():
    centres = np.random.default_rng(3).uniform(0, 2000, (40, 10, 2))
    exact = tour_discs(centres, 300.0, HOME)
    left = tour_discs(centres, 300.0, HOME, cutoff_m=4000.0)
    above = left.bound_m >= 4000.0
    assert above.any()
    assert (left.bound_m <= exact.length_m).all()
    assert left.bound_m[~above] == pytest.approx(exact.bound_m[~above], rel=1e-6)


@pytest.mark.parametrize("factors", [Band, BlockTridiagonal])
def test_block_tridiagonal_systems_are_solved_as_numpy_solves_them(factors):
    rng = np.random.default_rng(4)
    rows, batch = 5, 3
    half = rng.normal(size=(batch, 2 * rows, 2 * rows))
    matrix = half @ half.transpose(0, 2, 1) + 50 * np.eye(2 * rows)
    diagonal, beside = np.empty((3, rows, batch)), np.empty((3, rows - 1, batch))
    for row in range(rows):
        for column in range(rows):
            block = matrix[:, 2 * row : 2 * row + 2, 2 * column : 2 * column + 2]
            if abs(row - column) > 1:
                block[:] = 0.0
            elif row != column:
                block[:] = (matrix[:, 2 * min(row, column), 2 * max(row, column)])[:, None, None] * [
                    [1, 0.2],
                    [0.2, 1],
                ]
    for row in range(rows):
        block = matrix[:, 2 * row : 2 * row + 2, 2 * row : 2 * row + 2]
        diagonal[:, row] = block[:, 0, 0], block[:, 0, 1], block[:, 1, 1]
        if row + 1 < rows:
            block = matrix[:, 2 * row : 2 * row + 2, 2 * row + 2 : 2 * row + 4]
            beside[:, row] = -block[:, 0, 0], -block[:, 0, 1], -block[:, 1, 1]
    right = rng.normal(size=(batch, 2 * rows))
    expected = np.linalg.solve(matrix, right[..., None])[..., 0]
    found = factors(diagonal, beside).solve(right.reshape(batch, rows, 2).transpose(2, 1, 0))
    assert found.transpose(2, 1, 0).reshape(batch, -1) == pytest.approx(expected)


def test_a_system_that_is_not_positive_as_it_rounds_does_not_spoil_the_others():
    diagonal = np.array([[[1.0, 4.0]], [[2.0, 1.0]], [[1.0, 3.0]]])
    found = factored(diagonal, np.empty((3, 0, 2))).solve(np.ones((2, 1, 2)))
    assert found[:, 0, 1] == pytest.approx(np.linalg.solve([[4.0, 1.0], [1.0, 3.0]], [1.0, 1.0]))
