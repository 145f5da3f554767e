"""A plan's stops, in their order, cut into the fewest sorties that each come home with the reserve. Pure.

Minimal by a dynamic programme over consecutive stops: the number of sorties first, then the time in the air. A hold
that one battery does not last is flown as full sorties to that stop alone, and what is left of it as part of another.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mavplan.mission.autopilots import AutopilotRules
from mavplan.sorties.ways import Budget, Cost, Ways

CAUTION = 1e-4
"""Part of the budget that is not planned with: what rounding places to 1e-7 degrees may cost."""


@dataclass(frozen=True)
class Leaf:
    """One sortie: which stops, and how long at each."""

    stops: tuple[int, ...]
    holds_s: tuple[float, ...]


@dataclass(frozen=True)
class TooFar:
    """A stop from which no sortie comes home with the reserve, even with the least hold: what that would take."""

    stop: int
    needs: Cost


def with_caution(budget: Budget) -> Budget:
    """Return what is planned with."""
    return Budget(budget.seconds * (1 - CAUTION), budget.wh * (1 - CAUTION))


def unreachable(ways: Ways, budget: Budget, rules: AutopilotRules) -> list[TooFar]:
    """Return every stop that no sortie serves."""
    least = ways.hold(rules.min_hold_s)
    found = [TooFar(stop, ways.out(stop).plus(ways.home(stop)).plus(least)) for stop in range(len(ways))]
    return [far for far in found if not budget.allows(far.needs)]


def split(
    ways: Ways,
    holds_s: Sequence[float],
    budget: Budget,
    rules: AutopilotRules,
    order: Sequence[int] | None = None,
) -> list[Leaf] | None:
    """Return the sorties in flying order; None where a stop is too far for any.

    Parameters
    ----------
    ways
        Between the stops.
    holds_s
        (M,) as the autopilot stores them.
    budget
        Of a sortie.
    rules
        The autopilot.
    order
        The stops to visit, in this order; None: all of them as they are numbered.
    """
    stops = list(range(len(ways)) if order is None else order)
    alone: dict[int, list[float]] = {}
    core_s: dict[int, float] = {}
    for stop in stops:
        pieces = _pieces(ways, stop, holds_s[stop], budget, rules)
        if pieces is None:
            return None
        core_s[stop], alone[stop] = pieces
    groups = _fewest(ways, stops, core_s, budget)
    found: list[Leaf] = []
    for first, end in pairwise(groups):
        group = stops[first:end]
        full = [Leaf((stop,), (hold_s,)) for stop in group for hold_s in alone[stop]]
        found.append(Leaf(tuple(group), tuple(core_s[stop] for stop in group)))
        # Every stop is first visited in its order.
        found[-1:] = [*full, found[-1]] if len(group) == 1 else [found[-1], *full]
    return found


def _pieces(
    ways: Ways, stop: int, hold_s: float, budget: Budget, rules: AutopilotRules
) -> tuple[float, list[float]] | None:
    """Return what a stop is held within a sortie of several, and the holds of full sorties to it alone."""
    way = ways.out(stop).plus(ways.home(stop))
    if budget.allows(way.plus(ways.hold(hold_s))):
        return hold_s, []
    per_s = ways.hold(1.0)
    longest_s = budget.seconds - way.seconds
    if per_s.wh > 0:
        longest_s = min(longest_s, (budget.wh - way.wh) / per_s.wh)
    step_s, least = rules.hold_step_s, round(rules.min_hold_s / rules.hold_step_s)
    most = math.floor(longest_s / step_s + 1e-9) if longest_s > 0 else 0
    if most < least:
        return None
    steps = round(hold_s / step_s)
    alone: list[int] = []
    while steps > most:
        # What is left must be a hold that the autopilot stores.
        alone.append(min(most, max(steps - least, least)))
        steps -= alone[-1]
    pieces_s = [round(piece * step_s, 6) for piece in (*alone, max(steps, least))]
    # As float32, which is what the autopilot is given, the pieces must not be less than the whole.
    if sum(float(np.float32(piece_s)) for piece_s in pieces_s) < float(np.float32(hold_s)):
        longer_s = round(pieces_s[-1] + step_s, 6)
        pieces_s = [*pieces_s[:-1], longer_s] if longer_s <= most * step_s else [*pieces_s, rules.min_hold_s]
    return pieces_s[-1], pieces_s[:-1]


def _fewest(ways: Ways, stops: list[int], hold_s: dict[int, float], budget: Budget) -> list[int]:
    """Return where sorties begin among the stops, and their number at the end."""
    count = len(stops)
    best: list[tuple[int, float]] = [(0, 0.0)] + [(count + 1, math.inf)] * count
    before = [0] * (count + 1)
    for first in range(count):
        outward = ways.out(stops[first]).plus(ways.hold(hold_s[stops[first]]))
        for end in range(first + 1, count + 1):
            last = stops[end - 1]
            if end - 1 > first:
                outward = outward.plus(ways.leg(stops[end - 2], last)).plus(ways.hold(hold_s[last]))
            if not budget.allows(outward):
                break
            whole = outward.plus(ways.home(last))
            # Further on it may be nearer to home: only the way out ends the search.
            found = best[first][0] + 1, best[first][1] + whole.seconds
            if budget.allows(whole) and found < best[end]:
                best[end], before[end] = found, first
    cuts = [count]
    while cuts[-1] > 0:
        cuts.append(before[cuts[-1]])
    return cuts[::-1]
