"""Successive convex approximation: the lemma, the closed form against CVXPY, and that the sum rate never falls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.planners.sca import (
    closed_form_step,
    cvxpy_step,
    improve_stop,
    improve_stops,
    sum_rate,
    tangent_slopes,
)
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio

EXPONENTS = (2.0, 2.7, 4.0)


def channel_of(exponent, threshold_db=3.0):
    """A channel whose coverage radius is 400 m at 100 m, whatever its exponent."""
    noise_dbm = 20 - 70 - threshold_db - 10 * np.log10(170_000.0) * exponent / 2
    return Channel(
        Radio(path_loss_exponent=exponent, noise_dbm=noise_dbm, snr_threshold_db=threshold_db), 100.0, D2D()
    )


def instance(rng, channel):
    """A stop and users within R of it: scattered, in one corner, coincident, or on the rim."""
    count = int(rng.integers(1, 21))
    stop = rng.uniform(-2000, 2000, 2)
    away = channel.radius_m * np.sqrt(rng.random(count)) * rng.choice([0.3, 1.0])
    angle = rng.uniform(0, 2 * np.pi, count) * rng.choice([0.1, 1.0])
    users = stop + np.column_stack([away * np.cos(angle), away * np.sin(angle)])
    kind = rng.integers(4)
    if kind == 0:
        users[: count // 2] = users[0]
    elif kind == 1:
        # A crowd on one side and somebody on the far rim: the weighted centroid is out of his reach.
        far = stop - [channel.radius_m * (1 - 1e-9), 0]
        users = np.vstack([far, np.abs(users - stop) + stop])
    return stop, users


@pytest.mark.parametrize("part", range(8))
def test_the_closed_form_is_what_cvxpy_finds(part):
    """A thousand instances in eight parts, to 1e-6 m; a share of them with the centroid out of reach."""
    rng = np.random.default_rng(part)
    projected = 0
    for _ in range(125):
        channel = channel_of(rng.choice(EXPONENTS), rng.choice([0.0, 3.0, 20.0]))
        stop, users = instance(rng, channel)
        fast = closed_form_step(stop, users, channel)
        np.testing.assert_allclose(fast, cvxpy_step(stop, users, channel), rtol=0, atol=1e-6)
        slopes = tangent_slopes(stop, users, channel)
        centroid = slopes @ users / slopes.sum()
        projected += bool((np.linalg.norm(users - centroid, axis=1) > channel.radius_m).any())
    assert projected >= 5


@given(
    exponent=st.sampled_from(EXPONENTS),
    here=st.floats(0, 400),
    there=st.floats(0, 800),
)
def test_the_tangent_lies_below_the_rate_and_touches_it(exponent, here, there):
    channel = channel_of(exponent)
    stop, user = np.array([here, 0.0]), np.zeros((1, 2))
    slope = tangent_slopes(stop, user, channel)[0]
    rate_here, rate_there = channel.air_rate(np.array([here, there]))
    assert rate_here - slope * (there**2 - here**2) <= rate_there + 1e-9
    step = 1e-3
    near = channel.air_rate(np.sqrt(np.array([here**2 + step]) + 1.0))[0]
    base = channel.air_rate(np.sqrt(np.array([here**2]) + 1.0))[0]
    at_one_metre_more = tangent_slopes(np.array([np.sqrt(here**2 + 1.0), 0.0]), user, channel)[0]
    assert (base - near) / step == pytest.approx(at_one_metre_more, rel=1e-3, abs=1e-12)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), exponent=st.sampled_from(EXPONENTS))
def test_no_iteration_lowers_the_sum_rate_or_loses_a_user(seed, exponent):
    channel = channel_of(exponent)
    stop, users = instance(np.random.default_rng(seed), channel)
    rates = [sum_rate(stop, users, channel)]

    def watched(stop_m, users_m, channel_):
        moved = closed_form_step(stop_m, users_m, channel_)
        assert (np.linalg.norm(users_m - moved, axis=1) <= channel_.radius_m + 1e-6).all()
        rates.append(sum_rate(moved, users_m, channel_))
        return moved

    end = improve_stop(stop, users, channel, watched)
    assert (np.diff(rates) >= -1e-9).all()
    assert sum_rate(end, users, channel) >= rates[0]


def test_a_single_user_is_served_from_straight_above():
    channel = channel_of(2.0)
    end = improve_stop(np.array([300.0, 0]), np.zeros((1, 2)), channel, closed_form_step)
    # The last gain was below a billionth of a bit, hence within centimetres.
    assert np.linalg.norm(end) < 0.05


def test_both_solvers_end_at_the_same_stop():
    channel = channel_of(2.0)
    stop, users = instance(np.random.default_rng(11), channel)
    fast, slow = (improve_stop(stop, users, channel, step) for step in (closed_form_step, cvxpy_step))
    assert sum_rate(fast, users, channel) == pytest.approx(sum_rate(slow, users, channel), abs=1e-6)


def test_a_stop_with_nobody_near_stays_and_users_belong_to_their_nearest_stop():
    channel = channel_of(2.0)
    stops = np.array([[0.0, 0], [5000, 0]])
    improved = improve_stops(stops, np.array([[50.0, 0], [60, 0]]), channel, closed_form_step)
    assert (improved[1] == stops[1]).all()
    assert 50 < improved[0, 0] < 60
