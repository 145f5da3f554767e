"""The workers of a Dask cluster: one made here, or one whose scheduler is given."""

import contextlib
import itertools
import logging
import re
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from mavplan.errors import InputError, MavplanError
from mavplan.workers.crew import alone
from mavplan.workers.processes import interrupts_kept_here
from mavplan.workers.versions import ALL_CODE, versions

if TYPE_CHECKING:
    from distributed import Client

LOCAL_WORKERS = 2
"""Workers of ``--cluster local`` where no number is given."""

CONNECT_S = 10.0
QUEUED_PER_THREAD = 4
"""Tasks that wait at a cluster for each of its threads."""


@contextlib.contextmanager
def on_cluster(cluster: str, jobs: int | None, kept: str = "") -> Iterator["Cluster"]:
    """Give the workers of a cluster as a crew; `mavplan.workers.crew.crew_of` explains."""
    try:
        from distributed.utils import silence_logging_cmgr
    except ImportError as error:
        raise InputError("--cluster needs Dask distributed: pip install 'mavplan[study]'") from error
    with contextlib.ExitStack() as stack:
        # What goes wrong is raised, and said once.
        stack.enter_context(silence_logging_cmgr(logging.CRITICAL))
        yield Cluster(_connect(stack, cluster, jobs), kept)


class Cluster:
    """A crew at the other end of a client."""

    def __init__(self, client: "Client", kept: str = "") -> None:
        self._client, self._kept = client, kept

    def results(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Generator[Any]:
        """Give the results; as `Crew` says."""
        from distributed import KilledWorker, as_completed

        client = self._client
        made_with = versions(ALL_CODE)
        waiting = iter(tasks)
        running = as_completed(loop=client.loop, with_results=True)

        def fill() -> None:
            # A few tasks a thread keep the workers busy; all at once would drown the scheduler of long work.
            room = QUEUED_PER_THREAD * sum(client.nthreads().values()) - running.count()
            for task in itertools.islice(waiting, max(room, 1)):
                running.add(client.submit(checked, function, task, made_with, pure=False))

        fill()
        try:
            for number, (_, result) in enumerate(running, start=1):
                if isinstance(result, BaseException):  # so it tells of tasks that nobody works on any more
                    raise OSError(str(result))
                if number % QUEUED_PER_THREAD == 0 or running.is_empty():
                    fill()
                yield result
        except (KilledWorker, OSError) as error:
            reason = " ".join(str(error).split()).rstrip(".")
            kept = f"{self._kept}: " if self._kept else ""
            raise MavplanError(f"the cluster was lost: {reason}; {kept}run the same command again") from error


def checked(function: Callable[[Any], Any], task: Any, made_with: dict[str, str]) -> Any:
    """Return the result of a task; what a worker of a cluster does, if it has the versions that it must have."""
    own = versions(ALL_CODE)
    if made_with != own:
        here = ", ".join(f"{name} {number}" for name, number in own.items())
        there = ", ".join(f"{name} {number}" for name, number in made_with.items())
        raise InputError(f"a worker of the cluster has {here}; the same numbers come only from {there}")
    return alone(function, task)


def _connect(stack: contextlib.ExitStack, cluster: str, jobs: int | None) -> "Client":
    """Return a client of the cluster, closed with the stack."""
    from distributed import Client, LocalCluster

    if cluster == "local":
        with interrupts_kept_here():
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
