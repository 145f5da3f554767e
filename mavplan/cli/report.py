"""``mavplan report``: a plan, or the plans of several flights, as one page to look at, print and hand over."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.kinds import Files
from mavplan.cli.streams import DASH, named_outputs, write_outputs_of

if TYPE_CHECKING:
    from mavplan.comparison import Comparison
    from mavplan.errors import Problem
    from mavplan.mission.model import Mission
    from mavplan.scenario.model import Scenario
    from mavplan.stored_plan import StoredPlan

QUICK_USERS = 60
"""Up to so many users the comparison has the planners that search, too; each of them may search for long among more."""

FAR_M = 100_000.0
"""Flights that begin farther apart are not on one map."""


@click.command("report", short_help="Write a plan as one page to look at and print.")
@click.argument(
    "files", type=Files(".plan", ".waypoints", ".json"), nargs=-1, required=True, metavar="FILE..."
)
@click.option(
    "-o",
    "--output",
    type=Files(".html", ".htm", dash=True),
    metavar="FILE",
    help="Write this file. Default: the mission's name with .html, beside it, of several what their names begin with; "
    "- is standard output.",
)
@click.option("--title", help="Heading of the page. Default: the mission's name.")
@click.option(
    "--compare/--no-compare",
    "with_planners",
    default=True,
    show_default=True,
    help="Put the other planners' figures on the same users beside the plan's; of one flight only.",
)
def report_command(
    files: tuple[Path, ...], output: Path | None, title: str | None, with_planners: bool
) -> None:
    """Write a report of FILE, a mission with its plan beside it (.mavplan.json), or of several flights together.

    One HTML file that needs no network: map, height and holds over time, stops, users, mission items.

    \b
    mavplan report valley.plan
    mavplan report valley.plan -o for-the-pilot.html --title "Valley, second flight" --no-compare
    mavplan report valley-1.plan valley-2.plan valley-3.plan -o valley.html
    """
    from mavplan.cli.console import answer, note, say_problems, tell_written
    from mavplan.errors import InputError, Problem
    from mavplan.formats.beside import mission_beside, plan_path, read_known_mission
    from mavplan.geo import LocalPlane
    from mavplan.report.content import report_content
    from mavplan.report.page import render
    from mavplan.stored_plan import read_plan

    names = [mission_beside(file) if file.name.endswith(".json") else file for file in files]
    output = output or _default_output(names)
    if output == DASH:
        output = named_outputs([output], "html")[0]
    if output.suffix.lower() not in {".html", ".htm"}:
        raise InputError([Problem(str(output), "a report is a page: its name ends in .html", "format")])
    missions = [read_known_mission(name) for name in names]
    plans = [read_plan(plan_path(name)) for name in names]
    _check_near(names, missions)
    found, said = None, [problem for mission in missions for problem in mission.warnings]
    if with_planners and len(plans) == 1:
        found, left_out = _compared(plans[0], names[0].parent)
        said += left_out
    note("writing")
    home = missions[0].home
    plane = LocalPlane(home.lat_e7 / 1e7, home.lon_e7 / 1e7)
    contents = [
        report_content(mission, plan, name.stem, found, plane)
        for mission, plan, name in zip(missions, plans, names, strict=True)
    ]
    write_outputs_of([(output, render(*contents, title=title or _stem(names)))])
    say_problems(said)
    tell_written([output])
    answer({"written": [str(output)]})


def _stem(names: Sequence[Path]) -> str:
    """Return what the names begin with: ``valley`` of ``valley-1.plan`` and ``valley-2.plan``."""
    stem = names[0].stem
    while not all(name.stem.startswith(stem) for name in names):
        stem = stem[:-1]
    return (stem if len(names) == 1 else stem.rstrip("-_. ")) or "flights"


def _default_output(names: Sequence[Path]) -> Path:
    return names[0].with_name(f"{_stem(names)}.html")


def _check_near(names: Sequence[Path], missions: Sequence["Mission"]) -> None:
    """Raise where flights are not of one place: one map cannot show them."""
    from mavplan.errors import InputError, Problem
    from mavplan.geo import geodesic_distance_m

    first = missions[0].home
    problems = []
    for name, mission in zip(names, missions, strict=True):
        home = mission.home
        far_m = float(
            geodesic_distance_m(first.lat_e7 / 1e7, first.lon_e7 / 1e7, home.lat_e7 / 1e7, home.lon_e7 / 1e7)
        )
        if far_m > FAR_M:
            message = (
                f"begins {far_m / 1000:,.0f} km away from {names[0].name}: make a page of its own for it"
            )
            problems.append(Problem(str(name), message, "far-apart"))
    if problems:
        raise InputError(problems)


def _compared(plan: "StoredPlan", folder: Path) -> tuple["Comparison | None", list["Problem"]]:
    """Return the other planners on the same users; None with the reason where they cannot be planned."""
    from mavplan.cli.console import progress
    from mavplan.comparison import PAPERS, compare
    from mavplan.errors import InputError, Problem
    from mavplan.planners import PLANNERS

    names = PLANNERS if len(plan.scenario.users) <= QUICK_USERS else PAPERS
    try:
        scenario = _over_its_ground(plan, folder)
        with progress("comparing") as tell:
            return compare(scenario, tell, [name for name in names if name != plan.planner]), []
    except InputError as error:
        reasons = "; ".join(str(problem) for problem in error.problems)
        message = f"the other planners are left out of the page: {reasons}"
        return None, [Problem("--compare", message, "no-comparison", "warning")]


def _over_its_ground(plan: "StoredPlan", folder: Path) -> "Scenario":
    """Return the scenario of a plan with the ground that it was planned over: its file is not in the plan.

    Raises
    ------
    InputError
        The file is not there, or is not what it was.
    """
    from mavplan.errors import InputError, Problem
    from mavplan.plan_file import fingerprint
    from mavplan.scenario.report import Report
    from mavplan.scenario.terrain import ground_of

    if plan.scenario.terrain_options.file is None:
        return plan.scenario
    report = Report()
    places = [f"user {name}" for name in plan.scenario.users.names]
    ground = ground_of(plan.scenario, places, folder, plan.label, report)
    report.raise_errors()
    scenario = dataclasses.replace(plan.scenario, terrain=ground)
    if plan.fingerprint and fingerprint(scenario) != plan.fingerprint:
        message = "is not the ground that the plan was made over"
        raise InputError([Problem("[terrain] file", message, "other-ground")])
    return scenario
