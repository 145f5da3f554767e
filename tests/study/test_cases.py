"""One case: the same bits whenever it is run, and the same users while only K, H or γ_th change."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.hppp import draw_pairs
from mavplan.planners import plan_trajectory
from mavplan.planners.index import joint_index
from mavplan.radio import Channel, coverage_radius_m
from mavplan.scenario import Home, PlannerOptions, Radio, Scenario, Vehicle
from mavplan.study import regime
from mavplan.study.cases import Case, draw_case, run_case
from mavplan.study.regime import IDEAL_LINK, PLANNERS, radio_of

CASE = Case(16.0, 100.0, 3.0, 4, seed=7)


def test_a_case_gives_the_same_bits_alone_again_and_after_others():
    alone = run_case(CASE, PLANNERS)
    run_case(dataclasses.replace(CASE, seed=8), PLANNERS)
    np.random.random(3)  # nobody's draws may depend on the global generator
    assert run_case(CASE, PLANNERS) == alone
    assert tuple(run_case(CASE, [name])[0] for name in PLANNERS) == alone


@pytest.mark.parametrize(
    "change", [{"clusters": 6}, {"altitude_m": 60.0}, {"snr_threshold_db": 15.0}, {"held": "power"}]
)
def test_only_lambda_generator_and_seed_decide_the_users(change):
    users, same = draw_case(CASE), draw_case(dataclasses.replace(CASE, **change))
    np.testing.assert_array_equal(users.xy_m, same.xy_m)
    np.testing.assert_array_equal(users.mate, same.mate)


@pytest.mark.parametrize("change", [{"mean_users": 40.0}, {"seed": 8}, {"generator": "users"}])
def test_lambda_generator_and_seed_each_change_the_users(change):
    users, other = draw_case(CASE), draw_case(dataclasses.replace(CASE, **change))
    assert not np.array_equal(users.xy_m, other.xy_m)


def test_the_users_are_those_of_the_public_generator_in_one_line():
    np.testing.assert_array_equal(draw_case(CASE).xy_m, draw_pairs(16.0, seed=7)[0])


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_row_is_what_planning_a_scenario_of_these_users_gives(planner):
    def plan(name):
        return plan_trajectory(
            Scenario(
                home=Home(46.5, 7.5, 600.0),
                users=draw_case(CASE),
                radio=Radio(),
                d2d=IDEAL_LINK,
                vehicle=Vehicle(position_error_m=0.0),
                planner=PlannerOptions(name=name, clusters=CASE.clusters, seed=CASE.seed),
            )
        )

    found, benchmark = plan(planner), plan("sbw")
    (row,) = run_case(CASE, [planner])
    assert row.length_m == found.length_m
    assert row.sum_rate_bit_s_hz == found.sum_rate_bit_s_hz
    assert row.stops == len(found.stops_m)
    assert row.rho_e == joint_index(found, benchmark)
    assert (row.benchmark_length_m, row.benchmark_sum_rate_bit_s_hz) == (
        benchmark.length_m,
        benchmark.sum_rate_bit_s_hz,
    )


def test_the_regime_is_four_hundred_metres_at_three_decibels_from_a_hundred_metres():
    assert pytest.approx(400.0, abs=0.01) == regime.RADIUS_M
    assert (regime.ALTITUDE_M, regime.SNR_THRESHOLD_DB, regime.CLUSTERS) == (100.0, 3.0, 4)
    assert radio_of(regime.ALTITUDE_M, regime.SNR_THRESHOLD_DB, "radius") == Radio()
    assert radio_of(regime.ALTITUDE_M, regime.SNR_THRESHOLD_DB, "power") == Radio()


@given(st.floats(1.0, 500.0), st.floats(-10.0, 30.0))
def test_with_the_radius_held_the_snr_at_the_edge_is_the_threshold(altitude_m, threshold_db):
    radio = radio_of(altitude_m, threshold_db, "radius")
    assert coverage_radius_m(radio, altitude_m) == pytest.approx(regime.RADIUS_M, abs=1e-6)
    rate = Channel(radio, altitude_m, IDEAL_LINK).air_rate(np.array([regime.RADIUS_M]))
    assert 2.0 ** rate[0] - 1.0 == pytest.approx(10.0 ** (threshold_db / 10.0), rel=1e-9)


def test_with_the_power_held_a_higher_threshold_is_a_smaller_radius():
    radii = [coverage_radius_m(radio_of(100.0, db, "power"), 100.0) for db in (0.0, 3.0, 10.0, 20.0)]
    assert radii == sorted(radii, reverse=True)
    assert radii[-1] == 0.0


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.1, 30.0),
    st.integers(1, 40),
    st.integers(0, 2**63 - 1),
    st.sampled_from(["pairs", "users"]),
    st.floats(10.0, 300.0),
)
def test_whatever_is_drawn_every_planner_gives_a_row_and_the_benchmark_is_one(
    mean_users, clusters, seed, generator, altitude_m
):
    case = Case(mean_users, altitude_m, 3.0, clusters, seed, generator)
    rows = run_case(case, PLANNERS)
    assert [row.planner for row in rows] == list(PLANNERS)
    places = len(np.unique(draw_case(case).xy_m, axis=0))
    for row in rows:
        assert row.clusters_used == (0 if row.planner == "sbw" else min(clusters, places))
        assert row.users == len(draw_case(case))
        assert row.stops >= 1
    assert rows[-1].rho_e in (1.0, None)
