"""``mavplan upload`` and ``mavplan download`` as processes, against the mock as a process, over real sockets."""

import json
import socket
import subprocess
import sys
import threading
import time

import pytest
from pymavlink.dialects.v20 import common

from mavplan.formats import read_mission, write_mission
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from tests.link.fenced import fenced
from tests.link.harness import make_mission
from tests.sitl_mock.process import mock, port_of

HOME = "37.4,-122.1,10"
ITEM = common.MAVLINK_MSG_ID_MISSION_ITEM_INT


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def mavplan(*arguments, folder, **options):
    command = [sys.executable, "-m", "mavplan", *(str(argument) for argument in arguments)]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=120, check=False, **options
    )


def mission_file(folder, firmware, stops=6):
    path = folder / f"{firmware}.plan"
    write_mission(make_mission(firmware, stops), path)
    return path


def pair(way):
    """Connection strings of the mock and of mavplan that find each other; None: read the mock's port."""
    if way == "udpout":
        return "udpin:127.0.0.1:0", None
    if way == "tcp":
        return "tcpin:127.0.0.1:0", None
    port = free_port(socket.SOCK_DGRAM if way == "udpin" else socket.SOCK_STREAM)
    calls = "udpout" if way == "udpin" else "tcp"
    return f"{calls}:127.0.0.1:{port}", f"{way}:127.0.0.1:{port}"


@pytest.mark.parametrize(
    ("way", "firmware"), [("udpout", "ardupilot"), ("udpin", "px4"), ("tcp", "px4"), ("tcpin", "ardupilot")]
)
def test_upload_and_download_over_every_kind_of_socket(tmp_path, firmware, way):
    theirs, ours = pair(way)
    file = mission_file(tmp_path, firmware)
    with mock("--firmware", firmware, "--conn", theirs, "--home", HOME) as (_, (line,)):
        conn = ours or f"{way}:127.0.0.1:{port_of(line)}"
        up = mavplan("upload", file.name, "--conn", conn, "--system", 1, folder=tmp_path)
        assert up.returncode == 0, up.stderr
        title = AUTOPILOTS[firmware].title
        assert up.stdout.startswith(
            f"stored and verified: {15 + (firmware == 'ardupilot')} items on {title}, system 1"
        )
        fetch = ["download", "--conn", conn, "--system", 1, "-o", "held.plan", "--autopilot", firmware]
        down = mavplan(*fetch, folder=tmp_path)
        assert down.returncode == 0, down.stderr
    rules = AUTOPILOTS[firmware]
    sent, held = (to_wire(read_mission(path), rules) for path in (file, tmp_path / "held.plan"))
    assert differences(sent, held, rules) == []


@pytest.mark.parametrize("firmware", ["px4"])
def test_a_fence_and_rally_points_come_back_in_a_plan_and_are_left_out_of_a_waypoints_file(
    tmp_path, firmware
):
    mission = fenced(firmware, 2)
    write_mission(mission, tmp_path / "fenced.plan")
    with mock("--firmware", firmware, "--conn", "tcpin:127.0.0.1:0", "--home", HOME) as (_, (line,)):
        conn = ["--conn", f"tcp:127.0.0.1:{port_of(line)}", "--system", 1]
        assert mavplan("upload", "fenced.plan", *conn, folder=tmp_path).returncode == 0
        whole = mavplan("download", *conn, "-o", "held.plan", "--json", folder=tmp_path)
        flat = mavplan("download", *conn, "-o", "held.waypoints", folder=tmp_path)
        alone = mavplan("download", *conn, "-o", "alone.plan", "--mission-only", "--json", folder=tmp_path)
        cleared = mavplan("clear", *conn, "--yes", folder=tmp_path)
        none = mavplan("download", *conn, "-o", "none.plan", "--json", folder=tmp_path)
    codes = [ran.returncode for ran in (whole, flat, alone, cleared, none)]
    assert codes == [0, 0, 0, 0, 6], whole.stderr + flat.stderr + alone.stderr + none.stderr
    held = read_mission(tmp_path / "held.plan")
    assert (held.fence, held.rally) == (mission.fence, mission.rally)
    told = json.loads(whole.stdout)
    assert (told["items"], told["fence_items"], told["rally_items"]) == (len(mission.items), 5, 2)
    assert (
        flat.stdout
        == f"written: held.waypoints, {len(mission.items)} items, 5 of the fence, 2 rally points\n"
    )
    assert "fence areas cannot stand in this format" in flat.stderr
    assert "rally points cannot stand in this format" in flat.stderr
    only = json.loads(alone.stdout)
    assert (only["fence_items"], only["rally_items"], only["warnings"]) == (None, None, [])
    assert read_mission(tmp_path / "alone.plan").fence is None
    assert json.loads(none.stdout)["exit_code"] == 6
    assert "only a fence of 5 items and 2 rally points" in none.stderr
    assert not (tmp_path / "none.plan").exists()


class Relay:
    """Carries datagrams between mavplan and the mock, and does something at the so-manyth item."""

    def __init__(self, vehicle_port, at_item, action):
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.bind(("127.0.0.1", 0))
        self.sock.settimeout(0.1)
        self.port = self.sock.getsockname()[1]
        self.vehicle = ("127.0.0.1", vehicle_port)
        self.items = set()
        self.at_item, self.action = at_item, action
        self.over = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        ground = None
        while not self.over:
            try:
                data, sender = self.sock.recvfrom(65536)
            except OSError:
                continue
            if sender == self.vehicle:
                if ground:
                    self.sock.sendto(data, ground)
                continue
            ground = sender
            if data[7] == ITEM:
                self.items.add(data[10:])
                if len(self.items) == self.at_item:
                    self.action()
            self.sock.sendto(data, self.vehicle)

    def close(self):
        self.over = True
        self.thread.join()
        self.sock.close()


@pytest.mark.parametrize("firmware", ["ardupilot"])
def test_the_vehicle_is_killed_in_mid_upload_and_it_ends_in_time_uncertain_in_one_sentence(
    tmp_path, firmware
):
    file = mission_file(tmp_path, firmware, 20)
    with mock("--firmware", firmware, "--conn", "udpin:127.0.0.1:0", "--home", HOME) as (process, (line,)):
        relay = Relay(port_of(line), 9, process.kill)
        try:
            start = time.monotonic()
            up = mavplan(
                "upload",
                file.name,
                "--conn",
                f"udpout:127.0.0.1:{relay.port}",
                "--timeout",
                4,
                folder=tmp_path,
            )
            lasted_s = time.monotonic() - start
        finally:
            relay.close()
    assert up.returncode == 5
    assert up.stdout == ""
    assert up.stderr.count("\n") == 1
    assert "Traceback" not in up.stderr
    assert up.stderr.startswith("error: no end within 4 s: the vehicle had asked for 9 of 4")
    assert lasted_s < 4 + 10  # the interpreter's own start is not the deadline's


def test_a_tcp_vehicle_that_goes_away_in_mid_upload_is_uncertain_too(tmp_path):
    file = mission_file(tmp_path, "ardupilot", 20)
    arguments = [
        "--firmware",
        "ardupilot",
        "--conn",
        "tcpin:127.0.0.1:0",
        "--home",
        HOME,
        "--fault",
        "silent-after=5",
    ]
    with mock(*arguments) as (_, (line,)):
        up = mavplan(
            "upload", file.name, "--conn", f"tcp:127.0.0.1:{port_of(line)}", "--timeout", 4, folder=tmp_path
        )
    assert up.returncode == 5
    assert "mixture" in up.stderr


def test_json_tells_a_success_and_a_table_a_difference(tmp_path):
    file = mission_file(tmp_path, "px4")
    ends = ["--firmware", "px4", "--conn", "tcpin:127.0.0.1:0", "--home", HOME]
    with mock(*ends) as (_, (line,)):
        conn = f"tcp:127.0.0.1:{port_of(line)}"
        up = mavplan("upload", file.name, "--conn", conn, "--system", 1, "--json", folder=tmp_path)
    assert up.returncode == 0
    told = json.loads(up.stdout)
    assert (told["outcome"], told["items"], told["autopilot"], told["judgement"]) == (
        "verified",
        15,
        "px4",
        "flyable",
    )
    with mock(*ends, "--fault", "alter=3") as (_, (line,)):
        conn = f"tcp:127.0.0.1:{port_of(line)}"
        up = mavplan("upload", file.name, "--conn", conn, "--system", 1, "--json", folder=tmp_path)
        table = mavplan("upload", file.name, "--conn", conn, "--system", 1, folder=tmp_path)
    assert (up.returncode, table.returncode) == (5, 5)
    (found,) = json.loads(up.stdout)["differences"]
    assert (found["item"], found["field"]) == (3, "x")
    assert "what the vehicle stored otherwise" in table.stderr
    assert f"{found['sent'] / 1e7:.7f}°" in table.stderr
    assert "latitude" in table.stderr


def test_nobody_there_is_no_link(tmp_path):
    file = mission_file(tmp_path, "px4")
    conn = f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    up = mavplan("upload", file.name, "--conn", conn, "--timeout", 1.5, folder=tmp_path)
    assert up.returncode == 3
    assert conn in up.stderr


def test_refused_by_capacity_is_4_with_both_numbers(tmp_path):
    file = mission_file(tmp_path, "ardupilot", 20)
    ends = ["--firmware", "ardupilot", "--conn", "tcpin:127.0.0.1:0", "--home", HOME, "--capacity", "30"]
    with mock(*ends) as (_, (line,)):
        up = mavplan("upload", file.name, "--conn", f"tcp:127.0.0.1:{port_of(line)}", folder=tmp_path)
    assert up.returncode == 4
    assert "room for 30 items, this mission has 44" in up.stderr


def test_two_vehicles_on_one_port_are_bad_usage_without_system_and_fine_with_it(tmp_path):
    file = mission_file(tmp_path, "px4")
    port = free_port(socket.SOCK_DGRAM)
    ends = ["--firmware", "px4", "--conn", f"udpout:127.0.0.1:{port}", "--home", HOME]
    with mock(*ends, "--system-id", "3"), mock(*ends, "--system-id", "9"):
        both = mavplan("upload", file.name, "--conn", f"udp:127.0.0.1:{port}", folder=tmp_path)
        one = mavplan(
            "upload", file.name, "--conn", f"udp:127.0.0.1:{port}", "--system", 9, "--json", folder=tmp_path
        )
    assert both.returncode == 2
    assert "systems 3, 9" in both.stderr
    assert one.returncode == 0, one.stderr
    assert json.loads(one.stdout)["system"] == 9


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["upload", "px4.plan", "--conn", "nonsense"], "udpout:HOST:PORT"),
        (["upload", "no-such.plan", "--conn", "udp:127.0.0.1:14550"], "no-such.plan"),
        (["upload", "px4.plan", "--conn", "udp:127.0.0.1:14550", "--timeout", "-1"], "timeout"),
        (["download", "--conn", "udp:127.0.0.1:14550", "-o", "held.txt"], "held.txt"),
        (["download", "--conn", "udp:127.0.0.1:14550"], "--output"),
    ],
)
def test_bad_usage_is_2_without_a_traceback(tmp_path, arguments, word):
    mission_file(tmp_path, "px4")
    ran = mavplan(*arguments, folder=tmp_path)
    assert ran.returncode == 2
    assert word in ran.stderr
    assert "Traceback" not in ran.stderr


def test_an_upload_imports_nothing_heavy():
    code = (
        "import sys, mavplan.cli.upload, mavplan.cli.download, mavplan.cli.console, mavplan.formats.beside;"
        "import mavplan.link.vehicle, mavplan.link.connection;"
        "print(*{'scipy', 'sklearn', 'cvxpy', 'pyproj', 'pydantic', 'numpy', 'mavsdk'} & sys.modules.keys())"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        == "\n"
    )
