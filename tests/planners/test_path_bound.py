"""The shortest path that reaches everybody, against all orders, and what its bound must never do."""

import itertools

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.path_bound import path_lower_bound
from mavplan.planners.touring import tour_discs
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario import UNPAIRED
from tests.support import user_fields

RADIUS_M = 300.0
HOME = np.zeros(2)


def by_all_orders(xy_m, closed, mate=None):
    """The least length over every order of every choice of pair members; touring is held against Clarabel elsewhere."""
    users = range(len(xy_m))
    groups = (
        [(n,) for n in users]
        if mate is None
        else [(n,) if mate[n] == UNPAIRED else (n, mate[n]) for n in users]
    )
    shortest = np.inf
    for members in itertools.product(*dict.fromkeys(tuple(sorted(group)) for group in groups)):
        away = [member for member in members if np.linalg.norm(xy_m[member]) > RADIUS_M]
        if not away:
            return 0.0
        orders = np.array(list(itertools.permutations(away)))
        tours = tour_discs(xy_m[orders], RADIUS_M, HOME, HOME if closed else None, precision=1e-6)
        shortest = min(shortest, float(tours.length_m.min()))
    return shortest


def reached(xy_m, found, mate=None):
    away = found.problem.away_m(found.path.points_m[None])[0]
    path = found.problem.path_m(found.path.points_m)
    steps = np.linspace(0, 1, 2001)[:, None, None]
    along = (path[:-1] + steps * np.diff(path, axis=0)).reshape(-1, 2) if len(path) > 1 else path
    distance = np.linalg.norm(xy_m[:, None] - along[None], axis=2).min(axis=1)
    met = distance <= RADIUS_M + 0.1
    assert (away <= RADIUS_M + REACH_TOLERANCE_M).all()
    return met if mate is None else met | (np.where(mate == UNPAIRED, False, met[mate]))


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("users", [1, 2, 3, 5, 6, 7])
@pytest.mark.parametrize("side_m", [700.0, 2000.0])
def test_it_is_the_shortest_over_all_orders(users, side_m, closed):
    xy = np.random.default_rng([users, int(side_m)]).uniform(-side_m / 2, side_m, (users, 2))
    found = path_lower_bound(xy, RADIUS_M, closed=closed, time_limit_s=None)
    exact = by_all_orders(xy, closed)
    assert found.path.length_m == pytest.approx(exact, rel=2e-6, abs=2e-3)
    assert found.bound_m <= exact * (1 + 1e-9)
    assert found.proved
    assert reached(xy, found).all()


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
def test_clarabel_finds_no_shorter_path_in_any_order_of_six(closed):
    xy = np.random.default_rng(11).uniform(400, 2000, (6, 2))
    points, centres = cp.Variable((6, 2)), cp.Parameter((6, 2))
    home = np.zeros((1, 2))
    path = cp.vstack([home, points, *([home] if closed else [])])
    length = cp.sum(cp.norm(path[1:] - path[:-1], axis=1))
    programme = cp.Problem(cp.Minimize(length), [cp.norm(points - centres, axis=1) <= RADIUS_M])
    shortest = np.inf
    for order in itertools.permutations(range(6)):
        centres.value = xy[list(order)]
        shortest = min(shortest, programme.solve(solver="CLARABEL"))
    found = path_lower_bound(xy, RADIUS_M, closed=closed, time_limit_s=None)
    assert found.path.length_m == pytest.approx(shortest, rel=2e-6)
    assert found.bound_m <= shortest * (1 + 1e-7)


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("seed", range(4))
def test_of_a_pair_the_better_member_is_reached(seed, closed):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 2000, (7, 2))
    mate = np.array([1, 0, 3, 2, 5, 4, UNPAIRED])
    found = path_lower_bound(xy, RADIUS_M, closed=closed, mate=mate, time_limit_s=None)
    exact = by_all_orders(xy, closed, mate)
    assert found.path.length_m == pytest.approx(exact, rel=2e-6, abs=2e-3)
    assert found.bound_m <= exact * (1 + 1e-9)
    assert reached(xy, found, mate).all()


@pytest.mark.parametrize("mean", [16, 60])
def test_random_users_of_the_regime_are_proved(mean):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        xy = rng.uniform(0, 2000, (rng.poisson(mean), 2))
        found = path_lower_bound(xy, RADIUS_M, closed=False, time_limit_s=None, node_limit=20_000)
        assert found.proved
        assert reached(xy, found).all()


def test_a_node_limit_leaves_a_path_a_valid_bound_and_the_same_answer_again():
    xy = np.random.default_rng(7).uniform(0, 2000, (63, 2))
    proved = path_lower_bound(xy, RADIUS_M, closed=False, time_limit_s=None)
    short, again = (
        path_lower_bound(xy, RADIUS_M, closed=False, time_limit_s=None, node_limit=60) for _ in range(2)
    )
    assert short.bound_m < proved.bound_m <= short.path.length_m
    assert proved.path.length_m <= short.path.length_m * (1 + 1e-7)
    assert short.gap > 0.001
    assert (short.bound_m, short.path.sequence) == (again.bound_m, again.path.sequence)
    assert (short.path.points_m == again.path.points_m).all()


def test_no_time_at_all_still_gives_a_path():
    xy = np.random.default_rng(8).uniform(0, 2000, (40, 2))
    found = path_lower_bound(xy, RADIUS_M, closed=False, time_limit_s=0.0)
    assert reached(xy, found).all()
    assert 0.0 <= found.bound_m < found.path.length_m


def test_who_is_reached_from_home_needs_no_way():
    xy = np.array([[0.0, 299.0], [-200.0, 0.0], [0.0, RADIUS_M]])
    found = path_lower_bound(xy, RADIUS_M, closed=False)
    assert (found.path.length_m, found.bound_m, found.gap, found.proved) == (0.0, 0.0, 0.0, True)


def test_one_user_is_approached_straight():
    found = path_lower_bound(np.array([[600.0, 800.0]]), RADIUS_M, closed=True)
    assert found.path.length_m == pytest.approx(1400.0, rel=1e-6)
    assert found.path.points_m[0] == pytest.approx([420.0, 560.0], abs=0.01)


def test_the_search_tells_how_far_it_is():
    told = []
    xy = np.random.default_rng(9).uniform(0, 2000, (60, 2))
    path_lower_bound(xy, RADIUS_M, closed=False, progress=lambda bound, length: told.append((bound, length)))
    bounds, lengths = np.array(told).T
    assert (np.diff(bounds) >= -1e-6 * bounds[-1]).all()
    assert (np.diff(lengths) <= 0).all()
    assert (bounds <= lengths).all()


@pytest.mark.parametrize("radius_m", [0.0, -1.0, np.nan, np.inf])
def test_a_radius_that_is_none_is_refused(radius_m):
    with pytest.raises(ValueError, match="radius"):
        path_lower_bound(np.ones((1, 2)), radius_m, closed=False)


def test_a_position_that_is_nowhere_is_refused():
    with pytest.raises(ValueError, match="finite"):
        path_lower_bound(np.array([[np.nan, 0.0]]), RADIUS_M, closed=False)


@settings(deadline=None, max_examples=40)
@given(user_fields(most=9), st.booleans(), st.booleans())
def test_bound_and_length_enclose_each_other_for_any_users(users, closed, pairs):
    mate = users.mate if pairs else None
    found = path_lower_bound(users.xy_m, RADIUS_M, closed=closed, mate=mate, time_limit_s=None)
    assert found.bound_m <= found.path.length_m * (1 + 1e-12)
    assert found.proved
    assert reached(users.xy_m, found, mate).all()
