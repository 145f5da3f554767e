"""The hover of plans that differ from one plan by a stop or two: a few pivots from its programme, not one from scratch.

Order does not matter to hover, so a plan counts as the set of its places. Places that it has not any more are
constraints of the dual less, one that is new is a constraint more, and needs that in-flight service or relaying changed
are another gain.
"""

import numpy as np

from mavplan.planners.geometry import as_numbers, as_places
from mavplan.planners.simplex import NOTHING, Tableaux
from mavplan.planners.time_problem import TimeProblem
from mavplan.planners.time_programme import least_hover
from mavplan.scenario.model import Bools, Floats

MOST_GONE = 2
"""Places that a plan may lack, and it may have one more."""


class Nearby:
    """What is known of plans near one.

    Parameters
    ----------
    stops_m
        (M, 2) the plan.

    Attributes
    ----------
    prices
        (N,) of a second of need there; with TDMA nothing.
    """

    def __init__(self, problem: TimeProblem, stops_m: Floats) -> None:
        self.problem = problem
        self._places = np.unique(as_numbers(stops_m))
        rates = problem.rates(as_places(self._places))[None]
        wants = problem.wants_of(stops_m[None], rates)[0]
        self._needs = np.where(np.isfinite(wants), np.maximum(wants, 0.0), 0.0)
        self.prices = np.zeros(len(self._needs))
        if not problem.tdma:
            self._tableaux = Tableaux.of(rates, self._needs[None])
            self._tableaux.maximise()
            self.prices = self._tableaux.values()[0][0, : len(self._needs)]

    def total_s(self, flight_s: Floats, stops_m: Floats, rates: Floats, wants: Floats) -> Floats:
        """Return (B,) flight and hover of plans (B, M, 2) with these rates (B, M, N) and finite wants (B, N)."""
        if self.problem.tdma:
            return self.problem.hovering(flight_s, rates, wants).total_s
        same = as_numbers(stops_m)[:, :, None] == self._places
        gone, new = ~same.any(axis=1), ~same.any(axis=2)
        total_s = np.full(len(stops_m), np.inf)
        near = np.flatnonzero((gone.sum(axis=1) <= MOST_GONE) & (new.sum(axis=1) <= 1))
        fresh = rates[near, new[near].argmax(axis=1)] * new[near].any(axis=1)[:, None]
        total_s[near] = self._hover_s(gone[near], fresh, np.maximum(wants[near], 0.0))
        far = np.flatnonzero(np.isinf(total_s))
        if len(far):
            total_s[far] = least_hover(rates[far], wants[far]).total_s
        total_s += flight_s
        return total_s

    def _hover_s(self, gone: Bools, fresh: Floats, needs: Floats) -> Floats:
        """Return (B,) the hover without some places (B, P) and with rates (B, N) at a new one; infinite: not known."""
        found = self._tableaux.taken(np.zeros(len(gone), dtype=np.int64)).with_constraint(fresh)
        sure = found.make_feasible()
        # Only now, as some users may be reached from the new place alone.
        slacks = np.where(gone, len(self._needs) + np.arange(gone.shape[1]), NOTHING)
        for slack in np.sort(slacks, axis=1)[:, -MOST_GONE:].T:
            sure &= found.without(slack)
        if (needs != self._needs).any():
            found.set_gain(needs)
        sure &= found.maximise()
        hover_s: Floats = np.where(sure, found.value, np.inf)
        return hover_s
