"""Maps of a plan: every place at its place, read back by other readers, and no name of a user does anything."""

import csv
import dataclasses
import io
import itertools
import json
import zipfile

import numpy as np
import pytest
from defusedxml.ElementTree import fromstring
from hypothesis import given
from hypothesis import strategies as st

from mavplan.geo import geodesic_distance_m
from mavplan.maps import MAPS, plan_map
from mavplan.maps.content import MappedUser, Place, PlanMap
from mavplan.maps.csv_table import neutral
from mavplan.maps.kml import circle_deg
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.scenario import load_scenario
from mavplan.scenario.report import Report
from mavplan.scenario.users_csv import read_csv
from mavplan.scenario.users_geojson import read_geojson
from mavplan.scenario.users_gpx import read_gpx
from mavplan.stored_plan import parse_plan
from tests.test_gallery import GALLERY

KML = "{http://www.opengis.net/kml/2.2}"
GPX = "{http://www.topografix.com/GPX/1/1}"


@pytest.fixture(scope="module")
def valley():
    plan = make_plan(load_scenario(GALLERY / "valley/scenario.toml"))
    return plan, plan_map(plan.built.mission, parse_plan(dumps(plan), "valley"), "valley")


def one_user(name, fence=None, rally=()):
    home = Place(46.5, 7.5, 600.0, 0.0)
    user = MappedUser(name, 46.501, 7.501, 10.0, 1, False, name)
    return PlanMap(name, home, (home, Place(46.502, 7.5, 700.0, 100.0)), (), (user,), 400.0, fence, rally)


def test_a_map_has_what_the_mission_flies(valley):
    plan, content = valley
    mission = plan.built.mission
    flown = {(item.lat_deg, item.lon_deg) for item in mission.items if item.has_position}
    assert {(place.lat_deg, place.lon_deg) for place in content.path} == flown
    assert content.path[0].alt_amsl_m == 900.0
    assert (content.path[-1].lat_deg, content.path[-1].lon_deg) == (
        content.home.lat_deg,
        content.home.lon_deg,
    )
    assert [stop.hold_s for stop in content.stops] == plan.holds.stored_s.tolist()
    assert [user.name for user in content.users] == list(plan.scenario.users.names)
    assert content.users[int(np.flatnonzero(plan.trajectory.assignment.d2d)[0])].d2d


def test_a_mission_without_its_plan_shows_where_it_holds(valley):
    plan, content = valley
    bare = plan_map(plan.built.mission, None, "valley")
    assert bare.users == ()
    assert bare.radius_m is None
    assert [(stop.place, stop.hold_s) for stop in bare.stops] == [
        (stop.place, stop.hold_s) for stop in content.stops
    ]


def test_kml_says_longitude_first_and_heights_above_the_sea(valley):
    _, content = valley
    root = fromstring(MAPS[".kml"](content))
    marks = {mark.findtext(f"{KML}name"): mark for mark in root.iter(f"{KML}Placemark")}
    first = content.stops[0]
    stop = next(mark for mark in root.iter(f"{KML}Placemark") if mark.findtext(f"{KML}name") == "Stop 1")
    lon, lat, alt = map(float, stop.findtext(f"{KML}Point/{KML}coordinates").split(","))
    assert (lat, lon, alt) == pytest.approx((first.place.lat_deg, first.place.lon_deg, 900.0), abs=1e-6)
    assert stop.findtext(f"{KML}Point/{KML}altitudeMode") == "absolute"
    assert [child.tag.removeprefix(KML) for child in stop] == ["name", "styleUrl", "ExtendedData", "Point"]
    assert len(marks["Path"].findtext(f"{KML}LineString/{KML}coordinates").split()) == len(content.path)
    styles = {f"#{style.get('id')}" for style in root.iter(f"{KML}Style")}
    assert {url.text for url in root.iter(f"{KML}styleUrl")} <= styles


def test_kmz_is_the_kml_and_the_same_bytes_every_time(valley):
    _, content = valley
    packed = MAPS[".kmz"](content)
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        assert archive.namelist() == ["doc.kml"]
        assert archive.read("doc.kml").decode() == MAPS[".kml"](content)
    assert MAPS[".kmz"](content) == packed


def test_gpx_users_come_back_as_users_and_the_stops_are_its_route(valley):
    _, content = valley
    text = MAPS[".gpx"](content)
    report = Report()
    table = read_gpx(text.encode(), "x.gpx", report)
    assert [row.cells["name"] for row in table.rows] == [*(user.name for user in content.users), "Home"]
    assert float(table.rows[0].position[0]) == pytest.approx(content.users[0].lat_deg, abs=1e-7)
    route = [point.findtext(f"{GPX}name") for point in fromstring(text).iter(f"{GPX}rtept")]
    assert route == [f"Stop {stop.number}" for stop in content.stops]


def test_geojson_is_features_told_apart_by_kind(valley):
    _, content = valley
    collection = json.loads(MAPS[".geojson"](content))
    kinds = [feature["properties"]["kind"] for feature in collection["features"]]
    assert kinds == ["home", "path", *["stop"] * len(content.stops), *["user"] * len(content.users)]
    users = [feature for feature in collection["features"] if feature["properties"]["kind"] == "user"]
    only = {"type": "FeatureCollection", "features": users}
    table = read_geojson(json.dumps(only), "x.geojson", Report())
    assert [row.position[0] for row in table.rows] == pytest.approx(
        [user.lat_deg for user in content.users], abs=1e-7
    )


def test_the_table_is_a_users_file_again(valley):
    _, content = valley
    table = read_csv(MAPS[".csv"](content), "x.csv", Report())
    assert [row.cells["name"] for row in table.rows] == [user.name for user in content.users]
    assert [float(row.cells["demand_mbit"]) for row in table.rows] == [
        user.demand_mbit for user in content.users
    ]


def test_the_table_keeps_priorities_where_there_are_any(valley):
    _, content = valley
    assert "priority" not in MAPS[".csv"](content).splitlines()[0]
    first, *others = content.users
    weighted = dataclasses.replace(content, users=(dataclasses.replace(first, priority=3.5), *others))
    rows = read_csv(MAPS[".csv"](weighted), "x.csv", Report()).rows
    assert [float(row.cells["priority"]) for row in rows] == [3.5, *(1.0 for _ in others)]


def test_fence_and_rally_points_are_on_the_maps_that_have_areas():
    square = ((465_000_000, 75_000_000), (465_100_000, 75_000_000), (465_100_000, 75_100_000))
    fence = Fence((FencePolygon(True, square),), (FenceCircle(False, 465_050_000, 75_050_000, 100.0),))
    content = one_user("A", fence, (RallyPoint(465_010_000, 75_010_000, 30.0, "meadow"),))
    kml = MAPS[".kml"](content)
    assert "fence polygon 1 (inclusion)" in kml
    assert "fence circle 1 (exclusion)" in kml
    assert "Rally point 1 (meadow)" in kml
    features = json.loads(MAPS[".geojson"](content))["features"]
    polygon = next(f for f in features if f["geometry"]["type"] == "Polygon")["geometry"]["coordinates"][0]
    assert polygon[0] == polygon[-1]
    shoelace = sum(a[0] * b[1] - b[0] * a[1] for a, b in itertools.pairwise(polygon))
    assert shoelace > 0, "RFC 7946 wants outer rings anticlockwise"


@given(st.floats(-80, 80), st.floats(-180, 180), st.floats(1, 5000))
def test_a_drawn_circle_is_at_its_distance(lat_deg, lon_deg, radius_m):
    for at in circle_deg(lat_deg, lon_deg, radius_m)[::17]:
        assert geodesic_distance_m(lat_deg, lon_deg, *at) == pytest.approx(radius_m, rel=0.006)


@given(st.text(max_size=30))
def test_no_name_breaks_a_file(name):
    """Markup, control characters, halves of characters: the files stay what they are."""
    content = one_user(name)
    fromstring(MAPS[".kml"](content))
    assert len(fromstring(MAPS[".gpx"](content)).findall(f"{GPX}wpt")) == 2
    found = json.loads(MAPS[".geojson"](content))["features"][-1]["properties"]
    assert found["name"] == name
    rows = list(csv.reader(io.StringIO(MAPS[".csv"](content).replace("\r", "\n"), newline="")))
    assert len(rows[0]) == 7


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"])
def test_a_name_that_a_spreadsheet_would_run_is_text(name):
    assert neutral(name) == f"'{name}"
    assert f"'{name}"[:3] in MAPS[".csv"](one_user(name))
    assert neutral("Anna = Ben") == "Anna = Ben"
