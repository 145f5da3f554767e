"""A path through discs made shorter by many small changes: fast and nearly exact, without proof.

Discs are taken out and put in again where the detour is least (G. Schrimpf et al., "Record breaking optimization
results using the ruin and recreate principle", J. Computational Physics 159, 2000, doi 10.1006/jcph.1999.6413). Each
change moves a stretch of points only, each to the best place between its neighbours. Some legs may be given: they are
neither changed nor counted, and meet nothing; so the pieces of a longer path that lead through one region are one path
here.
"""

import math
from dataclasses import dataclass

import numpy as np

from mavplan.planners.cover_candidates import COVER_SLACK_M, Requirements
from mavplan.scenario.model import Bools, Floats, Ints

FIXED = -1
"""In `Pieces.place`: a point that stays where it is."""

JOIN = -2
"""In `Pieces.place`: a point where pieces were joined; it is left out unless a piece begins or ends there."""

STRETCH = 2
"""Points on each side of a change that move with it."""

SWEEPS = 2
"""Rounds in which a stretch's points move one after the other."""

SETTLED = 12
"""Rounds in which all points move one after the other."""

TURNS = 3
"""Steps by which a point is turned round its disc."""

APART = 4.0
"""Users put in before distances are measured again are this many radii apart."""

TAKEN_OUT = (2, 6)
"""Discs taken out at once, from the first number to before the second."""

WARMTH = 0.02
"""Radii by which a path may at first become longer in a change, in the mean."""

SAME_M = 1e-9
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Points of one or more pieces of a path, in flying order.

    Attributes
    ----------
    points_m
        (K, 2).
    place
        (K,) which required place's disc each point touches, or `FIXED` or `JOIN`; first and last are taken as fixed.
    given
        (K − 1,) legs between pieces: both their ends are fixed.
    open_end
        Whether the last point ends the path and may be anywhere.
    """

    points_m: Floats
    place: Ints
    given: Bools
    open_end: bool


def improved(
    required: Requirements, radius_m: float, pieces: Pieces, rng: np.random.Generator, attempts: int
) -> Pieces:
    """Return pieces that meet all requirements, made shorter by so many attempts.

    Parameters
    ----------
    required
        What the pieces have to meet; they need not do so yet.
    radius_m
        R, greater than 0.
    pieces
        To begin with.
    """
    path = _QuickPath(required, radius_m, pieces)
    path.leave_out_joins()
    path.complete(None)
    path.settle_all()
    path.drop_needless()
    best, best_m, now_m = path.copy(), path.length_m(), path.length_m()
    for attempt in range(attempts):
        trial = path.copy()
        if not trial.take_out(rng):
            break
        trial.complete(rng)
        length_m = trial.length_m()
        warmth_m = WARMTH * radius_m * (1.0 - attempt / attempts)
        if length_m < now_m - warmth_m * math.log(max(rng.random(), SAME_M)):
            path, now_m = trial, length_m
            if now_m < best_m - SAME_M:
                best, best_m = trial.copy(), now_m
    best.drop_needless()
    return best.pieces()


class _QuickPath:
    """The path while it is changed: which leg meets which requirement is kept up with every change."""

    def __init__(self, required: Requirements, radius_m: float, pieces: Pieces) -> None:
        self._required, self._radius_m, self._open_end = required, radius_m, pieces.open_end
        self._one, self._other = required.choices[:, 0], required.choices[:, 1]
        self._alone = bool((self._one == self._other).all())
        self._x, self._y = required.places_m[:, 0].copy(), required.places_m[:, 1].copy()
        self.points_m, self.place, self.given = pieces.points_m, pieces.place, pieces.given
        # Requirements with one place each, from west to east: a leg is compared with those near it only.
        self._by_x: Ints = np.argsort(self._x[self._one], kind="stable")
        self._sorted_x, self._sorted_y = self._x[self._one[self._by_x]], self._y[self._one[self._by_x]]
        self._met = self._met_by(0, len(self.given))
        self.times: Ints = np.zeros(len(required), dtype=np.int64)
        self._count(self._met, 1)

    def copy(self) -> "_QuickPath":
        """Return a path that can be changed apart from this one."""
        other = object.__new__(_QuickPath)
        other.__dict__ = {**self.__dict__, "times": self.times.copy()}
        return other

    def pieces(self) -> Pieces:
        """Return the path as it is."""
        return Pieces(self.points_m, self.place, self.given, self._open_end)

    def length_m(self) -> float:
        """Return the length of all legs but the given ones."""
        steps = np.diff(self.points_m, axis=0)
        return float(np.sqrt((steps**2).sum(axis=1))[~self.given].sum())

    def complete(self, rng: np.random.Generator | None) -> None:
        """Put in whoever is not met, until everybody is; the farthest first, or in an order that is drawn."""
        while len(unmet := np.flatnonzero(self.times == 0)):
            if rng is not None:
                for requirement in rng.permutation(unmet).tolist():
                    if not self.times[requirement]:
                        self._insert(requirement)
                continue
            for requirement in self._spread(unmet):
                if not self.times[requirement]:
                    self._insert(requirement)

    def take_out(self, rng: np.random.Generator) -> bool:
        """Take out some points near each other, and return whether there are any."""
        free = np.flatnonzero(self.place != FIXED)
        if not len(free):
            return False
        middle = self.points_m[free[rng.integers(len(free))]]
        away = ((self.points_m[free] - middle) ** 2).sum(axis=1)
        count = int(rng.integers(*TAKEN_OUT))
        near = free if len(free) <= count else free[np.argpartition(away, count - 1)[:count]]
        for at in -np.sort(-near):
            self._replace(int(at), int(at) + 1, np.empty((0, 2)), np.empty(0, dtype=np.int64))
        return True

    def leave_out_joins(self) -> None:
        """Take out the points where pieces were joined."""
        for at in np.flatnonzero(self.place == JOIN)[::-1].tolist():
            self._replace(at, at + 1, np.empty((0, 2)), np.empty(0, dtype=np.int64))

    def settle_all(self) -> None:
        """Move all points, and put in whoever is not met any more."""
        free = np.flatnonzero(self.place != FIXED)
        runs = np.split(free, np.flatnonzero(np.diff(free) > 1) + 1) if len(free) else []
        for run in runs:
            first, last = int(run[0]), int(run[-1]) + 1
            line = self.points_m[first - 1 : last + 1].tolist()
            ends_here = last == len(self.place)
            if ends_here:
                line.append(line[-1])
            places = self.place[first:last]
            centres = list(zip(self._x[places].tolist(), self._y[places].tolist(), strict=True))
            settle(line, centres, self._radius_m, SETTLED, open_end=ends_here)
            self._replace(first, last, np.array(line[1:-1]), places)
        self.complete(None)

    def drop_needless(self) -> None:
        """Take out points without which everybody is still met."""
        for at in range(len(self.place) - 1, 0, -1):
            if self.place[at] == FIXED:
                continue
            last = at + 1 == len(self.place)
            left = self.times.copy()
            for met in self._met[at - 1 : at + (not last)]:
                left[met] -= 1
            if not last:
                left[self._reached(self.points_m[at - 1 : at], self.points_m[at + 1 : at + 2])[0]] += 1
            if left.min(initial=1) > 0:
                self._replace(at, at + 1, np.empty((0, 2)), np.empty(0, dtype=np.int64))

    def _replace(self, first: int, last: int, points_m: Floats, place: Ints) -> None:
        """Put others in place of the points from ``first`` to before ``last``; legs there are not given ones."""
        self.points_m = np.concatenate((self.points_m[:first], points_m, self.points_m[last:]))
        self.place = np.concatenate((self.place[:first], place, self.place[last:]))
        end = min(last, len(self.given))
        self._count(self._met[first - 1 : end], -1)
        count = len(points_m) + (last <= len(self.given))
        fresh = np.zeros(count, dtype=np.bool_)
        self.given = np.concatenate((self.given[: first - 1], fresh, self.given[end:]))
        met = self._met_by(first - 1, first - 1 + count)
        self._met = [*self._met[: first - 1], *met, *self._met[end:]]
        self._count(met, 1)

    def _count(self, legs: list[Ints], by: int) -> None:
        for met in legs:
            self.times[met] += by

    def _met_by(self, first: int, last: int) -> list[Ints]:
        """Return which requirements each leg from ``first`` to before ``last`` meets."""
        met = self._reached(self.points_m[first:last], self.points_m[first + 1 : last + 1])
        for leg in np.flatnonzero(self.given[first:last]).tolist():
            met[leg] = met[leg][:0]
        return met

    def _reached(self, begin_m: Floats, end_m: Floats) -> list[Ints]:
        """Return which requirements each leg between these points meets."""
        if not len(begin_m):
            return []
        if not self._alone:
            reached = self._within(begin_m, end_m, self._x, self._y)
            met = reached[:, self._one] | reached[:, self._other]
            return [np.flatnonzero(row) for row in met]
        reach_m = self._radius_m + COVER_SLACK_M
        west = float(min(begin_m[:, 0].min(), end_m[:, 0].min())) - reach_m
        east = float(max(begin_m[:, 0].max(), end_m[:, 0].max())) + reach_m
        low, high = self._sorted_x.searchsorted((west, east)).tolist()
        near = slice(low, high + 1)
        ids = self._by_x[near]
        return [ids[row] for row in self._within(begin_m, end_m, self._sorted_x[near], self._sorted_y[near])]

    def _within(self, begin_m: Floats, end_m: Floats, x: Floats, y: Floats) -> Bools:
        """Return (L, P) which of these places are within reach of the legs between these points."""
        reach_m = self._radius_m + COVER_SLACK_M
        along = end_m - begin_m
        u, v = along[:, :1], along[:, 1:]
        dx, dy = x - begin_m[:, :1], y - begin_m[:, 1:]
        squared = np.maximum(u * u + v * v, TINY)
        share = np.minimum(np.maximum((dx * u + dy * v) / squared, 0.0), 1.0)
        dx -= share * u
        dy -= share * v
        return np.asarray(dx * dx + dy * dy <= reach_m**2)

    def _spread(self, requirements: Ints) -> list[int]:
        """Return the requirement farthest from the path and, in turn, those that are far from all before."""
        at = self._one[requirements]
        x, y = self._x[at], self._y[at]
        away = self._away(x, y)
        order = np.argsort(-away, kind="stable")
        requirements, x, y = requirements[order], x[order], y[order]
        open_ = np.ones(len(requirements), dtype=np.bool_)
        taken = []
        apart = (APART * self._radius_m) ** 2
        for row in range(len(requirements)):
            if open_[row]:
                taken.append(int(requirements[row]))
                open_ &= (x - x[row]) ** 2 + (y - y[row]) ** 2 > apart
        return taken

    def _away(self, x: Floats, y: Floats) -> Floats:
        """Return squared distances of these places to the nearest point of the path."""
        dx, dy = x[:, None] - self.points_m[:, 0], y[:, None] - self.points_m[:, 1]
        return np.asarray((dx * dx + dy * dy).min(axis=1))

    def _insert(self, requirement: int) -> None:
        """Put in a place of a requirement where that makes the path longer by least; points near it move."""
        best: tuple[float, int, int] | None = None
        for place in {int(self._one[requirement]): None, int(self._other[requirement]): None}:
            detours = self._detours(self._x[place], self._y[place])
            leg = int(detours.argmin())
            if best is None or detours[leg] < best[0]:
                best = float(detours[leg]), place, leg
        assert best is not None
        _, place, leg = best
        self._put_in(leg + 1, place)

    def _put_in(self, at: int, place: int) -> None:
        """Put a disc in as the ``at``-th point and move the stretch round it."""
        first = at
        while first > 1 and at - first < STRETCH and self.place[first - 1] != FIXED:
            first -= 1
        last = at
        while last < len(self.place) and last - at < STRETCH and self.place[last] != FIXED:
            last += 1
        places = np.concatenate((self.place[first:at], [place], self.place[at:last]))
        stretch = self.points_m[first - 1 : last + 1].tolist()
        stretch.insert(at - first + 1, [float(self._x[place]), float(self._y[place])])
        ends_here = last == len(self.place)
        if ends_here:
            stretch.append(stretch[-1])
        centres = list(zip(self._x[places].tolist(), self._y[places].tolist(), strict=True))
        settle(stretch, centres, self._radius_m, SWEEPS, open_end=ends_here)
        self._replace(first, last, np.array(stretch[1:-1]), places)

    def _detours(self, x: float, y: float) -> Floats:
        """Return how much longer each leg becomes on its way by a disc; the last is the way on from an open end."""
        begin, end = self.points_m[:-1], self.points_m[1:]
        if self._open_end:
            begin, end = self.points_m, np.concatenate((end, self.points_m[-1:]))
        bx, by = begin[:, 0], begin[:, 1]
        u, v = end[:, 0] - bx, end[:, 1] - by
        squared = u * u + v * v
        share = ((x - bx) * u + (y - by) * v) / np.maximum(squared, TINY)
        share = np.minimum(np.maximum(share, 0.0), 1.0)
        fx, fy = bx + share * u, by + share * v
        dx, dy = x - fx, y - fy
        away = np.sqrt(dx * dx + dy * dy)
        inwards = np.maximum(away - self._radius_m, 0.0) / np.maximum(away, TINY)
        fx += inwards * dx
        fy += inwards * dy
        detours = np.sqrt((fx - bx) ** 2 + (fy - by) ** 2) - np.sqrt(squared)
        detours += np.sqrt((fx - end[:, 0]) ** 2 + (fy - end[:, 1]) ** 2)
        if self._open_end:
            detours[-1] /= 2.0
        detours[: len(self.given)][self.given] = np.inf
        return np.asarray(detours)


def settle(
    line: list[list[float]],
    centres: list[tuple[float, float]],
    radius_m: float,
    sweeps: int,
    *,
    open_end: bool,
) -> None:
    """Move the inner points of a line, each to the best place of its disc between its neighbours, a few times.

    Parameters
    ----------
    line
        Points; the first and the last stay, and with an open end the last does not count.
    centres
        Of the inner points' discs.
    """
    count = len(centres)
    for _ in range(sweeps):
        for i, (x, y) in enumerate(centres, start=1):
            if open_end and i == count:
                line[i] = _nearest(line[i - 1], x, y, radius_m)
            else:
                line[i] = touched(line[i - 1], line[i + 1], x, y, radius_m)


def _nearest(a: list[float], x: float, y: float, radius_m: float) -> list[float]:
    """Return the point of a disc nearest to another."""
    dx, dy = a[0] - x, a[1] - y
    away = math.sqrt(dx * dx + dy * dy)
    if away <= radius_m:
        return a
    return [x + radius_m * dx / away, y + radius_m * dy / away]


def touched(a: list[float], b: list[float], x: float, y: float, radius_m: float) -> list[float]:
    """Return a point of a disc by which the way from a to b is nearly shortest: exactly where it leads through it."""
    ax, ay = a
    bx, by = b
    u, v = bx - ax, by - ay
    squared = u * u + v * v
    share = ((x - ax) * u + (y - ay) * v) / squared if squared > 0.0 else 0.0
    share = 0.0 if share < 0.0 else min(share, 1.0)
    px, py = ax + share * u, ay + share * v
    dx, dy = px - x, py - y
    away = math.sqrt(dx * dx + dy * dy)
    if away <= radius_m:
        return [px, py]
    px, py = x + radius_m * dx / away, y + radius_m * dy / away
    # At the best place of the circle the radius halves the angle between the ways to both ends.
    for _ in range(TURNS):
        to_ax, to_ay, to_bx, to_by = ax - px, ay - py, bx - px, by - py
        a_m = math.sqrt(to_ax * to_ax + to_ay * to_ay)
        b_m = math.sqrt(to_bx * to_bx + to_by * to_by)
        if a_m < SAME_M or b_m < SAME_M:
            break
        dx, dy = to_ax / a_m + to_bx / b_m, to_ay / a_m + to_by / b_m
        away = math.sqrt(dx * dx + dy * dy)
        if away < SAME_M:
            break
        px, py = x + radius_m * dx / away, y + radius_m * dy / away
    return [px, py]
