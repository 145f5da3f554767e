"""``[[vehicles]]``: a fleet's homes, read, checked and written again; priorities of the users file too."""

import pytest

from mavplan.errors import InputError
from mavplan.scenario import load_scenario
from mavplan.scenario.sections import FleetVehicle
from mavplan.scenario.write import scenario_toml, users_csv

HEAD = 'users = "users.csv"\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600.0\n'
USERS = "name,lat_deg,lon_deg,demand_mbit,priority\na,46.5,7.5,10,2.5\nb,46.501,7.5,10,\n"


def load(folder, vehicles, users=USERS):
    (folder / "users.csv").write_text(users)
    (folder / "scenario.toml").write_text(HEAD + vehicles)
    return load_scenario(folder / "scenario.toml")


def entry(name="", system=None, lat_deg=46.5):
    lines = ["[[vehicles]]", f"lat_deg = {lat_deg}", "lon_deg = 7.51", "alt_amsl_m = 610.0"]
    lines += [f'name = "{name}"'] if name else []
    lines += [f"system = {system}"] if system is not None else []
    return "\n".join(lines) + "\n"


def test_vehicles_and_priorities_are_read_and_written_again(tmp_path):
    found = load(tmp_path, entry("red", 7) + entry())
    assert found.vehicles == (
        FleetVehicle(46.5, 7.51, 610.0, "red", 7),
        FleetVehicle(46.5, 7.51, 610.0, "[[vehicles]] 2", None),
    )
    assert found.users.priority.tolist() == [2.5, 1.0]
    (tmp_path / "again.toml").write_text(scenario_toml(found, "again.csv", "again"))
    (tmp_path / "again.csv").write_text(users_csv(found.users))
    again = load_scenario(tmp_path / "again.toml")
    assert again.vehicles == found.vehicles
    assert again.users.priority.tolist() == [2.5, 1.0]


def test_without_the_column_nobody_has_a_priority(tmp_path):
    assert load(tmp_path, "", "name,lat_deg,lon_deg\na,46.5,7.5\n").users.priority is None


@pytest.mark.parametrize(
    ("vehicles", "code"),
    [
        (entry("red", 7) + entry("red", 8), "duplicate"),
        (entry("red", 7) + entry("blue", 7), "duplicate"),
        (entry("red", 0), "out-of-range"),
        (entry("red", 1, lat_deg=91.0), "out-of-range"),
        ("[[vehicles]]\nlat_deg = 46.5\nlon_deg = 7.5\n", "missing-key"),
        ("[vehicles]\nlat_deg = 46.5\n", "wrong-type"),
    ],
)
def test_what_is_wrong_with_a_vehicle_is_said(tmp_path, vehicles, code):
    with pytest.raises(InputError) as raised:
        load(tmp_path, vehicles)
    assert [problem.code for problem in raised.value.problems] == [code]


@pytest.mark.parametrize("weight", ["-1", "heavy", "1e7"])
def test_a_priority_out_of_range_names_its_row(tmp_path, weight):
    with pytest.raises(InputError) as raised:
        load(tmp_path, "", USERS.replace("2.5", weight))
    (problem,) = raised.value.problems
    assert "line 2" in problem.where
    assert "priority" in problem.where


def test_the_endurance_reaches_from_every_vehicles_home(tmp_path):
    far = "name,lat_deg,lon_deg\na,46.5,7.5\nb,46.7,7.51\n"
    endurance = "[vehicle]\nendurance_s = 600.0\n"
    assert load(tmp_path, endurance + entry("north", lat_deg=46.7), far).vehicles
    with pytest.raises(InputError) as raised:
        load(tmp_path, endurance + entry("south"), far)
    (problem,) = raised.value.problems
    assert problem.code == "beyond-endurance"
    assert "nearest home" in problem.message
