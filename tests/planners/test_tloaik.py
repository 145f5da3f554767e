"""TLOAIK: the three cases of SPSS by hand, and what must hold for any users."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.planners import PLANNERS, plan_trajectory
from mavplan.planners.selection import nearest_to_reference, supplementary_stops
from mavplan.planners.setting import Setting
from mavplan.progress import PARTS
from mavplan.radio import Channel
from mavplan.scenario import D2D, UNPAIRED, Radio
from tests.support import make_scenario, make_users, user_fields

CHANNEL = Channel(Radio(), 100.0, D2D(link="ideal"))
R = CHANNEL.radius_m


def added_stops(users, initial, reference):
    """The supplementary stops for these users."""
    stops = np.array(initial, dtype=float)
    return supplementary_stops(
        users, stops, np.array(reference, dtype=float), CHANNEL, nearest_to_reference(CHANNEL)
    )


def test_case_1_a_user_whose_mate_is_covered_gets_no_stop():
    users = make_users([[1000, 0], [1000 + R + 50, 0]], pairs=[(0, 1)])
    assert len(added_stops(users, [[1000, 0]], [[0, 0], [1000, 0]])) == 0


def test_case_2_a_user_within_reach_of_the_reference_gets_the_foot_of_its_perpendicular():
    users = make_users([[1000, 300]])
    np.testing.assert_allclose(added_stops(users, [[2000, 0]], [[0, 0], [2000, 0]]), [[1000, 0]])


def test_case_3_beyond_reach_the_stop_is_on_the_circle_round_the_user_symmetric_between_the_neighbours():
    users = make_users([[1000, 900]])
    np.testing.assert_allclose(
        added_stops(users, [[2000, 0]], [[0, 0], [2000, 0]]), [[1000, 900 - R]], atol=1e-9
    )


def test_case_3_past_the_free_end_the_stop_is_on_the_way_to_the_last_point():
    users = make_users([[3000, 0]])
    np.testing.assert_allclose(added_stops(users, [[2000, 0]], [[0, 0], [2000, 0]]), [[3000 - R, 0]])


def test_the_origin_is_no_free_end():
    users = make_users([[-1000, 0]])
    stop = added_stops(users, [[0, 2000]], [[0, 0], [0, 2000]])[0]
    assert np.linalg.norm(stop - [-1000, 0]) == pytest.approx(R)
    # Drawn towards the second neighbour, off the straight line to the origin.
    assert stop[1] > 10.0


def test_of_a_pair_with_nobody_covered_the_member_nearer_to_the_reference_stands():
    users = make_users([[1000, 600], [1000, 350]], pairs=[(0, 1)])
    np.testing.assert_allclose(added_stops(users, [[3000, 0]], [[0, 0], [3000, 0]]), [[1000, 0]])


def test_a_new_stop_that_covers_the_next_user_spares_it_one():
    users = make_users([[1000, 300], [1100, 200]])
    assert len(added_stops(users, [[3000, 0]], [[0, 0], [3000, 0]])) == 1


@settings(max_examples=150, deadline=None)
@given(
    users=user_fields(),
    clusters=st.integers(1, 20),
    seed=st.integers(0, 3),
    name=st.sampled_from(sorted(PLANNERS)),
)
def test_every_user_is_reached_or_has_a_mate_that_is(users, clusters, seed, name):
    found = PLANNERS[name].plan(users, CHANNEL, Setting(clusters, np.random.default_rng(seed)))
    distance_m = np.linalg.norm(users.xy_m[:, None] - found.stops_m, axis=2)
    reached = distance_m.min(axis=1) <= R + 1e-5
    served = found.assignment
    for user in range(len(users)):
        assert served.stop[user] >= 0
        if served.d2d[user]:
            mate = users.mate[user]
            assert not reached[user]
            assert mate != UNPAIRED
            assert reached[mate]
            assert not served.d2d[mate]
            assert served.stop[user] == served.stop[mate]
        else:
            assert reached[user]
            assert distance_m[user, served.stop[user]] == pytest.approx(distance_m[user].min())
    assert np.isfinite(found.length_m)
    assert len(found.assignment.stop) == len(users)


def test_the_same_seed_gives_the_same_plan_and_auto_never_a_longer_one_than_any_of_its_numbers():
    xy = np.random.default_rng(2).uniform(0, 2000, (30, 2))
    auto = plan_trajectory(make_scenario(xy, clusters="auto"))
    again = plan_trajectory(make_scenario(xy, clusters="auto"))
    assert (auto.stops_m == again.stops_m).all()
    for clusters in (1, 2, 3, 5, 8):
        assert auto.length_m <= plan_trajectory(make_scenario(xy, clusters=clusters)).length_m + 1e-9


def test_progress_is_told_for_every_number_of_clusters():
    told = []
    plan_trajectory(
        make_scenario([[0, 0], [900, 0]], clusters="auto"), lambda done, todo: told.append((done, todo))
    )
    assert len(told) == 2
    assert told[-1] == (PARTS, PARTS)
    assert 0 < told[0][0] < PARTS / 10  # one cluster is planned in no time beside two


def test_an_unknown_planner_is_refused_with_the_names_there_are():
    with pytest.raises(InputError, match="tloaik"):
        plan_trajectory(make_scenario([[0, 0]], planner="genetic"))


def test_nothing_is_planned_from_an_altitude_that_reaches_nobody():
    with pytest.raises(InputError, match="nobody on the ground"):
        plan_trajectory(make_scenario([[0, 0]], altitude_m=1000.0))


def test_more_clusters_than_places_draw_as_if_exactly_as_many_were_asked_for():
    xy = np.random.default_rng(6).uniform(0, 3000, (7, 2))
    many, exact = (plan_trajectory(make_scenario(xy, clusters=clusters)) for clusters in (50, 7))
    assert (many.stops_m == exact.stops_m).all()
    assert many.notes
    assert not exact.notes


@pytest.mark.filterwarnings("error")
def test_users_a_hair_apart_are_one_place():
    xy = [[1000, 0], [1000, 1e-7], [1000, 2e-7], [2000, 0]]
    found = plan_trajectory(make_scenario(xy, clusters=4))
    assert found.clusters == 2
    assert len(found.stop_at) == 2


@pytest.mark.parametrize("beyond_m", [1.1e-6, 2e-6, 5e-6, 1e-4])
def test_a_user_just_beyond_reach_of_the_reference_is_placed_without_a_fault(beyond_m):
    users = make_users([[1000, R + beyond_m]])
    stop = added_stops(users, [[2000, 0]], [[0, 0], [2000, 0]])[0]
    assert np.linalg.norm(stop - users.xy_m[0]) <= R + 1e-6


@pytest.mark.parametrize("name", ["stoaik", "boaik"])
def test_a_plan_that_needs_no_way_is_the_best_balanced(name):
    found = plan_trajectory(make_scenario([[30, 0], [-30, 0]], clusters="auto", planner=name))
    assert found.length_m == pytest.approx(0.0, abs=1e-9)


def test_the_benchmark_of_a_radius_of_millimetres_is_refused_in_a_sentence():
    lowest = make_scenario([[0, 0], [9000, 9000]], planner="sbw", altitude_m=412.3110745)
    with pytest.raises(InputError, match="strips"):
        plan_trajectory(lowest)
