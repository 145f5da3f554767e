"""``--via mavsdk``: MAVSDK carries out the transfers, and every outcome is the one our own transfers have."""

import dataclasses
import json
import socket
import time

import pytest

from mavplan.formats import read_mission, write_mission
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.geofence import Fence, FencePolygon, RallyPoint
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from tests.link.harness import HOME as PLACE
from tests.link.harness import make_mission
from tests.link.test_commands import HOME, Relay, free_port, mavplan, mission_file
from tests.sitl_mock.process import mock, port_of

pytest.importorskip("mavsdk")


def vehicle(firmware, *more):
    return mock("--firmware", firmware, "--conn", "tcpin:127.0.0.1:0", "--home", HOME, *more)


def via(line):
    return ["--conn", f"tcp:127.0.0.1:{port_of(line)}", "--system", 1, "--via", "mavsdk"]


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_mission_is_stored_verified_and_downloaded(tmp_path, firmware):
    file = mission_file(tmp_path, firmware)
    with vehicle(firmware) as (_, (line,)):
        up = mavplan("upload", file.name, *via(line), "--json", folder=tmp_path)
        down = mavplan("download", *via(line), "-o", "held.plan", folder=tmp_path)
    assert (up.returncode, down.returncode) == (0, 0), up.stderr + down.stderr
    told = json.loads(up.stdout)
    assert (told["outcome"], told["items"], told["uploads"]) == (
        "verified",
        15 + (firmware == "ardupilot"),
        1,
    )
    assert told["judgement"] == (None if firmware == "ardupilot" else "flyable")
    assert (told["opaque_id"] is not None) is (firmware == "px4")
    rules = AUTOPILOTS[firmware]
    sent, held = (to_wire(read_mission(path), rules) for path in (file, tmp_path / "held.plan"))
    assert differences(sent, held, rules) == []


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_fence_and_rally_points_go_before_the_mission(tmp_path, firmware):
    lat, lon = PLACE.lat_e7, PLACE.lon_e7
    corners = ((-90_000, -90_000), (300_000, -90_000), (300_000, 90_000), (-90_000, 90_000))
    fence = Fence((FencePolygon(True, tuple((lat + north, lon + east) for north, east in corners)),))
    rally = (RallyPoint(lat + 900, lon, 30.0),)
    mission = dataclasses.replace(make_mission(firmware, 6), fence=fence, rally=rally)
    write_mission(mission, tmp_path / "fenced.plan")
    with vehicle(firmware) as (_, (line,)):
        up = mavplan("upload", "fenced.plan", *via(line), folder=tmp_path)
        held = mavplan("verify", "fenced.plan", *via(line)[:4], folder=tmp_path)
        down = mavplan("download", *via(line), "-o", "held.plan", folder=tmp_path)
    assert (up.returncode, held.returncode, down.returncode) == (0, 0, 0), up.stderr + held.stderr
    back = read_mission(tmp_path / "held.plan")
    assert (back.fence, back.rally) == (fence, rally), down.stderr
    assert "fence" in held.stdout
    assert "rally" in held.stdout


def test_nobody_there_is_no_link_also_where_mavsdk_would_say_success(tmp_path):
    file = mission_file(tmp_path, "px4")
    closed = free_port(socket.SOCK_STREAM)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        for conn, word in (
            (f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}", "no heartbeat"),
            (f"udpin:127.0.0.1:{taken.getsockname()[1]}", "cannot listen"),
            (f"tcp:127.0.0.1:{closed}", "cannot open"),
        ):
            up = mavplan(
                "upload", file.name, "--conn", conn, "--timeout", 1.5, "--via", "mavsdk", folder=tmp_path
            )
            assert (up.returncode, word in up.stderr, up.stderr.count("error:")) == (3, True, 1), up.stderr
            assert ("is the vehicle on" in up.stderr) == (word == "no heartbeat"), up.stderr


def test_too_many_items_are_refused_with_both_numbers(tmp_path):
    file = mission_file(tmp_path, "ardupilot", 20)
    with vehicle("ardupilot", "--capacity", "30") as (_, (line,)):
        up = mavplan("upload", file.name, *via(line), folder=tmp_path)
    assert up.returncode == 4
    assert "room for 30 items, this mission has 44" in up.stderr


def test_a_refusal_is_told_with_what_the_vehicle_keeps(tmp_path):
    file = mission_file(tmp_path, "px4")
    with vehicle("px4", "--fault", "nack=UNSUPPORTED") as (_, (line,)):
        up = mavplan("upload", file.name, *via(line), folder=tmp_path)
    assert up.returncode == 4
    assert "a command it does not know" in up.stderr
    assert "MissionItem" not in up.stderr  # as MAVSDK's own error would print


def test_an_item_that_is_stored_otherwise_is_uncertain_with_the_field(tmp_path):
    file = mission_file(tmp_path, "px4")
    with vehicle("px4", "--fault", "alter=3") as (_, (line,)):
        up = mavplan("upload", file.name, *via(line), "--json", folder=tmp_path)
    assert up.returncode == 5
    (found,) = json.loads(up.stdout)["differences"]
    assert (found["item"], found["field"]) == (3, "x")


def test_a_vehicle_that_is_killed_in_the_middle_is_uncertain_in_time(tmp_path):
    file = mission_file(tmp_path, "ardupilot", 20)
    with mock("--firmware", "ardupilot", "--conn", "udpin:127.0.0.1:0", "--home", HOME) as (process, (line,)):
        relay = Relay(port_of(line), 9, process.kill)
        try:
            conn = ["--conn", f"udpout:127.0.0.1:{relay.port}", "--timeout", 7, "--via", "mavsdk"]
            start = time.monotonic()
            up = mavplan("upload", file.name, *conn, folder=tmp_path)
            lasted_s = time.monotonic() - start
        finally:
            relay.close()
    assert (up.returncode, up.stdout, up.stderr.count("\n")) == (5, "", 1), up.stderr
    assert "the vehicle had asked for 9 of 44 items" in up.stderr
    assert lasted_s < 7 + 10  # the interpreter's own start is not the deadline's


@pytest.mark.parametrize(
    ("firmware", "fault"), [("px4", "ack-lost"), ("ardupilot", "ack-lost"), ("px4", "drop=0.05,dup=0.1")]
)
def test_where_mavsdk_gives_up_the_read_back_or_another_attempt_verifies(tmp_path, firmware, fault):
    file = mission_file(tmp_path, firmware, 1)
    with vehicle(firmware, "--fault", fault, "--seed", "5") as (_, (line,)):
        up = mavplan("upload", file.name, *via(line), "--json", folder=tmp_path)
    assert up.returncode == 0, up.stderr
    assert json.loads(up.stdout)["outcome"] == "verified"


def test_a_key_cannot_go_with_it(tmp_path):
    file = mission_file(tmp_path, "px4")
    for command in (["upload", file.name], ["download", "-o", "held.plan"]):
        ran = mavplan(
            *command,
            "--conn",
            "udpin:127.0.0.1:14550",
            "--via",
            "mavsdk",
            "--signing-key",
            "k",
            folder=tmp_path,
        )
        assert ran.returncode == 2
        assert "MAVSDK has no signing" in ran.stderr


def test_of_two_vehicles_on_one_port_only_the_named_one_gets_the_mission(tmp_path):
    file = mission_file(tmp_path, "px4")
    port = free_port(socket.SOCK_DGRAM)
    ends = ["--firmware", "px4", "--conn", f"udpout:127.0.0.1:{port}", "--home", HOME]
    conn = ["--conn", f"udpin:127.0.0.1:{port}", "--via", "mavsdk"]
    with mock(*ends, "--system-id", "3"), mock(*ends, "--system-id", "9"):
        both = mavplan("upload", file.name, *conn, folder=tmp_path)
        one = mavplan("upload", file.name, *conn, "--system", 9, "--json", folder=tmp_path)
        other = mavplan("download", *conn, "--system", 3, "-o", "other.plan", folder=tmp_path)
        same = mavplan("download", *conn, "--system", 9, "-o", "same.plan", folder=tmp_path)
    assert (both.returncode, one.returncode, other.returncode, same.returncode) == (2, 0, 6, 0), one.stderr
    assert "systems 3, 9" in both.stderr
    assert json.loads(one.stdout)["system"] == 9
    assert "no mission" in other.stderr
