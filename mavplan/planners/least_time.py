"""Time: the least mission time, flight and hover together, with a bound that no plan is below.

Which users share a stop, where it stands, the order and the holds are decided together: `time_search` improves the
plans of the paper's planners and short paths that come near everybody, `time_bound` proves how much is left.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from mavplan.bounds import Bound
from mavplan.bounds.time import from_json, proved_time_s, to_json
from mavplan.bounds.time_case import TimeCase
from mavplan.errors import Problem
from mavplan.planners.boaik import boaik
from mavplan.planners.clustering import candidate_clusters, distinct_places
from mavplan.planners.limits import Limits
from mavplan.planners.path_bound import shortest_path
from mavplan.planners.path_problem import path_problem
from mavplan.planners.setting import Setting
from mavplan.planners.stoaik import stoaik
from mavplan.planners.time_bound import TimeBound, time_bound
from mavplan.planners.time_certificate import time_certificate
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.time_search import TimeSearch
from mavplan.planners.tloaik import tloaik
from mavplan.planners.trajectory import Trajectory, through
from mavplan.planners.wide_time import TOGETHER, stops_of_many
from mavplan.progress import Progress
from mavplan.radio import Channel
from mavplan.scenario.model import Floats, Users

PAPERS = (tloaik, stoaik, boaik)
"""Whose plans are starting points."""

NEARER, NEARER_IN_FLIGHT = (1.0, 0.97, 0.94, 0.9, 0.8, 0.7, 0.5, 0.3), (1.0, 0.95, 0.85, 0.7, 0.5, 0.3)
"""Paths that come within these parts of R of everybody are starting points: the greater the demand the nearer."""

PATH_NODES = 200
"""Of the search for each of these paths."""

ROUNDS, ROUNDS_IN_FLIGHT = 100, 80
"""Perturbations before the bound is sought, and as many after."""

ROUNDS_A_STOP = 20
"""Where this times the stops of the plan is more, so many: more of a long plan can be otherwise."""

SEARCHED, PRICED, BOUNDED = 0.5, 0.66, 0.75
"""Shares of the time limit at which the first search, the prices of the bound and the bound end; what is left is for
the second search."""

DOUBTFUL, DOUBTED = 0.02, 4
"""Plans of the paper's planners whose time is above the best by less than this part, and how many of them, are
compared with it once more by exact integrals."""

FROM_BOUND = 6
"""Paths met on the way to the bound that are improved."""


def least_time(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan the mission of least time, never longer than the paper's planners' with the same numbers of clusters.

    Parameters
    ----------
    setting
        ``tried`` says which numbers of clusters; ``vehicle``, ``service`` and ``wind`` how it is flown and served.
    """
    if len(users) > TOGETHER:
        return _of_many(users, channel, setting)
    service, limits = setting.service, setting.limits
    gathers_speed = setting.vehicle.acceleration_m_s2 != 0
    problem = TimeProblem.of(
        users,
        channel,
        setting.vehicle,
        service,
        wind=setting.wind,
        in_flight=setting.in_flight,
        alone=not gathers_speed,
    )
    search = TimeSearch(problem, setting.rng)

    def until(share: float) -> Callable[[], bool]:
        """Return what says whether less than this share of the time limit is used up, and tells how much."""

        def goes_on() -> bool:
            setting.tell_limits()
            return limits.used(0) < share

        return goes_on

    papers = list(_papers_stops(users, channel, setting))
    search.consider(papers, until(SEARCHED))
    near = list(_near_paths(users, channel, setting))
    for stops in near:
        search.consider([stops], until(SEARCHED))
    rounds = max(ROUNDS_IN_FLIGHT if problem.in_flight else ROUNDS, ROUNDS_A_STOP * len(search.best_m))
    search.perturb(rounds, until(SEARCHED))
    case = TimeCase.of(
        users, channel, setting.vehicle, service, wind=setting.wind, in_flight=setting.in_flight
    )
    bound = time_bound(problem, case, [search.best_m, *near], until(BOUNDED), until(PRICED))
    search.consider([path for path in bound.paths if len(path)], until(1.0), FROM_BOUND)
    search.perturb(rounds, until(1.0))
    stops = _truly_best(problem, users, [_with_all_reached(problem, search.best_m), *papers])
    beside = _bound(problem, stops, bound, case)
    return replace(through("time", users, channel, stops, bound=beside), notes=_notes(beside, limits))


def _of_many(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan for more users than are searched together."""
    message = f"more than {TOGETHER:,} users are planned region by region: a short mission, of which nothing is proved"
    note = Problem("[planner] name", message, "no-bound", "warning")
    return replace(through("time", users, channel, stops_of_many(users, channel, setting)), notes=(note,))


def _papers_stops(users: Users, channel: Channel, setting: Setting) -> Iterator[Floats]:
    """Yield the stops of the paper's planners, drawn as they draw them."""
    places = distinct_places(users)
    for clusters in setting.tried or candidate_clusters(users, channel.radius_m):
        for planner in PAPERS:
            setting.tell_limits()
            rng = np.random.default_rng([setting.seed, min(clusters, places)])
            yield planner(users, channel, Setting(clusters, rng, setting.solver)).stops_m


def _near_paths(users: Users, channel: Channel, setting: Setting) -> Iterator[Floats]:
    """Yield the points of short paths that come near everybody."""
    returns = setting.vehicle.end == "rtl"
    for part in NEARER_IN_FLIGHT if setting.in_flight else NEARER:
        setting.tell_limits()
        problem = path_problem(users.xy_m, part * channel.radius_m, returns=returns, mate=users.mate)
        limits = Limits(seconds=_left_s(setting.limits), nodes=PATH_NODES)
        points = shortest_path(
            problem.without_met(), limits, np.random.default_rng(setting.seed)
        ).path.points_m
        yield points if len(points) else np.zeros((1, 2))


def _left_s(limits: Limits) -> float | None:
    """Return the seconds that are left for one of many steps of a search."""
    return None if limits.seconds is None else max(limits.seconds * SEARCHED - limits.elapsed_s, 0.0) / 4


def _truly_best(problem: TimeProblem, users: Users, plans: list[Floats]) -> Floats:
    """Return the first plan, or one that is better where what is received in flight is integrated, not looked up."""
    if not problem.in_flight:
        return plans[0]
    times = [float(problem.times(stops[None]).total_s[0]) for stops in plans]
    near = [k for k in np.argsort(times[1:]) + 1 if times[k] < times[0] + DOUBTFUL * times[0]][:DOUBTED]
    exact = [_exact_s(problem, users, plans[k]) for k in (0, *near)]
    best: Floats = plans[(0, *near)[int(np.argmin(exact))]]
    return best


def _exact_s(problem: TimeProblem, users: Users, stops_m: Floats) -> float:
    """Return the time of a plan with its in-flight service integrated; infinite where somebody is not reached."""
    from mavplan.inflight import received_in_flight

    flown = through("time", users, problem.channel, stops_m)
    bits = received_in_flight(users.xy_m, flown, problem.channel, problem.vehicle, problem.flyer.rules)
    rates = problem.rates(stops_m[None])
    wants = problem.wants(np.asarray(rates.any(axis=1)), bits[None] * problem.need_s_per_bit)
    return float(problem.hovering(problem.flight_s(stops_m[None]), rates, wants).total_s[0])


def _with_all_reached(problem: TimeProblem, stops_m: Floats) -> Floats:
    """Return the stops with others on the path between them until each user, or its mate, is within R of one.

    They cost no time: this is only done where a stop does not.
    """
    while True:
        reached = np.asarray((problem.rates(stops_m) > 0).any(axis=0))
        wants = problem.wants(reached[None], None)[0]
        lacking = np.flatnonzero(np.isinf(wants))
        if not len(lacking):
            return stops_m
        path = np.vstack([np.zeros(2), stops_m])
        step = np.diff(path, axis=0)
        squared = np.maximum((step**2).sum(axis=1), 1e-12)
        offset = problem.users_m[lacking[0]] - path[:-1]
        along = np.clip((offset * step).sum(axis=1) / squared, 0.0, 1.0)
        feet = path[:-1] + along[:, None] * step
        leg = int(((feet - problem.users_m[lacking[0]]) ** 2).sum(axis=1).argmin())
        stops_m = np.insert(stops_m, leg, feet[leg], axis=0)


def _bound(problem: TimeProblem, stops_m: Floats, found: TimeBound, case: TimeCase) -> Bound:
    """Return the plan's time beside the bound, from take-off to the end."""
    plan_s = problem.takeoff_s + float(problem.times(stops_m[None]).total_s[0])
    return Bound("mission_s", plan_s, min(found.seconds, plan_s), partial(_certificate, found, case))


def _certificate(found: TimeBound, case: TimeCase, _progress: Progress | None = None) -> dict[str, Any]:
    """Return the proof for the plan's file, with what it proves: where it would be too long, less than is known."""
    written = to_json(time_certificate(found))
    proved_s = proved_time_s(from_json(written), case)
    return {**written, "bound": math.floor(proved_s * 1e3) / 1e3}


def _notes(bound: Bound, limits: Limits) -> tuple[Problem, ...]:
    """Return what to know where the search was cut off."""
    if limits.seconds is None or limits.used(0) < 1.0:
        return ()
    message = (
        f"the search for the least mission time was cut off after {limits.seconds:g} s, at most {bound.gap:.1%} above "
        "the least: another run may find another plan"
    )
    return (Problem("[planner] time_limit_s", message, "not-proved", "warning"),)
