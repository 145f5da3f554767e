"""The order of stops some of which have their place in it: the first, the last, one after another. Pure."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mavplan.planners.ordering import ORIGIN_M
from mavplan.scenario.model import Bools, Floats, Ints

ALL_MOVED = 60
"""Up to so many stops every part of the order is moved and turned; beyond, pinned stops alone are put in."""

MOST_MOVES = 200

MOVED_TOGETHER = 3
"""Neighbours that move to another place in the order at most, without being turned round as a whole."""

WORTHWHILE_M = 1e-6


@dataclass(frozen=True, eq=False)
class Ranks:
    """Which of M stops are pinned, and (M,) their ranks: -inf the first of all, inf the last, NaN anywhere."""

    pinned: Bools
    rank: Floats

    def taken(self, order: Ints) -> "Ranks":
        """Return the ranks of the stops in another order."""
        return Ranks(self.pinned[order], self.rank[order])


def is_kept(rank: Floats) -> bool:
    """Return whether stops with these ranks, in flying order, keep the order."""
    given = rank[~np.isnan(rank)]
    ascending = all(one <= other for one, other in pairwise(given.tolist()))
    return ascending and not np.isneginf(rank[1:]).any() and not np.isposinf(rank[:-1]).any()


def nearest_first(places_m: Floats, ranks: Ranks) -> Ints:
    """Return MPSS, from the origin always to the nearest stop, of those whose turn it may be."""
    rank = ranks.rank
    waiting = list(range(len(places_m)))
    order: list[int] = []
    here = ORIGIN_M
    while waiting:
        may_be = np.array(_next(waiting, rank))
        away = places_m[may_be] - here
        chosen = int(may_be[int(np.argmin(np.einsum("ij,ij->i", away, away)))])
        waiting.remove(chosen)
        order.append(chosen)
        here = places_m[chosen]
    return np.array(order, dtype=np.int64)


def _next(waiting: list[int], rank: Floats) -> list[int]:
    """Return the stops whose turn it may be."""
    given = [stop for stop in waiting if not math.isnan(rank[stop])]
    lowest = min(given, key=lambda stop: float(rank[stop]), default=None)
    if lowest is None:
        return waiting
    if rank[lowest] == -math.inf:
        return [lowest]
    free = [stop for stop in waiting if math.isnan(rank[stop])]
    return free if rank[lowest] == math.inf and free else [*free, lowest]


def inserted(places_m: Floats, ranks: Ranks, *, returns: bool) -> Ints:
    """Return the order of the stops that are not pinned, with each pinned one where its detour is least.

    Ordered ones come first, in their order, then those that may be anywhere; the first and the last of all at the end.
    """
    order = np.flatnonzero(~ranks.pinned).tolist()
    pins = np.flatnonzero(ranks.pinned).tolist()
    ends = [pin for pin in pins if math.isinf(ranks.rank[pin])]
    middle = sorted(
        (pin for pin in pins if pin not in ends),
        key=lambda pin: (math.isnan(ranks.rank[pin]), float(np.nan_to_num(ranks.rank[pin])), pin),
    )
    for pin in middle:
        low = 0
        if not math.isnan(ranks.rank[pin]):
            low = 1 + max(
                (at for at, stop in enumerate(order) if not math.isnan(ranks.rank[stop])), default=-1
            )
        detours = _detours_m(places_m, order, places_m[pin], returns=returns)
        order.insert(low + int(np.argmin(detours[low:])), pin)
    for pin in ends:
        order.insert(0 if ranks.rank[pin] < 0 else len(order), pin)
    return np.array(order, dtype=np.int64)


def _detours_m(places_m: Floats, order: list[int], place: Floats, *, returns: bool) -> Floats:
    """Return how much longer the path becomes with a place put in before each stop, and behind the last."""
    points = np.vstack([ORIGIN_M, places_m[order], ORIGIN_M])
    away = np.linalg.norm(points - place, axis=1)
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    detours = away[:-1] + away[1:] - legs
    if not returns:
        detours[-1] = away[-2]
    return np.asarray(detours)


def shortened(places_m: Floats, ranks: Ranks, *, returns: bool) -> Ints:
    """Return an order in which the path is no longer, and no part of it can be moved or turned to make it shorter.

    The best of all moves, again and again; ranks are kept.
    """
    count = len(places_m)
    order = np.arange(count)
    if not 2 <= count <= ALL_MOVED:
        return order
    moves = _moves(count)
    best_m = _lengths_m(places_m, order[None], returns=returns)[0]
    for _ in range(MOST_MOVES):
        tried = order[moves]
        lengths = _lengths_m(places_m, tried, returns=returns)
        for at in np.argsort(lengths, kind="stable").tolist():
            if lengths[at] >= best_m - WORTHWHILE_M:
                return order
            if is_kept(ranks.rank[tried[at]]):
                order, best_m = tried[at], lengths[at]
                break
        else:
            return order
    return order


def _moves(count: int) -> Ints:
    """Return permutations (B, M): every part turned round, every few neighbours put elsewhere."""
    rows = np.arange(count)
    found = []
    for first in range(count):
        for end in range(first + 2, count + 1):
            found.append(np.concatenate([rows[:first], rows[first:end][::-1], rows[end:]]))
        for size in range(1, min(MOVED_TOGETHER, count - first) + 1):
            part = rows[first : first + size]
            rest = np.delete(rows, part)
            for at in range(len(rest) + 1):
                if at != first:
                    found.append(np.concatenate([rest[:at], part, rest[at:]]))
    return np.unique(np.array(found).reshape(-1, count), axis=0)


def _lengths_m(places_m: Floats, orders: Ints, *, returns: bool) -> Floats:
    """Return (B,) lengths of the paths through the stops in each order (B, M)."""
    points = places_m[orders]
    legs = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    legs = legs + np.linalg.norm(points[:, 0], axis=1)
    return np.asarray(legs + np.linalg.norm(points[:, -1], axis=1) if returns else legs)
