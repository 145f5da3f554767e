"""What a planner is given beside users and channel: its options, settled for one run."""

from dataclasses import dataclass

import numpy as np

from mavplan.scenario.sections import Solver


@dataclass(frozen=True)
class Setting:
    """Options of one run.

    Attributes
    ----------
    clusters
        K of the clustering phase; planners without one ignore it.
    rng
        Draws all that is random.
    solver
        How the convex steps are solved: in closed form, or by CVXPY as the reference.
    """

    clusters: int
    rng: np.random.Generator
    solver: Solver = "closed-form"
