"""``mavplan download``: the mission that a vehicle holds, into a file."""

import json
from pathlib import Path

import click

from mavplan.cli.link_options import check_via, link_options, open_link, via_option
from mavplan.cli.upload import link_progress


@click.command("download", short_help="Save the mission that a vehicle holds.")
@link_options(120.0)
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write this file, .plan or .waypoints.",
)
@click.option(
    "--autopilot", type=click.Choice(["ardupilot", "px4"]), help="Refuse a vehicle with another firmware."
)
@via_option
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as one JSON object.")
def download_command(
    conn: str,
    output: Path,
    system: int | None,
    timeout_s: float,
    autopilot: str | None,
    signing_key: Path | None,
    via: str,
    as_json: bool,
) -> None:
    """Write the mission that a vehicle holds to FILE, without its fence and rally points; nothing on it is changed.

    \b
    mavplan download --conn udp:0.0.0.0:14550 -o held.plan
    """
    from mavplan.cli.console import say_problems
    from mavplan.formats import format_of, write_mission
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.vehicle import download_mission

    check_via(via, signing_key)
    endpoint = parse_endpoint(conn)
    format_of(output)
    with (
        open_link(endpoint, timeout_s, signing_key) as connection,
        link_progress("downloading") as show,
    ):
        held = download_mission(
            connection,
            deadline_s=timeout_s,
            system=system,
            autopilot=autopilot,  # type: ignore[arg-type]
            place=str(endpoint),
            progress=show,
            via=via,  # type: ignore[arg-type]
        )
    say_problems(held.warnings)
    say_problems(write_mission(held.mission, output))
    if as_json:
        items = len(held.mission.items)
        click.echo(
            json.dumps(
                {
                    "outcome": "downloaded",
                    "items": items,
                    "autopilot": held.mission.autopilot,
                    "file": str(output),
                }
            )
        )
    else:
        click.echo(f"written: {output}, {len(held.mission.items)} items")
