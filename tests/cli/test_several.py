"""``mavplan plan --sorties``: the files it writes, who is named, and the exit codes."""

import json
import re

import pytest

from mavplan.formats import read_mission
from mavplan.scenario import load_scenario
from mavplan.stored_plan import read_plan


@pytest.fixture
def short_of_battery(gallery, tmp_path):
    """The valley with a battery that does not do for one flight."""
    text = (gallery / "valley" / "scenario.toml").read_text()
    text = re.sub(r"battery_wh = [0-9.]+", "battery_wh = 85.0", text)
    text = re.sub(r"mass_kg = [0-9.]+", "mass_kg = 2.5", text)
    (tmp_path / "users.csv").write_text((gallery / "valley" / "users.csv").read_text())
    (tmp_path / "valley.toml").write_text(text)
    return tmp_path / "valley.toml"


def test_each_sortie_has_files_that_are_read_by_themselves(mavplan, short_of_battery, tmp_path):
    ran = mavplan("plan", short_of_battery, "--sorties", "auto", "-o", "v.plan", "-o", "v.kml")
    assert ran.code == 0, ran.err
    written = {path.name for path in tmp_path.glob("v*-*")}
    assert written == {f"v-{n}{end}" for n in (1, 2) for end in (".plan", ".mavplan.json", ".kml")} or any(
        name.startswith("v-3") for name in written
    )
    assert not (tmp_path / "v.plan").exists()
    names = set()
    for path in sorted(tmp_path.glob("v-*.plan")):
        stored = read_plan(path)
        assert len(read_mission(path).items) > len(stored.stops)
        names |= set(stored.scenario.users.names)
        assert path.name in ran.out
    assert names == set(load_scenario(short_of_battery).users.names)


def test_who_is_left_over_is_named_and_is_a_scenario(mavplan, short_of_battery, tmp_path):
    ran = mavplan("plan", short_of_battery, "--sorties", "1", "-o", "v.plan", "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    (flight,) = found["flights"]
    left = found["not_served"]
    assert left
    assert flight["part"]["not_served"] == left
    assert flight["forecast"]["remaining_fraction"] >= 0.2
    assert all(name in ran.err for name in left)
    rest = load_scenario(tmp_path / "v-rest.toml")
    assert list(rest.users.names) == left
    assert {user["name"] for user in flight["users"]} | set(left) == set(
        load_scenario(short_of_battery).users.names
    )


def test_a_user_beyond_the_endurance_is_left_over_where_somebody_may_be(mavplan, short_of_battery, tmp_path):
    users = tmp_path / "users.csv"
    header, first = users.read_text().splitlines()[:2]
    columns = header.split(",")
    far = first.split(",")
    far[columns.index("name")] = "Far hut"
    far[columns.index("lat_deg")] = str(float(far[columns.index("lat_deg")]) + 0.4)
    users.write_text(users.read_text() + ",".join(far) + "\n")
    text = short_of_battery.read_text()
    short_of_battery.write_text(re.sub(r"endurance_s = \d+", "endurance_s = 1500", text))
    for sorties in ([], ["--sorties", "auto"]):
        refused = mavplan("plan", short_of_battery, *sorties, "-o", "v.plan")
        assert refused.code == 2
        assert "Far hut is " in refused.err
        assert not (tmp_path / "v.plan").exists()
    ran = mavplan("plan", short_of_battery, "--sorties", "1", "-o", "v.plan", "--json")
    assert ran.code == 0, ran.err
    assert re.search(r"line \d+: Far hut is [\d,]+ m from home; .*; it is left over", ran.err)
    assert "Far hut" in json.loads(ran.out)["not_served"]
    assert "Far hut" in (tmp_path / "v-rest.csv").read_text()


def test_one_battery_that_does_it_writes_the_ordinary_files(mavplan, gallery, tmp_path):
    scenario = gallery / "valley" / "scenario.toml"
    assert mavplan("plan", scenario, "-o", "one.plan").code == 0
    assert mavplan("plan", scenario, "--sorties", "auto", "-o", "auto.plan").code == 0
    for end in (".plan", ".mavplan.json"):
        assert (tmp_path / f"one{end}").read_text() == (tmp_path / f"auto{end}").read_text()


def test_sorties_are_auto_or_a_number(mavplan, gallery):
    for wrong in ("0", "-1", "some"):
        assert mavplan("plan", gallery / "valley" / "scenario.toml", "--sorties", wrong).code == 2


def test_each_vehicle_has_files_of_its_own_and_a_start(mavplan, gallery, tmp_path):
    scenario = gallery / "valley" / "scenario.toml"
    ran = mavplan("plan", scenario, "--vehicles", "2", "-o", "v.plan", "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    assert [flight["files"] for flight in found["flights"]] == [["v-1.plan"], ["v-2.plan"]]
    assert min(flight["part"]["start_s"] for flight in found["flights"]) == 0.0
    ends = [flight["part"]["start_s"] + flight["forecast"]["mission_s"] for flight in found["flights"]]
    assert found["longest_s"] == pytest.approx(max(ends), abs=0.02)
    for number in (1, 2):
        assert read_plan(tmp_path / f"v-{number}.plan").stops
    table = mavplan("plan", scenario, "--vehicles", "2", "-o", "v.plan")
    assert "v-2.plan" in table.out
    assert mavplan("plan", scenario, "--vehicles", "0").code == 2


def test_vehicles_whose_batteries_do_not_last_have_files_for_every_sortie(
    mavplan, short_of_battery, tmp_path
):
    text = short_of_battery.read_text().replace("battery_wh = 85.0", "battery_wh = 76.5")
    short_of_battery.write_text(text)
    ran = mavplan("plan", short_of_battery, "--vehicles", "2", "--sorties", "auto", "-o", "v.plan", "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    parts = [flight["part"] for flight in found["flights"]]
    assert max(part["rounds"] for part in parts) > 1
    files = [[f"v-{part['number']}-{part['round']}.plan"] for part in parts]
    assert [flight["files"] for flight in found["flights"]] == files
    names = set()
    for flight in found["flights"]:
        stored = read_plan(tmp_path / flight["files"][0])
        assert (stored.part.number, stored.part.round) == (
            flight["part"]["number"],
            flight["part"]["round"],
        )
        assert flight["forecast"]["remaining_fraction"] >= 0.2
        names |= set(stored.scenario.users.names)
    assert names == set(load_scenario(short_of_battery).users.names)
    table = mavplan("plan", short_of_battery, "--vehicles", "2", "--sorties", "auto", "-o", "v.plan")
    assert "rounds" in table.out
    assert "v-1-1.plan" in table.out


def test_what_a_fleet_cannot_serve_with_its_batteries_is_left_over(mavplan, short_of_battery, tmp_path):
    text = short_of_battery.read_text("utf-8").replace("battery_wh = 85.0", "battery_wh = 76.5")
    short_of_battery.write_text(text)
    ran = mavplan("plan", short_of_battery, "--vehicles", "2", "--sorties", "1", "-o", "v.plan", "--json")
    assert ran.code == 0, ran.err
    found = json.loads(ran.out)
    assert len(found["flights"]) == 2
    served = {user["name"] for flight in found["flights"] for user in flight["users"]}
    everybody = set(load_scenario(short_of_battery).users.names)
    assert found["not_served"]
    assert set(found["not_served"]) == everybody - served
    assert "v-rest.toml" in found["written"]
    assert set(load_scenario(tmp_path / "v-rest.toml").users.names) >= set(found["not_served"])
    table = mavplan("plan", short_of_battery, "--vehicles", "2", "--sorties", "1", "-o", "v.plan")
    assert "what the battery gives goes to others" in table.err
    assert "of the weighted demand" in table.out


def test_a_warning_of_one_flight_names_it_and_one_of_all_comes_once(mavplan, gallery, tmp_path):
    text = (gallery / "valley/scenario.toml").read_text("utf-8")
    (tmp_path / "s.toml").write_text(text.replace("battery_wh = 222.0", "battery_wh = 105.0"))
    (tmp_path / "users.csv").write_bytes((gallery / "valley/users.csv").read_bytes())
    ran = mavplan("plan", "s.toml", "--vehicles", "2", "-o", "v.plan")
    assert ran.code == 0, ran.err
    lines = [line for line in ran.err.splitlines() if "battery gives 84.0 Wh" in line]
    assert 1 <= len(lines) == len(set(lines)) <= 2
    assert all(line.startswith("warning: v-") and ".plan, [vehicle] battery_wh" in line for line in lines)


def test_one_sortie_that_is_enough_is_told(mavplan, gallery):
    ran = mavplan("plan", gallery / "valley/scenario.toml", "--sorties", "auto", "-o", "v.plan")
    assert "one sortie is enough" in ran.out
