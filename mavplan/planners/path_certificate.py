"""From a search to a proof: the branches that matter, and few, short leaves with their dual vectors.

What the search pruned is solved once more, each sequence made as short as the bound allows; one leaf then serves all
sequences that contain its own. Where a search was cut off with too much to write down, the proof is of a smaller bound.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mavplan.bounds.path import Branch, Leaf, PathCertificate
from mavplan.planners.path_bound import PathBound
from mavplan.planners.path_problem import PathProblem
from mavplan.planners.path_search import PRUNED, Node, Sequence
from mavplan.planners.touring import dual_bound_m, tour_discs, turns_of
from mavplan.progress import Progress
from mavplan.scenario.model import UNPAIRED, Floats, Ints

MOST_CASES = 30_000
"""Sequences to be proved by leaves: some five seconds, and a megabyte or two."""

AT_ONCE = 256
"""Sequences that are made short together, before it is seen which others their leaves serve."""

SPARE = 1e-5
"""Share by which a leaf is solved beyond the bound, so that its vectors may be rounded."""

LIGHT = (0.3, 0.1, 0.03, 0.01)
"""Multipliers (at most 2) below which a leaf's discs are left out together, if the bound stands it."""

TRIED = 2
"""Discs, the lightest, that are left out of each leaf one after the other, and what is left solved anew."""

DIGITS = (4, 6, 9, 12)
"""Decimals of a leaf's vectors; the fewest that keep the bound are taken."""


def path_certificate(
    found: PathBound,
    users_xy_m: Floats,
    mate: Ints,
    most_cases: int = MOST_CASES,
    progress: Progress | None = None,
) -> PathCertificate:
    """Return a proof of the bound that was found, or of a smaller one where that would take too many cases.

    Parameters
    ----------
    users_xy_m, mate
        (N, 2) users in metres from home and (N,) their mates or `UNPAIRED`, as they were searched for.
    most_cases
        Sequences that a proof may have to prove by leaves.
    progress
        Called with the cases done and their number.
    """
    problem, nodes = found.problem, found.nodes
    if not nodes:
        return PathCertificate(problem.returns, (), ())
    bound_m = _provable_m(found, most_cases)
    kept = _branches(nodes, bound_m)
    if not kept:
        return PathCertificate(problem.returns, (), ())
    at = {index: position for position, index in enumerate(kept)}
    names = _Names(problem, users_xy_m, mate)
    cases = {case.sequence for index in kept for case in _cases(problem, nodes, index) if case.node not in at}
    leaves = _Leaves(problem, bound_m)
    leaves.prove(sorted(cases, key=lambda sequence: (len(sequence), sequence)), progress)
    branches = []
    for index in kept:
        children = []
        for case in _cases(problem, nodes, index):
            leaf = None if case.node in at else leaves.find(case.sequence)
            children.append(at[case.node] if leaf is None else -1 - leaf)
        branches.append(
            Branch(
                names.sequence(nodes[index].sequence), names.user(nodes[index].requirement), tuple(children)
            )
        )
    return PathCertificate(
        problem.returns,
        tuple(branches),
        tuple(Leaf(names.sequence(sequence), duals) for sequence, duals in leaves.found()),
    )


@dataclass(frozen=True, slots=True)
class _Case:
    """A child of a branch: its own sequence, or that of the node it refers to; `PRUNED` where there is none."""

    sequence: Sequence
    node: int


def _cases(problem: PathProblem, nodes: tuple[Node, ...], index: int) -> Iterator[_Case]:
    """Yield the children of a node in the order of the certificate."""
    node = nodes[index]
    assert node.children is not None
    positions = len(node.sequence) + 1
    places = list(dict.fromkeys(problem.required.choices[node.requirement].tolist()))
    for slot, child in enumerate(node.children):
        position = slot % positions
        if child == PRUNED:
            yield _Case(
                (*node.sequence[:position], places[slot // positions], *node.sequence[position:]), PRUNED
            )
        else:
            yield _Case(nodes[child].sequence, child)


def _branches(nodes: tuple[Node, ...], bound_m: float) -> list[int]:
    """Return the nodes that a proof of this bound branches on, each before those that it refers to."""
    waiting, kept = [0], {0}
    if nodes[0].children is None or nodes[0].bound_m >= bound_m:
        return []
    while waiting:
        for child in nodes[waiting.pop()].children or ():
            if (
                child != PRUNED
                and child not in kept
                and nodes[child].children is not None
                and nodes[child].bound_m < bound_m
            ):
                kept.add(child)
                waiting.append(child)
    return sorted(kept, key=lambda index: (nodes[index].bound_m, index))


def _provable_m(found: PathBound, most_cases: int) -> float:
    """Return the greatest bound, up to the one found, whose proof has at most so many cases."""
    nodes = found.nodes

    def size(bound_m: float) -> int:
        return sum(len(nodes[index].children or ()) for index in _branches(nodes, bound_m))

    if size(found.bound_m) <= most_cases:
        return found.bound_m
    levels = sorted({node.bound_m for node in nodes if node.bound_m < found.bound_m})
    low, high = 0, len(levels)  # levels[low] is provable, levels[high] is not or is too much
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if size(levels[middle]) <= most_cases else (low, middle)
    return levels[low]


class _Names:
    """Users for places, and for requirements the user with whose place they begin."""

    def __init__(self, problem: PathProblem, users_xy_m: Floats, mate: Ints) -> None:
        self._choices = problem.required.choices
        mates = np.where(mate == UNPAIRED, np.arange(len(mate)), mate)
        places = [place.tobytes() for place in users_xy_m]
        self._at = [place.tobytes() for place in problem.required.places_m]
        self._by_place: dict[bytes, int] = {}
        self._by_pair: dict[tuple[bytes, bytes], int] = {}
        for user, other in enumerate(mates.tolist()):
            self._by_place.setdefault(places[user], user)
            self._by_pair.setdefault((places[user], places[other]), user)

    def sequence(self, places: Sequence) -> tuple[int, ...]:
        """Return a user at each place."""
        return tuple(self._by_place[self._at[place]] for place in places)

    def user(self, requirement: int) -> int:
        """Return the user at the first of a requirement's places whose mate is at the other."""
        one, other = self._choices[requirement].tolist()
        return self._by_pair[self._at[one], self._at[other]]


class _Leaves:
    """Short sequences whose discs cannot be touched in order on a way shorter than the bound."""

    def __init__(self, problem: PathProblem, bound_m: float) -> None:
        self._problem, self._bound_m = problem, bound_m
        self._cutoff_m = bound_m * (1.0 + SPARE)
        self._sequences: list[Sequence] = []
        self._beginnings: dict[int, Any] = {}

    def prove(self, cases: list[Sequence], progress: Progress | None) -> None:
        """Make leaves until each case contains one."""
        open_: list[Sequence] = []
        for number, case in enumerate(cases, start=1):
            if self.find(case) is None:
                open_.append(case)
            if len(open_) == AT_ONCE or number == len(cases):
                for sequence in self._shortened(open_):
                    if self.find(sequence) is None:
                        self._append(sequence)
                open_ = []
                if progress is not None:
                    progress(number, len(cases))

    def find(self, case: Sequence) -> int | None:
        """Return a leaf that a case contains."""
        found = _part_of(case, 0, self._beginnings)
        if found is None and self._problem.returns:
            found = _part_of(case[::-1], 0, self._beginnings)
        return found

    def _append(self, sequence: Sequence) -> None:
        """Take in a leaf: its places lead from the table of first places to one of second places and so on to it."""
        here = self._beginnings
        for place in sequence[:-1]:
            here = here.setdefault(place, {})
        here[sequence[-1]] = len(self._sequences)
        self._sequences.append(sequence)

    def found(self) -> Iterator[tuple[Sequence, Floats]]:
        """Yield each leaf with vectors that prove it, rounded to few decimals."""
        for sequence, duals in zip(self._sequences, self._solve(self._sequences)[1], strict=True):
            for digits in DIGITS:
                rounded = _rounded(duals, digits)
                if self._bound_of(sequence, rounded) >= self._bound_m:
                    break
            yield sequence, rounded

    def _shortened(self, cases: list[Sequence]) -> list[Sequence]:
        """Return for each case a part of it that has the bound, short ones first."""
        parts, light = [], []
        for case, duals in zip(cases, self._solve(cases)[1], strict=True):
            weights = np.linalg.norm(turns_of(duals, len(case)), axis=1)
            part = self._without_light(case, duals, weights)
            parts.append(part)
            light.append([case[at] for at in np.argsort(weights, kind="stable") if case[at] in part][:TRIED])
        for turn in range(TRIED):
            trying = [index for index, part in enumerate(parts) if len(part) > 1 and turn < len(light[index])]
            shorter = [
                tuple(place for place in parts[index] if place != light[index][turn]) for index in trying
            ]
            for index, sequence, bound_m in zip(
                trying, shorter, self._solve(shorter, loose=1.0)[0], strict=True
            ):
                if bound_m >= self._cutoff_m:
                    parts[index] = sequence
        return sorted(parts, key=lambda sequence: (len(sequence), sequence))

    def _without_light(self, case: Sequence, duals: Floats, weights: Floats) -> Sequence:
        """Return as few discs of a case as prove the bound with the vectors it has."""
        for least in LIGHT:
            kept = np.flatnonzero(weights > least)
            if 0 < len(kept) < len(case):
                part = tuple(case[at] for at in kept)
                legs = np.append(kept, len(case)) if self._problem.end_m is not None else kept
                if self._bound_of(part, duals[legs]) >= self._cutoff_m:
                    return part
        return case

    def _solve(
        self, sequences: list[Sequence], loose: float | None = None
    ) -> tuple[list[float], list[Floats]]:
        """Return bound and vectors of each sequence, no better than what is asked for; see `tour_discs`."""
        problem = self._problem
        bounds_m, duals = [0.0] * len(sequences), [np.empty((0, 2))] * len(sequences)
        by_length: dict[int, list[int]] = {}
        for index, sequence in enumerate(sequences):
            by_length.setdefault(len(sequence), []).append(index)
        for group in by_length.values():
            centres = problem.required.places_m[np.array([sequences[index] for index in group])]
            tours = tour_discs(
                centres,
                problem.radius_m,
                problem.start_m,
                problem.end_m,
                cutoff_m=self._cutoff_m,
                precision=1e-8,
            )
            for row, index in enumerate(group):
                bounds_m[index], duals[index] = float(tours.bound_m[row]), tours.duals[row]
        return bounds_m, duals

    def _bound_of(self, sequence: Sequence, duals: Floats) -> float:
        problem = self._problem
        duals = duals / np.maximum(np.linalg.norm(duals, axis=1, keepdims=True), 1.0)
        centres = problem.required.places_m[list(sequence)]
        return dual_bound_m(centres, problem.radius_m, problem.start_m, problem.end_m, duals)


def _rounded(duals: Floats, digits: int) -> Floats:
    """Return vectors with few decimals; those of length 1 come out a little longer, to be scaled back."""
    unit = 10.0**-digits
    length = np.linalg.norm(duals, axis=1, keepdims=True)
    full = length > 1.0 - 5.0 * unit
    found: Floats = np.rint(np.where(full, duals / length * (1.0 + unit), duals) / unit) / 10.0**digits
    return found


def _part_of(case: Sequence, first: int, tables: dict[int, Any]) -> int | None:
    """Return a leaf whose places, from those tables on, come one after the other in the case from ``first`` on."""
    for at in range(first, len(case)):
        onward = tables.get(case[at])
        if isinstance(onward, dict):
            onward = _part_of(case, at + 1, onward)
        if onward is not None:
            return int(onward)
    return None
