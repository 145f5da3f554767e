"""Planners: pure functions from users and a channel to a `Trajectory`. A new planner is one new file and a line here.

No files, clocks or prints; whatever is random draws from a generator made from the seed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.planners.clustering import candidate_clusters
from mavplan.planners.tloaik import tloaik
from mavplan.planners.trajectory import Trajectory
from mavplan.radio import Channel
from mavplan.scenario.model import Scenario, Users

Plan = Callable[[Users, Channel, int, np.random.Generator], Trajectory]


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
        What ``clusters = "auto"`` minimises.
    """

    name: str
    summary: str
    plan: Plan
    cost: Callable[[Trajectory], float]


PLANNERS: dict[str, Planner] = {
    planner.name: planner
    for planner in (Planner("tloaik", "shortest trajectory", tloaik, cost=lambda found: found.length_m),)
}


def plan_trajectory(scenario: Scenario, progress: Callable[[int, int], None] | None = None) -> Trajectory:
    """Run the scenario's planner, for ``auto`` with every number of clusters worth a try.

    Parameters
    ----------
    scenario
        Users, channel and options; ``scenario.planner.seed`` decides all that is random.
    progress
        Called with runs done and runs to do.

    Returns
    -------
    The plan; of several numbers of clusters the one of least cost, of equal ones that with the fewest clusters.

    Raises
    ------
    InputError
        The planner's name is unknown, or nobody on the ground can be reached from this altitude.
    """
    options = scenario.planner
    planner = find_planner(options.name)
    channel = Channel(scenario.radio, scenario.vehicle.altitude_m, scenario.d2d)
    if channel.radius_m <= 0.0:
        raise InputError(
            [Problem("[vehicle] altitude_m", "nobody on the ground can be reached", "no-coverage")]
        )
    users = scenario.users
    fixed = options.clusters
    tried = [fixed] if isinstance(fixed, int) else candidate_clusters(users, channel.radius_m)
    best: Trajectory | None = None
    for done, clusters in enumerate(tried, start=1):
        # Each K has a generator of its own: what one K draws does not depend on which others are tried.
        found = planner.plan(users, channel, clusters, np.random.default_rng([options.seed, clusters]))
        if best is None or planner.cost(found) < planner.cost(best):
            best = found
        if progress is not None:
            progress(done, len(tried))
    assert best is not None
    return best


def find_planner(name: str) -> Planner:
    """Return the planner of this name, or raise an `InputError` that names those there are."""
    try:
        return PLANNERS[name]
    except KeyError:
        known = ", ".join(PLANNERS)
        raise InputError(
            [Problem("[planner] name", f"unknown planner {name!r}; known: {known}", "unknown-planner")]
        ) from None
