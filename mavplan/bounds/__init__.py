"""What no plan can be below, and proofs of it that can be checked without the planner that found them.

Nothing here knows how a bound was found.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from mavplan.progress import Progress

Objective = Literal["path_m", "tour_m", "mission_s"]
"""Length of the way from home to the last stop; of that and the way back home; mission time."""

SHORTEST = 1.001e-6
"""A gap up to this is none."""


@dataclass(frozen=True, eq=False)
class Bound:
    """A plan's figure beside the one that no plan is below.

    Attributes
    ----------
    objective
        What figure.
    plan, bound
        That of the plan, and the bound; both before rounding.
    certificate
        Function that gives the proof as an object for JSON, and tells what is done and what there is to do; None where
        there is no proof.
    """

    objective: Objective
    plan: float
    bound: float
    certificate: Callable[[Progress | None], dict[str, Any]] | None = None

    @property
    def gap(self) -> float:
        """(plan − bound)/plan; 0 where the plan's figure is 0."""
        return (self.plan - self.bound) / self.plan if self.plan > 0.0 else 0.0

    @property
    def proved(self) -> bool:
        """Whether no plan is better, to a millionth."""
        return self.gap <= SHORTEST
