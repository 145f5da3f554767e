"""A vehicle of a fleet starts when its plan says, and nobody is let start it at another time unasked."""

import dataclasses
import json
import re
import time
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from mavplan.cli.fly_console import FlyConsole
from mavplan.cli.fly_start import LATE_S, RENEW_S, Start, is_one_of_a_fleet, moment, start_of, turn_words
from mavplan.cli.outputs import write_outputs
from mavplan.flight.phases import Phase
from mavplan.part import Part
from mavplan.plan import make_plan
from mavplan.stored_plan import read_plan
from mavplan.track.tlog import TlogFrames
from tests.flight.terminal import at_terminal
from tests.flight.test_fly_command import COMMAND_LONG, fly, to
from tests.sitl_mock.process import mock
from tests.support import HOME, make_scenario

ZONE = timezone(timedelta(hours=2))
NOW = datetime(2025, 8, 18, 14, 29, 50, tzinfo=ZONE)
MISSION_START = 300
SECOND = Part("vehicle", 2, 3, "blue", None, 35.0)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("14:30", 10.0),
        ("14:30:05", 15.0),
        ("14:29:49", -1.0),
        ("02:29:51", -12 * 3600 + 1.0),
        ("2025-08-18T14:30:00+02:00", 10.0),
        ("2025-08-18T12:30:00+00:00", 10.0),
        ("2025-08-18 14:30:00", 10.0),
    ],
)
def test_a_time_of_the_clock_is_the_nearest_one_in_the_zone_of_now(text, seconds):
    assert (moment(text, NOW) - NOW).total_seconds() == seconds


def test_round_midnight_a_time_is_tonight_or_tomorrow():
    late = datetime(2025, 8, 18, 23, 59, 0, tzinfo=ZONE)
    assert moment("00:01", late) - late == timedelta(minutes=2)
    early = datetime(2025, 8, 18, 0, 1, 0, tzinfo=ZONE)
    assert moment("23:59", early) - early == timedelta(minutes=-2)


@pytest.mark.parametrize("text", ["", "now", "25:00", "14", "14:30:00:00", "2025-08-18", "1430", "nan"])
def test_what_is_no_time_is_not_taken(text):
    with pytest.raises(ValueError, match=r".*"):
        moment(text, NOW)


def test_each_vehicle_starts_so_much_after_the_first_as_its_plan_says():
    assert start_of(SECOND, NOW).at == NOW + timedelta(seconds=35)
    assert start_of(None, NOW).at == NOW
    assert start_of(SECOND, None) is None
    assert is_one_of_a_fleet(SECOND)
    assert not is_one_of_a_fleet(dataclasses.replace(SECOND, of=1))
    assert not is_one_of_a_fleet(Part("sortie", 2, 3))
    assert turn_words(SECOND) == "is vehicle 2 of 3, and starts 35 s after the first"


class Session:
    """What the console sees of a session that waits for its yes."""

    checks = ()
    questions = ()
    vehicle = None

    def __init__(self):
        self.done, self.phase, self.said, self.renewed = False, Phase.READY, [], []

    awaits_yes = property(lambda self: not self.said)

    def events(self):
        return []

    news = events

    def picture(self, now):
        return None

    def approve(self, now, *, every_question):
        self.said.append(("approved", now))

    def decline(self, why=""):
        self.said.append(("declined", why))

    def renew(self, now, fresh_s):
        self.renewed.append(now)

    def leave(self, now, why):
        self.said.append(("left", why))


def run(start, begin_s, seconds, step_s=0.25):
    """The console and what was said to the session, on a clock that begins at a time since 1970."""
    session, clock_s = Session(), begin_s
    console = FlyConsole(2, start, SECOND, clock=lambda: clock_s)
    while clock_s < begin_s + seconds and not session.said:
        console.see(session, clock_s)
        clock_s += step_s
    return session


def test_the_yes_is_given_at_the_moment_of_the_start_and_the_mission_verified_before(capsys):
    start = Start(NOW)
    begin_s = NOW.timestamp() - 60
    session = run(start, begin_s, 90)
    ((said, at_s),) = session.said
    assert said == "approved"
    assert 0 <= at_s - NOW.timestamp() <= 0.25
    assert session.renewed
    assert session.renewed[0] == pytest.approx(NOW.timestamp() - RENEW_S, abs=0.25)
    told = [line for line in capsys.readouterr().err.splitlines() if "starts at" in line]
    assert told == ["starts at 14:29:50, in 1:00; Ctrl-C: it stays on the ground"]


def test_a_start_that_is_missed_is_declined():
    session = run(Start(NOW), NOW.timestamp() + LATE_S + 1, 5)
    ((said, why),) = session.said
    assert said == "declined"
    assert "it was to start at 14:29:50, 4 s ago" in why


def test_a_start_that_is_hardly_late_is_made():
    assert run(Start(NOW), NOW.timestamp() + LATE_S - 0.5, 5).said[0][0] == "approved"


def plan_files(folder: Path, part: Part | None = SECOND, autopilot="px4"):
    plan = make_plan(make_scenario([(150, 0)], demand_mbit=20.0, autopilot=autopilot))
    write_outputs(dataclasses.replace(plan, part=part), [folder / "fleet-2.plan"])
    return folder / "fleet-2.plan"


def at_home(firmware="px4", speed=30):
    home = f"{HOME.lat_deg},{HOME.lon_deg},{HOME.alt_amsl_m:g}"
    return mock("--firmware", firmware, "--conn", "udpin:127.0.0.1:0", "--home", home, "--speed", str(speed))


def test_the_plan_is_read_back_with_its_part(tmp_path):
    file = plan_files(tmp_path)
    assert read_plan(file).part == SECOND


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--yes",), "is vehicle 2 of 3, and starts 35 s after the first: --start-at says when"),
        (("--yes", "--start-at", "2020-01-01T00:00:00"), "it was to start at 00:00:35"),
        (("--yes", "--start-at", "soon"), "is no time of the clock"),
        (("--yes", "--start-at", "14:30", "--watch"), "cannot go with --start-at"),
    ],
)
def test_a_start_at_no_time_or_a_past_one_is_2_and_nothing_is_begun(tmp_path, more, words):
    file = plan_files(tmp_path)
    ran = fly(file.name, "--conn", "udpout:127.0.0.1:9", *more, folder=tmp_path)
    assert ran.returncode == 2
    assert words in re.sub(r"\s+", " ", ran.stderr)
    assert "Traceback" not in ran.stderr
    assert list(tmp_path.glob("*.tlog")) == []


def test_a_vehicle_of_a_fleet_waits_for_its_start_and_then_flies(tmp_path):
    file = plan_files(tmp_path, dataclasses.replace(SECOND, start_s=3.0))
    first = datetime.now().astimezone().replace(microsecond=0) + timedelta(seconds=7)
    with at_home() as (_, (line,)):
        ran = fly(
            file.name,
            *to(line),
            "--upload",
            "--yes",
            "--json",
            "--start-at",
            first.isoformat(),
            folder=tmp_path,
        )
        ended_s = time.time()
    assert ran.returncode == 0, ran.stderr
    assert f"starts at {first + timedelta(seconds=3):%H:%M:%S}" in ran.stderr
    assert ended_s > first.timestamp() + 3
    (recording,) = tmp_path.glob("*.tlog")
    started_us = [
        frame.time_us
        for frame in TlogFrames(recording.read_bytes())
        if (frame.system, frame.message_id) == (255, COMMAND_LONG)
        and int.from_bytes(frame.payload.ljust(33, b"\0")[28:30], "little") == MISSION_START
    ]
    assert json.loads(ran.stdout)["outcome"] == "flown"
    assert 0 <= started_us[0] / 1e6 - (first.timestamp() + 3) < 3


def test_at_a_terminal_it_is_asked_whether_it_is_time(tmp_path):
    file = plan_files(tmp_path, SECOND)
    with (
        at_home() as (_, (line,)),
        at_terminal("fly", file.name, *to(line), "--upload", folder=tmp_path) as terminal,
    ):
        terminal.until("Arm PX4, system 1, and fly 1 stop")
        terminal.type("y")
        terminal.until("It is vehicle 2 of 3, and starts 35 s after the first. Is it time?")
        terminal.type("n")
        assert terminal.code() == 4
    assert "it was not armed" in terminal.shown


def test_ctrl_c_while_it_waits_leaves_it_on_the_ground(tmp_path):
    file = plan_files(tmp_path, SECOND)
    soon = datetime.now().astimezone() + timedelta(minutes=5)
    with (
        at_home() as (_, (line,)),
        at_terminal(
            *("fly", file.name, *to(line), "--upload", "--start-at", soon.isoformat()), folder=tmp_path
        ) as terminal,
    ):
        terminal.until("Arm PX4, system 1")
        terminal.type("y")
        terminal.until("it stays on the ground")
        terminal.interrupt()
        assert terminal.code() == 130
    assert "it was not armed" in terminal.shown
