"""When each vehicle starts, so that no two of them are in one place at one time. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.errors import Problem
from mavplan.fleet.timeline import Timeline, meeting, timeline
from mavplan.geo import LocalPlane
from mavplan.plan import Plan

SAME_HEIGHT_M = 10.0
"""Heights that differ by less are the same, where no step between the vehicles is smaller."""

DELAY_STEP_S = 5.0
"""Starts are put off by whole steps of this: nobody presses a button to the second."""


@dataclass(frozen=True)
class Starts:
    """When each vehicle starts, counted from the first; and what is to be said about it."""

    start_s: tuple[float, ...]
    said: tuple[Problem, ...]

    def longest_s(self, plans: Sequence[Plan | None]) -> float:
        """Return when the last mission is over."""
        flying = [(start_s, plan) for start_s, plan in zip(self.start_s, plans, strict=True) if plan]
        return max(start_s + plan.forecast.mission_s for start_s, plan in flying)


def kept_apart(plans: Sequence[Plan | None], *, separation_m: float, altitude_step_m: float) -> Starts | None:
    """Return starts that keep the vehicles apart: the longest mission first, each other one as early as may be.

    Parameters
    ----------
    plans
        One a vehicle, None for one that stays on the ground.
    separation_m
        Over the ground, at the same height; 0 asks for nothing.
    altitude_step_m
        Between the heights of the vehicles.

    Returns
    -------
    Starts or None
        None where no start does: one of them ends in the way of another.
    """
    vertical_m = min(altitude_step_m, SAME_HEIGHT_M) if altitude_step_m > 0 else SAME_HEIGHT_M
    flying = [vehicle for vehicle, plan in enumerate(plans) if plan is not None]
    start_s = [0.0] * len(plans)
    if separation_m <= 0 or len(flying) < 2:
        return Starts(tuple(start_s), ())
    first = next(plan for plan in plans if plan is not None)
    plane = LocalPlane(first.scenario.home.lat_deg, first.scenario.home.lon_deg)
    lines = {vehicle: timeline(plan, plane) for vehicle in flying if (plan := plans[vehicle]) is not None}
    missions_s = {
        vehicle: plan.forecast.mission_s for vehicle in flying if (plan := plans[vehicle]) is not None
    }
    placed: list[int] = []
    for vehicle in sorted(flying, key=lambda v: -missions_s[v]):
        found = _earliest_s(
            lines, placed, start_s, vehicle, sum(missions_s.values()), separation_m, vertical_m
        )
        if found is None:
            return None
        start_s[vehicle] = found
        placed.append(vehicle)
    late = [vehicle for vehicle in flying if start_s[vehicle] > 0]
    said = [
        Problem(
            f"vehicle {vehicle + 1}",
            f"starts {start_s[vehicle]:,.0f} s after the first, to stay {separation_m:g} m from the others",
            "later-start",
            "warning",
        )
        for vehicle in late
    ]
    return Starts(tuple(start_s), tuple(said))


def _earliest_s(
    lines: dict[int, Timeline],
    placed: Sequence[int],
    start_s: Sequence[float],
    vehicle: int,
    latest_s: float,
    separation_m: float,
    vertical_m: float,
) -> float | None:
    """Return the earliest start of a vehicle that keeps it from those that are placed."""
    delay_s = 0.0
    while delay_s <= latest_s + DELAY_STEP_S:
        if all(
            meeting(
                lines[other],
                lines[vehicle],
                start_s[other],
                delay_s,
                separation_m=separation_m,
                vertical_m=vertical_m,
            )
            is None
            for other in placed
        ):
            return delay_s
        delay_s += DELAY_STEP_S
    return None
