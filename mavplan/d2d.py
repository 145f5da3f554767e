"""Who is whose D2D mate: pairs as given, or matched. Pure functions on arrays; rates are `mavplan.radio`'s."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mavplan.errors import InputError, Problem
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario.model import UNPAIRED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_EXACT_USERS = 500
"""In a larger group of users within each other's range, mutual nearest ones are paired instead of the best whole."""

MAX_LINKS = 5_000_000
"""More users within range of each other than this makes are refused: the list of their links would fill the memory."""

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
    beyond = distance_m > range_m + REACH_TOLERANCE_M
    for user, apart_m in zip(first[beyond], distance_m[beyond], strict=True):
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

    Raises
    ------
    InputError
        There are more than `MAX_LINKS` links within range.

    References
    ----------
    Z. Galil, "Efficient algorithms for finding maximum matching in graphs", ACM Computing Surveys 18, 1986,
    doi 10.1145/6462.6502, as in rustworkx.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    users = len(xy_m)
    mate = unpaired(users)
    if users < 2:
        return mate, ()
    tree = KDTree(xy_m)
    reach_m = range_m + REACH_TOLERANCE_M
    count = (int(tree.count_neighbors(tree, reach_m)) - users) // 2
    if count > MAX_LINKS:
        message = (
            f"{users:,} users make {count:,} links within {range_m:,.10g} m, more than the {MAX_LINKS:,} that can be "
            'matched: give the pairs (matching = "given") or a smaller range_m'
        )
        raise InputError([Problem('[d2d] matching = "auto"', message, "too-many-links")])
    links = tree.query_pairs(reach_m, output_type="ndarray").astype(np.int64)
    links = links[np.lexsort((links[:, 1], links[:, 0]))]
    distance_m = np.linalg.norm(xy_m[links[:, 0]] - xy_m[links[:, 1]], axis=1)
    linked = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(users, users))
    groups, group_of = connected_components(linked, directed=False)
    sizes = np.bincount(group_of, minlength=groups)
    is_large = sizes[group_of[links[:, 0]]] > MAX_EXACT_USERS
    _pair_best(mate, links[~is_large], distance_m[~is_large], group_of.astype(np.int64))
    _pair_shortest_first(mate, links[is_large], distance_m[is_large])
    return mate, tuple(_not_exact(int(size)) for size in sizes[sizes > MAX_EXACT_USERS])


def _not_exact(users: int) -> Problem:
    message = (
        f"{users:,} users are linked with one another, more than the {MAX_EXACT_USERS} that are "
        "matched exactly: mutual nearest users are paired"
    )
    return Problem('[d2d] matching = "auto"', message, "matching-not-exact", "warning")


def _pair_best(mate: Ints, links: Ints, distance_m: Floats, group_of: Ints) -> None:
    """Pair along the links of each group so that most users have a mate and, of those ways, the links are shortest."""
    import rustworkx as rx

    if len(links) == 0:
        return
    # Micrometres saved over a link longer than any: all positive, so that the matching may take or leave them freely.
    gain = np.rint((distance_m.max() + 1.0 - distance_m) * _STEPS_PER_M).astype(np.int64)
    group = group_of[links[:, 0]]
    order = np.argsort(group, kind="stable")
    for of_group in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        members, ends = np.unique(links[of_group], return_inverse=True)
        graph: rx.PyGraph[int, int] = rx.PyGraph(multigraph=False)
        graph.add_nodes_from(members.tolist())
        one, other = ends.reshape(-1, 2).T.tolist()
        graph.add_edges_from(list(zip(one, other, gain[of_group].tolist(), strict=True)))
        for a, b in rx.max_weight_matching(graph, max_cardinality=True, weight_fn=int):
            _pair(mate, members[a], members[b])


def _pair_shortest_first(mate: Ints, links: Ints, distance_m: Floats) -> None:
    """Pair along links from the shortest to the longest: what repeated pairing of mutual nearest users comes to."""
    for a, b in links[np.argsort(distance_m, kind="stable")]:
        if mate[a] == UNPAIRED and mate[b] == UNPAIRED:
            _pair(mate, a, b)


def _pair(mate: Ints, a: int, b: int) -> None:
    mate[a], mate[b] = b, a
