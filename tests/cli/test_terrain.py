"""From a terrain file to files, a rehearsed flight and a report: hills between home and the users."""

import json

import numpy as np
import rasterio
from affine import Affine

HOME = (46.5, 7.5)
STEP = 1 / 3600


def write_valley(folder, autopilot, datum='datum = "EGM2008"\n'):
    """Two users, one behind a ridge of 160 m; the ground beyond lies below home."""
    size, half = 200, 100 * STEP
    columns = np.arange(size)[None, :] + 0.5
    east_m = (columns * STEP - half) * 76_700
    heights = 700 + 160 * np.exp(-(((east_m - 500) / 90) ** 2)) - 140 / (1 + np.exp(-(east_m - 700) / 40))
    transform = Affine(STEP, 0, HOME[1] - half, 0, -STEP, HOME[0] + half)
    with rasterio.open(
        folder / "h.tif", "w", driver="GTiff", width=size, height=size, count=1, dtype="float32",
        crs="EPSG:4326", transform=transform,
    ) as target:  # fmt: skip
        target.write(np.repeat(heights, size, axis=0).astype("float32"), 1)
    (folder / "s.toml").write_text(
        f'users = "u.csv"\n[home]\nlat_deg = {HOME[0]}\nlon_deg = {HOME[1]}\nalt_amsl_m = 700.0\n'
        f'[vehicle]\nautopilot = "{autopilot}"\n[terrain]\nfile = "h.tif"\n{datum}'
    )
    (folder / "u.csv").write_text(
        f"name,lat_deg,lon_deg\nanna,46.501,7.501\nbea,46.5,{7.5 + 1100 / 76_700}\n"
    )


def test_a_flight_over_a_ridge_is_planned_rehearsed_and_shown(mavplan, tmp_path):
    write_valley(tmp_path, "ardupilot")
    planned = mavplan("plan", "s.toml", "-o", "s.plan", "-o", "s.waypoints")
    assert planned.code == 0
    assert "alt m" in planned.out
    assert "m above the ground" in planned.out
    assert "a failsafe's return from there flies straight home" in " ".join(planned.err.split())
    plan = json.loads((tmp_path / "s.mavplan.json").read_text())
    lowest = min(stop["alt_rel_m"] for stop in plan["stops"])
    items = json.loads((tmp_path / "s.plan").read_text())["mission"]["items"]
    highest = max(item["params"][6] for item in items if item["command"] == 16)
    assert lowest < -20
    assert 185 < highest < 195
    assert {item["frame"] for item in items} == {2, 3}
    assert mavplan("check", "s.plan").code == 0
    assert mavplan("report", "s.plan").code == 0
    assert 'class="ground"' in (tmp_path / "s.html").read_text()


def test_a_terrain_that_does_not_say_its_datum_is_one_sentence_and_nothing_is_written(mavplan, tmp_path):
    write_valley(tmp_path, "px4", datum="")
    refused = mavplan("plan", "s.toml", "-o", "s.plan")
    assert refused.code == 2
    assert len(refused.err.strip().splitlines()) == 1
    assert "does not say what its heights are above" in refused.err
    assert not (tmp_path / "s.plan").exists()
