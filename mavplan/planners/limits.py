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

    def used(self, nodes: int) -> float:
        """Return the share of the limits that is used up with so many nodes: 1 when a search has to end."""
        by_clock = 0.0 if self.seconds is None else _share(self.elapsed_s, self.seconds)
        by_nodes = 0.0 if self.nodes is None else _share(nodes, self.nodes)
        return max(by_clock, by_nodes)


def _share(used: float, limit: float) -> float:
    return min(used / limit, 1.0) if limit > 0 else 1.0
