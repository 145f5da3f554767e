"""Who is whose D2D mate: pairs as given, or matched. Pure functions on arrays; rates are `mavplan.radio`'s."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mavplan.errors import Problem
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario.model import UNPAIRED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_EXACT_USERS = 500
"""In a larger group of users within each other's range, mutual nearest ones are paired instead of the best whole."""

_STEPS_PER_M = 1e6
"""Distances are compared as whole micrometres: exact arithmetic in the matching, finer than any position."""


def unpaired(users: int) -> Ints:
    """Return the matching of ``users`` users that pairs nobody."""
    return np.full(users, UNPAIRED, dtype=np.int64)


def keep_pairs_in_range(
    xy_m: Floats, mate: Ints, range_m: float, names: Sequence[str] | None = None
) -> tuple[Ints, tuple[Problem, ...]]:
    """Unpair the given pairs whose members are further apart than the D2D range.

    Parameters
    ----------
    xy_m
        (N, 2) positions in metres.
    mate
        (N,) index of each user's mate or `UNPAIRED`.
    range_m
        The D2D range.
    names
        Names for the warnings; by default user-1, user-2 …

    Returns
    -------
    mate : (N,) array
        The pairs that are left.
    warnings
        One for each pair that was taken apart.
    """
    first = np.flatnonzero(np.arange(len(mate)) < mate)
    distance_m = np.linalg.norm(xy_m[first] - xy_m[mate[first]], axis=1)
    kept = mate.copy()
    warnings = []
    for user, apart_m in zip(first, distance_m, strict=True):
        if apart_m <= range_m + REACH_TOLERANCE_M:
            continue
        other = mate[user]
        kept[[user, other]] = UNPAIRED
        one, two = (names[i] if names is not None else f"user-{i + 1}" for i in (int(user), int(other)))
        message = (
            f"the pair {one} and {two} is {apart_m:,.1f} m apart, beyond the D2D range of {range_m:,.10g} m: "
            "both are planned for as users without a mate"
        )
        warnings.append(Problem("[d2d] range_m", message, "pair-beyond-range", "warning"))
    return kept, tuple(warnings)


def match_pairs(xy_m: Floats, range_m: float) -> tuple[Ints, tuple[Problem, ...]]:
    """Match users within the D2D range: the largest number of pairs, and of those the least total distance.

    Each connected group (users linked through others in range) is matched by itself. In a group of more than
    `MAX_EXACT_USERS` those two are paired who are each other's nearest among the users still free, again and again,
    and a warning says so.

    Parameters
    ----------
    xy_m
        (N, 2) positions in metres.
    range_m
        The D2D range; users exactly this far apart can be paired.

    Returns
    -------
    mate : (N,) array
        Index of each user's mate or `UNPAIRED`.
    warnings
        One for each group that was too large.

    References
    ----------
    Z. Galil, "Efficient algorithms for finding maximum matching in graphs", ACM Computing Surveys 18, 1986,
    doi 10.1145/6462.6502, as in rustworkx.
    """
    import rustworkx as rx
    from scipy.spatial import KDTree

    mate = unpaired(len(xy_m))
    if len(xy_m) < 2:
        return mate, ()
    links = KDTree(xy_m).query_pairs(range_m + REACH_TOLERANCE_M, output_type="ndarray")
    links = links[np.lexsort((links[:, 1], links[:, 0]))].astype(np.int64)
    distance_m = np.linalg.norm(xy_m[links[:, 0]] - xy_m[links[:, 1]], axis=1)
    # All weights positive: the more pairs the better, and of as many the ones with the shortest links.
    gain = np.rint((range_m + 1.0 - distance_m) * _STEPS_PER_M).astype(np.int64)
    graph: rx.PyGraph[int, int] = rx.PyGraph(multigraph=False)
    graph.add_nodes_from(range(len(xy_m)))
    graph.add_edges_from([(int(a), int(b), int(g)) for (a, b), g in zip(links, gain, strict=True)])
    warnings = []
    group_of = np.empty(len(xy_m), dtype=np.int64)
    large: list[int] = []
    for number, members in enumerate(rx.connected_components(graph)):
        users = sorted(members)
        group_of[users] = number
        if len(users) > MAX_EXACT_USERS:
            large.append(number)
            message = (
                f"{len(users):,} users are linked with one another, more than the {MAX_EXACT_USERS} that are "
                "matched exactly: mutual nearest users are paired"
            )
            warnings.append(Problem('[d2d] matching = "auto"', message, "matching-not-exact", "warning"))
        elif len(users) > 1:
            part = graph.subgraph(users)
            for a, b in rx.max_weight_matching(part, max_cardinality=True, weight_fn=int):
                _pair(mate, users[a], users[b])
    among_many = np.isin(group_of[links[:, 0]], large)
    _pair_shortest_first(mate, links[among_many], distance_m[among_many])
    return mate, tuple(warnings)


def _pair_shortest_first(mate: Ints, links: Ints, distance_m: Floats) -> None:
    """Pair along links from the shortest to the longest: what repeated pairing of mutual nearest users comes to."""
    for a, b in links[np.argsort(distance_m, kind="stable")]:
        if mate[a] == UNPAIRED and mate[b] == UNPAIRED:
            _pair(mate, a, b)


def _pair(mate: Ints, a: int, b: int) -> None:
    mate[a], mate[b] = b, a
