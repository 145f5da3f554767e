"""The scenario of what a flight left over: the users not yet served, with what they still need. Pure."""

from dataclasses import replace
from typing import Literal

import numpy as np

from mavplan.proof.model import Proof
from mavplan.scenario.model import UNPAIRED, Scenario


def rest_of(proof: Proof) -> Scenario | None:
    """Return the scenario for the next flight; None where nothing is left.

    A user that is short keeps its mate, which may relay, with a demand of 0 where it has what it needs itself. Pairs
    stay as they were planned, also those that were matched. Pinned stops are left out.
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
    rest = users.some(np.flatnonzero(kept), left_bit)
    matching: Literal["given", "none"] = "given" if (rest.mate != UNPAIRED).any() else "none"
    return replace(scenario, users=rest, d2d=replace(scenario.d2d, matching=matching), stops=(), warnings=())
