"""``mavplan plan``: from a scenario to a table, a mission file and the plan beside it."""

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mavplan.cli.kinds import Files, Planner
from mavplan.cli.streams import format_option, named_outputs, read_scenario, stem_of
from mavplan.cli.worker_options import worker_options
from mavplan.errors import InputError, Problem

if TYPE_CHECKING:
    from mavplan.scenario.model import Scenario

WRITTEN = (".plan", ".waypoints", ".kml", ".kmz", ".gpx", ".geojson", ".csv", ".png", ".svg", ".pdf")
MAX_ALTITUDE_M = 10_000
HOVER_STYLES = ("waypoint+loiter", "loiter", "hold")


class Clusters(click.ParamType[int | str]):
    """``auto`` or a number of clusters."""

    name = "K"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | str:
        """Return ``auto`` or a positive number."""
        if value == "auto":
            return "auto"
        try:
            clusters = int(value)
        except ValueError:
            clusters = 0
        if clusters < 1:
            self.fail(f"{value!r} is neither 'auto' nor a whole number from 1", param, ctx)
        return clusters


class SortieCount(click.ParamType[int | str]):
    """``auto`` or a number of sorties."""

    name = "N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | str:
        """Return ``auto`` or a positive number."""
        if value == "auto":
            return "auto"
        try:
            count = int(value)
        except ValueError:
            count = 0
        if count < 1:
            self.fail(f"{value!r} is neither 'auto' nor a whole number from 1", param, ctx)
        return count


class Altitude(click.ParamType[float | str]):
    """``auto`` or metres."""

    name = "M"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        """Return ``auto`` or an altitude."""
        if value == "auto":
            return "auto"
        try:
            metres = float(value)
        except ValueError:
            metres = math.nan
        if not 0 < metres <= MAX_ALTITUDE_M:
            self.fail(
                f"{value!r} is neither 'auto' nor metres above 0 and at most {MAX_ALTITUDE_M:,}", param, ctx
            )
        return metres


altitude_option = click.option(
    "--altitude",
    type=Altitude(),
    help="Metres, or 'auto': the altitude at which the mission is shortest, instead of the scenario's.",
)


@click.command("plan", short_help="Plan stops, order and holds, and write the mission.")
@click.argument("scenario", type=Files(".toml", dash=True))
@click.option(
    "--planner",
    type=Planner(),
    help="tloaik, stoaik, boaik, sbw, length (the shortest path) or time (the least mission time), "
    "instead of the scenario's: tloaik.",
)
@click.option("--clusters", type=Clusters(), help="Number of clusters or 'auto', instead of the scenario's.")
@click.option(
    "--time-limit",
    "time_limit_s",
    type=click.FloatRange(0, 86400),
    metavar="S",
    help="Seconds after which a search for a proof ends, instead of the scenario's: 30.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), help="Seed of all that is random, instead of the scenario's."
)
@click.option(
    "--autopilot",
    type=click.Choice(["ardupilot", "px4"]),
    help="Firmware, instead of the scenario's [vehicle].",
)
@altitude_option
@click.option(
    "--hover",
    type=click.Choice(HOVER_STYLES),
    default=HOVER_STYLES[0],
    show_default=True,
    help="Mission items of a stop.",
)
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    type=Files(*WRITTEN, dash=True),
    metavar="FILE",
    help="Write this file: .plan, .waypoints, a map (.kml, .kmz, .gpx, .geojson), a table of the users (.csv) or a "
    "picture (.png, .svg, .pdf); may be given again; - with --format is standard output. "
    "Default: the scenario's name with .plan, in this folder.",
)
@format_option(*(suffix[1:] for suffix in WRITTEN))
@click.option(
    "--sorties",
    type=SortieCount(),
    help="Split the plan where the battery ends, into as many sorties as it takes ('auto') or at most N, of each "
    "vehicle: then what does the most for the weighted demand is flown.",
)
@click.option(
    "--vehicles",
    type=click.IntRange(min=1),
    metavar="N",
    help="Divide the users among N vehicles, so that the longest mission is short.",
)
@click.option(
    "--separation",
    "separation_m",
    type=click.FloatRange(0, 10_000),
    default=50.0,
    show_default=True,
    metavar="M",
    help="Metres that vehicles at the same height keep over the ground; 0 checks nothing.",
)
@click.option(
    "--altitude-step",
    "altitude_step_m",
    type=click.FloatRange(0, 1000),
    default=0.0,
    show_default=True,
    metavar="M",
    help="Metres that each vehicle flies higher than the one before.",
)
@worker_options
@click.option("--items", is_flag=True, help="Print time and energy of every mission item too.")
def plan_command(
    scenario: Path,
    planner: str | None,
    clusters: int | str | None,
    time_limit_s: float | None,
    seed: int | None,
    autopilot: str | None,
    altitude: float | str | None,
    hover: str,
    outputs: tuple[Path, ...],
    kind: str | None,
    sorties: int | str | None,
    vehicles: int | None,
    separation_m: float,
    altitude_step_m: float,
    jobs: int | None,
    cluster: str | None,
    items: bool,
) -> None:
    """Plan a flight for SCENARIO (a scenario.toml, or - for standard input) and write it as a mission.

    \b
    mavplan plan scenario.toml
    mavplan plan scenario.toml --clusters 6 -o valley.plan -o valley.waypoints -o valley.png
    mavplan plan scenario.toml --planner length --time-limit 60
    mavplan plan scenario.toml --altitude auto
    mavplan plan scenario.toml --items
    mavplan plan scenario.toml --sorties auto
    mavplan plan scenario.toml --vehicles 3 --altitude-step 15
    mavplan plan scenario.toml --vehicles 2 --sorties 1
    mavplan plan city.toml --planner length --jobs 4
    mavplan plan scenario.toml --json | jq .mission_s
    mavplan plan - -o - --format geojson < scenario.toml
    """
    from mavplan.cli.console import (
        answer,
        note,
        progress,
        say_hint,
        say_problems,
        tell,
        tell_next,
        tell_written,
    )
    from mavplan.cli.outputs import check_outputs, write_outputs
    from mavplan.cli.tables import print_items, print_plan
    from mavplan.formats import FORMATS
    from mavplan.plan import make_plan
    from mavplan.plan_file import summary
    from mavplan.workers.crew import lending

    outputs = named_outputs(outputs, kind) or (Path(f"{stem_of(scenario)}.plan"),)
    check_outputs(outputs)
    note(f"reading {scenario}")
    given = read_scenario(scenario, all_served=not isinstance(sorties, int))
    loaded = with_options(given, planner, clusters, seed, autopilot, time_limit_s, altitude)
    click.get_current_context().with_resource(lending(jobs, cluster))
    if vehicles is not None and vehicles > 1:
        from mavplan.cli.several import fly_fleet

        apart_m = separation_m, altitude_step_m
        fly_fleet(loaded, hover, vehicles, outputs, apart_m, sorties=sorties, items=items)
        return
    if sorties is not None:
        from mavplan.cli.several import fly_sorties

        fly_sorties(loaded, hover, sorties, outputs, items=items)
        return
    with progress("planning") as move:
        made = make_plan(loaded, hover, move)  # type: ignore[arg-type]
    with progress("writing") as move:
        written, warnings = write_outputs(made, outputs, move)
    say_problems([*made.warnings, *warnings])
    print_plan(made)
    if items:
        tell()
        print_items(made)
        tell()
    tell_written(written)
    if any(problem.code in {"mission-too-long", "mission-energy"} for problem in made.warnings):
        say_hint(
            "--sorties auto splits it among batteries, --vehicles N among vehicles, --planner time shortens it"
        )
    answer(lambda: summary(made) | {"written": [str(path) for path in written]})
    mission = next((path for path in written if path.suffix.lower() in FORMATS), None)
    if mission is not None:
        tell_next("mavplan", "check", mission, why="a mock vehicle flies it")


def with_options(
    scenario: "Scenario",
    planner: str | None,
    clusters: int | str | None,
    seed: int | None,
    autopilot: str | None,
    time_limit_s: float | None = None,
    altitude: float | str | None = None,
) -> "Scenario":
    """Return the scenario with what the command line says instead.

    Raises
    ------
    InputError
        Over terrain, an altitude that is less than what is to be kept above it.
    """
    chosen = {"name": planner, "clusters": clusters, "seed": seed, "time_limit_s": time_limit_s}
    given: dict[str, Any] = {key: value for key, value in chosen.items() if value is not None}
    vehicle: dict[str, Any] = {} if autopilot is None else {"autopilot": autopilot}
    if isinstance(altitude, float):
        clearance_m = scenario.terrain_options.clearance_m
        if scenario.terrain_options.file is not None and altitude < clearance_m:
            message = f"is below [terrain] clearance_m = {clearance_m:g}, which is kept above the ground"
            raise InputError([Problem(f"--altitude {altitude:g}", message, "clearance")])
        vehicle["altitude_m"] = altitude
    return dataclasses.replace(
        scenario,
        search_altitude=altitude == "auto" if altitude is not None else scenario.search_altitude,
        planner=dataclasses.replace(scenario.planner, **given),
        vehicle=dataclasses.replace(scenario.vehicle, **vehicle),
    )
