"""P1, section 3: the fewest stop points that reach all users, with its proof. The yardstick of the planners.

Geometric disc cover is NP-hard. Here it is set cover over finitely many candidates (`cover_candidates`), reduced,
cut into connected components, solved by local search (`cover_search`) and by HiGHS, and bounded (`cover_bound`).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mavplan.planners.cover_bound import (
    packing_bound,
    requirement_prices,
    strips_bound,
    whole,
)
from mavplan.planners.cover_candidates import (
    CoverInstance,
    Requirements,
    candidate_centres,
    cover_instance,
    reduce_instance,
    requirements_of,
)
from mavplan.planners.cover_search import exact_cover, greedy_cover, polish_cover, search_cover
from mavplan.scenario.model import Floats, Ints, Users

EASY_REQUIREMENTS = 150
EXACT_REQUIREMENTS = 600
"""Components up to the first size go straight to HiGHS, it takes milliseconds; up to the second it may succeed."""

PROMISING = 1.2
"""Candidates that large components are searched among, as a multiple of the requirements."""

MOST_WORK = 100_000_000
"""Squares of the places within 2R of each place, in sum: some ten seconds of candidates. Where there are more,
requirements are asked by and by, as they turn out to matter."""

ROUNDS = 6
"""Rounds of asking; each has an equal part of the time limit."""

Progress = Callable[[int, int], None]
"""Called with the number of discs proved necessary, and of those in the best cover so far."""


@dataclass(frozen=True, eq=False)
class Cover:
    """A cover by few discs, and how few it could be at best.

    Attributes
    ----------
    stops_m
        (M, 2) metres; each user (or pair) is within R of one of them, to the tolerance of `Channel.reaches`.
    bound
        Proved: with fewer discs than this it cannot be done.
    candidates, kept_candidates, kept_requirements
        Size of the set cover: disc centres before reduction, those left, and requirements left.
    """

    stops_m: Floats
    bound: int
    candidates: int
    kept_candidates: int
    kept_requirements: int

    @property
    def size(self) -> int:
        """Number of discs M."""
        return len(self.stops_m)

    @property
    def proved(self) -> bool:
        """Whether M is the minimum."""
        return self.size == self.bound


def minimum_cover(
    xy_m: Floats, radius_m: float, *, time_limit_s: float = 30.0, progress: Progress | None = None
) -> Cover:
    """Return the fewest discs that reach all users, centres anywhere: P1 of the paper.

    Parameters
    ----------
    xy_m
        (N, 2) users in metres.
    radius_m
        R, greater than 0.
    time_limit_s
        For proofs by HiGHS, in all. What is not proved by then shows as ``bound < size``.
    progress
        Called as the bound rises and the cover shrinks; where users stand too densely to consider all at once, bound
        and cover are those of the users considered, and begin anew when others join.

    Raises
    ------
    ValueError
        The radius is not a positive number, or a position is not finite.
    """
    return _fewest(requirements_of(xy_m), radius_m, time_limit_s, progress)


def minimum_pair_cover(
    users: Users, radius_m: float, *, time_limit_s: float = 30.0, progress: Progress | None = None
) -> Cover:
    """Return the fewest discs that reach each user or its mate; parameters as `minimum_cover`."""
    return _fewest(requirements_of(users.xy_m, users.mate), radius_m, time_limit_s, progress)


def _fewest(required: Requirements, radius_m: float, time_limit_s: float, progress: Progress | None) -> Cover:
    """Solve for some of the requirements, take in those that are left unmet, until none is or the proof fails.

    What some of them need at least, all of them do. Where users do not stand densely, "some" are all from the start.
    """
    if not (math.isfinite(radius_m) and radius_m > 0.0):
        raise ValueError(f"the radius must be a positive number of metres, not {radius_m}")
    if not np.isfinite(required.places_m).all():
        raise ValueError("positions must be finite")
    if not len(required):
        return Cover(np.zeros((0, 2)), 0, 0, 0, 0)
    asked = _first_asked(required, radius_m)
    rounds = 1 if len(asked) == len(required) else ROUNDS
    bound = 0
    for _ in range(rounds):
        part = required.part(asked)
        centres = candidate_centres(part.places_m, radius_m)
        instance = reduce_instance(cover_instance(part, centres, radius_m))
        chosen, proved = _solve(instance, radius_m, time_limit_s / rounds, progress)
        stops, bound = instance.centres_m[chosen], max(bound, proved)
        unmet = required.unmet(stops, radius_m)
        added = unmet[_spread(required, unmet, len(asked) // 2 + 1)]
        asked = np.concatenate((asked, added))
        if not len(unmet) or len(stops) > bound or _work(required.part(asked), radius_m) > MOST_WORK:
            break
    if len(unmet):
        above = required.places_m[required.choices[unmet, 0]]
        stops = _complete(required, np.vstack((instance.centres_m, above)), radius_m, bound)
    return Cover(stops, bound, len(centres), *instance.covers.shape)


def _work(required: Requirements, radius_m: float) -> int:
    """Return what finding and comparing the candidates takes: the square of each place's neighbours, in sum."""
    from scipy.spatial import KDTree

    places = required.places_m
    neighbours = KDTree(places).query_ball_point(places, 2 * radius_m, return_length=True)
    return int((np.asarray(neighbours, dtype=np.int64) ** 2).sum())


def _first_asked(required: Requirements, radius_m: float) -> Ints:
    """Return all requirements, or a number spread over the area such that room is left to take in others."""
    everything = np.arange(len(required))
    share = MOST_WORK / _work(required, radius_m)
    if share >= 1.0:
        return everything
    return _spread(required, everything, max(1, int(len(required) * share ** (1 / 3) / 2)))


def _complete(required: Requirements, centres_m: Floats, radius_m: float, bound: int) -> Floats:
    """Return stops that meet all requirements, few of these centres."""
    instance = reduce_instance(cover_instance(required, centres_m, radius_m))
    rng = np.random.default_rng(0)
    chosen = search_cover(instance.covers, greedy_cover(instance.covers), bound, rng)
    return instance.centres_m[polish_cover(instance, chosen, radius_m, bound, rng)]


def _spread(required: Requirements, among: Ints, count: int) -> Ints:
    """Return positions in ``among`` of at most ``count`` requirements, each furthest from those before it."""
    places = required.places_m[required.choices[among, 0]]
    taken: list[int] = []
    away = np.full(len(places), np.inf)
    while len(taken) < min(count, len(places)):
        taken.append(int(away.argmax()))
        away = np.minimum(away, ((places - places[taken[-1]]) ** 2).sum(axis=1))
    return np.array(taken, dtype=np.int64)


def _solve(
    instance: CoverInstance, radius_m: float, time_limit_s: float, progress: Progress | None
) -> tuple[Ints, int]:
    """Return a cover and its bound, the sums over the connected components; the small ones are solved first."""
    components = _components(instance)
    limit_s = time_limit_s / instance.covers.shape[1]
    steps = [
        _improvements(instance.part(*component), radius_m, limit_s * len(component[1]))
        for component in components
    ]
    found = [next(step) for step in steps]

    def tell() -> None:
        if progress is not None:
            progress(sum(bound for _, bound in found), sum(len(chosen) for chosen, _ in found))

    tell()
    for index, step in enumerate(steps):
        for better in step:
            found[index] = better
            tell()
    chosen = [candidates[own] for (candidates, _), (own, _) in zip(components, found, strict=True)]
    return np.concatenate(chosen), sum(bound for _, bound in found)


def _components(instance: CoverInstance) -> list[tuple[Ints, Ints]]:
    """Return candidates and requirements of each connected component, those with fewest requirements first."""
    from scipy import sparse
    from scipy.sparse import csgraph

    candidates = instance.covers.shape[0]
    blocks: Any = [[None, instance.covers], [instance.covers.T, None]]
    graph: Any = sparse.block_array(blocks)
    count, label = csgraph.connected_components(graph, directed=False)
    members = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label, minlength=count))[:-1])
    split = [(nodes[nodes < candidates], nodes[nodes >= candidates] - candidates) for nodes in members]
    return sorted(split, key=lambda component: len(component[1]))


def _improvements(
    instance: CoverInstance, radius_m: float, time_limit_s: float
) -> Iterator[tuple[Ints, int]]:
    """Yield better and better pairs of a cover and a bound for a connected instance, at least one."""
    covers = instance.covers
    chosen, bound = greedy_cover(covers), packing_bound(covers)
    yield chosen, bound
    requirements = covers.shape[1]
    if len(chosen) > bound and requirements > EASY_REQUIREMENTS:
        prices = requirement_prices(covers, time_limit_s)
        bound = max(bound, whole(float(prices.sum())))
        yield chosen, bound
        # Discs that the prices pay for nearly in full: small covers consist of these, and fewer are searched faster.
        by_price = np.argsort(-(covers @ prices), kind="stable")
        promising = np.union1d(
            by_price[: int(PROMISING * requirements)] if prices.any() else by_price, chosen
        )
        narrowed = instance.part(promising)
        rng = np.random.default_rng(0)
        found = search_cover(narrowed.covers, np.searchsorted(promising, chosen), bound, rng)
        yield promising[found], bound
        found = polish_cover(narrowed, found, radius_m, bound, rng)
        chosen = promising[found]
        yield chosen, bound
        if len(chosen) > bound and requirements > EXACT_REQUIREMENTS:
            yield chosen, max(bound, whole(strips_bound(instance, prices, time_limit_s)))
            return
    if len(chosen) > bound:
        exact, least = exact_cover(covers, time_limit_s=time_limit_s)
        if exact is not None and len(exact) < len(chosen):
            chosen = exact
        yield chosen, max(bound, whole(least))
