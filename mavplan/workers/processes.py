"""Processes of this machine as workers, by joblib: they end with their parent, interrupts are for it alone."""

import contextlib
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing import resource_tracker
from typing import Any

from mavplan.errors import MavplanError
from mavplan.workers.crew import alone

ORPHANED_S = 0.5
"""A worker process looks so often whether its parent is still there."""


@contextlib.contextmanager
def on_processes(processes: int, kept: str = "") -> Iterator["Processes"]:
    """Give a crew of processes, which end with it; `mavplan.workers.crew.crew_of` explains."""
    from joblib.externals.loky import get_reusable_executor

    crew = Processes(processes, kept)
    try:
        yield crew
    finally:
        if crew.called:
            get_reusable_executor().shutdown(wait=True, kill_workers=crew.left_off)


class Processes:
    """A crew of processes.

    Attributes
    ----------
    called
        Whether there are processes.
    left_off
        Whether work was left before its end.
    """

    def __init__(self, processes: int, kept: str = "") -> None:
        self._processes, self._kept = processes, kept
        self.called = self.left_off = False

    def results(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Generator[Any]:
        """Give the results; as `Crew` says."""
        import joblib
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        self.called = True
        with joblib.parallel_config(
            "loky", inner_max_num_threads=1, initializer=_begin_worker, initargs=(os.getpid(),)
        ):
            parallel = joblib.Parallel(n_jobs=self._processes, batch_size=1, return_as="generator_unordered")
        with interrupts_kept_here():
            found = parallel(joblib.delayed(alone)(function, task) for task in tasks)
        finished = False
        try:
            for result in found:  # noqa: UP028 - handed over with "from", it would be closed before the warning is silenced
                yield result
            finished = True
        except TerminatedWorkerError as error:
            kept = f"{self._kept}, " if self._kept else ""
            raise MavplanError(
                f"a worker process was killed, perhaps for want of memory; {kept}"
                "run the same command again, with fewer --jobs"
            ) from error
        finally:
            self.left_off = self.left_off or not finished
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message=".*tasks", category=UserWarning)  # that are dropped
                found.close()


@contextlib.contextmanager
def interrupts_kept_here() -> Iterator[None]:
    """Keep an interrupt at the keyboard, which goes to all processes of a terminal, from those started meanwhile.

    They inherit that it is blocked, as do the threads that will start more of them; this thread gets it afterwards.
    """
    # Python's own helper process unblocks the signal in the thread that first needs it: not one of those below.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker(parent: int) -> None:
    """Make this worker process end with its parent, however that ends."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(ORPHANED_S)
        os._exit(1)

    threading.Thread(target=watch, name="orphan-watch", daemon=True).start()
