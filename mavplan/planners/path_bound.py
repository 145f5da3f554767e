"""The shortest path that comes within R of every user, and how short it could be at best."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mavplan.planners.limits import Limits
from mavplan.planners.path_edit import path_length_m
from mavplan.planners.path_local import inserted_path, reinserted
from mavplan.planners.path_problem import FoundPath, PathProblem, path_problem
from mavplan.planners.path_search import GAP, Node, PathSearch
from mavplan.planners.path_windows import shortened
from mavplan.scenario.model import Floats, Ints

MOST_NODES = 400_000
"""A search ends at this many nodes in any case: they take about 300 MB."""

FEW = 40
"""Up to so many requirements are searched to proof straight away."""

MANY = 500
"""With more requirements there is no hope of a proof: the path is made shorter first, then there is a bound."""

FIRST_SHARE, IMPROVED_SHARE = 0.3, 0.8
"""Shares of the limits after which the search gives way, and after which it goes on."""

ATTEMPTS = 50
"""To take some discs out and put them in otherwise, after each round of windows."""

IN_VAIN = 4
"""Rounds without a shorter path, after which no more are made."""

WINDOW_EFFORT, ATTEMPT_EFFORT = 100, 20
"""What a window and an attempt count for, in nodes of a search."""

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
    seed: int = 0,
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
    seed
        Of what is drawn where a path is made shorter without proof.
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
    return shortest_path(problem, Limits(time_limit_s, node_limit), np.random.default_rng(seed), progress)


def shortest_path(
    problem: PathProblem, limits: Limits, rng: np.random.Generator, progress: Progress | None = None
) -> PathBound:
    """Return the shortest path for requirements none of which is met from the start.

    A search to proof; where it takes long, the path is made shorter without proof for a while, and the search goes on
    with what came out.
    """
    if not len(problem.required):
        direct_m = path_length_m(problem.path_m(np.empty((0, 2))))
        return PathBound(problem, FoundPath((), np.empty((0, 2)), direct_m), direct_m, ())
    return _Work(problem, limits, rng, progress).done()


class _Work:
    """A search and what is done between its parts; effort is counted in nodes."""

    def __init__(
        self, problem: PathProblem, limits: Limits, rng: np.random.Generator, progress: Progress | None
    ) -> None:
        self._problem, self._limits, self._rng, self._progress = problem, limits, rng, progress
        self._effort = 0
        users = len(problem.required)
        self._search = PathSearch(problem, inserted_path(problem))
        self._first_share = 1.0 if users <= FEW else FIRST_SHARE if users <= MANY else 0.0

    def done(self) -> PathBound:
        """Do all of it."""
        search = self._search
        for share in (self._first_share, 1.0):
            search.run(partial(self._goes_on, share))
            if search.proved or share == 1.0:
                break
            self._improve()
        return PathBound(self._problem, search.best, search.bound_m, tuple(search.nodes))

    def _goes_on(self, share: float) -> bool:
        """Return whether less than this share of the limits is used, and tell how far it is."""
        search = self._search
        nodes = len(search.nodes)
        if self._progress is not None:
            self._progress(search.bound_m, search.best.length_m)
        return self._limits.used(nodes + self._effort) < share and nodes < MOST_NODES

    def _improve(self) -> None:
        """Make the best path shorter, until its share is used up or attempts have long been in vain."""
        problem, search = self._problem, self._search
        vain = 0
        while self._goes_on(IMPROVED_SHARE) and vain < IN_VAIN:
            before_m = search.best.length_m
            search.best = shortened(problem, search.best, lambda path: self._spend(WINDOW_EFFORT, path))
            for _ in range(ATTEMPTS):
                search.best = reinserted(problem, search.best, self._rng)
                if not self._spend(ATTEMPT_EFFORT, search.best):
                    break
            vain = 0 if search.best.length_m < before_m * (1.0 - GAP) else vain + 1

    def _spend(self, effort: int, path: FoundPath) -> bool:
        """Count effort for a path, and return whether there is some left."""
        self._effort += effort
        if path.length_m < self._search.best.length_m:
            self._search.best = path
        return self._goes_on(IMPROVED_SHARE)
