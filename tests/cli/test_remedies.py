"""An error is followed by what may help, and by nothing where nothing is known."""

import re
import socket
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("args", "hint"),
    [
        (["plan", "nonexistent.toml"], "'mavplan init FOLDER' writes a scenario to start from"),
        (["plan", "scenari.toml"], "did you mean scenario.toml?"),
        (["plan", "folder"], "did you mean folder/scenario.toml?"),
        (["check", "valley.plan"], "'mavplan plan SCENARIO -o valley.plan' writes one"),
        (["upload", "resceu.plan", "--conn", "udpout:127.0.0.1:9"], "did you mean rescue.plan?"),
        (["info"], "say where the vehicle is, as in --conn udp:0.0.0.0:14550, or set MAVPLAN_CONN"),
        (["prove", "flight.tlog", "--plan", "rescue.plan"], "'mavplan plan' writes it beside the mission"),
    ],
)
def test_an_error_names_what_to_do(mavplan, args, hint):
    Path("folder").mkdir()
    for name in ("scenario.toml", "rescue.plan", "folder/scenario.toml"):
        Path(name).write_text("")
    ran = mavplan(*args)
    assert ran.code == 2
    assert ran.err.splitlines()[-1] == f"hint: {hint}"
    assert "hint" not in mavplan(*args, "-q").err


def test_a_vehicle_that_is_not_heard_is_looked_for(mavplan):
    ran = mavplan("info", "--conn", "udpout:127.0.0.1:9", "--timeout", "0.2")
    assert ran.code == 3
    assert "hint: is the vehicle on" in ran.err


@pytest.mark.parametrize("name", ["x\x1b[31m.toml", "missing/x.toml", "x.docx", "\0.toml"])
def test_where_nothing_is_known_nothing_is_said(mavplan, name):
    ran = mavplan("plan", name)
    assert ran.code == 2
    assert "\x1b" not in ran.err
    assert "did you mean" not in ran.err


def test_a_mission_beyond_the_battery_is_followed_by_the_ways_out(mavplan, gallery):
    scenario = Path("scenario.toml")
    text = (gallery / "valley/scenario.toml").read_text()
    scenario.write_text(re.sub("battery_wh = .*", "battery_wh = 120.0", text))
    Path("users.csv").write_bytes((gallery / "valley/users.csv").read_bytes())
    ran = mavplan("plan", scenario)
    assert ran.code == 0
    assert "hint: --sorties auto splits it" in ran.err
    assert "hint" not in mavplan("plan", gallery / "valley/scenario.toml").err


def test_a_planner_that_there_is_not_and_a_folder_that_there_is_not_are_told_before_any_work(
    mavplan, gallery
):
    valley = gallery / "valley/scenario.toml"
    assert "there is no planner 'tim': did you mean time?" in mavplan("plan", valley, "--planner", "tim").err
    ran = mavplan("plan", valley, "-o", "nowhere/x.plan", "-o", "there/y.png")
    assert ran.code == 2
    assert ran.err.count("does not exist: make it first") == 2


def test_a_connection_that_the_system_refuses_is_followed_by_who_may_have_it(mavplan):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        ran = mavplan("info", "--conn", f"udpin:127.0.0.1:{taken.getsockname()[1]}")
        assert ran.code == 3
        assert "hint: another ground station or another mavplan listens there" in ran.err
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        ran = mavplan("info", "--conn", f"tcp:127.0.0.1:{closed.getsockname()[1]}", "--timeout", "1")
        assert ran.code == 3
        assert "hint: nothing listens there" in ran.err
    ran = mavplan("info", "--conn", "serial:/dev/nowhere:57600")
    assert ran.code == 3
    assert ran.err.count("No such file") == 1
    assert "hint: " in ran.err
