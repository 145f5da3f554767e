"""Whom one vehicle's batteries leave over, the others are offered, each from its own home."""

from collections.abc import Sequence

import numpy as np

from mavplan.errors import InputError
from mavplan.fleet.crews import share_of
from mavplan.fleet.rounds import Cut
from mavplan.plan import HoverStyle, Plan, make_plan
from mavplan.scenario.model import UNPAIRED, Scenario, Users
from mavplan.sorties.make import sorties_of

TIMES = 3
"""How often each vehicle is asked at most."""


def offered(
    cut: Cut, flights: Sequence[Plan | None], own: Sequence[Scenario], hover: HoverStyle, most: int
) -> Cut:
    """Return sorties that serve at least as much of the weighted demand: all that is left is offered to each in turn.

    A vehicle that is offered users is planned anew for these and its own, and may leave others over for them; it takes
    them where that is worth more, or as much and they are more users. Whom a pinned stop of another vehicle is above it
    is not offered.

    Parameters
    ----------
    cut
        The sorties of each vehicle, and who is left over.
    flights
        What each would fly with a battery that lasts; None for one that has nothing to do.
    own
        The scenario as each vehicle has it.
    hover
        What a stop is made of.
    most
        How many sorties each has at most.
    """
    users, sorties, left = own[0].users, list(cut.sorties), set(cut.not_served)
    pinned = [_pinned(flight, users) for flight in flights]
    asked: set[tuple[int, frozenset[str]]] = set()

    def worth(names: set[str]) -> tuple[int, int]:
        """Return the weighted demand of some, in whole bits, and how many they are."""
        return round(float(users.weighted_bit[users.named(names)].sum())), len(names)

    for _ in range(TIMES):
        before = set(left)
        for vehicle, scenario in enumerate(own):
            mine = {name for plan in sorties[vehicle] for name in plan.scenario.users.names}
            open_to = left.difference(*pinned[:vehicle], *pinned[vehicle + 1 :])
            question = vehicle, frozenset(mine | open_to)
            if not open_to or question in asked:
                continue
            asked.add(question)
            flight = flights[vehicle]
            kept = np.flatnonzero(users.named(question[1]))
            share = share_of(scenario, kept, () if flight is None else flight.scenario.stops)
            try:
                found = sorties_of(make_plan(share, hover), hover, most)
            except InputError:
                continue
            served = (mine | open_to) - set(found.not_served)
            if worth(served) > worth(mine):
                sorties[vehicle] = found.plans
                left = (left | mine) - served
        if left == before:
            break
    return Cut(tuple(sorties), users.names_of(users.named(left)))


def _pinned(flight: Plan | None, users: Users) -> set[str]:
    """Return the users that pinned stops of a flight are above, and their mates: they are its business alone."""
    above = [] if flight is None else [stop.user for stop in flight.scenario.stops if stop.user is not None]
    theirs = users.named(above)
    theirs[users.mate[theirs & (users.mate != UNPAIRED)]] = True
    return set(users.names_of(theirs))
