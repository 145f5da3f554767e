"""``mavplan upload``: a mission file onto a vehicle, read back and compared."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.kinds import Files
from mavplan.cli.link_options import check_via, home_options, link_options, open_link, via_option
from mavplan.errors import MavplanError, Problem

if TYPE_CHECKING:
    from mavplan.link.outbox import Progress
    from mavplan.link.report import UploadReport
    from mavplan.mission.readback import Difference


@click.command("upload", short_help="Upload a mission to a vehicle and read it back.")
@click.argument("file", type=Files(".plan", ".waypoints"))
@link_options()
@click.option(
    "--autopilot", type=click.Choice(["ardupilot", "px4"]), help="The firmware, where FILE does not say."
)
@click.option("--allow-armed", is_flag=True, help="Write also to a vehicle that is armed.")
@home_options("home")
@via_option
def upload_command(
    file: Path,
    conn: str,
    system: int | None,
    timeout_s: float | None,
    autopilot: str | None,
    allow_armed: bool,
    max_home_distance_m: float,
    max_home_height_m: float | None,
    signing_key: Path | None,
    via: str,
) -> None:
    """Put the mission in FILE (.plan or .waypoints) onto a vehicle, after its fence and rally points if it has any.

    Everything is read back and compared item by item; only then it counts as stored. The exit code says what the
    vehicle holds: 0 this mission, 3 no vehicle was heard, 4 it refused and keeps its old one (or PX4 judges the
    new one not flyable), 5 that is uncertain.

    \b
    mavplan upload valley.plan --conn udp:0.0.0.0:14550
    mavplan upload valley.plan --conn /dev/ttyUSB0,57600 --system 3
    """
    from mavplan.cli.console import answer, say_problems, tell, tell_next
    from mavplan.formats.beside import home_height_limit_m, read_known_mission, remember_vehicle
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.vehicle import upload_mission
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.mission.uploadable import check_uploadable

    check_via(via, signing_key)
    endpoint = parse_endpoint(conn)
    mission = read_known_mission(file, autopilot)  # type: ignore[arg-type]
    if mission.autopilot is not None:
        check_uploadable(mission, AUTOPILOTS[mission.autopilot], str(file))
    say_problems(mission.warnings)
    if mission.autopilot is None:
        message = "does not say which firmware it is for: taken for the vehicle's (--autopilot says it)"
        say_problems([Problem(str(file), message, "unknown-autopilot", "warning")])
    try:
        with (
            open_link(endpoint, timeout_s, signing_key) as connection,
            link_progress("uploading") as show,
        ):
            report = upload_mission(
                mission,
                connection,
                deadline_s=timeout_s,
                system=system,
                place=str(endpoint),
                allow_armed=allow_armed,
                max_home_distance_m=max_home_distance_m,
                max_home_height_m=home_height_limit_m(file, max_home_height_m),
                source=str(file),
                progress=show,
                via=via,  # type: ignore[arg-type]
            )
    except MavplanError as error:
        tell_failure(error)
        raise
    say_problems([*report.warnings, *remember_vehicle(file, report)])
    tell(summary(report))
    answer(success(report))
    tell_next("mavplan", "fly", file, "--conn", conn, why="checks, asks, flies, records")


def summary(report: "UploadReport") -> str:
    """Return the line that a person reads after a verified upload."""
    from mavplan.mission.autopilots import AUTOPILOTS

    title = AUTOPILOTS[report.autopilot].title
    again = f", in {report.uploads} attempts" if report.uploads > 1 else ""
    fence = f", {report.fence_items} of the fence" if report.fence_items else ""
    points = "rally point" if report.rally_items == 1 else "rally points"
    rally = f", {report.rally_items} {points}" if report.rally_items else ""
    return (
        f"stored and verified: {report.items} items{fence}{rally} on {title}, system {report.vehicle.system} "
        f"({report.upload_s:.1f} s to upload{again}, {report.total_s:.1f} s in all)"
    )


@contextmanager
def link_progress(label: str) -> "Iterator[Callable[[Progress], None]]":
    """Give a callback that moves a progress bar on standard error, if that is a terminal."""
    from mavplan.cli.console import progress

    with progress(label) as move:

        def show(step: "Progress") -> None:
            if step.total:
                move(step.done, step.total)

        yield show


def success(report: "UploadReport") -> dict[str, object]:
    """Return what scripts get after a verified upload."""
    return {
        "outcome": "verified",
        "items": report.items,
        "autopilot": report.autopilot,
        "system": report.vehicle.system,
        "component": report.vehicle.component,
        "judgement": report.judgement.value if report.judgement else None,
        "opaque_id": report.opaque_id,
        "upload_s": round(report.upload_s, 3),
        "total_s": round(report.total_s, 3),
        "uploads": report.uploads,
        "read_backs": report.read_backs,
        "fence_items": report.fence_items,
        "rally_items": report.rally_items,
        "fence": report.fence_force.words if report.fence_force else None,
        "fence_in_force": list(report.fence_force.enforced)
        if report.fence_force and report.fence_force.enforced is not None
        else None,
        "fence_breached": list(report.fence_force.breached) if report.fence_force else [],
        "warnings": [str(problem) for problem in report.warnings],
    }


SMALLEST_E7 = 1000
"""In the fields of a position, less than this (11 m from the equator) is the parameter of an item that has none."""
_FIELDS = {"x": "latitude", "y": "longitude", "z": "altitude (m)", "count": "number of items"}
"""What the fields of MISSION_ITEM_INT are to people."""


def tell_failure(error: MavplanError, title: str = "what the vehicle stored otherwise") -> None:
    """Print what is known of a failure besides its message: all of it as JSON, or a table of differences."""
    from mavplan.cli.console import answer, mode

    differences: Sequence[Difference] = getattr(error, "differences", ())
    answer(_failure(error, differences))
    if differences and not mode().as_json:
        _print_differences(differences, title)


def _failure(error: MavplanError, differences: "Sequence[Difference]") -> dict[str, object]:
    return {
        "outcome": error.exit_code.name.lower(),
        "exit_code": int(error.exit_code),
        "message": str(error),
        # NaN is no JSON
        "differences": [
            {
                "item": found.seq,
                "field": found.field,
                "sent": _plain(found.sent),
                "stored": _plain(found.stored),
            }
            for found in differences
        ],
    }


def _plain(value: float) -> float | None:
    return value if value == value else None  # noqa: PLR0124 - false for NaN only


def _print_differences(differences: "Sequence[Difference]", title: str) -> None:
    from rich.table import Table

    from mavplan.cli.console import stderr

    table = Table(title=title)
    for heading in ("item", "field", "mavplan's", "the vehicle's"):
        table.add_column(heading, justify="left" if heading == "field" else "right")
    for found in differences:
        item = "" if found.seq is None else str(found.seq)
        name = _FIELDS.get(found.field, found.field)
        table.add_row(item, name, _value(found.field, found.sent), _value(found.field, found.stored))
    stderr().print(table)


def _value(field: str, value: float) -> str:
    """Return a value of the wire as people read it."""
    if field in {"x", "y"} and abs(value) >= SMALLEST_E7:
        return f"{value / 1e7:.7f}°"
    if field == "command":
        from mavplan.mission.sendable import command_name

        return command_name(int(value))
    return f"{value:.9g}"
