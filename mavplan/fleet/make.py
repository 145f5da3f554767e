"""From a scenario to the plans of a fleet: users divided, each flight planned, and kept apart from the others."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from mavplan.errors import InputError, Problem
from mavplan.fleet.apart import Starts
from mavplan.fleet.crews import Crews
from mavplan.fleet.offered import offered
from mavplan.fleet.rounds import Apart, Cut, Round, cut_each, dealt, rounds_of, said_once
from mavplan.geo import Elsewhere, LocalPlane
from mavplan.part import Part
from mavplan.plan import HoverStyle, Plan, make_plan
from mavplan.progress import Progress
from mavplan.scenario.model import UNPAIRED, Scenario
from mavplan.scenario.sections import FleetVehicle, Home
from mavplan.sorties.beyond import within_reach
from mavplan.sorties.make import needed_budget, said_of_the_end


@dataclass(frozen=True, eq=False)
class Fleet:
    """The flights of the vehicles that fly.

    Attributes
    ----------
    single
        What the first vehicle alone would fly.
    single_s
        How long it takes it, all sorties together where it is cut into some; infinite where it cannot.
    plans
        One for each vehicle that has users, with its number and its start.
    said
        What was done to keep them apart, and who stays on the ground.
    not_served, rest
        Names of the users whom no sortie serves, and a scenario of them, with mates that may relay; None where all are
        served.
    """

    single: Plan
    single_s: float
    plans: tuple[Plan, ...]
    said: tuple[Problem, ...] = ()
    not_served: tuple[str, ...] = ()
    rest: Scenario | None = None

    @property
    def longest_s(self) -> float:
        """From the first start until the last mission is over; of rounds of sorties the sum, batteries left out."""
        return longest_s(self.plans)


def longest_s(plans: Sequence[Plan]) -> float:
    """Return how long the rounds of a fleet take, each from its first start until its last mission is over."""
    ends_s: dict[int, float] = {}
    for plan in plans:
        number = 1 if plan.part is None else plan.part.round
        ends_s[number] = max(ends_s.get(number, 0.0), _start_s(plan) + plan.forecast.mission_s)
    return sum(ends_s.values())


def plan_fleet(
    scenario: Scenario,
    count: int,
    hover: HoverStyle = "waypoint+loiter",
    *,
    separation_m: float = 50.0,
    altitude_step_m: float = 0.0,
    sorties: bool = False,
    most: int | None = None,
    progress: Progress | None = None,
) -> Fleet:
    """Plan a scenario for several vehicles, the longest mission as short as can be found.

    Parameters
    ----------
    scenario
        Its ``vehicles`` have homes of their own; without them all start at its home.
    count
        How many vehicles.
    hover
        What a stop is made of.
    separation_m
        What they keep over the ground where they are at the same height; 0 checks nothing.
    altitude_step_m
        How much higher each flies than the one before.
    sorties
        Whether each vehicle's flight is cut into sorties where a battery does not last it. Each round of them, one a
        vehicle, begins when all vehicles of the one before stand at home.
    most
        How many sorties each vehicle has at most: what they do not serve of the weighted demand is left over. None: as
        many as it takes.
    progress
        As for `make_plan`.

    Raises
    ------
    InputError
        As `make_plan`, with ``sorties`` as `plan_sorties`; there are fewer vehicles.
    """
    if scenario.vehicles and count > len(scenario.vehicles):
        message = f"--vehicles {count} asks for more than the {len(scenario.vehicles)} that have a home"
        raise InputError([Problem("[[vehicles]]", message, "too-few-vehicles")])
    if count > 1:
        _check_pinned(scenario)
    chosen, given = None, scenario
    scenario, beyond = within_reach(scenario, most)
    if scenario.search_altitude:
        single, scenario = _at_best_altitude(scenario, altitude_step_m * (count - 1), hover, progress)
        chosen, progress = single.altitude, None
    if sorties:
        needed_budget(scenario)
        home = replace(scenario.vehicle, end="rtl")
        scenario = replace(scenario, vehicle=home, warnings=said_of_the_end(scenario))
    own = [_of_vehicle(scenario, number, altitude_step_m) for number in range(count)]
    single = make_plan(own[0], hover, progress)
    faults: list[InputError] = []
    cut = partial(_cut, hover=hover, sorties=sorties)
    alone = _tried(lambda: cut([single], most=most), faults)
    single_s = math.inf
    if alone is not None and not alone.not_served:
        single_s = sum(plan.forecast.mission_s for plan in alone.sorties[0])
    if count == 1 and alone is not None and alone.sorties == ((single,),) and not beyond.any():
        return Fleet(single, single_s, (replace(single, altitude=chosen),))
    best = None
    if alone is not None:
        best = _Way(
            [Round((plan, *[None] * (count - 1)), _at_once(count)) for plan in alone.sorties[0]],
            alone.not_served,
        )
    if count > 1:
        apart = Apart(separation_m, altitude_step_m)
        # From the highest the fewest are in reach: its stops do for all of them.
        high = replace(own[0], vehicle=own[-1].vehicle)
        base = make_plan(high, hover) if altitude_step_m > 0 else single
        found = Crews(base, own, hover).planned()
        each = _tried(lambda: cut(found, most=most), faults)
        ways = [best, None if each is None else _way(rounds_of(each.sorties, apart), each)]
        if each is not None and each.not_served and most is not None:
            more = offered(each, found, own, hover, most)
            if more.sorties != each.sorties:
                ways.append(_way(rounds_of(more.sorties, apart), more))
        if sorties and not scenario.vehicles:
            whole = _tried(lambda: cut([base], most=None if most is None else most * count), faults)
            ways.append(
                None if whole is None else _way(dealt(whole.sorties[0], own, hover, apart, most), whole)
            )
        # One vehicle alone is done sooner than all of them in turn, where they are in one another's way; of ways that
        # are as good the last is taken.
        best = min(
            (way for way in reversed(ways) if way is not None), key=lambda w: w.cost(scenario), default=None
        )
    if best is None:
        raise faults[-1]
    left = beyond | given.users.named(best.not_served)
    names = given.users.names_of(left)
    best = _Way(said_once(best.rounds, scenario.warnings), names)
    plans = tuple(replace(plan, altitude=chosen) for plan in _numbered(best, scenario))
    there = replace(scenario, users=given.users, vehicle=replace(scenario.vehicle, end=given.vehicle.end))
    rest = there.left_over(left, given.users.demand_bit)
    return Fleet(single, single_s, plans, (*_told(best.rounds), *_idle(best, scenario)), names, rest)


@dataclass(frozen=True)
class _Way:
    """A way to fly: its rounds, and who is not served."""

    rounds: list[Round]
    not_served: tuple[str, ...]

    def cost(self, scenario: Scenario) -> tuple[float, int, float]:
        """Return what is made small: weighted demand that is not met, Mbit, users left, seconds of the rounds."""
        left = scenario.users.named(self.not_served)
        lost_bit = float(scenario.users.weighted_bit[left].sum())
        return round(lost_bit / 1e6, 6), int(left.sum()), sum(found.seconds for found in self.rounds)


def _way(rounds: list[Round] | None, cut: Cut) -> _Way | None:
    """Return a way to fly; None where there are no rounds that keep vehicles apart."""
    return None if rounds is None else _Way(rounds, cut.not_served)


def _check_pinned(scenario: Scenario) -> None:
    """Refuse pinned stops that several vehicles cannot keep.

    Raises
    ------
    InputError
        Each of them.
    """
    mates = {stop.user: stop.name for stop in scenario.stops if stop.user is not None}
    users, problems = scenario.users, []
    for stop in scenario.stops:
        if stop.order is not None:
            message = "has an order, and that is kept within one flight: leave it out, or plan one vehicle"
            problems.append(Problem(stop.name, message, "fleet-stops"))
        mate = int(users.mate[users.names.index(stop.user)]) if stop.user in users.names else UNPAIRED
        if mate != UNPAIRED and users.names[mate] in mates:
            message = (
                f"is above a user whose mate {users.names[mate]} has a pinned stop too: a pair flies together"
            )
            problems.append(Problem(stop.name, message, "fleet-stops"))
    if problems:
        raise InputError(problems)


Found = TypeVar("Found")


def _tried(make: Callable[[], Found], faults: list[InputError]) -> Found | None:
    """Return what is made; None where that cannot be, and why is noted."""
    try:
        return make()
    except InputError as error:
        faults.append(error)
        return None


def _at_once(count: int) -> Starts:
    return Starts((0.0,) * count, ())


def _cut(found: Sequence[Plan | None], hover: HoverStyle, *, sorties: bool, most: int | None) -> Cut:
    """Return the flights of each vehicle, cut where its battery ends if that is wanted."""
    if sorties:
        return cut_each(found, hover, most)
    return Cut(tuple(() if plan is None else (plan,) for plan in found))


def _told(rounds: Sequence[Round]) -> tuple[Problem, ...]:
    """Return what is said of the starts."""
    if len(rounds) == 1:
        return rounds[0].starts.said
    return tuple(
        replace(problem, where=f"{problem.where}, round {number}")
        for number, found in enumerate(rounds, start=1)
        for problem in found.starts.said
    )


def _at_best_altitude(
    scenario: Scenario, steps_m: float, hover: HoverStyle, progress: Progress | None
) -> tuple[Plan, Scenario]:
    """Return what one vehicle flies at the altitude at which it is done soonest, and the scenario at that altitude.

    Parameters
    ----------
    steps_m
        How much higher the highest of the fleet flies: it keeps to the greatest altitude too.
    """
    vehicle = replace(scenario.vehicle, altitude_max_m=scenario.vehicle.altitude_max_m - steps_m)
    if vehicle.altitude_max_m <= 0:
        raise InputError(
            [Problem("--altitude-step", "leaves no altitude for the first vehicle", "no-altitude")]
        )
    sought = _of_vehicle(replace(scenario, vehicle=vehicle), 0, 0.0)
    single = make_plan(sought, hover, progress)
    at = replace(scenario.vehicle, altitude_m=single.scenario.vehicle.altitude_m)
    return single, replace(scenario, vehicle=at, search_altitude=False)


def _of_vehicle(scenario: Scenario, number: int, altitude_step_m: float) -> Scenario:
    """Return the scenario as one vehicle has it: its home, its height, users in its plane."""
    vehicle = replace(scenario.vehicle, altitude_m=scenario.vehicle.altitude_m + number * altitude_step_m)
    if not scenario.vehicles:
        return replace(scenario, vehicle=vehicle)
    at = scenario.vehicles[number]
    users = scenario.users
    xy_m = LocalPlane(at.lat_deg, at.lon_deg).to_xy_m(users.lat_deg, users.lon_deg)
    home = Home(lat_deg=at.lat_deg, lon_deg=at.lon_deg, alt_amsl_m=at.alt_amsl_m)
    terrain = scenario.terrain
    if terrain is not None:
        theirs = (scenario.home.lat_deg, scenario.home.lon_deg)
        terrain = terrain.seen_from(Elsewhere((at.lat_deg, at.lon_deg), theirs))
    return replace(scenario, home=home, users=replace(users, xy_m=xy_m), vehicle=vehicle, terrain=terrain)


def _numbered(way: _Way, scenario: Scenario) -> Iterator[Plan]:
    """Yield the flights, round by round, with numbers, names and starts."""
    rounds = way.rounds
    flying = [v for v in _vehicles(rounds) if any(found.plans[v] is not None for found in rounds)]
    for turn, found in enumerate(rounds, start=1):
        for number, vehicle in enumerate(flying, start=1):
            plan, at = found.plans[vehicle], _named(scenario, vehicle)
            if plan is None:
                continue
            part = Part(
                "vehicle",
                number,
                len(flying),
                "" if at is None else at.name,
                None if at is None else at.system,
                found.starts.start_s[vehicle],
                round=turn,
                rounds=len(rounds),
                not_served=way.not_served,
            )
            yield replace(plan, part=part)


def _vehicles(rounds: Sequence[Round]) -> range:
    return range(len(rounds[0].plans))


def _idle(way: _Way, scenario: Scenario) -> tuple[Problem, ...]:
    rounds = way.rounds
    idle = [v for v in _vehicles(rounds) if all(found.plans[v] is None for found in rounds)]
    if not idle:
        return ()
    named = [_named(scenario, vehicle) for vehicle in idle]
    names = ", ".join(str(v + 1) if at is None else at.name for v, at in zip(idle, named, strict=True))
    without = "it would serve nobody" if way.not_served else "the others are done no later without it"
    message = f"stays on the ground: {without}"
    return (Problem(f"vehicle {names}", message, "idle-vehicle", "warning"),)


def _named(scenario: Scenario, vehicle: int) -> FleetVehicle | None:
    return scenario.vehicles[vehicle] if scenario.vehicles else None


def _start_s(plan: Plan) -> float:
    return 0.0 if plan.part is None else plan.part.start_s
