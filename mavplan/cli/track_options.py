"""What the commands share that read a flight's log beside its plan: the log, the plan, whose flight, what counts."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

from mavplan.cli.kinds import Files

_Command = TypeVar("_Command", bound=Callable[..., Any])


def track_options(command: _Command) -> _Command:
    """Add TRACK, ``--plan``, ``--system`` and ``--in-flight`` to a command."""
    for option in (
        click.option(
            "--in-flight/--no-in-flight",
            "in_flight",
            default=None,
            help="Count what users receive between stops, or not. Default: where the plan counts on it.",
        ),
        click.option(
            "--system", type=click.IntRange(1, 255), help="The vehicle, where a tlog holds several."
        ),
        click.option(
            "--plan",
            "plan_file",
            required=True,
            type=Files(".mavplan.json", ".plan", ".waypoints"),
            metavar="FILE",
            help="The plan that was flown: X.mavplan.json, or the mission file beside it.",
        ),
        click.argument("track", type=Files(".tlog", ".bin", ".ulg", ".csv")),
    ):
        command = option(command)
    return command
