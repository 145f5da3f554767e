"""Moving all stops of a plan at once to where its mission takes least time, order and number of stops kept.

Sequential linear programming: holds and small moves of the stops are chosen together under rates, in-flight service
and leg lengths as they change to first order, no stop moves further than a radius of trust, and a step is taken where
the time truly falls. A stop does not leave the disc of a user that it alone serves.
"""

import math

import numpy as np

from mavplan.planners.linear_programme import least
from mavplan.planners.time_problem import TimeProblem, Times
from mavplan.scenario.model import Bools, Floats

FIRST_TRUST, LAST_TRUST, MOST_TRUST = 0.2, 2e-4, 0.7
"""Radii of trust at the beginning, at the end and at most, in units of R."""

GOOD, FAIR = 0.7, 0.1
"""Shares of the promised gain: above the first trust grows, below the second it shrinks."""

AROUND = 12
"""Directions in which a short leg may turn."""

STEEPEST = 4.0
"""Legs so short that a metre more costs more than so many times what it costs at full speed count with this."""


def polish(
    problem: TimeProblem, stops_m: Floats, *, steps: int = 15, tolerance: float = 1e-5
) -> tuple[Floats, float]:
    """Return stops (M, 2) at least as good as those given, and their time.

    Parameters
    ----------
    stops_m
        (M, 2), a plan that serves everybody.
    steps
        Linear programmes at most.
    tolerance
        Share of the time that a step must promise, and gain, for another one.
    """
    times = problem.times(stops_m[None])
    total_s = float(times.total_s[0])
    trust_m = FIRST_TRUST * problem.channel.radius_m
    least_m, most_m = LAST_TRUST * problem.channel.radius_m, MOST_TRUST * problem.channel.radius_m
    model: _Model | None = None
    for _ in range(steps):
        model = model or _Model(problem, stops_m, times)
        moved = model.step(trust_m)
        if moved is None:
            trust_m /= 4
        else:
            candidate_m, promised_s = moved
            if total_s - promised_s < tolerance * total_s:
                break
            candidate = problem.times(candidate_m[None])
            gain = total_s - float(candidate.total_s[0])
            promise = total_s - promised_s
            if gain > 0:
                stops_m, times, total_s = candidate_m, candidate, total_s - gain
                model = None
                if gain < tolerance * total_s:
                    break
            if not gain > FAIR * promise:
                trust_m /= 3
            elif gain > GOOD * promise:
                trust_m = min(2 * trust_m, most_m)
        if trust_m < least_m:
            break
    return stops_m, total_s


class _Model:
    """The problem to first order about one plan."""

    def __init__(self, problem: TimeProblem, stops_m: Floats, times: Times) -> None:
        self.problem, self.stops_m = problem, stops_m
        holds = times.holds_s[0]
        self.offset = stops_m[:, None] - problem.users_m
        self.squared = (self.offset**2).sum(axis=2)
        self.rates = problem.rates(stops_m)
        slopes = 2 * self.offset * problem.slopes(self.squared)[:, :, None]
        self.path = np.vstack([np.zeros(2), stops_m])
        wants = problem.wants_of(stops_m[None], self.rates[None])[0]
        self.needed = self._needed(holds, wants)
        stops = len(stops_m)
        if problem.tdma:
            self.holds_from = np.zeros((0, 3 * stops))
            self.limits = np.zeros(0)
            best, users = self.rates.argmax(axis=0), np.arange(len(wants))
            rate = self.rates[best, users]
            pull = (
                np.where(wants > 0, -wants / np.maximum(rate, 1e-12) ** 2, 0.0)[:, None] * slopes[best, users]
            )
            self.cost = np.zeros((stops, 2))
            np.add.at(self.cost, best, pull)
            self.base_s = float(times.hover_s[0])
            return
        gained = holds[:, None, None] * slopes
        if problem.in_flight:
            gained = gained + self._passing_slopes()
        active = np.flatnonzero(wants > 0)
        by_move = gained[:, active].transpose(1, 0, 2).reshape(len(active), 2 * stops)
        self.holds_from = -np.hstack([by_move, self.rates[:, active].T])
        self.limits = -wants[active]
        self.cost = np.zeros((stops, 2))
        self.base_s = 0.0

    def _needed(self, holds: Floats, wants: Floats) -> Bools:
        """(M, N) whether the stop must stay within R of the user: without it the user would lack something."""
        within = self.rates > 0
        given = holds[:, None] * self.rates
        lacking = (given.sum(axis=0) - given < wants - 1e-9) & (given > 1e-9)
        if self.problem.tdma:
            lacking = self.rates == self.rates.max(axis=0)
        only = within.sum(axis=0) == 1
        if self.problem.in_flight:
            only &= wants > -1e-3
        needed: Bools = within & (lacking | only)
        return needed

    def _passing_slopes(self) -> Floats:
        """(M, N, 2) how what users receive in flight changes as stops move, at full speed all the way."""
        problem = self.problem
        assert problem.table is not None
        shares = np.vstack([problem.rates(np.zeros((1, 2))), self.rates])
        by_start, by_end = problem.table.slopes(self.path[:-1], self.path[1:], problem.users_m, shares)
        found = by_end
        found[:-1] += by_start[1:]
        return np.moveaxis(found, 1, 2) / problem.vehicle.speed_m_s

    def step(self, trust_m: float) -> tuple[Floats, float] | None:
        """Return where the stops go within the radius of trust and the time promised there; None where nowhere."""
        problem, stops = self.problem, len(self.stops_m)
        legs, leg_limits, leg_cost = self._legs(trust_m)
        discs, disc_limits = self._discs(trust_m)
        count = len(leg_cost)
        wide = 3 * stops + count
        matrix = np.zeros((len(self.limits) + len(legs) + len(discs), wide))
        one, two = len(self.limits), len(self.limits) + len(legs)
        matrix[:one, : 3 * stops] = self.holds_from
        matrix[one:two, : 2 * stops], matrix[one:two, 3 * stops :] = (
            legs[:, : 2 * stops],
            legs[:, 2 * stops :],
        )
        matrix[two:, : 2 * stops] = discs
        held = 0.0 if problem.tdma else 1.0
        cost = np.concatenate([self.cost.ravel(), np.full(stops, held), leg_cost])
        low = np.concatenate([np.full(2 * stops, -trust_m), np.zeros(stops + count)])
        high = np.concatenate([np.full(2 * stops, trust_m), np.full(stops + count, np.inf)])
        found = least(cost, matrix, np.concatenate([self.limits, leg_limits, disc_limits]), low, high)
        if found is None:
            return None
        moved = self.stops_m + found.x[: 2 * stops].reshape(stops, 2)
        return self._back_in_reach(moved), found.value + self.base_s + self.constant_s

    def _legs(self, trust_m: float) -> tuple[Floats, Floats, Floats]:
        """Return rows over moves and lengths that keep lengths above their legs', limits, and costs by the metre."""
        problem, stops = self.problem, len(self.stops_m)
        steps = np.diff(self.path, axis=0)
        if problem.end_at is not None:
            steps = np.vstack([steps, problem.end_at[0] - self.stops_m[-1]])
        count = len(steps)
        length = np.hypot(*steps.T)
        heading = np.arctan2(steps[:, 1], steps[:, 0])
        spread = 2 * trust_m / np.maximum(length, 1e-9)
        narrow = spread < 0.5
        few = np.concatenate([[0.0, 0.5, -0.5, 1.5, -1.5], np.full(AROUND - 5, np.nan)])
        angles = np.where(
            narrow[:, None], heading[:, None] + few * spread[:, None], np.arange(AROUND) * math.tau / AROUND
        )
        leg, which = np.nonzero(np.isfinite(angles))
        angle = angles[leg, which]
        unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        rows = np.zeros((len(leg), 2 * stops + count))
        at = np.arange(len(leg))
        to, of = leg < stops, leg > 0
        for axis in range(2):
            rows[at[to], 2 * leg[to] + axis] += unit[to, axis]
            rows[at[of], 2 * leg[of] - 2 + axis] -= unit[of, axis]
        rows[at, 2 * stops + leg] = -1.0
        longer = 1.0 + 1.0 / np.maximum(length, 1e-9)
        seconds, ahead = self._leg_s(steps), self._leg_s(steps * longer[:, None])
        by_metre = np.clip(ahead - seconds, 0.0, STEEPEST / problem.speed_m_s)
        self.constant_s = float(seconds.sum() - (by_metre * length).sum()) + problem.home_s
        return rows, -(unit * steps[leg]).sum(axis=1), by_metre

    def _leg_s(self, steps_m: Floats) -> Floats:
        """Return the times of legs to the stops, and of the return behind them."""
        problem, stops = self.problem, len(self.stops_m)
        if problem.end_at is None:
            return problem.leg_s(steps_m, problem.vehicle.speed_m_s)
        back = problem.leg_s(steps_m[stops:], problem.end_at[1])
        return np.concatenate([problem.leg_s(steps_m[:stops], problem.vehicle.speed_m_s), back])

    def _discs(self, trust_m: float) -> tuple[Floats, Floats]:
        """Return rows over moves that keep stops within R of the users that need them, and their limits."""
        radius_m = self.problem.channel.radius_m
        away = np.sqrt(self.squared)
        stop, user = np.nonzero(self.needed & (away + 1.5 * trust_m > radius_m))
        rows = np.zeros((len(stop), 2 * len(self.stops_m)))
        outward = self.offset[stop, user] / np.maximum(away[stop, user], 1e-9)[:, None]
        at = np.arange(len(stop))
        rows[at, 2 * stop], rows[at, 2 * stop + 1] = outward.T
        return rows, np.maximum(radius_m - away[stop, user], 0.0)

    def _back_in_reach(self, stops_m: Floats) -> Floats:
        """Return the stops moved back into the discs that they slipped out of, as discs are round."""
        radius_m, users = self.problem.channel.radius_m, self.problem.users_m
        stop, user = np.nonzero(self.needed)
        for _ in range(3):
            offset = stops_m[stop] - users[user]
            away = np.sqrt((offset**2).sum(axis=1))
            for k in np.flatnonzero(away > radius_m):
                beside = stops_m[stop[k]] - users[user[k]]
                stops_m[stop[k]] = users[user[k]] + beside * min(1.0, radius_m / float(np.hypot(*beside)))
        return stops_m
