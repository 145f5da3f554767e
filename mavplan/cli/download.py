"""``mavplan download``: the mission that a vehicle holds, with its fence and rally points, into a file."""

from pathlib import Path

import click

from mavplan.cli.kinds import Files
from mavplan.cli.link_options import check_via, link_options, open_link, via_option
from mavplan.cli.streams import format_option, named_outputs, write_outputs_of
from mavplan.cli.upload import link_progress, tell_failure
from mavplan.errors import MavplanError


@click.command("download", short_help="Save the mission that a vehicle holds.")
@link_options(120.0)
@click.option(
    "-o",
    "--output",
    required=True,
    type=Files(".plan", ".waypoints", dash=True),
    metavar="FILE",
    help="Write this file, .plan or .waypoints; - with --format is standard output.",
)
@format_option("plan", "waypoints")
@click.option(
    "--autopilot", type=click.Choice(["ardupilot", "px4"]), help="Refuse a vehicle with another firmware."
)
@click.option("--mission-only", is_flag=True, help="Leave out its fence and its rally points.")
@via_option
def download_command(
    conn: str,
    output: Path,
    kind: str | None,
    system: int | None,
    timeout_s: float,
    autopilot: str | None,
    mission_only: bool,
    signing_key: Path | None,
    via: str,
) -> None:
    """Write the mission that a vehicle holds to FILE, with its fence and rally points; nothing on it is changed.

    A .waypoints file cannot hold a fence or rally points: they are left out of it, with a warning. Exit code 0: the
    mission is in FILE. 6: the vehicle holds none. 3: no vehicle was heard. 4: it does not give its mission. 5: what it
    holds could not be had in time; then FILE is as it was.

    \b
    mavplan download --conn udp:0.0.0.0:14550 -o held.plan
    """
    from mavplan.cli.console import answer, counted, say_problems, tell
    from mavplan.formats import format_of
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.vehicle import download_mission

    check_via(via, signing_key)
    endpoint = parse_endpoint(conn)
    output = named_outputs([output], kind)[0]
    mission_format = format_of(output)
    try:
        with (
            open_link(endpoint, timeout_s, signing_key) as connection,
            link_progress("downloading") as show,
        ):
            held = download_mission(
                connection,
                deadline_s=timeout_s,
                system=system,
                autopilot=autopilot,  # type: ignore[arg-type]
                mission_only=mission_only,
                place=str(endpoint),
                progress=show,
                via=via,  # type: ignore[arg-type]
            )
    except MavplanError as error:
        tell_failure(error)
        raise
    say_problems(held.warnings)
    write_outputs_of([(output, mission_format.dumps(held.mission))])
    warnings = mission_format.warnings(held.mission)
    say_problems(warnings)
    counts = [f"{len(held.mission.items)} items"]
    if held.fence_items:
        counts.append(f"{held.fence_items} of the fence")
    if held.rally_items:
        counts.append(counted(held.rally_items, "rally point"))
    tell(f"written: {output}, {', '.join(counts)}")
    told = {
        "outcome": "downloaded",
        "items": len(held.mission.items),
        "fence_items": held.fence_items,
        "rally_items": held.rally_items,
        "autopilot": held.mission.autopilot,
        "file": str(output),
        "warnings": [str(problem) for problem in (*held.warnings, *warnings)],
    }
    answer(told)
