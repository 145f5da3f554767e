"""What the plan beside a mission file remembers of the vehicle that holds it."""

import json
from datetime import UTC, datetime, timedelta

import pytest

from mavplan.formats.beside import home_height_limit_m, plan_path, remember_vehicle, remembered_vehicle
from tests.link.harness import make_mission, make_network, upload


@pytest.fixture(scope="module")
def report():
    return upload(make_mission("px4", 1), make_network("px4")).session.report


def test_the_vehicle_is_added_and_every_other_value_stays_as_it_was(tmp_path, report):
    file = tmp_path / "valley.plan"
    before = {
        "format": "mavplan",
        "names": ["Grüße", "x"],
        "numbers": [0.1, 1e-9, 37.400000000000006, None],
        "vehicle": {"old": 1},
    }
    plan_path(file).write_text(json.dumps(before), "utf-8")
    assert remember_vehicle(file, report) == ()
    after = json.loads(plan_path(file).read_text("utf-8"))
    vehicle = after.pop("vehicle")
    before.pop("vehicle")
    assert after == before
    assert (vehicle["autopilot"], vehicle["system"], vehicle["opaque_id"]) == ("px4", 1, report.opaque_id)
    age = datetime.now(UTC) - datetime.fromisoformat(vehicle["verified_at"])
    assert timedelta(0) <= age + timedelta(seconds=1) < timedelta(minutes=5)
    assert remembered_vehicle(file) == vehicle


@pytest.mark.parametrize("content", [None, "no json", "[1, 2]", '"text"'])
def test_where_there_is_no_plan_nothing_is_written(tmp_path, report, content):
    file = tmp_path / "valley.plan"
    if content is not None:
        plan_path(file).write_text(content)
    assert remember_vehicle(file, report) == ()
    assert plan_path(file).exists() == (content is not None)
    if content is not None:
        assert plan_path(file).read_text() == content
    assert remembered_vehicle(file) == {}


def test_a_plan_that_cannot_be_replaced_is_a_warning_and_stays_whole(tmp_path, report, monkeypatch):
    file = tmp_path / "valley.plan"
    plan_path(file).write_text('{"a": 1}')

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mavplan.formats.atomic.os.fsync", full)
    (found,) = remember_vehicle(file, report)
    assert found.severity == "warning"
    assert plan_path(file).read_text() == '{"a": 1}'
    assert [path.name for path in tmp_path.iterdir()] == ["valley.mavplan.json"]


@pytest.mark.parametrize(
    ("content", "limit_m"),
    [
        ('{"scenario": {"terrain": {"file": "a.tif"}}}', 10.0),
        ('{"scenario": {"terrain": {"file": null}}}', 30.0),
        ('{"scenario": {}}', 30.0),
        ('{"scenario": [1]}', 30.0),
        ("nothing", 30.0),
        (None, 30.0),
    ],
)
def test_a_home_may_be_less_off_where_the_plan_is_over_terrain(tmp_path, content, limit_m):
    mission_file = tmp_path / "a.plan"
    if content is not None:
        plan_path(mission_file).write_text(content)
    assert home_height_limit_m(mission_file) == limit_m
    assert home_height_limit_m(mission_file, 44.0) == 44.0
