"""A proof as a person reads it in a terminal, as JSON, and as the error that says who is short."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mavplan.cli.console import clock, counted, plain_table, print_table, printable, stopwatch, tell
from mavplan.errors import CheckError
from mavplan.proof.model import FlownStop, Proof

MOST_MET = 30
"""Users whose demand is met in the table; those that are short are all in it."""

MOST_NAMED = 5
"""Users that the error names."""


def print_proof(proof: Proof) -> None:
    """Print users, stops and totals."""
    _print_users(proof)
    tell()
    _print_stops(proof)
    tell()
    for line in totals(proof):
        tell(line)


def _print_users(proof: Proof) -> None:
    users, d2d = proof.plan.scenario.users, bool(proof.plan.d2d.any())
    table = plain_table("users, Mbit")
    table.add_column("user")
    for heading in ("stop", "demand", "hovering", "in flight", *(["by D2D"] if d2d else []), "short"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("what was wrong")
    met = np.flatnonzero(proof.met)
    for user in [*np.flatnonzero(~proof.met).tolist(), *met[:MOST_MET].tolist()]:
        cells = [
            printable(users.names[user]).replace("\n", " "),
            str(int(proof.plan.stop_of[user]) + 1),
            _mbit(proof.demand_bit[user]),
            _mbit(proof.hover_bit[user]),
            _in_flight(proof, user),
            *([_mbit(proof.d2d_bit[user]) if proof.plan.d2d[user] else "–"] if d2d else []),
            "–" if proof.met[user] else _short(proof.short_bit[user]),
            printable(proof.reasons.get(user, "")).replace("\n", " "),
        ]
        table.add_row(*cells)
    print_table(table)
    if len(met) > MOST_MET:
        tell(f"and {counted(len(met) - MOST_MET, 'user')} more whose demand is met")


def _mbit(bits: float) -> str:
    return f"{bits / 1e6:,.1f}"


def _short(bits: float) -> str:
    """Return what is missing; never as nothing."""
    return f"{bits / 1e6:,.1f}" if bits >= 0.1e6 else f"{bits / 1e6:.2g}"


def _in_flight(proof: Proof, user: int) -> str:
    """Return what was received in flight, in brackets where it does not count."""
    received = _mbit(proof.flight_bit[user])
    return received if proof.in_flight or proof.flight_bit[user] == 0 else f"({received})"


def _print_stops(proof: Proof) -> None:
    table = plain_table("stops")
    headings = (
        "planned\ns",
        "held\ns",
        "began",
        "forecast",
        "off\nplace m",
        "most\nm",
        "height\nm",
        "not\ncounted s",
    )
    for heading in ("stop", *headings):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("known by")
    for number, stop in enumerate(proof.stops, start=1):
        table.add_row(str(number), *_stop_cells(stop))
    print_table(table)


def _stop_cells(stop: FlownStop) -> list[str]:
    if stop.span is None:
        near = f"{stop.away_m:,.0f}"
        return [
            f"{stop.planned_s:g}",
            "not held",
            "–",
            _at(stop.expected_s),
            near,
            "–",
            "–",
            "–",
            "how near it came",
        ]
    return [
        f"{stop.planned_s:g}",
        f"{stop.held_s:,.1f}",
        _at(stop.arrived_s),
        _at(stop.expected_s),
        f"{stop.away_m:,.1f}",
        f"{stop.most_away_m:,.1f}",
        "–" if stop.higher_m is None else f"{stop.higher_m:+,.1f}",
        f"{stop.uncounted_s:,.1f}" if stop.uncounted_s > 0.05 else "–",
        "its words" if stop.by == "vehicle" else "its track",
    ]


def _at(seconds: float | None) -> str:
    return "–" if seconds is None else stopwatch(max(seconds, 0.0))


def totals(proof: Proof) -> Iterator[str]:
    """Yield the lines below the tables."""
    met, users = int(proof.met.sum()), len(proof.met)
    counted_bit = np.minimum(proof.received_bit, proof.demand_bit).sum()
    yield (
        f"{met} of {counted(users, 'user')} received what they need: {counted_bit / 1e6:,.1f} of "
        f"{proof.demand_bit.sum() / 1e6:,.1f} Mbit"
    )
    if not proof.in_flight and proof.flight_bit.any():
        yield "in flight (in brackets) does not count: the plan does not count on it (--in-flight counts it)"
    held = sum(stop.span is not None for stop in proof.stops)
    planned_s = sum(stop.planned_s for stop in proof.stops)
    yield (
        f"{held} of {counted(len(proof.stops), 'stop')} held, {sum(stop.held_s for stop in proof.stops):,.1f} s of "
        f"{planned_s:,.1f} s planned"
    )
    forecast_s = proof.plan.mission_s
    if not proof.flight.has_landed:
        yield f"forecast {clock(forecast_s)}; the track ends in the air after {clock(proof.flight.flown_s)}"
    else:
        more = (forecast_s - proof.flight.flown_s) / proof.flight.flown_s
        off = f"{abs(more):.1%} {'more' if more > 0 else 'less'}"
        whole = f" ({off})" if held == len(proof.stops) else ""
        yield f"flown {clock(proof.flight.flown_s)}, forecast {clock(forecast_s)}{whole}"


def to_json(proof: Proof) -> dict[str, Any]:
    """Return a proof as one object: SI units, Mbit, times of the vehicle's clock."""
    users = proof.plan.scenario.users
    return {
        "all_met": proof.all_met,
        "users_met": int(proof.met.sum()),
        "in_flight_counts": proof.in_flight,
        "flown_s": round(proof.flight.flown_s, 3),
        "forecast_s": round(proof.plan.mission_s, 3),
        "landed": proof.flight.has_landed,
        "system": proof.track.system,
        "autopilot": proof.track.autopilot,
        "users": [
            {
                "name": name,
                "stop": int(proof.plan.stop_of[user]),
                "demand_mbit": float(proof.demand_bit[user] / 1e6),
                "hovering_mbit": round(float(proof.hover_bit[user]) / 1e6, 6),
                "in_flight_mbit": round(float(proof.flight_bit[user]) / 1e6, 6),
                "d2d_mbit": round(float(proof.d2d_bit[user]) / 1e6, 6),
                "short_mbit": round(float(proof.short_bit[user]) / 1e6, 6),
                "met": bool(proof.met[user]),
                "reason": proof.reasons.get(user),
            }
            for user, name in enumerate(users.names)
        ],
        "stops": [
            {
                "planned_s": stop.planned_s,
                "held_s": round(stop.held_s, 3),
                "from_s": None if stop.span is None else round(stop.span.from_s, 3),
                "until_s": None if stop.span is None else round(stop.span.until_s, 3),
                "arrived_s": None if stop.arrived_s is None else round(stop.arrived_s, 3),
                "forecast_arrival_s": stop.expected_s,
                "known_by": stop.by,
                "off_place_m": round(stop.away_m, 2),
                "off_place_most_m": round(stop.most_away_m, 2),
                "off_height_m": None if stop.higher_m is None else round(stop.higher_m, 2),
                "not_counted_s": round(stop.uncounted_s, 3),
            }
            for stop in proof.stops
        ],
        "notes": [str(note) for note in proof.notes],
    }


def shortfall(proof: Proof) -> CheckError:
    """Return the error that names who is short, by how much and at which stop."""
    users = proof.plan.scenario.users
    missing = sorted(proof.reasons, key=lambda user: -float(proof.short_bit[user]))
    named = [
        f"{users.names[user]} by {_short(proof.short_bit[user])} Mbit ({proof.reasons[user]})"
        for user in missing[:MOST_NAMED]
    ]
    more = f" and {len(missing) - MOST_NAMED} more" if len(missing) > MOST_NAMED else ""
    return CheckError(
        f"{len(missing)} of {counted(len(users), 'user')} did not receive what they need: {'; '.join(named)}{more}"
    )
