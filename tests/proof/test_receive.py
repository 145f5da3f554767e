"""What is integrated along a path is what a slow sum gives; it adds up, and never falls as the path goes on."""

import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.geo import LocalPlane
from mavplan.hover import Slot
from mavplan.proof.path import GAP_S, cut, flown_path
from mavplan.proof.receive import received_by_broadcast, received_by_turns
from mavplan.proof.relay import forwarded_bit, relayed_by_broadcast, relayed_by_turns
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio
from mavplan.track.model import Span, Track
from tests.support import HOME

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)
RADIO = Radio()
CHANNEL = Channel(RADIO, 100.0, D2D())
"""Reaches 400 m over the ground from 100 m above it."""


def make_path(points, altitude_m=100.0):
    """The path through (time, east, north, height)."""
    time_s, east_m, north_m, height_m = np.array(points, dtype=float).T
    lat_deg, lon_deg = PLANE.to_lat_lon_deg(np.column_stack((east_m, north_m)))
    track = Track("x", time_s, lat_deg, lon_deg, height_m, None, (Span(time_s[0], time_s[-1]),))
    return flown_path(track, Span(time_s[0], time_s[-1]), PLANE, altitude_m)


def rate(place, user):
    """Bit/s by the equations of the paper's section 2, said again."""
    ground = math.hypot(place[0] - user[0], place[1] - user[1])
    slant = math.hypot(ground, place[2])
    snr = 10 ** ((20 - 70 + 105.3045) / 10) / slant**2
    return 1e6 * math.log2(1 + snr) if ground <= 400.0005 and snr >= 10 ** (3.0 / 10) * (1 - 1e-9) else 0.0


def by_force(points, user, step_s=0.002):
    """The same integral in small steps, with the rules about gaps and heights said again."""
    total = 0.0
    for (t0, *a), (t1, *b) in itertools.pairwise(points):
        if t1 - t0 > 2.0 or min(a[2], b[2]) < 90 or math.dist(a[:2], b[:2]) > 60 * (t1 - t0):
            continue
        steps = max(round((t1 - t0) / step_s), 1)
        for step in range(steps):
            share = (step + 0.5) / steps
            place = [one + share * (two - one) for one, two in zip(a, b, strict=True)]
            total += rate(place, user) * (t1 - t0) / steps
    return total


FLIGHT = [
    (0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 95.0), (2.0, 0.0, 0.0, 100.0), (3.9, 19.0, 0.0, 101.0),
    (5.5, 30.0, 10.0, 100.0), (8.0, 60.0, 10.0, 99.0), (9.5, 400.0, 10.0, 99.0), (10.0, 402.0, 10.0, 99.0),
    (12.0, 420.0, 10.0, 99.0), (12.5, 420.0, 10.0, 85.0), (13.0, 420.0, 10.0, 100.0), (14.0, 420.0, 10.0, 100.0),
]  # fmt: skip
"""With a climb, a gap of 2.5 s, a jump of 340 m in 1.5 s and a dip."""

USERS = np.array([(0.0, 0.0), (400.0, 0.0), (-385.0, 0.0), (700.0, 0.0), (2000.0, 0.0)])


def test_broadcast_gives_what_a_slow_sum_gives():
    received = received_by_broadcast(make_path(FLIGHT), [], USERS, CHANNEL)
    for user, bits in zip(USERS, received.flight_bit, strict=True):
        expected = by_force(FLIGHT, user)
        # At the edge of R a piece of a metre is counted half, where the sum knows how much of it is inside.
        assert bits == pytest.approx(expected, rel=2e-3, abs=0.05 * 1.6e6)
    assert received.flight_bit[0] > 0
    assert received.flight_bit[4] == 0


metres = st.floats(-500, 500, allow_nan=False)


@st.composite
def flights(draw):
    """A few positions: near and far in time and place, high and low."""
    count = draw(st.integers(2, 7))
    points, now, east, north = [], 0.0, draw(metres), draw(metres)
    for _ in range(count):
        points.append((now, east, north, draw(st.sampled_from([100.0, 99.0, 103.0, 80.0]))))
        lasts = draw(st.sampled_from([0.2, 1.0, 1.9, 2.0, 2.1, 5.0]))
        now = round(now + lasts, 3)
        far = draw(st.sampled_from([0.0, 0.5, 10.0, 500.0]))
        east += lasts * far * draw(st.sampled_from([-1.0, 1.0]))
        north += lasts * far * draw(st.sampled_from([-0.5, 0.5]))
    return points


@settings(max_examples=25, deadline=None)
@given(flights(), st.tuples(metres, metres))
def test_any_small_flight_gives_what_a_slow_sum_gives(points, user):
    received = received_by_broadcast(make_path(points), [], np.array([user]), CHANNEL)
    expected = by_force(points, user, 0.005)
    pieces_s = [
        (t1 - t0) / math.ceil(math.dist(a[:2], b[:2]))
        for (t0, *a), (t1, *b) in itertools.pairwise(points)
        if a[:2] != b[:2]
    ]
    edges_bit = 1.6e6 * max(pieces_s, default=0.0)
    assert received.flight_bit[0] == pytest.approx(expected, rel=2e-3, abs=edges_bit)


@settings(max_examples=60, deadline=None)
@given(flights(), st.floats(0, 40))
def test_two_parts_of_a_path_give_what_the_whole_gives(points, at_s):
    whole = cut(make_path(points), [at_s])
    total = received_by_broadcast(whole, [], USERS, CHANNEL).total_bit
    parts = np.zeros(len(USERS))
    for span in (Span(-1.0, at_s), Span(at_s, 1e9)):
        inside = received_by_broadcast(
            cut(whole, span),
            [Span(max(span.from_s, 0.0), min(span.until_s, whole.time_s[-1]))],
            USERS,
            CHANNEL,
        )
        parts += inside.hold_bit[0]
    np.testing.assert_allclose(parts, total, rtol=1e-9, atol=1e-3)


@settings(max_examples=60, deadline=None)
@given(flights())
def test_received_never_falls_as_a_track_goes_on(points):
    before = np.zeros(len(USERS))
    for count in range(2, len(points) + 1):
        now = received_by_broadcast(make_path(points[:count]), [], USERS, CHANNEL).total_bit
        assert np.all(now >= before - 1e-6)
        before = now


def test_a_gap_of_two_seconds_counts_and_a_longer_one_does_not():
    for gap_s, counted_s in ((GAP_S, GAP_S), (GAP_S + 0.01, 0.0)):
        path = make_path([(0.0, 0.0, 0.0, 100.0), (gap_s, 0.0, 0.0, 100.0)])
        received = received_by_broadcast(path, [], USERS[:1], CHANNEL).total_bit
        assert received[0] == pytest.approx(counted_s * rate((0, 0, 100), (0, 0)))


def test_the_height_really_flown_makes_the_distance():
    low, high = (
        received_by_broadcast(
            make_path([(0.0, 0.0, 0.0, height), (1.0, 0.0, 0.0, height)]), [], USERS[:1], CHANNEL
        ).total_bit[0]
        for height in (95.0, 140.0)
    )
    assert low == pytest.approx(rate((0, 0, 95), (0, 0)))
    assert high == pytest.approx(rate((0, 0, 140), (0, 0)))


def test_too_high_is_beyond_the_threshold_within_r_over_the_ground():
    path = make_path([(0.0, 0.0, 0.0, 110.0), (1.0, 0.0, 0.0, 110.0)])
    assert received_by_broadcast(path, [], np.array([(399.0, 0.0)]), CHANNEL).total_bit[0] == 0
    assert received_by_broadcast(path, [], np.array([(397.0, 0.0)]), CHANNEL).total_bit[0] > 0


def test_each_turn_counts_from_the_beginning_of_the_hold_and_is_cut_with_it():
    path = make_path([(float(t), 0.0, 0.0, 100.0) for t in range(20)])
    schedule = [Slot(0, 0, 0.0, 2.5), Slot(0, 1, 2.5, 3.0), Slot(0, 2, 5.5, 1.0), Slot(1, 0, 0.0, 4.0)]
    holds = [Span(4.0, 8.25), None]
    received = received_by_turns(path, holds, schedule, USERS[:3], CHANNEL)
    for user, seconds in enumerate([2.5, 1.75, 0.0]):
        assert received.hold_bit[0, user] == pytest.approx(seconds * rate((0, 0, 100), USERS[user]))
    assert not received.hold_bit[1].any()
    assert not received.flight_bit.any()


def queue_by_force(arrivals, own, link, end_s, step_s=0.001):
    """What a queue lets pass: filled beyond the own demand, emptied at the link's rate, in small steps."""
    heard = waiting = sent = 0.0
    for step in range(round(end_s / step_s)):
        now = step * step_s
        bits = sum(rate_bit_s * step_s for begin, end, rate_bit_s in arrivals if begin <= now < end)
        waiting += max(heard + bits - own, 0.0) - max(heard - own, 0.0)
        heard += bits
        passed = min(waiting, link * step_s)
        waiting -= passed
        sent += passed
    return sent


@pytest.mark.parametrize("link", [0.4, 1.5, 6.0])
@pytest.mark.parametrize("own", [0.0, 3.3, 8.0, 100.0])
def test_a_mate_sends_on_what_a_queue_lets_pass(own, link):
    arrivals = [(1.0, 4.0, 2.0), (6.0, 7.0, 5.0)]
    moments = np.array([0.0, 1.0, 4.0, 6.0, 7.0, 9.0])
    received = np.array([0.0, 0.0, 6.0, 6.0, 11.0, 11.0])
    expected = queue_by_force(arrivals, own, link, 10.0)
    assert forwarded_bit(moments, received, own, link, 10.0) == pytest.approx(expected, abs=0.02)


def test_an_ideal_link_sends_on_all_that_is_beyond_the_own_demand():
    assert forwarded_bit(np.array([0.0, 1.0]), np.array([0.0, 9.0]), 4.0, math.inf, 1.0) == 5.0


def test_what_mates_send_on_is_the_same_queue_along_a_path():
    points = [(float(t), 10.0 * t, 0.0, 100.0) for t in range(30)]
    path, users = make_path(points), np.array([(150.0, 0.0), (3000.0, 0.0)])
    heard = received_by_broadcast(path, [], users, CHANNEL).total_bit
    own, rates = np.array([heard[0] / 2, 1.0]), np.array([0.8e6, 0.8e6])
    sent = relayed_by_broadcast(path, users, [0, 1], own, rates, CHANNEL)
    half_s = next(
        t for t in np.arange(0, 29, 0.01) if by_force([*points[: int(t) + 1]], users[0], 0.05) >= own[0]
    )
    assert sent[0] <= rates[0] * (29 - half_s + 1)
    assert sent[0] == pytest.approx(min(heard[0] / 2, rates[0] * (29 - 14.5)), rel=0.08)
    assert sent[1] == 0


def test_by_turns_a_mate_sends_on_after_its_turn():
    path = make_path([(float(t), 0.0, 0.0, 100.0) for t in range(20)])
    full = rate((0, 0, 100), (0, 0))
    schedule, holds = [Slot(0, 0, 1.0, 4.0)], [Span(2.0, 10.0)]
    sent = relayed_by_turns(
        path, holds, schedule, USERS, [0], np.array([full]), np.array([full / 10]), CHANNEL
    )
    # It has its own after a second of its turn, at 4 s; from there until the end, at 19 s, the link is the limit.
    assert sent[0] == pytest.approx(full / 10 * 15, rel=1e-6)


def test_ten_minutes_at_ten_hertz_with_two_thousand_users_take_a_second():
    rng = np.random.default_rng(1)
    time_s = np.arange(0, 600, 0.1)
    angle = time_s / 60
    points = np.column_stack(
        (time_s, 1500 * np.cos(angle), 1500 * np.sin(angle), np.full(len(time_s), 100.0))
    )
    users = rng.uniform(-2000, 2000, (2000, 2))
    path = make_path(points)
    began = time.perf_counter()
    received = received_by_broadcast(path, [Span(0.0, 300.0)], users, CHANNEL)
    assert time.perf_counter() - began < 10
    assert (received.total_bit > 0).sum() > 500
