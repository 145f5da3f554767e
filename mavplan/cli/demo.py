"""``mavplan demo``: the whole way at once, to a mock vehicle over a real socket on this machine."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from mavplan.cli.kinds import Files
from mavplan.cli.plan import altitude_option, with_options
from mavplan.cli.streams import read_scenario, stem_of
from mavplan.errors import MavplanError

READY = re.compile(r"listening on (udpin:127\.0\.0\.1:(\d+))")


@click.command("demo", short_help="From a scenario to a verified mission on a mock vehicle.")
@click.argument("scenario", type=Files(".toml", dash=True), required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("mavplan-demo"),
    show_default=True,
    help="Folder for the files.",
)
@altitude_option
def demo_command(scenario: Path | None, out: Path, altitude: float | str | None) -> None:
    """Plan SCENARIO (default: the one of mavplan init), write the files, upload to a mock vehicle, read back.

    Everything stays on this machine: the mock vehicle is a process of its own that listens on 127.0.0.1.

    \b
    mavplan demo
    mavplan demo missions/coast/scenario.toml --out out/coast
    """
    from mavplan.cli.console import answer, progress, say_problems, tell, tell_next, tell_written
    from mavplan.cli.init import TEMPLATE, write_template
    from mavplan.cli.outputs import write_outputs
    from mavplan.cli.tables import print_plan
    from mavplan.cli.upload import link_progress, success, summary
    from mavplan.formats import read_mission
    from mavplan.link.connection import open_connection
    from mavplan.link.endpoint import parse_endpoint
    from mavplan.link.vehicle import upload_mission
    from mavplan.plan import make_plan
    from mavplan.plan_file import summary as plan_summary

    if scenario is None:
        scenario = out / TEMPLATE[0]
        if not scenario.is_file():
            tell_written(write_template(out))
    loaded = with_options(read_scenario(scenario), None, None, None, None, altitude=altitude)
    make_folder(out)
    tell(f"1. plan {scenario}\n")
    with progress("planning") as move:
        plan = make_plan(loaded, progress=move)
    print_plan(plan)
    name = scenario.resolve().parent.name if scenario.stem == "scenario" else stem_of(scenario)
    written, warnings = write_outputs(
        plan, [out / f"{name}{suffix}" for suffix in (".plan", ".waypoints", ".png")]
    )
    say_problems([*plan.warnings, *warnings])
    tell(f"\n2. upload {written[0]} to a mock {plan.rules.title}")
    with mock_vehicle(
        plan.rules.name, loaded.home.lat_deg, loaded.home.lon_deg, loaded.home.alt_amsl_m
    ) as port:
        endpoint = parse_endpoint(f"udpout:127.0.0.1:{port}")
        with open_connection(endpoint) as connection, link_progress("uploading") as show:
            report = upload_mission(read_mission(written[0]), connection, place=str(endpoint), progress=show)
    tell(f"   {summary(report)}")
    tell("\n3. the files")
    for path in written:
        tell(f"   {path}")
    answer(
        {"plan": plan_summary(plan), "upload": success(report), "written": [str(path) for path in written]}
    )
    tell_next("mavplan", "report", written[0], why="the plan as a page to look at")


def make_folder(folder: Path) -> None:
    """Make a folder, or raise an `InputError` that says why it cannot be made."""
    from mavplan.errors import InputError, Problem

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"the folder cannot be made: {error.strerror or error}"
        raise InputError([Problem(str(folder), message, "no-folder")]) from error


@contextmanager
def mock_vehicle(firmware: str, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Iterator[int]:
    """Run a mock vehicle as a process that listens on a UDP port of 127.0.0.1; give the port."""
    command = [
        *(sys.executable, "-m", "sitl_mock", "--firmware", firmware, "--conn", "udpin:127.0.0.1:0"),
        f"--home={lat_deg},{lon_deg},{alt_amsl_m}",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            line = process.stdout.readline() if process.stdout else ""
            ready = READY.search(line)
            if ready is None:
                raise MavplanError(f"the mock vehicle did not start: {line.strip() or 'it said nothing'}")
            yield int(ready[2])
        finally:
            process.terminate()
