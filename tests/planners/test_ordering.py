"""MPSS and path lengths on cases that a reader can check by hand."""

import numpy as np

from mavplan.planners.ordering import from_origin, minimum_path_order, path_length_m


def test_always_the_nearest_stop_not_yet_visited_comes_next():
    stops = np.array([[100.0, 0], [10, 0], [-15, 0], [20, 0]])
    # From 0: 10 (10 away), 20 (10), then -15 (35) before 100 (80).
    assert minimum_path_order(stops).tolist() == [1, 3, 2, 0]


def test_of_two_stops_equally_near_the_first_one_comes_first():
    assert minimum_path_order(np.array([[0.0, 5], [5, 0]])).tolist() == [0, 1]


def test_the_length_counts_the_way_from_the_origin_and_no_return():
    assert path_length_m(from_origin(np.array([[3.0, 4], [3, 10]]))) == 11.0
