"""``mavplan verify``: whether a vehicle still holds the mission in a file."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.kinds import Files
from mavplan.cli.link_options import link_options, open_link
from mavplan.cli.upload import link_progress, tell_failure
from mavplan.errors import MavplanError

if TYPE_CHECKING:
    from mavplan.link.verify_session import VerifyReport


@click.command("verify", short_help="Tell whether a vehicle holds this mission.")
@click.argument("file", type=Files(".plan", ".waypoints"))
@link_options(120.0)
@click.option(
    "--autopilot", type=click.Choice(["ardupilot", "px4"]), help="The firmware, where FILE does not say."
)
def verify_command(
    file: Path,
    conn: str,
    system: int | None,
    timeout_s: float,
    autopilot: str | None,
    signing_key: Path | None,
) -> None:
    """Tell whether a vehicle holds the mission in FILE, with its fence and rally points; nothing is changed.

    PX4 tells at once, by its checksum; from ArduPilot, and where the checksum differs, everything is downloaded and
    compared. Exit code 0: it holds this very mission. 6: it holds something else. 3: no vehicle was heard. 5: what it
    holds could not be had.

    \b
    mavplan verify valley.plan --conn udp:0.0.0.0:14550
    """
    from mavplan.cli.console import answer, say_problems, tell
    from mavplan.formats.beside import read_known_mission, remembered_vehicle
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.services import verify_mission

    endpoint = parse_endpoint(conn)
    mission = read_known_mission(file, autopilot)  # type: ignore[arg-type]
    say_problems(mission.warnings)
    try:
        with open_link(endpoint, timeout_s, signing_key) as connection, link_progress("verifying") as show:
            report = verify_mission(
                mission,
                connection,
                deadline_s=timeout_s,
                system=system,
                place=str(endpoint),
                source=str(file),
                progress=show,
            )
    except MavplanError as error:
        tell_failure(error, "what the vehicle holds otherwise")
        raise
    say_problems(report.warnings)
    since = remembered_vehicle(file).get("verified_at")
    tell(_summary(report))
    answer(_success(report, since))


def _summary(report: "VerifyReport") -> str:
    from mavplan.mission.autopilots import AUTOPILOTS

    how = f"by its checksum {report.opaque_id}" if report.by == "id" else "item by item"
    title = AUTOPILOTS[report.autopilot].title
    return f"the same: {title}, system {report.vehicle.system}, holds this {' and '.join(_order(report))} ({how})"


def _order(report: "VerifyReport") -> list[str]:
    """Return the lists with the mission first."""
    return sorted(report.lists, key=lambda name: name != "mission")


def _success(report: "VerifyReport", since: object) -> dict[str, object]:
    return {
        "outcome": "same",
        "by": report.by,
        "lists": _order(report),
        "items": report.items,
        "autopilot": report.autopilot,
        "system": report.vehicle.system,
        "component": report.vehicle.component,
        "opaque_id": report.opaque_id,
        "uploaded_at": since if isinstance(since, str) else None,
        "warnings": [str(problem) for problem in report.warnings],
    }
