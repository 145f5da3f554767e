"""``-``: scenarios from standard input, one file to standard output and nothing beside it."""

import io
import json
import zipfile

import pytest

from mavplan.cli import streams
from mavplan.formats.plan import loads


@pytest.fixture
def typed(monkeypatch):
    """Put text on standard input."""

    def put(text):
        data = text if isinstance(text, bytes) else text.encode()
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))

    return put


@pytest.fixture
def scenario(mavplan, typed):
    """The template's scenario on standard input, its users in the working folder."""
    mavplan("init", ".")
    from pathlib import Path

    text = Path("scenario.toml").read_text()
    typed(text)
    return text


def test_a_scenario_on_standard_input_is_planned_as_from_its_file(mavplan, scenario, typed):
    assert mavplan("plan", "-").out.endswith("written: mission.plan, mission.mavplan.json\n")
    mavplan("plan", "scenario.toml", "-o", "other.plan")
    from pathlib import Path

    assert Path("mission.plan").read_bytes() == Path("other.plan").read_bytes()


def test_what_is_wrong_on_standard_input_is_said_with_its_place(mavplan, typed, tmp_path):
    typed('users = "users.csv"\n[home]\nlat_deg = 91.0\n')
    ran = mavplan("plan", "-")
    assert ran.code == 2
    assert "standard input, [home] lat_deg" in ran.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"#" * (1024 * 1024 + 1), b"", b"users ="])
def test_what_is_no_scenario_on_standard_input_is_a_sentence(mavplan, typed, content):
    typed(content)
    ran = mavplan("compare", "-")
    assert ran.code == 2
    assert ran.err.startswith("error: standard input")
    assert "Traceback" not in ran.err


def test_check_takes_a_scenario_on_standard_input(mavplan, scenario):
    ran = mavplan("check", "-", "--firmware", "px4", "--no-flight")
    assert ran.code == 0
    assert "mock PX4" in ran.out


def test_one_file_goes_to_standard_output_and_nothing_beside_it(mavplan, scenario, tmp_path):
    before = set(tmp_path.iterdir())
    ran = mavplan("plan", "-", "-o", "-", "--format", "plan")
    assert ran.code == 0
    mission = loads(ran.out, "standard output")
    assert len(mission.items) > 3
    assert set(tmp_path.iterdir()) == before


def test_a_stream_and_files_can_be_written_at_once(mavplan, scenario):
    ran = mavplan("plan", "-", "-o", "-", "-o", "a.plan", "--format", "geojson")
    assert json.loads(ran.out)["type"] == "FeatureCollection"
    exported = mavplan("export", "a.plan", "-o", "-", "--format", "waypoints")
    assert exported.out.startswith("QGC WPL 110\n")


def test_bytes_go_to_a_pipe_and_a_page_to_standard_output(mavplan_process, gallery, mavplan):
    mavplan("plan", gallery / "valley/scenario.toml", "-o", "a.plan")
    assert mavplan("report", "a.plan", "--no-compare", "-o", "-").out.startswith("<!")
    import subprocess
    import sys

    command = [sys.executable, "-m", "mavplan", "export", "a.plan", "-o", "-", "--format", "kmz"]
    done = subprocess.run(command, capture_output=True, timeout=60)
    assert zipfile.ZipFile(io.BytesIO(done.stdout)).testzip() is None


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["plan", "s.toml", "-o", "-"], "say with --format"),
        (["plan", "s.toml", "-o", "a.plan", "--format", "plan"], "said by its suffix"),
        (["plan", "s.toml", "-o", "-", "-o", "-", "--format", "plan"], "takes one file"),
        (["plan", "s.toml", "-o", "-", "--format", "plan", "--json"], "both want standard output"),
        (["prove", "-", "--plan", "a.plan"], "for scenarios only"),
        (["upload", "-", "--conn", "udp:"], "for scenarios only"),
        (["compare", "s.toml", "-o", "-"], "for scenarios only"),
    ],
)
def test_a_dash_that_makes_no_sense_is_refused(mavplan, args, said):
    ran = mavplan(*args)
    assert ran.code == 2
    assert said in ran.err


def test_bytes_are_not_sent_to_a_terminal(mavplan, monkeypatch):
    monkeypatch.setattr(streams, "is_terminal", lambda stream: True)
    ran = mavplan("plan", "s.toml", "-o", "-", "--format", "png")
    assert ran.code == 2
    assert "not to a terminal" in ran.err
