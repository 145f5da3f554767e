"""``mavplan compare``: one row a planner, beside SBW = 1, and how few stops would do."""

import dataclasses
import json
import re
from pathlib import Path

import pytest

from mavplan.cli.compare import print_comparison
from mavplan.comparison import compare
from mavplan.planners import PLANNERS
from mavplan.scenario import load_scenario


@pytest.fixture
def compared(mavplan, gallery):
    """The object for an example."""
    ran = mavplan("compare", gallery / "hppp60/scenario.toml", "--clusters", "5", "--json", "-o", "c.png")
    assert ran.code == 0, ran.err
    return json.loads(ran.out)


def test_the_benchmark_is_one_and_every_index_is_that_of_its_ratios(compared):
    rows = {row["planner"]: row for row in compared["planners"]}
    assert set(rows) == set(PLANNERS)
    assert rows["sbw"]["length_ratio"] == rows["sbw"]["sum_rate_ratio"] == rows["sbw"]["joint_index"] == 1.0
    for row in rows.values():
        assert row["joint_index"] == pytest.approx(row["sum_rate_ratio"] / row["length_ratio"])
    assert rows["tloaik"]["length_m"] < rows["sbw"]["length_m"]
    assert rows["stoaik"]["d2d_users"] == rows["sbw"]["d2d_users"] == 0


def test_the_benchmark_is_one_also_where_its_strips_go_round_a_zone(mavplan, gallery):
    """Every planner's path is compared as it is flown."""
    for name in ("scenario.toml", "users.csv"):
        Path(name).write_bytes((gallery / "hppp60" / name).read_bytes())
    with Path("scenario.toml").open("a") as file:
        file.write(
            "\n[[no_fly]]\nname = 'field'\ncircle = { lat_deg = 47.592, lon_deg = 21.137, radius_m = 200 }\n"
        )
    ran = mavplan("compare", "scenario.toml", "--clusters", "5", "--json")
    assert ran.code == 0, ran.err
    for row in json.loads(ran.out)["planners"]:
        assert row["joint_index"] == pytest.approx(row["sum_rate_ratio"] / row["length_ratio"])
    assert "index ρe 1.00 (benchmark SBW = 1)" in mavplan("plan", "scenario.toml", "--planner", "sbw").out


def test_no_planner_uses_fewer_stops_than_are_proved_to_be_needed(compared):
    for row in compared["planners"]:
        least = compared["least_stops_with_d2d" if row["d2d_users"] else "least_stops"]
        assert row["stops"] >= least["bound"]
    assert compared["least_stops_with_d2d"]["bound"] <= compared["least_stops"]["size"]


def test_the_table_and_the_picture_are_for_people(mavplan, gallery, tmp_path):
    ran = mavplan("compare", gallery / "valley/scenario.toml", "-o", "valley.png")
    assert ran.code == 0, ran.err
    for word in (
        "TLOAIK",
        "STOAIK",
        "BOAIK",
        "SBW",
        "fewest stops",
        "only TIME counts on what users receive",
    ):
        assert word in ran.out
    assert (tmp_path / "valley.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_of_no_known_format_is_refused_before_any_planning(mavplan, gallery):
    ran = mavplan("compare", gallery / "valley/scenario.toml", "-o", "valley.bmp")
    assert ran.code == 2
    assert ".bmp" in ran.err


def test_energy_stands_where_the_mass_is_given(mavplan, gallery, tmp_path):
    for name in ("scenario.toml", "users.csv"):
        (tmp_path / name).write_bytes((gallery / "valley" / name).read_bytes())
    scenario = tmp_path / "scenario.toml"
    ran = mavplan("compare", scenario)
    assert ran.out.splitlines()[1].endswith(" Wh")
    rows = json.loads(mavplan("compare", scenario, "--json").out)["planners"]
    for row in rows:
        assert f" {row['energy_wh']:,.1f}" in ran.out
        watt = row["energy_wh"] * 3600 / row["mission_s"] / 3.5
        assert 85 < watt < 120
    scenario.write_text(re.sub("(mass_kg|battery_wh).*\n", "", scenario.read_text()))
    assert " Wh" not in mavplan("compare", scenario).out


def test_missions_that_the_battery_does_not_do_are_marked(gallery, capsys):
    loaded = load_scenario(gallery / "valley/scenario.toml")

    def beside_each_other(**battery):
        vehicle = dataclasses.replace(loaded.vehicle, endurance_s=None, reserve_fraction=0.1, **battery)
        return compare(dataclasses.replace(loaded, vehicle=vehicle), planners=["tloaik", "stoaik"])

    needed_wh = {row.planner: row.energy_wh for row in beside_each_other(battery_wh=1e4).rows}
    least_wh, _, most_wh = sorted(needed_wh.values())
    found = beside_each_other(battery_wh=(least_wh + 1) / 0.9)
    assert [row.within_battery for row in found.rows] == [
        needed_wh[row.planner] == least_wh for row in found.rows
    ]
    print_comparison(found)
    lines = capsys.readouterr().out.splitlines()
    for row in found.rows:
        line = next(line for line in lines if line.startswith(row.planner.upper()))
        assert (" !" in line) != row.within_battery
    assert any(line.startswith("! takes more than the battery gives above its reserve") for line in lines)
    assert all(row.within_battery for row in beside_each_other(battery_wh=(most_wh + 1) / 0.9).rows)
    unknown = beside_each_other(battery_wh=None).rows
    assert {row.within_battery for row in unknown} == {None}
