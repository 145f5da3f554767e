"""A crew of workers, which stays together while one piece of work after the other is done."""

import contextlib
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, Protocol

from mavplan.planners.one_thread import one_thread
from mavplan.planners.spread import hands


class Crew(Protocol):
    """Works tasks out."""

    def results(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Generator[Any]:
        """Give the function's result for each task, in the order in which they are finished.

        Close the generator where it is not run to its end.

        Raises
        ------
        MavplanError
            A worker died.
        """
        ...


class Here:
    """A crew of this process alone."""

    def results(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Generator[Any]:
        """Give the results; as `Crew` says."""
        for task in tasks:
            yield alone(function, task)


@contextlib.contextmanager
def crew_of(jobs: int | None = None, cluster: str | None = None, *, kept: str = "") -> Iterator[Crew]:
    """Give a crew; its processes and connections close with it.

    Parameters
    ----------
    jobs
        Processes on this machine; None: one a core. With a local cluster the number of its workers.
    cluster
        None: this machine; ``local``: a Dask cluster made here; ``tcp://host:port``: the scheduler of one.
    kept
        What to add to the message where a worker is lost: what of the work is not lost with it.

    Raises
    ------
    InputError
        The cluster cannot be used.
    """
    if cluster is not None:
        from mavplan.workers.cluster import on_cluster

        with on_cluster(cluster, jobs, kept) as found:
            yield found
        return
    import joblib

    processes = jobs or joblib.cpu_count()
    if processes == 1:
        yield Here()
        return
    from mavplan.workers.processes import on_processes

    with on_processes(processes, kept) as found:
        yield found


@contextlib.contextmanager
def lending(jobs: int | None = None, cluster: str | None = None) -> Iterator[None]:
    """Lend a crew to whatever is planned meanwhile; one of this machine is called together when it is first needed."""
    with contextlib.ExitStack() as stack:
        found: list[Crew] = []
        if cluster is not None:
            found.append(stack.enter_context(crew_of(jobs, cluster)))

        def spread(function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Any]:
            if len(tasks) < 2 and cluster is None:
                return (alone(function, task) for task in tasks)
            if not found:
                found.append(stack.enter_context(crew_of(jobs)))
            return in_order(found[0], function, tasks)

        with hands(spread):
            yield


def in_order(crew: Crew, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Any]:
    """Give the results in the order of the tasks."""
    numbered = [(number, function, task) for number, task in enumerate(tasks)]
    ready: dict[int, Any] = {}
    wanted = 0
    with contextlib.closing(crew.results(_numbered, numbered)) as results:
        for number, result in results:
            ready[number] = result
            while wanted in ready:
                yield ready.pop(wanted)
                wanted += 1


def _numbered(task: tuple[int, Callable[[Any], Any], Any]) -> tuple[int, Any]:
    number, function, own = task
    return number, function(own)


def alone(function: Callable[[Any], Any], task: Any) -> Any:
    """Return the result of a task, its sums added up by one thread: what every worker does."""
    with one_thread(clustering=False):
        return function(task)
