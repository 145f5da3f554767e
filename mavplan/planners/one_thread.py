"""One thread for everything that adds up: several do it in an order of their own, and the last digits with it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_lock = threading.Lock()
_inside = 0
_limits: Any = None


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS and OpenMP of this process to one thread.

    The limits belong to the whole process, so the first of several threads that come here sets them and the last to
    leave lifts them: none is left with more than one while it is at work.
    """
    global _inside, _limits  # noqa: PLW0603 - as the limits themselves are
    # Only libraries that are loaded can be limited: all that planners use, before the first of them runs.
    import scipy.optimize
    import scipy.spatial  # noqa: F401
    import sklearn.cluster  # noqa: F401
    from threadpoolctl import threadpool_limits

    with _lock:
        if _inside == 0:
            _limits = threadpool_limits(1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                _limits.restore_original_limits()
