"""Hover programmes side by side, against HiGHS and against what their duals must hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from mavplan.planners.time_programme import least_hover, least_hover_at


def drawn(seed, batch=6):
    """Rates with gaps, needs that the rates can meet; some needs 0 or below."""
    rng = np.random.default_rng(seed)
    stops, users = int(rng.integers(1, 9)), int(rng.integers(1, 25))
    rates = rng.uniform(0.2, 1.0, (batch, stops, users)) * (rng.random((batch, stops, users)) < 0.5)
    needs = rng.uniform(-5.0, 30.0, (batch, users))
    return rates, np.where(rates.any(axis=1), needs, -1.0)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_least_sum_is_that_of_highs_and_the_prices_prove_it(seed):
    rates, needs = drawn(seed)
    found = least_hover(rates, needs)
    for k in range(len(rates)):
        solved = linprog(np.ones(rates.shape[1]), A_ub=-rates[k].T, b_ub=-needs[k])
        assert found.total_s[k] == pytest.approx(solved.fun, abs=1e-7)
        assert found.holds_s[k].sum() == pytest.approx(solved.fun, abs=1e-7)
        assert (rates[k].T @ found.holds_s[k] >= needs[k] - 1e-7).all()
        assert (found.holds_s[k] >= -1e-12).all()
        assert (rates[k] @ found.prices[k] <= 1 + 1e-7).all()
        assert found.prices[k] @ np.maximum(needs[k], 0) == pytest.approx(solved.fun, abs=1e-7)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), changed=st.integers(0, 3))
def test_prices_of_a_plan_bound_those_near_it_and_its_own_to_the_second(seed, changed):
    rates, needs = drawn(seed)
    prices = least_hover(rates[:1], needs[:1]).prices[0]
    near = np.repeat(rates[:1], len(rates), axis=0)
    near[1:, :changed] = rates[1:, :changed]
    wants = np.where(near.any(axis=1), needs, 0.0)
    wants[0] = needs[0]
    least = least_hover(near, wants).total_s
    bound = least_hover_at(prices, near, wants)
    assert (bound <= least + 1e-7).all()
    assert bound[0] == pytest.approx(least[0], abs=1e-7)


def test_a_new_stop_lowers_the_prices_that_lose_least_by_it():
    rates = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.75]]])
    needs = np.array([[8.0, 1.0, 3.0]])
    # The third stop is 0.25 too dear: half of the second price costs 0.5 s, a third of the third would cost 1 s.
    assert least_hover_at(np.ones(3), rates, needs) == pytest.approx([11.5])


def test_no_plans_and_no_stops_are_bound_by_nothing():
    assert least_hover_at(np.ones(4), np.empty((0, 2, 4)), np.empty((0, 4))).shape == (0,)
    assert least_hover_at(np.ones(4), np.empty((3, 0, 4)), np.ones((3, 4))).tolist() == [0.0] * 3


def test_a_need_that_no_stop_meets_takes_for_ever_and_disturbs_nobody():
    rates = np.array([[[1.0, 0.0]], [[1.0, 0.5]]])
    found = least_hover(rates, np.array([[2.0, 1.0], [2.0, 1.0]]))
    assert found.total_s.tolist() == [np.inf, 2.0]


def test_nothing_needed_takes_nothing():
    found = least_hover(np.ones((2, 3, 4)), np.array([[0.0] * 4, [-1.0] * 4]))
    assert found.total_s.tolist() == [0.0, 0.0]
    assert not found.holds_s.any()


def test_thousands_go_through_in_parts():
    rates, needs = drawn(7, batch=3000)
    whole = least_hover(rates, needs)
    some = least_hover(rates[2990:], needs[2990:])
    np.testing.assert_allclose(whole.total_s[2990:], some.total_s)
