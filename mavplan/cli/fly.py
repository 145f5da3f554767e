"""``mavplan fly``: a mission from the list before the start to the motors' stop, watched and recorded."""

import sys
import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.fly_start import ClockTime, Start, is_one_of_a_fleet, start_of, turn_words
from mavplan.cli.kinds import Files
from mavplan.cli.link_options import home_options, link_options, open_link
from mavplan.errors import ExitCode, InputError, Problem, RefusedError

if TYPE_CHECKING:
    from mavplan.cli.fly_setup import Flight
    from mavplan.flight.conductor import FlySession
    from mavplan.flight.recording import Recording
    from mavplan.flight.route import Route
    from mavplan.flight.run import Hands

INTERRUPTED = 130


@click.command("fly", short_help="Fly a mission, watch it and record it.")
@click.argument("file", type=Files(".plan", ".waypoints"))
@link_options(None, "the flight's forecast and half as much again, and 2 minutes, from the start on")
@click.option(
    "--autopilot", type=click.Choice(["ardupilot", "px4"]), help="The firmware, where FILE does not say."
)
@click.option(
    "--upload", is_flag=True, help="Put the mission onto the vehicle first, as mavplan upload does."
)
@click.option("--watch", is_flag=True, help="Start nothing; watch what is flown, or is going to be.")
@click.option(
    "--yes",
    count=True,
    help="Do not ask before arming. Given twice: nor about an end that does not come home.",
)
@click.option(
    "--start-at",
    type=ClockTime(),
    help="Start at this time of the clock (14:30:00); the vehicles of a fleet are all given the time of the first, and "
    "each starts as much later as its plan says.",
)
@home_options("home or place")
@click.option(
    "--min-battery",
    "min_battery_percent",
    type=click.FloatRange(0, 100),
    default=30.0,
    show_default=True,
    metavar="PERCENT",
    help="Refuse to start with less than this left.",
)
@click.option(
    "--arm-timeout",
    "arm_s",
    type=click.FloatRange(min=0, min_open=True),
    default=90.0,
    show_default=True,
    metavar="S",
    help="How long it is tried to arm a vehicle that is not ready yet.",
)
@click.option(
    "--record",
    "record_file",
    type=click.Path(path_type=Path),
    metavar="FILE.tlog",
    help="Where the recording goes, which must not be there. Default: beside FILE, with date and time.",
)
@click.option("--no-record", is_flag=True, help="Record nothing.")
def fly_command(
    file: Path,
    conn: str,
    system: int | None,
    timeout_s: float | None,
    signing_key: Path | None,
    autopilot: str | None,
    upload: bool,
    watch: bool,
    yes: int,
    start_at: datetime | None,
    max_home_distance_m: float,
    max_home_height_m: float | None,
    min_battery_percent: float,
    arm_s: float,
    record_file: Path | None,
    no_record: bool,
) -> int:
    """Fly the mission in FILE (.plan or .waypoints) that the vehicle holds: check, ask, arm, start, watch, record.

    Everything that stands against the flight is listed at once. Nothing is armed before a yes. In flight Ctrl-C asks
    what the vehicle shall do; losing the link, or mavplan, changes nothing about its mission.

    Exit code 0: flown to its end and landed, or where it is to stay. 2: bad usage. 3: no vehicle was heard. 4: not
    started, with the reason. 5: how it ended is not known. 6: it ended otherwise than planned.

    \b
    mavplan fly valley.plan --conn udp:0.0.0.0:14550
    mavplan fly valley.plan --conn udp:0.0.0.0:14550 --upload
    mavplan fly valley-2.plan --conn udp:0.0.0.0:14551 --upload --start-at 14:30:00
    """
    from mavplan.cli.console import is_terminal, mode, say_problems, tell_next
    from mavplan.cli.fly_console import FlyConsole
    from mavplan.cli.fly_setup import Setup, make_session, open_recording, read_flight
    from mavplan.flight.run import fly
    from mavplan.formats.beside import home_height_limit_m
    from mavplan.link.endpoint import parse_endpoint

    endpoint = parse_endpoint(conn)
    _check_usage(upload, watch, record_file, no_record, start_at)
    flight = read_flight(file, autopilot, timeout_s)  # type: ignore[arg-type]
    start = start_of(flight.part, start_at)
    if not watch:
        _check_the_start(flight, start, yes, is_terminal(sys.stdin) and is_terminal(sys.stderr))
        _check_that_somebody_says_yes(flight.route, yes, is_terminal(sys.stdin) and is_terminal(sys.stderr))
    say_problems(flight.warnings)
    if system is None and flight.part is not None:
        system = flight.part.system
    setup = Setup(
        upload=upload,
        watch=watch,
        system=system,
        place=str(endpoint),
        source=str(file),
        timeout_s=timeout_s,
        arm_s=arm_s,
        max_home_distance_m=max_home_distance_m,
        max_home_height_m=home_height_limit_m(file, max_home_height_m),
        min_battery_percent=min_battery_percent,
    )
    fleet = flight.part if is_one_of_a_fleet(flight.part) else None
    console = FlyConsole(yes, start, fleet, quiet=mode().quiet)
    with (
        open_recording(file, record_file, wanted=not no_record) as recording,
        open_link(endpoint, timeout_s, signing_key) as connection,
        console.signals(),
    ):
        session = make_session(flight, setup)
        hands = Remembering(file, console)
        fly(session, connection, hands, recording.write if recording is not None else None)
        kept = _kept(session, recording, asked_for=record_file is not None)
    if recording is not None and recording.failed:
        message = f"ended after {recording.frames:,} frames: {recording.failed}"
        say_problems([Problem(str(recording.path), message, "recording", "warning")])
    if session.uploaded is not None:
        say_problems([*session.uploaded.warnings, *hands.problems])
    code = _end(session, console.interrupted, kept)
    if kept is not None and code == ExitCode.DONE:
        tell_next("mavplan", "prove", kept, "--plan", file, why="what every user received")
    return code


class Remembering:
    """Hands that write beside the mission file which vehicle holds it, as soon as that is verified.

    Parameters
    ----------
    file
        What is uploaded.
    hands
        Who shows and decides.
    """

    def __init__(self, file: Path, hands: "Hands") -> None:
        self.problems: tuple[Problem, ...] = ()
        """What there is to be said of the writing, once the flight is over."""
        self._file = file
        self._hands = hands
        self._written = False

    def see(self, session: "FlySession", now: float) -> None:
        """Write it once, and hand on."""
        if not self._written and session.uploaded is not None:
            from mavplan.formats.beside import remember_vehicle

            self._written = True
            self.problems = remember_vehicle(self._file, session.uploaded)
        self._hands.see(session, now)


def _check_usage(
    upload: bool, watch: bool, record_file: Path | None, no_record: bool, start_at: datetime | None
) -> None:
    """Refuse what does not go together.

    Raises
    ------
    InputError
        All of it.
    """
    problems = []
    if upload and watch:
        problems.append(Problem("--watch", "changes nothing, so it cannot go with --upload", "usage"))
    if start_at is not None and watch:
        problems.append(Problem("--watch", "starts nothing, so it cannot go with --start-at", "usage"))
    if record_file is not None and no_record:
        problems.append(Problem("--record", "cannot go with --no-record", "usage"))
    if problems:
        raise InputError(problems)


def _check_the_start(flight: "Flight", start: Start | None, yes: int, person: bool) -> None:
    """Refuse a start that is over, and one of a fleet whose time nobody gave or can be asked for.

    Raises
    ------
    InputError
        It is.
    """
    if start is not None and start.is_late(time.time()):
        raise InputError(
            [Problem("--start-at", f"{start.late_words(time.time())}: nothing was armed", "late")]
        )
    part = flight.part
    if part is None or not is_one_of_a_fleet(part) or start is not None or person or yes > 1:
        return
    message = (
        f"it {turn_words(part)}: --start-at says when the first one does, or a second --yes that it is time; "
        "nothing was armed"
    )
    raise InputError([Problem("start", message, "no-start")])


def _check_that_somebody_says_yes(route: "Route", yes: int, person: bool) -> None:
    """Refuse a start that nobody could agree to.

    Raises
    ------
    InputError
        There is no terminal to ask and to be answered at, and not enough was said beforehand.
    """
    wanted = 1 if route.comes_home else 2
    if person or yes >= wanted:
        return
    if yes:
        message = (
            "the mission does not come home by itself: that wants a second --yes where nobody can be asked"
        )
        raise InputError([Problem(f"end of the mission ({route.end})", message, "no-yes")])
    twice = " --yes" if wanted > 1 else ""
    raise InputError(f"nothing was armed: there is no terminal to ask at; --yes{twice} starts without asking")


def _kept(session: "FlySession", to: "Recording | None", *, asked_for: bool) -> str | None:
    """Return the recording's name; one that nobody asked for and that holds no flight is taken away."""
    if to is None:
        return None
    if session.report is None and not asked_for and not session.may_have_armed:
        to.discard()
        return None
    return str(to.path)


def _end(session: "FlySession", interrupted: bool, recording: str | None) -> int:
    """Say what came of it.

    Raises
    ------
    MavplanError
        It was not flown to its end.
    """
    from mavplan.cli.console import answer, tell
    from mavplan.cli.fly_view import report_object, summary

    report, error = session.report, session.error
    code = int(error.exit_code) if error is not None else int(ExitCode.DONE)
    if interrupted and isinstance(error, RefusedError):
        code = INTERRUPTED
    message = str(error) if error is not None else (report.words if report is not None else "")
    outcome = error.exit_code.name.lower() if error is not None else "done"
    found = report_object(
        report, session.checks, outcome=outcome, exit_code=code, message=message, recording=recording
    )
    answer(found)
    if report is not None:
        words = f"{report.words}: " if error is None else ""
        tell(f"{words}{summary(report, recording)}")
    if code == INTERRUPTED:
        click.echo(message, err=True)
        return code
    if error is not None:
        raise error
    return code
