"""The planner of the shortest path: its stops, its ends, its figures beside other planners' and its bound."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.bounds import Bound
from mavplan.geo import LocalPlane
from mavplan.mission.geofence import Fence, FenceCircle
from mavplan.plan import make_plan
from mavplan.planners import PLANNERS, plan_trajectory
from mavplan.planners.length import length
from mavplan.planners.limits import Limits
from mavplan.planners.ordering import path_length_m
from mavplan.planners.path_stops import stops_on_path
from mavplan.planners.setting import Setting
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio
from tests.support import make_scenario, make_users, user_fields

CHANNEL = Channel(Radio(), 100.0, D2D(link="ideal"))
R = CHANNEL.radius_m


def setting(returns=False, **limits):
    return Setting(0, np.random.default_rng(0), returns=returns, limits=Limits(**limits))


def tour_m(found):
    return path_length_m(np.vstack([found.path_m, [[0.0, 0.0]]]))


def test_two_users_in_line_are_reached_by_one_straight_way():
    found = length(make_users([[1000, 0], [2000, 0]]), CHANNEL, setting())
    assert found.length_m == pytest.approx(2000 - R, abs=0.01)
    assert found.path_m[:, 1] == pytest.approx(np.zeros(len(found.path_m)), abs=1e-3)
    assert found.bound.proved


def test_one_stop_reaches_whom_one_stop_can_reach():
    found = length(make_users([[1500, 100], [1500, -100], [1700, 0]]), CHANNEL, setting())
    assert len(found.stop_at) == 1


def test_a_tour_counts_its_way_home_and_a_path_does_not():
    users = make_users([[1500, 0], [0, 1500], [1400, 1400]])
    path, tour = length(users, CHANNEL, setting()), length(users, CHANNEL, setting(returns=True))
    assert (path.bound.objective, tour.bound.objective) == ("path_m", "tour_m")
    assert path.bound.plan == pytest.approx(path.length_m)
    assert tour.bound.plan == pytest.approx(tour_m(tour))
    assert path.length_m < tour.length_m
    assert tour_m(tour) < tour_m(path)


@pytest.mark.parametrize("end", ["rtl", "land", "stay"])
def test_the_end_of_the_mission_decides_which(end):
    found = plan_trajectory(make_scenario([[1500, 0], [0, 1500]], planner="length", end=end))
    assert found.bound.objective == ("tour_m" if end == "rtl" else "path_m")


def test_one_of_a_pair_is_enough():
    xy = [[600, 0], [600, 1400], [900, 100]]
    paired = length(make_users(xy, pairs=[(0, 1)]), CHANNEL, setting())
    single = length(make_users(xy), CHANNEL, setting())
    assert paired.length_m < single.length_m - 500
    assert paired.assignment.d2d.tolist() == [False, True, False]
    assert paired.assignment.served.all()


def test_whoever_is_reached_from_home_makes_a_stop_there_and_no_way():
    found = length(make_users([[R / 2, 0], [-R, 0]]), CHANNEL, setting())
    assert found.length_m == pytest.approx(0.0, abs=1e-5)
    assert len(found.stop_at) >= 1
    assert found.assignment.served.all()
    assert found.bound.gap == pytest.approx(0.0, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(user_fields(most=10), st.booleans())
def test_no_planner_of_the_paper_is_below_the_bound(users, returns):
    found = length(users, CHANNEL, setting(returns))
    assert found.bound.bound <= found.bound.plan
    assert found.bound.gap <= 2e-6 or found.bound.plan < 1.0
    for name in ("tloaik", "stoaik", "boaik", "sbw"):
        if name == "stoaik" or returns:
            continue
        for clusters in (1, 3):
            other = PLANNERS[name].plan(users, CHANNEL, Setting(clusters, np.random.default_rng(0)))
            assert other.length_m >= found.bound.bound * (1 - 1e-9)


def test_a_demand_moves_a_stop_along_the_path_to_where_it_is_served_fastest():
    xy = [[1000, 300], [3000, 0]]
    path = np.array([[0.0, 0.0], [3000.0 - R, 0.0]])
    stops = stops_on_path(make_users(xy), CHANNEL, path)
    assert stops[0] == pytest.approx([1000.0, 0.0], abs=50.0)
    assert stops[1] == pytest.approx([3000.0 - R, 0.0], abs=1e-6)


def test_the_path_through_the_stops_is_no_longer_than_the_one_they_stand_on():
    rng = np.random.default_rng(3)
    for seed in range(5):
        users = make_users(rng.uniform(0, 2500, (25, 2)))
        found = length(users, CHANNEL, setting(returns=bool(seed % 2)))
        assert found.bound.gap <= 2e-6
        assert found.assignment.served.all()


def test_what_a_time_limit_cuts_off_is_said():
    users = make_users(np.random.default_rng(4).uniform(0, 6000, (60, 2)))
    found = length(users, CHANNEL, setting(seconds=0.0))
    assert [note.code for note in found.notes] == ["not-proved"]
    assert found.bound.gap > 0.01
    assert found.assignment.served.all()


def test_the_same_node_limit_gives_the_same_plan():
    users = make_users(np.random.default_rng(5).uniform(0, 5000, (50, 2)))
    one, other = (length(users, CHANNEL, setting(nodes=100)) for _ in range(2))
    assert (one.path_m == other.path_m).all()
    assert one.bound.bound == other.bound.bound


def test_a_gap_is_relative_to_the_plan():
    assert Bound("path_m", 200.0, 150.0).gap == 0.25
    assert Bound("path_m", 0.0, 0.0).gap == 0.0
    assert not Bound("path_m", 200.0, 199.9).proved
    assert dataclasses.replace(Bound("path_m", 200.0, 199.9), plan=199.9).proved


def test_round_a_no_fly_zone_the_plan_is_longer_and_its_bound_the_same():
    scenario = make_scenario([[1500, 0], [1500, 300]], planner="length")
    plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    lat_e7, lon_e7 = plane.to_e7(np.array([[600.0, 0.0]]))
    zone = Fence((), (FenceCircle(False, int(lat_e7[0]), int(lon_e7[0]), 200.0),))
    free, led = (make_plan(one).trajectory for one in (scenario, dataclasses.replace(scenario, no_fly=zone)))
    assert led.bound.bound == pytest.approx(free.bound.bound, rel=1e-9)
    assert led.bound.plan > free.bound.plan + 50.0
    assert led.bound.plan > tour_m(led)
    assert not led.bound.proved
