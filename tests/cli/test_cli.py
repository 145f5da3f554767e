"""The command line as a whole: start, help, exit codes, and that nobody meets a traceback."""

import json
import subprocess
import sys

import pytest

from mavplan.cli import COMMANDS, LazyGroup, cli


def test_help_and_upload_start_without_anything_heavy():
    code = (
        "import sys\n"
        "from mavplan.cli import run\n"
        "code = run(['--help'])\n"
        "from mavplan.cli.upload import upload_command\n"
        "run(['upload', 'missing.plan', '--conn', 'udpout:127.0.0.1:9'])\n"
        "heavy = {'scipy', 'sklearn', 'cvxpy', 'pyproj', 'pydantic', 'matplotlib', 'mavsdk'} & set(sys.modules)\n"
        "sys.exit(f'loaded: {heavy}' if heavy or code else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_the_list_of_commands_says_what_each_command_says_of_itself(name):
    command = LazyGroup.get_command(cli, None, name)
    assert command.short_help == COMMANDS[name][1]
    assert command.name == name


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(mavplan, name):
    shown = mavplan(name, "--help")
    assert shown.code == 0
    assert "usage" in shown.out.lower()


@pytest.mark.parametrize(
    "args",
    [
        ["fly-away"],
        ["plan"],
        ["plan", "missing.toml"],
        ["plan", "missing.toml", "--clusters", "0"],
        ["plan", "missing.toml", "--clusters", "many"],
        ["plan", "missing.toml", "-o", "plan.docx"],
        ["export", "missing.plan", "-o", "x.waypoints"],
        ["check", "missing.plan"],
        ["check", "missing.toml"],
        ["compare", "missing.toml"],
        ["upload", "missing.plan", "--conn", "udp:127.0.0.1:14550"],
        ["upload", "missing.plan", "--conn", "carrier-pigeon:1"],
        ["download", "--conn", "udp:", "-o", "x.docx"],
        ["demo", "missing.toml"],
        ["sim", "--firmware", "betaflight"],
        ["init", "/proc/nowhere"],
    ],
)
def test_bad_input_is_exit_code_2_and_a_sentence(mavplan, args):
    ran = mavplan(*args)
    assert ran.code == 2
    assert ran.err.strip()
    assert "Traceback" not in ran.err


def test_an_altitude_that_reaches_nobody_names_the_one_below_which_somebody_is(mavplan, tmp_path):
    mavplan("init", ".")
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(scenario.read_text().replace("# altitude_m = 100.0", "altitude_m = 900.0"))
    ran = mavplan("plan", "scenario.toml")
    assert ran.code == 2
    assert "below 411.3 m" in ran.err


def test_all_problems_come_at_once(mavplan, tmp_path):
    (tmp_path / "scenario.toml").write_text(
        'users = "users.csv"\n[home]\nlat_deg = 91.0\nlon_deg = 8.0\nalt_amsl_m = 500.0\n[radio]\nbandwith_hz = 1e6\n'
    )
    (tmp_path / "users.csv").write_text("name,lat_deg,lon_deg,demand_mbit\na,47,8,-1\na,nan,8,1\n")
    ran = mavplan("plan", "scenario.toml")
    assert ran.code == 2
    for part in ("91", "bandwith_hz", "bandwidth_hz", "line 2", "line 3", "-1", "nan"):
        assert part in ran.err


def test_an_unfinished_write_leaves_the_old_files_alone(mavplan, tmp_path, gallery):
    (tmp_path / "old.plan").write_text("old")
    ran = mavplan("plan", gallery / "valley/scenario.toml", "-o", "old.plan", "-o", "missing/new.plan")
    assert ran.code == 2
    assert (tmp_path / "old.plan").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["old.plan"]


def test_version(mavplan):
    assert mavplan("--version").out.startswith("mavplan, version")


def test_a_reader_that_goes_away_is_no_fault(gallery, tmp_path):
    scenario = gallery / "hppp60/scenario.toml"
    command = f"{sys.executable} -m mavplan plan {scenario} --clusters 4 | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr
    assert done.returncode == 0


def test_the_plan_as_json_is_one_object_whatever_is_warned_about(mavplan, gallery):
    ran = mavplan("plan", gallery / "coast/scenario.toml", "--json")
    json.loads(ran.out)
    assert "warning" in ran.err
