"""The door to all mission files."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mavplan.errors import InputError
from mavplan.formats import FORMATS, read_mission, write_mission
from mavplan.mission.model import Autopilot, Mission

MakeMission = Callable[[Autopilot], Mission]


@pytest.mark.parametrize("name", ["m.kml", "m", "m.plan.bak"])
def test_an_unknown_suffix_is_refused_with_those_that_exist(
    tmp_path: Path, name: str, make_mission: MakeMission
) -> None:
    """Reading and writing name the formats there are, and nothing is written."""
    with pytest.raises(InputError, match=r"\.plan .*\.waypoints") as caught:
        write_mission(make_mission("px4"), tmp_path / name)
    assert name in str(caught.value)
    with pytest.raises(InputError, match=r"\.plan .*\.waypoints"):
        read_mission(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_suffix_may_be_in_capitals(tmp_path: Path, make_mission: MakeMission) -> None:
    """M.PLAN is a plan."""
    write_mission(make_mission("ardupilot"), tmp_path / "M.PLAN")
    assert read_mission(tmp_path / "M.PLAN") == make_mission("ardupilot")


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_cannot_be_read_is_told(tmp_path: Path, suffix: str) -> None:
    """Missing, a folder, bytes that are no text: one sentence each."""
    (tmp_path / f"folder{suffix}").mkdir()
    (tmp_path / f"binary{suffix}").write_bytes(b"\x00\xff\xfe")
    for name, said in (("missing", "No such file"), ("folder", "directory"), ("binary", "not UTF-8")):
        with pytest.raises(InputError, match=said):
            read_mission(tmp_path / f"{name}{suffix}")


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_is_written_is_read_back(
    tmp_path: Path, suffix: str, autopilot: Autopilot, make_mission: MakeMission
) -> None:
    """Same items and home; a text file knows no autopilot and no NaN."""
    meant = make_mission(autopilot)
    found = write_mission(meant, tmp_path / f"m{suffix}")
    read = read_mission(tmp_path / f"m{suffix}")
    assert read.home == meant.home
    if suffix == ".plan":
        assert read == meant
        assert not found
    else:
        assert read.autopilot is None
        zeroed = [(*item.params[:3], 0.0) for item in meant.items]
        assert [item.params for item in read.items] == zeroed
        assert [problem.code for problem in found] == (["nose-north"] if autopilot == "px4" else [])
        assert all(problem.severity == "warning" for problem in found)
