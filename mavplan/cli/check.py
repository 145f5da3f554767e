"""``mavplan check``: a mission before anyone goes outside, by readers' rules, uploaded to a mock vehicle and flown."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from mavplan.cli.kinds import Files
from mavplan.cli.streams import DASH, read_scenario
from mavplan.errors import CheckError, InputError, MavplanError, Problem

if TYPE_CHECKING:
    from mavplan.cli.flight_rehearsal import World
    from mavplan.cli.rehearsal import Rehearsal
    from mavplan.mission.model import Autopilot, Mission
    from mavplan.stored_plan import StoredPlan

    _Checked = tuple[Autopilot, Mission, StoredPlan | None]


@click.command("check", short_help="Check a mission or scenario against a mock vehicle.")
@click.argument("file", type=Files(".plan", ".waypoints", ".toml", dash=True))
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
    """Check FILE: a mission (.plan, .waypoints) or a scenario (.toml, or - for standard input), planned first.

    A mission file is read by the rules of QGroundControl, Mission Planner and MAVProxy, by MAVSDK's own importer
    (.plan) or pymavlink's loader (.waypoints). Then the mission is uploaded to a mock vehicle of each firmware, in this
    process, and read back. Where its plan is known (a scenario, or the .mavplan.json beside FILE) the mock flies it,
    and what every user received is worked out as mavplan prove does. Pinned stops must be at their places, in order,
    held long enough. A proof that no plan is better, which planners length and time leave in the plan, is checked
    without the planner. Exit code 6 if anything is wrong.

    \b
    mavplan check valley.plan
    mavplan check scenario.toml --firmware px4 --wind 6@270
    mavplan check valley.plan --fault hold-cut=8,position-lost=6/30s
    """
    from mavplan.cli.console import answer, problem_objects, progress, say_problems, tell, tell_next
    from mavplan.cli.flight_rehearsal import make_world
    from mavplan.cli.rehearsal import rehearse
    from mavplan.mission.autopilots import AUTOPILOTS

    world = make_world(wind, ",".join(faults), seed)
    found: list[Problem] = []
    wrong = 0
    is_scenario = file == DASH or file.suffix.lower() == ".toml"
    if is_scenario:
        missions = list(_planned(file, autopilot))  # type: ignore[arg-type]
    else:
        found = list(_file_problems(file, autopilot))  # type: ignore[arg-type]
        missions = list(_read(file, autopilot))  # type: ignore[arg-type]
        tell(f"{file}: {_verdict(found)}")
        wrong = sum(problem.severity == "error" for problem in found)
    say_problems(found)
    vehicles: list[dict[str, Any]] = []
    for firmware, mission, plan in missions:
        title = AUTOPILOTS[firmware].title
        proved = None if plan is None else proves(plan)
        pinned = None if plan is None else keeps_pinned(plan, mission)
        if vehicles and vehicles[-1]["flight"] is not None:
            tell()
        with progress(f"uploading: mock {title}"):
            outcome = rehearse(mission, firmware)
        tell(_outcome(title, outcome))
        flight = None
        if outcome.report is None:
            print_stored(outcome)
            say_problems(outcome.error.problems if isinstance(outcome.error, InputError) else ())
        elif plan is not None and not no_flight:
            flight = flies(mission, plan, world)
        well = (
            outcome.report is not None and False not in (proved, pinned) and (flight is None or flight["ok"])
        )
        wrong += 0 if well else 1
        told = {"autopilot": firmware, "ok": well, "stored": outcome.report is not None}
        told |= {"error": _words(outcome.error), "bound_proved": proved, "pinned_kept": pinned}
        vehicles.append(told | {"flight": flight})
    answer({"ok": not wrong, "file": str(file), "readers": problem_objects(found), "vehicles": vehicles})
    if wrong:
        raise CheckError(f"{file}: do not fly this before it is mended")
    if is_scenario:
        tell_next("mavplan", "plan", file, why="writes the mission")
    else:
        tell_next("mavplan", "upload", file, "--conn", "udp:0.0.0.0:14550", why="onto your vehicle")


def _words(error: MavplanError | None) -> str | None:
    return None if error is None else str(error)


PROVED = {
    "path_m": ("path", "m"),
    "tour_m": ("path and way home", "m"),
    "mission_s": ("mission before rounding", "s"),
}
"""What a bound is on, and its unit."""


def proves(plan: "StoredPlan") -> bool | None:
    """Check the proof of a plan's bound, where it holds one, print what it proves, and return whether it does.

    None: it holds none.
    """
    from mavplan.bounds.path import CertificateError
    from mavplan.bounds.stored import prove_bound
    from mavplan.cli.console import progress, say_problems, tell

    try:
        with progress("checking the proof of the plan's bound"):
            found = prove_bound(plan)
    except CertificateError as error:
        say_problems([Problem(f"{plan.label}, certificate", str(error), "certificate")])
        return False
    if found is not None:
        what, unit = PROVED[found.stated.objective]
        tell(
            f"plan: {what} {found.stated.plan:,.1f} {unit}, proved anew: at least {found.proved:,.1f} {unit}"
        )
    return None if found is None else True


def keeps_pinned(plan: "StoredPlan", mission: "Mission") -> bool | None:
    """Check the pinned stops of a plan, print what is found, and return whether all is kept; None: it has none."""
    from mavplan.cli.console import counted, say_problems, tell
    from mavplan.proof.pinned import pinned_faults

    if not plan.scenario.stops:
        return None
    found = list(pinned_faults(plan, mission))
    say_problems(found)
    if not found:
        tell(
            f"plan: {counted(len(plan.scenario.stops), 'pinned stop')} at their places, in order, held long enough"
        )
    return not found


def flies(mission: "Mission", plan: "StoredPlan", world: "World") -> dict[str, Any]:
    """Fly a mission on the mock, print what every user received, and return it: ``ok`` where all was well."""
    from mavplan.cli.console import progress, say_problems, tell
    from mavplan.cli.flight_rehearsal import idle_faults, rehearse_flight
    from mavplan.cli.proof_tables import print_proof, shortfall, to_json
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.proof.prove import prove
    from mavplan.track.telemetry import read_tlog

    name = f"mock {AUTOPILOTS[plan.autopilot].title}"
    say_problems(idle_faults(mission, world))
    vehicle = plan.scenario.vehicle
    with progress(f"flying: {name}") as move:
        flown = rehearse_flight(
            mission, world, mass_kg=vehicle.mass_kg, battery_wh=vehicle.battery_wh, progress=move
        )
    tell(f"{name}: {flown.report.words if flown.report else 'NOT flown'}")
    if flown.error is not None:
        say_problems([Problem(name, str(flown.error), "flight")])
    told = {"ok": False, "ended": flown.report.words if flown.report else None, "error": _words(flown.error)}
    if flown.report is None:
        return told | {"proof": None}
    try:
        proof = prove(plan, read_tlog(flown.tlog, name))
    except InputError as error:
        say_problems(error.problems)
        return told | {"proof": None}
    say_problems(proof.notes)
    tell()
    print_proof(proof)
    if not proof.all_met:
        say_problems([Problem(name, str(shortfall(proof)), "short")])
    return told | {"ok": proof.all_met and flown.error is None, "proof": to_json(proof)}


def _planned(path: Path, wanted: "Autopilot | None") -> "Iterator[_Checked]":
    """Plan a scenario for each firmware."""
    from mavplan.cli.console import progress, say_problems
    from mavplan.mission.model import Autopilot
    from mavplan.plan import make_plan
    from mavplan.plan_file import dumps
    from mavplan.stored_plan import parse_plan

    scenario = read_scenario(path)
    warnings: dict[str, Problem] = {}
    firmwares: Sequence[Autopilot] = (wanted,) if wanted else get_args(Autopilot)
    for firmware in firmwares:
        with progress(f"planning for {firmware}") as tell:
            vehicle = dataclasses.replace(scenario.vehicle, autopilot=firmware)
            plan = make_plan(dataclasses.replace(scenario, vehicle=vehicle), progress=tell)
        warnings |= {str(problem): problem for problem in plan.warnings}
        yield firmware, plan.built.mission, parse_plan(dumps(plan), str(path))
    say_problems(warnings.values())


def _read(path: Path, wanted: "Autopilot | None") -> "Iterator[_Checked]":
    """Read a mission file, for the firmware it is for, or for both, with the plan beside it where it is this one's."""
    from mavplan.cli.console import say_problems
    from mavplan.cli.fly_setup import plan_of
    from mavplan.flight.route import make_route
    from mavplan.formats.beside import read_known_mission
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.mission.model import Autopilot

    mission = read_known_mission(path, wanted)
    say_problems(mission.warnings)
    firmwares: Sequence[Autopilot] = (mission.autopilot,) if mission.autopilot else get_args(Autopilot)
    for firmware in firmwares:
        plan, noticed = plan_of(path, make_route(mission, AUTOPILOTS[firmware]))
        say_problems(noticed)
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
    from mavplan.cli.console import plain_table, print_table

    if not outcome.differences:
        return
    table = plain_table()
    for heading in ("item", "field", "sent", "stored", ""):
        table.add_column(heading)
    for found in outcome.differences:
        item = "" if found.seq is None else str(found.seq)
        table.add_row(item, found.field, f"{found.sent:.9g}", f"{found.stored:.9g}", str(found))
    print_table(table)
