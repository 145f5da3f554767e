"""Whom one vehicle's batteries leave over, the others are offered, each from its own home."""

from collections.abc import Sequence

import numpy as np

from mavplan.errors import InputError
from mavplan.fleet.crews import share_of
from mavplan.fleet.rounds import Cut
from mavplan.plan import HoverStyle, Plan, make_plan
from mavplan.scenario.model import Scenario
from mavplan.sorties.make import sorties_of

TIMES = 3
"""How often each vehicle is asked at most."""

WORTHWHILE_BIT = 1.0
"""A vehicle must serve more of the weighted demand by this, or more users of equal worth."""


def offered(
    cut: Cut, flights: Sequence[Plan | None], own: Sequence[Scenario], hover: HoverStyle, most: int
) -> Cut:
    """Return sorties that serve at least as much of the weighted demand: all that is left is offered to each in turn.

    A vehicle that is offered users is planned anew for these and its own, and may leave others over for them; it takes
    them where that is worth more.

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

    def worth(names: set[str]) -> tuple[float, int]:
        return float(users.weighted_bit[users.named(names)].sum()), len(names)

    for _ in range(TIMES):
        before = set(left)
        for vehicle, scenario in enumerate(own):
            if not left:
                break
            mine = {name for plan in sorties[vehicle] for name in plan.scenario.users.names}
            flight = flights[vehicle]
            kept = np.flatnonzero(users.named(mine | left))
            asked = share_of(scenario, kept, () if flight is None else flight.scenario.stops)
            try:
                found = sorties_of(make_plan(asked, hover), hover, most)
            except InputError:
                continue
            served = (mine | left) - set(found.not_served)
            (bits, count), (now_bits, now_count) = worth(served), worth(mine)
            more_bits = bits - now_bits
            if more_bits > WORTHWHILE_BIT or (more_bits > -WORTHWHILE_BIT and count > now_count):
                sorties[vehicle] = found.plans
                left = (left | mine) - served
        if left == before:
            break
    return Cut(tuple(sorties), tuple(name for name in users.names if name in left))
