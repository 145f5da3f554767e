"""SBW's snake by hand, and the joint evaluation index."""

import numpy as np
import pytest

from mavplan.planners.index import joint_index
from mavplan.planners.sbw import sbw, strip_of
from mavplan.planners.setting import Setting
from mavplan.planners.tloaik import tloaik
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio
from tests.support import make_users

CHANNEL = Channel(Radio(), 100.0, D2D(link="ideal"))
R = CHANNEL.radius_m


def test_the_snake_flies_all_of_every_strip_southernmost_first_from_the_west():
    # A rectangle 1000 m by 1.6 R: two strips of width R.
    users = make_users([[100, 0], [1100, 0], [100, 1.6 * R], [1100, 1.6 * R]])
    found = sbw(users, CHANNEL)
    np.testing.assert_allclose(
        found.path_m, [[0, 0], [100, 0.5 * R], [1100, 0.5 * R], [1100, 1.5 * R], [100, 1.5 * R]]
    )
    assert found.length_m == pytest.approx(np.hypot(100, 0.5 * R) + 1000 + R + 1000)
    assert found.stop_at.tolist() == [1, 2, 3, 4]


def test_a_user_within_reach_of_an_earlier_stop_gets_none():
    users = make_users([[0, 0], [0.5 * R, 10], [3 * R, 0]])
    found = sbw(users, CHANNEL)
    assert len(found.stop_at) == 2
    assert found.assignment.stop.tolist() == [0, 0, 1]


def test_stops_of_a_westward_strip_are_made_from_the_east():
    users = make_users([[0, 0], [2000, 0], [500, 1.2 * R], [1500, 1.2 * R]])
    found = sbw(users, CHANNEL)
    westward = found.stops_m[found.stops_m[:, 1] > R]
    assert westward[0, 0] == 1500


def test_a_user_on_a_border_belongs_to_the_first_of_the_two_strips():
    assert strip_of(np.array([0.0, 400, 400.001, 800]), 400.0, 2).tolist() == [0, 0, 1, 1]


def test_one_user_is_one_strip_and_one_stop():
    found = sbw(make_users([[300, 0]]), CHANNEL)
    np.testing.assert_allclose(found.stops_m, [[300, 0.5 * R]])
    assert found.length_m == pytest.approx(np.hypot(300, 0.5 * R))


def test_sbw_uses_no_d2d():
    users = make_users([[0, 0], [0, 3 * R]], pairs=[(0, 1)])
    assert not sbw(users, CHANNEL).assignment.d2d.any()


def test_the_benchmarks_own_index_is_one_and_a_shorter_equal_plan_scores_higher():
    users = make_users(np.random.default_rng(0).uniform(0, 2000, (16, 2)))
    benchmark = sbw(users, CHANNEL)
    assert joint_index(benchmark, benchmark) == 1.0
    found = tloaik(users, CHANNEL, Setting(4, np.random.default_rng(0)))
    throughput = found.sum_rate_bit_s_hz / benchmark.sum_rate_bit_s_hz
    assert joint_index(found, benchmark) == pytest.approx(throughput / (found.length_m / benchmark.length_m))


def test_a_plan_without_length_has_no_index():
    users = make_users([[0, 0]])
    found = tloaik(users, CHANNEL, Setting(1, np.random.default_rng(0)))
    assert found.length_m == 0.0
    assert joint_index(found, sbw(users, CHANNEL)) is None


@pytest.mark.parametrize("strips", [1, 2, 3, 7])
def test_a_height_of_whole_radii_makes_no_strip_too_many_whatever_the_last_digit(strips):
    found = sbw(make_users([[0, 0.1], [1000, 0.1 + strips * R]]), CHANNEL)
    assert len(np.unique(found.path_m[1:, 1])) == strips
