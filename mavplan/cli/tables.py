"""A plan as a person reads it in a terminal: a row for each stop or each item, then the totals."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, astuple

import numpy as np

from mavplan.altitude import ChosenAltitude
from mavplan.bounds import Bound
from mavplan.cli.console import clock, counted, plain_table, print_table, printable, stopwatch, tell
from mavplan.hover import demand_on_air
from mavplan.mission.phases import Phases
from mavplan.mission.sendable import command_name
from mavplan.plan import Plan
from mavplan.plan_forecast import stop_of_item
from mavplan.radio import planning_error_m
from mavplan.scenario.model import Scenario

MOST_NAMES = 8
"""Names of users in one cell; the rest is counted."""

MOST_ROWS = 400
"""Of longer tables the first and last are shown, half of these each; the plan's file has all."""


def print_plan(plan: Plan) -> None:
    """Print stops in flying order with arrival, hold and users, and the totals."""
    trajectory, users = plan.trajectory, plan.scenario.users
    items = plan.built.mission.items
    flown_m = np.cumsum(np.linalg.norm(np.diff(trajectory.path_m, axis=0), axis=1))
    legs_m = np.diff(flown_m[trajectory.stop_at - 1], prepend=0.0)
    any_d2d = bool(trajectory.assignment.d2d.any())
    table = plain_table(f"{trajectory.planner.upper()} for {plan.rules.title}")
    over_ground = plan.scenario.terrain is not None
    heights = ("alt m",) if over_ground else ()
    for heading in ("stop", "latitude", "longitude", *heights, "leg m", "arrives", "hold s"):
        table.add_column(heading, justify="right", no_wrap=True)
    names = plan.pinned_names
    any_name = any(names)
    if any_name:
        table.add_column("pinned")
    table.add_column("served from the air")
    if any_d2d:
        table.add_column("served by D2D")
    arrivals_s, assignment = plan.arrivals_s, trajectory.assignment
    by_stop = np.argsort(assignment.stop, kind="stable")
    counts = np.bincount(assignment.stop[assignment.served], minlength=len(trajectory.stop_at))
    ends = np.cumsum(counts) + int((~assignment.served).sum())
    for stop in _shown(len(plan.built.stop_items)):
        if stop is None:
            table.add_row("…")
            continue
        here = by_stop[ends[stop] - counts[stop] : ends[stop]]
        place = items[plan.built.stop_items[stop].first]
        cells = [
            str(stop + 1),
            f"{place.lat_deg:.6f}",
            f"{place.lon_deg:.6f}",
            *([f"{place.alt_m:,.0f}"] if over_ground else []),
            f"{legs_m[stop]:,.0f}",
            stopwatch(arrivals_s[stop]),
            f"{plan.holds.stored_s[stop]:g}",
            *([printable(names[stop])] if any_name else []),
            _names([users.names[n] for n in here[~assignment.d2d[here]]]),
        ]
        if any_d2d:
            relayed = here[assignment.d2d[here]]
            cells.append(_names([f"{users.names[n]} (by {users.names[users.mate[n]]})" for n in relayed]))
        table.add_row(*cells)
    print_table(table)
    tell()
    for line in totals(plan):
        tell(line)


def _shown(count: int) -> Iterator[int | None]:
    """Yield the numbers of the rows that are shown, None for those left out."""
    if count <= MOST_ROWS:
        yield from range(count)
        return
    yield from range(MOST_ROWS // 2)
    yield None
    yield from range(count - MOST_ROWS // 2, count)


def totals(plan: Plan) -> list[str]:
    """Return the lines below the table."""
    trajectory, vehicle, count = plan.trajectory, plan.scenario.vehicle, len(plan.scenario.users)
    relayed = int(trajectory.assignment.d2d.sum())
    clusters = f", {counted(trajectory.clusters, 'cluster')}" if trajectory.clusters else ""
    index = "" if plan.joint_index is None else f", index ρe {plan.joint_index:.2f} (benchmark SBW = 1)"
    served = f"{counted(count, 'user')} served by {counted(len(trajectory.stop_at), 'stop')}{clusters}"
    ground = "home" if plan.scenario.terrain is None else "the ground"
    lines = [
        f"{served}: {count - relayed} from the air, {relayed} by D2D; "
        f"coverage radius {trajectory.radius_m:,.0f} m at {vehicle.altitude_m:g} m above {ground}"
        f"{_kept(plan.scenario)}",
        f"path {trajectory.length_m:,.0f} m{_proved_length(trajectory.bound, plan.scenario)}, "
        f"sum rate {trajectory.sum_rate_bit_s_hz:.1f} bit/s/Hz{index}",
        f"hover {clock(plan.holds.hover_s)} ({plan.holds.surplus_s:.1f} s of it by rounding up), "
        f"flight {clock(plan.forecast.flight_s)}, mission {clock(plan.forecast.mission_s)}"
        f"{_proved_time(trajectory.bound, plan.scenario)}",
        _energy(plan),
    ]
    if plan.altitude is not None:
        lines.append(altitude_line(plan.altitude))
    if plan.holds.in_flight_bit is not None:
        demand_bit = demand_on_air(plan.scenario.users, trajectory)
        useful_bit = np.minimum(plan.holds.in_flight_bit, demand_bit).sum()
        lines.append(
            f"in flight: {useful_bit / 1e6:,.0f} of {demand_bit.sum() / 1e6:,.0f} Mbit are received on the way"
        )
    return lines


def altitude_line(found: ChosenAltitude) -> str:
    """Return which altitude was chosen, and what each one that was tried came to."""
    unit = "s" if found.objective == "mission_s" else "m"
    values = [
        f"{tried.altitude_m:g} m {'–' if tried.value is None else f'{tried.value:,.0f} {unit}'}"
        for tried in found.tried
    ]
    what = {"mission_s": "mission", "path_m": "path", "tour_m": "path and way home"}[found.objective]
    return (
        f"altitude {found.chosen_m:g} m chosen between {found.low_m:g} and {found.high_m:g} m, "
        f"by the {what}: {', '.join(values)}"
    )


def print_items(plan: Plan) -> None:
    """Print what each item of the mission takes, its way there included, phase by phase."""
    found, stops = plan.forecast, stop_of_item(plan)
    known = found.used_wh is not None
    table = plain_table("forecast by item")
    table.show_footer = True
    sums = [*_seconds(found.seconds), "", *([f"{found.used_wh:,.1f}", ""] if known else [])]
    headings = [
        "climb\ns",
        "cruise\ns",
        "hover\ns",
        "descent\ns",
        "done",
        *(["Wh", "Wh\nused"] if known else []),
    ]
    table.add_column("item", justify="right", no_wrap=True)
    table.add_column("command", "in all", no_wrap=True)
    table.add_column("stop", justify="right", no_wrap=True)
    for heading, footer in zip(headings, sums, strict=True):
        table.add_column(heading, footer, justify="right", no_wrap=True)
    for row in _shown(len(found.items)):
        if row is None:
            table.add_row("…")
            continue
        item = found.items[row]
        stop = stops.get(item.item)
        cells = [str(item.item + 1), command_name(item.command), "" if stop is None else str(stop + 1)]
        cells += [*_seconds(item.seconds), stopwatch(item.done_s)]
        if item.energy_wh is not None:
            cells += [f"{item.energy_wh.total:,.1f}" if item.energy_wh.total else "", f"{item.used_wh:,.1f}"]
        table.add_row(*cells)
    print_table(table)


def _seconds(phases: Phases) -> list[str]:
    """Return a cell for each phase, empty where it does not occur."""
    return [f"{value:,.1f}" if value else "" for value in astuple(phases)]


def _energy(plan: Plan) -> str:
    """Return what the mission takes from the battery, or why nobody knows."""
    energy, left = plan.forecast.energy_wh, plan.remaining_fraction
    if energy is None:
        return "energy –: [vehicle] mass_kg is not set"
    parts = ", ".join(f"{phase} {value:,.1f}" for phase, value in asdict(energy).items())
    if left is None:
        return f"energy {energy.total:,.1f} Wh ({parts})"
    battery = f"{left:.0%} of the battery left" if left >= 0 else "more than the battery holds"
    return f"energy {energy.total:,.1f} Wh ({parts}), {battery}"


def _kept(scenario: Scenario) -> str:
    """Return the clause on the margins that the plan keeps."""
    error_m, fade_db = planning_error_m(scenario.vehicle, scenario.service), scenario.radio.fade_margin_db
    kept = [f"{error_m:g} m of drift"] if error_m else []
    kept += [f"{fade_db:g} dB of fading"] if fade_db else []
    return f", {' and '.join(kept)} allowed for" if kept else ""


def _proved_length(bound: Bound | None, scenario: Scenario) -> str:
    """Return what is proved of a path's length, with the way home where that counts."""
    if bound is None or bound.objective == "mission_s":
        return ""
    home = f", with the way home {bound.plan:,.0f} m" if bound.objective == "tour_m" else ""
    proved = f"at least {bound.bound:,.0f} m proved{_without(scenario)} (gap {bound.gap:.2%})"
    if bound.proved:
        proved = "proved the shortest"
    elif bound.bound <= 0:
        proved = "nothing proved of how much is left"
    return f"{home}, {proved}"


def _proved_time(bound: Bound | None, scenario: Scenario) -> str:
    """Return what is proved of a mission's time."""
    if bound is None or bound.objective != "mission_s":
        return ""
    if bound.proved:
        return ", proved the shortest"
    return (
        f", before rounding {bound.plan:,.1f} s, at least {bound.bound:,.1f} s proved{_without(scenario)} "
        f"(gap {bound.gap:.1%})"
    )


def _without(scenario: Scenario) -> str:
    """Return what a bound does not know."""
    return " without the pinned stops" if scenario.stops else ""


def _names(names: Sequence[str]) -> str:
    """Return names in one line, long lists shortened."""
    shown = ", ".join(printable(name).replace("\n", " ") for name in names[:MOST_NAMES])
    return f"{shown} and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else shown
