"""Other people's readers take our files and read what we meant."""

import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

from mavplan.formats import read_mission, write_mission
from mavplan.formats.checks import mavsdk_problems, pymavlink_problems, reader_problems
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.build import ENDS, HOVERS, End, Hover, build_mission
from mavplan.mission.model import Autopilot, HomePosition, Mission

MakeMission = Callable[[Autopilot], Mission]
QGC_FILE = Path(__file__).with_name("data") / "qgroundcontrol.plan"


@pytest.mark.parametrize(("autopilot", "end", "hover"), list(product(AUTOPILOTS, ENDS, HOVERS)))
def test_every_kind_of_mission_passes_every_reader(
    tmp_path: Path, autopilot: Autopilot, end: End, hover: Hover
) -> None:
    """MAVSDK imports the plan, pymavlink loads the text, no reader's rule is broken, and no value differs."""
    mission = build_mission(
        home=HomePosition(-338_567_890, 1_512_098_765, -1.5),
        stops_e7=[
            (-338_567_890, 1_512_098_765),
            (-338_560_001, 1_512_099_999),
            (-338_500_003, 1_512_000_007),
        ],
        holds_s=(1.0, 65_535.0, 17.0),
        rules=AUTOPILOTS[autopilot],
        altitude_m=87.3,
        speed_m_s=6.5,
        end=end,
        hover=hover,
    ).mission
    write_mission(mission, tmp_path / "m.plan")
    write_mission(mission, tmp_path / "m.waypoints")
    assert not mavsdk_problems(tmp_path / "m.plan", mission)
    assert not pymavlink_problems(tmp_path / "m.waypoints", mission)
    assert not reader_problems(tmp_path / "m.plan", mission)
    assert not reader_problems(tmp_path / "m.waypoints", mission)


def test_mavsdk_reads_qgroundcontrols_file_as_we_do() -> None:
    """Our reader against MAVSDK's on a file that neither wrote."""
    mission = read_mission(QGC_FILE)
    jump = mission.items[2]
    # MAVSDK passes the target on as the file has it, by id; ours follows it to the item.
    by_id = replace(jump, params=(3.0, *jump.params[1:]))
    seen = replace(mission, items=(*mission.items[:2], by_id, mission.items[3]))
    assert not mavsdk_problems(QGC_FILE, seen)


@pytest.mark.parametrize("key", ["geoFence", "rallyPoints", "mission", "version"])
def test_mavsdks_refusal_is_told(tmp_path: Path, make_mission: MakeMission, key: str) -> None:
    """A section that MAVSDK wants and does not find is a problem, not an exception."""
    path = tmp_path / "m.plan"
    write_mission(make_mission("px4"), path)
    document = json.loads(path.read_text())
    del document[key]
    path.write_text(json.dumps(document))
    (problem,) = mavsdk_problems(path, make_mission("px4"))
    assert "MAVSDK refuses it" in problem.message


def test_a_machine_without_mavsdk_is_told(
    tmp_path: Path, make_mission: MakeMission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was not asked: a warning, neither silence nor a traceback."""
    write_mission(make_mission("px4"), tmp_path / "m.plan")
    monkeypatch.setitem(sys.modules, "mavsdk", None)
    (problem,) = mavsdk_problems(tmp_path / "m.plan", make_mission("px4"))
    assert (problem.code, problem.severity) == ("not-asked", "warning")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("field", ["lat_e7", "alt_m", "params", "frame"])
def test_a_value_that_differs_is_found_by_all_readers(
    tmp_path: Path, make_mission: MakeMission, autopilot: Autopilot, field: str
) -> None:
    """The comparison can fail: one field of one item changed, by as little as 1e-7 degrees."""
    meant = make_mission(autopilot)
    item = meant.items[3]
    new = {"lat_e7": item.lat_e7 + 1, "alt_m": 100.1, "params": (9.0, 0.0, 0.0, 0.0), "frame": 0}[field]
    items = (*meant.items[:3], replace(item, **{field: new}), *meant.items[4:])
    other = replace(meant, items=items)
    for path, foreign in (
        (tmp_path / "m.plan", mavsdk_problems),
        (tmp_path / "m.waypoints", pymavlink_problems),
    ):
        write_mission(other, path)
        assert foreign(path, meant)
        assert reader_problems(path, meant)


@pytest.mark.parametrize(("autopilot", "seen_by_mavsdk"), [("ardupilot", True), ("px4", False)])
def test_another_home_is_found(
    tmp_path: Path, make_mission: MakeMission, autopilot: Autopilot, seen_by_mavsdk: bool
) -> None:
    """MAVSDK sends home to ArduPilot only; the text file carries it for everybody."""
    meant = make_mission(autopilot)
    other = replace(meant, home=replace(meant.home, alt_amsl_m=100.0))
    write_mission(other, tmp_path / "m.plan")
    write_mission(other, tmp_path / "m.waypoints")
    assert bool(mavsdk_problems(tmp_path / "m.plan", meant)) == seen_by_mavsdk
    assert pymavlink_problems(tmp_path / "m.waypoints", meant)


@pytest.mark.parametrize(
    "text", ["QGC WPL 120\n", "QGC WPL 110\n1 2 3\n", "QGC WPL 110\n", "", "QGC WPL 110\n" + "x " * 12]
)
def test_pymavlinks_refusal_is_told(tmp_path: Path, make_mission: MakeMission, text: str) -> None:
    """What it cannot load is a problem, not an exception, and no file stays open."""
    (tmp_path / "m.waypoints").write_text(text)
    (problem,) = pymavlink_problems(tmp_path / "m.waypoints", make_mission("px4"))
    assert "pymavlink" in problem.message


def test_the_environment_is_left_as_it_was(
    tmp_path: Path, make_mission: MakeMission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pymavlink chooses its dialect by MAVLINK20; asking it must not choose for the rest of the program."""
    write_mission(make_mission("px4"), tmp_path / "m.waypoints")
    for before in ("1", None):
        monkeypatch.delenv("MAVLINK20", raising=False)
        if before:
            monkeypatch.setenv("MAVLINK20", before)
        assert not pymavlink_problems(tmp_path / "m.waypoints", make_mission("px4"))
        assert os.environ.get("MAVLINK20") == before
