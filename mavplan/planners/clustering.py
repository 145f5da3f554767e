"""The clustering phase: K-means with the paper's improved start, and how many clusters are worth a try."""

import heapq
import math

import numpy as np

from mavplan.errors import Problem
from mavplan.scenario.model import Floats, Users

REDRAWS = 10
"""Draws of a whole start before its spacing shrinks by a tenth."""

SHRINKS = 60
"""After this many shrinks (0.2 % of the first spacing left) any distinct places do."""

MOST_CLUSTER_NUMBERS = 30
"""``auto`` tries at most this many values of K."""


def to_places(xy_m: Floats) -> Floats:
    """Return positions to the millimetre: closer together is one place, which K-means could not tell apart either."""
    return np.round(xy_m, 3)


def distinct_places(users: Users) -> int:
    """Return the number of different places."""
    return len(np.unique(to_places(users.xy_m), axis=0))


def clip_clusters(users: Users, clusters: int) -> tuple[int, tuple[Problem, ...]]:
    """Return K clipped to the number of distinct places, and a warning where that changed it."""
    places = distinct_places(users)
    if clusters <= places:
        return clusters, ()
    message = f"{clusters} clusters asked for, but the users stand at {places} distinct places: {places} used"
    return places, (Problem("[planner] clusters", message, "clusters-clipped", "warning"),)


def start_spacing_m(xy_m: Floats, clusters: int) -> float:
    """Return d_γ = sqrt(A_c/(π·K)), A_c the bounding box of the users.

    The formula is lost in our copy of the paper; this one, the radius of a disc of area A_c/K, is assumed.
    """
    width, height = np.ptp(xy_m, axis=0)
    return math.sqrt(width * height / (math.pi * clusters))


def spread_start(xy_m: Floats, clusters: int, rng: np.random.Generator) -> Floats:
    """Draw K users as initial centres, every two of them at least d_γ apart (section 4, improved start).

    Where no user satisfies the distance any more the whole start is drawn again, and after `REDRAWS` draws the
    distance shrinks by a tenth. K must not exceed the number of distinct places.

    Returns
    -------
    (K, 2) metres.
    """
    spacing_m = start_spacing_m(xy_m, clusters)
    for _ in range(SHRINKS):
        for _ in range(REDRAWS):
            centres = _draw(xy_m, clusters, spacing_m, rng)
            if len(centres) == clusters:
                return centres
        spacing_m *= 0.9
    return _draw(xy_m, clusters, 0.0, rng)


def _draw(xy_m: Floats, clusters: int, spacing_m: float, rng: np.random.Generator) -> Floats:
    """Draw users one after another until K stand apart or none is left."""
    allowed = np.arange(len(xy_m))
    drawn: list[Floats] = []
    while len(drawn) < clusters and len(allowed):
        chosen = xy_m[rng.choice(allowed)]
        drawn.append(chosen)
        apart_m = np.linalg.norm(xy_m[allowed] - chosen, axis=1)
        allowed = allowed[(apart_m >= spacing_m) & (apart_m > 0)]
    return np.array(drawn)


def cluster_centres(xy_m: Floats, clusters: int, rng: np.random.Generator) -> Floats:
    """Return the K centres of K-means with the sum of squared errors (6)(7), from the improved start.

    Returns
    -------
    (K, 2) metres: the initial stop points, of positions to the millimetre.
    """
    from sklearn.cluster import KMeans

    places = to_places(xy_m)
    start = spread_start(places, clusters, rng)
    fitted = KMeans(n_clusters=clusters, init=start, n_init=1, tol=0.0).fit(places)
    return np.asarray(fitted.cluster_centers_, dtype=np.float64)


def greedy_cover_size(xy_m: Floats, radius_m: float) -> int:
    """Return how many discs round users a greedy cover takes: always the one that holds most uncovered users.

    Lazy: a disc's count only falls, so one that is still the greatest when counted again is the greatest of all.
    """
    from scipy.spatial import KDTree

    tree = KDTree(xy_m)
    counts = np.asarray(tree.query_ball_point(xy_m, radius_m, return_length=True))
    waiting = [(-int(count), user) for user, count in enumerate(counts)]
    heapq.heapify(waiting)
    uncovered = np.ones(len(xy_m), dtype=bool)
    left, discs = len(xy_m), 0
    while left:
        _, user = heapq.heappop(waiting)
        within = np.asarray(tree.query_ball_point(xy_m[user], radius_m), dtype=np.int64)
        fresh = within[uncovered[within]]
        if waiting and (-len(fresh), user) > waiting[0]:
            heapq.heappush(waiting, (-len(fresh), user))
            continue
        uncovered[fresh] = False
        left -= len(fresh)
        discs += 1
    return discs


def candidate_clusters(users: Users, radius_m: float) -> list[int]:
    """Return the values of K that ``auto`` tries: 1 to min(distinct places, 2·M + 2), at most 30, evenly spread.

    M is the number of discs of a greedy cover.
    """
    most = min(distinct_places(users), 2 * greedy_cover_size(users.xy_m, radius_m) + 2)
    spread = np.linspace(1, most, min(most, MOST_CLUSTER_NUMBERS))
    return [int(k) for k in np.unique(np.rint(spread))]
