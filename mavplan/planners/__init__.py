"""Planners: pure functions from users and a channel to a `Trajectory`. A new planner is one new file and a line here.

No files, clocks or prints; whatever is random draws from a generator made from the seed.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.mission.wind import Wind
from mavplan.planners.boaik import boaik
from mavplan.planners.clustering import candidate_clusters, distinct_places
from mavplan.planners.index import joint_index
from mavplan.planners.least_time import least_time
from mavplan.planners.length import length
from mavplan.planners.limits import Limits
from mavplan.planners.one_thread import one_thread
from mavplan.planners.pinned import Cost as MissionTimes
from mavplan.planners.pinned import pins_of, with_pins
from mavplan.planners.sbw import sbw
from mavplan.planners.setting import Setting
from mavplan.planners.stoaik import stoaik
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.tloaik import tloaik
from mavplan.planners.trajectory import Trajectory
from mavplan.planners.wide_time import TOGETHER
from mavplan.progress import Progress, tell_share
from mavplan.radio import Channel, highest_altitude_m, planning_channel
from mavplan.scenario.model import Scenario, Users

Plan = Callable[[Users, Channel, Setting], Trajectory]
Cost = Callable[[Trajectory, Callable[[], Trajectory]], float]
"""(plan, function that gives the benchmark) → what ``clusters = "auto"`` minimises."""


@dataclass(frozen=True)
class Planner:
    """One entry of the registry.

    Attributes
    ----------
    name, summary
        Key on the command line, and what it is good for in a few words.
    plan
        The algorithm, for one number of clusters.
    cost
        What ``clusters = "auto"`` minimises; None where the planner has no clusters.
    """

    name: str
    summary: str
    plan: Plan
    cost: Cost | None


def length_m(found: Trajectory, _benchmark: Callable[[], Trajectory]) -> float:
    """Return the length: the least wins."""
    return found.length_m


def imbalance(found: Trajectory, benchmark: Callable[[], Trajectory]) -> float:
    """Return −ρ_e: the greatest index wins, and a plan that reaches everybody from home, without any way, over all."""
    index = joint_index(found, benchmark())
    return -math.inf if index is None else -index


GROWTH = 4
"""A plan's time grows about so with its clusters: of 2,000 users half of it goes into the last tenth of them."""
SEARCHING = frozenset({"length", "time"})
"""Planners that search until a time limit at the latest."""

WITHOUT_CLUSTERS = frozenset({"length", "sbw"})
"""Planners that need no clustering, of their own or of others."""

PLANNERS: dict[str, Planner] = {
    planner.name: planner
    for planner in (
        Planner("tloaik", "shortest trajectory", tloaik, length_m),
        Planner("stoaik", "highest throughput", stoaik, imbalance),
        Planner("boaik", "balance of both", boaik, imbalance),
        Planner("length", "shortest path that reaches everybody, with a proof", length, None),
        Planner("time", "least mission time, with a bound", least_time, None),
        Planner("sbw", "strips, the benchmark", lambda users, channel, _setting: sbw(users, channel), None),
    )
}


def plan_trajectory(scenario: Scenario, progress: Progress | None = None) -> Trajectory:
    """Run the scenario's planner and put its pinned stops in.

    Parameters
    ----------
    scenario
        Users, channel and options; ``scenario.planner.seed`` decides all that is random.
    progress
        Called with the part done and the whole, in about equal steps of time.

    Returns
    -------
    The plan; of several numbers of clusters the one of least cost, of equal ones that with the fewest.

    Raises
    ------
    InputError
        The planner's name is unknown, or nobody on the ground can be reached from this altitude.
    """
    region_by_region = scenario.planner.name == "time" and len(scenario.users) > TOGETHER
    without = region_by_region or scenario.planner.name in WITHOUT_CLUSTERS
    with one_thread(clustering=not without):
        return _with_pins(scenario, _planned(scenario, progress))


def _with_pins(scenario: Scenario, found: Trajectory) -> Trajectory:
    """Return the plan with the scenario's pinned stops in it."""
    pins = pins_of(scenario)
    if not pins.names:
        return found
    channel, returns = planning_channel(scenario), scenario.vehicle.end == "rtl"
    # All plans of very many users at once would not fit into memory: then the length counts.
    few = len(scenario.users) <= TOGETHER
    cost = _mission_times(scenario, channel) if found.planner == "time" and few else None
    return with_pins(found, pins, scenario.users, channel, returns=returns, cost=cost)


def _mission_times(scenario: Scenario, channel: Channel) -> MissionTimes:
    """Return what gives the mission times of plans."""
    from mavplan.inflight import counts_in_flight

    problem = TimeProblem.of(
        scenario.users,
        channel,
        scenario.vehicle,
        scenario.service,
        wind=Wind.of(scenario.wind),
        in_flight=counts_in_flight(scenario),
    )
    return lambda stops_m: problem.times(stops_m).total_s


def _planned(scenario: Scenario, progress: Progress | None = None) -> Trajectory:
    """Return the plan of the scenario's planner, which knows nothing of pinned stops."""
    from mavplan.inflight import counts_in_flight

    options, users = scenario.planner, scenario.users
    planner = find_planner(options.name)
    channel = planning_channel(scenario)
    if channel.radius_m <= 0.0:
        limit_m = highest_altitude_m(channel.radio) - channel.position_error_m
        message = f"nobody on the ground can be reached from {channel.altitude_m:g} m, only from below {limit_m:.4g} m"
        raise InputError([Problem("[vehicle] altitude_m", message, "no-coverage")])

    places = distinct_places(users)
    returns, limits = scenario.vehicle.end == "rtl", Limits(options.time_limit_s)
    tell = progress if planner.cost is None else None

    def run(clusters: int) -> Trajectory:
        # Each K has a generator of its own: what one K draws does not depend on which others are tried.
        # More clusters than places are as many as places, in the draw too.
        rng = np.random.default_rng([options.seed, min(clusters, places)])
        setting = Setting(
            clusters,
            rng,
            options.solver,
            returns,
            limits,
            tell,
            seed=options.seed,
            tried=(options.clusters,) if isinstance(options.clusters, int) else (),
            vehicle=scenario.vehicle,
            service=scenario.service,
            wind=Wind.of(scenario.wind),
            in_flight=counts_in_flight(scenario),
        )
        return planner.plan(users, channel, setting)

    if planner.cost is None:
        return run(0)
    if isinstance(options.clusters, int):
        return run(options.clusters)
    benchmark = functools.cache(lambda: sbw(users, channel))
    tried = candidate_clusters(users, channel.radius_m)
    work = [number**GROWTH for number in tried]
    best: tuple[float, Trajectory] | None = None
    for done, clusters in enumerate(tried, start=1):
        found = run(clusters)
        cost = planner.cost(found, benchmark)
        if best is None or cost < best[0]:
            best = cost, found
        tell_share(progress, sum(work[:done]) / sum(work))
    assert best is not None
    return best[1]


def find_planner(name: str) -> Planner:
    """Return the planner of this name, or raise an `InputError` that names those there are."""
    try:
        return PLANNERS[name]
    except KeyError:
        message = f"unknown planner {name!r}; known: {', '.join(PLANNERS)}"
        raise InputError([Problem("[planner] name", message, "unknown-planner")]) from None
