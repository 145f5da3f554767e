"""The shortest way round no-fly zones: A* over their corners, each asked only once what it sees."""

import heapq
import itertools

import numpy as np

from mavplan.airspace.zones import KeepOut
from mavplan.scenario.model import Bools, Floats


class Routes:
    """Ways between places that keep out of the zones.

    Parameters
    ----------
    out
        The zones.
    """

    def __init__(self, out: KeepOut) -> None:
        self._out = out
        self._corners = out.corners_m
        self._seen: dict[int, Bools] = {}

    def between(self, start_m: Floats, end_m: Floats) -> list[Floats] | None:
        """Return where the shortest way from one place to another turns; None where there is no way.

        Parameters
        ----------
        start_m, end_m
            (2,) metres, both outside of what is closed.
        """
        if not self._out.crossed(start_m[None], end_m[None])[0]:
            return []
        if not len(self._corners):
            return None
        to_end_m = np.linalg.norm(self._corners - end_m, axis=1)
        sees_end = ~self._out.crossed(self._corners, end_m[None])
        from_start_m = np.linalg.norm(self._corners - start_m, axis=1)
        length_m = np.where(~self._out.crossed(start_m[None], self._corners), from_start_m, np.inf)
        before = np.full(len(self._corners), -1)
        order = itertools.count()
        todo = [
            (length_m[k] + to_end_m[k], next(order), int(k)) for k in np.flatnonzero(np.isfinite(length_m))
        ]
        heapq.heapify(todo)
        done = np.zeros(len(self._corners), dtype=bool)
        best_m, last = np.inf, -1
        while todo:
            bound_m, _, corner = heapq.heappop(todo)
            if bound_m >= best_m:
                break
            if done[corner]:
                continue
            done[corner] = True
            if sees_end[corner] and length_m[corner] + to_end_m[corner] < best_m:
                best_m, last = length_m[corner] + to_end_m[corner], corner
            through_m = length_m[corner] + np.linalg.norm(self._corners - self._corners[corner], axis=1)
            nearer = self._sees(corner) & ~done & (through_m < length_m)
            for k in np.flatnonzero(nearer):
                length_m[k], before[k] = through_m[k], corner
                heapq.heappush(todo, (through_m[k] + to_end_m[k], next(order), int(k)))
        if last < 0:
            return None
        turns = []
        while last >= 0:
            turns.append(self._corners[last])
            last = int(before[last])
        return turns[::-1]

    def _sees(self, corner: int) -> Bools:
        """Return (V,) which corners can be flown to straight from one of them."""
        if corner not in self._seen:
            self._seen[corner] = ~self._out.crossed(self._corners[corner][None], self._corners)
        return self._seen[corner]
