"""A path without proof, by insertion: whoever is farthest away is put in where the detour is least.

Only a stretch of the path round each insertion is toured anew, so that thousands of users take seconds. What has been
put together is made shorter by taking some of it out again and putting it in otherwise (P. Shaw, "Using constraint
programming and local search methods to solve vehicle routing problems", CP98, 1998, doi 10.1007/3-540-49481-2_30).
"""

import numpy as np

from mavplan.planners.path_edit import EditablePath
from mavplan.planners.path_problem import FoundPath, PathProblem
from mavplan.planners.touring import tour_discs
from mavplan.scenario.model import Floats, Ints

STRETCH = 4
"""Discs on each side of an insertion that are toured anew with it."""

APART = 4.0
"""Users put in before distances are measured again are this many radii apart."""

PRECISION = 1e-4
"""Of the tours of stretches."""

EXACT = 1e-8
ROUNDS = 6
"""Tours of the whole path, each without the discs that the last one did not need."""

NEEDLESS = 1e-3
"""Multiplier (at most 2) up to which a disc is not needed."""

PROMISING = 1.01
"""A path put together again is toured exactly if it is no longer than this, as a multiple of the best one."""

TAKEN_OUT = (2, 9)
"""Discs taken out at once, from the first number to before the second."""


def inserted_path(problem: PathProblem) -> FoundPath:
    """Return a path that meets all requirements."""
    path = EditablePath(problem)
    complete(path)
    return polished(path)


def reinserted(problem: PathProblem, best: FoundPath, rng: np.random.Generator) -> FoundPath:
    """Return a path at least as short: discs near each other are taken out, and what is not met then put in again."""
    path = EditablePath(problem, best)
    middle = path.points_m[rng.integers(len(path.points_m))]
    near = np.argsort(np.linalg.norm(path.points_m - middle, axis=1), kind="stable")
    for at in -np.sort(-near[: rng.integers(*TAKEN_OUT)]):
        path.replace(at, at + 1, (), np.empty((0, 2)))
    complete(path, rng)
    found = polished(path) if path.length_m < PROMISING * best.length_m else best
    return min(best, found, key=lambda one: one.length_m)


def complete(path: EditablePath, rng: np.random.Generator | None = None) -> None:
    """Put in whoever is not met, until everybody is; the farthest first, or in an order that is drawn."""
    problem = path.problem
    while len(unmet := path.unmet()):
        if rng is None:
            away = problem.part_away_m(unmet, path.points_m)
            unmet = unmet[np.argsort(-away, kind="stable")]
        else:
            unmet = rng.permutation(unmet)
        for requirement in _spread(problem, unmet):
            if not path.times[requirement]:
                _insert(path, requirement)


def polished(path: EditablePath) -> FoundPath:
    """Return a complete path exactly toured, without needless discs."""
    best = path.found()
    for _ in range(ROUNDS):
        needed = path.tour(0, len(path.sequence), EXACT) > NEEDLESS
        sequence = tuple(place for place, kept in zip(path.sequence, needed, strict=True) if kept)
        if not needed.all():
            path.replace(0, len(path.sequence), sequence, path.points_m[needed])
        whole = not len(path.unmet())
        complete(path)
        if path.length_m < best.length_m:
            best = path.found()
        if whole and needed.all():
            break
    return best


def _spread(problem: PathProblem, requirements: Ints) -> list[int]:
    """Return the first of these requirements and, in turn, those that are far from all before."""
    required = problem.required
    places = required.places_m[required.choices[requirements, 0]]
    open_ = np.arange(len(requirements))
    taken: list[int] = []
    while len(open_):
        first = open_[0]
        taken.append(int(requirements[first]))
        away = np.linalg.norm(places[open_] - places[first], axis=1)
        open_ = open_[away > APART * problem.radius_m]
    return taken


def _insert(path: EditablePath, requirement: int) -> None:
    """Put in a place of a requirement where that makes the path longer by least, and tour the stretch round it."""
    problem, line = path.problem, path.path_m
    best: tuple[float, int, int] | None = None
    for place in dict.fromkeys(problem.required.choices[requirement].tolist()):
        centre = problem.required.places_m[place]
        detours = _detours(line, centre, problem.radius_m, problem.end_m is None)
        at = int(detours.argmin())
        if best is None or detours[at] < best[0]:
            best = float(detours[at]), place, at
    assert best is not None
    _, place, at = best
    first, last = max(0, at - STRETCH), min(len(path.sequence), at + STRETCH)
    sequence = (*path.sequence[first:at], place, *path.sequence[at:last])
    end = line[last + 1] if last + 1 < len(line) else None
    centres = problem.required.places_m[list(sequence)]
    tours = tour_discs(centres[None], problem.radius_m, line[first], end, precision=PRECISION)
    path.replace(first, last, sequence, tours.points_m[0])


def _detours(path_m: Floats, centre_m: Floats, radius_m: float, open_end: bool) -> Floats:
    """Return how much longer each leg becomes on its way by a disc, touched nearly where that is least.

    With an open end the last row is the way on from the end.
    """
    begin, end = path_m[:-1], path_m[1:]
    if open_end:
        begin, end = path_m, np.vstack([path_m[1:], path_m[-1:]])
    along = end - begin
    squared = (along**2).sum(axis=1)
    share = ((centre_m - begin) * along).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
    foot = begin + np.clip(share, 0.0, 1.0)[:, None] * along
    away = np.linalg.norm(centre_m - foot, axis=1)
    inwards = (centre_m - foot) / np.maximum(away, np.finfo(float).tiny)[:, None]
    touched = foot + np.maximum(away - radius_m, 0.0)[:, None] * inwards
    detours = (
        np.linalg.norm(touched - begin, axis=1) + np.linalg.norm(touched - end, axis=1) - np.sqrt(squared)
    )
    if open_end:
        detours[-1] /= 2.0
    return np.asarray(detours)
