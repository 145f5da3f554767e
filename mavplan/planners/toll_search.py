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

from mavplan.planners.toll_problem import TollProblem
from mavplan.planners.toll_tours import Tolls, solve_tours
from mavplan.scenario.model import Floats

BATCH, PLUNGERS = 24, 4
"""Nodes that are branched on together; of these, the most promising children of the last ones: they find paths."""

ITERATIONS, LAST_ITERATIONS = (8, 12, 20, 60), 1000
"""Of a tour: some, and more each time that its bound is not yet above the cheapest path; many more where nothing is put
in any more."""

KEPT = 8
"""Complete paths that are kept, the cheapest."""

ALIKE = 1e-6
"""Paths whose costs differ by less than this part are taken for the same."""

Step = tuple[int, int]
"""Requirement and member."""


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
        self._met: list[tuple[float, Floats]] = []
        self._push(self.root)

    @property
    def bound(self) -> float:
        """No path costs less."""
        waiting = self._open[0][0] if self._open else np.inf
        return float(min(waiting, self._floor))

    @property
    def promising(self) -> list[Floats]:
        """Points (K, 2) of the cheapest paths met, the best first, or of the sequences that came nearest to one."""
        if self._met:
            return [points for _, points in self._met]
        nearest = sorted(self._plunge, key=lambda node: (-len(node.sequence), node.floor))
        return [node.points_m for node in nearest[:1]]

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
        self._meet(node.points_m, cost)
        more = (tolls + 2 * problem.leg_cost * beyond).min(axis=1) - problem.least
        inside = [requirement for requirement, _ in node.sequence]
        more[inside] = -1.0
        most = int(more.argmax()) if len(more) else 0
        if len(inside) == len(more) or more[most] <= 0.0:
            return None
        if np.isfinite(cost) and more[more > 0].sum() < slack / 4:
            return None
        return most

    def _meet(self, points_m: Floats, cost: float) -> None:
        """Keep a path, unless it is none or dearer than enough others."""
        if cost < self.cost:
            self.cost, self.best = cost, points_m
        if not np.isfinite(cost) or (len(self._met) == KEPT and cost >= self._met[-1][0]):
            return
        costs = np.array([known for known, _ in self._met])
        if (np.abs(costs - cost) < ALIKE * cost).any():
            return
        self._met.insert(int(np.searchsorted(costs, cost)), (cost, points_m))
        del self._met[KEPT:]

    def _branch(self, chosen: list[tuple[Node, int]], goal: float) -> None:
        """Solve all children of these nodes; those below the goal are searched on."""
        problem = self.problem
        sprouts = [
            (node, (requirement, member))
            for node, requirement in chosen
            for member, _ in enumerate(dict.fromkeys(problem.members[requirement].tolist()))
        ]
        made = [
            (node, (*node.sequence[:at], step, *node.sequence[at:]))
            for node, step in sprouts
            for at in range(len(node.sequence) + 1)
        ]
        places = max(len(sequence) for _, sequence in made)
        tolls, points, duals = self._begin(sprouts, len(made), places)
        positions = [len(node.sequence) + 1 for node, _ in sprouts]
        outside = np.repeat([self._constant((*node.sequence, step)) for node, step in sprouts], positions)
        floors = np.repeat([node.floor for node, _ in sprouts], positions)
        bound = np.full(len(made), -np.inf)
        for iterations in ITERATIONS:
            short = np.flatnonzero(np.maximum(bound + outside, floors) < goal)
            if not len(short):
                break
            again = solve_tours(tolls.part(short), points[short], duals[short], iterations)
            better = again.bound > bound[short]
            improved = short[better]
            bound[improved], duals[improved] = again.bound[better], again.duals[better]
            points[short] = again.points_m
        kept: dict[int, list[Node]] = {id(node): [] for node, _ in chosen}
        for row, (parent, sequence) in enumerate(made):
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
        centres, weights = self._places(node.sequence)
        tours = solve_tours(
            self._tolls(centres[None], weights[None]), node.points_m[None], node.duals[None], LAST_ITERATIONS
        )
        proved = float(tours.bound[0]) + self._constant(node.sequence)
        if proved > node.bound:
            node.bound, node.duals = proved, tours.duals[0]
            node.floor = max(node.floor, proved)

    def _constant(self, sequence: tuple[Step, ...]) -> float:
        """Return what a sequence pays beside its tour: fixed parts of those inside, the least of those outside."""
        inside = [requirement for requirement, _ in sequence]
        fixed = sum(float(self.problem.fixed[step]) for step in sequence)
        return fixed + float(self.problem.least.sum() - self.problem.least[inside].sum())

    def _places(self, sequence: tuple[Step, ...]) -> tuple[Floats, Floats]:
        """Return (K, 2) centres and (K,) weights of the members of a sequence."""
        requirements, which = np.array(sequence, dtype=np.int64).reshape(-1, 2).T
        users = self.problem.members[requirements, which]
        return self.problem.places_m[users], self.problem.weights[requirements, which]

    def _tolls(self, centres: Floats, weights: Floats) -> Tolls:
        problem = self.problem
        return Tolls(centres, weights, problem.leg_cost, problem.end_cost, problem.curve)

    def _begin(
        self, sprouts: list[tuple[Node, Step]], count: int, places: int
    ) -> tuple[Tolls, Floats, Floats]:
        """Return the tours of new nodes, filled up in front, and where their parents' end.

        Parameters
        ----------
        sprouts
            Parents, and the step that is put in at every position.
        count, places
            Number of new nodes, and of the places of their tours.
        """
        ends = 0 if self.problem.end_cost is None else 1
        centres, weights = np.zeros((count, places, 2)), np.full((count, places), -1.0)
        points, duals = np.zeros((count, places, 2)), np.zeros((count, places + ends, 2))
        row = 0
        for parent, step in sprouts:
            longer = len(parent.sequence) + 1
            rows, first = slice(row, row + longer), places - longer
            row += longer
            old_centres, old_weights = self._places((*parent.sequence, step))
            at, place = np.arange(longer)[:, None], np.arange(longer)
            old = np.where(place == at, longer - 1, place - (place > at))
            centres[rows, first:], weights[rows, first:] = old_centres[old], old_weights[old]
            points[rows, first:] = np.vstack([parent.points_m, old_centres[-1:]])[old]
            if len(parent.duals):
                leg = np.arange(longer + ends)
                duals[rows, first:] = parent.duals[np.minimum(leg - (leg > at), len(parent.duals) - 1)]
        return self._tolls(centres, weights), points, duals
