"""Twenty malformed inputs for each reader, given to the command line: a sentence each, exit code 2, nothing written."""

import json
from pathlib import Path

import numpy as np
import pytest

from mavplan.cli import run
from tests.scenario.test_users_places import (
    BAD_GPX,
    BAD_KML,
    BAD_XLSX,
    ENTITY,
    LAUGHS,
    TABLE,
    gpx,
    kml,
    placemark,
    spoilt,
    wpt,
    xlsx,
    zipped,
)
from tests.terrain.test_read import write_tiff

HOME = "[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600\n"
USERS = "name,lat_deg,lon_deg\nAnna,46.501,7.501\nBen,46.502,7.502\n"
HEAD = "name,lat_deg,lon_deg\n"

# fmt: off
BAD_CSV = {
    "empty": "",
    "only white space": " \n\n \n",
    "only a header": HEAD,
    "no header": "Anna,46.501,7.501\nBen,46.502,7.502\n",
    "no latitude": "name,lon_deg\nAnna,7.5\n",
    "no longitude": "name,lat_deg\nAnna,46.5\n",
    "column twice": "name,lat_deg,lat_deg,lon_deg\nAnna,46.5,46.5,7.5\n",
    "too few cells": HEAD + "Anna,46.5\n",
    "too many cells": HEAD + "Anna,46.5,7.5,1,2\n",
    "open quote": HEAD + '"Anna,46.5,7.5\nBen,46.5,7.6\n',
    "empty latitude": HEAD + "Anna,,7.5\n",
    "word": HEAD + "Anna,north,7.5\n",
    "nan": HEAD + "Anna,nan,7.5\n",
    "infinite": HEAD + "Anna,1e999,7.5\n",
    "latitude 91": HEAD + "Anna,91,7.5\n",
    "longitude 181": HEAD + "Anna,46.5,181\n",
    "swapped": HEAD + "Anna,7.501,46.501\n",
    "twice the name": HEAD + "Anna,46.5,7.501\nAnna,46.501,7.5\n",
    "demand": "name,lat_deg,lon_deg,demand_mbit\nAnna,46.5,7.501,-3\n",
    "demand in words": "name,lat_deg,lon_deg,demand_mbit\nAnna,46.5,7.501,much\n",
    "pair once": "name,lat_deg,lon_deg,pair\nAnna,46.5,7.501,1\n",
    "pair of three": "name,lat_deg,lon_deg,pair\na,46.5,7.501,1\nb,46.5,7.502,1\nc,46.5,7.503,1\n",
    "control character": HEAD + "An\x07na,46.5,7.501\n",
    "null": HEAD + "An\0na,46.5,7.501\n",
    "latin-1": (HEAD + "Zürich,46.5,7.501\n").encode("latin-1"),
    "utf-16 cut off": b"\xff\xfe" + (HEAD + "Anna,46.5,7.501\n").encode("utf-16-le")[:-1],
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)),
    "old excel": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600,
    "pdf": b"%PDF-1.7\n" + b"\xe2\xe3\xcf\xd3" * 20,
    "web page": "<!doctype html><html><body>404</body></html>",
}
BAD_TSV = {name: text.replace(",", "\t") for name, text in BAD_CSV.items() if isinstance(text, str)}


def points(*features, **more):
    return json.dumps({"type": "FeatureCollection", "features": list(features), **more})


def point(coordinates=(7.501, 46.501), name="Anna", kind="Point", **more):
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": {"name": name, **more}}


BAD_GEOJSON = {
    "empty": "",
    "cut off": points(point())[:-5],
    "list": "[]",
    "number": "46.5",
    "no features": '{"type": "FeatureCollection"}',
    "features no list": '{"type": "FeatureCollection", "features": {}}',
    "nobody": points(),
    "a polygon": points(point([[[7, 46], [7.1, 46], [7, 46.1], [7, 46]]], kind="Polygon")),
    "a line": points(point([[7, 46], [7.1, 46]], kind="LineString")),
    "no geometry": points({"type": "Feature", "geometry": None, "properties": {}}),
    "geometry is text": points({"type": "Feature", "geometry": "POINT(7 46)", "properties": {}}),
    "one number": points(point([7.5])),
    "words": points(point(["7.5", "north"])),
    "latitude 91": points(point([7.5, 91])),
    "swapped": points(point([46.501, 7.501])),
    "metres": points(point([2_600_000, 1_200_000])),
    "other crs": points(point(), crs={"type": "name", "properties": {"name": "EPSG:2056"}}),
    "two places": points(point([[7.5, 46.5], [7.6, 46.5]], kind="MultiPoint")),
    "twice the name": points(point(), point()),
    "properties a list": points({**point(), "properties": []}),
    "demand": points(point(demand_mbit="lots")),
    "feature a text": points("Anna"),
    "deep": "[" * 100_000,
    "huge number": '{"type": ' + "9" * 5000 + "}",
    "web page": "<!doctype html><html></html>",
}
BAD_KMZ = {
    **{name: zipped({"doc.kml": content}) for name, (content, _) in BAD_KML.items() if content},
    "two documents": zipped({"a.kml": kml(), "b.kml": kml()}),
    "no document": zipped({"a.txt": "x"}),
    "cut off": zipped({"doc.kml": kml(placemark())})[:-9],
    "bomb": zipped({"doc.kml": b" " * 3_000_000}),
    "damaged": spoilt(zipped({"doc.kml": kml(placemark())})),
}
RING = [[7.51, 46.51], [7.52, 46.51], [7.52, 46.52], [7.51, 46.51]]


def zone(coordinates=None, kind="Polygon", **more):
    geometry = {"type": kind, "coordinates": [RING] if coordinates is None else coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": {}, **more}


def kml_zone(corners):
    ring = f"<LinearRing><coordinates>{corners}</coordinates></LinearRing>"
    return kml(placemark(f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"))


BAD_ZONES = {
    "empty.geojson": "",
    "cut off.geojson": points(zone())[:-4],
    "list.geojson": "[]",
    "nothing.geojson": points(),
    "only points.geojson": points(point()),
    "feature a text.geojson": points("zone"),
    "two corners.geojson": points(zone([[[7, 46], [7.1, 46]]])),
    "a corner of one number.geojson": points(zone([[[7.51], [7.52, 46.51], [7.52, 46.52]]])),
    "words.geojson": points(zone([[["a", "b"], [7.52, 46.51], [7.52, 46.52]]])),
    "ring a number.geojson": points(zone([7])),
    "latitude 91.geojson": points(zone([[[7.51, 91], [7.52, 46.51], [7.52, 46.52], [7.51, 91]]])),
    "metres.geojson": points(zone([[[2_600_000, 1_200_000], [2_600_100, 1_200_000], [2_600_000, 1_200_100]]])),
    "crossing itself.geojson": points(zone([[[7.5, 46.6], [7.6, 46.7], [7.6, 46.6], [7.5, 46.7], [7.5, 46.6]]])),
    "no area.geojson": points(zone([[[7.51, 46.51], [7.52, 46.51], [7.51, 46.51], [7.51, 46.51]]])),
    "over home.geojson": points(zone([[[7.49, 46.49], [7.51, 46.49], [7.51, 46.51], [7.49, 46.51], [7.49, 46.49]]])),
    "deep.geojson": "[" * 100_000,
    "csv.geojson": USERS,
    "web page.geojson": "<!doctype html><html></html>",
    "laughs.kml": LAUGHS + "<kml>&b;</kml>",
    "entity.kml": ENTITY + "<kml/>",
    "cut off.kml": kml_zone("7.51,46.51 7.52,46.51 7.52,46.52")[:-20],
    "words.kml": kml_zone("a,b c,d e,f"),
    "two corners.kml": kml_zone("7.51,46.51 7.52,46.51"),
    "no corners.kml": kml_zone(""),
    "only points.kml": kml(placemark()),
    "latin-1.kml": kml(placemark(name="Zürich")).encode("latin-1"),
    "gpx.gpx": gpx(wpt()),
    "sheet.xlsx": xlsx(TABLE),
    "other crs.geojson": points(zone(), crs={"type": "name", "properties": {"name": "EPSG:2056"}}),
    "collection.geojson": points(zone(), zone([], kind="GeometryCollection")),
    "link and zone.kml": kml_zone("7.51,46.51 7.52,46.51 7.52,46.52").replace("<Folder>", "<Folder><NetworkLink/>"),
    "network link.kml": kml("<NetworkLink><Link><href>http://example.org</href></Link></NetworkLink>"),
}
BAD_TOML = {
    "empty": "",
    "no users": HOME,
    "no home": 'users = "users.csv"\n',
    "cut off": 'users = "users.csv"\n[home',
    "open quote": 'users = "users.csv\n',
    "key twice": 'users = "users.csv"\nusers = "b.csv"\n' + HOME,
    "not toml": "users: users.csv\nhome: {}\n",
    "json": '{"users": "users.csv"}',
    "latin-1": ('# Zürich\nusers = "users.csv"\n' + HOME).encode("latin-1"),
    "utf-16": ('users = "users.csv"\n' + HOME).encode("utf-16"),
    "binary": bytes(range(256)),
    "users a number": "users = 3\n" + HOME,
    "users not there": 'users = "nobody.csv"\n' + HOME,
    "users a folder": 'users = "."\n' + HOME,
    "users a device": 'users = "/dev/zero"\n' + HOME,
    "users an address": 'users = "https://example.org/users.csv"\n' + HOME,
    "unknown key": 'users = "users.csv"\n' + HOME + "alt_m = 3\n",
    "unknown section": 'users = "users.csv"\n' + HOME + "[radar]\nx = 1\n",
    "latitude 91": 'users = "users.csv"\n' + HOME.replace("46.5", "91"),
    "nan": 'users = "users.csv"\n' + HOME.replace("46.5", "nan"),
    "text for a number": 'users = "users.csv"\n' + HOME.replace("46.5", '"46.5"'),
    "true for a number": 'users = "users.csv"\n' + HOME.replace("46.5", "true"),
    "home a list": 'users = "users.csv"\nhome = [46.5, 7.5]\n',
    "speed 0": 'users = "users.csv"\n' + HOME + "[vehicle]\nspeed_m_s = 0\n",
    "unknown autopilot": 'users = "users.csv"\n' + HOME + '[vehicle]\nautopilot = "dji"\n',
    "unknown planner": 'users = "users.csv"\n' + HOME + '[planner]\nname = "fastest"\n',
    "nobody in reach": 'users = "users.csv"\n' + HOME + "[radio]\nsnr_threshold_db = 90\n",
    "zones not there": 'users = "users.csv"\n' + HOME + '[[no_fly]]\nfile = "zones.geojson"\n',
}
BAD_WAYPOINTS = {
    "empty": lambda lines: [],
    "no head": lambda lines: lines[1:],
    "other head": lambda lines: ["QGC WPL 300", *lines[1:]],
    "only a head": lambda lines: lines[:1],
    "only home": lambda lines: lines[:2],
    "not a number": lambda lines: [*lines[:3], lines[3].replace("46.", "north"), *lines[4:]],
    "too few cells": lambda lines: [*lines[:3], lines[3].rsplit("\t", 1)[0], *lines[4:]],
    "too many cells": lambda lines: [*lines[:3], lines[3] + "\t1\t2", *lines[4:]],
    "item left out": lambda lines: [*lines[:3], *lines[4:]],
    "item twice": lambda lines: [*lines[:4], *lines[3:]],
    "commas": lambda lines: [lines[0], *(line.replace("\t", ",") for line in lines[1:])],
    "latitude 91": lambda lines: with_cell(lines, 3, 8, "91"),
    "longitude 181": lambda lines: with_cell(lines, 3, 9, "181"),
    "altitude": lambda lines: with_cell(lines, 3, 10, "1e9"),
    "nan": lambda lines: with_cell(lines, 3, 8, "nan"),
    "infinite": lambda lines: with_cell(lines, 3, 10, "inf"),
    "unknown command": lambda lines: with_cell(lines, 3, 3, "112"),
    "local frame": lambda lines: with_cell(lines, 3, 2, "1"),
    "no frame": lambda lines: with_cell(lines, 3, 2, "77"),
    "command a word": lambda lines: with_cell(lines, 3, 3, "waypoint"),
    "negative hold": lambda lines: with_cell(lines, 4, 4, "-5"),
    "text after": lambda lines: [*lines, "the end"],
    "web page": lambda lines: ["<!doctype html>", "<html></html>"],
}


def with_cell(lines, row, column, value):
    cells = lines[row].split("\t")
    cells[column] = value
    return [*lines[:row], "\t".join(cells), *lines[row + 1 :]]


BAD_TIFF = {
    "no datum": {"crs": "EPSG:4326"},
    "ellipsoid": {"crs": "EPSG:4979"},
    "feet by its keys": {"crs": "EPSG:4326+6360"},
    "feet by its unit": {"units": "ft"},
    "three bands": {"count": 3},
    "no coordinate system": {"crs": None},
    "elsewhere": {"lat": 10.0},
    "other side of the world": {"lon": -172.5},
    "complex numbers": {"dtype": "complex64", "nodata": None},
    "all without a height": {"heights": np.full((360, 360), -9999.0)},
    "all too high": {"heights": np.full((360, 360), 9500.0)},
    "all not a number": {"heights": np.full((360, 360), np.nan)},
    "home 100 m higher": {"heights": np.full((360, 360), 700.0)},
    "home 47 m lower": {"heights": np.full((360, 360), 553.0)},
    "hole at the user": {"heights": np.where(np.hypot(*np.mgrid[-180:180, -180:180]) < 20, -9999.0, 600.0)},
    "only a corner": {"half": 0.001, "lat": 46.52},
}
BAD_TIFF_BYTES = {
    "empty": lambda data: b"",
    "cut in half": lambda data: data[: len(data) // 2],
    "only a head": lambda data: data[:8],
    "text": lambda data: b"heights: 1 2 3",
    "virtual": lambda data: b"<VRTDataset rasterXSize='1' rasterYSize='1'/>",
    "web page": lambda data: b"<!doctype html><html></html>",
    "zipped": lambda data: zipped({"a.tif": data}),
    "noise behind its head": lambda data: data[:8] + bytes(range(256)) * 8,
}
BAD_HGT = {
    "empty.hgt": b"",
    "hill.hgt": b"\0\0" * 1201**2,
    "N46.hgt": b"\0\0" * 1201**2,
    "46N007E.hgt": b"\0\0" * 1201**2,
    "N46E7.hgt": b"\0\0" * 1201**2,
    "E007N46.hgt": b"\0\0" * 1201**2,
    "N46E007.hgt": b"",
    "N46E007 short.hgt": b"\0\0" * 1201**2 + b"\0",
    "N46E007 cut.hgt": b"\0\0" * 1201 * 600,
    "N46E007 one row.hgt": b"\0\0" * 1201,
    "N46E007 odd.hgt": b"\0" * 1201**2,
    "N46E007 1200.hgt": b"\0\0" * 1200**2,
    "N46E007 3600.hgt": b"\0\0" * 3600,
    "N46E007 text.hgt": b"600 600 600\n" * 100,
    "N46E007 web page.hgt": b"<!doctype html><html></html>",
    "N46E007 zipped.hgt": zipped({"N46E007.hgt": b"\0" * 1000}),
    "N46E007 gz.hgt": b"\x1f\x8b\x08" + b"\0" * 1000,
    "N46E007_void.hgt": b"\x80\x00" * 1201**2,
    "N46E007_sea.hgt": b"\0\0" * 1201**2,
    "N46E007_high.hgt": b"\x26\x00" * 1201**2,
    "N10E007.hgt": b"\x02\x58" * 1201**2,
    "S46W007.hgt": b"\x02\x58" * 1201**2,
}


def without(key):
    return lambda data: {name: value for name, value in data.items() if name != key}


def changed(value, *keys):
    """What puts a value somewhere into a document."""
    def change(data):
        data = json.loads(json.dumps(data))
        inner = data
        for key in keys[:-1]:
            inner = inner[key]
        inner[keys[-1]] = value
        return data
    return change


BAD_PLAN = {
    "no mission": without("mission"),
    "no fence": without("geoFence"),
    "file type": changed("Mission", "fileType"),
    "version": changed(7, "version"),
    "mission a list": changed([], "mission"),
    "items a table": changed({}, "mission", "items"),
    "no items": changed([], "mission", "items"),
    "item a number": changed(3, "mission", "items", 1),
    "firmware": changed(4, "mission", "firmwareType"),
    "vehicle": changed("quad", "mission", "vehicleType"),
    "home of two": changed([46.5, 7.5], "mission", "plannedHomePosition"),
    "home at 91": changed([91, 7.5, 600], "mission", "plannedHomePosition"),
    "command": changed(112, "mission", "items", 1, "command"),
    "command a text": changed("16", "mission", "items", 1, "command"),
    "frame": changed(10, "mission", "items", 2, "frame"),
    "params of six": changed([0] * 6, "mission", "items", 2, "params"),
    "params a text": changed("0", "mission", "items", 2, "params"),
    "no latitude": changed(None, "mission", "items", 2, "params", 4),
    "latitude 91": changed(91, "mission", "items", 2, "params", 4),
    "survey": changed("ComplexItem", "mission", "items", 2, "type"),
    "negative hold": changed(-5, "mission", "items", 3, "params", 0),
    "fence version": changed(1, "geoFence", "version"),
    "id twice": changed(1, "mission", "items", 2, "doJumpId"),
    "empty": lambda data: None,
}
BAD_STORED = {
    "format": changed("plan", "format"),
    "version": changed(99, "version"),
    "no stops": without("stops"),
    "stops a table": changed({}, "stops"),
    "stops empty": changed([], "stops"),
    "stop a number": changed(1, "stops", 0),
    "latitude 91": changed(91.0, "stops", 0, "lat_deg"),
    "hold a text": changed("8", "stops", 0, "hold_s"),
    "negative hold": changed(-1.0, "stops", 0, "hold_s"),
    "no users": without("users"),
    "users empty": changed([], "users"),
    "user without a name": changed(None, "users", 0, "name"),
    "user at no stop": changed(99, "users", 0, "stop"),
    "via": changed("radio", "users", 0, "via"),
    "mate unknown": changed("Nobody", "users", 0, "mate"),
    "names twice": changed("Ben", "users", 0, "name"),
    "stop items": changed([], "stop_items"),
    "items backwards": changed({"first": 9, "hold": 2}, "stop_items", 0),
    "autopilot": changed("dji", "autopilot"),
    "scenario": without("scenario"),
    "home": changed({}, "scenario", "home"),
    "radio a text": changed("strong", "scenario", "radio"),
    "mission time": changed(-3.0, "mission_s"),
    "bound": changed({"objective": "cost", "plan": 1.0, "bound": 1.0}, "bound"),
    "part": changed({"kind": "swarm", "number": 0, "of": 1}, "part"),
    "empty": lambda data: None,
}
# fmt: on


def users_cases():
    for ending, cases in (
        ("csv", BAD_CSV),
        ("tsv", BAD_TSV),
        ("xlsx", {name: content for name, (content, _) in BAD_XLSX.items()}),
        ("geojson", BAD_GEOJSON),
        ("kml", {name: content for name, (content, _) in BAD_KML.items()}),
        ("kmz", BAD_KMZ),
        ("gpx", {name: content for name, (content, _) in BAD_GPX.items()}),
    ):
        for name, content in cases.items():
            yield pytest.param(f"users.{ending}", content, id=f"{ending}, {name}")


def write(path: Path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def refused(words, folder, capsys, named):
    """Run a command that must refuse its input, and return its sentences."""
    before = sorted(folder.rglob("*"))
    capsys.readouterr()
    code = run([str(word) for word in words])
    out, err = capsys.readouterr()
    assert code == 2, (out, err)
    assert out == ""
    assert sorted(folder.rglob("*")) == before
    assert "Traceback" not in err
    lines = [line for line in err.splitlines() if not line.startswith("hint:")]
    assert lines
    for line in lines:
        assert line.startswith(("error: ", "warning: ")), err
        assert line.isprintable()
        assert len(line) < 700
    errors = [line for line in lines if line.startswith("error: ")]
    assert any(named in line for line in errors), err
    return errors


@pytest.mark.parametrize(("name", "content"), list(users_cases()))
def test_users_that_cannot_be_read_are_refused(name, content, tmp_path, capsys):
    write(tmp_path / name, content)
    (tmp_path / "scenario.toml").write_text(f'users = "{name}"\n{HOME}')
    refused(["plan", tmp_path / "scenario.toml", "-o", tmp_path / "x.plan"], tmp_path, capsys, name)


@pytest.mark.parametrize("name", BAD_ZONES)
def test_zones_that_cannot_be_read_are_refused(name, tmp_path, capsys):
    write(tmp_path / name, BAD_ZONES[name])
    (tmp_path / "users.csv").write_text(USERS)
    (tmp_path / "s.toml").write_text(f'users = "users.csv"\n{HOME}[[no_fly]]\nfile = "{name}"\n')
    named = "home" if name.startswith("over home") else name
    refused(["plan", tmp_path / "s.toml", "-o", tmp_path / "x.plan"], tmp_path, capsys, named)


@pytest.mark.parametrize("name", BAD_TOML)
def test_a_scenario_that_cannot_be_read_is_refused(name, tmp_path, capsys):
    (tmp_path / "users.csv").write_text(USERS)
    write(tmp_path / "scenario.toml", BAD_TOML[name])
    named = {"users a device": "/dev/zero", "nobody in reach": "[vehicle] altitude_m"}.get(
        name, str(tmp_path)
    )
    refused(["plan", tmp_path / "scenario.toml", "-o", tmp_path / "x.plan"], tmp_path, capsys, named)


def terrain_refused(file, folder, capsys):
    (folder / "users.csv").write_text(USERS)
    (folder / "s.toml").write_text(f'users = "users.csv"\n{HOME}[terrain]\nfile = "{file}"\n')
    refused(["plan", folder / "s.toml", "-o", folder / "x.plan"], folder, capsys, "")


@pytest.mark.parametrize("name", BAD_TIFF)
def test_a_geotiff_that_cannot_be_used_is_refused(name, tmp_path, capsys):
    write_tiff(tmp_path / "a.tif", **BAD_TIFF[name])
    terrain_refused("a.tif", tmp_path, capsys)


@pytest.mark.parametrize("name", BAD_TIFF_BYTES)
def test_a_damaged_geotiff_is_refused(name, tmp_path, capsys):
    write_tiff(tmp_path / "a.tif", heights=np.full((360, 360), 600.0))
    (tmp_path / "a.tif").write_bytes(BAD_TIFF_BYTES[name]((tmp_path / "a.tif").read_bytes()))
    terrain_refused("a.tif", tmp_path, capsys)


@pytest.mark.parametrize("name", BAD_HGT)
def test_an_hgt_that_cannot_be_used_is_refused(name, tmp_path, capsys):
    (tmp_path / name).write_bytes(BAD_HGT[name])
    terrain_refused(name, tmp_path, capsys)


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A good mission in both formats, and the plan beside it."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "users.csv").write_text(USERS)
    (folder / "scenario.toml").write_text(f'users = "users.csv"\n{HOME}')
    words = ["plan", folder / "scenario.toml", "-o", folder / "x.plan", "-o", folder / "x.waypoints"]
    assert run([str(word) for word in words]) == 0
    return folder


@pytest.mark.parametrize("name", BAD_WAYPOINTS)
def test_a_waypoints_file_that_cannot_be_read_is_refused(name, planned, tmp_path, capsys):
    lines = BAD_WAYPOINTS[name]((planned / "x.waypoints").read_text().splitlines())
    (tmp_path / "x.waypoints").write_text("\n".join(lines) + "\n" if lines else "")
    words = ["export", tmp_path / "x.waypoints", "-o", tmp_path / "y.plan", "--autopilot", "ardupilot"]
    refused(words, tmp_path, capsys, "x.waypoints")


@pytest.mark.parametrize("name", BAD_PLAN)
def test_a_plan_file_that_cannot_be_read_is_refused(name, planned, tmp_path, capsys):
    data = BAD_PLAN[name](json.loads((planned / "x.plan").read_text()))
    (tmp_path / "x.plan").write_text("" if data is None else json.dumps(data))
    refused(["export", tmp_path / "x.plan", "-o", tmp_path / "y.waypoints"], tmp_path, capsys, "x.plan")


@pytest.mark.parametrize("name", BAD_STORED)
def test_a_plan_beside_a_mission_that_cannot_be_read_is_refused(name, planned, tmp_path, capsys):
    (tmp_path / "x.plan").write_bytes((planned / "x.plan").read_bytes())
    data = BAD_STORED[name](json.loads((planned / "x.mavplan.json").read_text()))
    (tmp_path / "x.mavplan.json").write_text("" if data is None else json.dumps(data))
    refused(["report", tmp_path / "x.plan", "-o", tmp_path / "x.html"], tmp_path, capsys, "x.mavplan.json")


def test_there_are_twenty_for_each_reader():
    counts = {
        name: len(cases)
        for name, cases in {
            "csv": BAD_CSV, "tsv": BAD_TSV, "xlsx": BAD_XLSX, "geojson": BAD_GEOJSON, "kml": BAD_KML, "kmz": BAD_KMZ,
            "gpx": BAD_GPX, "toml": BAD_TOML, "zones": BAD_ZONES, "waypoints": BAD_WAYPOINTS, "plan": BAD_PLAN,
            "mavplan.json": BAD_STORED, "tiff": {**BAD_TIFF, **BAD_TIFF_BYTES}, "hgt": BAD_HGT,
        }.items()
    }  # fmt: skip
    assert min(counts.values()) >= 20, counts
