"""``mavplan replan``: after a flight, a scenario of the users not yet served."""

from pathlib import Path

import click

from mavplan.cli.new_folder import make_folder
from mavplan.cli.track_options import track_options
from mavplan.errors import Problem

FILES = ("scenario.toml", "users.csv")
"""What is written, as ``mavplan init`` names it."""


@click.command("replan", short_help="Make a scenario of the users not yet served.")
@track_options
@click.option(
    "-o",
    "--output",
    "folder",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Where to write scenario.toml and users.csv.",
)
def replan_command(
    track: Path, plan_file: Path, system: int | None, in_flight: bool | None, folder: Path
) -> None:
    """Write a scenario of the users that did not get what they need in the flight that TRACK recorded.

    After an abort, a battery swap or a crash: each with what it still lacks, home, radio and vehicle as they were.
    Where everybody is served nothing is written.

    \b
    mavplan replan flight.tlog --plan valley.mavplan.json -o rest
    mavplan plan rest/scenario.toml
    """
    from mavplan.cli.console import (
        answer,
        counted,
        printable,
        progress,
        say_problems,
        tell,
        tell_next,
        tell_written,
    )
    from mavplan.formats.atomic import write_all
    from mavplan.proof.prove import prove
    from mavplan.proof.rest import rest_of
    from mavplan.scenario.write import scenario_toml, users_csv
    from mavplan.stored_plan import read_plan
    from mavplan.track.read import read_track

    plan = read_plan(plan_file)
    with progress(f"reading {track}"):
        flown = read_track(track, system)
    proof = prove(plan, flown, in_flight)
    say_problems(proof.notes)
    rest = rest_of(proof)
    if rest is None:
        tell(
            f"all {counted(len(proof.met), 'user')} received what they need: nothing is left, nothing is written"
        )
        answer({"users_left": 0, "relays": 0, "left_mbit": 0.0, "written": []})
        return
    if plan.scenario.stops:
        message = "are not carried over: put in again what the flight did not reach"
        say_problems([Problem("[[stops]]", message, "stops-left-out", "warning")])
    targets = make_folder(folder, FILES)
    remark = (
        f"The users that {track.name} left over of {plan_file.name}, each with what it still needs.\n\n"
        f"  mavplan plan {targets[0].name}"
    )
    contents = (scenario_toml(rest, FILES[1], printable(remark)), users_csv(rest.users))
    write_all(zip(targets, contents, strict=True))
    short = int((~proof.met).sum())
    relays = len(rest.users) - short
    beside = f" and {counted(relays, 'mate')} that may relay" if relays else ""
    left_mbit = rest.users.demand_bit.sum() / 1e6
    tell(f"{counted(short, 'user')}{beside} left, {left_mbit:,.1f} Mbit in all")
    tell_written(targets)
    answer(
        {
            "users_left": short,
            "relays": relays,
            "left_mbit": round(float(left_mbit), 6),
            "written": [str(path) for path in targets],
        }
    )
    tell_next("mavplan", "plan", targets[0])
