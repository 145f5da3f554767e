"""Where not everybody can be served: who is, so that the most weighted demand is met within so many sorties. Pure.

The value of a user is its priority times its demand; users are served whole or not at all, one that is served through
D2D together with its mate. Pinned stops are flown whoever is chosen. With up to `ALL_TRIED` users every choice is
tried, else one is built up by value for seconds and then improved by exchanges. Stops and their order are the plan's,
those that nobody needs left out.
"""

from bisect import bisect_left, insort
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.hover import hold_times
from mavplan.mission.autopilots import AutopilotRules
from mavplan.plan import HoverStyle, Plan
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import moved
from mavplan.radio import planning_channel
from mavplan.scenario.model import UNPAIRED, Floats
from mavplan.sorties.make import Sorties, cut, finished, too_far_problem
from mavplan.sorties.share import ALONE, Share
from mavplan.sorties.split import split, unreachable, with_caution
from mavplan.sorties.ways import Budget, Ways

ALL_TRIED = 9
"""Units of which every choice is tried: 512 choices."""

EXCHANGES = 1500
"""Exchanges that are tried at most."""

FILLED_UP = 40
"""Users that are tried at most with the real holds, which stops share, after the choice."""


def most_weighted(whole: Plan, budget: Budget, most: int, hover: HoverStyle) -> Sorties:
    """Return at most so many sorties that meet the most weighted demand, and the scenario of the rest.

    Raises
    ------
    InputError
        Nobody can be served.
    """
    scenario, trajectory, rules = whole.scenario, whole.trajectory, whole.rules
    careful = with_caution(budget)
    ways = Ways(scenario, trajectory.stops_m)
    too_far = unreachable(ways, careful, rules)
    if not too_far:
        everybody = cut(scenario, trajectory, whole.holds, ways, careful, most)
        if everybody is not None:
            return Sorties(whole, finished(whole, everybody, hover))
    pinned = pins_of(scenario).at(trajectory.stops_m) != NO_PIN
    if any(pinned[far.stop] for far in too_far):
        raise InputError([too_far_problem(far, whole, budget) for far in too_far if pinned[far.stop]])
    choice = _Choice(whole, ways, careful, most)
    chosen = choice.all_tried() if len(choice.units) <= ALL_TRIED else choice.built_up()
    if not chosen:
        raise InputError(
            [too_far_problem(far, whole, budget) for far in too_far] or [choice.nobody(whole, budget)]
        )
    chosen, found = choice.filled_up(chosen)
    left = np.ones(len(scenario.users), dtype=bool)
    for unit in chosen:
        left[choice.units[unit].users] = False
    names = scenario.users.names_of(left)
    return Sorties(
        whole,
        finished(whole, found, hover, names),
        names,
        scenario.left_over(left, scenario.users.demand_bit),
    )


@dataclass(frozen=True)
class Unit:
    """Users that are served together or not at all: one, or a mate with whom it relays to.

    Attributes
    ----------
    users
        Their indices.
    stop
        Where they are served.
    seconds
        What that takes where nobody else is served there.
    value
        Σ priority · demand, Mbit.
    """

    users: list[int]
    stop: int
    seconds: float
    value: float


class _Choice:
    """Some of the users, and whether the sorties there may be serve them."""

    def __init__(self, whole: Plan, ways: Ways, budget: Budget, most: int) -> None:
        self._whole, self._ways, self._budget, self._most = whole, ways, budget, most
        self._rules: AutopilotRules = whole.rules
        self._tdma = whole.scenario.service.mode == "tdma"
        self.units = _units(whole)
        self._pinned_s = _pinned_s(whole)

    def nobody(self, whole: Plan, budget: Budget) -> Problem:
        """Return the problem of a battery that does not do for the demand of any user."""
        limits = [
            f"{budget.seconds:,.0f} s" if np.isfinite(budget.seconds) else "",
            f"{budget.wh:,.1f} Wh" if np.isfinite(budget.wh) else "",
        ]
        kept = f"a reserve of {whole.scenario.vehicle.reserve_fraction:.0%} kept"
        message = (
            f"{' and '.join(limit for limit in limits if limit)} ({kept}) do not serve any user whole"
            f"{', pinned stops flown,' if self._pinned_s else ''} within "
            f"{self._most} {'sortie' if self._most == 1 else 'sorties'}: a bigger battery, or more sorties, would"
        )
        return Problem("[vehicle]", message, "beyond-battery")

    def all_tried(self) -> list[int]:
        """Return the best of all choices: the greatest value, then the most users."""
        numbers = range(len(self.units))
        every = [list(c) for size in range(1, len(self.units) + 1) for c in combinations(numbers, size)]

        def worth(some: list[int]) -> tuple[float, int]:
            return self._value(some), sum(len(self.units[unit].users) for unit in some)

        for some in sorted(every, key=worth, reverse=True):
            fits = self._seconds(some) is not None
            if fits and self._pinned_s and self._shares(some, shared=True) is None:
                continue  # a pinned stop would be alone in a sortie
            if fits or (
                self._seconds(some, reached=True) is not None and self._shares(some, shared=True) is not None
            ):
                return some
        return []

    def built_up(self) -> list[int]:
        """Return a choice by value for seconds, improved by exchanges."""
        chosen = self._filled([], list(range(len(self.units))))
        tried = 0
        improved = True
        while improved and tried < EXCHANGES:
            improved = False
            outside = sorted(set(range(len(self.units))) - set(chosen), key=lambda u: -self.units[u].value)
            for new in outside:
                for old in sorted(chosen, key=lambda u: self.units[u].value):
                    tried += 1
                    if self.units[old].value >= self.units[new].value or tried >= EXCHANGES:
                        break
                    swapped = [unit for unit in chosen if unit != old] + [new]
                    if self._seconds(swapped) is not None:
                        chosen = self._filled(swapped, [unit for unit in outside if unit != new])
                        improved = True
                        break
                if improved or tried >= EXCHANGES:
                    break
        return chosen

    def filled_up(self, chosen: list[int]) -> tuple[list[int], list[Share]]:
        """Return the choice and whoever still fits where stops share what a user receives, and its sorties."""
        found = self._shares(chosen, shared=True) or self._shares(chosen, shared=False)
        if found is None and self._pinned_s:
            raise InputError([Problem("[[stops]]", f"one of them {ALONE}", "stop-alone")])
        if found is None:
            raise AssertionError("a choice that fits has no sorties")
        outside = sorted(set(range(len(self.units))) - set(chosen), key=self._dearness)
        for unit in outside[:FILLED_UP]:
            more = self._shares([*chosen, unit], shared=True)
            if more is not None:
                chosen, found = [*chosen, unit], more
        return chosen, found

    def _value(self, some: list[int]) -> float:
        return sum(self.units[unit].value for unit in some)

    def _dearness(self, unit: int) -> float:
        """Return seconds for value of a unit by itself."""
        found = self.units[unit]
        way = self._ways.out(found.stop).plus(self._ways.home(found.stop)).seconds
        return (way + found.seconds) / found.value if found.value > 0 else np.inf

    def _filled(self, chosen: list[int], outside: list[int]) -> list[int]:
        """Return the choice with others added, always the one with the most value for its seconds that fits."""
        chosen, waiting = list(chosen), list(outside)
        held = self._held_s(chosen)
        stops = sorted(held)
        while waiting:
            unit = max(waiting, key=lambda u: self._worth(u, stops, held))
            waiting.remove(unit)
            if self._seconds([*chosen, unit]) is None:
                continue
            chosen.append(unit)
            held = self._held_s(chosen)
            if self.units[unit].stop not in stops:
                insort(stops, self.units[unit].stop)
        return chosen

    def _worth(self, unit: int, stops: list[int], held: dict[int, float]) -> tuple[float, float]:
        """Return value for the seconds that a unit adds to one long flight."""
        found, ways = self.units[unit], self._ways
        if found.stop in held:
            before_s = held[found.stop]
            more_s = found.seconds if self._tdma else max(found.seconds - before_s, 0.0)
        else:
            at = bisect_left(stops, found.stop)
            before, after = stops[at - 1] if at else None, stops[at] if at < len(stops) else None
            to = ways.out(found.stop) if before is None else ways.leg(before, found.stop)
            on = ways.home(found.stop) if after is None else ways.leg(found.stop, after)
            more_s = to.seconds + on.seconds + found.seconds
            if before is not None and after is not None:
                more_s -= ways.leg(before, after).seconds
            elif before is not None or after is not None:
                more_s -= (ways.home(before) if before is not None else ways.out(after or 0)).seconds
        return found.value / max(more_s, 1e-3), -more_s

    def _held_s(self, some: list[int]) -> dict[int, float]:
        """Return how long each stop is held where every user is served at its own, as the autopilot stores it."""
        asked: dict[int, float] = {}
        for unit in some:
            stop, seconds = self.units[unit].stop, self.units[unit].seconds
            asked[stop] = asked.get(stop, 0.0) + seconds if self._tdma else max(asked.get(stop, 0.0), seconds)
        for stop, seconds in self._pinned_s.items():
            asked[stop] = max(asked.get(stop, 0.0), seconds)
        step_s = self._rules.hold_step_s
        return {
            stop: max(round(np.ceil(s / step_s - 1e-7) * step_s, 6), self._rules.min_hold_s)
            for stop, s in asked.items()
        }

    def _seconds(self, some: list[int], *, reached: bool = False) -> float | None:
        """Return the time in the air of sorties for a choice, or just to reach it; None where they are too many."""
        held = self._held_s(some)
        if reached:
            held = self._held_s([]) | {
                stop: self._rules.min_hold_s for stop in held if stop not in self._pinned_s
            }
        stops = sorted(held)
        if self._most == 1:
            cost = self._ways.flight(stops, [held[stop] for stop in stops])
            return cost.seconds if self._budget.allows(cost) else None
        holds_s = [held.get(stop, 0.0) for stop in range(len(self._ways))]
        leaves = split(self._ways, holds_s, self._budget, self._rules, stops)
        if leaves is None or len(leaves) > self._most:
            return None
        return sum(self._ways.flight(list(leaf.stops), list(leaf.holds_s)).seconds for leaf in leaves)

    def _shares(self, some: list[int], *, shared: bool) -> list[Share] | None:
        """Return the sorties of a choice with their users; stops share what a user receives, or do not."""
        whole = self._whole
        held = self._held_s(some)
        stops = sorted(held)
        kept = np.array(sorted(n for unit in some for n in self.units[unit].users), dtype=np.int64)
        users = whole.scenario.users.some(kept, whole.scenario.users.demand_bit)
        scenario = replace(whole.scenario, users=users)
        stops_m: Floats = whole.trajectory.stops_m[stops]
        flown = moved(whole.trajectory, users, planning_channel(scenario), stops_m)
        trajectory = replace(flown, bound=None)
        ways = Ways(scenario, stops_m)
        if unreachable(ways, self._budget, self._rules):
            return None
        holds = hold_times(scenario, trajectory, self._rules)
        if not shared:
            stored_s = np.array([held[stop] for stop in stops])
            holds = replace(holds, asked_s=np.minimum(holds.asked_s, stored_s), stored_s=stored_s)
        try:
            return cut(scenario, trajectory, holds, ways, self._budget, self._most)
        except InputError:
            return None  # a pinned stop would be alone in a sortie


def _pinned_s(whole: Plan) -> dict[int, float]:
    """Return the least hold of each pinned stop by its number."""
    pins = pins_of(whole.scenario).at(whole.trajectory.stops_m).tolist()
    return {stop: whole.scenario.stops[pin].hold_s for stop, pin in enumerate(pins) if pin != NO_PIN}


def _units(whole: Plan) -> list[Unit]:
    """Return the users as units, in the order of their first user."""
    users, assignment = whole.scenario.users, whole.trajectory.assignment
    channel = planning_channel(whole.scenario)
    stops_m = whole.trajectory.stops_m
    found = []
    for user in np.flatnonzero(~assignment.d2d).tolist():
        mate, together = int(users.mate[user]), [user]
        if mate != UNPAIRED and assignment.d2d[mate]:
            together.append(mate)
        stop = int(assignment.stop[user])
        apart_m = np.linalg.norm(users.xy_m[user : user + 1] - stops_m[stop], axis=1)
        rate_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(apart_m)[0])
        seconds = float(users.demand_bit[together].sum()) / rate_bit_s
        value = float(users.weighted_bit[together].sum()) / 1e6
        found.append(Unit(together, stop, seconds, value))
    return found
