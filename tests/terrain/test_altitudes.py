"""Legs bent over random ground, against brute sampling; altitudes that ArduPilot keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.terrain.altitudes import OVER_M, bent_leg, kept_altitudes_m, least_clearance_m, over_ground
from tests.terrain.hills import bilinear, flat, ridge, rough, terrain_of

metres = st.floats(-580, 580)
places = st.tuples(metres, metres)


@settings(max_examples=60, deadline=None)
@given(rough(), st.lists(places, min_size=1, max_size=12))
def test_heights_are_bilinear_between_the_middles_of_cells(terrain, points):
    assert terrain.height_m(np.array(points)) == pytest.approx(bilinear(terrain, points), abs=1e-3)


@settings(max_examples=60, deadline=None)
@given(rough(), places, places)
def test_the_ground_under_a_leg_is_nowhere_above_its_bound_and_touches_it(terrain, start, end):
    start, end = np.array(start), np.array(end)
    ground = terrain.under(start, end)
    at = np.linspace(0, 1, 1500)
    real_m = bilinear(terrain, start + at[:, None] * (end - start))
    bound_m = np.interp(at, ground.at, ground.top_m)
    # A line above all points is above the ground: try the lowest one of many slopes.
    for slope in (-300.0, -40.0, 0.0, 55.0, 400.0):
        line_m = (ground.top_m - slope * ground.at).max() + slope * at
        assert (line_m >= real_m - 1e-3).all()
    assert ground.top_m[::2] == pytest.approx(
        bilinear(terrain, start + ground.at[::2, None] * (end - start)), abs=1e-3
    )
    assert np.isfinite(bound_m).all()


@settings(max_examples=80, deadline=None)
@given(
    rough(),
    st.lists(places, min_size=2, max_size=5),
    st.floats(20, 150),
    st.floats(0, 1),
)
def test_every_leg_keeps_its_clearance_by_brute_sampling(terrain, points, height_m, part):
    clearance_m = part * height_m
    path = np.array(points)
    alt_m = terrain.height_m(path) + height_m
    climbing = over_ground(terrain, path, alt_m, clearance_m)
    assert (climbing.path_m[climbing.given] == path).all()
    assert (climbing.alt_m[climbing.given] == alt_m).all()
    at = np.linspace(0, 1, 400)
    for leg in range(len(climbing.path_m) - 1):
        start, end = climbing.path_m[leg : leg + 2]
        low, high = climbing.alt_m[leg : leg + 2]
        above_m = low + at * (high - low) - bilinear(terrain, start + at[:, None] * (end - start))
        assert above_m.min() >= clearance_m - 1e-2
        bound_m, _ = least_clearance_m(terrain.under(start, end), low, high)
        assert bound_m <= above_m.min() + 1e-2


def test_a_leg_that_is_clear_is_not_bent_and_one_over_a_ridge_at_its_crest():
    terrain = ridge(top_m=800.0, at_m=500.0, width_m=150.0)
    ground = terrain.under(np.array([0.0, 0.0]), np.array([1000.0, 0.0]))
    assert len(bent_leg(ground, 900.0, 900.0, 30.0).at) == 0
    bends = bent_leg(ground, 700.0, 700.0, 30.0)
    crest = int(bends.alt_m.argmax())
    assert bends.at[crest] * 1000 == pytest.approx(500.0, abs=31)
    assert 830.0 <= bends.alt_m[crest] <= 830.0 + OVER_M + 1.5
    assert len(bends.at) <= 9


def test_flat_ground_bends_nothing():
    path = np.array([[0.0, 0.0], [900.0, 100.0], [-400.0, 50.0]])
    climbing = over_ground(flat(), path, np.full(3, 700.0), 100.0)
    assert (climbing.path_m == path).all()


def test_ground_that_is_not_known_is_not_a_number():
    heights = np.full((41, 41), 600.0)
    heights[20, 25] = np.nan
    terrain = terrain_of(heights)
    assert np.isnan(terrain.height_m(np.array([[140.0, 5.0], [5000.0, 0.0]]))).all()
    assert terrain.height_m(np.array([[0.0, 0.0]])) == [600.0]
    assert np.isnan(least_clearance_m(terrain.under(np.zeros(2), np.array([300.0, 0.0])), 700.0, 700.0)[0])


@given(st.lists(st.floats(-400, 3000), min_size=1, max_size=20))
def test_altitudes_go_up_to_centimetres_that_ardupilot_keeps(altitudes):
    for asked, kept in zip(altitudes, kept_altitudes_m(altitudes), strict=True):
        assert asked - 1e-6 <= kept < asked + 0.05
        assert int(np.float32(kept) * np.float32(100)) / 100 == kept
