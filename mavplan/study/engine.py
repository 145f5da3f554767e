"""The cases of a study, worked out by whoever `mavplan.workers` gives: here, processes, or a cluster.

Rows come back in any order, batch by batch, and are the same bits wherever they were worked out.
"""

import contextlib
import itertools
from collections.abc import Generator, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mavplan.planners.one_thread import one_thread
from mavplan.progress import Progress
from mavplan.study.cases import Case, Row, run_case
from mavplan.study.settings import Settings
from mavplan.study.store import open_store
from mavplan.workers.crew import crew_of

if TYPE_CHECKING:
    from mavplan.errors import Problem

Task = tuple[Case, tuple[str, ...]]
"""A case, and the planners that are still to run on it."""

BATCH = 8
"""Cases that travel and are flushed to disk together: a fraction of a second of work."""


def run_study(
    folder: Path,
    settings: Settings,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: "Progress | None" = None,
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
    batches = list(_batched(tasks, BATCH))
    if cluster is None and len(batches) == 1:
        jobs = 1
    with (
        crew_of(jobs, cluster, kept="what was finished is kept") as crew,
        contextlib.closing(crew.results(run_batch, batches)) as found,
    ):
        yield from found


def run_batch(batch: Sequence[Task]) -> list[Row]:
    """Return the rows of a batch of cases and planners; what every worker does."""
    with one_thread():
        return [row for case, planners in batch for row in run_case(case, planners)]


def _batched(tasks: Iterable[Task], size: int) -> Iterator[tuple[Task, ...]]:
    """Give the tasks in tuples of ``size``; the last may be shorter."""
    remaining = iter(tasks)
    while batch := tuple(itertools.islice(remaining, size)):
        yield batch
