"""The intervals against SciPy's: Student's for a mean, the bootstrap for a ratio of means."""

import numpy as np
import pytest
from scipy import stats

from mavplan.study.intervals import mean_interval, ratio_of_means_interval


@pytest.fixture
def draws():
    """Lengths of a plan and of the benchmark on the same 400 draws, related as such lengths are."""
    rng = np.random.default_rng(5)
    benchmark = rng.gamma(20.0, 400.0, 400)
    return 0.4 * benchmark + rng.normal(300.0, 250.0, 400), benchmark


@pytest.mark.parametrize("count", [2, 3, 30, 400])
def test_the_interval_of_a_mean_is_students(draws, count):
    values = draws[0][:count]
    found = mean_interval(values)
    low, high = stats.t.interval(0.95, count - 1, loc=values.mean(), scale=stats.sem(values))
    assert (found.value, found.low, found.high) == pytest.approx((values.mean(), low, high))


def test_the_interval_of_a_paired_difference_is_that_of_the_paired_t_test(draws):
    plan, benchmark = draws
    found = mean_interval(plan - benchmark)
    expected = stats.ttest_rel(plan, benchmark).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high))


def test_the_interval_of_a_ratio_of_means_is_that_of_the_bootstrap(draws):
    found = ratio_of_means_interval(*draws)
    assert found.value == pytest.approx(draws[0].mean() / draws[1].mean())
    boot = stats.bootstrap(
        draws,
        lambda plan, benchmark, axis: plan.mean(axis=axis) / benchmark.mean(axis=axis),
        paired=True,
        n_resamples=4000,
        rng=np.random.default_rng(1),
    )
    # The delta method and 4,000 resamples each know the ends to a few per cent of the width.
    width = boot.confidence_interval.high - boot.confidence_interval.low
    assert found.low == pytest.approx(boot.confidence_interval.low, abs=0.06 * width)
    assert found.high == pytest.approx(boot.confidence_interval.high, abs=0.06 * width)


def test_the_interval_of_a_ratio_holds_the_truth_nineteen_times_in_twenty():
    rng = np.random.default_rng(11)
    held = 0
    for _ in range(2000):
        benchmark = rng.gamma(20.0, 400.0, 60)
        plan = 0.4 * benchmark + rng.normal(300.0, 250.0, 60)
        found = ratio_of_means_interval(plan, benchmark)
        held += found.low <= (0.4 * 8000.0 + 300.0) / 8000.0 <= found.high
    # 0.95 ± 4 standard deviations of a count of 2,000.
    assert 0.93 < held / 2000 < 0.97


def test_a_ratio_of_the_same_figures_is_one_without_width(draws):
    found = ratio_of_means_interval(draws[0], draws[0])
    assert (found.value, found.half_width) == (1.0, 0.0)


def test_one_draw_has_no_interval():
    assert mean_interval(np.array([3.0])).low is None
    found = ratio_of_means_interval(np.array([3.0]), np.array([4.0]))
    assert (found.value, found.low, found.half_width) == (0.75, None, None)
