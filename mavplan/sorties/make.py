"""From a scenario to its sorties: one plan, cut where the battery ends, each part made into a mission of its own."""

from dataclasses import dataclass, replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.hover import Holds, hold_times
from mavplan.inflight import counts_in_flight
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.part import Part
from mavplan.plan import HoverStyle, Plan, make_plan, plan_along
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import Trajectory
from mavplan.progress import Progress, part_of
from mavplan.scenario.model import Scenario
from mavplan.sorties.beyond import within_reach
from mavplan.sorties.share import Share, shares
from mavplan.sorties.split import TooFar, split, unreachable, with_caution
from mavplan.sorties.ways import Budget, Ways, budget_of

ATTEMPTS = 4
"""How often the cuts are made again for what their own ways bring in flight."""


@dataclass(frozen=True, eq=False)
class Sorties:
    """The flights in their order, and who is left over.

    Attributes
    ----------
    whole
        The plan that was cut: one flight that serves everybody, whatever the battery.
    plans
        A plan a sortie; the whole one where one battery does it.
    not_served
        Names of the users that no sortie serves.
    rest
        A scenario of them, and of mates that may relay; None where all are served.
    """

    whole: Plan
    plans: tuple[Plan, ...]
    not_served: tuple[str, ...] = ()
    rest: Scenario | None = None

    @property
    def total_s(self) -> float:
        """Time in the air of all of them; what a change of batteries takes is not known."""
        return sum(plan.forecast.mission_s for plan in self.plans)


def plan_sorties(
    scenario: Scenario,
    hover: HoverStyle = "waypoint+loiter",
    most: int | None = None,
    progress: Progress | None = None,
) -> Sorties:
    """Plan a scenario and cut the plan into sorties.

    Parameters
    ----------
    scenario
        With the endurance or the battery of its vehicle.
    hover
        What a stop is made of.
    most
        How many sorties there may be: what they do not serve of the weighted demand is left over, and whom the
        endurance does not reach; None: as many as it takes.
    progress
        As for `make_plan`.

    Raises
    ------
    InputError
        As `make_plan`; no battery is given; users that no sortie serves and comes home with the reserve.
    """
    needed_budget(scenario)
    near, beyond = within_reach(scenario, most)
    whole = make_plan(near, hover, part_of(progress, 0, 2) if scenario.over_ground else progress)
    found = sorties_of(whole, hover, most, part_of(progress, 1, 2))
    if not beyond.any():
        return found
    left = beyond | scenario.users.named(found.not_served)
    names = scenario.users.names_of(left)
    parts = [plan.part or Part("sortie", 1, 1) for plan in found.plans]
    plans = tuple(
        replace(plan, part=replace(part, not_served=names))
        for plan, part in zip(found.plans, parts, strict=True)
    )
    return Sorties(whole, plans, names, scenario.left_over(left, scenario.users.demand_bit))


def sorties_of(
    whole: Plan,
    hover: HoverStyle = "waypoint+loiter",
    most: int | None = None,
    progress: Progress | None = None,
) -> Sorties:
    """Return a plan as it is where one battery does it, else cut into sorties; all as in `plan_sorties`."""
    budget = needed_budget(whole.scenario)
    if _lasts(whole, budget):
        return Sorties(whole, (whole,))
    if whole.scenario.over_ground:
        return _over_ground(whole, budget, hover, most, progress)
    if most is not None:
        from mavplan.sorties.choose import most_weighted

        return most_weighted(whole, budget, most, hover)
    return Sorties(whole, finished(whole, _all_served(whole, budget), hover))


def needed_budget(scenario: Scenario) -> Budget:
    """Return what a battery gives.

    Raises
    ------
    InputError
        The scenario does not say.
    """
    budget = budget_of(scenario.vehicle)
    if budget is None:
        message = "sorties need what a battery gives: set endurance_s, or battery_wh and mass_kg"
        raise InputError([Problem("[vehicle]", message, "no-battery")])
    return budget


def _all_served(whole: Plan, budget: Budget) -> list[Share]:
    """Return the sorties that serve everybody.

    Raises
    ------
    InputError
        Every stop that none can serve.
    """
    scenario, trajectory, rules = whole.scenario, whole.trajectory, whole.rules
    careful = with_caution(budget)
    ways = Ways(scenario, trajectory.stops_m)
    too_far = unreachable(ways, careful, rules)
    if too_far:
        raise InputError([too_far_problem(far, whole, budget) for far in too_far])
    found = cut(scenario, trajectory, whole.holds, ways, careful)
    if found is None:
        raise AssertionError("every stop can be served, and yet no sorties were found")
    return found


def cut(
    scenario: Scenario,
    trajectory: Trajectory,
    holds: Holds,
    ways: Ways,
    budget: Budget,
    most: int | None = None,
) -> list[Share] | None:
    """Return sorties over the stops of a trajectory that meet every demand; None where there are none, or too many.

    Where holds count what users receive in flight, that changes with the cuts: holds grow until all is met, at the
    worst to those that count on nothing.
    """
    rules = AUTOPILOTS[scenario.vehicle.autopilot]
    in_flight_off = replace(scenario, service=replace(scenario.service, in_flight=False))
    for attempt in range(ATTEMPTS):
        leaves = split(ways, holds.stored_s.tolist(), budget, rules)
        if leaves is None or (most is not None and len(leaves) > most):
            return None
        found = shares(scenario, trajectory, holds, leaves, rules)
        if found is not None:
            return found
        if not counts_in_flight(scenario):
            # What float32 takes off the pieces of a hold: a step for each.
            holds = replace(holds, stored_s=np.round(holds.stored_s + rules.hold_step_s, 6))
            continue
        still = hold_times(in_flight_off, trajectory, rules)
        # Half-way first: much of what was counted on is still received.
        stored_s = still.stored_s
        if attempt < ATTEMPTS - 2:
            steps = np.ceil((holds.stored_s + stored_s) / 2 / rules.hold_step_s - 1e-9)
            stored_s = np.round(steps * rules.hold_step_s, 6)
        holds = replace(still, stored_s=stored_s)
    raise AssertionError("holds that count on nothing in flight leave a demand open")


def finished(
    whole: Plan, found: list[Share], hover: HoverStyle, left: tuple[str, ...] = ()
) -> tuple[Plan, ...]:
    """Return the sorties as plans, each with its number and the names of those that none serves.

    Raises
    ------
    InputError
        What `plan_along` finds wrong with any of them.
    """
    plans: list[Plan] = []
    problems: list[Problem] = []
    for number, share in enumerate(found, start=1):
        try:
            made = plan_along(share.scenario, share.trajectory, hover, lambda _, holds=share.holds: holds)  # type: ignore[misc]
        except InputError as error:
            problems += [replace(p, where=f"sortie {number}, {p.where}") for p in error.problems]
            continue
        plans.append(made)
    if problems:
        raise InputError(problems)
    return _numbered(whole, plans, left)


def _numbered(whole: Plan, plans: list[Plan], left: tuple[str, ...] = ()) -> tuple[Plan, ...]:
    """Return the sorties with their numbers; the first says what is to be known of the whole."""
    parts = [Part("sortie", number, len(plans), not_served=left) for number in range(1, len(plans) + 1)]
    made = [
        replace(plan, part=part, altitude=whole.altitude) for plan, part in zip(plans, parts, strict=True)
    ]
    warnings = (*said_of_the_end(whole.scenario), *whole.trajectory.notes)
    first = replace(made[0], scenario=replace(made[0].scenario, warnings=warnings))
    return (first, *made[1:])


def _over_ground(
    whole: Plan,
    budget: Budget,
    hover: HoverStyle,
    most: int | None = None,
    progress: Progress | None = None,
) -> Sorties:
    """Return the sorties of a plan over real ground: all, or those that serve the most weighted demand.

    Raises
    ------
    InputError
        Every stop that no sortie serves, or where others may be left over every pinned one; too many sorties with
        pinned stops.
    """
    from mavplan.sorties.over_ground import cut_over_ground, worth_most

    careful, scenario = with_caution(budget), whole.scenario
    found, problems = cut_over_ground(whole, lambda plan: _lasts(plan, careful), budget, hover, progress)
    pinned = pins_of(scenario).at(whole.trajectory.stops_m) != NO_PIN
    all_count = most is None or not found
    fatal = [problem for stop, problem in problems.items() if all_count or pinned[stop]]
    if fatal:
        raise InputError(fatal)
    chosen = found if most is None else worth_most(found, most)
    left = ~scenario.users.named({name for plan in chosen for name in plan.scenario.users.names})
    names = scenario.users.names_of(left)
    rest = scenario.left_over(left, scenario.users.demand_bit)
    return Sorties(whole, _numbered(whole, chosen, names), names, rest)


def said_of_the_end(scenario: Scenario) -> tuple[Problem, ...]:
    """Return the scenario's warnings, and that sorties come home whatever it says."""
    if scenario.vehicle.end == "rtl":
        return scenario.warnings
    message = f'"{scenario.vehicle.end}" is for one flight: a sortie returns home for the next battery'
    return (*scenario.warnings, Problem("[vehicle] end", message, "sorties-return", "warning"))


def _lasts(plan: Plan, budget: Budget) -> bool:
    used_wh = plan.forecast.used_wh
    return plan.forecast.mission_s <= budget.seconds and (used_wh is None or used_wh <= budget.wh)


def too_far_problem(far: TooFar, whole: Plan, budget: Budget) -> Problem:
    """Return what is wrong with a stop that no sortie serves, and what would do."""
    vehicle, users = whole.scenario.vehicle, whole.scenario.users
    served = np.flatnonzero(whole.trajectory.assignment.stop == far.stop).tolist()
    names = ", ".join(users.names[n] for n in served[:5]) + (" …" if len(served) > 5 else "")
    says, would = [], []
    usable = 1 - vehicle.reserve_fraction
    if far.needs.seconds > budget.seconds:
        says.append(f"takes {far.needs.seconds:,.0f} s, the battery lasts {budget.seconds:,.0f} s")
        would.append(f"endurance_s = {np.ceil(far.needs.seconds / usable):,.0f}")
    if far.needs.wh > budget.wh:
        says.append(f"takes {far.needs.wh:,.1f} Wh, the battery gives {budget.wh:,.1f} Wh")
        would.append(f"battery_wh = {np.ceil(far.needs.wh / usable * 10) / 10:,.1f}")
    kept = f"a reserve of {vehicle.reserve_fraction:.0%} kept"
    message = (
        f"there, back and the least hold {' and '.join(says)} ({kept}): no sortie serves {names or 'it'}; "
        f"a bigger battery ({' and '.join(would)}) would, or a home nearer"
    )
    pinned = whole.pinned_names[far.stop]
    where = f"stop {far.stop + 1}" + (f" ({pinned})" if pinned else "")
    return Problem(where, message, "beyond-battery")
