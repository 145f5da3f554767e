"""``mavplan plan`` for very many users: the same files by one process and by two, a short table, and plain warnings."""

import json

import numpy as np
import pytest

from mavplan.geo import LocalPlane
from mavplan.planners import wide_path

HOME = (47.5, 19.0)


@pytest.fixture
def city(tmp_path, monkeypatch):
    """A scenario of 1,200 users, planned in regions with little effort."""
    monkeypatch.setattr(wide_path, "LEAST_ATTEMPTS", 0)
    monkeypatch.setattr(wide_path, "EFFORTS", (0.1, 0.1, 0.1))
    xy_m = np.random.default_rng(0).uniform(-6000, 6000, (1200, 2))
    lat_deg, lon_deg = LocalPlane(*HOME).to_lat_lon_deg(xy_m)
    rows = [f"u{n},{lat:.7f},{lon:.7f}" for n, (lat, lon) in enumerate(zip(lat_deg, lon_deg, strict=True))]
    (tmp_path / "users.csv").write_text("\n".join(["name,lat_deg,lon_deg", *rows]) + "\n")
    path = tmp_path / "city.toml"
    path.write_text(
        f'users = "users.csv"\n[home]\nlat_deg = {HOME[0]}\nlon_deg = {HOME[1]}\nalt_amsl_m = 100\n'
        '[radio]\nnoise_dbm = -95.0\n[vehicle]\nend = "stay"\n[planner]\nname = "length"\n'
    )
    return path


def test_one_process_and_two_write_the_same_files(mavplan, city, tmp_path):
    for jobs in (1, 2):
        ran = mavplan("plan", city, "--jobs", jobs, "-o", f"{jobs}.plan", "--json")
        assert ran.code == 0, ran.err
    assert (tmp_path / "1.plan").read_bytes() == (tmp_path / "2.plan").read_bytes()
    document = json.loads((tmp_path / "1.mavplan.json").read_text())
    assert document["bound"] is None
    assert len(document["users"]) == 1200
    assert all(user["stop"] >= 0 for user in document["users"])


def test_a_long_table_shows_its_first_and_last_rows_and_warnings_say_what_to_do(mavplan, city, tmp_path):
    ran = mavplan("plan", city, "--jobs", 1, "-o", "x.plan")
    assert ran.code == 0, ran.err
    stops = len(json.loads((tmp_path / "x.mavplan.json").read_text())["stops"])
    assert stops > 400
    numbers = [int(line.split()[0]) for line in ran.out.splitlines() if line[:5].strip().isdigit()]
    assert numbers == [*range(1, 201), *range(stops - 199, stops + 1)]
    assert "…" in ran.out
    assert "region by region" in ran.err
    assert "--hover hold makes one item of a stop, --vehicles and --sorties several missions" in ran.err


def test_an_address_that_is_none_is_told_before_anything_is_planned(mavplan, city, tmp_path):
    pytest.importorskip("distributed", reason="a cluster needs Dask distributed (extra 'study')")
    ran = mavplan("plan", city, "--cluster", "nowhere", "-o", "x.plan")
    assert ran.code == 2
    assert "allowed is 'local' or the address" in ran.err
    assert not (tmp_path / "x.plan").exists()
