"""Margins shrink what every planner counts on: at the worst place, with the faded radio, everybody is served."""

import dataclasses
import math

import numpy as np
import pytest

from mavplan.plan import make_plan
from mavplan.planners import PLANNERS
from mavplan.scenario import Service
from tests.support import make_scenario

XY_M = [(900, 0), (1150, 200), (-700, 500), (300, -800), (350, -600)]
DRIFT_M, USERS_OFF_M, FADE_DB = 2.0, 8.0, 4.0


def with_margins(planner, mode, in_flight, **margins):
    scenario = make_scenario(XY_M, planner=planner, clusters=2, demand_mbit=30.0, position_error_m=DRIFT_M)
    radio = dataclasses.replace(scenario.radio, fade_margin_db=margins.get("fade_db", FADE_DB))
    service = Service(mode=mode, in_flight=in_flight, user_error_m=margins.get("users_off_m", USERS_OFF_M))
    options = dataclasses.replace(scenario.planner, time_limit_s=0.5)
    return dataclasses.replace(scenario, radio=radio, service=service, planner=options)


def worst_rate_bit_s(scenario, user_m, stop_m):
    """By equations (1) to (4), 10 m of drift and error further away, 4 dB fainter; 0 below the threshold."""
    radio = scenario.radio
    slant_m = math.hypot(scenario.vehicle.altitude_m, math.dist(user_m, stop_m)) + DRIFT_M + USERS_OFF_M
    snr_db = radio.tx_power_dbm - FADE_DB + radio.ref_gain_db - 20 * math.log10(slant_m) - radio.noise_dbm
    reached = snr_db >= radio.snr_threshold_db - 1e-6
    return radio.bandwidth_hz * math.log2(1 + 10 ** (snr_db / 10)) if reached else 0.0


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("planner", PLANNERS)
def test_everybody_is_served_with_all_margins_used_up(planner, mode):
    scenario = with_margins(planner, mode, in_flight=False)
    plan = make_plan(scenario)
    rates = np.array(
        [[worst_rate_bit_s(scenario, user, stop) for stop in plan.trajectory.stops_m] for user in XY_M]
    )
    if mode == "broadcast":
        received_bit = rates @ plan.holds.stored_s.astype(np.float32)
    else:
        received_bit = np.zeros(len(XY_M))
        for slot in plan.holds.schedule:
            received_bit[slot.user] += rates[slot.user, slot.stop] * slot.duration_s
        assert (plan.holds.stored_s >= plan.holds.asked_s - 1e-6).all()
    assert (received_bit >= scenario.users.demand_bit - 10.0).all()


@pytest.mark.parametrize("planner", PLANNERS)
def test_each_margin_makes_the_radius_less_and_no_mission_shorter_than_is_proved_without(planner):
    bare = make_plan(with_margins(planner, "broadcast", None, fade_db=0.0, users_off_m=0.0))
    for margins in ({"fade_db": 4.0, "users_off_m": 0.0}, {"fade_db": 0.0, "users_off_m": 8.0}):
        kept = make_plan(with_margins(planner, "broadcast", None, **margins))
        assert kept.trajectory.radius_m < bare.trajectory.radius_m
        assert kept.trajectory.assignment.served.all()
        if bare.trajectory.bound is not None:
            assert kept.trajectory.bound.plan >= bare.trajectory.bound.bound - 1e-6
