"""No-fly zones: no stop and no leg in one, ever; the shortest ways round; who cannot be served, and why."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from mavplan.airspace.routes import Routes
from mavplan.airspace.zones import TURN_CLEARANCE_M, keep_out
from mavplan.errors import InputError
from mavplan.geo import LocalPlane
from mavplan.hover import broadcast_rates
from mavplan.mission.fence_check import mission_breaches
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon
from mavplan.mission.model import Command
from mavplan.plan import make_plan
from mavplan.radio import planning_channel
from tests.support import HOME, make_scenario, user_fields

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)
MARGIN_M = 3.0


def polygon(points_m, name=""):
    lat, lon = PLANE.to_e7(np.asarray(points_m, dtype=float))
    return FencePolygon(False, tuple(zip(lat.tolist(), lon.tolist(), strict=True)), name)


def circle(x_m, y_m, radius_m, name=""):
    lat, lon = PLANE.to_e7(np.array([[x_m, y_m]]))
    return FenceCircle(False, int(lat[0]), int(lon[0]), radius_m, name)


def box(west, south, east, north, name=""):
    return polygon([(west, south), (east, south), (east, north), (west, north)], name)


def with_zones(scenario, *zones):
    polygons = tuple(zone for zone in zones if isinstance(zone, FencePolygon))
    circles = tuple(zone for zone in zones if isinstance(zone, FenceCircle))
    return replace(scenario, no_fly=Fence(polygons, circles))


def bare_shapes(zones):
    """The zones by shapely alone, without margins."""
    for zone in zones:
        if isinstance(zone, FenceCircle):
            centre = PLANE.to_xy_m(zone.lat_e7 / 1e7, zone.lon_e7 / 1e7)[0]
            yield shapely.Point(centre).buffer(zone.radius_m, quad_segs=32)
        else:
            lat, lon = np.array(zone.vertices_e7).T / 1e7
            yield shapely.Polygon(PLANE.to_xy_m(lat, lon))


def flown(mission):
    """Every place that the mission flies to, in the plane, from home."""
    placed = [item for item in mission.items if item.has_position]
    return np.vstack([[0, 0], PLANE.to_xy_m([i.lat_deg for i in placed], [i.lon_deg for i in placed])])


def planned(scenario):
    """The plan, or None and the codes of what stands against it."""
    try:
        return make_plan(scenario), set()
    except InputError as error:
        return None, {problem.code for problem in error.problems}


metres = st.floats(-2500, 2500).map(lambda value: round(value, 1))


@st.composite
def zones(draw):
    found = []
    for _ in range(draw(st.integers(1, 5))):
        x, y = draw(metres), draw(metres)
        if draw(st.booleans()):
            found.append(circle(x, y, draw(st.floats(5, 700))))
        else:
            angles = sorted(draw(st.lists(st.floats(0, 6.2), min_size=3, max_size=8, unique=True)))
            assume(all(b - a > 0.1 for a, b in itertools.pairwise(angles)))
            reach = [draw(st.floats(30, 900)) for _ in angles]
            found.append(
                polygon([(x + r * np.cos(a), y + r * np.sin(a)) for a, r in zip(angles, reach, strict=True)])
            )
    return found


@settings(max_examples=120, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(
    user_fields(10),
    zones(),
    st.sampled_from(["tloaik", "stoaik", "boaik", "sbw"]),
    st.sampled_from(["rtl", "stay", "land"]),
    st.sampled_from(["ardupilot", "px4"]),
)
def test_no_stop_and_no_leg_is_ever_in_a_zone(users, zones, planner, end, autopilot):
    scenario = make_scenario([[0, 0]], planner=planner, end=end, autopilot=autopilot)
    clear_plan(replace(scenario, users=users), zones)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    user_fields(5),
    zones(),
    st.sampled_from(["length", "time"]),
    st.sampled_from(["rtl", "stay"]),
    st.booleans(),
)
def test_nor_is_any_of_the_planners_that_search(users, zones, planner, end, in_flight):
    scenario = make_scenario([[0, 0]], planner=planner, end=end)
    options = replace(scenario.planner, time_limit_s=0.2)
    service = replace(scenario.service, in_flight=in_flight)
    plan = clear_plan(replace(scenario, users=users, planner=options, service=service), zones)
    if plan is None:
        return
    channel, d2d = planning_channel(plan.scenario), plan.trajectory.assignment.d2d
    got_bit = broadcast_rates(users, plan.trajectory.stops_m, channel) @ plan.holds.asked_s
    if plan.holds.in_flight_bit is not None:
        got_bit += plan.holds.in_flight_bit
    assert (got_bit[~d2d] >= users.demand_bit[~d2d] * (1 - 1e-6)).all()
    bound = plan.trajectory.bound
    assert bound is not None
    assert bound.bound <= bound.plan * (1 + 1e-9)


def clear_plan(scenario, zones):
    """The plan round the zones, held against shapely and the fence's own check; None where there is none."""
    shapes = list(bare_shapes(zones))
    assume(all(shape.is_valid for shape in shapes))
    assume(all(shape.distance(shapely.Point(0, 0)) > 40 for shape in shapes))
    plan, codes = planned(with_zones(scenario, *zones))
    assert codes <= {"no-allowed-place", "no-way"}
    if plan is None:
        return None
    path = flown(plan.built.mission)
    legs = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
    for shape in shapes:
        assert shapely.distance(shape, legs).min() >= MARGIN_M - 0.01
    assert plan.trajectory.assignment.served.all()
    if scenario.vehicle.end == "rtl":
        assert plan.built.mission.items[-1].command == Command.NAV_LAND
        assert np.abs(path[-1]).max() < 0.02
    assert mission_breaches(plan.built.mission, margin_m=MARGIN_M) == []
    return plan


def test_a_way_round_a_box_turns_at_its_two_near_corners():
    out = keep_out(Fence((box(200, -50, 300, 500),)), PLANE, MARGIN_M)
    turns = Routes(out).between(np.array([0.0, 0.0]), np.array([500.0, 0.0]))
    off_m = MARGIN_M + TURN_CLEARANCE_M + 0.1
    assert np.array(turns) == pytest.approx(
        np.array([[200 - off_m, -50 - off_m], [300 + off_m, -50 - off_m]]), abs=0.1
    )
    assert Routes(out).between(np.array([0.0, 0.0]), np.array([0.0, 400.0])) == []


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(zones(), metres, metres)
def test_a_way_round_is_the_shortest_that_the_corners_allow(zones, x_m, y_m):
    """Against Floyd and Warshall over everything that sees each other, asked of shapely one by one."""
    shapes = list(bare_shapes(zones))
    start, end = np.array([0.0, 0.0]), np.array([x_m, y_m])
    assume(
        all(
            shape.is_valid and shape.distance(shapely.Point(p)) > 40 for shape in shapes for p in (start, end)
        )
    )
    out = keep_out(
        Fence(
            tuple(z for z in zones if isinstance(z, FencePolygon)),
            tuple(z for z in zones if isinstance(z, FenceCircle)),
        ),
        PLANE,
        MARGIN_M,
    )
    found = Routes(out).between(start, end)
    nodes = np.vstack([start, end, out.corners_m])
    apart = np.linalg.norm(nodes[:, None] - nodes, axis=2)
    for i, j in itertools.combinations(range(len(nodes)), 2):
        if out.core.intersects(shapely.LineString([nodes[i], nodes[j]])):
            apart[i, j] = apart[j, i] = np.inf
    for k in range(len(nodes)):
        apart = np.minimum(apart, apart[:, k, None] + apart[None, k])
    if found is None:
        assert np.isinf(apart[0, 1])
        return
    way = np.vstack([start, *found, end])
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).sum() == pytest.approx(apart[0, 1])


def test_a_stop_in_a_zone_is_moved_to_the_nearest_place_that_serves_the_same_users():
    scenario = make_scenario([[1000, 0], [1000, 200]])
    before = make_plan(scenario).trajectory.stops_m
    x, y = before[0]
    plan = make_plan(with_zones(scenario, box(x - 50, y - 50, x + 50, y + 30)))
    moved = plan.trajectory.stops_m
    assert len(moved) == len(before)
    assert moved[0] == pytest.approx([x, y + 30 + MARGIN_M + 0.1], abs=0.3)


def test_a_stop_whose_users_no_place_reaches_together_stands_for_several():
    """Two users 780 m apart with a zone over everything between them."""
    scenario = make_scenario([[1000, 390], [1000, -390]])
    plan = make_plan(with_zones(scenario, box(500, -200, 1500, 200)))
    assert len(plan.trajectory.stop_at) == 2
    assert plan.trajectory.assignment.served.all()


def test_a_user_deep_in_a_zone_is_named_with_the_zone():
    scenario = make_scenario([[1500, 0], [0, 300]])
    with pytest.raises(InputError) as caught:
        make_plan(with_zones(scenario, circle(1500, 0, 600, "airfield")))
    (problem,) = caught.value.problems
    assert (problem.where, problem.code) == ("u0", "no-allowed-place")
    assert "airfield and the margin leave no place within 400 m of it" in problem.message


def test_a_user_deep_in_a_zone_is_served_through_its_mate_outside():
    scenario = make_scenario([[1500, 0], [1500, 650]], pairs=[(0, 1)])
    plan = make_plan(with_zones(scenario, circle(1500, 0, 500)))
    assert plan.trajectory.assignment.d2d.tolist() == [True, False]


def test_home_that_is_walled_in_has_no_way_out():
    walls = [
        box(-500, 300, 500, 320),
        box(-500, -320, 500, -300),
        box(-520, -320, -500, 320),
        box(500, -320, 520, 320),
    ]
    with pytest.raises(InputError) as caught:
        make_plan(with_zones(make_scenario([[2000, 0]]), *walls))
    assert "leave no way to it" in str(caught.value)


def test_the_stops_from_which_a_failsafe_would_cross_are_named():
    plan = make_plan(with_zones(make_scenario([[2000, 0], [0, 600]]), box(800, -100, 900, 100, "hill")))
    (warning,) = [problem for problem in plan.warnings if problem.code == "failsafe-crosses"]
    assert warning.where == "hill"
    hill = shapely.box(800, -100, 900, 100)
    ways = [shapely.LineString([stop, (0, 0)]) for stop in plan.trajectory.stops_m]
    (crossing,) = [n for n, way in enumerate(ways, start=1) if way.intersects(hill)]
    assert f"from stop {crossing}:" in warning.message


def test_the_zones_go_into_the_fence_of_the_mission_beside_its_own():
    scenario = make_scenario([[1500, 0]])
    inside = replace(box(-3000, -3000, 3000, 3000), inclusion=True)
    scenario = replace(with_zones(scenario, circle(700, 0, 100)), fence=Fence((inside,)))
    fence = make_plan(scenario).built.mission.fence
    assert [area.inclusion for _, area in fence.labelled()] == [True, False]


def test_a_way_through_open_country_is_left_as_it_is():
    scenario = make_scenario([[1500, 0], [1000, 500]])
    plan, free = make_plan(with_zones(scenario, circle(-2000, -2000, 100))), make_plan(scenario)
    assert np.array_equal(plan.trajectory.path_m, free.trajectory.path_m)


# -- zones as people bring them ---------------------------------------------------------------------------------

SQUARE = [[7.51, 46.51], [7.52, 46.51], [7.52, 46.52], [7.51, 46.52], [7.51, 46.51]]


def geojson(*geometries):
    features = [
        {"type": "Feature", "properties": {"name": f"zone {n}"}, "geometry": g}
        for n, g in enumerate(geometries)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


@pytest.fixture
def load(tmp_path):
    def read(toml, **files):
        for name, text in files.items():
            (tmp_path / name.replace("__", ".")).write_text(text)
        (tmp_path / "users.csv").write_text("name,lat_deg,lon_deg\nAnna,46.501,7.501\n")
        path = tmp_path / "scenario.toml"
        path.write_text(
            f'users = "users.csv"\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600\n{toml}'
        )
        from mavplan.scenario import load_scenario

        return load_scenario(path)

    return read


def test_zones_are_drawn_in_the_scenario_or_read_from_geojson_and_kml(load):
    kml = (
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><name>lake</name><Polygon><outerBoundaryIs><LinearRing>'
        "<coordinates>7.53,46.51 7.54,46.51,0 7.54,46.52 7.53,46.51</coordinates></LinearRing></outerBoundaryIs>"
        "</Polygon></Placemark></kml>"
    )
    polygons = geojson(
        {"type": "Polygon", "coordinates": [SQUARE]},
        {"type": "MultiPolygon", "coordinates": [[SQUARE], [SQUARE]]},
    )
    scenario = load(
        '[[no_fly]]\nname = "airfield"\ncircle = { lat_deg = 46.51, lon_deg = 7.51, radius_m = 100.0 }\n'
        '[[no_fly]]\nfile = "zones.geojson"\n[[no_fly]]\nfile = "lake.kml"\n',
        zones__geojson=polygons,
        lake__kml=kml,
    )
    assert [label for label, _ in scenario.no_fly.labelled()] == [
        "zone 0",
        "zone 1",
        "zone 1",
        "lake",
        "airfield",
    ]
    assert scenario.no_fly.polygons[0].vertices_e7[1] == (465_100_000, 75_200_000)
    assert not any(area.inclusion for _, area in scenario.no_fly.labelled())


def test_a_hole_counts_as_part_of_the_zone_and_is_said(load):
    hole = [[7.512, 46.512], [7.518, 46.512], [7.518, 46.518], [7.512, 46.512]]
    scenario = load(
        '[[no_fly]]\nfile = "z.geojson"\n',
        z__geojson=geojson({"type": "Polygon", "coordinates": [SQUARE, hole]}),
    )
    assert [problem.code for problem in scenario.warnings] == ["hole"]


CIRCLE = "circle = { lat_deg = 46.6, lon_deg = 7.5, radius_m = 9.0 }"
FILE = 'file = "z.geojson"'


def drawn(kind, coordinates):
    return geojson({"type": kind, "coordinates": coordinates})


@pytest.mark.parametrize(
    ("entry", "text", "words"),
    [
        ("", "", "an area is either polygon_deg or circle"),
        (f"name = 3\n{CIRCLE}", "", "allowed is text"),
        (f'fil = "x"\n{CIRCLE}', "", "nearest is file"),
        (f"{FILE}\n{CIRCLE}", "", "either drawn here"),
        (CIRCLE.replace("46.6", "46.5"), "", "[home]"),
        ('file = "none.geojson"', "", "there is no such file"),
        (FILE, "{", "is not JSON"),
        (FILE, "name,lat\n", "is not JSON"),
        (FILE, geojson(), "has no polygon in it"),
        (FILE, drawn("Point", [7.5, 46.5]), "has no polygon in it"),
        (FILE, drawn("Polygon", [[["a", 1]] * 4]), "[longitude, latitude]"),
        (FILE, drawn("Polygon", 3), "[longitude, latitude]"),
        (FILE, drawn("Polygon", [3]), "[longitude, latitude]"),
        (FILE, drawn("Polygon", [[[7, 46], [8, 47], [9, 48]]]), "polygon 1"),
        (FILE, "<kml><Placemark><Polygon/></Placemark></kml>", "longitude,latitude"),
    ],
)
def test_a_zone_that_is_none_is_one_sentence(load, entry, text, words):
    with pytest.raises(InputError) as caught:
        load(f"[[no_fly]]\n{entry}\n", z__geojson=text)
    assert words in str(caught.value)
