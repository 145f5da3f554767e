"""Paths for very many users, region by region: nobody is left, the same anywhere, and hardly longer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.hppp import draw_pairs, draw_users
from mavplan.planners import wide_path as wide
from mavplan.planners import wide_stops
from mavplan.planners.near_legs import legs_near
from mavplan.planners.path_problem import path_problem
from mavplan.planners.quick_path import FIXED, Pieces, improved, touched
from mavplan.planners.spread import spread_here
from mavplan.planners.touring import tour_discs
from tests.support import make_scenario

R = 300.0
CHEAP = {"REGION": 60, "LEAST_ATTEMPTS": 0, "EFFORTS": (0.1, 0.1, 0.1)}


@pytest.fixture
def small_regions(monkeypatch):
    """Regions of sixty users, and little effort."""
    for name, value in CHEAP.items():
        monkeypatch.setattr(wide, name, value)


def drawn(mean, seed, *, pairs=False):
    side_m = 2000 * np.sqrt(mean / 60)
    xy_m, mate = (draw_pairs if pairs else draw_users)(mean, side_m, seed=seed)
    return xy_m - side_m / 2, mate


def away_m(problem, points_m):
    """Distances of the requirements to the path, all pairs measured."""
    return problem.away_m(points_m[None])[0]


def length_m(problem, points_m):
    return float(np.linalg.norm(np.diff(problem.path_m(points_m), axis=0), axis=1).sum())


@pytest.mark.parametrize("returns", [False, True])
@pytest.mark.parametrize("pairs", [False, True])
def test_everybody_is_within_reach_of_the_path_or_its_mate_is(small_regions, returns, pairs):
    for seed in (0, 1):
        xy_m, mate = drawn(400, seed, pairs=pairs)
        problem = path_problem(xy_m, R, returns=returns, mate=mate).without_met()
        points_m = wide.wide_path(problem, 0, spread_here)
        assert away_m(problem, points_m).max() <= R + 1e-6


@given(seed=st.integers(0, 10**6), clusters=st.integers(1, 8), spread_m=st.floats(0.0, 800.0))
@settings(max_examples=15, deadline=None)
def test_nobody_is_left_where_users_stand_in_heaps(seed, clusters, spread_m):
    rng = np.random.default_rng(seed)
    heaps = rng.uniform(-5e3, 5e3, (clusters, 2))
    xy_m = heaps[rng.integers(0, clusters, 150)] + rng.normal(0, 1, (150, 2)) * spread_m
    problem = path_problem(xy_m, R, returns=bool(seed % 2)).without_met()
    if not len(problem.required):
        return
    with pytest.MonkeyPatch.context() as patch:
        for name, value in CHEAP.items():
            patch.setattr(wide, name, value)
        patch.setattr(wide, "REGION", 25)
        points_m = wide.wide_path(problem, seed, spread_here)
    assert away_m(problem, points_m).max() <= R + 1e-6


def test_regions_may_be_worked_out_in_any_order_and_the_path_is_the_same(small_regions):
    def backwards(function, tasks):
        return [function(task) for task in tasks[::-1]][::-1]

    xy_m, _ = drawn(300, 3)
    problem = path_problem(xy_m, R, returns=False).without_met()
    here = wide.wide_path(problem, 5, spread_here)
    np.testing.assert_array_equal(here, wide.wide_path(problem, 5, backwards))
    assert not np.array_equal(here, wide.wide_path(problem, 6, spread_here))


def test_cutting_the_plane_anew_makes_the_path_shorter_than_its_regions_did(small_regions, monkeypatch):
    xy_m, _ = drawn(400, 4)
    problem = path_problem(xy_m, R, returns=False).without_met()
    whole_m = length_m(problem, wide.wide_path(problem, 0, spread_here))
    monkeypatch.setattr(wide, "CUTS", ())
    monkeypatch.setattr(wide, "EFFORTS", (0.3,))
    assert whole_m < length_m(problem, wide.wide_path(problem, 0, spread_here))


def test_progress_is_told_in_order_and_to_the_end(small_regions):
    told = []
    xy_m, _ = drawn(300, 7)
    problem = path_problem(xy_m, R, returns=False).without_met()
    wide.wide_path(problem, 0, spread_here, lambda done, todo: told.append((done, todo)))
    assert told == sorted(told)
    assert told[-1][0] == told[-1][1]


def test_a_path_of_few_users_by_small_changes_is_hardly_longer_than_the_proved_one():
    from mavplan.planners.path_bound import path_lower_bound

    ratios = []
    for seed in range(5):
        xy_m, _ = drawn(30, seed)
        proved = path_lower_bound(xy_m, R, closed=False, time_limit_s=None, node_limit=20_000, seed=seed)
        problem = path_problem(xy_m, R, returns=False).without_met()
        begin = Pieces(np.zeros((1, 2)), np.array([FIXED]), np.zeros(0, dtype=np.bool_), open_end=True)
        found = improved(problem.required, R, begin, np.random.default_rng(0), 300)
        assert away_m(problem, found.points_m[1:]).max() <= R + 1e-6
        ratios.append(length_m(problem, found.points_m[1:]) / proved.path.length_m)
    assert min(ratios) >= 1 - 1e-6
    assert np.mean(ratios) <= 1.04


def test_given_legs_stay_and_meet_nobody():
    xy_m = np.array([[0.0, 0.0], [1000.0, 0.0], [2000.0, 900.0]])
    problem = path_problem(xy_m, R, returns=False, home_m=np.array([-5e3, 0.0]))
    points_m = np.array([[-1000.0, 0.0], [-900.0, 0.0], [3000.0, 0.0], [3100.0, 50.0]])
    given_legs = np.array([False, True, False])
    begin = Pieces(points_m, np.full(4, FIXED), given_legs, open_end=False)
    found = improved(problem.required, R, begin, np.random.default_rng(0), 50)
    at = int(np.flatnonzero(found.given)[0])
    assert found.given.sum() == 1
    np.testing.assert_array_equal(found.points_m[at : at + 2], points_m[1:3])
    np.testing.assert_array_equal(found.points_m[[0, -1]], points_m[[0, -1]])
    for part in (found.points_m[: at + 1], found.points_m[at + 1 :]):
        assert len(part) >= 2
    apart = [
        legs_near(part, xy_m, R + 1e-6)[1] for part in (found.points_m[: at + 1], found.points_m[at + 1 :])
    ]
    assert set(np.concatenate(apart).tolist()) == {0, 1, 2}


@given(
    ax=st.floats(-2, 2),
    ay=st.floats(-2, 2),
    bx=st.floats(-2, 2),
    by=st.floats(-2, 2),
    radius=st.floats(0.05, 0.9),
)
@settings(max_examples=60, deadline=None)
def test_a_touched_point_is_in_its_disc_and_no_way_is_shorter_than_the_best(ax, ay, bx, by, radius):
    a, b = np.array([ax, ay]) * 1e3, np.array([bx, by]) * 1e3
    point = np.array(touched(a.tolist(), b.tolist(), 100.0, -50.0, radius * 1e3))
    centre = np.array([100.0, -50.0])
    assert np.linalg.norm(point - centre) <= radius * 1e3 * (1 + 1e-9) + 1e-6
    way_m = np.linalg.norm(point - a) + np.linalg.norm(point - b)
    assert way_m >= float(tour_discs(centre[None, None], radius * 1e3, a, b).length_m[0]) - 1e-3


def test_ways_by_a_disc_are_hardly_longer_than_the_shortest():
    rng = np.random.default_rng(0)
    ends = rng.uniform(-1500, 1500, (200, 2, 2))
    centres = np.zeros((200, 1, 2))
    best_m = tour_discs(centres, R, ends[:, 0], ends[:, 1]).length_m
    points = np.array([touched(a.tolist(), b.tolist(), 0.0, 0.0, R) for a, b in ends])
    way_m = np.linalg.norm(points[:, None] - ends, axis=2).sum(axis=1)
    assert (way_m / best_m).mean() <= 1.005


def test_legs_near_are_those_of_all_pairs():
    rng = np.random.default_rng(0)
    line, places = rng.uniform(0, 3e3, (40, 2)), rng.uniform(0, 3e3, (100, 2))
    pairs = set(zip(*(column.tolist() for column in legs_near(line, places, 250.0)), strict=True))
    for leg in range(39):
        along = line[leg + 1] - line[leg]
        share = np.clip((places - line[leg]) @ along / (along @ along), 0, 1)
        away = np.linalg.norm(places - line[leg] - share[:, None] * along, axis=1)
        assert {(leg, int(place)) for place in np.flatnonzero(away <= 250.0)} == {
            p for p in pairs if p[0] == leg
        }


class TestStops:
    def test_stops_stand_on_the_path_in_its_order_and_reach_everybody(self, small_regions, monkeypatch):
        from mavplan.radio import planning_channel

        monkeypatch.setattr(wide_stops, "LEGS", 10)
        xy_m, mate = drawn(300, 2, pairs=True)
        scenario = make_scenario(xy_m, pairs=[(n, n + 1) for n in range(0, len(xy_m), 2)])
        channel = planning_channel(scenario)
        problem = path_problem(xy_m, channel.radius_m, returns=False, mate=mate).without_met()
        line = problem.path_m(wide.wide_path(problem, 0, spread_here))
        stops = wide_stops.stops_on_long_path(scenario.users, channel, line, spread_here)
        apart = np.linalg.norm(xy_m[:, None] - stops, axis=2).min(axis=1)
        assert (np.minimum(apart, apart[mate]) <= channel.radius_m + 1e-6).all()
        through = np.vstack([line[:1], stops])
        assert np.linalg.norm(np.diff(through, axis=0), axis=1).sum() <= (
            np.linalg.norm(np.diff(line, axis=0), axis=1).sum() + 1e-6
        )
