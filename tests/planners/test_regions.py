"""Regions: each place in one of them, none too large, whatever lies where."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.coarse_order import coarse_order
from mavplan.planners.regions import halved, shared_out


def length_m(line):
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


@given(
    seed=st.integers(0, 10**6), count=st.integers(0, 200), most=st.integers(1, 40), spots=st.integers(1, 200)
)
@settings(max_examples=60, deadline=None)
def test_regions_share_all_places_out_none_with_more_than_allowed(seed, count, most, spots):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1e3, 1e3, (spots, 2))[rng.integers(0, spots, count)]  # some of them equal
    regions = halved(places, most)
    assert sorted(np.concatenate(regions).tolist()) == list(range(count))
    assert max(len(own) for own in regions) <= most


@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.31, 0.5, 0.69]))
@settings(max_examples=30, deadline=None)
def test_other_points_lie_in_the_rectangle_of_their_region(seed, share):
    rng = np.random.default_rng(seed)
    places, others = rng.uniform(0, 1e3, (120, 2)), rng.uniform(-100, 1.1e3, (80, 2))
    regions = shared_out(places, others, 20, share)
    assert sorted(np.concatenate([points for _, points in regions]).tolist()) == list(range(80))
    for own, points in regions:
        for other, _ in regions:
            if other is not own:
                # No place of another region stands in the rectangle round a region's own places and points.
                box = np.vstack([places[own], others[points]])
                inside = (places[other] > box.min(axis=0)) & (places[other] < box.max(axis=0))
                assert not inside.all(axis=1).any()


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [1, 2, 7])
def test_a_coarse_order_of_few_places_is_at_most_a_tenth_above_the_best(count, closed):
    from itertools import permutations

    rng = np.random.default_rng(count)
    start = np.zeros(2)
    for _ in range(5):
        places = rng.uniform(-1e3, 1e3, (count, 2))
        end = [start] if closed else []
        order = coarse_order(places, start, start if closed else None)
        assert sorted(order.tolist()) == list(range(count))
        best = min(length_m(np.vstack([start, places[list(p)], *end])) for p in permutations(range(count)))
        assert length_m(np.vstack([start, places[order], *end])) <= 1.1 * best


def test_more_places_than_are_ordered_together_are_ordered_in_groups(monkeypatch):
    rng = np.random.default_rng(0)
    places = rng.uniform(0, 1e4, (150, 2))
    whole = coarse_order(places, np.zeros(2), None)
    monkeypatch.setattr("mavplan.planners.coarse_order.AT_ONCE", 20)
    grouped = coarse_order(places, np.zeros(2), None)
    assert sorted(grouped.tolist()) == list(range(150))
    assert length_m(places[grouped]) < 1.5 * length_m(places[whole])
