"""``mavplan verify``, ``info`` and ``clear`` as processes, against the mock as a process, over real sockets."""

import json
import socket
import subprocess
import sys

import pytest

from mavplan.formats import write_mission
from tests.link.fenced import fenced
from tests.link.test_commands import HOME, free_port, mavplan
from tests.sitl_mock.process import mock, port_of


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_upload_verify_info_clear_and_verify_again(tmp_path, firmware):
    file = tmp_path / "field.plan"
    write_mission(fenced(firmware, 2), file)
    beside = tmp_path / "field.mavplan.json"
    beside.write_text('{"format": "mavplan", "stops": [1.25]}')
    with mock("--firmware", firmware, "--conn", "tcpin:127.0.0.1:0", "--home", HOME) as (_, (line,)):
        line_to = ["--conn", f"tcp:127.0.0.1:{port_of(line)}", "--system", 1]
        up = mavplan("upload", file.name, *line_to, folder=tmp_path)
        assert up.returncode == 0, up.stderr
        assert "5 of the fence, 2 rally points" in up.stdout
        kept = json.loads(beside.read_text())
        assert kept["stops"] == [1.25]
        assert (kept["vehicle"]["autopilot"], kept["vehicle"]["system"]) == (firmware, 1)
        assert kept["vehicle"]["verified_at"].endswith("+00:00")

        same = mavplan("verify", file.name, *line_to, "--json", folder=tmp_path)
        assert same.returncode == 0, same.stderr
        told = json.loads(same.stdout)
        assert told["by"] == ("id" if firmware == "px4" else "download")
        assert told["opaque_id"] == kept["vehicle"]["opaque_id"]
        assert told["uploaded_at"] == kept["vehicle"]["verified_at"]

        shown = mavplan("info", *line_to, "--json", folder=tmp_path)
        assert shown.returncode == 0, shown.stderr
        assert json.loads(shown.stdout)["items"] == {"mission": 7, "fence": 5, "rally_points": 2}

        silent = mavplan("clear", *line_to, folder=tmp_path, stdin=subprocess.DEVNULL)
        assert silent.returncode == 2
        assert "--yes" in silent.stderr
        cleared = mavplan("clear", *line_to, "--fence", folder=tmp_path, input="y\n")
        assert cleared.returncode == 0, cleared.stderr
        assert "holds no fence" in cleared.stdout

        other = mavplan("verify", file.name, *line_to, "--json", folder=tmp_path)
        assert other.returncode == 6
        assert json.loads(other.stdout)["differences"][0]["field"] == "count"
        assert "holds no fence" in other.stderr


def test_a_vehicle_elsewhere_is_exit_4_and_can_be_allowed(tmp_path):
    file = tmp_path / "field.plan"
    write_mission(fenced("px4", 1), file)
    with mock("--firmware", "px4", "--conn", "tcpin:127.0.0.1:0", "--home", "37.41,-122.1,10") as (
        _,
        (line,),
    ):
        line_to = ["--conn", f"tcp:127.0.0.1:{port_of(line)}", "--system", 1]
        far = mavplan("upload", file.name, *line_to, folder=tmp_path)
        assert far.returncode == 4
        assert "1,112 m" in far.stderr
        allowed = mavplan("upload", file.name, *line_to, "--max-home-distance", 2000, folder=tmp_path)
        assert allowed.returncode == 0, allowed.stderr


@pytest.mark.parametrize("command", [["verify", "field.plan"], ["info"], ["clear", "--yes"]])
def test_nobody_there_is_exit_3_in_one_sentence(tmp_path, command):
    write_mission(fenced("px4", 1), tmp_path / "field.plan")
    conn = f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    ran = mavplan(*command, "--conn", conn, "--timeout", 1.5, folder=tmp_path)
    assert ran.returncode == 3
    error, hint = ran.stderr.splitlines()
    assert conn in error
    assert hint.startswith("hint: is the vehicle on")


def test_verify_info_and_clear_import_nothing_heavy():
    code = (
        "import sys, mavplan.cli.verify, mavplan.cli.info, mavplan.cli.clear, mavplan.link.services;"
        "print(*{'scipy', 'sklearn', 'cvxpy', 'pyproj', 'pydantic', 'numpy', 'mavsdk'} & sys.modules.keys())"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "\n"
