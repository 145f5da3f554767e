"""Paths made without proof: they meet everybody, changes to them never lose count, and shortening never lengthens."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.path_bound import path_lower_bound
from mavplan.planners.path_edit import EditablePath, path_length_m
from mavplan.planners.path_local import inserted_path, reinserted
from mavplan.planners.path_problem import PathProblem, path_problem
from mavplan.planners.path_windows import shortened
from tests.support import user_fields

R = 300.0


def problem_of(xy, mate=None, returns=False):
    return path_problem(np.asarray(xy, dtype=float), R, returns=returns, mate=mate).without_met()


def meets_all(problem, found):
    assert found.length_m == pytest.approx(path_length_m(problem.path_m(found.points_m)), rel=1e-12)
    centres = problem.required.places_m[list(found.sequence)]
    assert (np.linalg.norm(found.points_m - centres, axis=1) <= R + 1e-6).all()
    return not problem.unmet(problem.away_m(found.points_m[None])[0]).any()


@settings(max_examples=60, deadline=None)
@given(user_fields(), st.booleans())
def test_an_inserted_path_meets_everybody_and_no_change_makes_it_longer(users, returns):
    problem = problem_of(users.xy_m, users.mate, returns)
    if not len(problem.required):
        return
    found = inserted_path(problem)
    assert meets_all(problem, found)
    rng = np.random.default_rng(0)
    for change in (
        lambda path: reinserted(problem, path, rng),
        lambda path: shortened(problem, path, lambda _: True),
    ):
        better = change(found)
        assert meets_all(problem, better)
        assert better.length_m <= found.length_m
        found = better


@settings(max_examples=60, deadline=None)
@given(user_fields(), st.data())
def test_a_path_that_is_changed_knows_what_it_meets(users, data):
    problem = problem_of(users.xy_m, users.mate)
    if not len(problem.required):
        return
    path = EditablePath(problem)
    places = len(problem.required.places_m)
    for _ in range(6):
        first = data.draw(st.integers(0, len(path.sequence)))
        last = data.draw(st.integers(first, len(path.sequence)))
        sequence = tuple(data.draw(st.lists(st.integers(0, places - 1), max_size=3)))
        before = path.copy()
        path.replace(first, last, sequence, problem.required.places_m[list(sequence)])
        away = problem.away_m(path.points_m[None])[0]
        assert set(path.unmet()) == set(np.flatnonzero(problem.unmet(away)))
        assert before.sequence != path.sequence or (first, last) == (0, 0) or len(sequence) == last - first
    assert EditablePath(problem, path.found()).times.tolist() == path.times.tolist()


def test_a_copy_is_changed_apart():
    problem = problem_of([[1000, 0], [2000, 0]])
    path = EditablePath(problem, inserted_path(problem))
    other = path.copy()
    other.replace(0, len(other.sequence), (), np.empty((0, 2)))
    assert len(other.unmet()) == 2
    assert not len(path.unmet())


def test_what_only_a_window_meets_is_left_over_without_it():
    xy = [[1000, 0], [2000, 0], [2000, 1000], [1000, 1000]]
    problem = problem_of(xy)
    path = EditablePath(problem, inserted_path(problem))
    alone = path.only_met_by(1, 3)
    path.replace(1, 3, (), np.empty((0, 2)))
    assert set(alone) >= set(path.unmet())


@pytest.mark.parametrize("seed", range(3))
def test_windows_find_the_shortest_path_where_one_window_holds_it_all(seed):
    xy = np.random.default_rng(seed).uniform(0, 2000, (9, 2))
    problem = problem_of(xy)
    found = shortened(problem, inserted_path(problem), lambda _: True)
    assert found.length_m == pytest.approx(path_lower_bound(xy, R, closed=False).path.length_m, rel=2e-6)


@pytest.mark.parametrize("returns", [False, True])
def test_on_draws_of_the_regime_it_comes_within_a_few_per_cent(returns):
    excess = []
    for seed in range(4):
        xy = np.random.default_rng(seed).uniform(0, 2000, (60, 2))
        problem = problem_of(xy, returns=returns)
        found = shortened(problem, inserted_path(problem), lambda _: True)
        rng = np.random.default_rng(seed)
        for _ in range(10):
            found = reinserted(problem, found, rng)
        shortest = path_lower_bound(xy, R, closed=returns, time_limit_s=None).path.length_m
        assert found.length_m >= shortest * (1 - 1e-6)
        excess.append(found.length_m / shortest - 1)
    assert np.mean(excess) < 0.05


def test_a_fixed_end_elsewhere_is_kept():
    problem = problem_of([[1000, 500], [2000, -500]])
    through = PathProblem(problem.required, R, np.zeros(2), np.array([3000.0, 0.0]))
    found = inserted_path(through)
    assert meets_all(through, found)
    assert found.length_m >= 3000.0
    assert found.length_m == pytest.approx(path_length_m(through.path_m(found.points_m)))


def test_thousands_of_users_get_a_path_at_once():
    xy = np.random.default_rng(0).uniform(0, 5000, (2000, 2))
    found = path_lower_bound(xy, R, closed=False, time_limit_s=0.0)
    assert meets_all(found.problem, found.path)
    assert found.bound_m <= found.path.length_m
