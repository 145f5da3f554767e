"""Fences and rally points about one home for several tests: hypothesis strategies, and a mission that carries them."""

import math
from dataclasses import replace

from hypothesis import strategies as st

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.build import build_mission
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint, area_faults
from mavplan.mission.model import HomePosition, Mission

HOME = HomePosition(465_000_000, 75_000_000, 600.0)
DEGREE_M = 111_200.0


def place_e7(east_m: float, north_m: float, home: HomePosition = HOME) -> tuple[int, int]:
    """A place so far from home, to about a thousandth."""
    shrink = math.cos(math.radians(home.lat_e7 / 1e7))
    return (
        home.lat_e7 + round(north_m / DEGREE_M * 1e7),
        home.lon_e7 + round(east_m / DEGREE_M / shrink * 1e7),
    )


def box(west_m, south_m, east_m, north_m, inclusion=True, home=HOME) -> FencePolygon:
    """A rectangle, metres about home."""
    corners = ((west_m, south_m), (west_m, north_m), (east_m, north_m), (east_m, south_m))
    return FencePolygon(inclusion, tuple(place_e7(*corner, home) for corner in corners))


def circle(east_m, north_m, radius_m, inclusion=True) -> FenceCircle:
    """A circle, metres about home."""
    return FenceCircle(inclusion, *place_e7(east_m, north_m), radius_m)


@st.composite
def polygons(draw, home=HOME, reach_m=2000.0):
    """Any star-shaped polygon of 3 to 9 vertices: its sides do not meet."""
    count = draw(st.integers(3, 9))
    cuts = draw(st.lists(st.integers(1, 100), min_size=count, max_size=count))
    far_m = draw(st.lists(st.floats(reach_m / 20, reach_m), min_size=count, max_size=count))
    centre = [draw(st.floats(-reach_m, reach_m)) for _ in range(2)]
    turn, total = draw(st.floats(0, 6.2)), sum(cuts)
    angles = [turn + 2 * math.pi * sum(cuts[:k]) / total for k in range(count)]
    vertices = tuple(
        place_e7(centre[0] + r * math.cos(a), centre[1] + r * math.sin(a), home)
        for a, r in zip(angles, far_m, strict=True)
    )
    if draw(st.booleans()):
        vertices = vertices[::-1]
    return FencePolygon(draw(st.booleans()), vertices)


sound_polygons = polygons().filter(lambda area: not list(area_faults(area)))
circles = st.builds(
    lambda inclusion, east, north, radius: circle(east, north, radius, inclusion),
    st.booleans(),
    st.floats(-2000, 2000),
    st.floats(-2000, 2000),
    st.floats(1, 3000, width=32),
)
fences = st.builds(
    Fence,
    st.lists(sound_polygons, max_size=3).map(tuple),
    st.lists(circles, max_size=3).map(tuple),
)
rally_points = st.builds(
    lambda east, north, alt, name: RallyPoint(*place_e7(east, north), float(alt), name),
    st.floats(-3000, 3000),
    st.floats(-3000, 3000),
    st.integers(1, 500),
    st.sampled_from(["", "meadow"]),
)


def fenced_mission(
    stops_m=((0.0, 200.0), (300.0, 200.0)),
    *,
    fence=None,
    rally=(),
    autopilot="ardupilot",
    altitude_m=50.0,
    end="rtl",
) -> Mission:
    """A mission with stops so many metres east and north of home."""
    built = build_mission(
        home=HOME,
        stops_e7=[place_e7(*stop) for stop in stops_m],
        holds_s=[5.0] * len(stops_m),
        rules=AUTOPILOTS[autopilot],
        altitude_m=altitude_m,
        speed_m_s=8.0,
        end=end,
        hover="loiter",
    )
    return replace(built.mission, fence=fence, rally=tuple(rally))
