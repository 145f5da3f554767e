"""The fewest stops: against brute force, on cases by hand, and bounded truthfully where the search ends early."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from mavplan.geo import LocalPlane
from mavplan.planners import cover, cover_candidates
from mavplan.planners.clustering import greedy_cover_size
from mavplan.planners.cover import minimum_cover, minimum_pair_cover
from mavplan.planners.cover_bound import packing_bound, requirement_prices, strips_bound
from mavplan.planners.cover_candidates import (
    candidate_centres,
    cover_instance,
    inclusions,
    reduce_instance,
    requirements_of,
)
from mavplan.planners.cover_search import exact_cover, greedy_cover, polish_cover, search_cover
from mavplan.scenario import UNPAIRED
from tests.support import make_users

HYDRANTS = Path(__file__).resolve().parents[2].parent / "shared/data/cambridge_hydrants.geojson"
R = 100.0
metres = st.integers(-250, 250).map(float)
places = st.lists(st.tuples(metres, metres), min_size=1, max_size=7)


def centres_by_hand(xy, radius):
    """Every user and every crossing of two circles round users."""
    found = [*xy]
    for one, other in itertools.combinations(xy, 2):
        apart = np.linalg.norm(other - one)
        if 0 < apart <= 2 * radius:
            middle, across = (one + other) / 2, np.array([other[1] - one[1], one[0] - other[0]]) / apart
            height = np.sqrt(radius**2 - apart**2 / 4)
            found += [middle + height * across, middle - height * across]
    return np.array(found)


def smallest(met):
    """The fewest rows of a 0/1 matrix that together meet every column."""
    return next(
        size
        for size in range(1, met.shape[1] + 1)
        for chosen in itertools.combinations(range(len(met)), size)
        if met[list(chosen)].any(axis=0).all()
    )


def reached_by_hand(xy, radius):
    """Which candidate reaches which user; equal rows once, to keep the brute force small."""
    reach = np.linalg.norm(centres_by_hand(xy, radius)[:, None] - xy, axis=2) <= radius + 1e-7
    return np.unique(reach, axis=0)


def assert_covered(xy, stops, mate=None):
    near = np.linalg.norm(xy[:, None] - stops, axis=2).min(axis=1) <= R + 1e-6
    if mate is not None:
        near |= (mate != UNPAIRED) & near[mate]
    assert near.all()


@settings(max_examples=120)
@given(xy=places)
def test_the_fewest_are_those_of_brute_force(xy):
    xy = np.array(xy)
    found = minimum_cover(xy, R)
    assert found.proved
    assert found.size == smallest(reached_by_hand(xy, R))
    assert_covered(xy, found.stops_m)


@settings(max_examples=80)
@given(xy=places, data=st.data())
def test_the_fewest_for_each_user_or_its_mate_are_those_of_brute_force(xy, data):
    order = data.draw(st.permutations(range(len(xy))))
    paired = data.draw(st.integers(0, len(xy) // 2))
    users = make_users(xy, pairs=[(order[2 * i], order[2 * i + 1]) for i in range(paired)])
    found = minimum_pair_cover(users, R)
    reach = reached_by_hand(users.xy_m, R)
    with_mates = reach | np.where(users.mate == UNPAIRED, False, reach[:, users.mate])
    assert found.proved
    assert found.size == smallest(with_mates)
    assert_covered(users.xy_m, found.stops_m, users.mate)
    assert found.size <= minimum_cover(users.xy_m, R).size


def enclosing_radius(xy):
    """Radius of the smallest disc round these points: two of them are its diameter, or three lie on its rim."""
    centres = [*xy] + [(one + other) / 2 for one, other in itertools.combinations(xy, 2)]
    for one, other, third in itertools.combinations(xy, 3):
        sides = 2 * np.array([other - one, third - one])
        if abs(np.linalg.det(sides)) > 1e-6:
            centres.append(np.linalg.solve(sides, [other @ other - one @ one, third @ third - one @ one]))
    return min(np.linalg.norm(xy - centre, axis=1).max() for centre in centres)


@settings(max_examples=60)
@given(xy=st.lists(st.tuples(metres, metres), min_size=1, max_size=6))
def test_the_fewest_are_those_of_the_best_partition_into_groups_that_a_disc_encloses(xy):
    """Needs no candidate centres: every subset is judged by its smallest enclosing disc."""
    xy = np.array(xy)
    groups = range(1, 2 ** len(xy))
    fits = {
        group
        for group in groups
        if enclosing_radius(xy[[bool(group >> i & 1) for i in range(len(xy))]]) <= R + 1e-7
    }
    fewest = {0: 0}
    for group in groups:
        parts = (part for part in range(1, group + 1) if part & group == part and part in fits)
        fewest[group] = 1 + min(fewest[group & ~part] for part in parts)
    assert minimum_cover(xy, R).size == fewest[2 ** len(xy) - 1]


@given(xy=st.lists(st.tuples(metres, metres), min_size=1, max_size=40))
def test_no_greedy_cover_is_smaller_and_the_bound_is_never_above_the_size(xy):
    xy = np.array(xy)
    found = minimum_cover(xy, R)
    assert found.bound <= found.size <= greedy_cover_size(xy, R)
    assert_covered(xy, found.stops_m)


def test_two_users_exactly_twice_the_radius_apart_share_the_stop_between_them():
    assert minimum_cover(np.array([[0.0, 0], [2 * R, 0]]), R).size == 1
    assert minimum_cover(np.array([[0.0, 0], [2 * R + 0.01, 0]]), R).size == 2


def test_users_on_a_circle_of_the_radius_share_its_centre():
    angle = np.linspace(0, 2 * np.pi, 9)
    assert minimum_cover(R * np.column_stack([np.cos(angle), np.sin(angle)]), R).size == 1


def test_one_user_and_many_on_one_spot_take_one_stop():
    assert minimum_cover(np.zeros((1, 2)), R).size == 1
    assert minimum_cover(np.zeros((30, 2)), R).size == 1


def test_users_in_a_line_take_a_stop_for_each_two_radii():
    line = np.column_stack([np.arange(0, 1001, 50.0), np.zeros(21)])
    assert minimum_cover(line, R).size == 5


def test_a_copy_far_away_takes_as_many_again():
    xy = np.random.default_rng(0).uniform(0, 1500, (60, 2))
    one = minimum_cover(xy, R)
    two = minimum_cover(np.vstack([xy, xy + 1e5]), R)
    assert one.proved
    assert two.proved
    assert two.size == 2 * one.size


def test_a_pair_needs_one_stop_where_two_strangers_need_two():
    users = make_users([[0, 0], [5 * R, 0]], pairs=[(0, 1)])
    assert minimum_cover(users.xy_m, R).size == 2
    assert minimum_pair_cover(users, R).size == 1


def test_progress_never_tells_more_stops_needed_than_known_to_do():
    told = []
    minimum_cover(
        np.random.default_rng(1).uniform(0, 3000, (80, 2)), R, progress=lambda *both: told.append(both)
    )
    assert told
    assert all(bound <= size for bound, size in told)
    assert told[-1][0] == told[-1][1]


def test_no_users_take_no_stop():
    found = minimum_cover(np.zeros((0, 2)), R)
    assert (found.size, found.bound, found.proved) == (0, 0, True)


def test_positions_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="finite"):
        minimum_cover(np.array([[0.0, np.nan]]), R)


@pytest.fixture
def scattered():
    """300 users, few enough for a proof."""
    return np.random.default_rng(7).uniform(0, 2000, (300, 2))


def test_users_asked_by_and_by_take_as_many_stops_as_all_at_once(scattered, monkeypatch):
    dense = scattered / 5
    at_once = minimum_cover(dense, R)
    monkeypatch.setattr(cover, "MOST_WORK", 1_000_000)
    by_and_by = minimum_cover(dense, R)
    assert at_once.proved
    assert by_and_by.proved
    assert by_and_by.size == at_once.size
    assert by_and_by.candidates < at_once.candidates


def test_where_too_few_can_be_asked_all_are_covered_and_the_bound_still_holds(scattered, monkeypatch):
    minimum = minimum_cover(scattered, R)
    monkeypatch.setattr(cover, "MOST_WORK", 1000)
    found = minimum_cover(scattered, R)
    assert_covered(scattered, found.stops_m)
    assert found.bound <= minimum.size <= found.size


def test_large_components_by_search_and_strips_end_between_bound_and_greedy(scattered, monkeypatch):
    minimum = minimum_cover(scattered, R)
    assert minimum.proved
    monkeypatch.setattr(cover, "EASY_REQUIREMENTS", 0)
    monkeypatch.setattr(cover, "EXACT_REQUIREMENTS", 0)
    monkeypatch.setattr("mavplan.planners.cover_bound.STRIP_REQUIREMENTS", 15)
    found = minimum_cover(scattered, R)
    assert_covered(scattered, found.stops_m)
    assert found.bound <= minimum.size <= found.size <= greedy_cover_size(scattered, R)
    assert found.size - found.bound <= 3


@given(xy=st.lists(st.tuples(metres, metres), min_size=2, max_size=40))
def test_every_bound_is_at_most_the_minimum_and_every_search_at_least(xy):
    required = requirements_of(np.array(xy))
    instance = cover_instance(required, candidate_centres(required.places_m, R), R)
    minimum = len(exact_cover(instance.covers)[0])
    small = reduce_instance(instance)
    assert len(exact_cover(small.covers)[0]) == minimum
    prices = requirement_prices(small.covers, 10.0)
    assert (small.covers @ prices).max() <= 1.0 + 1e-12
    assert packing_bound(small.covers) <= minimum
    by_strips = strips_bound(small, prices, 10.0)
    assert prices.sum() <= by_strips <= minimum + 1e-6
    rng = np.random.default_rng(0)
    searched = search_cover(small.covers, greedy_cover(small.covers), minimum, rng)
    polished = polish_cover(small, searched, R, minimum, rng)
    assert minimum <= len(polished) <= len(searched) <= len(greedy_cover(small.covers))
    for chosen in (searched, polished):
        assert small.covers[chosen].sum(axis=0).min() >= 1


@pytest.mark.parametrize("outright", [0, 600])
@given(rows=st.sets(st.frozensets(st.integers(0, 6), min_size=1), min_size=1, max_size=12))
def test_inclusions_are_those_of_pythons_sets(outright, rows):
    rows = sorted(rows, key=sorted)
    dense = np.array([[float(column in row) for column in range(7)] for row in rows])
    with pytest.MonkeyPatch.context() as few:
        few.setattr(cover_candidates, "COMPARED_OUTRIGHT", outright)
        included, including = inclusions(sparse.csr_array(dense))
    assert included.tolist() == [any(row < other for other in rows) for row in rows]
    assert including.tolist() == [any(row > other for other in rows) for row in rows]


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan"), float("inf")])
def test_a_radius_that_is_none_is_refused(radius):
    with pytest.raises(ValueError, match="radius"):
        minimum_cover(np.zeros((1, 2)), radius)


@pytest.mark.skipif(not HYDRANTS.is_file(), reason=f"{HYDRANTS} is not on this machine")
def test_a_quarter_of_a_citys_hydrants_is_covered_and_bounded():
    features = json.loads(HYDRANTS.read_text())["features"]
    lon_deg, lat_deg = np.array([feature["geometry"]["coordinates"][:2] for feature in features[::4]]).T
    xy = LocalPlane(float(lat_deg.mean()), float(lon_deg.mean())).to_xy_m(lat_deg, lon_deg)
    found = minimum_cover(xy, R, time_limit_s=4.0)
    assert_covered(xy, found.stops_m)
    assert 0.95 * found.size <= found.bound <= found.size < greedy_cover_size(xy, R)
