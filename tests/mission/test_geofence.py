"""What an area must be in itself: corners in order, sides that do not meet, a radius; exact."""

import itertools
import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.mission.geofence import (
    Fence,
    FenceCircle,
    FencePolygon,
    RallyPoint,
    area_faults,
    crossing_sides,
    rally_faults,
    rally_label,
)
from tests.fences import box, circle

SQUARE = ((0, 0), (0, 10), (10, 10), (10, 0))


def codes(area):
    return [code for _, code in area_faults(area)]


@pytest.mark.parametrize(
    ("vertices", "code", "words"),
    [
        ((), "vertices", "0 vertices; at least 3"),
        (((0, 0),), "vertices", "1 vertex; at least 3"),
        (((0, 0), (1, 1)), "vertices", "2 vertices; at least 3"),
        ((*SQUARE, SQUARE[0]), "vertices", "the last vertex repeats the first: leave it out"),
        (((0, 0), (0, 5), (0, 5), (5, 0)), "vertices", "vertices 2 and 3 are the same place"),
        (((0, 0), (0, 10), (0, 20)), "self-crossing", "its sides meet"),
        (((0, 0), (10, 10), (0, 10), (10, 0)), "self-crossing", "vertex 1 to 2 and vertex 3 to 4"),
        (((0, 0), (0, 10), (10, 10), (0, 5)), "self-crossing", "vertex 1 to 2 and vertex 3 to 4"),
        (((0, 0), (0, 10), (5, 10), (10, 10), (5, 10), (5, 0)), "self-crossing", "its sides meet"),
        (((0, 0), (0, 10), (900_000_001, 5)), "latitude", "vertex 3: latitude 90.0000001"),
        (((0, -5), (0, -1_800_000_001), (10, -9)), "longitude", "vertex 2: longitude -180.0000001"),
        (((0, 1_799_999_000), (10, 1_799_999_000), (10, -1_799_999_000)), "antimeridian", "180° meridian"),
        (tuple((k, k * k) for k in range(256)), "vertices", "256 vertices; at most 255"),
    ],
)
def test_each_way_in_which_a_polygon_is_none_has_its_sentence(vertices, code, words):
    """One fault, one problem."""
    ((message, found),) = area_faults(FencePolygon(True, tuple(vertices)))
    assert found == code
    assert words in message


@pytest.mark.parametrize("radius_m", [0.0, -1.0, math.nan, math.inf, 100_001.0])
def test_a_circle_has_a_radius(radius_m):
    """NaN above all: it has killed a simulated vehicle."""
    assert codes(circle(0, 0, radius_m)) == ["radius"]


def test_every_fault_of_a_circle_is_told():
    """Latitude, longitude and radius at once."""
    assert codes(FenceCircle(True, 900_000_001, 1_800_000_001, 0.0)) == ["latitude", "longitude", "radius"]


@pytest.mark.parametrize("vertices", [SQUARE, SQUARE[::-1], ((0, 0), (0, 10), (10, 10), (2, 8))])
def test_a_good_area_has_no_fault(vertices):
    """Either way round, also with a corner that points inwards."""
    assert codes(FencePolygon(False, vertices)) == []
    assert codes(circle(0, 0, 1.0)) == []


def meet_by_fractions(a, b, c, d):
    """Whether two closed segments meet, by solving for the point with fractions; parallels by their ends."""
    r, s = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    cross = r[0] * s[1] - r[1] * s[0]
    gap = (c[0] - a[0], c[1] - a[1])
    if cross:
        t, u = Fraction(gap[0] * s[1] - gap[1] * s[0], cross), Fraction(gap[0] * r[1] - gap[1] * r[0], cross)
        return 0 <= t <= 1 and 0 <= u <= 1
    if gap[0] * r[1] - gap[1] * r[0]:
        return False
    return any(
        min(p[k], q[k]) <= point[k] <= max(p[k], q[k]) and p != q
        for p, q, points in ((a, b, (c, d)), (c, d, (a, b)))
        for point in points
        for k in (0, 1)
        if (p[0] != q[0] or k == 1) and (p[1] != q[1] or k == 0)
    )


small = st.tuples(st.integers(-4, 4), st.integers(-4, 4))


@given(st.lists(small, min_size=3, max_size=7, unique=True))
@settings(deadline=None, max_examples=300)
def test_sides_meet_exactly_where_fractions_say_so(vertices):
    """On a small grid touching corners, overlaps and crossings are common."""
    sides = list(zip(vertices, [*vertices[1:], vertices[0]], strict=True))
    count, found = len(sides), False
    for i, j in itertools.combinations(range(count), 2):
        (a, b), (c, d) = sides[i], sides[j]
        if j == i + 1 or (i, j) == (0, count - 1):
            shared = b if j == i + 1 else a
            one, other = (a, d) if j == i + 1 else (b, c)
            v, w = ((p[0] - shared[0], p[1] - shared[1]) for p in (one, other))
            found |= v[0] * w[1] == v[1] * w[0] and v[0] * w[0] + v[1] * w[1] > 0
        else:
            found |= meet_by_fractions(a, b, c, d)
    assert (crossing_sides(vertices) is not None) == found


def test_a_rectangle_with_two_corners_swapped_is_a_bow_tie():
    """The usual slip of whoever types corners row by row."""
    square = box(0, 0, 100, 100)
    a, b, c, d = square.vertices_e7
    assert codes(square) == []
    assert codes(FencePolygon(True, (a, c, b, d))) == ["self-crossing"]


def test_areas_are_called_by_name_or_by_kind_and_number():
    """Names take no part in comparisons: neither file nor vehicle keeps them."""
    plain, named = box(0, 0, 1, 1), FencePolygon(False, SQUARE, "[[fence.exclusion]] 1")
    fence = Fence((plain, named), (circle(0, 0, 5.0, False),))
    labels = [label for label, _ in fence.labelled()]
    assert labels == ["fence polygon 1 (inclusion)", "[[fence.exclusion]] 1", "fence circle 1 (exclusion)"]
    assert named == FencePolygon(False, SQUARE)
    assert not Fence()
    assert fence


def test_a_rally_point_is_a_place_with_an_altitude():
    """0, 0 is what vehicles take for none."""
    assert rally_label(2, RallyPoint(1, 1, 30.0, "meadow")) == "rally point 2 (meadow)"
    assert rally_label(1, RallyPoint(1, 1, 30.0)) == "rally point 1"
    assert not list(rally_faults(RallyPoint(1, 0, -3.0)))
    bad = (RallyPoint(0, 0, 1.0), RallyPoint(1, 1, math.nan), RallyPoint(900_000_001, 1, 1.0))
    found = [code for point in bad for _, code in rally_faults(point)]
    assert found == ["position", "altitude", "latitude"]
