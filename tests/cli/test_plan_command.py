"""``mavplan plan``: the names that scripts rely on, and that table, JSON and files say the same."""

import itertools
import json
import math
import re

import pytest
from pyproj import Geod

from mavplan.formats import read_mission

GEOD = Geod(ellps="WGS84")


@pytest.fixture
def planned(mavplan, gallery, tmp_path):
    """The JSON object of an example, the plan file and the mission."""

    def run(name, *args):
        ran = mavplan(
            "plan", gallery / name / "scenario.toml", "-o", "x.plan", "-o", "x.waypoints", "--json", *args
        )
        assert ran.code == 0, ran.err
        document = json.loads((tmp_path / "x.mavplan.json").read_text())
        return json.loads(ran.out), document, read_mission(tmp_path / "x.plan")

    return run


def test_the_object_has_the_keys_that_scripts_rely_on(planned):
    found, document, _ = planned("valley")
    assert set(found) == {
        *(
            "planner",
            "radius_m",
            "length_m",
            "bound",
            "sum_rate_bit_s_hz",
            "joint_index",
            "flight_s",
            "hover_s",
            "mission_s",
            "stops",
            "users",
            "forecast",
            "warnings",
            "written",
        ),
    }
    assert set(found["stops"][0]) == {"lat_deg", "lon_deg", "alt_rel_m", "hold_s", "users"}
    assert set(found["users"][0]) == {
        *("name", "lat_deg", "lon_deg", "demand_mbit", "stop", "via", "mate", "rate_bit_s"),
    }
    assert {
        key: document[key] for key in found if key not in {"warnings", "written"}
    }.items() <= found.items()
    assert len(document["scenario_sha256"]) == 64


@pytest.mark.parametrize("name", ["valley", "hppp60", "coast"])
@pytest.mark.parametrize("planner", ["tloaik", "stoaik", "boaik", "length", "sbw"])
def test_every_user_is_within_reach_of_the_stop_that_the_mission_flies_to(planned, name, planner):
    found, document, mission = planned(name, "--planner", planner, "--clusters", "4")
    users = {user["name"]: user for user in found["users"]}
    for user in found["users"]:
        server = users[user["mate"]] if user["via"] == "d2d" else user
        items = document["stop_items"][user["stop"]]
        flown = mission.items[items["first"]]
        away_m = GEOD.inv(server["lon_deg"], server["lat_deg"], flown.lon_deg, flown.lat_deg)[2]
        assert away_m <= found["radius_m"] + 0.05
        assert user["rate_bit_s"] > 0
        assert server["via"] == "air"
        assert user["name"] in found["stops"][user["stop"]]["users"]


def test_the_sums_are_those_of_the_parts(planned):
    found, document, mission = planned("coast")
    assert found["hover_s"] == pytest.approx(sum(stop["hold_s"] for stop in found["stops"]))
    assert found["mission_s"] == pytest.approx(found["flight_s"] + found["hover_s"])
    home = mission.home
    places = [(home.lon_e7 / 1e7, home.lat_e7 / 1e7)] + [(s["lon_deg"], s["lat_deg"]) for s in found["stops"]]
    legs_m = [GEOD.inv(*a, *b)[2] for a, b in itertools.pairwise(places)]
    assert found["length_m"] == pytest.approx(sum(legs_m), abs=0.5)
    for stop, items in zip(found["stops"], document["stop_items"], strict=True):
        hold = mission.items[items["hold"]]
        assert hold.params[0] == stop["hold_s"]
        assert hold.alt_m == stop["alt_rel_m"]
    for asked, stop in zip(document["asked_hold_s"], found["stops"], strict=True):
        assert asked <= stop["hold_s"] + 1e-6


def test_what_each_user_receives_while_the_vehicle_hovers_meets_its_demand(planned):
    found, document, _ = planned("hppp60", "--clusters", "6")
    radio = document["scenario"]["radio"]
    gamma0 = 10 ** ((radio["tx_power_dbm"] + radio["ref_gain_db"] - radio["noise_dbm"]) / 10)
    owed_mbit = dict.fromkeys((user["name"] for user in found["users"]), 0.0)
    for user in found["users"]:
        owed_mbit[user["mate"] if user["via"] == "d2d" else user["name"]] += user["demand_mbit"]
    for user in found["users"]:
        bits = 0.0
        for stop in found["stops"]:
            away_m = GEOD.inv(user["lon_deg"], user["lat_deg"], stop["lon_deg"], stop["lat_deg"])[2]
            if away_m <= found["radius_m"] + 0.05:
                snr = gamma0 / (away_m**2 + stop["alt_rel_m"] ** 2) ** (radio["path_loss_exponent"] / 2)
                bits += radio["bandwidth_hz"] * math.log2(1 + snr) * stop["hold_s"]
        assert bits >= owed_mbit[user["name"]] * 1e6 * (1 - 1e-4)


def test_the_same_seed_gives_the_same_files(planned, tmp_path):
    planned("hppp60", "--clusters", "5", "--seed", "3")
    first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    planned("hppp60", "--clusters", "5", "--seed", "3")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == first


def test_by_default_a_plan_of_the_scenarios_name_is_written_here(mavplan, gallery, tmp_path):
    ran = mavplan("plan", gallery / "valley/scenario.toml")
    assert ran.code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"scenario.plan", "scenario.mavplan.json"}
    assert "Heliport" in ran.out
    assert "mission" in ran.out


def test_a_tdma_plan_keeps_its_schedule(planned, tmp_path, gallery, mavplan):
    for name in ("scenario.toml", "users.csv"):
        (tmp_path / name).write_text((gallery / "valley" / name).read_text())
    text = (tmp_path / "scenario.toml").read_text()
    (tmp_path / "scenario.toml").write_text(
        text.replace("[service]\n", '[service]\nmode = "tdma"\n')
        if "[service]" in text
        else text + '\n[service]\nmode = "tdma"\n'
    )
    ran = mavplan("plan", "scenario.toml", "-o", "t.plan")
    assert ran.code == 0, ran.err
    document = json.loads((tmp_path / "t.mavplan.json").read_text())
    turns = {slot["user"] for slot in document["schedule"]}
    assert turns
    assert turns <= {user["name"] for user in document["users"]}


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_a_picture_is_drawn_where_one_is_named(mavplan, gallery, tmp_path, suffix):
    ran = mavplan("plan", gallery / "valley/scenario.toml", "--clusters", "3", "-o", f"v.{suffix}")
    assert ran.code == 0, ran.err
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[suffix]
    assert (tmp_path / f"v.{suffix}").read_bytes().startswith(start)


def test_a_mission_longer_than_the_endurance_is_a_warning(mavplan, gallery, tmp_path):
    mavplan("init", ".")
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(scenario.read_text().replace("# endurance_s = 1200.0", "endurance_s = 1400.0"))
    ran = mavplan("plan", "scenario.toml")
    assert ran.code == 0, ran.err
    assert "the battery lasts 1,120 s" in ran.err


PHASES = ("climb", "cruise", "hover", "descent")


def valley_with(tmp_path, gallery, *vehicle):
    """The valley with these lines for its mass and battery."""
    for name in ("scenario.toml", "users.csv"):
        (tmp_path / name).write_bytes((gallery / "valley" / name).read_bytes())
    scenario = tmp_path / "scenario.toml"
    lines = [line for line in scenario.read_text().splitlines() if not re.match("mass_kg|battery_wh", line)]
    at = lines.index("[vehicle]") + 1
    scenario.write_text("\n".join([*lines[:at], *vehicle, *lines[at:]]))
    return scenario


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("planner", ["tloaik", "sbw"])
def test_the_forecast_of_the_items_adds_up_to_that_of_the_mission(
    mavplan, gallery, tmp_path, autopilot, planner
):
    scenario = valley_with(tmp_path, gallery, "mass_kg = 3.5", "battery_wh = 400.0")
    ran = mavplan("plan", scenario, "--autopilot", autopilot, "--planner", planner, "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    mission = read_mission(tmp_path / "scenario.plan")
    forecast, items = found["forecast"], found["forecast"]["items"]
    assert len(items) == len(mission.items)
    assert forecast["mission_s"] == pytest.approx(found["mission_s"], abs=0.1)
    clock = used = 0.0
    for item in items:
        clock += sum(item[f"{phase}_s"] for phase in PHASES)
        used += sum(item[f"{phase}_wh"] for phase in PHASES)
        assert item["done_s"] == pytest.approx(clock, abs=0.5)
        assert item["used_wh"] == pytest.approx(used, abs=0.01)
    for phase in PHASES:
        assert forecast[f"{phase}_s"] == pytest.approx(sum(item[f"{phase}_s"] for item in items), abs=0.5)
        assert forecast[f"{phase}_wh"] == pytest.approx(sum(item[f"{phase}_wh"] for item in items), abs=0.01)
    assert forecast["used_wh"] == pytest.approx(used, abs=0.01)
    assert forecast["remaining_fraction"] == pytest.approx(1 - used / 400, abs=1e-3)
    # The hold of a stop begins when it arrives and ends when the stop's last item is done.
    for number, (stop, arrival_s) in enumerate(zip(found["stops"], forecast["arrivals_s"], strict=True)):
        own = [item for item in items if item["stop"] == number]
        assert own[-1]["done_s"] == pytest.approx(arrival_s + stop["hold_s"], abs=0.02)
        assert sum(item["hover_s"] for item in own) == pytest.approx(stop["hold_s"])


def test_without_a_mass_no_energy_is_forecast_and_that_is_said_once(mavplan, gallery, tmp_path):
    ran = mavplan("plan", valley_with(tmp_path, gallery), "--items")
    assert ran.code == 0, ran.err
    assert ran.out.count("–:") == ran.out.count("mass_kg") == 1
    assert "Wh" not in ran.out
    forecast = json.loads((tmp_path / "scenario.mavplan.json").read_text())["forecast"]
    assert forecast["used_wh"] is forecast["remaining_fraction"] is forecast["cruise_wh"] is None
    assert all(item["used_wh"] is None for item in forecast["items"])
    assert forecast["cruise_s"] > 0


def test_the_table_of_items_shows_each_of_them_within_a_hundred_columns(mavplan, gallery, tmp_path):
    scenario = valley_with(tmp_path, gallery, "mass_kg = 3.5", "battery_wh = 400.0")
    ran = mavplan("plan", scenario, "--items")
    assert ran.code == 0, ran.err
    assert "of the battery left" in ran.out
    document = json.loads((tmp_path / "scenario.mavplan.json").read_text())
    _, _, table = ran.out.partition("forecast by item")
    rows = [line for line in table.splitlines() if "NAV_" in line or "DO_" in line]
    assert len(rows) == len(document["forecast"]["items"])
    assert max(len(line.rstrip()) for line in table.splitlines()) <= 100
    for row, item in zip(rows, document["forecast"]["items"], strict=True):
        assert item["command"] in row
        minutes, seconds = divmod(round(item["done_s"]), 60)
        assert f" {minutes}:{seconds:02d} " in f"{row} "
    first_s = document["forecast"]["arrivals_s"][0]
    assert f" {round(first_s) // 60}:{round(first_s) % 60:02d} " in ran.out.splitlines()[2]


def test_a_mission_that_leaves_less_than_the_reserve_is_a_warning(mavplan, gallery, tmp_path):
    scenario = valley_with(tmp_path, gallery, "mass_kg = 3.5", "battery_wh = 150.0")
    ran = mavplan("plan", scenario)
    assert ran.code == 0, ran.err
    used_wh = json.loads((tmp_path / "scenario.mavplan.json").read_text())["forecast"]["used_wh"]
    assert f"the mission takes {used_wh:.1f} Wh, the battery gives 120.0 Wh" in ran.err
    scenario.write_text(scenario.read_text().replace("battery_wh = 150.0", "battery_wh = 100.0"))
    assert "more than the battery holds" in mavplan("plan", scenario).out
    scenario.write_text(
        scenario.read_text().replace("battery_wh = 100.0", f"battery_wh = {used_wh / 0.79:.3f}")
    )
    assert "Wh, the battery gives" not in mavplan("plan", scenario).err
