"""STOAIK, BOAIK and its P3, by hand and against a dense search."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mavplan.planners.balance import balance_at, best_balance
from mavplan.planners.boaik import boaik
from mavplan.planners.geometry import nearest_on_path
from mavplan.planners.selection import Place
from mavplan.planners.setting import Setting
from mavplan.planners.stoaik import stoaik
from mavplan.planners.tloaik import tloaik
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio
from tests.support import make_users

CHANNEL = Channel(Radio(), 100.0, D2D(link="ideal"))
R = CHANNEL.radius_m
metres = st.floats(-2000, 2000, allow_nan=False).map(lambda value: round(value, 3))
point = st.tuples(metres, metres).map(np.array)


def setting(clusters, seed=0, solver="closed-form"):
    return Setting(clusters, np.random.default_rng(seed), solver)


def test_stoaik_puts_a_stop_straight_above_everyone_left_over_and_uses_no_d2d():
    users = make_users([[0, 0], [10, 0], [0, 10], [1500, 0], [1500, 120]], pairs=[(0, 1), (3, 4)])
    found = stoaik(users, CHANNEL, setting(1))
    left_over = np.linalg.norm(users.xy_m - users.xy_m.mean(axis=0), axis=1) > R
    for user in np.flatnonzero(left_over):
        assert (np.abs(found.stops_m - users.xy_m[user]).max(axis=1) == 0).any()
    assert not found.assignment.d2d.any()


def test_stoaik_makes_one_stop_above_users_on_one_spot():
    users = make_users([[0, 0], [0, 0], [3000, 0], [3000, 0], [9000, 9000]])
    found = stoaik(users, CHANNEL, setting(1))
    assert len(np.unique(found.stops_m, axis=0)) == len(found.stops_m)


def test_stoaik_is_the_same_with_either_solver():
    users = make_users(np.random.default_rng(1).uniform(0, 2000, (16, 2)))
    fast, slow = (stoaik(users, CHANNEL, setting(4, solver=solver)) for solver in ("closed-form", "cvxpy"))
    assert fast.sum_rate_bit_s_hz == pytest.approx(slow.sum_rate_bit_s_hz, abs=1e-4)
    assert len(fast.stop_at) == len(slow.stop_at)


def place_of(user, left, right):
    """Where a user stands to a reference of one segment, or to its free end."""
    path = np.array([left, left if right is None else right])
    nearest = nearest_on_path(np.array([user]), path)
    return Place(np.asarray(user), nearest.foot_m[0], float(nearest.distance_m[0]), np.asarray(left), right)


@settings(max_examples=60, deadline=None)
@given(user=point, left=point, right=st.none() | point)
def test_p3_is_not_beaten_by_a_dense_search(user, left, right):
    ends = [left] if right is None else [left, right]
    assume(min(np.linalg.norm(user - end) for end in ends) > R + 1)
    where = place_of(user, left, right)
    stop = best_balance(CHANNEL)(where)
    assert np.linalg.norm(stop - user) <= R * (1 + 1e-9)
    radii, angles = np.meshgrid(np.linspace(0, R, 60), np.linspace(0, 2 * np.pi, 240))
    grid = user + np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1)
    best = balance_at(grid, where, CHANNEL).max()
    assert balance_at(stop, where, CHANNEL) >= best * (1 - 1e-9)


def test_p3_finds_the_narrow_peak_beside_a_neighbour_just_out_of_reach():
    where = place_of(np.array([1192.09350586, -15.8349463]), np.array([1487.03850021, -477.1184052]), None)
    assert balance_at(best_balance(CHANNEL)(where), where, CHANNEL) >= 0.0107


def test_p3_lies_between_straight_above_and_the_least_detour():
    stop = best_balance(CHANNEL)(place_of(np.array([1000.0, 900]), np.array([0.0, 0]), np.array([2000.0, 0])))
    assert stop[0] == pytest.approx(1000, abs=0.5)
    assert 900 - R <= stop[1] <= 900


def test_boaik_asks_p3_also_for_a_user_within_reach_of_the_reference():
    around = np.random.default_rng(0).normal(0, 5, (40, 2))
    west, east = around + np.array([1000, 0]), around + np.array([3000, 0])
    users = make_users([*west, *east, [2000, 300]])
    found = boaik(users, CHANNEL, setting(2))
    extra = found.stops_m[np.linalg.norm(found.stops_m - [2000, 0], axis=1) < 500]
    assert len(extra) == 1
    # The foot of the perpendicular is (2000, 0); the balance is nearly straight above.
    assert extra[0, 1] > 250


def test_users_a_rounding_beyond_reach_of_one_another_do_not_stop_sca():
    users = make_users([[1000, 0], [1000 + 2 * R + 1e-8, 0]])
    assert stoaik(users, CHANNEL, setting(1)).assignment.served.all()


def test_boaik_serves_by_d2d_as_tloaik_does_and_measures_against_the_stops_after_sca():
    users = make_users([*[[1000 + i, 0] for i in range(20)], [1000 + R + 100, 0]], pairs=[(0, 20)])
    found = boaik(users, CHANNEL, setting(1))
    assert len(found.stop_at) == 1
    assert np.flatnonzero(found.assignment.d2d).tolist() == [20]
    assert (found.reference_m[1:] == found.stops_m).all()


def test_where_everyone_is_covered_at_once_boaik_is_stoaik_and_not_worse_than_tloaik():
    users = make_users(np.random.default_rng(3).uniform(0, 500, (12, 2)))
    by_rate, balanced, short = (plan(users, CHANNEL, setting(2)) for plan in (stoaik, boaik, tloaik))
    assert (by_rate.stops_m == balanced.stops_m).all()
    assert by_rate.sum_rate_bit_s_hz >= short.sum_rate_bit_s_hz - 1e-9


def test_supplementary_stops_of_boaik_stay_within_reach_of_whom_they_are_for():
    users = make_users([[0, 0], [10, 10], [2500, 0], [2500, 2500]])
    found = boaik(users, CHANNEL, setting(1))
    assert nearest_on_path(users.xy_m, found.path_m).distance_m.max() <= R + 1e-6
