"""``mavplan export``: a mission file in another format."""

from pathlib import Path

import click

from mavplan.errors import InputError, Problem


@click.command("export", short_help="Write a mission file in another format.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write this file, .plan or .waypoints; may be given again.",
)
@click.option(
    "--autopilot",
    type=click.Choice(["ardupilot", "px4"]),
    help="The firmware it is for, where FILE does not say (.waypoints).",
)
def export_command(file: Path, outputs: tuple[Path, ...], autopilot: str | None) -> None:
    """Write the mission in FILE (.plan or .waypoints) in another format.

    The plan beside it (.mavplan.json) goes along, so that the new file is known by it too.

    \b
    mavplan export valley.plan -o valley.waypoints
    mavplan export survey.waypoints --autopilot ardupilot -o survey.plan
    """
    from mavplan.cli.console import say_problems
    from mavplan.formats import format_of, write_all
    from mavplan.formats.beside import plan_path, read_known_mission

    mission = read_known_mission(file, autopilot)  # type: ignore[arg-type]
    contents: dict[Path, str | bytes] = {}
    warnings: list[Problem] = []
    beside = plan_path(file)
    for output in outputs:
        if output.resolve() == file.resolve():
            raise InputError(f"{output}: is the file that is read; name another one")
        mission_format = format_of(output)
        contents[output] = mission_format.dumps(mission)
        warnings += mission_format.warnings(mission)
        if beside.is_file() and plan_path(output).resolve() != beside.resolve():
            contents[plan_path(output)] = beside.read_bytes()
    write_all(contents.items())
    say_problems(warnings)
    click.echo(f"written: {', '.join(str(path) for path in contents)}")
