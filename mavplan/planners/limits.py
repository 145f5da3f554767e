"""How long a search may go on: nodes counted, which is the same on every machine, and seconds by the clock.

The only clock of the planners is in here.
"""

import time
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Limits:
    """Where a search ends even if it has not finished; the clock starts when this is made.

    Attributes
    ----------
    seconds
        By the clock: where it strikes depends on the machine. None: no limit.
    nodes
        Of a search tree. None: no limit.
    """

    seconds: float | None = None
    nodes: int | None = None
    _begin_s: float = field(default_factory=time.monotonic)

    @property
    def elapsed_s(self) -> float:
        """Seconds since this was made."""
        return time.monotonic() - self._begin_s

    @property
    def share(self) -> float:
        """Share of the seconds that is used up, 0 without such a limit."""
        if self.seconds is None:
            return 0.0
        return min(self.elapsed_s / self.seconds, 1.0) if self.seconds > 0 else 1.0

    def reached(self, nodes: int) -> bool:
        """Return whether a search with so many nodes has to end."""
        return (self.nodes is not None and nodes >= self.nodes) or self.share >= 1.0
