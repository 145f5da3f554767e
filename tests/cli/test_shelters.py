"""A city's own file as it is: 15 emergency shelters, demand from their capacity, to both mock vehicles."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from pyproj import Geod

SHELTERS = Path(__file__).resolve().parents[2].parent / "shared/data/cambridge_emergency_shelters.geojson"

pytestmark = pytest.mark.skipif(not SHELTERS.is_file(), reason=f"{SHELTERS} is not on this machine")

SCENARIO = f"""
users = "{SHELTERS}"
[home]
lat_deg = 42.3736
lon_deg = -71.1097
alt_amsl_m = 10.0
[columns]
name = "Name"
demand_mbit = "Capacity"
"""


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_every_shelter_is_served_and_the_mission_is_verified(mavplan, tmp_path, firmware):
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    ran = mavplan("plan", "scenario.toml", "--autopilot", firmware, "-o", "city.plan", "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    features = json.loads(SHELTERS.read_text())["features"]
    assert len(found["users"]) == len(features) == 15
    geod = Geod(ellps="WGS84")
    for user, feature in zip(found["users"], features, strict=True):
        lon_deg, lat_deg = feature["geometry"]["coordinates"][:2]
        stop = found["stops"][user["stop"]]
        # One of them has no capacity in the file: the default of 10 Mbit.
        assert user["demand_mbit"] == float(feature["properties"].get("Capacity") or 10)
        assert geod.inv(lon_deg, lat_deg, stop["lon_deg"], stop["lat_deg"])[2] <= found["radius_m"] + 1.0
    mock = [sys.executable, "-m", "sitl_mock", "--firmware", firmware, "--conn", "tcpin:127.0.0.1:0"]
    with subprocess.Popen(
        [*mock, "--home=42.3736,-71.1097,10"], stdout=subprocess.PIPE, text=True
    ) as vehicle:
        try:
            port = re.search(r":(\d+)\s*$", vehicle.stdout.readline())[1]
            uploaded = mavplan("upload", "city.plan", "--conn", f"tcp:127.0.0.1:{port}")
            assert uploaded.code == 0, uploaded.err
            assert "stored and verified" in uploaded.out
            fetched = mavplan("download", "--conn", f"tcp:127.0.0.1:{port}", "-o", "back.plan")
            assert fetched.code == 0, fetched.err
        finally:
            vehicle.terminate()
    assert (tmp_path / "back.plan").is_file()
