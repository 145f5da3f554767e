"""The scenario of what a flight left over: the users not yet served, with what they still need. Pure."""

from dataclasses import replace
from typing import Literal

import numpy as np

from mavplan.proof.model import Proof
from mavplan.scenario.model import UNPAIRED, Floats, Ints, Scenario, Users


def rest_of(proof: Proof) -> Scenario | None:
    """Return the scenario for the next flight; None where nothing is left.

    A user that is short keeps its mate, which may relay, with a demand of 0 where it has what it needs itself. Pairs
    stay as they were planned, also those that were matched.
    """
    scenario, users = proof.plan.scenario, proof.plan.scenario.users
    short = ~proof.met
    if not short.any():
        return None
    kept = short.copy()
    paired = np.flatnonzero(short & (users.mate != UNPAIRED))
    kept[users.mate[paired]] = True
    # Whole bits, upwards: what is left must not come out as met by rounding.
    left_bit = np.where(short, np.ceil(proof.short_bit), 0.0)
    rest = _some_users(users, np.flatnonzero(kept), left_bit)
    matching: Literal["given", "none"] = "given" if (rest.mate != UNPAIRED).any() else "none"
    return replace(scenario, users=rest, d2d=replace(scenario.d2d, matching=matching), warnings=())


def _some_users(users: Users, kept: Ints, demand_bit: Floats) -> Users:
    """Return K of N users by their indices with other demands, (N,); a pair of which one is left out is none."""
    place = np.full(len(users) + 1, UNPAIRED, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    mate = users.mate[kept]
    return replace(
        users,
        names=tuple(users.names[number] for number in kept),
        lat_deg=users.lat_deg[kept],
        lon_deg=users.lon_deg[kept],
        xy_m=users.xy_m[kept],
        demand_bit=demand_bit[kept],
        mate=np.where(mate == UNPAIRED, UNPAIRED, place[mate]),
    )
