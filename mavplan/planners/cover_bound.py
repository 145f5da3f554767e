"""Proofs for a `CoverInstance`: how many discs any cover needs at least."""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.planners.cover_candidates import CoverInstance
from mavplan.planners.cover_search import exact_cover
from mavplan.scenario.model import Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

WHOLE_SLACK = 1e-4
"""A bound this little above a whole number may be there by the solver's tolerances, and counts as that number."""

STRIP_REQUIREMENTS = 400
"""Of a strip: HiGHS proves much of a cover of so many in seconds."""


def whole(bound: float) -> int:
    """Return the least whole number of discs that a bound allows."""
    return math.ceil(bound - WHOLE_SLACK)


def packing_bound(covers: "csr_array") -> int:
    """Return how many requirements, taken rarest first, no two of which one candidate meets: each needs a disc."""
    met_by = covers.T.tocsr()
    blocked = np.zeros(covers.shape[1], dtype=bool)
    apart = 0
    for need in np.argsort(np.diff(met_by.indptr), kind="stable"):
        if not blocked[need]:
            apart += 1
            candidates = met_by.indices[met_by.indptr[need] : met_by.indptr[need + 1]]
            blocked[covers[candidates].indices] = True
    return apart


def requirement_prices(covers: "csr_array", time_limit_s: float) -> Floats:
    """Return prices (Q,) that no candidate's requirements exceed 1 in sum: their total is a lower bound.

    They are the dual solution of the linear relaxation, scaled down by what the solver's tolerance lets them exceed;
    all 0 where it was not found in time.
    """
    from scipy import optimize

    candidates, needs = covers.shape
    linprog: Any = optimize.linprog  # its stubs do not know sparse matrices
    found = linprog(
        np.ones(candidates),
        A_ub=-covers.T.tocsr(),
        b_ub=-np.ones(needs),
        bounds=(0, None),
        method="highs-ipm",
        options={"time_limit": time_limit_s},
    )
    if found.status != 0:
        return np.zeros(needs)
    prices: Floats = np.maximum(-found.ineqlin.marginals, 0.0)
    return prices / max(1.0, float((covers @ prices).max()))


def strips_bound(instance: CoverInstance, prices: Floats, time_limit_s: float) -> float:
    """Return a lower bound, at least the sum of the prices, from exact covers of strips.

    The requirements are cut into strips across their longest extent. Each disc's price of 1 is split among the
    strips it touches, so the least costs of covering each strip alone add up to a lower bound; a strip gets what
    its own requirements' prices make, and what the prices leave of the disc. Every second strip is priced first,
    then the others with what is left.
    """
    covers = instance.covers
    by_need = covers.T.tocsr()
    parts = math.ceil(covers.shape[1] / STRIP_REQUIREMENTS)
    strips = np.array_split(np.argsort(_along(instance), kind="stable"), parts)
    workers = min(os.cpu_count() or 1, (parts + 1) // 2)
    rounds = [strips[0::2], strips[1::2]]
    batches = sum(math.ceil(len(group) / workers) for group in rounds)
    bound = float(prices.sum())
    left = np.maximum(1.0 - covers @ prices, 0.0)

    def least_cost(strip: Ints, discs: Ints, more: Floats) -> float:
        part = by_need[strip][:, discs].T.tocsr()
        return exact_cover(part, part @ prices[strip] + more, time_limit_s=time_limit_s / batches)[1]

    for group in rounds:
        touched = [np.unique(by_need[strip].indices) for strip in group]
        sharers = np.bincount(np.concatenate(touched), minlength=len(left)) if touched else np.zeros(0)
        extra = [left[discs] / sharers[discs] for discs in touched]

        with ThreadPoolExecutor(workers) as pool:  # HiGHS works outside Python's lock
            costs = list(pool.map(least_cost, group, touched, extra))
        for strip, discs, more, cost in zip(group, touched, extra, costs, strict=True):
            won = cost - float(prices[strip].sum())
            if won > WHOLE_SLACK:
                bound += won
                left[discs] -= more
    return bound


def _along(instance: CoverInstance) -> Floats:
    """Return how far along their longest extent the requirements lie; each at the mean of its candidates."""
    by_need = instance.covers.T.tocsr()
    middle = by_need @ instance.centres_m / np.diff(by_need.indptr)[:, None]
    middle = middle - middle.mean(axis=0)
    return np.asarray(middle @ np.linalg.svd(middle, full_matrices=False)[2][0])
