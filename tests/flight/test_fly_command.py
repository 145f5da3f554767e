"""``mavplan fly`` as a process against the mock as a process: exit codes, questions, Ctrl-C, the recording."""

import dataclasses
import json
import signal
import subprocess
import sys
import time

import pytest

from mavplan.formats import write_mission
from mavplan.mission.model import Command, Frame, MissionItem
from mavplan.track.tlog import TlogFrames
from tests.flight.terminal import at_terminal
from tests.link.harness import HOME, make_mission
from tests.sitl_mock.process import mock, port_of

SPEED = 30
BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
HEARTBEAT, COMMAND_LONG, POSITION = 0, 76, 33


def mission_file(folder, firmware, stops=1, hold_s=8.0):
    path = folder / f"{firmware}.plan"
    write_mission(make_mission(firmware, stops, hold_s), path)
    return path


def vehicle(firmware, *more, speed=SPEED):
    """A mock at the harness's home."""
    home = f"{HOME.lat_e7 / 1e7},{HOME.lon_e7 / 1e7},{HOME.alt_amsl_m:g}"
    ends = ("--firmware", firmware, "--conn", "udpin:127.0.0.1:0", "--home", home, "--speed", str(speed))
    return mock(*ends, *more)


def fly(*arguments, folder, **options):
    command = [sys.executable, "-m", "mavplan", "fly", *(str(argument) for argument in arguments)]
    return subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        stdin=subprocess.DEVNULL,
        **options,
    )


def to(line):
    return ("--conn", f"udpout:127.0.0.1:{port_of(line)}", "--system", "1")


def recordings(folder):
    return sorted(folder.glob("*.tlog"))


def test_quiet_says_nothing_of_a_flight_that_goes_well(tmp_path):
    file = mission_file(tmp_path, "px4")
    with vehicle("px4") as (_, (line,)):
        ran = fly(file.name, *to(line), "--upload", "--yes", "-q", folder=tmp_path)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    assert recordings(tmp_path)


@BOTH
def test_a_flight_with_a_yes_beforehand_is_flown_told_and_recorded(tmp_path, firmware):
    file = mission_file(tmp_path, firmware)
    signed = ()
    if firmware == "px4":  # one of the two with signatures
        key = tmp_path / "link.key"
        key.write_text("0123456789abcdef" * 4)
        key.chmod(0o600)
        signed = ("--signing-key", str(key))
    with vehicle(firmware, *signed) as (_, (line,)):
        ran = fly(file.name, *to(line), "--upload", "--yes", "--json", *signed, folder=tmp_path)
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout)
    assert (found["outcome"], found["exit_code"], found["stops_done"]) == ("flown", 0, [1])
    assert found["items_done"] == found["items"] == 5
    assert found["flight_s"] == pytest.approx(found["forecast_s"], rel=0.05)
    told_s = [event["flight_s"] for event in found["events"]]
    assert told_s == sorted(told_s)
    assert {check["verdict"] for check in found["checks"]} <= {"good", "warning"}
    assert "stop 1 of 1: holds 8 s" in ran.stderr
    (recording,) = recordings(tmp_path)
    assert found["recording"] == recording.name
    frames = TlogFrames(recording.read_bytes())
    heard = [(frame.system, frame.message_id) for frame in frames]
    assert (frames.losses.skipped_bytes, frames.losses.cut_bytes) == (0, 0)
    assert {(1, HEARTBEAT), (1, POSITION), (255, HEARTBEAT), (255, COMMAND_LONG)} <= set(heard)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ((), "--yes starts without asking"),
        (("--yes", "--upload", "--watch"), "cannot go with --upload"),
        (("--yes", "--record", "there.tlog"), "is never written over"),
        (("--yes", "--record", "there.tlog", "--no-record"), "cannot go with --no-record"),
        (("--yes", "--record", "no/such/there.tlog"), "cannot be made"),
    ],
)
def test_bad_usage_is_2_and_nothing_is_begun(tmp_path, more, words):
    file = mission_file(tmp_path, "px4")
    (tmp_path / "there.tlog").write_bytes(b"old")
    ran = fly(file.name, "--conn", "udpout:127.0.0.1:9", *more, folder=tmp_path)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert words in ran.stderr
    assert "Traceback" not in ran.stderr
    assert (tmp_path / "there.tlog").read_bytes() == b"old"
    assert len(recordings(tmp_path)) == 1


def test_an_end_that_does_not_come_home_wants_a_second_yes_where_nobody_can_be_asked(tmp_path):
    mission = make_mission("px4", 1)
    place = (mission.items[3].lat_e7, mission.items[3].lon_e7, 0.0)
    land = MissionItem(Command.NAV_LAND, Frame.GLOBAL_RELATIVE_ALT, (0, 0, 0, 0), *place)
    write_mission(dataclasses.replace(mission, items=(*mission.items[:-1], land)), tmp_path / "land.plan")
    ran = fly("land.plan", "--conn", "udpout:127.0.0.1:9", "--yes", folder=tmp_path)
    assert ran.returncode == 2
    assert "that wants a second --yes" in ran.stderr


def test_nobody_there_is_3_and_leaves_no_recording(tmp_path):
    file = mission_file(tmp_path, "px4")
    ran = fly(file.name, "--conn", "tcp:127.0.0.1:9", "--yes", folder=tmp_path)
    assert ran.returncode == 3
    assert recordings(tmp_path) == []


def test_a_vehicle_that_does_not_hold_the_mission_is_4_with_the_list_and_leaves_no_recording(tmp_path):
    file = mission_file(tmp_path, "ardupilot")
    with vehicle("ardupilot") as (_, (line,)):
        ran = fly(file.name, *to(line), "--yes", "--min-battery", 100, "--json", folder=tmp_path)
    assert ran.returncode == 4, ran.stderr
    found = json.loads(ran.stdout)
    assert (found["outcome"], found["exit_code"]) == ("refused", 4)
    assert "ArduPilot holds no mission; --upload sends it first" in found["message"]
    assert len(found["checks"]) == 9
    assert recordings(tmp_path) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_without_a_terminal_leaves_the_mission_alone_and_says_so(tmp_path, number):
    file = mission_file(tmp_path, "px4", 1, 100.0)
    with vehicle("px4") as (_, (line,)):
        command = [sys.executable, "-m", "mavplan", "fly", file.name, *to(line), "--upload", "--yes"]
        with subprocess.Popen(
            command, cwd=tmp_path, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as ran:
            for told in ran.stderr:
                if "in the air" in told:
                    break
            ran.send_signal(number)
            rest = ran.stderr.read()
            assert ran.wait(30) == 5, rest
        assert "its mission was left alone, and it flies on by itself" in rest
        if number == signal.SIGINT:
            watched = fly(file.name, *to(line), "--watch", "--json", "--no-record", folder=tmp_path)
            assert watched.returncode == 0, watched.stderr
            assert json.loads(watched.stdout)["outcome"] == "flown"
    (recording,) = recordings(tmp_path)
    assert recording.stat().st_size > 1_000


def test_a_recording_survives_being_killed_with_all_but_the_last_second(tmp_path):
    file = mission_file(tmp_path, "px4", 1, 60.0)
    with vehicle("px4", speed=10) as (_, (line,)):
        command = [sys.executable, "-m", "mavplan", "fly", file.name, *to(line), "--upload", "--yes"]
        with subprocess.Popen(
            command, cwd=tmp_path, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as ran:
            for told in ran.stderr:
                if "in the air" in told:
                    break
            time.sleep(1.0)
            killed_at = time.time()
            ran.kill()
    (recording,) = recordings(tmp_path)
    times = [frame.time_us / 1e6 for frame in TlogFrames(recording.read_bytes())]
    assert killed_at - times[-1] < 1.0
    assert times[-1] - times[0] > 2.0


def test_a_no_at_the_terminal_arms_nothing(tmp_path):
    file = mission_file(tmp_path, "px4")
    with (
        vehicle("px4") as (_, (line,)),
        at_terminal("fly", file.name, *to(line), "--upload", folder=tmp_path) as terminal,
    ):
        terminal.until("Arm PX4, system 1, and fly 1 stop, 5 items")
        terminal.type("n")
        assert terminal.code() == 4
    assert "you did not say yes: it was not armed" in terminal.shown
    assert recordings(tmp_path) == []


def test_ctrl_c_in_flight_asks_and_does_what_is_answered(tmp_path):
    file = mission_file(tmp_path, "ardupilot", 1, 60.0)
    with (
        vehicle("ardupilot", speed=10) as (_, (line,)),
        at_terminal("fly", file.name, *to(line), "--upload", folder=tmp_path) as terminal,
    ):
        terminal.until("Arm ArduPilot, system 1, and fly 1 stop")
        terminal.type("y")
        terminal.until("in the air")
        terminal.interrupt()
        at = terminal.until("What shall it do?")
        terminal.type("g")
        at = terminal.until("it is left as it is", at)
        terminal.interrupt()
        at = terminal.until("What shall it do?", at)
        terminal.type("hold")
        at = terminal.until("BRAKE, as you ordered", at)
        terminal.interrupt()
        at = terminal.until("It does as you ordered", at)
        terminal.type("r")
        at = terminal.until("RTL, as you ordered", at)
        assert terminal.code() == 6
    assert "it was to return by your order" in terminal.shown
    assert "Traceback" not in terminal.shown


def test_ctrl_c_twice_leaves_the_mission_alone_and_ends(tmp_path):
    file = mission_file(tmp_path, "px4", 1, 60.0)
    with (
        vehicle("px4", speed=10) as (_, (line,)),
        at_terminal("fly", file.name, *to(line), "--upload", folder=tmp_path) as terminal,
    ):
        terminal.until("Arm PX4")
        terminal.type("y")
        at = terminal.until("in the air")
        terminal.interrupt()
        terminal.until("What shall it do?", at)
        terminal.interrupt()
        assert terminal.code() == 5
    assert "its mission was left alone" in terminal.shown


def test_ctrl_c_before_the_yes_is_130_and_arms_nothing(tmp_path):
    file = mission_file(tmp_path, "px4")
    with (
        vehicle("px4") as (_, (line,)),
        at_terminal("fly", file.name, *to(line), "--upload", folder=tmp_path) as terminal,
    ):
        terminal.until("Arm PX4")
        terminal.interrupt()
        assert terminal.code() == 130
    assert "it was not armed" in terminal.shown


def test_the_command_imports_nothing_heavy_before_it_flies():
    code = (
        "import sys, mavplan.cli.fly, mavplan.cli.fly_console, mavplan.cli.fly_setup, mavplan.flight.run;"
        "print(*{'scipy', 'sklearn', 'cvxpy', 'pyproj', 'pydantic', 'numpy', 'mavsdk'} & sys.modules.keys())"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        == "\n"
    )
