"""``mavplan check``: a mission before anyone goes outside, by readers' rules, uploaded to a mock vehicle and flown."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click

from mavplan.errors import CheckError, InputError, Problem

if TYPE_CHECKING:
    from mavplan.cli.flight_rehearsal import World
    from mavplan.cli.rehearsal import Rehearsal
    from mavplan.mission.model import Autopilot, Mission
    from mavplan.stored_plan import StoredPlan

    _Checked = tuple[Autopilot, Mission, StoredPlan | None]


@click.command("check", short_help="Check a mission or scenario against a mock vehicle.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--autopilot",
    "--firmware",
    type=click.Choice(["ardupilot", "px4"]),
    help="Only this firmware. Default: the one that FILE is for, both where it does not say.",
)
@click.option("--no-flight", is_flag=True, help="Upload the mission, but do not fly it.")
@click.option("--wind", metavar="SPEED@FROM", help="Fly in this wind: m/s, degrees it comes from.")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAMES",
    help="Fly with this going wrong, as mavplan sim --help lists it: hold-cut=8, gust=6/200m …; may be given again.",
)
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, help="Of drift, gusts and faults.")
def check_command(
    file: Path, autopilot: str | None, no_flight: bool, wind: str | None, faults: tuple[str, ...], seed: int
) -> None:
    """Check FILE: a mission (.plan, .waypoints) or a scenario (.toml), which is planned first.

    A mission file is read by the rules of QGroundControl, Mission Planner and MAVProxy, by MAVSDK's own importer
    (.plan) or pymavlink's loader (.waypoints). Then the mission is uploaded to a mock vehicle of each firmware, in this
    process, and read back. Where its plan is known (a scenario, or the .mavplan.json beside FILE) the mock flies it,
    and what every user received is worked out as mavplan prove does. A proof that no plan is better, which planner
    length leaves in the plan, is checked without the planner. Exit code 6 if anything is wrong.

    \b
    mavplan check valley.plan
    mavplan check scenario.toml --firmware px4 --wind 6@270
    mavplan check valley.plan --fault hold-cut=8,position-lost=6/30s
    """
    from mavplan.cli.flight_rehearsal import make_world
    from mavplan.cli.rehearsal import rehearse
    from mavplan.mission.autopilots import AUTOPILOTS

    world = make_world(wind, ",".join(faults), seed)
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
    for firmware, mission, plan in missions:
        wrong += 0 if plan is None or proves(plan) else 1
        outcome = rehearse(mission, firmware)
        click.echo(_outcome(AUTOPILOTS[firmware].title, outcome))
        if outcome.report is None:
            wrong += 1
            print_stored(outcome)
            _say(outcome.error.problems if isinstance(outcome.error, InputError) else ())
        elif plan is not None and not no_flight:
            wrong += 0 if flies(mission, plan, world) else 1
    if wrong:
        raise CheckError(f"{file}: do not fly this before it is mended")


def proves(plan: "StoredPlan") -> bool:
    """Check the proof of a plan's bound, where it holds one, print what it proves, and return whether it does."""
    from mavplan.bounds.path import CertificateError
    from mavplan.bounds.stored import prove_bound

    try:
        found = prove_bound(plan)
    except CertificateError as error:
        _say([Problem(f"{plan.label}, certificate", str(error), "certificate")])
        return False
    if found is not None:
        what = "path and way home" if found.stated.objective == "tour_m" else "path"
        click.echo(f"plan: {what} {found.stated.plan:,.1f} m, proved anew: at least {found.proved:,.1f} m")
    return True


def flies(mission: "Mission", plan: "StoredPlan", world: "World") -> bool:
    """Fly a mission on the mock, print what every user received, and return whether all was well."""
    from mavplan.cli.console import progress
    from mavplan.cli.flight_rehearsal import idle_faults, rehearse_flight
    from mavplan.cli.proof_tables import print_proof, shortfall
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.proof.prove import prove
    from mavplan.track.telemetry import read_tlog

    name = f"mock {AUTOPILOTS[plan.autopilot].title}"
    _say(idle_faults(mission, world))
    vehicle = plan.scenario.vehicle
    with progress(f"flying: {name}") as tell:
        flown = rehearse_flight(
            mission, world, mass_kg=vehicle.mass_kg, battery_wh=vehicle.battery_wh, progress=tell
        )
    click.echo(f"{name}: {flown.report.words if flown.report else 'NOT flown'}")
    if flown.error is not None:
        _say([Problem(name, str(flown.error), "flight")])
    if flown.report is None:
        return False
    try:
        proof = prove(plan, read_tlog(flown.tlog, name))
    except InputError as error:
        _say(error.problems)
        return False
    _say(proof.notes)
    click.echo()
    print_proof(proof)
    click.echo()
    if not proof.all_met:
        _say([Problem(name, str(shortfall(proof)), "short")])
    return proof.all_met and flown.error is None


def _planned(path: Path, wanted: "Autopilot | None") -> "Iterator[_Checked]":
    """Plan a scenario for each firmware."""
    from mavplan.cli.console import progress
    from mavplan.mission.model import Autopilot
    from mavplan.plan import make_plan
    from mavplan.plan_file import dumps
    from mavplan.scenario import load_scenario
    from mavplan.stored_plan import parse_plan

    scenario = load_scenario(path)
    warnings: dict[str, Problem] = {}
    firmwares: Sequence[Autopilot] = (wanted,) if wanted else get_args(Autopilot)
    for firmware in firmwares:
        with progress(f"planning for {firmware}") as tell:
            vehicle = dataclasses.replace(scenario.vehicle, autopilot=firmware)
            plan = make_plan(dataclasses.replace(scenario, vehicle=vehicle), progress=tell)
        warnings |= {str(problem): problem for problem in plan.warnings}
        yield firmware, plan.built.mission, parse_plan(dumps(plan), str(path))
    _say(warnings.values())


def _read(path: Path, wanted: "Autopilot | None") -> "Iterator[_Checked]":
    """Read a mission file, for the firmware it is for, or for both, with the plan beside it where it is this one's."""
    from mavplan.cli.fly_setup import plan_of
    from mavplan.flight.route import make_route
    from mavplan.formats.beside import read_known_mission
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.mission.model import Autopilot

    mission = read_known_mission(path, wanted)
    _say(mission.warnings)
    firmwares: Sequence[Autopilot] = (mission.autopilot,) if mission.autopilot else get_args(Autopilot)
    for firmware in firmwares:
        plan, noticed = plan_of(path, make_route(mission, AUTOPILOTS[firmware]))
        _say(noticed)
        known = plan if plan is not None and plan.autopilot == firmware else None
        yield firmware, dataclasses.replace(mission, autopilot=firmware), known


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
