"""The scenario of what a flight left over: the users not yet served, with what they still need. Pure."""

import numpy as np

from mavplan.proof.model import Proof
from mavplan.scenario.model import Scenario


def rest_of(proof: Proof) -> Scenario | None:
    """Return the scenario for the next flight; None where nothing is left.

    A user that is short keeps its mate, which may relay, with a demand of 0 where it has what it needs itself. Pairs
    stay as they were planned, also those that were matched. Pinned stops are left out.
    """
    # Whole bits, upwards: what is left must not come out as met by rounding.
    return proof.plan.scenario.left_over(~proof.met, np.ceil(proof.short_bit))
