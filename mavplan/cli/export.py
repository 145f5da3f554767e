"""``mavplan export``: a mission file in another format, and as a map."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mavplan.cli.kinds import Files
from mavplan.cli.streams import format_option, is_stdout, named_outputs, write_outputs_of
from mavplan.errors import InputError, Problem

if TYPE_CHECKING:
    from mavplan.stored_plan import StoredPlan


WRITTEN = (".plan", ".waypoints", ".kml", ".kmz", ".gpx", ".geojson", ".csv")


@click.command("export", short_help="Write a mission file in another format.")
@click.argument("file", type=Files(".plan", ".waypoints"))
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    required=True,
    type=Files(*WRITTEN, dash=True),
    metavar="FILE",
    help="Write this file: .plan, .waypoints, .kml, .kmz, .gpx, .geojson or .csv; may be given again; - with "
    "--format is standard output.",
)
@format_option(*(suffix[1:] for suffix in WRITTEN))
@click.option(
    "--autopilot",
    type=click.Choice(["ardupilot", "px4"]),
    help="The firmware it is for, where FILE does not say (.waypoints).",
)
def export_command(file: Path, outputs: tuple[Path, ...], kind: str | None, autopilot: str | None) -> None:
    """Write the mission in FILE (.plan or .waypoints) in another format, or as a map.

    The plan beside it (.mavplan.json) goes along, so that the new mission file is known by it too, and gives maps their
    users.

    \b
    mavplan export valley.plan -o valley.waypoints
    mavplan export valley.plan -o valley.kml -o valley.gpx
    mavplan export valley.plan -o - --format kml | gzip > valley.kml.gz
    mavplan export survey.waypoints --autopilot ardupilot -o survey.plan
    """
    from mavplan.cli.console import answer, say_problems, tell_written
    from mavplan.cli.outputs import check_suffixes
    from mavplan.formats import FORMATS, format_of
    from mavplan.formats.beside import plan_path, read_known_mission
    from mavplan.maps import MAPS, plan_map

    outputs = named_outputs(outputs, kind)
    check_suffixes(outputs, (*FORMATS, *MAPS))
    mission = read_known_mission(file, autopilot)  # type: ignore[arg-type]
    contents: dict[Path, str | bytes] = {}
    warnings: list[Problem] = []
    beside = plan_path(file)
    for output in outputs:
        suffix = output.suffix.lower()
        if output.resolve() == file.resolve():
            raise InputError(f"{output}: is the file that is read; name another one")
        if suffix in MAPS:
            plan = _plan_beside(beside, needed_by=output if suffix == ".csv" else None)
            contents[output] = MAPS[suffix](plan_map(mission, plan, file.stem))
            continue
        mission_format = format_of(output)
        contents[output] = mission_format.dumps(mission)
        warnings += mission_format.warnings(mission)
        if beside.is_file() and not is_stdout(output) and plan_path(output).resolve() != beside.resolve():
            contents[plan_path(output)] = beside.read_bytes()
    write_outputs_of(contents.items())
    say_problems(warnings)
    tell_written(contents)
    answer({"written": [str(path) for path in contents]})


def _plan_beside(beside: Path, needed_by: Path | None) -> "StoredPlan | None":
    """Return the plan beside a mission; where there is none, None, or the error where nothing else would do."""
    from mavplan.stored_plan import read_plan

    if beside.is_file():
        return read_plan(beside)
    if needed_by is not None:
        message = f"is a table of users, and there is no plan beside the mission: {beside} is missing"
        raise InputError([Problem(str(needed_by), message, "no-plan")])
    return None
