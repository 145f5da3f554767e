"""``mavplan compare``: every planner on the same users, beside the benchmark."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mavplan.cli.kinds import Files
from mavplan.cli.plan import Clusters, altitude_option, with_options
from mavplan.cli.streams import read_scenario

if TYPE_CHECKING:
    from mavplan.comparison import Comparison


BEYOND = " !"
"""Stands behind the time of a mission that the battery does not do."""


@click.command("compare", short_help="Compare all planners on one scenario.")
@click.argument("scenario", type=Files(".toml", dash=True))
@click.option("--clusters", type=Clusters(), help="Number of clusters or 'auto', instead of the scenario's.")
@click.option(
    "--seed", type=click.IntRange(min=0), help="Seed of all that is random, instead of the scenario's."
)
@altitude_option
@click.option(
    "-o",
    "--output",
    "picture",
    type=Files(".png", ".svg", ".pdf"),
    metavar="FILE",
    help="Draw the plans side by side: .png, .svg or .pdf.",
)
def compare_command(
    scenario: Path,
    clusters: int | str | None,
    seed: int | None,
    altitude: float | str | None,
    picture: Path | None,
) -> None:
    """Plan SCENARIO with every planner and show stops, length, throughput and time of each.

    SBW, strips flown in a snake, is the benchmark: its length, sum rate and index are 1.

    \b
    mavplan compare scenario.toml
    mavplan compare scenario.toml --clusters 4 -o compare.png
    """
    from mavplan.cli.console import answer, progress, say_problems, tell_next, tell_written
    from mavplan.comparison import compare
    from mavplan.figures.files import check_picture, draw_comparison, plan_names
    from mavplan.formats.atomic import atomic_write

    if picture is not None:
        check_picture(picture)
    loaded = with_options(read_scenario(scenario), None, clusters, seed, None, altitude=altitude)
    with progress("comparing") as tell:
        found = compare(loaded, tell)
    if picture is not None:
        atomic_write(picture, draw_comparison(found, picture))
    say_problems([*loaded.warnings, *(plan_names([loaded]) if picture is not None else ())])
    print_comparison(found)
    written = [] if picture is None else [picture]
    if written:
        tell_written(written)
    answer(to_json(found) | {"written": [str(path) for path in written]})
    fit = [row for row in found.rows if row.within_battery is not False]
    best = max(fit or found.rows, key=lambda row: row.joint_index or 0.0).planner
    among = " of those within the battery" if 0 < len(fit) < len(found.rows) else ""
    tell_next("mavplan", "plan", scenario, "--planner", best, why=f"of the greatest index{among}")


def to_json(found: "Comparison") -> dict[str, Any]:
    """Return the comparison as one object: a row for each planner, and the least numbers of stops."""
    return {
        "planners": [dataclasses.asdict(row) for row in found.rows],
        "least_stops": dataclasses.asdict(found.least_stops),
        "least_stops_with_d2d": dataclasses.asdict(found.least_stops_with_d2d),
    }


def print_comparison(found: "Comparison") -> None:
    """Print a row for each planner, and how few stops would do."""
    from mavplan.cli.console import clock, plain_table, print_table, tell

    table = plain_table()
    table.add_column("planner", no_wrap=True)
    energy = all(row.energy_wh is not None for row in found.rows)
    heights = len({row.altitude_m for row in found.rows}) > 1 or found.plans[0].altitude is not None
    headings = [
        "K",
        *(["alt m"] if heights else []),
        "stops",
        "D2D",
        "length\nm",
        "/SBW",
        "Σ rate",
        "/SBW",
        "ρe",
        "hover",
        "mission",
    ]
    for heading in [*headings, *(["Wh"] if energy else [])]:
        table.add_column(heading, justify="right", no_wrap=True)
    for row in found.rows:
        table.add_row(
            row.planner.upper(),
            str(row.clusters or "–"),
            *([f"{row.altitude_m:g}"] if heights else []),
            str(row.stops),
            str(row.d2d_users),
            f"{row.length_m:,.0f}",
            _ratio(row.length_ratio),
            f"{row.sum_rate_bit_s_hz:.1f}",
            _ratio(row.sum_rate_ratio),
            _ratio(row.joint_index),
            clock(row.hover_s),
            clock(row.mission_s) + (BEYOND if row.within_battery is False else ""),
            *([f"{row.energy_wh:,.1f}"] if energy else []),
        )
    print_table(table)
    tell()
    tell(f"fewest stops that reach every user: {found.least_stops}")
    tell(f"fewest stops that reach every user or its mate: {found.least_stops_with_d2d}")
    tell("Σ rate in bit/s/Hz; index ρe = (Σ rate/SBW)/(length/SBW), greater is better")
    if any(row.within_battery is False for row in found.rows):
        tell(
            f"{BEYOND.strip()} takes more than the battery gives above its reserve: no mission to fly as one"
        )
    counting = [plan.trajectory.planner for plan in found.plans if plan.holds.in_flight_bit is not None]
    if 0 < len(counting) < len(found.plans):
        names = ", ".join(counting).upper()
        tell(f"only {names} counts on what users receive in flight: [service] in_flight sets it for all")


def _ratio(value: float | None) -> str:
    """Return a ratio, a dash where it has no value."""
    return "–" if value is None else f"{value:.2f}"
