"""The forecast of a plan as an object: ``forecast`` in ``X.mavplan.json`` and ``mavplan plan --json``."""

from dataclasses import fields
from typing import Any

from mavplan.mission.phases import Phases
from mavplan.mission.sendable import command_name
from mavplan.plan import Plan

SECONDS_DIGITS, WH_DIGITS = 2, 4

PHASES = tuple(phase.name for phase in fields(Phases))


def forecast_object(plan: Plan) -> dict[str, Any]:
    """Return sums, arrivals and items; energies are None where the mass is not known.

    Items count from 0 over those without home, as do stops.
    """
    found, stops = plan.forecast, stop_of_item(plan)
    return {
        "mission_s": _rounded(found.mission_s, SECONDS_DIGITS),
        "used_wh": _rounded(found.used_wh, WH_DIGITS),
        "remaining_fraction": _rounded(plan.remaining_fraction, 4),
        **_phases(found.seconds, found.energy_wh),
        "arrivals_s": [round(arrival_s, SECONDS_DIGITS) for arrival_s in plan.arrivals_s],
        "items": [
            {
                "item": item.item,
                "command": command_name(item.command),
                "stop": stops.get(item.item),
                **_phases(item.seconds, item.energy_wh),
                "done_s": _rounded(item.done_s, SECONDS_DIGITS),
                "used_wh": _rounded(item.used_wh, WH_DIGITS),
            }
            for item in found.items
        ],
    }


def stop_of_item(plan: Plan) -> dict[int, int]:
    """Return the stop that each item belongs to, by its index; items that belong to none are left out."""
    return {
        index: stop
        for stop, item in enumerate(plan.built.stop_items)
        for index in range(item.first, item.hold + 1)
    }


def _phases(seconds: Phases, energy_wh: Phases | None) -> dict[str, float | None]:
    """Return ``climb_s`` … ``descent_s`` and ``climb_wh`` … ``descent_wh``."""
    named = {f"{phase}_s": _rounded(getattr(seconds, phase), SECONDS_DIGITS) for phase in PHASES}
    for phase in PHASES:
        known = None if energy_wh is None else getattr(energy_wh, phase)
        named[f"{phase}_wh"] = _rounded(known, WH_DIGITS)
    return named


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
