"""Disc centres worth a try for the fewest discs that cover all users, as a set-cover instance made small.

A disc that reaches a set of users can be moved, reaching them still, until two of them lie on its rim or it stands
on one. So users and crossings of circles round users are centres enough; what is covered by fewer is left out here.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.planners.geometry import nearest_of
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

CIRCLE_SLACK_M = REACH_TOLERANCE_M / 4
"""Circles are drawn this much wider than R, so users exactly 2R apart have one disc in common however they round."""

COVER_SLACK_M = REACH_TOLERANCE_M / 2
"""A candidate covers a user this far beyond R; the other half of the tolerance is for whoever measures it again."""

COMPARED_OUTRIGHT = 600
"""Sets up to which all are compared with one another."""

COMPARED_AT_ONCE = 4_000_000
"""Pairs of sets compared at once; bounds the memory."""


@dataclass(frozen=True, eq=False)
class CoverInstance:
    """A set cover: choose the fewest candidates such that each requirement is met by one of them.

    Attributes
    ----------
    centres_m
        (C, 2) candidate disc centres.
    covers
        (C, Q) sparse 0/1 matrix: candidate meets requirement.
    """

    centres_m: Floats
    covers: "csr_array"

    def part(self, candidates: Ints, requirements: Ints | None = None) -> "CoverInstance":
        """Return the instance of these candidates and requirements alone; all requirements where None."""
        covers = self.covers[candidates]
        if requirements is not None:
            covers = covers[:, requirements]
        covers.sort_indices()
        return CoverInstance(self.centres_m[candidates], covers)


@dataclass(frozen=True, eq=False)
class Requirements:
    """What has to be reached: each requirement is met by a disc that reaches any of its places.

    Attributes
    ----------
    places_m
        (P, 2) distinct positions.
    choices
        (Q, 2) indices of places; twice the same where there is only one.
    """

    places_m: Floats
    choices: Ints

    def __len__(self) -> int:
        """Return the number of requirements."""
        return len(self.choices)

    def part(self, chosen: Ints) -> "Requirements":
        """Return these requirements alone, with the places that they need."""
        kept, choices = np.unique(self.choices[chosen], return_inverse=True)
        return Requirements(self.places_m[kept], choices.reshape(-1, 2))

    def unmet(self, stops_m: Floats, radius_m: float) -> Ints:
        """Return the requirements that discs round these stops leave unmet."""
        reached = nearest_of(self.places_m, stops_m)[0] <= radius_m + COVER_SLACK_M
        return np.flatnonzero(~reached[self.choices].any(axis=1))


def requirements_of(xy_m: Floats, mate: Ints | None = None) -> Requirements:
    """Return one requirement for each distinct place, or, with ``mate``, for each pair and each single user.

    Equal ones are there once.
    """
    places, at = np.unique(xy_m, axis=0, return_inverse=True)
    at = at.reshape(-1)
    other = at if mate is None else np.where(mate == UNPAIRED, at, at[mate])
    choices = np.unique(np.sort(np.column_stack((at, other)), axis=1), axis=0)
    return Requirements(places, choices)


def candidate_centres(places_m: Floats, radius_m: float) -> Floats:
    """Return centres (C, 2) among which, for every disc of this radius, one reaches all that the disc reaches.

    On the circle round a place each neighbour within 2R is in reach along one arc. What is in reach changes only
    where an arc begins or ends, and it is greatest where the next event after a beginning is an end: only these
    crossings are returned, and places without neighbours.

    Parameters
    ----------
    places_m
        (P, 2) distinct positions.
    """
    from scipy.spatial import KDTree

    circle_m = radius_m + CIRCLE_SLACK_M
    pairs = KDTree(places_m).query_pairs(2 * circle_m, output_type="ndarray")
    centre = np.concatenate((pairs[:, 0], pairs[:, 1]))
    neighbour = np.concatenate((pairs[:, 1], pairs[:, 0]))
    offset = places_m[neighbour] - places_m[centre]
    towards_rad = np.arctan2(offset[:, 1], offset[:, 0])
    half_rad = np.arccos(np.minimum(np.hypot(offset[:, 0], offset[:, 1]) / (2 * circle_m), 1.0))
    # Arcs begin a little early: one that begins where another ends overlaps it, whichever way the angles round.
    early_rad = CIRCLE_SLACK_M / (2 * circle_m)
    angle_rad = np.concatenate((towards_rad - half_rad - early_rad, towards_rad + half_rad)) % math.tau
    is_end = np.repeat([False, True], len(centre))
    circle = np.concatenate((centre, centre))
    in_order = np.lexsort((is_end, angle_rad, circle))
    angle_rad, is_end, circle = angle_rad[in_order], is_end[in_order], circle[in_order]

    events = np.bincount(circle, minlength=len(places_m))
    first = np.cumsum(events) - events
    previous = np.arange(len(circle)) - 1
    crossed = events > 0
    previous[first[crossed]] = (first + events - 1)[crossed]
    kept = is_end & ~is_end[previous]
    direction = np.column_stack((np.cos(angle_rad[kept]), np.sin(angle_rad[kept])))
    return np.vstack((places_m[~crossed], places_m[circle[kept]] + circle_m * direction))


def cover_instance(required: Requirements, centres_m: Floats, radius_m: float) -> CoverInstance:
    """Return which requirements discs round these centres (C, 2) meet."""
    from scipy import sparse
    from scipy.spatial import KDTree

    places = required.places_m
    reached: Any = KDTree(places).query_ball_point(centres_m, radius_m + COVER_SLACK_M)
    counts = np.array([len(near) for near in reached])
    indices = np.concatenate([np.asarray(near, dtype=np.int64) for near in reached])
    starts = np.concatenate(([0], np.cumsum(counts)))
    reaches = sparse.csr_array((np.ones(len(indices)), indices, starts), shape=(len(centres_m), len(places)))
    row = np.arange(len(required))
    one, other = required.choices[:, 0], required.choices[:, 1]
    belongs = sparse.csr_array(
        (np.ones(2 * len(required)), (np.concatenate((one, other)), np.concatenate((row, row)))),
        shape=(len(places), len(required)),
    )
    covers = sparse.csr_array(reaches @ belongs)
    covers.data[:] = 1.0
    covers.sort_indices()
    return CoverInstance(centres_m, covers)


def reduce_instance(instance: CoverInstance) -> CoverInstance:
    """Return an instance with the same minimum, and covers that are covers of the given one.

    A candidate whose requirements another meets too is left out, and so is a requirement that is met wherever
    another one is; each makes room for the other, until nothing changes.
    """
    centres, covers = instance.centres_m, instance.covers
    while True:
        before = covers.shape
        kept = distinct_rows(covers)
        kept = kept[np.diff(covers.indptr)[kept] > 0]
        kept = kept[~inclusions(covers[kept])[0]]
        centres, needs = centres[kept], covers[kept].T.tocsr()
        kept = distinct_rows(needs)
        kept = kept[~inclusions(needs[kept])[1]]
        covers = needs[kept].T.tocsr()
        covers.sort_indices()
        if covers.shape == before:
            return CoverInstance(centres, covers)


def distinct_rows(sets: "csr_array") -> Ints:
    """Return the index of the first of each group of equal rows of a 0/1 matrix with sorted indices, ascending."""
    # Two independent 64-bit sums: that unequal rows agree in both is out of the question.
    rng = np.random.default_rng(0)
    signature = np.zeros((sets.shape[0], 2), dtype=np.uint64)
    filled = np.flatnonzero(np.diff(sets.indptr))
    for column in range(2):
        weight = rng.integers(0, 2**63, sets.shape[1], dtype=np.uint64)
        if len(filled):
            signature[filled, column] = np.add.reduceat(weight[sets.indices], sets.indptr[filled])
    return np.sort(np.unique(signature, axis=0, return_index=True)[1])


def inclusions(sets: "csr_array") -> tuple[Bools, Bools]:
    """Return which rows of a 0/1 matrix are properly included in another row, and which properly include another.

    Rows are sets of column indices, none empty, no two equal. Few are all compared with one another. Whoever includes
    a set includes its rarest element, so of many each is compared with the sets that hold that one only.
    """
    size = np.diff(sets.indptr)
    if len(size) <= COMPARED_OUTRIGHT and sets.shape[0] * sets.shape[1] <= COMPARED_AT_ONCE:
        dense = sets.toarray()
        inside = (dense @ dense.T == size) & (size[:, None] > size)
        return inside.any(axis=0), inside.any(axis=1)
    holders = sets.T.tocsr()
    frequency = np.diff(holders.indptr)
    by_rarity = np.lexsort((frequency[sets.indices], np.repeat(np.arange(len(size)), size)))
    rarest = sets.indices[by_rarity][sets.indptr[:-1]]
    grouped = np.argsort(rarest, kind="stable")
    ends = np.cumsum(np.bincount(rarest, minlength=sets.shape[1]))
    included, including = np.zeros(len(size), dtype=bool), np.zeros(len(size), dtype=bool)
    for element in np.unique(rarest):
        start = ends[element - 1] if element else 0
        large = holders.indices[holders.indptr[element] : holders.indptr[element + 1]]
        at_once = max(1, COMPARED_AT_ONCE // len(large))
        for chunk in range(start, ends[element], at_once):
            small = grouped[chunk : min(chunk + at_once, ends[element])]
            shared = sets[large] @ sets[small].toarray().T
            inside = (shared == size[small]) & (size[large, None] > size[small])
            included[small] |= inside.any(axis=0)
            including[large] |= inside.any(axis=1)
    return included, including
