"""``mavplan check`` flies the mission on the mock and proves it: all is met as planned, what goes wrong is named."""

import re
from pathlib import Path

import pytest

SHELTERS = Path(__file__).resolve().parents[2].parent / "shared/data/cambridge_emergency_shelters.geojson"

SCENARIO = """
users = "users.csv"
[home]
lat_deg = 46.5
lon_deg = 7.5
alt_amsl_m = 600.0
[vehicle]
altitude_m = 30.0
[radio]
tx_power_dbm = 5.0
[planner]
name = "stoaik"
clusters = 2
"""
USERS = """name,lat_deg,lon_deg,demand_mbit
Anna,46.5010,7.5003,60
Ben,46.5012,7.5006,40
Cleo,46.4991,7.4985,70
"""


@pytest.fixture
def small(mavplan, tmp_path):
    """A scenario of two stops near home; gives a function that plans it for a firmware into ``small.plan``."""
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    (tmp_path / "users.csv").write_text(USERS)

    def plan(firmware):
        ran = mavplan("plan", "scenario.toml", "--autopilot", firmware, "-o", "small.plan")
        assert ran.code == 0, ran.err

    return plan


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_planned_mission_is_flown_and_every_demand_is_met(mavplan, small, firmware):
    small(firmware)
    ran = mavplan("check", "small.plan")
    assert ran.code == 0, ran.err
    assert "flown to its end, landed, motors off" in ran.out
    assert "3 of 3 users received what they need: 170.0 of 170.0 Mbit" in ran.out
    assert not ran.out.endswith("\n\n")
    assert "2 of 2 stops held" in ran.out
    off = float(re.search(r"flown .*, forecast .* \(([\d.]+)% (more|less)\)", ran.out)[1])
    assert off < 5.0


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("hover", ["loiter", "hold"])
def test_other_ways_to_hold_are_flown_and_proved_one_user_at_a_time(
    mavplan, small, tmp_path, firmware, hover
):
    with (tmp_path / "scenario.toml").open("a") as scenario:
        scenario.write('[service]\nmode = "tdma"\n')
    args = ("--autopilot", firmware, "--hover", hover, "-o", "small.plan")
    assert mavplan("plan", "scenario.toml", *args).code == 0
    ran = mavplan("check", "small.plan")
    assert ran.code == 0, ran.err
    assert "3 of 3 users received what they need" in ran.out


def test_a_mission_that_flies_on_behind_its_last_stop_is_recognised(mavplan, small):
    assert mavplan("plan", "scenario.toml", "--planner", "sbw", "-o", "small.plan").code == 0
    ran = mavplan("check", "small.plan")
    assert ran.code == 0, ran.err
    assert "3 of 3 users received what they need" in ran.out


def test_a_scenario_is_flown_by_both_firmwares(mavplan, small):
    ran = mavplan("check", "scenario.toml")
    assert ran.code == 0, ran.err
    assert ran.out.count("3 of 3 users received what they need") == 2


HOLD_ITEM = {"ardupilot": 4, "px4": 3}
"""The loiter of the first stop, as the vehicle numbers it."""


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_hold_cut_by_half_is_named_by_user_and_stop(mavplan, small, firmware):
    small(firmware)
    ran = mavplan("check", "small.plan", "--fault", f"hold-cut={HOLD_ITEM[firmware]}")
    assert ran.code == 6
    held = re.search(r"stop 1: held ([\d.]+) of ([\d.]+) s", ran.err)
    assert float(held[1]) == pytest.approx(float(held[2]) / 2, abs=0.6)
    assert "do not fly this before it is mended" in ran.err


def test_a_hold_that_is_none_cannot_be_cut_and_that_is_said(mavplan, small):
    small("ardupilot")
    ran = mavplan("check", "small.plan", "--fault", f"hold-cut={HOLD_ITEM['ardupilot'] - 1}")
    assert ran.code == 0
    assert "item 3 of the mission on ArduPilot holds nothing: nothing is cut" in ran.err


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_gust_of_two_hundred_metres_is_named_by_user_and_stop(mavplan, small, firmware):
    small(firmware)
    ran = mavplan("check", "small.plan", "--fault", f"gust={HOLD_ITEM[firmware]}/200m")
    assert ran.code == 6
    away_m = float(re.search(r"\(stop 1: [^)]*(?:held|pushed up to) (\d+) m from its place", ran.err)[1])
    assert 20 < away_m <= 205
    assert re.search(r"warning: mock \w+: stop 1 was held up to (19|20)\d m from the planned place", ran.err)


def test_positions_that_are_lost_are_named(mavplan, small):
    small("ardupilot")
    ran = mavplan("check", "small.plan", "--fault", f"position-lost={HOLD_ITEM['ardupilot']}/30s")
    assert ran.code == 6
    assert "no positions for" in ran.err
    assert "do not count (no positions, or too low)" in ran.err


def test_a_crash_is_no_flight_to_the_end(mavplan, small):
    small("px4")
    ran = mavplan("check", "small.plan", "--fault", f"crash={HOLD_ITEM['px4']}")
    assert ran.code == 6
    assert "flown to its end" not in ran.out
    assert "did not receive what they need" in ran.err


def test_wind_that_only_slows_it_leaves_every_demand_met(mavplan, small):
    small("ardupilot")
    ran = mavplan("check", "small.plan", "--wind", "4@270", "--seed", "3")
    assert ran.code == 0, ran.err
    assert "3 of 3 users received what they need" in ran.out


def test_without_its_plan_a_mission_is_not_flown(mavplan, small, tmp_path):
    small("ardupilot")
    (tmp_path / "small.mavplan.json").unlink()
    ran = mavplan("check", "small.plan")
    assert ran.code == 0, ran.err
    assert "stored, read back and verified" in ran.out
    assert "flown" not in ran.out


def test_with_another_missions_plan_beside_it_is_not_flown_and_that_is_said(
    mavplan, small, tmp_path, gallery
):
    small("ardupilot")
    assert mavplan("plan", gallery / "valley/scenario.toml", "-o", "valley.plan").code == 0
    (tmp_path / "valley.mavplan.json").replace(tmp_path / "small.mavplan.json")
    ran = mavplan("check", "small.plan")
    assert ran.code == 0, ran.err
    assert "is of another mission than the file" in ran.err
    assert "flown to its end" not in ran.out


def test_it_need_not_be_flown(mavplan, small):
    small("ardupilot")
    ran = mavplan("check", "small.plan", "--no-flight")
    assert ran.code == 0, ran.err
    assert "flown" not in ran.out


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("--wind", "x"), "wind is SPEED@FROM"),
        (("--fault", "nonsense"), "fault 'nonsense' is unknown; known are drop"),
    ],
)
def test_a_wind_or_a_fault_that_is_none_is_refused(mavplan, small, args, said):
    small("ardupilot")
    ran = mavplan("check", "small.plan", *args)
    assert (ran.code, said in ran.err) == (2, True)


@pytest.mark.skipif(not SHELTERS.is_file(), reason=f"{SHELTERS} is not on this machine")
@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_citys_shelters_are_flown_and_every_one_gets_what_it_needs(mavplan, tmp_path, firmware):
    # Ten times the default bandwidth makes holds a tenth as long, and the test take seconds.
    (tmp_path / "city.toml").write_text(
        f'users = "{SHELTERS}"\n'
        "[home]\nlat_deg = 42.3736\nlon_deg = -71.1097\nalt_amsl_m = 10.0\n"
        '[columns]\nname = "Name"\ndemand_mbit = "Capacity"\n[radio]\nbandwidth_hz = 1e7\n'
    )
    ran = mavplan("check", "city.toml", "--firmware", firmware)
    assert ran.code == 0, ran.err
    assert "15 of 15 users received what they need" in ran.out
    off = float(re.search(r"flown .*, forecast .* \(([\d.]+)% (more|less)\)", ran.out)[1])
    assert off < 5.0
