"""Neighbours of a plan that differ in a stop or in the order: what the search for the least time tries at each step.

All are plain arrays of stops in flying order, many at once; which of them is better is `time_search`'s business.
"""

import math
from functools import lru_cache

import numpy as np

from mavplan.bounds.time_case import top_speed_m_s
from mavplan.planners.time_problem import TimeProblem
from mavplan.scenario.model import Floats, Ints

MOST_PLACES = 4_000
"""Candidate places beyond this number are thinned out."""

ORDERS_IN_FLIGHT, ORDERS = 40, 3
"""Shortest orders tried: more where the order also decides what is received in flight."""

SIZES = 16
"""Numbers of stops for which the moves are kept in memory: many megabytes where there are many stops."""

LONGER_S = 20.0
"""Orders that fly longer than the present one by more than this are not tried."""


def candidate_places(problem: TimeProblem, rng: np.random.Generator) -> Floats:
    """Return (C, 2) places where stops may be worth while: users, middles of two, crossings of their circles."""
    from scipy.spatial import KDTree

    users, radius_m = np.unique(problem.users_m, axis=0), problem.channel.radius_m
    pairs = KDTree(users).query_pairs(2 * radius_m, output_type="ndarray")
    if len(pairs) > MOST_PLACES // 3:
        pairs = pairs[np.sort(rng.choice(len(pairs), MOST_PLACES // 3, replace=False))]
    one, other = users[pairs[:, 0]], users[pairs[:, 1]]
    middle, apart = (one + other) / 2, other - one
    length = np.sqrt((apart**2).sum(axis=1))
    height = np.sqrt(np.maximum(radius_m**2 - (length / 2) ** 2, 0.0)) * (1 - 1e-6)
    across = np.stack([-apart[:, 1], apart[:, 0]], axis=1) * (height / np.maximum(length, 1e-9))[:, None]
    return np.vstack([users, middle, middle + across, middle - across])


def detours_m(problem: TimeProblem, stops_m: Floats, places_m: Floats) -> Floats:
    """Return (C, M + 1) the metres at full speed that a stop at each place adds before each stop, and at the end."""
    path = np.vstack([np.zeros(2), stops_m])
    away = np.sqrt(((places_m[:, None] - path) ** 2).sum(axis=2))
    added: Floats = away.copy()
    added[:, :-1] += away[:, 1:] - np.sqrt((np.diff(path, axis=0) ** 2).sum(axis=1))
    if problem.end_at is not None:
        end_m, asked_m_s = problem.end_at
        back = np.sqrt(((places_m - end_m) ** 2).sum(axis=1)) - np.hypot(*(path[-1] - end_m))
        added[:, -1] += back * problem.speed_m_s / top_speed_m_s(problem.flyer, asked_m_s)
    return added


def inserted(stops_m: Floats, places_m: Floats, positions: Ints) -> Floats:
    """Return (C, M + 1, 2) plans, each with one more stop."""
    count, stops = len(places_m), len(stops_m)
    old = np.arange(stops + 1) - (np.arange(stops + 1) > positions[:, None])
    padded = np.vstack([stops_m, np.zeros((1, 2))])
    found: Floats = padded[np.minimum(old, stops)]
    found[np.arange(count), positions] = places_m
    return found


def with_another(problem: TimeProblem, stops_m: Floats, places_m: Floats) -> Floats:
    """Return plans with one more stop, each place where it costs least way."""
    return inserted(stops_m, places_m, detours_m(problem, stops_m, places_m).argmin(axis=1))


def with_one_less(stops_m: Floats) -> Floats:
    """Return (M, M − 1, 2) plans, each without one of the stops."""
    return stops_m[_others(len(stops_m))]


def with_one_instead(problem: TimeProblem, stops_m: Floats, places_m: Floats) -> Floats:
    """Return plans in which a place takes the part of one of the two stops nearest to it, where it costs least way."""
    stops = len(stops_m)
    away = ((places_m[:, None] - stops_m) ** 2).sum(axis=2)
    nearest = np.argsort(away, axis=1, kind="stable")[:, :2]
    found = []
    for gone in np.unique(nearest):
        theirs = places_m[(nearest == gone).any(axis=1)]
        rest = stops_m[np.arange(stops) != gone]
        found.append(inserted(rest, theirs, detours_m(problem, rest, theirs).argmin(axis=1)))
    return np.concatenate(found)


def merged(stops_m: Floats) -> Floats:
    """Return (M − 1, M − 1, 2) plans, each with two stops in a row become one in their middle."""
    found = with_one_less(stops_m)[:-1]
    at = np.arange(len(found))
    found[at, at] = (stops_m[:-1] + stops_m[1:]) / 2
    return found


def reordered(problem: TimeProblem, stops_m: Floats) -> Floats:
    """Return plans in other orders: parts turned round or moved elsewhere, the shortest of them."""
    orders = _orders(len(stops_m))
    if not len(orders):
        return np.empty((0, len(stops_m), 2))
    plans = stops_m[orders]
    flight_s, now_s = problem.flight_s(plans), float(problem.flight_s(stops_m))
    if problem.in_flight:
        best = np.argsort(flight_s, kind="stable")[:ORDERS_IN_FLIGHT]
        best = best[flight_s[best] < now_s + LONGER_S]
    else:
        best = np.argsort(flight_s, kind="stable")[:ORDERS]
        best = best[flight_s[best] < now_s - 1e-9]
    return plans[best]


@lru_cache(maxsize=SIZES)
def _others(stops: int) -> Ints:
    """(M, M − 1) row i: all but i."""
    return np.array(
        [[k for k in range(stops) if k != gone] for gone in range(stops)], dtype=np.int64
    ).reshape(stops, stops - 1)


MOST_ORDERS = 6_000


@lru_cache(maxsize=SIZES)
def _orders(stops: int) -> Ints:
    """Return orders one move away: any part turned round, parts of up to three moved, turned or not."""
    base = list(range(stops))
    found: dict[tuple[int, ...], None] = {}
    reach = stops if stops**2 * 6 <= MOST_ORDERS else max(4, math.isqrt(MOST_ORDERS // 6))
    for i in range(stops):
        for j in range(i + 2, min(stops, i + reach) + 1):
            found[tuple(base[:i] + base[i:j][::-1] + base[j:])] = None
        for length in (1, 2, 3):
            part, rest = base[i : i + length], base[:i] + base[i + length :]
            if i + length > stops:
                continue
            for j in range(max(0, i - reach), min(len(rest), i + reach) + 1):
                for piece in (part, part[::-1]):
                    found[tuple(rest[:j] + piece + rest[j:])] = None
    found.pop(tuple(base), None)
    return np.array(list(found), dtype=np.int64).reshape(len(found), stops)
