"""Small covers of a `CoverInstance`: greedy, local search with weights, and windows solved exactly. No proofs here."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.planners.cover_candidates import CoverInstance, distinct_rows
from mavplan.scenario.model import Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

STEPS_A_REQUIREMENT = 20
MOST_STEPS = 60_000
"""Swaps of the local search."""

WINDOW_REQUIREMENTS = 200
"""A window is opened until this many requirements depend on its discs: HiGHS takes some tenths of a second for one."""

WINDOWS = 50
WINDOW_NODES = 50
"""Windows of one polish, at most one for each disc, and branch-and-bound nodes that each may take."""


def greedy_cover(covers: "csr_array") -> Ints:
    """Return candidates that meet all requirements: always one that meets most of those still open."""
    open_ = np.ones(covers.shape[1])
    chosen: list[int] = []
    while open_.any():
        best = int((covers @ open_).argmax())
        chosen.append(best)
        open_[covers.indices[covers.indptr[best] : covers.indptr[best + 1]]] = 0.0
    return np.array(chosen, dtype=np.int64)


def search_cover(covers: "csr_array", start: Ints, target: int, rng: np.random.Generator) -> Ints:
    """Return a cover at most as large as ``start``, by swaps under weights that grow where a requirement stays open.

    With one disc too few, take out the disc whose loss weighs least, and put in the one that meets a requirement
    drawn from the open ones and gains most; open requirements then weigh one more. The disc put in last stays, and
    of equal discs the one that has not moved longest goes.

    Parameters
    ----------
    covers
        (C, Q) candidates and requirements.
    start
        A cover, indices of candidates.
    target
        A size known to be the minimum if it is reached: ends the search.

    References
    ----------
    C. Gao, X. Yao, T. Weise, J. Li, "An efficient local search heuristic with row weighting for the unicost set
    covering problem", Eur. J. Oper. Res. 246(3), 2015, doi 10.1016/j.ejor.2015.05.038.
    """
    met_by = covers.T.tocsr()
    candidates_of = np.split(met_by.indices.astype(np.int64), met_by.indptr[1:-1])
    needs_of = np.split(covers.indices.astype(np.int64), covers.indptr[1:-1])
    weight = np.ones(covers.shape[1])
    moved_out = np.full(covers.shape[0], -1)
    gain = np.zeros(covers.shape[0])
    draws = rng.random(min(STEPS_A_REQUIREMENT * covers.shape[1], MOST_STEPS))

    best = chosen = start.copy()
    put_in = np.full(len(chosen), -1)
    last = -1
    # How many chosen discs meet each requirement, and the sum of their positions: with one, its position.
    times, position = _count(chosen, needs_of, covers.shape[1])
    open_ = np.flatnonzero(times == 0)
    for step, draw in enumerate(draws):
        alone = np.flatnonzero(times == 1)
        loss = np.bincount(position[alone], weight[alone], len(chosen))
        if not len(open_):
            best = chosen.copy()
            if len(best) <= target:
                break
            out = int(loss.argmin())
            chosen, put_in, last = np.delete(chosen, out), np.delete(put_in, out), -1
            times, position = _count(chosen, needs_of, covers.shape[1])
            open_ = np.flatnonzero(times == 0)
            continue
        if last >= 0:
            loss[last] = math.inf
        ties = np.flatnonzero(loss == loss.min())
        out = int(ties[put_in[ties].argmin()])
        removed = chosen[out]
        times[needs_of[removed]] -= 1
        position[needs_of[removed]] -= out
        moved_out[removed] = step

        open_ = np.flatnonzero(times == 0)
        offered = candidates_of[open_[int(draw * len(open_))]]
        for need in open_:
            gain[candidates_of[need]] += weight[need]
        offered_gain = gain[offered]
        if len(offered) > 1:
            offered_gain[offered == removed] = -1.0
        for need in open_:
            gain[candidates_of[need]] = 0.0
        ties = offered[offered_gain == offered_gain.max()]
        added = ties[moved_out[ties].argmin()]
        times[needs_of[added]] += 1
        position[needs_of[added]] += out
        chosen[out], put_in[out], last = added, step, out
        open_ = open_[times[open_] == 0]
        weight[open_] += 1.0
    return best


def _count(chosen: Ints, needs_of: list[Ints], needs: int) -> tuple[Ints, Ints]:
    """Return how many chosen discs meet each requirement, and the sum of their positions in ``chosen``."""
    times, position = np.zeros(needs, dtype=np.int64), np.zeros(needs, dtype=np.int64)
    for index, disc in enumerate(chosen):
        times[needs_of[disc]] += 1
        position[needs_of[disc]] += index
    return times, position


def polish_cover(
    instance: CoverInstance, chosen: Ints, radius_m: float, target: int, rng: np.random.Generator
) -> Ints:
    """Return a cover at most as large as ``chosen``: neighbouring discs are lifted and set anew by an exact cover.

    A window that needs as many discs as before takes the new ones: the next windows overlap it.
    """
    covers, centres = instance.covers, instance.centres_m
    for _ in range(min(WINDOWS, len(chosen))):
        if len(chosen) <= target:
            break
        middle = centres[chosen[rng.integers(len(chosen))]]
        away_m = np.linalg.norm(centres[chosen] - middle, axis=1)
        ranked = chosen[np.argsort(away_m + rng.uniform(0.0, radius_m / 2, len(chosen)))]
        # A requirement opens when the last of the discs that meet it is lifted.
        place_in_line = np.arange(1.0, len(ranked) + 1.0)
        opens_at = covers[ranked].multiply(place_in_line[:, None]).max(axis=0).toarray().reshape(-1)
        opened = np.cumsum(np.bincount(opens_at.astype(np.int64), minlength=len(ranked) + 1))[1:]
        lifted = int(np.searchsorted(opened, WINDOW_REQUIREMENTS)) + 1
        needs = np.flatnonzero(opens_at <= lifted)
        window = covers[:, needs].tocsr()
        window.sort_indices()
        useful = distinct_rows(window)
        useful = useful[np.diff(window.indptr)[useful] > 0]
        found, _bound = exact_cover(window[useful], node_limit=WINDOW_NODES)
        if found is not None and len(found) <= lifted:
            chosen = np.concatenate((ranked[lifted:], useful[found]))
    return chosen


def exact_cover(
    covers: "csr_array",
    cost: Floats | None = None,
    *,
    time_limit_s: float | None = None,
    node_limit: int | None = None,
) -> tuple[Ints | None, float]:
    """Return the cheapest cover that HiGHS finds within the limits, None if none, and a lower bound of the cost.

    Parameters
    ----------
    covers
        (C, Q) candidates and requirements; every requirement has a candidate.
    cost
        (C,) not negative; 1 each where None.
    """
    from scipy import optimize

    options: dict[str, Any] = {}
    if time_limit_s is not None:
        options["time_limit"] = time_limit_s
    if node_limit is not None:
        options["node_limit"] = node_limit
    milp: Any = optimize.milp  # its stubs are stricter than it is
    found = milp(
        np.ones(covers.shape[0]) if cost is None else cost,
        constraints=optimize.LinearConstraint(covers.T.tocsr(), 1.0, np.inf),
        integrality=1,
        bounds=optimize.Bounds(0.0, 1.0),
        options=options,
    )
    bound = 0.0 if found.mip_dual_bound is None else max(float(found.mip_dual_bound), 0.0)
    if found.x is None:
        return None, bound
    chosen = np.flatnonzero(found.x > 0.5)
    met = np.zeros(covers.shape[1], dtype=bool)
    met[covers[chosen].indices] = True
    return (chosen if met.all() else None), bound
