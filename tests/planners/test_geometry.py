"""Plane geometry against brute force."""

import itertools

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from mavplan.planners.geometry import least_detour_on_circle, nearest_of, nearest_on_path, towards

metres = st.floats(-1000, 1000, allow_nan=False)
point = st.tuples(metres, metres).map(np.array)


@given(points=st.lists(point, min_size=1, max_size=5), path=st.lists(point, min_size=2, max_size=6))
def test_no_sampled_point_of_the_path_is_nearer_than_the_one_found(points, path):
    points, path = np.array(points), np.array(path)
    found = nearest_on_path(points, path)
    fractions = np.linspace(0, 1, 201)[:, None]
    samples = np.vstack([a + fractions * (b - a) for a, b in itertools.pairwise(path)])
    sampled_m = np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)
    assert (found.distance_m <= sampled_m + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(points - found.foot_m, axis=1), found.distance_m, atol=1e-9)


def test_of_two_segments_equally_near_the_earlier_one_is_meant():
    path = np.array([[0.0, 0], [10, 0], [10, 10]])
    assert nearest_on_path(np.array([[20.0, 0]]), path).segment[0] == 0


def test_only_the_last_vertex_is_an_end():
    path = np.array([[0.0, 0], [10, 0], [20, 0]])
    at_end = nearest_on_path(np.array([[-5.0, 1], [10, 3], [19, 1], [25, 1]]), path).at_end
    assert at_end.tolist() == [False, False, False, True]


def test_a_path_without_length_is_a_point():
    found = nearest_on_path(np.array([[3.0, 4.0]]), np.zeros((2, 2)))
    assert found.distance_m[0] == 5.0


@given(left=point, right=point, radius_m=st.floats(1, 500))
def test_no_sampled_point_of_the_circle_makes_a_shorter_detour(left, right, radius_m):
    centre = np.zeros(2)
    clearance_m = nearest_on_path(centre[None], np.array([left, right])).distance_m[0]
    assume(clearance_m > radius_m * (1 + 1e-9))
    stop = least_detour_on_circle(centre, radius_m, left, right)
    theta = np.linspace(0, 2 * np.pi, 3601)
    circle = radius_m * np.column_stack([np.cos(theta), np.sin(theta)])
    sampled_m = (np.linalg.norm(circle - left, axis=1) + np.linalg.norm(circle - right, axis=1)).min()
    detour_m = np.linalg.norm(stop - left) + np.linalg.norm(stop - right)
    assert detour_m <= sampled_m + 1e-9 * (1 + sampled_m)
    assert np.isclose(np.linalg.norm(stop), radius_m)


def test_with_one_neighbour_the_stop_is_on_the_straight_line_to_it():
    np.testing.assert_allclose(towards(np.array([1000.0, 0]), 400.0, np.zeros(2)), [600.0, 0])


@given(points=st.lists(point, min_size=1, max_size=8), places=st.lists(point, min_size=1, max_size=8))
def test_the_nearest_place_is_that_of_a_full_search(points, places):
    points, places = np.array(points), np.array(places)
    distance_m, index = nearest_of(points, places)
    every_m = np.linalg.norm(points[:, None] - places, axis=2)
    np.testing.assert_allclose(distance_m, every_m.min(axis=1), atol=1e-9)
    np.testing.assert_allclose(every_m[np.arange(len(points)), index], distance_m, atol=1e-9)


@given(path=st.lists(point, min_size=3, max_size=3), away=st.floats(1, 300))
def test_at_an_inner_vertex_the_earlier_segment_is_meant_to_the_last_bit(path, away):
    path = np.array(path)
    before, after = path[1] - path[0], path[1] - path[2]
    lengths = np.linalg.norm(before), np.linalg.norm(after)
    assume(min(lengths) > 1.0)
    outward = before / lengths[0] + after / lengths[1]
    assume(np.linalg.norm(outward) > 1e-3)
    user = path[1] + away * outward / np.linalg.norm(outward)
    found = nearest_on_path(user[None], path)
    assert found.segment[0] == 0
    assert not found.at_end[0]
    assert (found.foot_m[0] == path[1]).all()


def test_a_last_segment_without_length_is_still_an_end():
    path = np.array([[0.0, 0], [10, 0], [10, 0]])
    assert nearest_on_path(np.array([[15.0, 0]]), path).at_end[0]


@given(radius_m=st.floats(0.1, 1e5), beyond=st.floats(1e-9, 1e-3), angle=st.floats(0.1, 3.0))
def test_a_stop_just_outside_the_circle_is_no_fault(radius_m, beyond, angle):
    left = np.array([radius_m * (1 + beyond), 0.0])
    right = 3 * radius_m * np.array([np.cos(angle / 2), np.sin(angle / 2)])
    found = least_detour_on_circle(np.zeros(2), radius_m, left, right)
    assert np.isclose(np.linalg.norm(found), radius_m)


def test_of_places_equally_near_the_first_is_meant_also_in_a_large_tree():
    places = np.vstack([np.random.default_rng(0).uniform(500, 900, (60, 2)), [[0, 10], [10, 0], [0, -10]]])
    places = places[::-1]
    assert nearest_of(np.zeros((1, 2)), places)[1][0] == 0
