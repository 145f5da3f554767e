"""``mavplan check``: a mission before anyone goes outside, by readers' rules and on a mock vehicle in this process."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click

from mavplan.errors import CheckError, InputError, Problem

if TYPE_CHECKING:
    from mavplan.cli.rehearsal import Rehearsal
    from mavplan.mission.model import Autopilot, Mission


@click.command("check", short_help="Check a mission or scenario against a mock vehicle.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--autopilot",
    "--firmware",
    type=click.Choice(["ardupilot", "px4"]),
    help="Only this firmware. Default: the one that FILE is for, both where it does not say.",
)
def check_command(file: Path, autopilot: str | None) -> None:
    """Check FILE: a mission (.plan, .waypoints) or a scenario (.toml), which is planned first.

    A mission file is read by the rules of QGroundControl, Mission Planner and MAVProxy, by MAVSDK's own importer
    (.plan) or pymavlink's loader (.waypoints). Then the mission is uploaded to a mock vehicle of each firmware, in this
    process, and read back. Exit code 6 if anything is wrong.

    \b
    mavplan check valley.plan
    mavplan check scenario.toml --firmware px4
    """
    from mavplan.cli.rehearsal import rehearse
    from mavplan.mission.autopilots import AUTOPILOTS

    found: list[Problem] = []
    wrong = 0
    if file.suffix.lower() == ".toml":
        missions = list(_planned(file, autopilot))  # type: ignore[arg-type]
    else:
        found = list(_file_problems(file, autopilot))  # type: ignore[arg-type]
        missions = list(_read(file, autopilot))  # type: ignore[arg-type]
        click.echo(f"{file}: {_verdict(found)}")
        wrong = sum(problem.severity == "error" for problem in found)
    _say(found)
    for firmware, mission in missions:
        outcome = rehearse(mission, firmware)
        click.echo(_outcome(AUTOPILOTS[firmware].title, outcome))
        if outcome.report is None:
            wrong += 1
            print_stored(outcome)
            _say(outcome.error.problems if isinstance(outcome.error, InputError) else ())
    if wrong:
        raise CheckError(f"{file}: do not fly this before it is mended")


def _planned(path: Path, wanted: "Autopilot | None") -> "Iterator[tuple[Autopilot, Mission]]":
    """Plan a scenario for each firmware."""
    from mavplan.cli.console import progress
    from mavplan.mission.model import Autopilot
    from mavplan.plan import make_plan
    from mavplan.scenario import load_scenario

    scenario = load_scenario(path)
    warnings: dict[str, Problem] = {}
    firmwares: Sequence[Autopilot] = (wanted,) if wanted else get_args(Autopilot)
    for firmware in firmwares:
        with progress(f"planning for {firmware}") as tell:
            vehicle = dataclasses.replace(scenario.vehicle, autopilot=firmware)
            plan = make_plan(dataclasses.replace(scenario, vehicle=vehicle), progress=tell)
        warnings |= {str(problem): problem for problem in plan.warnings}
        yield firmware, plan.built.mission
    _say(warnings.values())


def _read(path: Path, wanted: "Autopilot | None") -> "Iterator[tuple[Autopilot, Mission]]":
    """Read a mission file, for the firmware it is for, or for both."""
    from mavplan.formats.beside import read_known_mission
    from mavplan.mission.model import Autopilot

    mission = read_known_mission(path, wanted)
    _say(mission.warnings)
    firmwares: Sequence[Autopilot] = (mission.autopilot,) if mission.autopilot else get_args(Autopilot)
    for firmware in firmwares:
        yield firmware, dataclasses.replace(mission, autopilot=firmware)


def _file_problems(path: Path, wanted: "Autopilot | None") -> "Iterator[Problem]":
    """Return what other people's readers make of a mission file."""
    from mavplan.formats.beside import read_known_mission
    from mavplan.formats.checks import mavsdk_problems, pymavlink_problems, reader_problems

    mission = read_known_mission(path, wanted)
    yield from reader_problems(path, mission)
    foreign = mavsdk_problems if path.suffix.lower() == ".plan" else pymavlink_problems
    yield from foreign(path, mission)


def _say(problems: Iterable[Problem]) -> None:
    from mavplan.cli.console import say_problems

    say_problems(problems)


def _verdict(found: Sequence[Problem]) -> str:
    """Return one clause on what the readers said."""
    errors = sum(problem.severity == "error" for problem in found)
    if errors:
        return f"{errors} problems that other programs would meet"
    return "read as meant by QGroundControl's, Mission Planner's and MAVProxy's rules and by a foreign reader"


def _outcome(title: str, outcome: "Rehearsal") -> str:
    """Return the line on one mock vehicle."""
    if outcome.report is not None:
        return f"mock {title}: {outcome.report.items} items stored, read back and verified"
    return f"mock {title}: NOT verified: {outcome.error}"


def print_stored(outcome: "Rehearsal") -> None:
    """Print, item by item, what the mock holds otherwise than it was sent."""
    from rich.table import Table

    from mavplan.cli.console import stdout

    if not outcome.differences:
        return
    table = Table(box=None)
    for heading in ("item", "field", "sent", "stored", ""):
        table.add_column(heading)
    for found in outcome.differences:
        item = "" if found.seq is None else str(found.seq)
        table.add_row(item, found.field, f"{found.sent:.9g}", f"{found.stored:.9g}", str(found))
    stdout().print(table)
