"""P1, section 3: the fewest stop points that reach all users, with its proof. The yardstick of the planners.

Geometric disc cover is NP-hard. Here it is set cover over finitely many candidates (`cover_candidates`), reduced,
cut into connected components, solved by local search (`cover_search`) and by HiGHS, and bounded (`cover_bound`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mavplan.planners.cover_bound import packing_bound, requirement_prices, strips_bound, whole
from mavplan.planners.cover_candidates import (
    CoverInstance,
    Requirements,
    cover_instance,
    reduce_instance,
    requirements_of,
)
from mavplan.planners.cover_search import exact_cover, greedy_cover, polish_cover, search_cover
from mavplan.scenario.model import Floats, Ints, Users

EASY_REQUIREMENTS = 150
"""Components up to this size go straight to HiGHS: it takes milliseconds."""

Progress = Callable[[int, int], None]
"""Called with the discs proved necessary and the discs of the best cover so far."""


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
    xy_m: Floats, radius_m: float, *, time_limit_s: float = 25.0, progress: Progress | None = None
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
        Called as the bound rises and the cover shrinks.

    Raises
    ------
    ValueError
        The radius is not a positive number, or a position is not finite.
    """
    return _fewest(requirements_of(xy_m), radius_m, time_limit_s, progress)


def minimum_pair_cover(
    users: Users, radius_m: float, *, time_limit_s: float = 25.0, progress: Progress | None = None
) -> Cover:
    """Return the fewest discs that reach each user or its mate; parameters as `minimum_cover`."""
    return _fewest(requirements_of(users.xy_m, users.mate), radius_m, time_limit_s, progress)


def _fewest(required: Requirements, radius_m: float, time_limit_s: float, progress: Progress | None) -> Cover:
    """Return the fewest discs for these requirements: reduced, cut into components, each solved and bounded."""
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise ValueError(f"the radius must be a positive number, not {radius_m!r}")
    if not np.isfinite(required.places_m).all():
        raise ValueError("a position is not finite")
    whole_instance = cover_instance(required, radius_m)
    instance = reduce_instance(whole_instance)
    parts = _components(instance)
    rng = np.random.default_rng(0)
    greedy = [greedy_cover(part.covers) for part in parts]
    sizes = [len(chosen) for chosen in greedy]
    bounds = [packing_bound(part.covers) for part in parts]
    stops: list[Floats] = []
    hard = sum(part.covers.shape[1] for part in parts if part.covers.shape[1] > EASY_REQUIREMENTS)
    for index, part in enumerate(parts):
        if progress is not None:
            progress(sum(bounds), sum(sizes))
        share = part.covers.shape[1] / hard if part.covers.shape[1] > EASY_REQUIREMENTS else 1.0
        chosen, bounds[index] = _solve_part(
            part, greedy[index], bounds[index], radius_m, share * time_limit_s, rng
        )
        sizes[index] = len(chosen)
        stops.append(part.centres_m[chosen])
    if progress is not None:
        progress(sum(bounds), sum(sizes))
    return Cover(
        stops_m=np.vstack(stops),
        bound=sum(bounds),
        candidates=len(whole_instance.centres_m),
        kept_candidates=len(instance.centres_m),
        kept_requirements=instance.covers.shape[1],
    )


def _solve_part(
    part: CoverInstance,
    start: Ints,
    bound: int,
    radius_m: float,
    time_limit_s: float,
    rng: np.random.Generator,
) -> tuple[Ints, int]:
    """Return a cover of one component and a bound of its size."""
    if len(start) == bound:
        return start, bound
    if part.covers.shape[1] <= EASY_REQUIREMENTS:
        found, proved = exact_cover(part.covers, time_limit_s=time_limit_s)
        if found is not None and len(found) <= len(start):
            start = found
        return start, min(max(bound, whole(proved)), len(start))
    chosen = search_cover(part.covers, start, bound, rng)
    chosen = polish_cover(part, chosen, radius_m, bound, rng)
    prices = requirement_prices(part.covers)
    bound = max(bound, whole(float(prices.sum())))
    if bound < len(chosen):
        bound = max(bound, whole(strips_bound(part, prices, time_limit_s)))
    return chosen, bound


def _components(instance: CoverInstance) -> list[CoverInstance]:
    """Return the instance cut where no candidate meets requirements of both sides."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    covers = instance.covers
    candidates = covers.shape[0]
    blocks: Any = [[None, covers], [covers.T, None]]
    both: Any = sparse.block_array(blocks).tocsr()
    count, label = connected_components(both, directed=False)
    parts = []
    for part in range(count):
        rows = np.flatnonzero(label[:candidates] == part)
        columns = np.flatnonzero(label[candidates:] == part)
        sub = covers[rows][:, columns].tocsr()
        sub.sort_indices()
        parts.append(CoverInstance(instance.centres_m[rows], sub))
    return parts
