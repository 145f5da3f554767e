"""``check``, ``export`` and ``demo``: what goes out is what was meant."""

import json

import pytest

from mavplan.formats import read_mission


@pytest.fixture
def valley(mavplan, gallery):
    """A planned example in this folder."""
    ran = mavplan(
        "plan", gallery / "valley/scenario.toml", "--clusters", "3", "-o", "v.plan", "-o", "v.waypoints"
    )
    assert ran.code == 0, ran.err


@pytest.mark.parametrize("name", ["v.plan", "v.waypoints"])
@pytest.mark.usefixtures("valley")
def test_a_written_mission_passes_its_check(mavplan, name):
    ran = mavplan("check", name)
    assert ran.code == 0, ran.err
    assert "verified" in ran.out
    assert "ArduPilot" in ran.out


def test_a_scenario_is_checked_on_both_firmwares(mavplan, gallery):
    ran = mavplan("check", gallery / "valley/scenario.toml")
    assert ran.code == 0, ran.err
    assert "mock ArduPilot" in ran.out
    assert "mock PX4" in ran.out


@pytest.mark.usefixtures("valley")
def test_a_mission_for_the_other_firmware_is_refused_by_name(mavplan):
    ran = mavplan("check", "v.plan", "--firmware", "px4")
    assert ran.code == 2
    assert "ArduPilot" in ran.err
    assert "PX4" in ran.err


@pytest.mark.parametrize("hover", ["hold", "waypoint+loiter"])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_one_at_a_time_above_home_the_slots_begin_with_the_hold_and_not_with_the_climb(
    mavplan, tmp_path, autopilot, hover
):
    (tmp_path / "users.csv").write_text("name,lat_deg,lon_deg\na,46.5002,7.5\nb,46.4998,7.5\nc,46.5,7.5003\n")
    (tmp_path / "s.toml").write_text(
        'users = "users.csv"\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600.0\n'
        '[vehicle]\naltitude_m = 30.0\nend = "land"\n[service]\nmode = "tdma"\ndemand_mbit = 20\n'
        '[[stops]]\nname = "here"\nlat_deg = 46.5\nlon_deg = 7.5\n'
    )
    options = ("--planner", "time", "--time-limit", "0", "--autopilot", autopilot, "--hover", hover)
    assert mavplan("plan", "s.toml", *options, "-o", "s.plan").code == 0
    ran = mavplan("check", "s.plan")
    assert ran.code == 0, ran.err
    assert "3 of 3 users received what they need" in ran.out


@pytest.mark.usefixtures("valley")
def test_a_file_with_a_swapped_position_fails_its_check(mavplan, tmp_path):
    plan = json.loads((tmp_path / "v.plan").read_text())
    params = plan["mission"]["items"][3]["params"]
    params[4], params[5] = params[5], params[4]
    (tmp_path / "v.plan").write_text(json.dumps(plan))
    ran = mavplan("check", "v.plan")
    assert ran.code == 6
    assert "error" in ran.err


@pytest.mark.usefixtures("valley")
def test_a_hold_that_ardupilot_would_cut_off_fails_its_check(mavplan, tmp_path):
    text = (tmp_path / "v.plan").read_text()
    plan = json.loads(text)
    holding = next(item for item in plan["mission"]["items"] if item["command"] == 19)
    holding["params"][0] = 7.6
    (tmp_path / "v.plan").write_text(json.dumps(plan))
    ran = mavplan("check", "v.plan")
    assert ran.code in {2, 6}
    assert "7.6" in ran.err


@pytest.mark.usefixtures("valley")
def test_an_export_holds_the_same_mission_and_keeps_the_plan_beside_it(mavplan, tmp_path):
    ran = mavplan("export", "v.plan", "-o", "w.waypoints")
    assert ran.code == 0, ran.err
    assert read_mission(tmp_path / "w.waypoints").items == read_mission(tmp_path / "v.plan").items
    assert (tmp_path / "w.mavplan.json").read_bytes() == (tmp_path / "v.mavplan.json").read_bytes()
    # Without the plan beside it, a .waypoints does not say its firmware; with it, it does.
    back = mavplan("export", "w.waypoints", "-o", "back.plan")
    assert back.code == 0
    assert read_mission(tmp_path / "back.plan").autopilot == "ardupilot"


@pytest.mark.usefixtures("valley")
def test_a_file_is_not_exported_onto_itself(mavplan, tmp_path):
    before = (tmp_path / "v.plan").read_bytes()
    assert mavplan("export", "v.plan", "-o", "v.plan").code == 2
    assert (tmp_path / "v.plan").read_bytes() == before


@pytest.mark.parametrize("name", ["valley", "coast"])
def test_the_demo_ends_with_a_verified_mission_and_its_files(mavplan_process, gallery, tmp_path, name):
    ran = mavplan_process("demo", gallery / name / "scenario.toml", "--out", "out")
    assert ran.code == 0, ran.err
    assert "stored and verified" in ran.out
    assert {path.suffix for path in (tmp_path / "out").iterdir()} == {".plan", ".waypoints", ".png", ".json"}


def test_the_demo_without_a_scenario_starts_from_the_one_of_init(mavplan_process, tmp_path):
    ran = mavplan_process("demo")
    assert ran.code == 0, ran.err
    assert (tmp_path / "mavplan-demo/scenario.toml").is_file()


@pytest.mark.usefixtures("valley")
def test_a_mission_and_its_plan_become_maps_and_a_table(mavplan, gallery, tmp_path):
    """The same from the plan as from the mission file afterwards."""
    outputs = [tmp_path / f"map{suffix}" for suffix in (".kml", ".kmz", ".gpx", ".geojson", ".csv")]
    ran = mavplan("export", "v.plan", *(word for path in outputs for word in ("-o", path)))
    assert ran.code == 0, ran.err
    assert "Last barn" in outputs[0].read_text("utf-8")
    assert all(path.stat().st_size > 500 for path in outputs)
    ran = mavplan("plan", gallery / "valley/scenario.toml", "--clusters", "3", "-o", "x.kml", "-o", "x.csv")
    assert ran.code == 0, ran.err
    drawn, exported = ((tmp_path / name).read_text("utf-8") for name in ("x.kml", "map.kml"))
    assert drawn.replace("<name>x</name>", "<name>v</name>") == exported
    assert (tmp_path / "x.csv").read_bytes() == outputs[-1].read_bytes()


@pytest.mark.usefixtures("valley")
def test_without_a_plan_a_map_has_no_users_and_a_table_cannot_be(mavplan, tmp_path):
    (tmp_path / "v.mavplan.json").unlink()
    assert mavplan("export", "v.plan", "-o", "bare.kml").code == 0
    assert "Last barn" not in (tmp_path / "bare.kml").read_text("utf-8")
    ran = mavplan("export", "v.plan", "-o", "also.kml", "-o", "users.csv")
    assert ran.code == 2
    assert "there is no plan beside the mission" in ran.err
    assert not (tmp_path / "also.kml").exists()
