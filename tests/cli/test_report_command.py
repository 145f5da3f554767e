"""``mavplan report``: of one flight or several, and what it says where something is left out."""

import shutil

import pytest

from mavplan.cli import run
from tests.test_gallery import GALLERY

SMALL = """users = "users.csv"
[home]
lat_deg = {lat}
lon_deg = 7.0
alt_amsl_m = 600.0
"""


def planned(folder, name, lat=46.5, more=""):
    (folder / "users.csv").write_text(f"name,lat_deg,lon_deg\na,{lat + 0.004},7.0\nb,{lat},7.01\n")
    (folder / f"{name}.toml").write_text(SMALL.format(lat=lat) + more)
    return run(["plan", str(folder / f"{name}.toml"), "-o", str(folder / f"{name}.plan")])


def test_two_flights_of_two_places_are_refused_and_nothing_is_written(tmp_path, capsys):
    assert planned(tmp_path, "north") == planned(tmp_path, "south", lat=44.0) == 0
    capsys.readouterr()
    assert run(["report", str(tmp_path / "north.plan"), str(tmp_path / "south.plan")]) == 2
    said = capsys.readouterr().err
    assert "begins 278 km away from north.plan: make a page of its own for it" in said
    assert not list(tmp_path.glob("*.html"))


def test_several_without_a_common_name_are_called_flights(tmp_path):
    assert planned(tmp_path, "north") == planned(tmp_path, "south") == 0
    assert run(["report", str(tmp_path / "north.plan"), str(tmp_path / "south.plan")]) == 0
    assert "<h1>flights</h1>" in (tmp_path / "flights.html").read_text("utf-8")


@pytest.fixture(scope="module")
def over_hills(tmp_path_factory):
    rasterio = pytest.importorskip("rasterio")
    import numpy as np

    folder = tmp_path_factory.mktemp("hills")
    options = {"driver": "GTiff", "width": 200, "height": 200, "count": 1, "dtype": "float32"}
    place = {"crs": "EPSG:4326", "transform": rasterio.Affine(0.0003, 0.0, 6.97, 0.0, -0.0003, 46.53)}
    with rasterio.open(folder / "hill.tif", "w", **options, **place) as file:
        file.write(np.full((200, 200), 600, dtype="float32"), 1)
    assert planned(folder, "hills", more='[terrain]\nfile = "hill.tif"\ndatum = "EGM96"\n') == 0
    return folder


def test_over_terrain_the_other_planners_are_compared_over_the_same_ground(over_hills, capsys):
    assert run(["report", str(over_hills / "hills.plan")]) == 0
    assert "left out" not in capsys.readouterr().err
    assert "Beside the other planners" in (over_hills / "hills.html").read_text("utf-8")


def test_without_its_terrain_the_report_says_why_it_compares_nothing(over_hills, tmp_path, capsys):
    for name in ("hills.plan", "hills.mavplan.json"):
        shutil.copy(over_hills / name, tmp_path / name)
    assert run(["report", str(tmp_path / "hills.plan")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "--compare: the other planners are left out of the page" in said
    assert "hill.tif" in said
    assert "Beside the other planners" not in (tmp_path / "hills.html").read_text("utf-8")


def test_warnings_of_the_plan_are_on_the_page(tmp_path):
    scenario = tmp_path / "valley.toml"
    text = (
        (GALLERY / "valley/scenario.toml")
        .read_text("utf-8")
        .replace("endurance_s = 1800.0", "endurance_s = 1400.0")
    )
    scenario.write_text(text.replace('"users.csv"', f'"{GALLERY / "valley/users.csv"}"'))
    assert run(["plan", str(scenario), "-o", str(tmp_path / "valley.plan")]) == 0
    assert run(["report", str(tmp_path / "valley.plan"), "--no-compare"]) == 0
    page = (tmp_path / "valley.html").read_text("utf-8")
    assert "<li>[vehicle] endurance_s: the mission takes" in page
