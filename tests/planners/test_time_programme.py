"""Hover programmes side by side, against HiGHS and against what their duals must hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from mavplan.planners.time_programme import least_hover


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
