"""Branch and bound over the order in which discs are touched, to proof.

A node is a sequence of places whose discs are touched in this order; its bound is the dual of `touring`. What the
shortest path of a node reaches anyway needs no branching; of what it does not, the requirement farthest away is put
in at every position, for each place that meets it. Added to that: discs that a node's dual does not need leave its
sequence, which proves the same bound for more orders at once, and a sequence that was met before is not searched
again. So the tree is an acyclic graph: whatever a node refers to has a greater bound than the node.

References
----------
W. P. Coutinho, R. Q. do Nascimento, A. A. Pessoa and A. Subramanian, "A branch-and-bound algorithm for the close-enough
traveling salesman problem", INFORMS J. Computing 28, 2016, doi 10.1287/ijoc.2016.0711.
"""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mavplan.planners.path_problem import FoundPath, PathProblem
from mavplan.planners.touring import Tours, dual_bound_m, tour_discs, turns_of
from mavplan.scenario.model import Bools, Floats, Ints

GAP = 1e-6
"""A path is the shortest when its bound is no further below it than this, of its length."""

BATCH = 48
"""Nodes that are branched on together."""

PLUNGERS = 6
"""Of these, nodes that follow the most promising children of the last ones down: they find paths."""

LOOSE = 1e-3
"""Precision of nodes that must be branched on anyway."""

EXACT = 1e-8
"""Precision of a node whose path meets everything, and of bounds that may or may not reach the best length."""

NEEDLESS = 1e-2
"""A disc with a smaller multiplier (at most 2) than this may leave a sequence."""

PRUNED = -1
"""In `Node.children`: no path with this sequence is shorter than the best one."""

NOTHING = -1
"""In `Node.requirement`: its own shortest path meets everything."""

Sequence = tuple[int, ...]


@dataclass(slots=True)
class Node:
    """One sequence of the search.

    Attributes
    ----------
    sequence
        Places in the order of touch.
    bound_m
        No path that touches them in this order is shorter.
    requirement
        What its children put in, or `NOTHING`.
    children
        For each place of the requirement and each position, from before the first to behind the last: the index of a
        node whose sequence is part of the child's, or `PRUNED`; None while it is not branched on.
    """

    sequence: Sequence
    bound_m: float
    requirement: int
    children: list[int] | None = None


@dataclass(eq=False)
class PathSearch:
    """A search under way.

    Parameters
    ----------
    problem
        Only requirements that are not met from the start, at least one.
    best
        A path to begin with.

    Attributes
    ----------
    nodes
        All nodes so far, the root first.
    """

    problem: PathProblem
    best: FoundPath
    nodes: list[Node] = field(default_factory=list)
    _floor_m: float = np.inf
    _open: list[tuple[float, int]] = field(default_factory=list)
    _plunge: list[int] = field(default_factory=list)
    _seen: dict[Sequence, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        away = self.problem.away_m(np.empty((1, 0, 2)))[0]
        self.nodes.append(Node((), 0.0, int(away.argmax())))
        self._open.append((0.0, 0))

    @property
    def cutoff_m(self) -> float:
        """Nodes whose bound reaches this are not searched."""
        return self.best.length_m * (1.0 - GAP)

    @property
    def bound_m(self) -> float:
        """No path that meets all requirements is shorter."""
        waiting = [self.nodes[index].bound_m for index in self._plunge]
        waiting += [bound for bound, _ in self._open[:1]]
        return float(min([self.cutoff_m, self._floor_m, *waiting]))

    @property
    def proved(self) -> bool:
        """Whether the best path is the shortest."""
        return self.bound_m >= self.cutoff_m

    def run(self, keep_going: Callable[[], bool]) -> None:
        """Search until nothing is left to be searched, or ``keep_going``, asked before each batch, returns False."""
        while keep_going():
            chosen = self._choose()
            if not chosen:
                return
            self._branch(chosen)

    def _choose(self) -> list[int]:
        """Take the nodes of the next batch."""
        chosen = [index for index in self._plunge if self.nodes[index].bound_m < self.cutoff_m]
        self._plunge = []
        while self._open and len(chosen) < BATCH and self._open[0][0] < self.cutoff_m:
            chosen.append(heapq.heappop(self._open)[1])
        return chosen

    def _branch(self, chosen: list[int]) -> None:
        """Solve all children of these nodes; take in those that may hold a shorter path."""
        by_length: dict[int, list[_Child]] = {}
        for parent in chosen:
            node = self.nodes[parent]
            places = dict.fromkeys(self.problem.required.choices[node.requirement].tolist())
            positions = len(node.sequence) + 1
            node.children = [PRUNED] * (len(places) * positions)
            for slot in range(len(node.children)):
                if not self._is_mirrored(node, slot):
                    position = slot % positions
                    place = list(places)[slot // positions]
                    sequence = (*node.sequence[:position], place, *node.sequence[position:])
                    by_length.setdefault(positions, []).append(_Child(parent, slot, sequence))
        made: set[int] = set()
        for children in by_length.values():
            made |= self._solve(children)
        for parent in chosen:
            node = self.nodes[parent]
            assert node.children is not None
            for slot in range(len(node.children)):
                if self._is_mirrored(node, slot):
                    node.children[slot] = node.children[slot - 1]
            own = made.intersection(node.children)
            if own and len(self._plunge) < PLUNGERS:
                self._plunge.append(min(own, key=lambda index: (self.nodes[index].bound_m, index)))
                made.discard(self._plunge[-1])
        for index in sorted(made):
            heapq.heappush(self._open, (self.nodes[index].bound_m, index))

    def _is_mirrored(self, node: Node, slot: int) -> bool:
        """Return whether a child is the one before it flown backwards."""
        return self.problem.returns and len(node.sequence) == 1 and slot % 2 == 1

    def _solve(self, children: list["_Child"]) -> set[int]:
        """Solve children of equal length, and return the new nodes that wait to be branched on."""
        problem, cutoff_m = self.problem, self.cutoff_m
        sequences = np.array([child.sequence for child in children])
        tours = self._tour(sequences, cutoff_m, LOOSE)
        alive = np.flatnonzero(tours.bound_m < cutoff_m)
        children, sequences, tours = [children[row] for row in alive], sequences[alive], tours.rows(alive)
        away = problem.away_m(tours.points_m)
        whole = np.flatnonzero(~problem.unmet(away).any(axis=1))
        if len(whole):
            tours.put(whole, self._tour(sequences[whole], np.inf, EXACT))
            away[whole] = problem.away_m(tours.points_m[whole])
        unmet: Bools = np.asarray(problem.unmet(away).any(axis=1))
        made: set[int] = set()
        for row, child in enumerate(children):
            bound_m = max(float(tours.bound_m[row]), self.nodes[child.parent].bound_m)
            if not unmet[row]:
                found = FoundPath(child.sequence, tours.points_m[row], float(tours.length_m[row]))
                if found.length_m < self.best.length_m:
                    self.best = found
                self._floor_m = min(self._floor_m, bound_m)
                self._link(child, self._add(Node(child.sequence, bound_m, NOTHING)))
                continue
            node = Node(child.sequence, bound_m, int(away[row].argmax()))
            shorter = self._shorter(child, tours.points_m[row], tours.duals[row])
            for candidate in (shorter, node):
                if candidate is None:
                    continue
                known = self._seen.get(candidate.sequence)
                if known is not None and self.nodes[known].bound_m > self.nodes[child.parent].bound_m:
                    self._link(child, known)
                    break
                if known is None or candidate is node:
                    self._link(child, self._add(candidate))
                    made.add(len(self.nodes) - 1)
                    break
        return made

    def _tour(self, sequences: Ints, cutoff_m: float, loose: float) -> Tours:
        problem = self.problem
        return tour_discs(
            problem.required.places_m[sequences],
            problem.radius_m,
            problem.start_m,
            problem.end_m,
            precision=min(EXACT, loose),
            loose=loose,
            cutoff_m=cutoff_m,
        )

    def _shorter(self, child: "_Child", points_m: Floats, duals: Floats) -> Node | None:
        """Return a node without the discs that the dual does not need; None where that would lose bound or reach."""
        discs = len(points_m)
        kept = np.flatnonzero(np.linalg.norm(turns_of(duals, discs), axis=1) > NEEDLESS)
        if len(kept) in (0, discs):
            return None
        problem = self.problem
        sequence = tuple(child.sequence[index] for index in kept)
        legs = np.append(kept, discs) if problem.end_m is not None else kept
        bound_m = dual_bound_m(
            problem.required.places_m[list(sequence)],
            problem.radius_m,
            problem.start_m,
            problem.end_m,
            duals[legs],
        )
        if bound_m <= self.nodes[child.parent].bound_m:
            return None
        away = problem.away_m(points_m[None, kept])
        left_out = np.setdiff1d(child.sequence, sequence)
        unmet = problem.unmet(away)[0]
        touched = np.isin(problem.required.choices, left_out)
        if not unmet.any() or touched[unmet].any():
            return None
        return Node(sequence, bound_m, int(away[0].argmax()))

    def _add(self, node: Node) -> int:
        self.nodes.append(node)
        self._seen.setdefault(node.sequence, len(self.nodes) - 1)
        return len(self.nodes) - 1

    def _link(self, child: "_Child", index: int) -> None:
        children = self.nodes[child.parent].children
        assert children is not None
        children[child.slot] = index


@dataclass(frozen=True, slots=True)
class _Child:
    """A sequence to be solved, and where its node is entered."""

    parent: int
    slot: int
    sequence: Sequence
