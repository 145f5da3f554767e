"""Distances to a border against dense sampling, and inside or outside against the mock vehicle's own test."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.geo import LocalPlane, geodesic_distance_m
from mavplan.mission.fence_geometry import SPHERE_SHARE, PlaneCircle, contains, plane_areas
from mavplan.mission.geofence import Fence, FencePolygon
from sitl_mock.feasibility import breaks_fence
from sitl_mock.items import StoredItem
from tests.fences import HOME, box, circle, place_e7, sound_polygons

PLANE = LocalPlane(HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7)
metres = st.floats(-4000, 4000)
points = st.tuples(metres, metres)


def plane_area(area):
    (found,) = plane_areas(Fence((area,)) if isinstance(area, FencePolygon) else Fence((), (area,)), PLANE)
    return found


def clearance_m(area, start, end):
    (found,) = area.clearance_m([start], [end])
    return float(found)


def sampled_clearance_m(area, start, end, steps=200):
    """Signed distance by brute force: points along the leg against points along the border."""
    along = np.linspace(0, 1, steps)[:, None]
    leg = np.asarray(start) + along * (np.asarray(end) - np.asarray(start))
    if isinstance(area, PlaneCircle):
        away = np.linalg.norm(leg - area.centre_m, axis=1)
        room = area.radius_m - away if area.inclusion else away - area.radius_m
        return room.min()
    ring = np.concatenate((area.ring_m, area.ring_m[:1]))
    border = np.concatenate([a + along * (b - a) for a, b in itertools.pairwise(ring)])
    away = min(np.linalg.norm(border - point, axis=1).min() for point in leg)
    inside = contains(area.ring_m, leg).tolist()
    if all(one == inside[0] for one in inside):
        return away if inside[0] == area.inclusion else -away
    return 0.0


@given(sound_polygons, points, points)
@settings(deadline=None, max_examples=20)
def test_the_clearance_of_a_leg_is_that_of_its_nearest_point(area, start, end):
    """To the step of the samples; where it crosses it is 0."""
    found = plane_area(area)
    step_m = max(math.dist(start, end), 8000.0) / 200
    exact, sampled = clearance_m(found, start, end), sampled_clearance_m(found, start, end)
    assert exact == pytest.approx(sampled, abs=2 * step_m)
    assert abs(exact) <= abs(sampled) + 1e-6  # samples cannot be nearer than the nearest point


@given(
    st.booleans(),
    points,
    st.floats(1, 3000),
    points,
    points,
)
@settings(deadline=None)
def test_the_clearance_from_a_circle_is_that_of_its_worst_point(inclusion, centre, radius_m, start, end):
    """Exact at the ends of a leg inside, and at the foot of the perpendicular outside."""
    area = PlaneCircle("c", inclusion, np.asarray(centre), radius_m)
    exact, sampled = clearance_m(area, start, end), sampled_clearance_m(area, start, end)
    assert exact <= sampled + 1e-6
    assert exact == pytest.approx(sampled, abs=math.dist(start, end) / 200 + 1e-6)


def test_a_case_by_hand():
    """A square of 100 m: distances to be read off."""
    inside, outside = plane_area(box(0, 0, 100, 100)), plane_area(box(0, 0, 100, 100, False))
    assert clearance_m(inside, (50, 50), (50, 50)) == pytest.approx(50, abs=0.5)
    assert clearance_m(inside, (20, 50), (50, 90)) == pytest.approx(10, abs=0.5)
    assert clearance_m(inside, (50, 50), (150, 50)) == 0
    assert clearance_m(inside, (150, 50), (150, 50)) == pytest.approx(-50, abs=0.5)
    assert clearance_m(outside, (130, -10), (130, 400)) == pytest.approx(30, abs=0.5)
    assert clearance_m(outside, (-50, 50), (150, 50)) == 0  # through it, both ends outside
    assert clearance_m(outside, (50, 50), (50, 50)) == pytest.approx(-50, abs=0.5)
    assert clearance_m(plane_area(circle(0, 0, 100, False)), (-200, 50), (200, 50)) == pytest.approx(
        -50, abs=0.2
    )


def vertex_items(area):
    command, count = (5001 if area.inclusion else 5002), float(len(area.vertices_e7))
    return [
        StoredItem(k, 5, command, 0, 0, count, 0.0, 0.0, 0.0, *place, 0.0)
        for k, place in enumerate(area.vertices_e7)
    ]


@given(sound_polygons, points)
@settings(deadline=None, max_examples=200)
def test_a_place_is_inside_where_the_vehicles_own_test_in_degrees_says_so(area, point):
    """But within 3 cm of the border, where the pieces of a side may lie off it."""
    lat_e7, lon_e7 = place_e7(*point)
    found = plane_area(area)
    at_m = PLANE.to_xy_m(lat_e7 / 1e7, lon_e7 / 1e7)[0]
    clear_m = clearance_m(found, at_m, at_m)
    if abs(clear_m) > 0.03:
        assert (clear_m < 0) == breaks_fence(lat_e7, lon_e7, vertex_items(area))


@pytest.mark.parametrize("lat_deg", [0.0, 46.5, 60.0, 80.0, -85.0])
def test_long_sides_are_straight_in_degrees_not_in_the_plane(lat_deg):
    """A side of 40 km along a parallel bulges by up to hundreds of metres; its middle is on the border all the same."""
    half_deg = 20_000 / (111_200 * math.cos(math.radians(lat_deg)))
    lat_e7, step = round(lat_deg * 1e7), 1 if lat_deg <= 0 else -1
    corners = [
        (lat_e7, half_deg),
        (lat_e7, -half_deg),
        (lat_e7 + step * 900_000, -half_deg),
        (lat_e7 + step * 900_000, half_deg),
    ]
    area = FencePolygon(True, tuple((lat, round(lon * 1e7)) for lat, lon in corners))
    plane = LocalPlane(lat_deg, 0.0)
    (found,) = plane_areas(Fence((area,)), plane)
    for share in (-0.9, -0.33, 0.0, 0.51):
        at_m = plane.to_xy_m(lat_deg, share * half_deg)[0]
        assert abs(clearance_m(found, at_m, at_m)) < 0.03
    straight_m = abs(plane.to_xy_m(lat_deg, half_deg)[0][1])
    expected_m = 20_000**2 * math.tan(math.radians(abs(lat_deg))) / (2 * 6_371_000)
    assert straight_m == pytest.approx(expected_m, rel=0.02, abs=0.01)


@given(st.floats(-89, 89), st.floats(0, 2 * math.pi), st.floats(10, 20_000))
@settings(deadline=None)
def test_a_radius_on_the_autopilots_spheres_is_ours_within_the_share_that_is_kept(
    lat_deg, bearing, distance_m
):
    """PX4's great circle on 6371.0 km and ArduPilot's plane of 6378.1 km against the geodesic."""
    plane = LocalPlane(lat_deg, 7.5)
    away = [[distance_m * math.sin(bearing), distance_m * math.cos(bearing)]]
    (lat, lon) = (float(value[0]) for value in plane.to_lat_lon_deg(away))
    exact_m = float(geodesic_distance_m(lat_deg, 7.5, lat, lon))
    d_lat, d_lon = math.radians(lat - lat_deg), math.radians(math.remainder(lon - 7.5, 360))
    h = math.sin(d_lat / 2) ** 2 + math.cos(math.radians(lat_deg)) * math.cos(math.radians(lat)) * (
        math.sin(d_lon / 2) ** 2
    )
    px4_m = 2 * 6_371_000 * math.asin(math.sqrt(h))
    assert px4_m == pytest.approx(exact_m, rel=SPHERE_SHARE)
    if abs(lat_deg) < 80:
        ardupilot_m = 6_378_137 * math.hypot(d_lat, d_lon * math.cos(math.radians((lat + lat_deg) / 2)))
        assert ardupilot_m == pytest.approx(exact_m, rel=SPHERE_SHARE)
