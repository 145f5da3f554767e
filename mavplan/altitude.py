"""The altitude at which a planner's mission is the shortest: whole metres, few plans, the same every time.

Each altitude that is tried is planned like any other: R and rates fall with it, climb and descent grow, hills hide
fewer users.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from mavplan.errors import InputError, Problem
from mavplan.planners import SEARCHING
from mavplan.progress import Progress, part_of
from mavplan.radio import highest_altitude_m, planning_error_m, planning_radio
from mavplan.scenario.model import Scenario

if TYPE_CHECKING:
    from mavplan.plan import HoverStyle, Plan

GRID = 7
"""Altitudes that are tried first, evenly spread."""

REFINED = 6
"""Altitudes between the neighbours of the best of them that are tried at most."""

GOLDEN = (math.sqrt(5) - 1) / 2

TRY = 0.1
"""Share of the time limit that a planner with one has for each try; the chosen altitude is planned again."""

Objective = Literal["mission_s", "path_m", "tour_m"]


@dataclass(frozen=True, slots=True)
class Tried:
    """One altitude and what its plan came to; None where there is no plan at this altitude."""

    altitude_m: float
    value: float | None


@dataclass(frozen=True, slots=True)
class ChosenAltitude:
    """Which altitude was chosen of which, and by what.

    Attributes
    ----------
    chosen_m
        The altitude.
    low_m, high_m
        Between what it was sought.
    objective
        What was made small: the mission before holds are rounded up, or the path (and the way home) of `length`.
    tried
        Every altitude tried, ascending.
    """

    chosen_m: float
    low_m: float
    high_m: float
    objective: Objective
    tried: tuple[Tried, ...]


def plan_at_best_altitude(
    scenario: Scenario,
    hover: "HoverStyle" = "waypoint+loiter",
    progress: Progress | None = None,
) -> "Plan":
    """Return the plan at the altitude between `altitude_min_m` and `altitude_max_m` that makes it the shortest.

    Of altitudes that are equally good the lowest.

    Raises
    ------
    InputError
        No altitude is left between the two, or there is a plan at none; then what is wrong at the lowest.
    """
    from mavplan.plan import make_plan

    low_m, high_m = limits_m(scenario)
    plans: dict[int, Plan] = {}
    faults: dict[int, InputError] = {}
    todo = min(GRID, high_m - low_m + 1) + (REFINED if high_m - low_m + 1 > GRID else 0) + 1
    searching = scenario.planner.name in SEARCHING

    def value(altitude_m: int) -> float:
        if altitude_m not in plans and altitude_m not in faults:
            tell = part_of(progress, len(plans) + len(faults), todo)
            tell(0, 1)
            try:
                plans[altitude_m] = make_plan(at_altitude(scenario, altitude_m, TRY), hover, tell)
            except InputError as error:
                faults[altitude_m] = error
        return value_of(plans[altitude_m])[1] if altitude_m in plans else math.inf

    best = least(value, low_m, high_m)
    if best not in plans:
        raise faults[low_m]
    if searching:
        tell = part_of(progress, todo - 1, todo)
        again = make_plan(at_altitude(scenario, best), hover, tell)
        plans[best] = min((plans[best], again), key=lambda plan: value_of(plan)[1])
    found = plans[best]
    tried = tuple(
        Tried(float(at), round(value_of(plans[at])[1], 3) if at in plans else None)
        for at in sorted({*plans, *faults})
    )
    chosen = ChosenAltitude(float(best), float(low_m), float(high_m), value_of(found)[0], tried)
    # A plan of a try is as good as one with the whole time limit.
    return replace(found, scenario=replace(found.scenario, planner=scenario.planner), altitude=chosen)


def at_altitude(scenario: Scenario, altitude_m: float, share: float = 1.0) -> Scenario:
    """Return the scenario at one altitude, with a share of its time limit."""
    planner = replace(scenario.planner, time_limit_s=share * scenario.planner.time_limit_s)
    vehicle = replace(scenario.vehicle, altitude_m=float(altitude_m))
    return replace(scenario, vehicle=vehicle, planner=planner, search_altitude=False)


def value_of(plan: "Plan") -> tuple[Objective, float]:
    """Return what is made small, and how small it is."""
    bound = plan.trajectory.bound
    if plan.trajectory.planner == "length":
        if bound is not None and bound.objective == "tour_m":
            return "tour_m", bound.plan
        return "path_m", plan.trajectory.length_m
    return "mission_s", plan.forecast.flight_s + float(plan.holds.asked_s.sum())


def limits_m(scenario: Scenario) -> tuple[int, int]:
    """Return the lowest and the highest whole metres that may be flown at.

    Raises
    ------
    InputError
        There are none.
    """
    vehicle, options = scenario.vehicle, scenario.fence_options
    low_m, high_m = vehicle.altitude_min_m, vehicle.altitude_max_m
    why = [f"altitude_min_m = {low_m:g}", f"altitude_max_m = {high_m:g}"]
    if scenario.over_ground:
        low_m = max(low_m, scenario.terrain_options.clearance_m)
        why.append(f"[terrain] clearance_m = {scenario.terrain_options.clearance_m:g}")
    elif options.max_alt_rel_m is not None:
        high_m = min(high_m, options.max_alt_rel_m)
        why.append(f"[fence] max_alt_rel_m = {options.max_alt_rel_m:g}")
    reach_m = highest_altitude_m(planning_radio(scenario.radio)) - planning_error_m(vehicle, scenario.service)
    if reach_m <= high_m and not scenario.over_ground:
        high_m = min(high_m, math.ceil(reach_m) - 1)
        why.append(f"the radio, which reaches the ground from below {reach_m:,.1f} m")
    lowest, highest = math.ceil(low_m - 1e-9), math.floor(high_m + 1e-9)
    if lowest > highest:
        message = f'"auto" finds no whole metre between {", ".join(why[:-1])} and {why[-1]}'
        raise InputError([Problem("[vehicle] altitude_m", message, "no-altitude")])
    return lowest, highest


def least(value: Callable[[int], float], low: int, high: int) -> int:
    """Return the whole number from low to high with the least value found; of equal ones the lowest.

    A grid first, then golden sections between the neighbours of its best. Of a function with one valley that is the
    bottom or near to it; of any other, the grid's best is never missed.

    Parameters
    ----------
    value
        Infinite where there is none. Each number may be asked for again.
    """
    count = min(GRID, high - low + 1)
    grid = sorted({low + round(step * (high - low) / max(count - 1, 1)) for step in range(count)})
    values = [value(number) for number in grid]
    at = min(range(len(grid)), key=lambda row: (values[row], grid[row]))
    if math.isinf(values[at]):
        return low
    known = dict(zip(grid, values, strict=True))
    left, right = grid[max(at - 1, 0)], grid[min(at + 1, len(grid) - 1)]
    best = grid[at]
    for _ in range(REFINED):
        fresh = _next(left, best, right)
        if fresh is None:
            break
        known[fresh] = value(fresh)
        if (known[fresh], fresh) < (known[best], best):
            left, right = (left, best) if fresh < best else (best, right)
            best = fresh
        else:
            left, right = (fresh, right) if fresh < best else (left, fresh)
    return min(known, key=lambda number: (known[number], number))


def _next(left: int, best: int, right: int) -> int | None:
    """Return the number to try in the longer part between the best and its neighbours; None where none is left."""
    below, above = best - left, right - best
    if max(below, above) < 2:
        return None
    step = max(1, round(max(below, above) * (1 - GOLDEN)))
    return best - step if below >= above else best + step
