"""``mavplan clear``: delete the mission, the fence or the rally points that a vehicle holds."""

from pathlib import Path

import click

from mavplan.cli.link_options import link_options, open_link
from mavplan.cli.upload import link_progress, tell_failure
from mavplan.errors import InputError, MavplanError

MISSION, FENCE, RALLY = 0, 1, 2
"""MAV_MISSION_TYPE."""


@click.command("clear", short_help="Delete what a vehicle holds.")
@link_options(60.0)
@click.option("--fence", is_flag=True, help="Clear the fence, and not the mission.")
@click.option("--rally", is_flag=True, help="Clear the rally points, and not the mission.")
@click.option("--all", "everything", is_flag=True, help="Clear the mission, the fence and the rally points.")
@click.option("--yes", is_flag=True, help="Do not ask.")
@click.option("--allow-armed", is_flag=True, help="Clear also on a vehicle that is armed.")
def clear_command(
    conn: str,
    fence: bool,
    rally: bool,
    everything: bool,
    yes: bool,
    system: int | None,
    timeout_s: float,
    allow_armed: bool,
    signing_key: Path | None,
) -> None:
    """Delete the mission that a vehicle holds, or with an option its fence or rally points.

    The vehicle is asked afterwards, and only when it holds nothing it counts as cleared (exit code 0). 4: refused, it
    keeps what it had. 5: that is not known.

    \b
    mavplan clear --conn udp:0.0.0.0:14550
    mavplan clear --conn udp:0.0.0.0:14550 --all --yes
    """
    from mavplan.cli.console import answer, tell
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.report import THINGS
    from mavplan.link.services import clear_vehicle
    from mavplan.mission.autopilots import AUTOPILOTS

    endpoint = parse_endpoint(conn)
    chosen = {
        MISSION: everything or not (fence or rally),
        FENCE: everything or fence,
        RALLY: everything or rally,
    }
    kinds = [kind for kind, wanted in chosen.items() if wanted]
    names = " and ".join(THINGS[kind] for kind in kinds)
    if not yes:
        _ask(f"Clear the {names} of the vehicle at {endpoint}?")
    try:
        with open_link(endpoint, timeout_s, signing_key) as connection, link_progress("clearing") as show:
            report = clear_vehicle(
                kinds,
                connection,
                deadline_s=timeout_s,
                system=system,
                place=str(endpoint),
                allow_armed=allow_armed,
                progress=show,
            )
    except MavplanError as error:
        tell_failure(error)
        raise
    title = AUTOPILOTS[report.autopilot].title
    tell(f"cleared: {title}, system {report.vehicle.system}, holds no {' and no '.join(report.cleared)}")
    told = {
        "outcome": "cleared",
        "cleared": list(report.cleared),
        "autopilot": report.autopilot,
        "system": report.vehicle.system,
    }
    answer(told)


def _ask(question: str) -> None:
    """Go on only after a yes; where nobody can answer, say what to do."""
    try:
        sure = click.confirm(question, err=True)
    except click.Abort as error:
        raise InputError("nothing was cleared: nobody answered; --yes clears without asking") from error
    if not sure:
        raise InputError("nothing was cleared: you did not say yes")
