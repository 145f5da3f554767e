"""Pairing: given pairs against the range, matched pairs against every possible matching."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, milp

from mavplan.d2d import MAX_EXACT_USERS, keep_pairs_in_range, match_pairs, unpaired
from mavplan.errors import InputError
from mavplan.scenario import UNPAIRED


def best_by_trying_all(xy_m, range_m):
    """The most pairs and the least total distance for them, by trying every matching."""

    def best(free):
        if len(free) < 2:
            return 0, 0.0
        first, *rest = free
        found = best(rest)
        for other in rest:
            apart_m = np.linalg.norm(xy_m[first] - xy_m[other])
            if apart_m <= range_m + 1e-6:
                pairs, total_m = best([user for user in rest if user != other])
                found = max(found, (pairs + 1, total_m + apart_m), key=lambda it: (it[0], -it[1]))
        return found

    return best(list(range(len(xy_m))))


def figures(xy_m, mate):
    first = np.flatnonzero(np.arange(len(mate)) < mate)
    return len(first), float(np.linalg.norm(xy_m[first] - xy_m[mate[first]], axis=1).sum())


def check_is_matching(xy_m, mate, range_m):
    paired = np.flatnonzero(mate != UNPAIRED)
    assert (mate[mate[paired]] == paired).all()
    assert (mate[paired] != paired).all()
    assert (np.linalg.norm(xy_m[paired] - xy_m[mate[paired]], axis=1) <= range_m + 1e-6).all()


places = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), min_size=0, max_size=8)


@settings(deadline=None)
@given(places, st.integers(1, 30))
def test_as_many_pairs_as_possible_and_of_those_the_shortest(points, range_m):
    """Against brute force, on a grid where ties and equal places abound."""
    xy_m = np.array(points, dtype=float).reshape(-1, 2)
    mate, warnings = match_pairs(xy_m, float(range_m))
    check_is_matching(xy_m, mate, range_m)
    pairs, total_m = figures(xy_m, mate)
    best_pairs, best_m = best_by_trying_all(xy_m, range_m)
    assert pairs == best_pairs
    assert total_m == pytest.approx(best_m, abs=1e-4)
    assert warnings == ()


@pytest.mark.parametrize(("seed", "users"), [(1, 40), (2, 60)])
def test_many_users_are_matched_as_an_integer_programme_would(seed, users):
    """HiGHS, given one variable a link, finds no more pairs and no shorter ones."""
    xy_m = np.random.default_rng(seed).uniform(0, 500, (users, 2))
    mate, _ = match_pairs(xy_m, 100.0)
    check_is_matching(xy_m, mate, 100.0)
    one, other = np.triu_indices(users, 1)
    apart_m = np.linalg.norm(xy_m[one] - xy_m[other], axis=1)
    one, other, apart_m = (side[apart_m <= 100.0] for side in (one, other, apart_m))
    links_of = np.zeros((users, len(one)))
    links_of[one, np.arange(len(one))] = links_of[other, np.arange(len(one))] = 1
    cost = apart_m - 100.0 * users  # one more pair outweighs all distances together
    best = milp(
        cost, constraints=LinearConstraint(links_of, ub=1), integrality=np.ones(len(one)), bounds=(0, 1)
    )
    chosen = best.x > 0.5
    pairs, total_m = figures(xy_m, mate)
    assert pairs == chosen.sum()
    assert total_m == pytest.approx(apart_m[chosen].sum(), abs=1e-3)


def test_the_most_pairs_come_before_the_shortest_link():
    """Four in a row, the middle two nearest each other: two pairs of 10 m beat one of 2 m."""
    xy_m = np.array([[0, 0], [10, 0], [12, 0], [22, 0]], dtype=float)
    assert match_pairs(xy_m, 11.0)[0].tolist() == [1, 0, 3, 2]


def test_exactly_at_the_range_is_within():
    """As with given pairs."""
    xy_m = np.array([[0, 0], [200, 0]], dtype=float)
    assert match_pairs(xy_m, 200.0)[0].tolist() == [1, 0]
    assert match_pairs(xy_m, 199.999)[0].tolist() == [UNPAIRED, UNPAIRED]
    assert keep_pairs_in_range(xy_m, np.array([1, 0]), 200.0)[0].tolist() == [1, 0]


def test_many_users_linked_with_one_another_are_paired_by_nearness_and_it_is_said():
    """Above the limit each pair is mutually nearest among those that come later, and nobody left could be paired."""
    rng = np.random.default_rng(2)
    xy_m = rng.uniform(0, 1000, (MAX_EXACT_USERS + 50, 2))
    mate, warnings = match_pairs(xy_m, 120.0)
    check_is_matching(xy_m, mate, 120.0)
    assert len(warnings) == 1
    assert warnings[0].severity == "warning"
    assert "550 users" in warnings[0].message
    expected = unpaired(len(xy_m))
    apart = np.linalg.norm(xy_m[:, None] - xy_m[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    free = set(range(len(xy_m)))
    while free:
        some = sorted(free)
        near = {a: min(some, key=lambda b, a=a: apart[a, b]) for a in some}
        mutual = [(a, b) for a, b in near.items() if near[b] == a and apart[a, b] <= 120]
        if not mutual:
            break
        for a, b in mutual:
            expected[a] = b
            free.discard(a)
    assert mate.tolist() == expected.tolist()


def test_a_small_group_beside_a_large_one_is_still_matched_exactly():
    """The limit counts by connected group."""
    rng = np.random.default_rng(2)
    crowd = rng.uniform(0, 500, (MAX_EXACT_USERS + 1, 2))
    row = np.array([[0, 0], [10, 0], [12, 0], [22, 0]], dtype=float) + 5000
    mate, warnings = match_pairs(np.vstack((crowd, row)), 100.0)
    assert len(warnings) == 1
    assert (mate[-4:] - len(crowd)).tolist() == [1, 0, 3, 2]


def test_more_links_than_fit_are_refused(monkeypatch):
    """Ten users at one place make 45 links; the number and a way out are said."""
    monkeypatch.setattr("mavplan.d2d.MAX_LINKS", 44)
    with pytest.raises(InputError, match=r"10 users make 45 links within 5 m, more than the 44"):
        match_pairs(np.zeros((10, 2)), 5.0)
    monkeypatch.setattr("mavplan.d2d.MAX_LINKS", 45)
    assert (match_pairs(np.zeros((10, 2)), 5.0)[0] != UNPAIRED).all()


def test_nobody_and_one_user_have_no_pairs():
    """Empty arrays come back empty."""
    assert match_pairs(np.zeros((0, 2)), 100.0)[0].tolist() == []
    assert match_pairs(np.zeros((1, 2)), 100.0)[0].tolist() == [UNPAIRED]


@given(st.integers(0, 6), st.integers(1, 300), st.integers(0, 2**32 - 1))
def test_given_pairs_in_range_stay_and_others_are_named(pairs, range_m, seed):
    """Exactly the pairs that are too long go, with a warning each, and the input is not changed."""
    rng = np.random.default_rng(seed)
    xy_m = rng.uniform(0, 300, (2 * pairs + 1, 2))
    given_mate = np.append(np.arange(2 * pairs) ^ 1, UNPAIRED)
    before = given_mate.copy()
    mate, warnings = keep_pairs_in_range(xy_m, given_mate, float(range_m))
    assert given_mate.tolist() == before.tolist()
    check_is_matching(xy_m, mate, range_m)
    apart_m = np.linalg.norm(xy_m[0 : 2 * pairs : 2] - xy_m[1 : 2 * pairs : 2], axis=1)
    gone = np.flatnonzero(apart_m > range_m)
    assert (mate == UNPAIRED).sum() == 2 * len(gone) + 1
    assert [
        f"user-{2 * k + 1} and user-{2 * k + 2} is" in w.message for k, w in zip(gone, warnings, strict=True)
    ] == ([True] * len(gone))
