"""Sorties of a fleet in rounds: in each, one sortie of each vehicle that has one left, kept apart from the others.

A round begins when all vehicles of the one before stand at home. Which vehicle flies what is found in two ways: each
vehicle's own flight is cut where its battery ends; or the sorties of one flight are dealt out.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mavplan.errors import InputError, Problem
from mavplan.fleet.apart import Starts, kept_apart
from mavplan.plan import HoverStyle, Plan, plan_along
from mavplan.planners.trajectory import moved
from mavplan.radio import planning_channel
from mavplan.scenario.model import Scenario
from mavplan.sorties.make import sorties_of


@dataclass(frozen=True, eq=False)
class Round:
    """What each vehicle flies, None for one that stays on the ground, and when each starts."""

    plans: tuple[Plan | None, ...]
    starts: Starts

    @property
    def seconds(self) -> float:
        """From its first start until its last mission is over."""
        return self.starts.longest_s(self.plans)


@dataclass(frozen=True)
class Apart:
    """What vehicles keep over the ground at the same height, and the step between their heights."""

    separation_m: float
    altitude_step_m: float

    def round(self, plans: Sequence[Plan | None]) -> Round | None:
        """Return the round of these flights; None where no starts keep them apart."""
        starts = kept_apart(plans, separation_m=self.separation_m, altitude_step_m=self.altitude_step_m)
        return None if starts is None else Round(tuple(plans), starts)


def rounds_of(cut: Sequence[Sequence[Plan]], apart: Apart) -> list[Round] | None:
    """Return the rounds of vehicles that fly their sorties in order; None where those of one cannot be kept apart."""
    found = []
    for number in range(max(len(plans) for plans in cut)):
        one = apart.round([plans[number] if number < len(plans) else None for plans in cut])
        if one is None:
            return None
        found.append(one)
    return found


@dataclass(frozen=True)
class Cut:
    """The sorties of each vehicle in their order, none of one that stays on the ground, and who is not served."""

    sorties: tuple[tuple[Plan, ...], ...]
    not_served: tuple[str, ...] = ()


def cut_each(plans: Sequence[Plan | None], hover: HoverStyle, most: int | None = None) -> Cut:
    """Return the sorties of each vehicle's flight.

    Parameters
    ----------
    plans
        What each vehicle would fly with a battery that lasts; None for one that stays on the ground.
    hover
        What a stop is made of.
    most
        How many sorties each vehicle has at most: then a vehicle whose battery serves nobody stays on the ground,
        unless pinned stops are its business, or nobody is served by any.

    Raises
    ------
    InputError
        Everything that no sortie of its vehicle serves.
    """
    found: list[tuple[Plan, ...]] = []
    left: list[str] = []
    problems: list[Problem] = []
    fatal = most is None
    for number, plan in enumerate(plans, start=1):
        if plan is None:
            found.append(())
            continue
        try:
            made = sorties_of(plan, hover, most)
        except InputError as error:
            problems += [replace(p, where=f"vehicle {number}, {p.where}") for p in error.problems]
            fatal = (
                fatal or bool(plan.scenario.stops) or any(p.code != "beyond-battery" for p in error.problems)
            )
            found.append(())
            left += plan.scenario.users.names
        else:
            found.append(made.plans)
            left += made.not_served
    if problems and (fatal or not any(found)):
        raise InputError(problems)
    return Cut(tuple(found), tuple(left))


def dealt(
    sorties: Sequence[Plan],
    own: Sequence[Scenario],
    hover: HoverStyle,
    apart: Apart,
    most: int | None = None,
) -> list[Round] | None:
    """Return rounds of the sorties of one flight, for vehicles that start at one home; None where there are none.

    Each round begins with the longest that is left. Then, vehicle by vehicle, the one is added that saves the most: its
    own time less what the round takes longer with it. Where none saves anything the vehicle waits.

    Parameters
    ----------
    sorties
        That serve everybody, each a whole flight.
    own
        The scenario as each vehicle has it: its altitude.
    hover
        What a stop is made of.
    apart
        What they keep.
    most
        Sorties of a vehicle at most.
    """
    left = sorted(range(len(sorties)), key=lambda n: -sorties[n].forecast.mission_s)
    made: dict[tuple[int, int], Plan | None] = {}

    def of(number: int, vehicle: int) -> Plan | None:
        if (number, vehicle) not in made:
            made[number, vehicle] = _of_vehicle(sorties[number], own[vehicle], hover)
        return made[number, vehicle]

    found: list[Round] = []
    while left:
        flying: list[Plan | None] = [None] * len(own)
        now: Round | None = None
        for vehicle in range(len(own)):
            if most is not None and sum(one.plans[vehicle] is not None for one in found) == most:
                continue
            best: tuple[float, int, Round] | None = None
            for number in left[:1] if now is None else left:
                plan = of(number, vehicle)
                if plan is None:
                    continue
                tried = apart.round([*flying[:vehicle], plan, *flying[vehicle + 1 :]])
                if tried is None:
                    continue
                longer_s = tried.seconds - (0.0 if now is None else now.seconds)
                saved_s = math.inf if now is None else plan.forecast.mission_s - longer_s
                if saved_s > 0 and (best is None or saved_s > best[0]):
                    best = saved_s, number, tried
            if best is not None:
                now = best[2]
                flying = list(now.plans)
                left.remove(best[1])
        if now is None:
            return None
        found.append(now)
    return found


def _of_vehicle(plan: Plan, own: Scenario, hover: HoverStyle) -> Plan | None:
    """Return a sortie as a vehicle flies it from its height; None where it does not reach everybody from there."""
    if plan.scenario.vehicle == own.vehicle:
        return plan
    scenario = replace(plan.scenario, vehicle=own.vehicle)
    found = plan.trajectory
    flown = moved(found, scenario.users, planning_channel(scenario), found.stops_m)
    if not flown.assignment.served.all():
        return None
    try:
        return plan_along(scenario, flown, hover)
    except InputError:
        return None


def said_once(rounds: Sequence[Round], said: tuple[Problem, ...]) -> list[Round]:
    """Return the rounds with what is to be known of the scenario told by their first flight alone, as its own."""
    flights = [plan for one in rounds for plan in one.plans if plan is not None]
    said = tuple(dict.fromkeys([*said, *(problem for plan in flights for problem in plan.scenario.warnings)]))
    found = []
    for one in rounds:
        plans: list[Plan | None] = []
        for plan in one.plans:
            told = None if plan is None else replace(plan.scenario, warnings=said)
            plans.append(None if plan is None or told is None else replace(plan, scenario=told))
            said = said if plan is None else ()
        found.append(replace(one, plans=tuple(plans)))
    return found
