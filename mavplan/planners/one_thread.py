"""One thread for everything that adds up: several do it in an order of their own, and the last digits with it."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_lock = threading.Lock()
_inside = 0
_limits: list[Any] = []


@contextmanager
def one_thread(*, clustering: bool = True) -> Iterator[None]:
    """Limit BLAS and OpenMP of this process to one thread.

    The limits belong to the whole process, so the first of several threads that come here sets them and the last to
    leave lifts them: none is left with more than one while it is at work.

    Parameters
    ----------
    clustering
        Whether scikit-learn may be used, which takes a second to load; whoever uses it inside asks for it again.
    """
    global _inside  # noqa: PLW0603 - as the limits themselves are
    # Only libraries that are loaded can be limited: all that planners use, before the first of them runs.
    import scipy.optimize
    import scipy.spatial  # noqa: F401
    from threadpoolctl import threadpool_limits

    with _lock:
        fresh = clustering and "sklearn.cluster" not in sys.modules
        if fresh:
            import sklearn.cluster  # noqa: F401
        if _inside == 0 or fresh:
            _limits.append(threadpool_limits(1))
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            while _inside == 0 and _limits:
                _limits.pop().restore_original_limits()
