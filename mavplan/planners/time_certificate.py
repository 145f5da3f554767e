"""From a bound on mission time to its proof: prices, and of the tree what the bound needs."""

from collections.abc import Iterator

import numpy as np

from mavplan.bounds.time import Entry, TimeCertificate
from mavplan.planners.time_bound import TimeBound
from mavplan.planners.toll_problem import TollProblem
from mavplan.planners.toll_search import Node

MOST_LEAVES = 8_000
"""Leaves at most: where the bound takes more, as much is proved as so many do. One takes about a hundred bytes."""

SPARE = 1e-9
"""Share of the bound that a leaf may lack."""


def time_certificate(found: TimeBound, most_leaves: int = MOST_LEAVES) -> TimeCertificate:
    """Return a proof of the bound, or of a smaller one where that would take too many leaves."""
    search, prices = found.search, found.prices
    level = search.bound * (1 - SPARE)
    if _leaves(search.root, level) > most_leaves:
        low, high = search.root.bound, level
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if _leaves(search.root, middle) <= most_leaves else (low, middle)
        level = low
    tree = tuple(_entries(search.problem, search.root, level))
    flat, steep = (np.maximum(np.round(values, 9), 0.0) for values in (prices.flat, prices.steep))
    return TimeCertificate(round(prices.share, 9), flat, steep, tree)


def _proves(node: Node, level: float) -> bool:
    """Return whether a node is a leaf of the proof: what it proves itself is enough, or nothing was made of it."""
    return node.bound >= level or node.children is None


def _leaves(root: Node, level: float) -> int:
    count, waiting = 0, [root]
    while waiting:
        node = waiting.pop()
        if _proves(node, level):
            count += 1
        elif node.children is not None:
            waiting += node.children[1]
    return count


def _entries(problem: TollProblem, root: Node, level: float) -> Iterator[Entry]:
    """Yield the tree in preorder, vectors in units of the cost of a metre."""
    cost = np.array([problem.leg_cost])
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if node.children is None or _proves(node, level):
            units = np.repeat(cost, len(node.duals))
            if problem.end_cost is not None:
                units[-1:] = problem.end_cost
            yield node.duals / units[:, None]
            continue
        requirement, children = node.children
        yield int(problem.members[requirement, 0])
        waiting += reversed(children)
