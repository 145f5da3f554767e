"""How a flight is shown: the list before the start, the live picture, the line at the end. Words and tables only."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mavplan.cli.console import clock, counted, printable
from mavplan.flight.phases import Phase
from mavplan.flight.picture import Picture
from mavplan.flight.preflight import Check
from mavplan.flight.report import FlightEvent, FlightReport
from mavplan.link.outbox import Progress

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

_MARKS = {
    "good": ("ok", "green"),
    "warning": ("look", "yellow"),
    "ask": ("asked", "yellow"),
    "refused": ("NO", "red"),
}
_PHASES = {
    Phase.CHECKING: "asking the vehicle",
    Phase.READY: "ready",
    Phase.REWINDING: "looking where the mission would start",
    Phase.SWITCHING: "switching to the mode for arming",
    Phase.ARMING: "arming",
    Phase.STARTING: "starting the mission",
}
SILENT_S = 3.0
"""A vehicle that was heard longer ago is shown in red."""
SHOWN_USERS = 6


def checks_table(checks: Sequence[Check]) -> "Table":
    """Return the list before the start."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column("", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("", overflow="fold")
    for check in checks:
        mark, colour = _MARKS[check.verdict]
        table.add_row(Text(mark, style=colour), check.name, printable(check.words))
    return table


def start_question(title: str, picture: Picture | None) -> str:
    """Return what is asked before anything is armed."""
    if picture is None:
        return f"Arm {title} and fly?"
    stops = counted(picture.stops, "stop")
    return f"Arm {title} and fly {stops}, {counted(picture.items, 'item')}, about {clock(picture.left_s or 0.0)}?"


def step_words(step: Progress) -> str:
    """Return a step of a transfer as a line."""
    far = f" {step.done} of {step.total}" if step.total else ""
    return f"{step.phase}{far} …"


def event_line(event: FlightEvent) -> str:
    """Return an event as a line."""
    return f"{_minutes(event.flight_s):>8}  {printable(event.words)}"


def live(picture: Picture) -> "RenderableType":
    """Return the picture of a moment."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

    if picture.phase is not Phase.FLYING:
        return Text(f"{_PHASES.get(picture.phase, '')} … {link_words(picture)}")
    bar = Table.grid(padding=(0, 1))
    bar.add_row(
        ProgressBar(total=max(1, picture.items), completed=picture.items_done, width=40),
        f"{picture.items_done} of {counted(picture.items, 'item')}",
        _minutes(picture.flight_s),
        f"about {clock(picture.left_s)} left" if picture.left_s is not None else "",
    )
    lines: list[Any] = [bar, Text(printable(stop_words(picture)))]
    style = "red" if picture.silent_s > SILENT_S else ""
    lines.append(Text(link_words(picture), style=style))
    if picture.order:
        lines.append(Text(f"ordered to {picture.order}: not confirmed yet", style="yellow"))
    return Group(*lines)


def stop_words(picture: Picture) -> str:
    """Return where it is among its stops, and who was served."""
    stop = picture.stop
    where = "on its way"
    if picture.follows:
        where = f"does as you ordered: {picture.follows}"
    elif stop is not None and picture.hold_left_s is not None:
        where = f"stop {stop.number} of {picture.stops}: holds, {picture.hold_left_s:.0f} s left{_for(stop.users)}"
    elif stop is not None:
        where = f"to stop {stop.number} of {picture.stops}{_for(stop.users)}"
    elif picture.stops_done == picture.stops:
        where = "all stops done"
    if not picture.users:
        return f"{where}; {picture.stops_done} of {counted(picture.stops, 'stop')} done"
    return f"{where}; {picture.users_served} of {counted(picture.users, 'user')} served, by the plan"


def link_words(picture: Picture) -> str:
    """Return what the vehicle told last of itself, and how long ago."""
    parts = [picture.mode or "mode not told", "armed" if picture.armed else "not armed"]
    if picture.alt_rel_m is not None:
        parts.append(f"{picture.alt_rel_m:.0f} m")
    if picture.battery_percent is not None:
        volts = f", {picture.voltage_v:.1f} V" if picture.voltage_v is not None else ""
        parts.append(f"battery {picture.battery_percent} %{volts}")
    elif picture.voltage_v is not None:
        parts.append(f"battery {picture.voltage_v:.1f} V")
    parts.append(
        "heard just now"
        if picture.silent_s < 1.5
        else f"last heard {clock(picture.silent_s)} ago: as it was then"
    )
    return " · ".join(parts)


def summary(report: FlightReport, recording: str | None) -> str:
    """Return the line that a person reads in the end."""
    forecast = f" (forecast {clock(report.forecast_s)})" if report.outcome == "flown" else ""
    parts = [
        f"{report.items_done} of {counted(report.items, 'item')}",
        f"{len(report.stops_done)} of {counted(report.stops, 'stop')}",
    ]
    if report.users_served:
        parts.append(f"{counted(len(report.users_served), 'user')} served, by the plan")
    parts.append(f"{clock(report.flight_s)}{forecast}")
    if report.battery_before is not None and report.battery_after is not None:
        parts.append(f"battery {report.battery_before} to {report.battery_after} %")
    if recording is not None:
        parts.append(f"recorded in {recording}")
    return printable(", ".join(parts))


def report_object(
    report: FlightReport | None,
    checks: Sequence[Check],
    *,
    outcome: str,
    exit_code: int,
    message: str,
    recording: str | None,
) -> dict[str, object]:
    """Return the object of ``--json``."""
    found: dict[str, object] = {
        "outcome": report.outcome if report is not None else outcome,
        "exit_code": exit_code,
        "message": message,
        "checks": [{"name": c.name, "verdict": c.verdict, "words": c.words} for c in checks],
        "recording": recording,
    }
    if report is None:
        return found
    return {
        **found,
        "autopilot": report.autopilot,
        "system": report.vehicle.system,
        "component": report.vehicle.component,
        "flight_s": round(report.flight_s, 1),
        "forecast_s": round(report.forecast_s, 1),
        "items_done": report.items_done,
        "items": report.items,
        "stops_done": list(report.stops_done),
        "stops": report.stops,
        "users_served_by_plan": list(report.users_served),
        "battery_before_percent": report.battery_before,
        "battery_after_percent": report.battery_after,
        "longest_silence_s": round(report.unheard_s, 1),
        "events": [{"flight_s": e.flight_s, "kind": e.kind, "words": e.words} for e in report.events],
    }


def _for(users: Sequence[str]) -> str:
    if not users:
        return ""
    more = f" and {len(users) - SHOWN_USERS} more" if len(users) > SHOWN_USERS else ""
    return f", for {', '.join(users[:SHOWN_USERS])}{more}"


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes}:{rest:02d}"
