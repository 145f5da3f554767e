"""Who does the work: ``--jobs`` and ``--cluster``, for commands whose work falls into independent tasks."""

from collections.abc import Callable
from typing import Any

import click

_Command = Callable[..., Any]


def worker_options(command: _Command) -> _Command:
    """Give a command the parameters ``jobs`` and ``cluster``."""
    jobs = click.option("--jobs", type=click.IntRange(min=1), help="Processes.  [one a core]")
    cluster = click.option(
        "--cluster",
        metavar="ADDRESS",
        help="Run on Dask: tcp://host:port of a scheduler, or 'local' to make one.",
    )
    return jobs(cluster(command))
