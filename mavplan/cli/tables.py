"""A plan as a person reads it in a terminal: a row for each stop, then the totals."""

from collections.abc import Sequence

import click
import numpy as np

from mavplan.cli.console import clock, counted, printable, stdout
from mavplan.plan import Plan

MOST_NAMES = 8
"""Names of users in one cell; the rest is counted."""


def print_plan(plan: Plan) -> None:
    """Print stops in flying order with hold and users, and the totals."""
    from rich.table import Table

    trajectory, users = plan.trajectory, plan.scenario.users
    items = plan.built.mission.items
    flown_m = np.cumsum(np.linalg.norm(np.diff(trajectory.path_m, axis=0), axis=1))
    legs_m = np.diff(flown_m[trajectory.stop_at - 1], prepend=0.0)
    any_d2d = bool(trajectory.assignment.d2d.any())
    table = Table(
        title=f"{trajectory.planner.upper()} for {plan.rules.title}", title_justify="left", box=None
    )
    for heading in ("stop", "latitude", "longitude", "leg m", "hold s"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("served from the air")
    if any_d2d:
        table.add_column("served by D2D")
    for stop, item in enumerate(plan.built.stop_items):
        here = trajectory.assignment.stop == stop
        place = items[item.first]
        cells = [
            str(stop + 1),
            f"{place.lat_deg:.6f}",
            f"{place.lon_deg:.6f}",
            f"{legs_m[stop]:,.0f}",
            f"{plan.holds.stored_s[stop]:g}",
            _names([users.names[n] for n in np.flatnonzero(here & ~trajectory.assignment.d2d)]),
        ]
        if any_d2d:
            relayed = np.flatnonzero(here & trajectory.assignment.d2d)
            cells.append(_names([f"{users.names[n]} (by {users.names[users.mate[n]]})" for n in relayed]))
        table.add_row(*cells)
    stdout().print(table)
    click.echo()
    for line in totals(plan):
        click.echo(line)


def totals(plan: Plan) -> list[str]:
    """Return the lines below the table."""
    trajectory, vehicle, count = plan.trajectory, plan.scenario.vehicle, len(plan.scenario.users)
    relayed = int(trajectory.assignment.d2d.sum())
    clusters = f", {counted(trajectory.clusters, 'cluster')}" if trajectory.clusters else ""
    index = "" if plan.joint_index is None else f", index ρe {plan.joint_index:.2f} (benchmark SBW = 1)"
    served = f"{counted(count, 'user')} served by {counted(len(trajectory.stop_at), 'stop')}{clusters}"
    return [
        f"{served}: {count - relayed} from the air, {relayed} by D2D; "
        f"coverage radius {trajectory.radius_m:,.0f} m at {vehicle.altitude_m:g} m above home",
        f"path {trajectory.length_m:,.0f} m, sum rate {trajectory.sum_rate_bit_s_hz:.1f} bit/s/Hz{index}",
        f"hover {clock(plan.holds.hover_s)} ({plan.holds.surplus_s:.1f} s of it by rounding up), "
        f"flight {clock(plan.forecast.flight_s)}, mission {clock(plan.forecast.mission_s)}",
    ]


def _names(names: Sequence[str]) -> str:
    """Return names in one line, long lists shortened."""
    shown = ", ".join(printable(name).replace("\n", " ") for name in names[:MOST_NAMES])
    return f"{shown} and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else shown
