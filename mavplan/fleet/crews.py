"""Which users each vehicle of a fleet serves, and the flights that come of it.

The stops of one vehicle's plan are divided; then stops move between vehicles while that makes the longest of the real
flights shorter.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.fleet.divide import divide, inserted
from mavplan.geo import LocalPlane
from mavplan.plan import HoverStyle, Plan, make_plan, plan_along
from mavplan.planners import SEARCHING
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.spread import lent, spread_here
from mavplan.planners.trajectory import cut_out
from mavplan.radio import planning_channel
from mavplan.scenario.model import UNPAIRED, Floats, Ints, Scenario
from mavplan.scenario.sections import PinnedStop
from mavplan.sorties.ways import Ways

MOST_TRIALS = 40
"""Whole flights that are planned to see whether a stop is better off with another vehicle."""


class Crews:
    """Which users each vehicle serves, and the flights that come of it.

    Parameters
    ----------
    base
        A plan of one vehicle, whose stops are divided.
    own
        The scenario as each vehicle has it.
    hover
        What a stop is made of.
    """

    def __init__(self, base: Plan, own: Sequence[Scenario], hover: HoverStyle) -> None:
        self._base, self._own, self._hover = base, own, hover
        here = LocalPlane(own[0].home.lat_deg, own[0].home.lon_deg)
        lat_deg, lon_deg = here.to_lat_lon_deg(base.trajectory.stops_m)
        self._stops_m = [
            LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg).to_xy_m(lat_deg, lon_deg)
            for scenario in own
        ]
        self._ways: list[Ways] = []
        self._made: dict[tuple[int, tuple[int, ...]], Plan | None] = {}
        self._pins = pins_of(base.scenario).at(base.trajectory.stops_m)
        self._users_of = self._by_stop()

    def planned(self) -> tuple[Plan | None, ...]:
        """Return a plan a vehicle, None for one that has nothing to do."""
        stops_m = self._stops_m[0]
        shared = all(scenario.home == self._own[0].home for scenario in self._own)
        ways = [Ways(scenario, xy_m) for scenario, xy_m in zip(self._own, self._stops_m, strict=True)]
        if shared and all(s.vehicle == self._own[0].vehicle for s in self._own):
            ways = [ways[0]] * len(ways)
        wanted = [
            stop for stop in range(len(stops_m)) if len(self._users_of[stop]) or self._pins[stop] != NO_PIN
        ]
        bearing = np.arctan2(stops_m[:, 0], stops_m[:, 1])
        self._ways = ways
        orders = [wanted, sorted(wanted, key=lambda stop: float(bearing[stop]))]
        parts = divide(ways, self._base.holds.stored_s.tolist(), orders)
        parts = self._improved(self._with_users(parts))
        flying = [vehicle for vehicle, part in enumerate(parts) if part]
        tasks = [(self._scenario(vehicle, parts[vehicle]), self._hover) for vehicle in flying]
        # These take so long that other hands are worth while.
        spread = lent() if self._own[0].planner.name in SEARCHING else spread_here
        anew = dict(zip(flying, spread(planned_anew, tasks), strict=True))
        return tuple(
            self._best(vehicle, part, anew[vehicle]) if part else None for vehicle, part in enumerate(parts)
        )

    def _with_users(self, parts: list[list[int]]) -> list[list[int]]:
        """Return the parts, pinned stops of one without users each given to another that has some, at least detour."""
        holds_s = self._base.holds.stored_s
        found = [list(part) if self._serves(part) else [] for part in parts]
        for part in parts:
            for stop in [] if self._serves(part) else part:
                longer = {
                    vehicle: inserted(self._ways[vehicle], mine, stop)
                    for vehicle, mine in enumerate(found)
                    if mine
                }
                least = min(
                    longer,
                    key=lambda v: (
                        self._ways[v].flight(longer[v], [float(holds_s[s]) for s in longer[v]]).seconds
                    ),
                )
                found[least] = longer[least]
        return found

    def _serves(self, part: Sequence[int]) -> bool:
        return any(self._users_of[stop] for stop in part)

    def _by_stop(self) -> list[list[int]]:
        """Return the users that go with each stop: those it serves best, a pair with the stop of its first member.

        Where a pinned stop is above one of a pair, both go with that.
        """
        users, assignment = self._base.scenario.users, self._base.trajectory.assignment
        pinned = {stop.user for stop in self._base.scenario.stops}
        found: list[list[int]] = [[] for _ in range(len(self._base.trajectory.stops_m))]
        for user in range(len(users)):
            mate = int(users.mate[user])
            pair = [user] if mate == UNPAIRED else sorted((user, mate))
            first = next((member for member in pair if users.names[member] in pinned), pair[0])
            found[int(assignment.stop[first])].append(user)
        return found

    def _improved(self, parts: list[list[int]]) -> list[list[int]]:
        """Return the parts after moves of stops that make the longest of the real flights shorter."""
        tried = 0
        while tried < MOST_TRIALS:
            seconds = [self._seconds(vehicle, part) for vehicle, part in enumerate(parts)]
            longest = max(range(len(parts)), key=lambda v: seconds[v])
            others = sorted((v for v in range(len(parts)) if v != longest), key=lambda v: seconds[v])
            better = None
            for other in others[:2]:
                for stop in parts[longest]:
                    tried += 1
                    mine = [s for s in parts[longest] if s != stop]
                    theirs = inserted(self._ways[other], parts[other], stop)
                    pair = self._seconds(longest, mine), self._seconds(other, theirs)
                    if max(pair) < seconds[longest] - 1e-6:
                        better = other, mine, theirs
                        break
                if better or tried >= MOST_TRIALS:
                    break
            if better is None:
                return parts
            other, mine, theirs = better
            parts = [mine if v == longest else theirs if v == other else part for v, part in enumerate(parts)]
        return parts

    def _seconds(self, vehicle: int, part: Sequence[int]) -> float:
        plan = self._along(vehicle, part)
        return 0.0 if not part else np.inf if plan is None else plan.forecast.mission_s

    def _scenario(self, vehicle: int, part: Sequence[int]) -> Scenario:
        scenario = self._own[vehicle]
        kept = np.array(sorted(user for stop in part for user in self._users_of[stop]), dtype=np.int64)
        stops = tuple(scenario.stops[self._pins[stop]] for stop in part if self._pins[stop] != NO_PIN)
        return share_of(scenario, kept, stops)

    def _along(self, vehicle: int, part: Sequence[int]) -> Plan | None:
        """Return the flight over the stops as they are; None where they do not reach everybody from its height."""
        key = vehicle, tuple(part)
        if key not in self._made:
            self._made[key] = self._planned_along(vehicle, part) if part else None
        return self._made[key]

    def _planned_along(self, vehicle: int, part: Sequence[int]) -> Plan | None:
        scenario = self._scenario(vehicle, part)
        if not len(scenario.users):
            return None  # a flight is planned for somebody
        stops_m: Floats = self._stops_m[vehicle][list(part)]
        flown = cut_out(self._base.trajectory, scenario.users, planning_channel(scenario), stops_m)
        if not flown.assignment.served.all():
            return None
        try:
            return plan_along(scenario, flown, self._hover)
        except InputError:
            return None

    def _best(self, vehicle: int, part: Sequence[int], anew: Plan | tuple[Problem, ...]) -> Plan:
        """Return the shorter of the flight over the stops as they are and the one that the planner makes anew."""
        along = self._along(vehicle, part)
        if not isinstance(anew, Plan):
            if along is None:
                raise InputError(anew)
            return along
        if along is None or anew.forecast.mission_s <= along.forecast.mission_s:
            return anew
        return along


def share_of(scenario: Scenario, kept: Ints, stops: tuple[PinnedStop, ...]) -> Scenario:
    """Return what one vehicle does of a scenario as it has it: some of the users, (K,), and of the pinned stops."""
    some = scenario.with_some(scenario.users.some(kept, scenario.users.demand_bit))
    return replace(some, vehicles=(), stops=stops, warnings=())


def planned_anew(task: tuple[Scenario, HoverStyle]) -> Plan | tuple[Problem, ...]:
    """Return the plan of one vehicle, or what is wrong with it; what every worker does."""
    try:
        return make_plan(*task)
    except InputError as error:
        return error.problems
