"""Sorties over real ground: each is planned as it is flown, with as many stops of the whole plan as its battery lasts.

What a cut costs is not known beforehand there, as legs bend over hills and ways home climb. So sorties are whole plans
from the first: the most consecutive stops whose plan comes home with the reserve are found by bisection, then those
behind them. Every user is served where the whole plan serves it best, in one sortie.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.hover import hold_times
from mavplan.plan import HoverStyle, Plan, plan_along
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import cut_out
from mavplan.progress import Progress, tell_share
from mavplan.radio import planning_channel
from mavplan.scenario.model import Ints
from mavplan.sorties.share import ALONE, as_sortie
from mavplan.sorties.ways import Budget


def cut_over_ground(
    whole: Plan, lasts: Callable[[Plan], bool], budget: Budget, hover: HoverStyle, progress: Progress | None
) -> tuple[list[Plan], dict[int, Problem]]:
    """Return the sorties of a plan over real ground, each a plan of its own, and every stop that none serves, and why.

    Parameters
    ----------
    whole
        One flight that serves everybody, whatever the battery.
    lasts
        Whether a plan comes home with the reserve.
    budget
        What a battery gives, for what is said.
    hover
        What a stop is made of.
    progress
        Told how many of the stops have a sortie.

    Raises
    ------
    InputError
        What `plan_along` finds wrong.
    """
    stops = len(whole.trajectory.stops_m)
    found: list[Plan] = []
    problems: dict[int, Problem] = {}
    first = 0
    while first < stops:
        tell_share(progress, first / stops)
        best, end = None, first
        # All that is left is tried first: the last sortie takes it. Where none lasts, the last try is one stop.
        least, most, tried = first + 1, stops, stops
        while least <= most:
            plan = over_some(whole, np.arange(first, tried), hover)
            if plan is None:
                least = tried + 1  # pinned stops without users: others have to come with them
            elif lasts(plan):
                best, end, least = plan, tried, tried + 1
            else:
                most = tried - 1
            tried = (least + most) // 2
        if best is None:
            alone = over_some(whole, np.arange(first, first + 1), hover)
            problems[first] = _too_much(whole, first, alone, budget)
            end = first + 1
        else:
            found.append(best)
        first = end
    return found, problems


def worth_most(found: list[Plan], most: int) -> list[Plan]:
    """Return at most so many sorties, those that serve the most weighted demand, in their order.

    Raises
    ------
    InputError
        Those with pinned stops, which are flown in any case, are more.
    """
    pinned = sum(bool(plan.scenario.stops) for plan in found)
    if pinned > most:
        message = f"take {pinned} sorties, more than the {most} there may be, and are flown whoever is served"
        raise InputError([Problem("[[stops]]", message, "stops-sorties")])

    def value(plan: Plan) -> float:
        return math.inf if plan.scenario.stops else float(plan.scenario.users.weighted_bit.sum())

    best = sorted(range(len(found)), key=lambda number: -value(found[number]))[:most]
    return [found[number] for number in sorted(best)]


def over_some(whole: Plan, stops: Ints, hover: HoverStyle) -> Plan | None:
    """Return the plan of a sortie over some stops and their users; None where nobody is served at them."""
    scenario, trajectory = whole.scenario, whole.trajectory
    kept = np.flatnonzero(np.isin(trajectory.assignment.stop, stops))
    if not len(kept):
        return None
    if whole.links is None:
        raise AssertionError("a plan over real ground knows its links")
    pins = pins_of(scenario).at(trajectory.stops_m[stops])
    some = replace(
        as_sortie(scenario, scenario.users.some(kept, scenario.users.demand_bit)),
        stops=tuple(scenario.stops[pin] for pin in pins[pins != NO_PIN].tolist()),
    )
    flown = cut_out(trajectory, some.users, planning_channel(scenario), trajectory.stops_m[stops])
    rates = whole.links.rates_bit_s_hz[np.ix_(kept, stops)]
    return plan_along(some, flown, hover, lambda over: hold_times(some, over, whole.rules, rates))


def _too_much(whole: Plan, stop: int, alone: Plan | None, budget: Budget) -> Problem:
    """Return what is wrong with a stop that no sortie serves, ``alone`` the plan of one that does nothing else."""
    pin = int(pins_of(whole.scenario).at(whole.trajectory.stops_m[stop : stop + 1])[0])
    name = "" if pin == NO_PIN else whole.scenario.stops[pin].name
    if alone is None:
        return Problem(name or f"stop {stop + 1}", ALONE, "stop-alone")
    takes, gives = [f"{alone.forecast.mission_s:,.0f} s"], [f"{budget.seconds:,.0f} s"]
    if alone.forecast.mission_s <= budget.seconds:
        takes, gives = [f"{alone.forecast.used_wh:,.1f} Wh"], [f"{budget.wh:,.1f} Wh"]
    names = ", ".join(alone.scenario.users.names[:5]) + (" …" if len(alone.scenario.users) > 5 else "")
    message = (
        f"there, back and the hold take {takes[0]}, a battery gives {gives[0]} above its reserve, and over real ground "
        f"no hold is cut in two: no sortie serves {names}; a bigger battery would, a home nearer, or a lower demand"
    )
    where = f"stop {stop + 1}" + (f" ({name})" if name else "")
    return Problem(where, message, "beyond-battery")
