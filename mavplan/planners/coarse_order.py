"""An order of places for a path that need not be the best: regions of a plan, one after the other.

Up to some hundreds of places: the nearest next, then parts are turned round or moved while that is shorter (2-opt and
Or-opt). More are put together in groups, which are ordered first.
"""

import numpy as np

from mavplan.planners.regions import halved
from mavplan.scenario.model import Floats, Ints

AT_ONCE = 400
"""Places that are ordered together."""

LONGEST_MOVED = 3
"""Places that are moved together."""

LEAST_GAIN = 1e-9
"""Of the length, below which a change is none."""


def coarse_order(places_m: Floats, start_m: Floats, end_m: Floats | None) -> Ints:
    """Return (N,) an order of places (N, 2) for a path from a start to an end, or that ends anywhere."""
    if len(places_m) <= AT_ONCE:
        return ordered(places_m, start_m, end_m)
    groups = halved(places_m, AT_ONCE)
    middles = np.array([places_m[group].mean(axis=0) for group in groups])
    found: list[Ints] = []
    order = coarse_order(middles, start_m, end_m)
    for at, group in enumerate(order.tolist()):
        members = groups[group]
        last = end_m if at + 1 == len(order) else middles[order[at + 1]]
        found.append(members[ordered(places_m[members], start_m, last)])
        start_m = places_m[found[-1][-1]]
    return np.concatenate(found)


def ordered(places_m: Floats, start_m: Floats, end_m: Floats | None) -> Ints:
    """Return an order of some hundreds of places."""
    line = np.vstack([start_m, places_m, *([] if end_m is None else [end_m])])
    away = np.linalg.norm(line[:, None] - line[None], axis=2)
    count = len(places_m)
    order = _nearest_next(away[: count + 1, : count + 1])
    if end_m is not None:
        order = np.append(order, count + 1)
    least = LEAST_GAIN * float(away[order[:-1], order[1:]].sum() + 1.0)
    while True:
        changed = _turned(order, away, least, free_end=end_m is None)
        if changed is None:
            changed = _moved(order, away, least, free_end=end_m is None)
        if changed is None:
            break
        order = changed
    return order[1 : count + 1] - 1


def _nearest_next(away: Floats) -> Ints:
    left = np.arange(1, len(away))
    order = [0]
    while len(left):
        nearest = int(away[order[-1], left].argmin())
        order.append(int(left[nearest]))
        left = np.delete(left, nearest)
    return np.array(order, dtype=np.int64)


def _turned(order: Ints, away: Floats, least: float, *, free_end: bool) -> Ints | None:
    """Return the order with the part turned round that gains most; None where none gains."""
    d = away[np.ix_(order, order)]
    size = len(order)
    legs = np.append(np.diagonal(d, 1), 0.0)
    beyond = np.hstack([d[:, 1:], np.zeros((size, 1))])
    # Turning the places from a + 1 to b round: the legs (a, a + 1) and (b, b + 1) become (a, b) and (a + 1, b + 1).
    gain = legs[:-1, None] + legs[None, :] - d[:-1] - beyond[1:]
    a, b = np.arange(size - 1)[:, None], np.arange(size)[None]
    allowed = (b >= a + 2) & (b < size - (not free_end))
    gain = np.where(allowed, gain, 0.0)
    if gain.max(initial=0.0) <= least:
        return None
    first, last = np.unravel_index(int(gain.argmax()), gain.shape)
    return np.concatenate([order[: first + 1], order[first + 1 : last + 1][::-1], order[last + 1 :]])


def _moved(order: Ints, away: Floats, least: float, *, free_end: bool) -> Ints | None:
    """Return the order with the few neighbours moved elsewhere that gain most; None where none gain."""
    d = away[np.ix_(order, order)]
    size = len(order)
    best = least
    found = None
    for length in range(1, LONGEST_MOVED + 1):
        firsts = np.arange(1, size - length + (1 if free_end else 0))
        if not len(firsts):
            continue
        lasts = firsts + length - 1
        at_end = lasts + 1 >= size
        after = np.minimum(lasts + 1, size - 1)
        saved = d[firsts - 1, firsts] + np.where(at_end, 0.0, d[lasts, after] - d[firsts - 1, after])
        to = np.arange(size - (not free_end))
        on = np.minimum(to + 1, size - 1)
        last_leg = (to + 1 >= size)[None]
        for turned in (False, True):
            head, tail = (lasts, firsts) if turned else (firsts, lasts)
            added = d[head][:, to] + np.where(last_leg, 0.0, d[tail][:, on] - d[to, on][None])
            gain = saved[:, None] - added
            inside = (to[None] >= firsts[:, None] - 1) & (to[None] <= lasts[:, None])
            gain = np.where(inside, 0.0, gain)
            row, column = np.unravel_index(int(gain.argmax()), gain.shape)
            if gain[row, column] > best:
                best = float(gain[row, column])
                found = int(firsts[row]), length, int(to[column]), turned
    if found is None:
        return None
    first, length, target, turned = found
    part = order[first : first + length]
    rest = np.concatenate([order[:first], order[first + length :]])
    at = target + 1 if target < first else target + 1 - length
    return np.concatenate([rest[:at], part[::-1] if turned else part, rest[at:]])
