"""Random users: the statistics of the process they are said to come from. All seeds are fixed."""

import numpy as np
import pytest
from scipy import stats

from mavplan.hppp import draw_pairs, draw_users
from mavplan.scenario import UNPAIRED


def test_the_same_seed_gives_the_same_users():
    """As a number and as a generator; another seed gives others."""
    for draw in (draw_users, draw_pairs):
        first, _ = draw(20.0, seed=4)
        assert first.tolist() == draw(20.0, seed=np.random.default_rng(4))[0].tolist()
        assert first.tolist() != draw(20.0, seed=5)[0].tolist()


@pytest.mark.parametrize("mean", [3.0, 15.0, 60.0])
def test_the_number_of_single_users_is_poisson(mean):
    """Chi-squared of 2,000 counts against the Poisson law."""
    rng = np.random.default_rng(1)
    counts = np.array([len(draw_users(mean, seed=rng, min_users=0)[0]) for _ in range(2000)])
    assert chi_squared_p(counts, mean) > 0.01


def test_the_number_of_pairs_is_poisson_with_half_the_mean():
    """λ counts users; a pair is two of them."""
    rng = np.random.default_rng(2)
    counts = np.array([len(draw_pairs(16.0, seed=rng, min_pairs=0)[0]) // 2 for _ in range(2000)])
    assert chi_squared_p(counts, 8.0) > 0.01


def chi_squared_p(counts, mean):
    """Probability of counts at least this far from Poisson(mean), cells of at least five expected counts."""
    low, high = stats.poisson.ppf([0.005, 0.995], mean).astype(int)
    edges = np.arange(low, high + 1)
    observed = np.array(
        [(counts <= low).sum(), *((counts == k).sum() for k in edges[1:-1]), (counts >= high).sum()]
    )
    expected = np.array(
        [
            stats.poisson.cdf(low, mean),
            *stats.poisson.pmf(edges[1:-1], mean),
            stats.poisson.sf(high - 1, mean),
        ]
    )
    return stats.chisquare(observed, expected / expected.sum() * len(counts)).pvalue


def test_positions_are_uniform_in_the_square():
    """Kolmogorov-Smirnov in both directions, and no correlation between them."""
    xy_m, mate = draw_users(20_000.0, 500.0, seed=3)
    assert (mate == UNPAIRED).all()
    for axis in (0, 1):
        assert stats.kstest(xy_m[:, axis] / 500.0, "uniform").pvalue > 0.01
    assert abs(np.corrcoef(xy_m.T)[0, 1]) < 0.02
    assert ((xy_m >= 0) & (xy_m <= 500)).all()


def test_counts_in_disjoint_halves_are_independent():
    """What makes it a Poisson process: variance of each half equals its mean, and the two do not go together."""
    rng = np.random.default_rng(4)
    halves = np.array(
        [np.histogram(draw_users(30.0, 2.0, seed=rng)[0][:, 0], [0, 1, 2])[0] for _ in range(3000)]
    )
    assert halves.var(axis=0) / halves.mean(axis=0) == pytest.approx([1, 1], abs=0.08)
    assert abs(np.corrcoef(halves.T)[0, 1]) < 0.05


def test_mates_are_uniform_in_the_disc_round_their_user():
    """Away from the border r²/R² and the bearing are uniform."""
    xy_m, mate = draw_pairs(40_000.0, 100_000.0, 200.0, seed=5)
    assert (mate[mate] == np.arange(len(mate))).all()
    user, other = xy_m[0::2], xy_m[1::2]
    inside = ((user > 200) & (user < 99_800)).all(axis=1)
    offset = (other - user)[inside]
    assert stats.kstest((offset**2).sum(axis=1) / 200.0**2, "uniform").pvalue > 0.01
    bearing = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) + 0.5
    assert stats.kstest(bearing, "uniform").pvalue > 0.01


def test_mates_beyond_the_border_are_moved_onto_it():
    """All in the square, none further than the radius; in a small square many on its border."""
    xy_m, _ = draw_pairs(4000.0, 400.0, 200.0, seed=6)
    assert ((xy_m >= 0) & (xy_m <= 400)).all()
    assert np.linalg.norm(xy_m[0::2] - xy_m[1::2], axis=1).max() <= 200.0
    on_border = ((xy_m[1::2] == 0) | (xy_m[1::2] == 400)).any(axis=1).mean()
    assert 0.2 < on_border < 0.6


def test_a_small_draw_counts_as_the_least_number():
    """Three pairs, one user, or as asked."""
    assert len(draw_pairs(0.0)[0]) == 6
    assert len(draw_pairs(0.0, min_pairs=5)[0]) == 10
    assert len(draw_users(0.0)[0]) == 1
