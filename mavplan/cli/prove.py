"""``mavplan prove``: from a flight's log, what every user of the plan really received."""

from pathlib import Path

import click

from mavplan.cli.kinds import Files
from mavplan.cli.track_options import track_options


@click.command("prove", short_help="Work out from a flight's log what every user received.")
@track_options
@click.option(
    "-o",
    "--output",
    "picture",
    type=Files(".png", ".svg", ".pdf"),
    metavar="FILE",
    help="Draw the track over the plan: .png, .svg or .pdf.",
)
def prove_command(
    track: Path,
    plan_file: Path,
    system: int | None,
    in_flight: bool | None,
    picture: Path | None,
) -> None:
    """Work out what every user received in the flight that TRACK recorded.

    TRACK is a .tlog, an ArduPilot .bin, a PX4 .ulg, or CSV with time_s, lat_deg, lon_deg, alt_rel_m. The channel is
    integrated along where the vehicle really was. Exit code 0: every demand is met. 6: one is not. 2: nothing can be
    said, or it is another plan's flight.

    \b
    mavplan prove flight.tlog --plan valley.mavplan.json -o proof.png
    mavplan prove 00000012.BIN --plan valley.plan --json
    """
    from mavplan.cli.console import answer, note, progress, say_problems, tell_next, tell_written
    from mavplan.cli.proof_tables import print_proof, shortfall, to_json
    from mavplan.figures.files import check_picture, draw_proof, proof_names
    from mavplan.formats.atomic import atomic_write
    from mavplan.proof.prove import prove
    from mavplan.stored_plan import read_plan
    from mavplan.track.read import read_track

    if picture is not None:
        check_picture(picture)
    plan = read_plan(plan_file)
    with progress(f"reading {track}"):
        flown = read_track(track, system)
    note("proving")
    proof = prove(plan, flown, in_flight)
    if picture is not None:
        atomic_write(picture, draw_proof(proof, picture))
    say_problems([*proof.notes, *(proof_names(proof) if picture is not None else ())])
    print_proof(proof)
    written = [] if picture is None else [picture]
    if written:
        tell_written(written)
    answer(to_json(proof) | {"written": [str(path) for path in written]})
    if not proof.all_met:
        tell_next(
            "mavplan", "replan", track, "--plan", plan_file, "-o", "rest", why="a scenario of who is left"
        )
        raise shortfall(proof)
