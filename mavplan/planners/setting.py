"""What a planner is given beside users and channel: its options, settled for one run."""

from dataclasses import dataclass, field

import numpy as np

from mavplan.mission.wind import Wind
from mavplan.planners.limits import Limits
from mavplan.planners.spread import Spread, lent
from mavplan.progress import Progress, tell_share
from mavplan.scenario.sections import Service, Solver, Vehicle

NODES = 20_000
"""Nodes of a search where nobody says otherwise; some ten seconds."""


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
    returns
        Whether the mission ends at home. Planners of the paper do not ask.
    limits
        Where searches end that could go on. By default after so many nodes, the same on every machine.
    progress
        Called with what is done and what there is to do.
    seed, tried
        Where the draws of other planners begin, and the numbers of clusters that a planner may try of its own; empty:
        those worth a try. As for the planners themselves.
    vehicle, service, wind, in_flight
        How it is flown and served, and whether what users receive in flight counts.
    spread
        Where the regions of a plan for many users are worked out.
    """

    clusters: int
    rng: np.random.Generator
    solver: Solver = "closed-form"
    returns: bool = False
    limits: Limits = field(default_factory=lambda: Limits(nodes=NODES))
    progress: Progress | None = None
    seed: int = 0
    tried: tuple[int, ...] = ()
    vehicle: Vehicle = field(default_factory=Vehicle)
    service: Service = field(default_factory=Service)
    wind: Wind | None = None
    in_flight: bool = False
    spread: Spread = field(default_factory=lent)

    def tell_limits(self) -> None:
        """Tell how much of the time limit is used up: a search ends with it at the latest."""
        tell_share(self.progress, self.limits.used(0))
