"""``mavplan report``: a plan as one page to look at, print and hand over."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.kinds import Files
from mavplan.cli.streams import DASH, named_outputs, write_outputs_of

if TYPE_CHECKING:
    from mavplan.comparison import Comparison
    from mavplan.stored_plan import StoredPlan


@click.command("report", short_help="Write a plan as one page to look at and print.")
@click.argument("file", type=Files(".plan", ".waypoints", ".json"))
@click.option(
    "-o",
    "--output",
    type=Files(".html", ".htm", dash=True),
    metavar="FILE",
    help="Write this file. Default: the mission's name with .html, beside it; - is standard output.",
)
@click.option("--title", help="Heading of the page. Default: the mission's name.")
@click.option(
    "--compare/--no-compare",
    "with_planners",
    default=True,
    show_default=True,
    help="Put the other planners' figures on the same users beside the plan's.",
)
def report_command(file: Path, output: Path | None, title: str | None, with_planners: bool) -> None:
    """Write a report of FILE, a mission with its plan beside it (.mavplan.json).

    One HTML file that needs no network: map, height and holds over time, stops, users, mission items.

    \b
    mavplan report valley.plan
    mavplan report valley.plan -o for-the-pilot.html --title "Valley, second flight" --no-compare
    """
    from mavplan.cli.console import answer, note, say_problems, tell_written
    from mavplan.errors import InputError, Problem
    from mavplan.formats.beside import mission_beside, plan_path, read_known_mission
    from mavplan.report.content import report_content
    from mavplan.report.page import render
    from mavplan.stored_plan import read_plan

    mission_file = mission_beside(file) if file.name.endswith(".json") else file
    output = output or mission_file.with_suffix(".html")
    if output == DASH:
        output = named_outputs([output], "html")[0]
    if output.suffix.lower() not in {".html", ".htm"}:
        raise InputError([Problem(str(output), "a report is a page: its name ends in .html", "format")])
    mission = read_known_mission(mission_file)
    plan = read_plan(plan_path(mission_file))
    # Over real ground the others would have to be planned from the scenario, whose terrain is not in the plan.
    found = _compared(plan) if with_planners and plan.scenario.terrain_options.file is None else None
    note("writing")
    content = report_content(mission, plan, title or mission_file.stem, found)
    write_outputs_of([(output, render(content, mission.warnings))])
    say_problems(mission.warnings)
    tell_written([output])
    answer({"written": [str(output)]})


def _compared(plan: "StoredPlan") -> "Comparison":
    from mavplan.cli.console import progress
    from mavplan.comparison import compare

    with progress("comparing") as tell:
        return compare(plan.scenario, tell)
