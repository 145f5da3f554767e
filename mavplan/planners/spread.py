"""Where independent pieces of one plan are worked out: in this process, unless somebody lends other hands.

The plan is the same wherever that is, so who plans does not ask: `hands` lends them for a while.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol


class Spread(Protocol):
    """Gives the results of a function for each of many tasks, in the tasks' order, as they become ready."""

    def __call__(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterable[Any]:
        """Return the results; function and tasks can be pickled, and one task's result depends on it alone."""
        ...


def spread_here(function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Any]:
    """Give the results, worked out in this process."""
    return map(function, tasks)


_lent: ContextVar[Spread] = ContextVar("hands", default=spread_here)


@contextmanager
def hands(spread: Spread) -> Iterator[None]:
    """Lend hands to all that is planned meanwhile."""
    before = _lent.set(spread)
    try:
        yield
    finally:
        _lent.reset(before)


def lent() -> Spread:
    """Return what works out the pieces of a plan at present."""
    return _lent.get()
