"""Paths that pay tolls: curve, tours, the search over all orders, and how high a sum of prices rises."""

import itertools

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.toll_curve import Curve
from mavplan.planners.toll_plateau import Payers, highest_sum
from mavplan.planners.toll_problem import TollProblem, distances_m, reaching_all
from mavplan.planners.toll_search import TollSearch
from mavplan.planners.toll_tours import Tolls, solve_tours
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio

CHANNEL = Channel(Radio(), 100.0, D2D())
CHANNELS = [
    CHANNEL,
    Channel(Radio(path_loss_exponent=4.0, ref_gain_db=-20.0), 30.0, D2D()),
    Channel(Radio(), 300.0, D2D(), position_error_m=8.0),
]
LEG_COST = 0.1


def problem_of(seed, users, *, end_cost=None, paired=0):
    """Users in 2 km, some with a toll, some only to be reached; the first of them in pairs."""
    rng = np.random.default_rng(seed)
    members = np.stack([np.arange(users)] * 2, axis=1)
    members[:paired, 1] = users - 1 - np.arange(paired)
    members = members[: users - paired]
    weights = rng.uniform(0, 60, len(members)) * (rng.random(len(members)) < 0.7)
    fixed = rng.uniform(0, 5, (len(members), 2))
    fixed[paired:, 1] = fixed[paired:, 0]
    return TollProblem(
        members,
        rng.uniform(-300, 1700, (users, 2)),
        fixed,
        np.stack([weights, weights], axis=1),
        Curve.of(CHANNEL),
        LEG_COST,
        end_cost,
    )


def least_cost(problem, order):
    """The cheapest path that passes these (requirement, member) in this order and pays their tolls, by CVXPY."""
    points = cp.Variable((len(order), 2))
    path = [np.zeros(2), *[points[k] for k in range(len(order))]]
    cost = sum(problem.leg_cost * cp.norm(b - a) for a, b in itertools.pairwise(path))
    if problem.end_cost is not None:
        cost += problem.end_cost * cp.norm(points[len(order) - 1])
    away, tolls = cp.Variable(len(order)), cp.Variable(len(order))
    curve = problem.curve
    limits = [away <= curve.radius_m]
    for k, step in enumerate(order):
        limits.append(cp.norm(points[k] - problem.places_m[problem.members[step]]) <= away[k])
        limits.append(tolls[k] >= curve.values[:-1] + cp.multiply(curve.slopes, away[k] - curve.knots_m[:-1]))
        cost += problem.fixed[step] + problem.weights[step] * tolls[k]
    solved = cp.Problem(cp.Minimize(cost), limits)
    return solved.solve(solver=cp.CLARABEL)


@pytest.mark.parametrize("channel", CHANNELS)
def test_the_curve_is_convex_rises_and_stays_below_the_slowness(channel):
    curve = Curve.of(channel)
    assert (np.diff(curve.slopes) > 0).all()
    assert curve.slopes[0] >= 0
    away = np.linspace(0, channel.radius_m, 5001)
    slowness = channel.air_rate(np.zeros(1))[0] / channel.air_rate(away)
    assert (curve.at(away) <= slowness + 1e-12).all()
    assert curve.values[0] == 1.0


@given(pull=st.floats(0, 3), weight=st.floats(0, 100))
def test_the_conjugate_is_the_greatest_of_all_distances(pull, weight):
    curve = Curve.of(CHANNEL)
    expected = (pull * curve.knots_m - weight * curve.values).max()
    assert curve.conjugate(np.array([pull]), np.array([weight]))[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("end_cost", [None, 0.1, 0.04])
def test_tours_are_solved_and_bounded_as_by_cvxpy(end_cost):
    for seed in range(3):
        problem = problem_of(seed, 6, end_cost=end_cost)
        order = [(q, 0) for q in np.random.default_rng(seed).permutation(6)]
        members = problem.members[[q for q, _ in order], 0]
        tolls = Tolls(
            problem.places_m[None, members],
            problem.weights[[q for q, _ in order], 0][None],
            LEG_COST,
            end_cost,
            problem.curve,
        )
        legs = 6 + (end_cost is not None)
        found = solve_tours(tolls, tolls.centres_m, np.zeros((1, legs, 2)), 300)
        fixed = sum(problem.fixed[step] for step in order)
        exact = least_cost(problem, order)
        assert exact * (1 - 3e-3) <= found.bound[0] + fixed <= exact * (1 + 1e-3)
        half_way = solve_tours(tolls, tolls.centres_m, np.zeros((1, legs, 2)), 5)
        assert half_way.bound[0] <= found.bound[0] * (1 + 1e-3)
        assert tolls.bound(found.duals)[0] == found.bound[0]


@pytest.mark.parametrize(("end_cost", "paired"), [(None, 0), (0.1, 0), (None, 1)])
def test_the_search_finds_the_cheapest_of_all_orders(end_cost, paired):
    for seed in range(2):
        problem = problem_of(seed, 4, end_cost=end_cost, paired=paired)
        search = TollSearch(problem, np.inf)
        search.run(1e-3, lambda: True)
        requirements = range(len(problem.members))
        exact = min(
            least_cost(problem, list(zip(order, which, strict=True)))
            for order in itertools.permutations(requirements)
            if end_cost is None or order[0] < order[-1]
            for which in itertools.product((0, 1) if paired else (0,), repeat=len(order))
            if all(
                not w or problem.members[q, 0] != problem.members[q, 1]
                for q, w in zip(order, which, strict=True)
            )
        )
        # Passing everybody's nearest point in some order is what any path does.
        assert search.bound <= exact * (1 + 1e-3)
        assert search.bound == pytest.approx(search.cost, rel=2e-3)
        assert search.cost >= exact * (1 - 3e-3)


def test_a_search_cut_short_still_bounds_from_below():
    problem = problem_of(3, 12)
    whole = TollSearch(problem, np.inf)
    whole.run(1e-3, lambda: True)
    for most in (1, 10, 50):
        short = TollSearch(problem, np.inf)
        short.run(1e-3, lambda short=short, most=most: short.nodes < most)
        assert short.bound <= whole.cost
    assert whole.bound == pytest.approx(whole.cost, rel=1e-3)
    away = distances_m(whole.best, problem.places_m)
    assert (away <= CHANNEL.radius_m + 0.01).all()


def test_complete_paths_are_kept_from_the_cheapest_on():
    problem = problem_of(5, 9)
    search = TollSearch(problem, np.inf)
    search.run(1e-3, lambda: True)
    kept = search.promising
    costs = []
    for points_m in kept:
        tolls, beyond = problem.tolls_along(points_m)
        assert (beyond.min(axis=1) == 0).all()
        costs.append(problem.way_cost(points_m) + np.where(beyond > 0, np.inf, tolls).min(axis=1).sum())
    assert len(kept) > 1
    assert costs == sorted(costs)
    assert costs[0] == search.cost
    np.testing.assert_array_equal(kept[0], search.best)


@pytest.mark.parametrize("users", [1, 5, 40])
def test_a_path_is_completed_until_it_reaches_a_member_of_each_requirement(users):
    problem = problem_of(users, users, paired=users // 4)
    for given_m in (np.empty((0, 2)), problem.places_m[:1]):
        found_m = reaching_all(problem, given_m)
        away = distances_m(found_m, problem.places_m)[problem.members].min(axis=1)
        assert (away <= problem.curve.radius_m + 2e-3).all()
        assert all((found_m == point).all(axis=1).any() for point in given_m)
    again_m = reaching_all(problem, found_m)
    np.testing.assert_array_equal(again_m, found_m)


def test_a_target_that_is_reached_ends_the_search():
    problem = problem_of(4, 12)
    whole, aimed = TollSearch(problem, np.inf), TollSearch(problem, 60.0)
    whole.run(1e-3, lambda: True)
    aimed.run(1e-3, lambda: True)
    assert aimed.nodes < whole.nodes
    assert 60.0 - 1e-3 <= aimed.bound <= whole.bound + 1e-9


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000))
def test_the_highest_sum_is_no_lower_than_any_sample_and_hardly_higher(seed):
    rng = np.random.default_rng(seed)
    users = rng.uniform(0, 1500, (8, 2))
    flat, steep = rng.uniform(0, 0.5, 8), rng.uniform(0, 0.5, 8)
    flat[:2] = steep[1:3] = 0.0
    found = highest_sum(Payers(users, flat, steep, CHANNEL), 0.7, 1e-3)
    samples = np.vstack([users, rng.uniform(-200, 1700, (20_000, 2))])
    away = np.linalg.norm(samples[:, None] - users, axis=2)
    rates = CHANNEL.air_rate(away) / CHANNEL.air_rate(np.zeros(1))
    sums = (CHANNEL.reaches(away) * (flat + steep * rates)).sum(axis=1)
    assert sums.max() <= found.most
    above = sums.max() > 0.7
    assert bool(len(found.peaks_m)) or not above
    if len(found.peaks_m):
        away = np.linalg.norm(found.peaks_m[:, None] - users, axis=2)
        rates = CHANNEL.air_rate(away) / CHANNEL.air_rate(np.zeros(1))
        peaks = (CHANNEL.reaches(away) * (flat + steep * rates)).sum(axis=1)
        assert (peaks > 0.7).all()
        assert found.most <= max(peaks.max(), sums.max()) * 1.01


def test_nobody_pays_nothing():
    assert highest_sum(Payers(np.zeros((2, 2)), np.zeros(2), np.zeros(2), CHANNEL), 1.0, 1e-3).most == 0.0
