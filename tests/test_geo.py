"""The plane about home against the geodesic: pyproj.Geod (Karney), and figures from other people's papers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from mavplan.geo import LocalPlane, degrees_to_e7, geodesic_distance_m

GEOD = Geod(ellps="WGS84")

HOMES = st.tuples(
    st.floats(-90, 90) | st.sampled_from([-90.0, 90.0, 0.0, 89.9999, -89.9999]),
    st.floats(-180, 180) | st.sampled_from([-180.0, 180.0, 179.9999, -179.9999, 0.0]),
)
BEARINGS = st.floats(0, 2 * np.pi)
DISTANCES = st.floats(0, 100_000)


def test_known_length_of_a_degree():
    """WGS84: one degree of latitude on the equator is 110,574 m, of longitude 111,319 m (NIMA TR8350.2)."""
    assert geodesic_distance_m(0, 0, 1, 0) == pytest.approx(110_574.39, abs=0.01)
    assert geodesic_distance_m(0, 0, 0, 1) == pytest.approx(111_319.49, abs=0.01)


def test_known_geodesic_between_two_cities():
    """Wellington to Salamanca, the example in GeographicLib's documentation: 19959679.267 m."""
    assert geodesic_distance_m(-41.32, 174.81, 40.96, -5.50) == pytest.approx(19_959_679.267, abs=0.001)


def test_distances_are_broadcast():
    """One home, many users."""
    assert geodesic_distance_m(0, 0, [0, 1, 2], [0, 0, 0]).shape == (3,)


@settings(deadline=None)
@given(HOMES, BEARINGS, DISTANCES)
def test_distance_and_direction_from_home_are_the_geodesic_s(home, bearing, distance_m):
    """To less than a millimetre, everywhere on Earth."""
    lat, lon = home
    plane = LocalPlane(lat, lon)
    xy_m = distance_m * np.array([[np.sin(bearing), np.cos(bearing)]])
    there_lat, there_lon = plane.to_lat_lon_deg(xy_m)
    azimuth, _, length_m = GEOD.inv(lon, lat, there_lon[0], there_lat[0])
    assert length_m == pytest.approx(distance_m, abs=1e-3)
    if abs(lat) < 89.9:  # at a pole every direction is south, or north
        off = np.radians(azimuth) - bearing
        assert abs(np.sin(off)) * distance_m < 1e-3 + 1e-9 * distance_m
        assert distance_m < 1 or np.cos(off) > 0


@settings(deadline=None)
@given(HOMES, BEARINGS, DISTANCES)
def test_there_and_back_is_less_than_a_millimetre(home, bearing, distance_m):
    """From metres to degrees and back."""
    plane = LocalPlane(*home)
    xy_m = distance_m * np.array([[np.sin(bearing), np.cos(bearing)]])
    lat, lon = plane.to_lat_lon_deg(xy_m)
    assert -90 <= lat[0] <= 90
    assert -180 <= lon[0] <= 180
    assert plane.to_xy_m(lat, lon) == pytest.approx(xy_m, abs=1e-3)


@settings(deadline=None)
@given(HOMES, BEARINGS, DISTANCES)
def test_whole_units_are_the_nearest_ones(home, bearing, distance_m):
    """Half a unit of 1e-7 degrees at most, and what a mission item can hold."""
    plane = LocalPlane(*home)
    xy_m = distance_m * np.array([[np.sin(bearing), np.cos(bearing)]])
    lat, lon = plane.to_lat_lon_deg(xy_m)
    lat_e7, lon_e7 = plane.to_e7(xy_m)
    assert lat_e7.dtype == lon_e7.dtype == np.int64
    assert abs(lat_e7[0] - lat[0] * 1e7) <= 0.5 + 1e-6
    assert abs(lon_e7[0] - lon[0] * 1e7) <= 0.5 + 1e-6
    assert abs(lat_e7[0]) <= 900_000_000
    assert abs(lon_e7[0]) <= 1_800_000_000


def test_units_are_rounded_not_cut_off():
    """46.58 is 46.5799999… in binary: cutting off gives 465,799,999."""
    assert degrees_to_e7([46.58, -46.58, 1.9e-7, -1.9e-7]).tolist() == [465_800_000, -465_800_000, 2, -2]


def test_across_the_antimeridian_users_are_near():
    """Fiji: 0.002 degrees of longitude apart are 213 m, not half the Earth."""
    xy_m = LocalPlane(-17.0, 179.999).to_xy_m([-17.0], [-179.999])
    assert xy_m[0] == pytest.approx([GEOD.inv(179.999, -17, -179.999, -17)[2], 0], abs=0.01)


def test_at_the_pole_the_plane_is_a_plane():
    """Four points a thousandth of a degree from the pole form a square of 111.7 m about home."""
    xy_m = LocalPlane(90.0, 0.0).to_xy_m([89.999] * 4, [0, 90, 180, -90])
    assert np.linalg.norm(xy_m, axis=1) == pytest.approx([111.69] * 4, abs=0.01)
    assert xy_m.sum(axis=0) == pytest.approx([0, 0], abs=1e-6)


def test_between_users_near_home_the_plane_agrees_with_the_geodesic():
    """Within 10 km of home, lengths between users are right to a millimetre in a kilometre."""
    rng = np.random.default_rng(3)
    plane = LocalPlane(46.5, 7.5)
    xy_m = rng.uniform(-7000, 7000, (200, 2))
    lat, lon = plane.to_lat_lon_deg(xy_m)
    in_plane_m = np.linalg.norm(xy_m[:-1] - xy_m[1:], axis=1)
    on_earth_m = geodesic_distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
    assert abs(in_plane_m - on_earth_m).max() < 1e-6 * in_plane_m.max()
