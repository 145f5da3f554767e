"""The shortest path that comes within R of every user, and how short it could be at best."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavplan.planners.limits import Limits
from mavplan.planners.path_problem import FoundPath, PathProblem, path_problem
from mavplan.planners.path_search import GAP, Node, PathSearch
from mavplan.scenario.model import Floats, Ints

MOST_NODES = 400_000
"""A search ends at this many nodes in any case: they take about 300 MB."""

Progress = Callable[[float, float], None]
"""Called with the proved bound and the length of the best path so far, both in metres."""


@dataclass(frozen=True, eq=False)
class PathBound:
    """The best path that was found, and a bound that no path is below.

    Attributes
    ----------
    problem
        What had to be reached, without what is reached from the start.
    path
        The best path.
    bound_m
        No path that meets all requirements is shorter; as `Channel.reaches` has it, so for discs a micrometre wider.
    nodes
        The search, from which `mavplan.planners.path_certificate` makes a proof; empty where nothing was searched.
    """

    problem: PathProblem
    path: FoundPath
    bound_m: float
    nodes: tuple[Node, ...]

    @property
    def gap(self) -> float:
        """(length − bound)/length; 0 for a path without length."""
        return (self.path.length_m - self.bound_m) / self.path.length_m if self.path.length_m > 0.0 else 0.0

    @property
    def proved(self) -> bool:
        """Whether the path is the shortest, to a millionth of its length."""
        return self.gap <= 1.001 * GAP


def path_lower_bound(
    users_xy_m: Floats,
    radius_m: float,
    *,
    closed: bool,
    mate: Ints | None = None,
    time_limit_s: float | None = 10.0,
    node_limit: int | None = None,
    progress: Progress | None = None,
) -> PathBound:
    """Return the shortest path from the origin that comes within R of each user, proved or with a gap.

    Parameters
    ----------
    users_xy_m
        (N, 2) metres from home.
    radius_m
        R, greater than 0.
    closed
        Whether the path returns to the origin; else it ends anywhere.
    mate
        (N,) mates or `UNPAIRED`: one of each pair is enough. None: everybody is to be reached.
    time_limit_s, node_limit
        Where the search ends at the latest. A node limit gives the same answer everywhere; what a time limit cuts off
        depends on the machine.
    progress
        Called after each batch of nodes.

    Raises
    ------
    ValueError
        The radius is not a positive number, or a position is not finite.
    """
    if not (math.isfinite(radius_m) and radius_m > 0.0):
        raise ValueError(f"the radius must be a positive number of metres, not {radius_m}")
    if not np.isfinite(users_xy_m).all():
        raise ValueError("positions must be finite")
    problem = path_problem(users_xy_m, radius_m, returns=closed, mate=mate).without_met()
    return shortest_path(problem, Limits(time_limit_s, node_limit), progress)


def shortest_path(problem: PathProblem, limits: Limits, progress: Progress | None = None) -> PathBound:
    """Return the shortest path for requirements none of which is met from the start."""
    if not len(problem.required):
        direct_m = float(np.linalg.norm(np.diff(problem.path_m(np.empty((0, 2))), axis=0)))
        return PathBound(problem, FoundPath((), np.empty((0, 2)), direct_m), direct_m, ())
    search = PathSearch(problem)

    def keep_going(search: PathSearch) -> bool:
        nodes = len(search.nodes)
        if progress is not None and search.best is not None:
            progress(search.bound_m, search.best.length_m)
        return search.best is None or not (limits.reached(nodes) or nodes >= MOST_NODES)

    search.run(keep_going)
    assert search.best is not None
    return PathBound(problem, search.best, search.bound_m, tuple(search.nodes))
