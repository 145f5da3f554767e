"""The clustering phase: start, K-means, and the numbers of clusters worth a try."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.planners.clustering import (
    candidate_clusters,
    clip_clusters,
    cluster_centres,
    distinct_places,
    greedy_cover_size,
    spread_start,
    start_spacing_m,
    to_places,
)
from tests.support import make_users, user_fields


def test_the_spacing_of_the_start_is_the_radius_of_a_disc_of_the_area_per_cluster():
    box = np.array([[0.0, 0], [300, 200]])
    assert np.pi * start_spacing_m(box, 3) ** 2 == pytest.approx(300 * 200 / 3)


def test_initial_centres_are_users_and_stand_apart():
    rng = np.random.default_rng(3)
    xy = rng.uniform(0, 2000, (200, 2))
    for clusters in (2, 4, 8):
        start = spread_start(xy, clusters, rng)
        gaps = [np.linalg.norm(a - b) for a, b in itertools.combinations(start, 2)]
        assert min(gaps) >= start_spacing_m(xy, clusters)
        assert all((centre == xy).all(axis=1).any() for centre in start)


@given(users=user_fields(), seed=st.integers(0, 9))
def test_a_start_with_as_many_centres_as_places_takes_every_place(users, seed):
    places = distinct_places(users)
    start = spread_start(to_places(users.xy_m), places, np.random.default_rng(seed))
    assert len(np.unique(start, axis=0)) == places


def test_every_centre_is_the_mean_of_the_users_nearest_to_it():
    xy = np.random.default_rng(5).uniform(0, 2000, (80, 2))
    centres = cluster_centres(xy, 6, np.random.default_rng(0))
    nearest = np.linalg.norm(xy[:, None] - centres, axis=2).argmin(axis=1)
    for index, centre in enumerate(centres):
        np.testing.assert_allclose(centre, xy[nearest == index].mean(axis=0), atol=1e-3)


def test_the_same_seed_gives_the_same_centres():
    xy = np.random.default_rng(5).uniform(0, 2000, (3000, 2))
    first, second = (cluster_centres(xy, 30, np.random.default_rng(7)) for _ in range(2))
    assert (first == second).all()


def test_more_clusters_than_places_are_clipped_and_said_so():
    clusters, notes = clip_clusters(make_users([[0, 0], [0, 0], [5, 5]]), 7)
    assert clusters == 2
    assert "7 clusters asked for" in notes[0].message
    assert clip_clusters(make_users([[0, 0], [5, 5]]), 2) == (2, ())


@given(users=user_fields(most=8))
def test_the_greedy_cover_is_never_smaller_than_the_smallest_and_covers_with_that_many(users):
    radius_m = 700.0
    near = np.linalg.norm(users.xy_m[:, None] - users.xy_m, axis=2) <= radius_m
    sizes = (
        size
        for size in range(1, len(users) + 1)
        for chosen in itertools.combinations(range(len(users)), size)
        if near[list(chosen)].any(axis=0).all()
    )
    smallest = next(sizes)
    found = greedy_cover_size(users.xy_m, radius_m)
    assert smallest <= found <= smallest * (1 + np.log(len(users)) + 1e-9)


def test_auto_tries_every_number_up_to_twice_the_cover_plus_two():
    users = make_users([[i * 1000.0, 0] for i in range(5)] + [[i * 1000.0, 10] for i in range(5)])
    assert candidate_clusters(users, 400.0) == list(range(1, 11))


def test_auto_spreads_thirty_values_over_a_long_range():
    users = make_users([[i * 1000.0, 0] for i in range(100)])
    tried = candidate_clusters(users, 400.0)
    assert len(tried) == 30
    assert (tried[0], tried[-1]) == (1, 100)
