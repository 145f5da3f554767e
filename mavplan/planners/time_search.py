"""The search for the plan of least mission time: local search from several plans, then perturbation of the best.

A plan is improved by the best of its neighbours (`time_moves`) until none is better, then all its stops are moved at
once (`time_polish`). After that some stops that stand near each other are taken out, or the order is cut and put
together otherwise, the plan is repaired, improved, and kept if it is better or hardly worse; in vain for long, another
local optimum is gone on with. Counted work and a seed decide everything; a clock only where a limit is given.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.planners.time_moves import (
    candidate_places,
    detours_m,
    inserted,
    merged,
    reordered,
    with_another,
    with_one_instead,
    with_one_less,
)
from mavplan.planners.time_nearby import Nearby
from mavplan.planners.time_polish import polish
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.time_programme import least_hover_at
from mavplan.scenario.model import Floats

PLACES = 40
"""Candidate places tried in one step."""

AT_ONCE = 30
"""Neighbours whose hover is computed together, those that promise most first."""

WORTHWHILE_S = 1e-3
"""A neighbour must be better by this."""

STARTS = 4
"""Plans that are improved before some of them are perturbed."""

WORSE = 0.003
"""A plan that is worse than the present one by up to a random part of this may take its place."""

ASTRAY = 0.01
"""Further above the best that the present plan has come to than this the search goes back to that."""

VAIN, GAINED = 40, 1e-4
"""After so many rounds in a row without a gain of this part another plan is gone on with."""

PROMISING = 1.02
"""Plans whose time before polishing is above this times the best are not polished to the end, and in a perturbation
not at all where it is above this times the best that the plan gone on with has come to."""

BRIEF_STEPS, BRIEF_TOLERANCE = 4, 1e-3
"""Of polishing where a search is brief."""

GONE, GONE_MORE = 3, 10
"""Stops that a perturbation takes out at most, and after how many in vain it may be one more."""

ALIKE, ALIKE_M = 2e-4, 20.0
"""A plan whose time differs by less than this part and whose stops by less than this many metres is the same again."""

KeepGoing = Callable[[], bool]
"""Asked before each piece of work whether there is time for it."""


@dataclass(eq=False)
class TimeSearch:
    """A search under way.

    Parameters
    ----------
    problem
        What is to be served.
    rng
        Draws all that is random.
    brief
        Whether a plan is improved by one descent and a few steps of polishing alone.

    Attributes
    ----------
    best_m, best_s
        The best plan so far and its time.
    """

    problem: TimeProblem
    rng: np.random.Generator
    brief: bool = False

    def __post_init__(self) -> None:
        self.places_m = candidate_places(self.problem, self.rng)
        self._reach = self.problem.rates(self.places_m) > 0
        self.best_m = np.empty((0, 2))
        self.best_s = np.inf
        self._optima: list[tuple[Floats, float]] = []
        self._begun: list[tuple[Floats, float]] = []

    def consider(self, starts: Sequence[Floats], keep_going: KeepGoing, most: int = STARTS) -> None:
        """Improve the best ``most`` of some plans.

        Parameters
        ----------
        starts
            (M, 2) stops each; where they serve not everybody, stops are added. The result is never worse than any
            of them that serves everybody.
        """
        served = [self._repaired(stops) for stops in starts if len(stops)]
        timed = sorted(
            ((self._time_s(stops), index) for index, stops in enumerate(served)), key=lambda pair: pair[0]
        )
        for total_s, index in timed[:most]:
            self._keep(served[index], total_s)
        for total_s, index in timed[:most]:
            if not keep_going():
                return
            self._optima.append(self._improved(served[index], total_s, keep_going))
            self._keep(*self._optima[-1])

    def perturb(self, rounds: int, keep_going: KeepGoing) -> None:
        """Perturb and improve plans ``rounds`` times, or until that was in vain with all of them or time is up.

        The best is gone on with, then the others that `consider` came to, as the deepest valley need not be the one
        that a start fell into.
        """
        lines = self._lines()
        least_m, least_s = here_m, here_s = next(lines)
        in_vain = 0
        for _ in range(rounds):
            if in_vain >= VAIN:
                following = next(lines, None)
                if following is None:
                    break
                least_m, least_s = here_m, here_s = following
                in_vain = 0
            if not keep_going():
                break
            before_s = least_s
            repaired = self._repaired(self._perturbed(here_m, GONE + in_vain // GONE_MORE))
            stops, total_s = self._descended(repaired, self._time_s(repaired), keep_going)
            if total_s < PROMISING * least_s and not _is_alike(stops, total_s, here_m, here_s):
                stops, total_s = self._improved(stops, total_s, keep_going, descended=True)
                if total_s < here_s * (1 + WORSE * self.rng.random()):
                    here_m, here_s = stops, total_s
                if total_s < least_s:
                    least_m, least_s = stops, total_s
                self._keep(stops, total_s)
            in_vain = 0 if least_s < before_s * (1 - GAINED) else in_vain + 1
            if here_s > least_s * (1 + ASTRAY):
                here_m, here_s = least_m, least_s

    def _lines(self) -> Iterator[tuple[Floats, float]]:
        """Yield plans to go on with: the best, each other local optimum of the starts once, the best again."""
        begun = self._begun
        begun.append((self.best_m, self.best_s))
        yield self.best_m, self.best_s
        for stops, total_s in sorted(self._optima, key=_seconds):
            if np.isfinite(total_s) and not any(_is_alike(stops, total_s, *other) for other in begun):
                begun.append((stops, total_s))
                yield stops, total_s
        yield self.best_m, self.best_s

    def best_of(self, plans_m: Floats, nearby: Nearby, below_s: float) -> tuple[Floats, float] | None:
        """Return the best of plans (B, M, 2) and its time, None where none takes less than this.

        Parameters
        ----------
        nearby
            Of a plan near them. Its prices bound the hover of each from below, and plans are compared in the order of
            these bounds: those that cannot be the best have no programme solved.
        """
        problem = self.problem
        flight_s = problem.flight_s(plans_m)
        kept = np.flatnonzero(flight_s < below_s)
        rates = problem.rates_of_many(plans_m[kept])
        wants = problem.wants_of(plans_m[kept], rates)
        kept = kept[able := np.isfinite(wants).all(axis=1)]
        rates, wants = rates[able], wants[able]
        least_s = flight_s[kept]
        if not problem.tdma:
            least_s = least_s + least_hover_at(nearby.prices, rates, wants)
        best_m: Floats | None = None
        order = np.argsort(least_s, kind="stable")
        for first in range(0, len(order), AT_ONCE):
            some = order[first : first + AT_ONCE]
            some = some[least_s[some] < below_s]
            if not len(some):
                break
            total_s = nearby.total_s(flight_s[kept[some]], plans_m[kept[some]], rates[some], wants[some])
            least = int(total_s.argmin())
            if total_s[least] < below_s:
                best_m, below_s = plans_m[kept[some[least]]], float(total_s[least])
        return None if best_m is None else (best_m, below_s)

    def _keep(self, stops_m: Floats, total_s: float) -> None:
        if total_s < self.best_s:
            self.best_m, self.best_s = stops_m, total_s

    def _time_s(self, stops_m: Floats) -> float:
        return float(self.problem.times(stops_m[None]).total_s[0])

    def _improved(
        self, stops_m: Floats, total_s: float, keep_going: KeepGoing, *, descended: bool = False
    ) -> tuple[Floats, float]:
        """Return a local optimum: neighbours, unless that has just been done, and polishing by turns."""
        while True:
            stepped, stepped_s = stops_m, total_s
            if not descended:
                stepped, stepped_s = self._descended(stops_m, total_s, keep_going)
            descended = False
            if not np.isfinite(stepped_s):
                return stepped, stepped_s
            if self.brief:
                return polish(self.problem, stepped, steps=BRIEF_STEPS, tolerance=BRIEF_TOLERANCE)
            quick = stepped_s > PROMISING * self.best_s
            polished, polished_s = polish(
                self.problem, stepped, steps=4 if quick else 12, tolerance=1e-4 if quick else 2e-5
            )
            if (
                polished_s > total_s - max(WORTHWHILE_S, 1e-4 * total_s)
                or polished_s > PROMISING * self.best_s
                or not keep_going()
            ):
                return polished, polished_s
            stops_m, total_s = polished, polished_s

    def _descended(self, stops_m: Floats, total_s: float, keep_going: KeepGoing) -> tuple[Floats, float]:
        """Return the plan that steps to the best neighbour lead to."""
        while keep_going():
            nearby = Nearby(self.problem, stops_m)
            best_s, best_m = total_s - WORTHWHILE_S, None
            for plans in self._neighbours(stops_m):
                found = self.best_of(plans, nearby, best_s)
                if found is not None:
                    best_m, best_s = found
            if best_m is None:
                break
            stops_m, total_s = best_m, best_s
        return stops_m, total_s

    def _neighbours(self, stops_m: Floats) -> list[Floats]:
        """Return plans to try, grouped by their number of stops."""
        problem = self.problem
        drawn = self.rng.permutation(len(self.places_m))[:PLACES]
        places = self.places_m[drawn]
        same = [reordered(problem, stops_m), with_one_instead(problem, stops_m, places)]
        groups = [np.concatenate(same), with_another(problem, stops_m, places)]
        if len(stops_m) > 1:
            groups.append(np.concatenate([with_one_less(stops_m), merged(stops_m)]))
        return groups

    def _perturbed(self, stops_m: Floats, most: int) -> Floats:
        """Return a plan without at most so many stops that stand near each other, or with its order cut in four."""
        rng, stops = self.rng, len(stops_m)
        if stops >= 4 and rng.random() < 0.3:
            i, j, k = np.sort(rng.choice(stops + 1, 3, replace=False))
            return np.vstack([stops_m[:i], stops_m[j:k], stops_m[i:j], stops_m[k:]])
        if stops == 1:
            return stops_m
        gone = int(rng.integers(1, min(stops, most + 1)))
        centre = self.places_m[rng.integers(len(self.places_m))]
        blur = rng.uniform(0.0, (2 / 3 * self.problem.channel.radius_m) ** 2, stops)
        order = np.argsort(((stops_m - centre) ** 2).sum(axis=1) + blur)
        return np.delete(stops_m, order[:gone], axis=0)

    def _repaired(self, stops_m: Floats) -> Floats:
        """Return a plan with stops added until everybody is served: where most are reached for the least way."""
        problem = self.problem
        for _ in range(len(problem.need_s)):
            rates = problem.rates(stops_m[None])
            passing = problem.passing_s(stops_m[None]) if problem.in_flight else None
            lacking = np.isinf(problem.wants(np.asarray(rates.any(axis=1)), passing)[0])
            if not lacking.any():
                break
            reached = self._reach[:, lacking].sum(axis=1)
            useful = np.flatnonzero(reached)
            detours = detours_m(problem, stops_m, self.places_m[useful])
            cost = detours.min(axis=1) + 2 * problem.channel.radius_m / 3
            cost = cost / reached[useful] * self.rng.uniform(0.8, 1.2, len(useful))
            best = int(cost.argmin())
            place = self.places_m[useful[best : best + 1]]
            stops_m = inserted(stops_m, place, detours[best : best + 1].argmin(axis=1))[0]
        return stops_m


def _seconds(plan: tuple[Floats, float]) -> float:
    return plan[1]


def _is_alike(stops_m: Floats, total_s: float, other_m: Floats, other_s: float) -> bool:
    """Return whether two plans are next to the same."""
    return (
        len(stops_m) == len(other_m)
        and abs(total_s - other_s) < ALIKE * other_s
        and bool((np.abs(stops_m - other_m) < ALIKE_M).all())
    )
