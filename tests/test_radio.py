"""The channel: equations (1) to (4) by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.radio import Channel, coverage_radius_m, highest_altitude_m, planning_channel, reference_snr
from mavplan.scenario import D2D, Radio, Vehicle
from tests.support import make_scenario


def test_the_default_radio_covers_400_m_from_100_m():
    assert coverage_radius_m(Radio(), 100.0) == pytest.approx(400.0, abs=0.01)


def test_the_reference_snr_is_power_times_gain_over_noise():
    # 20 dBm = 0.1 W, -70 dB = 1e-7, -100 dBm = 1e-13 W: 1e-8 / 1e-13.
    assert reference_snr(Radio(noise_dbm=-100.0), -100.0) == pytest.approx(1e5, rel=1e-12)


@given(
    exponent=st.floats(1.5, 5),
    threshold_db=st.floats(-20, 30),
    altitude_m=st.floats(1, 500),
    power_dbm=st.floats(-10, 40),
)
def test_at_the_coverage_radius_the_snr_is_the_threshold(exponent, threshold_db, altitude_m, power_dbm):
    radio = Radio(tx_power_dbm=power_dbm, path_loss_exponent=exponent, snr_threshold_db=threshold_db)
    channel = Channel(radio, altitude_m, D2D())
    if channel.radius_m == 0:
        assert altitude_m >= highest_altitude_m(radio)
        return
    snr = 2 ** channel.air_rate(np.array([channel.radius_m]))[0] - 1
    # The radius is a difference of squares: near the highest altitude the last digits of both go.
    assert 10 * np.log10(snr) == pytest.approx(threshold_db, abs=1e-6)


def test_above_the_highest_altitude_nobody_is_reached_and_just_below_somebody_is():
    highest_m = highest_altitude_m(Radio())
    assert coverage_radius_m(Radio(), highest_m + 0.001) == 0.0
    assert coverage_radius_m(Radio(), highest_m - 0.001) > 0.0


def test_the_rate_is_shannons_at_the_slant_distance():
    channel = Channel(Radio(noise_dbm=-100.0), 30.0, D2D())
    # 40 m away and 30 m up is 50 m; 1e5 / 50² = 40.
    assert channel.air_rate(np.array([40.0]))[0] == pytest.approx(np.log2(41.0))


@given(
    distance_m=st.floats(0, 600),
    error_m=st.floats(0, 5),
    bearing_deg=st.floats(0, 360),
    up_deg=st.floats(-90, 90),
    part=st.floats(0, 1),
)
def test_wherever_the_vehicle_drifts_the_user_gets_what_is_planned(
    distance_m, error_m, bearing_deg, up_deg, part
):
    planned, real = Channel(Radio(), 100.0, D2D(), error_m), Channel(Radio(), 100.0, D2D())
    off_m = part * error_m
    level_m, up_m = off_m * np.cos(np.radians(up_deg)), off_m * np.sin(np.radians(up_deg))
    east_m = distance_m - level_m * np.cos(np.radians(bearing_deg))
    north_m = level_m * np.sin(np.radians(bearing_deg))
    slant_m = np.sqrt(east_m**2 + north_m**2 + (100.0 + up_m) ** 2)
    if planned.reaches(np.array([distance_m]))[0]:
        assert slant_m <= highest_altitude_m(Radio()) + 1e-5
    rate = np.log2(1 + real.gamma0 / slant_m**2)
    assert planned.air_rate(np.array([distance_m]))[0] <= rate * (1 + 1e-12)


def test_an_autopilots_drift_is_planned_for_unless_the_scenario_says_how_much():
    def radius_m(**vehicle):
        return planning_channel(replace(make_scenario([[0, 0]]), vehicle=Vehicle(**vehicle))).radius_m

    assert radius_m(position_error_m=0.0) == pytest.approx(400.0, abs=0.01)
    assert radius_m() == pytest.approx(398.97, abs=0.01)  # (412.31 - 1)² - 100²
    assert radius_m(autopilot="px4") == pytest.approx(396.91, abs=0.01)
    assert coverage_radius_m(Radio(), 1.0, 1000.0) == 0.0


def test_phones_on_the_same_spot_hear_each_other_as_at_one_metre():
    channel = Channel(Radio(), 100.0, D2D())
    near, metre = channel.d2d_rate(np.array([0.0, 1.0]))
    assert near == metre
    assert np.isfinite(near)


def test_an_ideal_d2d_link_never_limits():
    channel = Channel(Radio(), 100.0, D2D(link="ideal"))
    assert np.isinf(channel.d2d_rate(np.array([5.0, 5000.0]))).all()


@given(fade_db=st.floats(0, 6), user_m=st.floats(0, 50), distance_m=st.floats(0, 400))
def test_margins_shrink_reach_and_rates_and_a_proof_knows_nothing_of_them(fade_db, user_m, distance_m):
    """6 dB of fading halves the distance that free space reaches."""
    scenario = make_scenario([[0, 0]])
    kept = replace(
        scenario,
        radio=replace(scenario.radio, fade_margin_db=fade_db),
        service=replace(scenario.service, user_error_m=user_m),
    )
    exact, planned = planning_channel(scenario), planning_channel(kept)
    slant_m = highest_altitude_m(Radio()) * 10 ** (-fade_db / 20) - user_m
    assert planned.radius_m == pytest.approx(np.sqrt(max(slant_m, 100.0) ** 2 - 100.0**2), abs=1e-6)
    away = np.array([distance_m])
    assert planned.air_rate(away)[0] <= exact.air_rate(away)[0]
    faded = Channel(replace(Radio(), tx_power_dbm=20.0 - fade_db), 100.0, D2D())
    assert planned.air_rate(away)[0] <= faded.air_rate(away + user_m)[0] + 1e-12
    assert planned.d2d_rate(away)[0] <= exact.d2d_rate(away)[0]
    assert kept.radio.tx_power_dbm == 20.0
