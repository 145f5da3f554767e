"""A path made shorter by windows: stretches of it, each searched to proof with its ends fixed, until none gets shorter.

A window has to meet what the rest of the path does not.
"""

from collections.abc import Callable

import numpy as np

from mavplan.planners.path_edit import EditablePath, path_length_m
from mavplan.planners.path_problem import FoundPath, PathProblem
from mavplan.planners.path_search import GAP, PathSearch

DISCS = 9
"""Of a window."""

NODES = 600
"""Of the search in a window."""


def shortened(problem: PathProblem, found: FoundPath, keep_going: Callable[[FoundPath], bool]) -> FoundPath:
    """Return a path that no window makes shorter, or what there is when ``keep_going``, given the path, says so."""
    path = EditablePath(problem, found)
    index = {place.tobytes(): number for number, place in enumerate(problem.required.places_m)}
    step = (DISCS + 1) // 2
    first, unchanged = 0, 0
    while unchanged * step <= len(path.sequence) + DISCS and keep_going(path.found()):
        unchanged = 0 if _search(path, first, index) else unchanged + 1
        first = first + step if first + DISCS < len(path.sequence) else 0
    return path.found()


def _search(path: EditablePath, first: int, index: dict[bytes, int]) -> bool:
    """Search the window from this disc on, and return whether it has become shorter."""
    problem, line, last = path.problem, path.path_m, min(first + DISCS, len(path.sequence))
    end = line[last + 1] if last + 1 < len(line) else None
    alone = problem.required.part(path.only_met_by(first, last))
    window = PathProblem(alone, problem.radius_m, line[first], end).without_met()
    now_m = path_length_m(line[first : last + 2])
    nothing = np.empty((0, 2))
    best = FoundPath((), nothing, path_length_m(window.path_m(nothing)))
    if len(window.required):
        search = PathSearch(window, FoundPath((), path.points_m[first:last], now_m))
        search.run(lambda: len(search.nodes) < NODES)
        best = search.best
    if best.length_m >= now_m * (1.0 - GAP):
        return False
    places = window.required.places_m[list(best.sequence)]
    path.replace(first, last, tuple(index[place.tobytes()] for place in places), best.points_m)
    return True
