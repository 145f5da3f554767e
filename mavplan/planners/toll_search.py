"""The cheapest path that pays by the metre and tolls for how far it stays from users: branch and bound on the order.

A node is a sequence of members whose tolls the path pays where it passes them in this order; everybody else pays the
least toll there is. Its bound is the dual of `toll_tours`. The requirement that pays most more than that along the
node's own path is put in, at every position, for each of its members. A bound from any dual vectors holds, so the
tree, with these vectors at its leaves, is a proof.
"""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mavplan.planners.toll_curve import Curve
from mavplan.planners.toll_tours import Tolls, solve_tours
from mavplan.scenario.model import Floats, Ints

BATCH, PLUNGERS = 24, 4
"""Nodes that are branched on together; of these, the most promising children of the last ones: they find paths."""

ITERATIONS, MORE_ITERATIONS, LAST_ITERATIONS = 40, 120, 1000
"""Of a tour: always, where its bound may still come above the cheapest path, and where nothing is put in any more."""

ROUNDING_M = 1e-3
"""A path that comes within R but for this reaches a user: it is only met on the way, no proof rests on it."""

Step = tuple[int, int]
"""Requirement and member."""


@dataclass(frozen=True, eq=False)
class TollProblem:
    """What has to be passed, and what it costs to stay away from it.

    Attributes
    ----------
    members
        (Q, 2) the users that may stand for each requirement, twice the same where there is one.
    places_m
        (N, 2) users.
    fixed, weights
        (Q, 2) constant and factor of each member's toll: fixed + weight·ĝ(δ).
    curve
        ĝ, up to R.
    leg_cost, end_cost
        Of a metre, and of a metre of the way back to the origin; None where the path ends anywhere.
    """

    members: Ints
    places_m: Floats
    fixed: Floats
    weights: Floats
    curve: Curve
    leg_cost: float
    end_cost: float | None

    def __post_init__(self) -> None:
        least = self.fixed + self.weights * self.curve.values[0]
        object.__setattr__(self, "least", least.min(axis=1))

    least: Floats = field(init=False)
    """(Q,) the least that each requirement can pay."""

    def way_cost(self, points_m: Floats) -> float:
        """Return what a path from the origin through points (K, 2) costs by the metre."""
        path = np.vstack([np.zeros(2), points_m])
        cost = self.leg_cost * float(np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1)).sum())
        return cost if self.end_cost is None else cost + self.end_cost * float(np.hypot(*path[-1]))

    def tolls_along(self, points_m: Floats) -> tuple[Floats, Floats]:
        """Return (Q, 2) tolls along a path through points (K, 2), as at R where it stays beyond, and how far beyond."""
        away = distances_m(points_m, self.places_m)[self.members]
        beyond = np.maximum(away - self.curve.radius_m - ROUNDING_M, 0.0)
        return self.fixed + self.weights * self.curve.at(away), beyond


def distances_m(points_m: Floats, places_m: Floats) -> Floats:
    """Return (N,) how near a path from the origin through points (K, 2) comes to places (N, 2): not on its way back."""
    path = np.vstack([np.zeros((1, 2)), points_m])
    start, step = path[:-1], np.diff(path, axis=0)
    if not len(step):
        return np.asarray(np.sqrt((places_m**2).sum(axis=1)))
    x = places_m[:, :1] - start[:, 0]
    y = places_m[:, 1:] - start[:, 1]
    squared = np.maximum((step**2).sum(axis=1), 1e-12)
    along = np.clip((x * step[:, 0] + y * step[:, 1]) / squared, 0.0, 1.0)
    x -= along * step[:, 0]
    y -= along * step[:, 1]
    return np.asarray(np.sqrt((x * x + y * y).min(axis=1)))


def reaching_all(problem: TollProblem, points_m: Floats) -> Floats:
    """Return points (K, 2) with others among them until the path reaches a member of each requirement.

    The farthest is reached first, by the shortest way out from the leg that is nearest to it.
    """
    radius_m = problem.curve.radius_m
    for _ in range(len(problem.members)):
        away = distances_m(points_m, problem.places_m)[problem.members]
        lacking = away.min(axis=1) - radius_m
        most = int(lacking.argmax())
        if lacking[most] <= ROUNDING_M:
            break
        centre = problem.places_m[problem.members[most, away[most].argmin()]]
        path = np.vstack([np.zeros((1, 2)), points_m])
        ahead = np.vstack([path[1:], path[-1:]])
        step = ahead - path
        squared = np.maximum((step**2).sum(axis=1), 1e-12)
        along = np.clip(((centre - path) * step).sum(axis=1) / squared, 0.0, 1.0)
        outward = path + along[:, None] * step - centre
        leg = int((outward**2).sum(axis=1).argmin())
        place = centre + outward[leg] * (radius_m / float(np.hypot(*outward[leg])))
        points_m = np.insert(points_m, leg, place, axis=0)
    return points_m


@dataclass(slots=True, eq=False)
class Node:
    """One sequence of the search.

    Attributes
    ----------
    sequence
        Steps in the order in which the path passes.
    bound
        Cost that its own dual proves.
    floor
        The greatest bound from the root to here.
    duals, points_m
        (L, 2), (K, 2) of its tour.
    children
        Requirement that is put in next and the nodes it leads to; None while it is a leaf.
    done
        Whether it has been looked at.
    """

    sequence: tuple[Step, ...]
    bound: float
    floor: float
    duals: Floats
    points_m: Floats
    children: "tuple[int, list[Node]] | None" = None
    done: bool = False


@dataclass(eq=False)
class TollSearch:
    """A search under way.

    Parameters
    ----------
    problem
        What to pass.
    target
        Nodes whose bound reaches it are not searched: a cost that is known to be reached, or all that is wanted.

    Attributes
    ----------
    root
        Of the tree.
    best
        Points (K, 2) of the cheapest path so far.
    cost
        What it costs.
    nodes
        Number of nodes so far.
    """

    problem: TollProblem
    target: float
    best: Floats = field(default_factory=lambda: np.empty((0, 2)))
    cost: float = np.inf
    nodes: int = 1

    def __post_init__(self) -> None:
        problem = self.problem
        legs = 0 if problem.end_cost is None else 1
        empty = np.empty((0, 2))
        least = float(problem.least.sum())
        self.root = Node((), least, least, np.zeros((legs, 2)), empty)
        self._open: list[tuple[float, int, Node]] = []
        self._plunge: list[Node] = []
        self._floor = np.inf
        self._push(self.root)

    @property
    def bound(self) -> float:
        """No path costs less."""
        waiting = self._open[0][0] if self._open else np.inf
        return float(min(waiting, self._floor))

    @property
    def promising(self) -> Floats:
        """Points (K, 2) of the cheapest path so far, or of the sequence that came nearest to one."""
        if np.isfinite(self.cost) or not self._plunge:
            return self.best
        return max(self._plunge, key=lambda node: (len(node.sequence), -node.floor)).points_m

    def run(self, slack: float, keep_going: Callable[[], bool]) -> None:
        """Search until the bound is within ``slack`` of the target or of the cheapest path, or there is no time."""
        while self._open and keep_going():
            goal = min(self.target, self.cost) - slack
            if self._open[0][0] >= min(goal, self._floor):
                return
            chosen = []
            for node in self._next_nodes(goal):
                node.done = True
                if (place := self._next(node, slack)) is None:
                    self._refine(node)
                    self._floor = min(self._floor, node.floor)
                else:
                    chosen.append((node, place))
            if chosen:
                self._branch(chosen, goal)
            while self._open and self._open[0][2].done:
                heapq.heappop(self._open)

    def _next_nodes(self, goal: float) -> Iterator[Node]:
        """Yield the nodes of a batch: a few that plunge, then those of least bound."""
        plunging = [node for node in self._plunge if node.floor < goal and not node.done]
        yield from plunging
        left = BATCH - len(plunging)
        while self._open and left and self._open[0][0] < goal:
            node = heapq.heappop(self._open)[2]
            if not node.done:
                left -= 1
                yield node

    def _push(self, node: Node) -> None:
        heapq.heappush(self._open, (node.floor, self.nodes, node))

    def _next(self, node: Node, slack: float) -> int | None:
        """Return the requirement to put in: what pays most more than the least; None where that hardly matters."""
        problem = self.problem
        tolls, beyond = problem.tolls_along(node.points_m)
        reach = tolls + np.where(beyond > 0, np.inf, 0.0)
        cost = problem.way_cost(node.points_m) + float(reach.min(axis=1).sum())
        if cost < self.cost:
            self.cost, self.best = cost, node.points_m
        more = (tolls + 2 * problem.leg_cost * beyond).min(axis=1) - problem.least
        inside = [requirement for requirement, _ in node.sequence]
        more[inside] = -1.0
        most = int(more.argmax()) if len(more) else 0
        if len(inside) == len(more) or more[most] <= 0.0:
            return None
        if np.isfinite(cost) and more[more > 0].sum() < slack / 4:
            return None
        return most

    def _branch(self, chosen: list[tuple[Node, int]], goal: float) -> None:
        """Solve all children of these nodes; those below the goal are searched on."""
        problem = self.problem
        made: list[tuple[Node, tuple[Step, ...], int]] = []
        for node, requirement in chosen:
            members = dict.fromkeys(problem.members[requirement].tolist())
            for member, _ in enumerate(members):
                for at in range(len(node.sequence) + 1):
                    step = (requirement, member)
                    made.append((node, (*node.sequence[:at], step, *node.sequence[at:]), at))
        places = max(len(sequence) for _, sequence, _ in made)
        tolls, points, duals = self._begin(made, places)
        tours = solve_tours(tolls, points, duals, ITERATIONS)
        points, duals, bound = tours.points_m, tours.duals, tours.bound
        outside = np.array([self._constant(sequence) for _, sequence, _ in made])
        floors = np.array([parent.floor for parent, _, _ in made])
        short = np.flatnonzero(np.maximum(bound + outside, floors) < goal)
        if len(short):
            part = Tolls(
                tolls.centres_m[short], tolls.weights[short], tolls.leg_cost, tolls.end_cost, tolls.curve
            )
            again = solve_tours(part, points[short], duals[short], MORE_ITERATIONS)
            better = again.bound > bound[short]
            improved = short[better]
            bound[improved], duals[improved] = again.bound[better], again.duals[better]
            points[short] = again.points_m
        kept: dict[int, list[Node]] = {id(node): [] for node, _ in chosen}
        for row, (parent, sequence, _) in enumerate(made):
            first = places - len(sequence)
            proved = float(bound[row] + outside[row])
            child = Node(
                sequence,
                proved,
                max(proved, parent.floor),
                duals[row, first:].copy(),
                points[row, first:].copy(),
            )
            kept[id(parent)].append(child)
            self.nodes += 1
            if child.floor < goal:
                self._push(child)
            else:
                self._floor = min(self._floor, child.floor)
        self._plunge = []
        for node, requirement in chosen:
            node.children = requirement, kept[id(node)]
            if len(self._plunge) < PLUNGERS:
                self._plunge.append(min(kept[id(node)], key=lambda child: child.floor))

    def _refine(self, node: Node) -> None:
        """Bring the bound of a node that is not branched on nearer to what its path costs."""
        if not node.sequence:
            return
        tolls, points, duals = self._begin([(node, node.sequence, -1)], len(node.sequence))
        tours = solve_tours(tolls, points, duals, LAST_ITERATIONS)
        proved = float(tours.bound[0]) + self._constant(node.sequence)
        if proved > node.bound:
            node.bound, node.duals = proved, tours.duals[0]
            node.floor = max(node.floor, proved)

    def _constant(self, sequence: tuple[Step, ...]) -> float:
        """Return what a sequence pays beside its tour: fixed parts of those inside, the least of those outside."""
        inside = [requirement for requirement, _ in sequence]
        fixed = sum(float(self.problem.fixed[step]) for step in sequence)
        return fixed + float(self.problem.least.sum() - self.problem.least[inside].sum())

    def _begin(
        self, made: list[tuple[Node, tuple[Step, ...], int]], places: int
    ) -> tuple[Tolls, Floats, Floats]:
        """Return the tours of new nodes, filled up in front, and where their parents' end.

        Where the position is −1, the tours of the nodes themselves.
        """
        problem = self.problem
        count, ends = len(made), 0 if problem.end_cost is None else 1
        centres, weights = np.zeros((count, places, 2)), np.full((count, places), -1.0)
        points, duals = np.zeros((count, places, 2)), np.zeros((count, places + ends, 2))
        for row, (parent, sequence, at) in enumerate(made):
            first = places - len(sequence)
            requirements, members = np.array(sequence).T
            centres[row, first:] = problem.places_m[problem.members[requirements, members]]
            weights[row, first:] = problem.weights[requirements, members]
            old = parent.duals
            if at < 0:
                points[row, first:], duals[row, first:] = parent.points_m, old
                continue
            points[row, first:] = np.insert(parent.points_m, at, centres[row, first + at], axis=0)
            if len(old):
                duals[row, first:] = np.insert(old, at, old[min(at, len(old) - 1)], axis=0)
        tolls = Tolls(centres, weights, problem.leg_cost, problem.end_cost, problem.curve)
        return tolls, points, duals
