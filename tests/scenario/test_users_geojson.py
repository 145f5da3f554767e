"""Users from GeoJSON: RFC 7946 points, a city's own properties, and what is refused."""

import json
from pathlib import Path

import pytest

from mavplan.scenario import load_scenario

DATA = Path(__file__).resolve().parents[2] / "../shared/data"


def feature(lon=7.5, lat=46.5, **properties):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Point", "coordinates": [lon, lat]},
    }


def collection(*features, **more):
    return json.dumps({"type": "FeatureCollection", "features": list(features), **more})


def load(desk, users, toml=""):
    return desk.load(users, toml, name="users.geojson")


def test_longitude_comes_first(desk):
    """RFC 7946, section 3.1.1; a height behind them is ignored."""
    one = feature(name="A")
    one["geometry"]["coordinates"] = [7.6, 46.4, 1234.5]
    users = load(desk, collection(one)).users
    assert (users.lon_deg[0], users.lat_deg[0]) == (7.6, 46.4)


def test_properties_are_mapped_and_taken_as_numbers_or_text(desk):
    """Capacity as a number or a clean string; a pair id as a number is the same as its text."""
    users = collection(
        feature(Name="A", Capacity=12, party=7),
        feature(Name="B", Capacity=" 3.5 ", party="7"),
        feature(Name=3, Capacity=None, party=8.0),
        feature(Name="D", party=8),
    )
    scenario = load(desk, users, '[columns]\ndemand_mbit = "Capacity"\npair = "party"\n')
    assert scenario.users.names == ("A", "B", "3", "D")
    assert scenario.users.demand_bit.tolist() == [12e6, 3.5e6, 10e6, 10e6]
    assert scenario.users.mate.tolist() == [1, 0, 3, 2]
    assert scenario.d2d.matching == "given"


def test_a_single_feature_and_a_point_among_many_are_users(desk):
    """A Feature alone, and a MultiPoint of one."""
    one = feature(name="A")
    one["geometry"] = {"type": "MultiPoint", "coordinates": [[7.5, 46.5]]}
    assert len(load(desk, json.dumps(one)).users) == 1


@pytest.mark.parametrize(
    "name",
    [
        "urn:ogc:def:crs:OGC:1.3:CRS84",
        "urn:ogc:def:crs:OGC::CRS84",
        "EPSG:4326",
        "urn:ogc:def:crs:EPSG::4326",
        "OGC:CRS84",
    ],
)
def test_wgs84_may_be_named(desk, name):
    """As GeoJSON's former version did, and many programs do."""
    crs = {"type": "name", "properties": {"name": name}}
    assert len(load(desk, collection(feature(), crs=crs)).users) == 1
    assert len(load(desk, collection(feature(), crs=None)).users) == 1


def with_geometry(kind, coordinates):
    return {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": coordinates}}


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (
            with_geometry("Polygon", [[[7.5, 46.5]]]),
            "feature 2, geometry: found a Polygon; allowed is a Point",
        ),
        (with_geometry("LineString", [[7.5, 46.5]]), "found a LineString"),
        (with_geometry("GeometryCollection", None), "found a GeometryCollection"),
        (
            with_geometry("MultiPoint", [[7, 46], [7, 46]]),
            "found a MultiPoint of 2 points; allowed is one point a user",
        ),
        (with_geometry(None, [7, 46]), "found nothing; allowed is a Point"),
        (with_geometry("Point", [7.5]), "its coordinates are a list; allowed is longitude and latitude"),
        (with_geometry("Point", "7.5,46.5"), 'its coordinates are "7.5,46.5"'),
        (
            with_geometry("Point", [46.5, 91]),
            "feature 2, geometry, latitude: found 91; allowed is a number from -90",
        ),
        (with_geometry("Point", [-181, 46]), "feature 2, geometry, longitude: found -181"),
        (with_geometry("Point", [float("nan"), 46]), "geometry, longitude: found nan"),
        (with_geometry("Point", [7, float("-inf")]), "geometry, latitude: found -inf"),
        (with_geometry("Point", [True, 46]), "geometry, longitude: found true"),
        (with_geometry("Point", [10**400, 46]), "found a number of more than sixty digits"),
        (with_geometry("Point", [7, None]), "geometry, latitude: nothing stands there"),
        (
            {"type": "Feature", "properties": {}, "geometry": None},
            "feature 2, geometry: has none; allowed is a Point",
        ),
        ({"type": "Feature", "properties": {}}, "feature 2, geometry: has none"),
        (
            {"type": "Feature", "properties": [], "geometry": {}},
            "its properties are a list; allowed is a table",
        ),
        ({"type": "Point", "coordinates": [7, 46]}, 'feature 2: found "Point"; allowed is a Feature'),
        (3, "feature 2: found 3; allowed is a Feature"),
        (feature(demand_mbit=-1), "feature 2, property demand_mbit: found -1"),
        (feature(demand_mbit="12 Mbit"), "which is not a plain decimal number"),
        (feature(demand_mbit=True), "feature 2, property demand_mbit: found true"),
        (feature(demand_mbit=[1]), "feature 2, property demand_mbit: found a list"),
        (feature(name={"de": "A"}), "feature 2, property name: found a table; allowed is text or a number"),
        (feature(name="\ud800"), "with characters that cannot be written"),
        (feature(pair=1), 'the pair id "1" stands there once (in feature 2)'),
    ],
)
def test_a_bad_feature_is_named_with_its_number_and_what_is_allowed(desk, bad, words):
    """One sentence that can be printed, whatever stands in the file."""
    found = desk.problems(collection(feature(), bad), name="users.geojson")
    assert any(words in text for _, text in found), found
    for _, text in found:
        assert text.startswith("users.geojson, feature 2")
        text.encode()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "users.geojson, line 1: is not valid JSON"),
        ('{"type":\n "FeatureCollection",', "users.geojson, line 2: is not valid JSON"),
        ("[" * 100_000, "users.geojson: is not JSON that can be read"),
        ('{"a": 1' + "0" * 5000 + "}", "users.geojson: is not JSON that can be read"),
        ("[]", "found a list; allowed is a FeatureCollection"),
        ("null", "found nothing; allowed is a FeatureCollection"),
        ('{"type": "Topology"}', 'found "Topology"; allowed is a FeatureCollection'),
        ('{"type": "FeatureCollection"}', "its features are missing or no list"),
        ('{"type": "FeatureCollection", "features": []}', "holds no users; at least one is needed"),
        (
            collection(feature(), crs={"properties": {"name": "EPSG:2056"}}),
            'crs: its coordinates are in "EPSG:2056"',
        ),
        (collection(feature(), crs="x"), 'its coordinates are in "x"; allowed is WGS84'),
        (b"\xff", "users.geojson, line 1: byte 0xff is not UTF-8"),
    ],
)
def test_a_file_that_is_no_collection_of_points_is_refused(desk, text, words):
    """Syntax, kind of object, reference system."""
    assert words in desk.only_problem(text, name="users.geojson")[1]


def test_a_mapped_property_must_be_there_once_at_least(desk):
    """A misspelt mapping is an error that names those there."""
    text = desk.only_problem(
        collection(feature(Cap=1)), '[columns]\ndemand_mbit = "Capacity"\n', name="u.json"
    )[1]
    assert (
        "u.json: there is no property Capacity, which [columns] demand_mbit names; those there: Cap" in text
    )


def test_mapped_positions_are_said_to_be_unused(desk):
    """The geometry is the position."""
    scenario = load(desk, collection(feature()), '[columns]\nlat_deg = "Y"\n')
    assert [problem.code for problem in scenario.warnings] == ["not-used"]


def city(desk, file, columns):
    if not (DATA / file).exists():
        pytest.skip(f"{DATA / file} is not there")
    home = "[home]\nlat_deg = 42.3736\nlon_deg = -71.1097\nalt_amsl_m = 12\n"
    path = desk.folder / "scenario.toml"
    path.write_text(f'users = "{(DATA / file).resolve()}"\n{home}[columns]\n{columns}\n', encoding="utf-8")
    return load_scenario(path)


def test_the_shelters_of_a_city_are_usable_as_they_are(desk):
    """Fifteen shelters with demand from Capacity; the one without gets the default, which is said."""
    file = "cambridge_emergency_shelters.geojson"
    scenario = city(desk, file, 'demand_mbit = "Capacity"')
    features = json.loads((DATA / file).read_text(encoding="utf-8"))["features"]
    assert list(scenario.users.names) == [entry["properties"]["Name"] for entry in features]
    expected = [entry["properties"].get("Capacity", 10) * 1e6 for entry in features]
    assert scenario.users.demand_bit.tolist() == expected
    assert [entry["geometry"]["coordinates"][0] for entry in features] == scenario.users.lon_deg.tolist()
    assert scenario.d2d.matching == "none"
    assert ["Gately Youth Center" in problem.message for problem in scenario.warnings] == [True]


def test_the_hydrants_of_a_city_are_usable_as_they_are(desk):
    """1,960 users without names of their own."""
    scenario = city(desk, "cambridge_hydrants.geojson", "")
    assert len(scenario.users) == 1960
    assert scenario.users.names[-1] == "user-1960"
    assert abs(scenario.users.xy_m).max() < 6000
