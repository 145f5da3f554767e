"""A path that can be changed in places: it knows which of its legs meets which requirement."""

import numpy as np

from mavplan.planners.cover_candidates import COVER_SLACK_M
from mavplan.planners.path_problem import FoundPath, PathProblem
from mavplan.planners.touring import tour_discs, turns_of
from mavplan.scenario.model import Floats, Ints


class EditablePath:
    """A path through discs, not necessarily all that are required.

    Attributes
    ----------
    sequence
        Places in the order of touch.
    points_m
        (K, 2) where their discs are touched.
    times
        (Q,) how many legs meet each requirement.
    """

    def __init__(self, problem: PathProblem, path: FoundPath | None = None) -> None:
        from scipy.spatial import KDTree

        self.problem = problem
        self.sequence: tuple[int, ...] = ()
        self.points_m: Floats = np.empty((0, 2))
        self._tree = KDTree(problem.required.places_m)
        places = problem.required.choices.ravel()
        order = np.argsort(places, kind="stable")
        self._of_place = np.split(order // 2, np.cumsum(np.bincount(places))[:-1])
        self._met = self._met_by(problem.path_m(self.points_m))
        self.times: Ints = np.zeros(len(problem.required), dtype=np.int64)
        self._count(self._met, 1)
        if path is not None:
            self.replace(0, 0, path.sequence, path.points_m)

    def copy(self) -> "EditablePath":
        """Return a path that can be changed apart from this one."""
        other = object.__new__(EditablePath)
        other.__dict__ = {**self.__dict__, "_met": list(self._met), "times": self.times.copy()}
        return other

    @property
    def path_m(self) -> Floats:
        """(L + 1, 2) from start to end."""
        return self.problem.path_m(self.points_m)

    @property
    def length_m(self) -> float:
        """Length from start to end."""
        return path_length_m(self.path_m)

    def found(self) -> FoundPath:
        """Return the path as it is."""
        return FoundPath(self.sequence, self.points_m, self.length_m)

    def unmet(self) -> Ints:
        """Return the requirements that no leg meets."""
        return np.flatnonzero(self.times == 0)

    def only_met_by(self, first: int, last: int) -> Ints:
        """Return the requirements that are met on the way to discs from ``first`` to ``last``, and nowhere else."""
        within = np.zeros_like(self.times)
        for met in self._met[first : last + 1]:
            within[met] += 1
        return np.flatnonzero((within > 0) & (within == self.times))

    def replace(self, first: int, last: int, sequence: tuple[int, ...], points_m: Floats) -> None:
        """Put others in place of the discs from ``first`` to before ``last``."""
        before, legs = self._met[:first], self._met[first : last + 1]
        self._count(legs, -1)
        self.sequence = (*self.sequence[:first], *sequence, *self.sequence[last:])
        self.points_m = np.vstack([self.points_m[:first], points_m, self.points_m[last:]])
        fresh = self._met_by(self.path_m[first : first + len(sequence) + 2])
        self._count(fresh, 1)
        self._met = [*before, *fresh, *self._met[last + 1 :]]

    def tour(self, first: int, last: int, precision: float) -> Floats:
        """Touch the discs from ``first`` to before ``last`` anew, and return their multipliers."""
        problem, path = self.problem, self.path_m
        if first == last:
            return np.empty(0)
        end = path[last + 1] if last + 1 < len(path) else None
        sequence = self.sequence[first:last]
        centres = problem.required.places_m[list(sequence)]
        tours = tour_discs(centres[None], problem.radius_m, path[first], end, precision=precision)
        self.replace(first, last, sequence, tours.points_m[0])
        return np.asarray(np.linalg.norm(turns_of(tours.duals[0], last - first), axis=1))

    def _met_by(self, path_m: Floats) -> list[Ints]:
        """Return for each leg of a path the requirements that it meets."""
        begin, along = path_m[:-1], np.diff(path_m, axis=0)
        if not len(begin):
            return []
        steps = np.linalg.norm(along, axis=1)
        reach_m = self.problem.radius_m + COVER_SLACK_M
        near = self._tree.query_ball_point(begin + along / 2.0, reach_m + steps / 2.0)
        found = []
        for places, start, step, length_m in zip(near, begin, along, steps, strict=True):
            at = np.array(places, dtype=np.int64)
            offset = self.problem.required.places_m[at] - start
            share = np.clip(offset @ step / max(length_m**2, np.finfo(float).tiny), 0.0, 1.0)
            reached = at[np.linalg.norm(offset - share[:, None] * step, axis=1) <= reach_m]
            met = [self._of_place[place] for place in reached.tolist()]
            found.append(np.unique(np.concatenate(met)) if met else np.empty(0, dtype=np.int64))
        return found

    def _count(self, legs: list[Ints], by: int) -> None:
        for met in legs:
            self.times[met] += by


def path_length_m(path_m: Floats) -> float:
    """Return the length of a polyline."""
    return float(np.linalg.norm(np.diff(path_m, axis=0), axis=1).sum())
