"""Terrain files: heights against GDAL's own sampling, several tiles as one, and what is refused, in one sentence."""

import re

import numpy as np
import pytest
import rasterio
from affine import Affine

from mavplan.errors import InputError
from mavplan.geo import LocalPlane
from mavplan.scenario import load_scenario
from mavplan.scenario.report import Report
from mavplan.scenario.sections import TerrainOptions
from mavplan.terrain.read import read_terrain

LAT, LON = 46.5, 7.5
PLANE = LocalPlane(LAT, LON)
BOX_M = (-1500.0, -1500.0, 1500.0, 1500.0)


def from_origin(west, north, column, row):
    return Affine(column, 0.0, west, 0.0, -row, north)


def hills(lat_deg, lon_deg):
    return 800 + 150 * np.sin(np.asarray(lon_deg) * 700) * np.cos(np.asarray(lat_deg) * 900)


def write_tiff(
    path, *, crs="EPSG:4326+5773", lat=LAT, lon=LON, half=0.05, step=1 / 3600, heights=None, **profile
):
    """A GeoTIFF round a place with the heights of `hills`, or those given."""
    size = round(2 * half / step)
    columns, rows = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    if heights is None:
        heights = hills(lat + half - rows * step, lon - half + columns * step)
    heights = np.asarray(heights)
    profile = {"dtype": "float32", "nodata": -9999.0, "compress": "deflate", **profile}
    count = profile.pop("count", 1)
    units = profile.pop("units", None)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        height=heights.shape[0],
        width=heights.shape[1],
        count=count,
        crs=crs,
        transform=from_origin(lon - half, lat + half, step, step),
        **profile,
    ) as target:
        for band in range(1, count + 1):
            target.write(heights.astype(profile["dtype"]), band)
        if units:
            target.set_band_unit(1, units)
    return path


def read(tmp_path, *names, datum=None, box_m=BOX_M):
    report = Report()
    file = names[0] if len(names) == 1 else list(names)
    terrain = read_terrain(
        TerrainOptions(file=file, datum=datum), tmp_path, PLANE, box_m, "[terrain]", report
    )
    return terrain, report.problems()


def refused(tmp_path, *names, datum=None, box_m=BOX_M):
    """The one problem of files that cannot be used."""
    terrain, (problem,) = read(tmp_path, *names, datum=datum, box_m=box_m)
    assert terrain is None
    assert "\n" not in problem.message
    return problem


def test_heights_of_a_geotiff_are_those_that_gdal_finds_there(tmp_path):
    """Its own bilinear resampling onto a finer grid is the authority."""
    from rasterio.warp import Resampling, reproject

    write_tiff(tmp_path / "a.tif")
    terrain, problems = read(tmp_path, "a.tif")
    assert problems == ()
    assert terrain.datum == "EGM96 height"
    assert terrain.pitch_m == pytest.approx(21.3, abs=0.2)
    fine = np.zeros((200, 200), dtype=np.float32)
    grid = from_origin(LON - 0.01, LAT + 0.01, 0.0001, 0.0001)
    with rasterio.open(tmp_path / "a.tif") as source:
        reproject(
            source.read(1),
            fine,
            src_transform=source.transform,
            src_crs="EPSG:4326",
            dst_transform=grid,
            dst_crs="EPSG:4326",
            resampling=Resampling.bilinear,
            tolerance=0,
        )
    columns, rows = np.meshgrid(np.arange(200) + 0.5, np.arange(200) + 0.5)
    places = PLANE.to_xy_m((LAT + 0.01 - rows * 0.0001).ravel(), (LON - 0.01 + columns * 0.0001).ravel())
    inside = np.abs(places).max(axis=1) < 1400
    assert inside.sum() > 30_000
    assert terrain.height_m(places[inside]) == pytest.approx(fine.ravel()[inside], abs=0.05)


def test_a_projected_raster_gives_the_heights_of_the_same_places(tmp_path):
    """Swiss and UTM metres; the ground is a plane, which bilinear heights have exactly."""
    from pyproj import Transformer

    to_utm = Transformer.from_crs(4326, 32632, always_xy=True)
    east, north = to_utm.transform(LON, LAT)
    west, top = round(east) - 4000, round(north) + 4000
    columns, rows = np.meshgrid(np.arange(400) + 0.5, np.arange(400) + 0.5)
    plane = 500 + 0.02 * (columns * 20) + 0.05 * (rows * 20)
    with rasterio.open(
        tmp_path / "u.tif", "w", driver="GTiff", width=400, height=400, count=1, dtype="float32",
        crs="EPSG:32632", transform=from_origin(west, top, 20, 20),
    ) as target:  # fmt: skip
        target.write(plane.astype("float32"), 1)
    terrain, problems = read(tmp_path, "u.tif", datum="EGM2008")
    assert problems == ()
    assert terrain.datum == "EGM2008"
    lat, lon = LAT + np.array([0, 0.003, -0.009]), LON + np.array([0, 0.011, -0.004])
    x, y = to_utm.transform(lon, lat)
    expected = 500 + 0.02 * (np.array(x) - west) + 0.05 * (top - np.array(y))
    assert terrain.height_m(PLANE.to_xy_m(lat, lon)) == pytest.approx(expected, abs=0.01)


def write_hgt(path, lat, lon, voids=()):
    side = np.arange(1201) / 1200
    heights = hills(lat + 1 - side[:, None], lon + side[None, :]).round().astype(">i2")
    for row, column in voids:
        heights[row, column] = -32768
    path.write_bytes(heights.tobytes())


def test_srtm_tiles_are_egm96_and_several_are_one_ground(tmp_path):
    plane = LocalPlane(46.5, 7.999)
    for lon in (7, 8):
        write_hgt(tmp_path / f"N46E00{lon}.hgt", 46, lon)
    report = Report()
    options = TerrainOptions(file=["N46E007.hgt", "N46E008.hgt"])
    terrain = read_terrain(options, tmp_path, plane, BOX_M, "[terrain]", report)
    assert report.problems() == ()
    assert terrain.datum == "EGM96"
    lat, lon = 46.5 + np.array([0, 6, -5]) / 1200, np.array([7.99, 8.0, 8.01])
    assert terrain.height_m(plane.to_xy_m(lat, lon)) == pytest.approx(hills(lat, lon).round(), abs=0.1)
    assert np.isfinite(terrain.under(np.array([-1400.0, 30.0]), np.array([1400.0, -500.0])).top_m).all()


def test_tiles_that_do_not_overlap_leave_no_seam(tmp_path):
    """Cells as areas: the middles of the last column and the next first one are a cell apart, in two files."""
    write_tiff(tmp_path / "w.tif", lon=LON - 0.05)
    write_tiff(tmp_path / "e.tif", lon=LON + 0.05)
    terrain, problems = read(tmp_path, "w.tif", "e.tif")
    assert problems == ()
    assert np.isfinite(terrain.under(np.array([-1400.0, 3.0]), np.array([1400.0, 3.0])).top_m).all()
    alone, _ = read(tmp_path, "w.tif")
    assert np.isnan(alone.height_m(np.array([[900.0, 0.0]]))).all()


def test_cells_without_a_height_are_not_known(tmp_path):
    heights = np.full((360, 360), 700.0)
    heights[180, 180], heights[170, 170], heights[190, 190] = -9999.0, -32768.0, np.nan
    write_tiff(tmp_path / "a.tif", heights=heights)
    terrain, _ = read(tmp_path, "a.tif")
    for row in (170, 180, 190):
        lat, lon = LAT + 0.05 - (row + 0.5) / 3600, LON - 0.05 + (row + 0.5) / 3600
        assert np.isnan(terrain.height_m(PLANE.to_xy_m(lat, lon)))[0]
    assert np.isfinite(terrain.height_m(PLANE.to_xy_m(LAT + 0.005, LON + 0.007)))[0]


@pytest.mark.parametrize(
    "name",
    [
        "/vsicurl/http://a.b/c.tif",
        "https://a.b/c.tif",
        "s3://a/b.tif",
        "/vsizip/a.zip/b.tif",
        "zip://a.zip!b.tif",
        "",
    ],
)
def test_nothing_is_fetched(tmp_path, name):
    assert refused(tmp_path, name).code == "not-a-file"


def test_files_that_cannot_be_used_are_refused_in_one_sentence(tmp_path):
    write_tiff(tmp_path / "no_datum.tif", crs="EPSG:4326")
    write_tiff(tmp_path / "ellipsoid.tif", crs="EPSG:4979")
    write_tiff(tmp_path / "feet.tif", crs="EPSG:4326+6360")
    write_tiff(tmp_path / "ft.tif", units="ft")
    write_tiff(tmp_path / "egm96.tif")
    write_tiff(tmp_path / "bands.tif", count=3)
    write_tiff(tmp_path / "nowhere.tif", crs=None)
    write_tiff(tmp_path / "away.tif", lat=10.0)
    write_tiff(tmp_path / "coarse.tif", lon=LON + 0.1, step=1 / 1800)
    write_tiff(tmp_path / "shifted.tif", lon=LON + 0.05 + 0.4 / 3600)
    (tmp_path / "text.tif").write_text("no tiff")
    (tmp_path / "N46E007.hgt").write_bytes(b"\0" * 1000)
    write_hgt(tmp_path / "hill.hgt", 46, 7)
    whole = (tmp_path / "egm96.tif").read_bytes()
    (tmp_path / "cut.tif").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "vrt.tif").write_text("<VRTDataset rasterXSize='1' rasterYSize='1'/>")
    (tmp_path / "folder").mkdir()
    codes = {
        ("no_datum.tif",): "no-datum",
        ("ellipsoid.tif",): "ellipsoid-heights",
        ("feet.tif",): "unit",
        ("ft.tif",): "unit",
        ("bands.tif",): "bands",
        ("nowhere.tif",): "no-crs",
        ("away.tif",): "not-covered",
        ("egm96.tif", "coarse.tif"): "tiles",
        ("egm96.tif", "shifted.tif"): "tiles",
        ("text.tif",): "file-type",
        ("vrt.tif",): "file-type",
        ("N46E007.hgt",): "hgt-size",
        ("hill.hgt",): "hgt-name",
        ("cut.tif",): "unreadable",
        ("folder",): "unreadable",
        ("none.tif",): "missing-file",
    }
    assert {names: refused(tmp_path, *names).code for names in codes} == codes
    assert refused(tmp_path, "egm96.tif", datum="NAVD88").code == "other-datum"
    assert refused(tmp_path, "no_datum.tif", datum="WGS84").code == "datum"
    assert read(tmp_path, "egm96.tif", datum="EGM96")[0].datum == "EGM96 height"
    assert refused(tmp_path, "egm96.tif", box_m=(-90_000, -90_000, 90_000, 90_000)).code == "too-large"


SCENARIO = """users = "users.csv"
[home]
lat_deg = 46.5
lon_deg = 7.5
alt_amsl_m = {home_m}
[terrain]
file = {file}
"""


def load(tmp_path, home_m=700.0, file='"a.tif"', users="name,lat_deg,lon_deg\nanna,46.503,7.502\n", more=""):
    (tmp_path / "scenario.toml").write_text(SCENARIO.format(home_m=home_m, file=file) + more)
    (tmp_path / "users.csv").write_text(users)
    return load_scenario(tmp_path / "scenario.toml")


def test_a_scenario_reads_its_terrain_and_only_a_window_of_it(tmp_path):
    write_tiff(tmp_path / "a.tif", heights=np.full((360, 360), 701.0))
    scenario = load(tmp_path)
    assert scenario.terrain.height_m(scenario.users.xy_m) == pytest.approx([701.0])
    assert scenario.terrain.heights_m.size < 360 * 360 / 2
    assert load(tmp_path, file='["a.tif"]').terrain.label == "a.tif"


def test_a_home_that_is_not_on_its_ground_is_an_error_that_names_both_heights(tmp_path):
    write_tiff(tmp_path / "a.tif", heights=np.full((360, 360), 701.0))
    with pytest.raises(InputError) as found:
        load(tmp_path, home_m=748.0)
    (problem,) = found.value.problems
    assert problem.code == "home-height"
    assert re.search(r"found 748; a.tif has 701.0 m \(EGM96 height\)", problem.message)


VEHICLE = '\n[[vehicles]]\nname = "{}"\nlat_deg = {}\nlon_deg = {}\nalt_amsl_m = {}\n'


def test_homes_of_vehicles_must_lie_on_their_ground_too(tmp_path):
    write_tiff(tmp_path / "a.tif", heights=np.full((360, 360), 701.0))
    stand = VEHICLE.format("ann", 46.507, 7.508, 700) + VEHICLE.format("bob", 46.49, 7.49, 705)
    scenario = load(tmp_path, more=stand)
    assert [vehicle.name for vehicle in scenario.vehicles] == ["ann", "bob"]
    with pytest.raises(InputError) as found:
        load(
            tmp_path,
            more=VEHICLE.format("cat", 46.507, 7.508, 748) + VEHICLE.format("dan", 46.507, 7.64, 700),
        )
    assert [problem.code for problem in found.value.problems] == ["home-height", "not-covered"]
    for problem, name in zip(found.value.problems, ("cat", "dan"), strict=True):
        assert f"[[vehicles]] {name}" in problem.where


def test_what_a_section_asks_that_cannot_be_is_said(tmp_path):
    write_tiff(tmp_path / "a.tif", heights=np.full((360, 360), 701.0))
    with pytest.raises(InputError) as found:
        load(tmp_path, more="clearance_m = 120.0\n[service]\nin_flight = true\n")
    assert [problem.code for problem in found.value.problems] == ["clearance", "no-in-flight"]
    with pytest.raises(InputError) as found:
        load(tmp_path, users="name,lat_deg,lon_deg\nanna,46.503,7.502\nbea,46.503,7.62\n")
    assert [problem.code for problem in found.value.problems] == ["not-covered"]
    assert "bea" in found.value.problems[0].message
