"""Where the cases of a study run: here by processes (joblib), or on a cluster (Dask distributed).

Rows come back in any order, batch by batch, and are the same bits wherever they were worked out: a case knows all
that it needs, one thread adds up its sums, and a worker with other versions of the numerical packages is refused.
"""

import contextlib
import itertools
import logging
import os
import re
import signal
import threading
import time
import warnings
from collections.abc import Generator, Iterable, Iterator, Sequence
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavplan.errors import InputError, MavplanError
from mavplan.planners.one_thread import one_thread
from mavplan.study.cases import Case, Row, run_case
from mavplan.study.settings import Settings
from mavplan.study.store import open_store, versions

if TYPE_CHECKING:
    from collections.abc import Callable

    from distributed import Client

    from mavplan.errors import Problem

Task = tuple[Case, tuple[str, ...]]
"""A case, and the planners that are still to run on it."""

BATCH = 8
"""Cases that travel and are flushed to disk together: a fraction of a second of work."""

LOCAL_WORKERS = 2
"""Workers of ``--cluster local`` where no number is given."""

ORPHANED_S = 0.5
"""A worker process looks so often whether its parent is still there."""

CONNECT_S = 10.0
QUEUED_PER_THREAD = 4
"""Batches that wait at a cluster for each of its threads."""


def run_study(
    folder: Path,
    settings: Settings,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: "Callable[[int, int], None] | None" = None,
) -> "tuple[list[Row], tuple[Problem, ...]]":
    """Run what is missing of a study and return all of it.

    Parameters
    ----------
    folder
        Where the study lives; one that was interrupted or that these settings extend goes on.
    settings
        What to vary.
    jobs
        Processes on this machine; None: one a core. With a local cluster the number of its workers.
    cluster
        None: this machine; ``local``: a Dask cluster made here; ``tcp://host:port``: the scheduler of one.
    progress
        Called with rows done and rows in all, on every batch.

    Returns
    -------
    rows
        In the order of cases, and of the settings' planners within a case.
    warnings
        What was noticed on opening the folder.

    Raises
    ------
    InputError
        The folder holds another study, or the cluster cannot be used.
    MavplanError
        A worker died. As after an interrupt, everything that was finished is kept.
    """
    with open_store(folder, settings) as store:
        in_all = sum(1 for _ in settings.cases()) * len(settings.planners)

        def tell() -> None:
            if progress is not None:
                progress(len(store.rows), in_all)

        missing = []
        for case in settings.cases():
            planners = tuple(name for name in settings.planners if (case, name) not in store.rows)
            if planners:
                missing.append((case, planners))
        tell()
        if missing:
            with contextlib.closing(run_tasks(missing, jobs=jobs, cluster=cluster)) as batches:
                for rows in batches:
                    store.append(rows)
                    tell()
        place = {name: index for index, name in enumerate(settings.planners)}
        rows = sorted(store.rows.values(), key=lambda row: (row.case, place[row.planner]))
        return rows, store.warnings


def run_tasks(
    tasks: Sequence[Task], *, jobs: int | None = None, cluster: str | None = None
) -> Generator[list[Row]]:
    """Give the rows of the tasks, a batch at a time in the order in which they are finished; `run_study` explains.

    Close the iterator where it is not run to its end: processes and connections close with it.
    """
    batches = [list(batch) for batch in _batched(tasks, BATCH)]
    if cluster is not None:
        return _on_dask(batches, cluster, jobs)
    import joblib

    processes = min(jobs or joblib.cpu_count(), len(batches))
    return _on_processes(batches, processes) if processes > 1 else map_here(batches)


def run_batch(batch: Sequence[Task], made_with: dict[str, str] | None = None) -> list[Row]:
    """Return the rows of a batch; what every worker does.

    Parameters
    ----------
    batch
        Cases and planners.
    made_with
        Versions that the worker must have; None where it runs from the same installation.
    """
    if made_with is not None and made_with != versions():
        here = ", ".join(f"{name} {number}" for name, number in versions().items())
        there = ", ".join(f"{name} {number}" for name, number in made_with.items())
        raise InputError(f"a worker of the cluster has {here}; the same numbers come only from {there}")
    with one_thread():
        return [row for case, planners in batch for row in run_case(case, planners)]


def map_here(batches: Iterable[Sequence[Task]]) -> Generator[list[Row]]:
    """Give the rows of each batch, run in this process."""
    for batch in batches:
        yield run_batch(batch)


def _on_processes(batches: Sequence[Sequence[Task]], processes: int) -> Generator[list[Row]]:
    """Give the rows of each batch, run by processes of this machine."""
    import joblib
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    with joblib.parallel_config(
        "loky", inner_max_num_threads=1, initializer=_begin_worker, initargs=(os.getpid(),)
    ):
        parallel = joblib.Parallel(n_jobs=processes, batch_size=1, return_as="generator_unordered")
    with _interrupts_kept_here():
        found = parallel(joblib.delayed(run_batch)(batch) for batch in batches)
    finished = False
    try:
        for rows in found:  # noqa: UP028 - handed over with "from", it would be closed before the warning is silenced
            yield rows
        finished = True
    except TerminatedWorkerError as error:
        raise MavplanError(
            "a worker process was killed, perhaps for want of memory; what was finished is kept: "
            "run the same command again, with fewer --jobs"
        ) from error
    finally:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*tasks", category=UserWarning)  # that are dropped
            found.close()
        get_reusable_executor().shutdown(wait=True, kill_workers=not finished)


@contextlib.contextmanager
def _interrupts_kept_here() -> Iterator[None]:
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


def _on_dask(batches: Sequence[Sequence[Task]], cluster: str, jobs: int | None) -> Generator[list[Row]]:
    """Give the rows of each batch, run by the workers of a cluster."""
    try:
        from distributed import KilledWorker, as_completed
        from distributed.utils import silence_logging_cmgr
    except ImportError as error:
        raise InputError("--cluster needs Dask distributed: pip install 'mavplan[study]'") from error
    made_with = versions()
    waiting = iter(batches)
    with contextlib.ExitStack() as stack:
        # What goes wrong is raised, and said once.
        stack.enter_context(silence_logging_cmgr(logging.CRITICAL))
        client = _connect(stack, cluster, jobs)
        running = as_completed(loop=client.loop, with_results=True)

        def fill() -> None:
            # A few batches a thread keep the workers busy; all at once would drown the scheduler of a long study.
            room = QUEUED_PER_THREAD * sum(client.nthreads().values()) - running.count()
            for batch in itertools.islice(waiting, max(room, 1)):
                running.add(client.submit(run_batch, batch, made_with, pure=False))

        fill()
        try:
            for number, (_, rows) in enumerate(running, start=1):
                if isinstance(rows, BaseException):  # so it tells of batches that nobody works on any more
                    raise OSError(str(rows))
                if number % QUEUED_PER_THREAD == 0 or running.is_empty():
                    fill()
                yield rows
        except (KilledWorker, OSError) as error:
            reason = " ".join(str(error).split()).rstrip(".")
            message = f"the cluster was lost: {reason}; what was finished is kept: run the same command again"
            raise MavplanError(message) from error


def _connect(stack: contextlib.ExitStack, cluster: str, jobs: int | None) -> "Client":
    """Return a client of the cluster, closed with the stack."""
    from distributed import Client, LocalCluster

    if cluster == "local":
        with _interrupts_kept_here():
            made: Any = LocalCluster(
                n_workers=jobs or LOCAL_WORKERS,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",  # a free port: the usual one may be taken
                silence_logs=logging.ERROR,
            )
        stack.enter_context(made)
        return stack.enter_context(Client(made, set_as_default=False))
    no_scheduler = (
        f"no Dask scheduler answers at {cluster!r}: allowed is 'local' or the address that 'dask scheduler' prints, "
        "tcp://host:port"
    )
    if not re.fullmatch(r"(tcp|tls)://[^/\s]+:[0-9]+", cluster):
        raise InputError(no_scheduler)
    try:
        client = stack.enter_context(Client(cluster, timeout=CONNECT_S, set_as_default=False))
    except (OSError, ValueError) as error:
        raise InputError(no_scheduler) from error
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError as error:
        message = f"the Dask scheduler at {cluster} has no workers: start some with 'dask worker {cluster}'"
        raise InputError(message) from error
    return client


def _batched(tasks: Iterable[Task], size: int) -> Iterator[tuple[Task, ...]]:
    """Give the tasks in tuples of ``size``; the last may be shorter."""
    remaining = iter(tasks)
    while batch := tuple(itertools.islice(remaining, size)):
        yield batch
