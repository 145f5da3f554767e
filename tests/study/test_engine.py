"""Here, by processes, on a cluster: the same bits; killed or interrupted: everything finished is kept."""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from mavplan.errors import InputError, MavplanError
from mavplan.planners.one_thread import one_thread
from mavplan.study import engine
from mavplan.study.engine import run_batch, run_study, run_tasks
from mavplan.study.settings import Settings

# Among them draws whose last digits depend on the number of threads.
SOME = Settings(mean_users=(16.0,), seeds=(*range(20), 437, 756, 920, 181))
LONG = Settings(mean_users=(16.0,), seeds=tuple(range(150)))
PATIENCE_S = 60.0
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The rows, run in this process."""
    return run_study(tmp_path_factory.mktemp("here") / "study", SOME, jobs=1)[0]


def test_two_processes_give_the_same_bits(here, tmp_path):
    told = []
    rows, _ = run_study(tmp_path, SOME, jobs=2, progress=lambda done, todo: told.append((done, todo)))
    assert rows == here
    assert told[0] == (0, 96)
    assert told[-1] == (96, 96)
    assert told == sorted(told)


FIRST_CASE = """
from threadpoolctl import threadpool_info
from mavplan.study import engine
from mavplan.study.cases import Case

run_case, threads = engine.run_case, []

def noting(case, planners):
    rows = run_case(case, planners)
    threads.extend(pool["num_threads"] for pool in threadpool_info())
    return rows

engine.run_case = noting
engine.run_batch([(Case(16.0, 100.0, 3.0, 4, 437), ("tloaik", "stoaik", "boaik", "sbw"))])
print(len(threads), *set(threads))
"""


def test_already_the_first_case_of_a_process_is_added_up_by_one_thread():
    """Libraries that a planner only loads as it runs bring their threads along, and other last digits."""
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    output = subprocess.run(
        [sys.executable, "-c", FIRST_CASE],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert int(output[0]) >= 3  # NumPy's BLAS, SciPy's, and scikit-learn's OpenMP
    assert output[1:] == ["1"]


def test_the_threads_of_a_process_are_limited_until_the_last_batch_in_it_ends():
    from threadpoolctl import threadpool_info

    def threads():
        return [pool["num_threads"] for pool in threadpool_info()]

    with ExitStack() as others:
        with one_thread():
            others.enter_context(one_thread())
        assert set(threads()) == {1}
    before = threads()
    with one_thread():
        assert set(threads()) == {1}
    assert threads() == before


def test_a_local_dask_cluster_of_two_workers_gives_the_same_bits(here, tmp_path):
    pytest.importorskip("distributed", reason="a cluster needs Dask distributed (extra 'study')")
    assert run_study(tmp_path, SOME, jobs=2, cluster="local")[0] == here


@pytest.mark.parametrize(
    "address", ["127.0.0.1:8786", "tcp://", "elsewhere", "tcp://127.0.0.1", "http://a:1"]
)
def test_what_is_no_address_of_a_scheduler_is_refused_with_what_is_allowed(tmp_path, address):
    pytest.importorskip("distributed", reason="a cluster needs Dask distributed (extra 'study')")
    with pytest.raises(InputError, match="allowed is 'local' or the address"):
        run_study(tmp_path, SOME, cluster=address)


def test_a_worker_with_other_versions_is_refused():
    from mavplan.workers.cluster import checked

    case = next(SOME.cases())
    with pytest.raises(InputError, match=r"a worker of the cluster has .*the same numbers come only from"):
        checked(run_batch, [(case, ("sbw",))], {"mavplan": "0", "numpy": "1"})


def test_rows_come_batch_by_batch_and_the_rest_can_be_left(here, monkeypatch):
    monkeypatch.setattr(engine, "BATCH", 2)
    tasks = [(case, SOME.planners) for case in SOME.cases()]
    some = run_tasks(tasks, jobs=2)
    first = next(some)
    some.close()
    assert len(first) == 2 * len(SOME.planners)
    assert set(first) <= set(here)


def _die(*_):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_that_is_killed_is_told_of_and_not_waited_for(monkeypatch):
    monkeypatch.setattr(engine, "run_batch", _die)
    with pytest.raises(MavplanError, match="a worker process was killed, perhaps for want of memory"):
        list(run_tasks([(case, SOME.planners) for case in SOME.cases()], jobs=2))


def start(folder, *options):
    """Start the command as a process in a group of its own, and wait for its first rows."""
    process = subprocess.Popen(
        [sys.executable, "-m", "mavplan", "study", "-o", folder, "--mean-users", "16", "--seeds", "150", *options],
        start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        cwd=ROOT,
    )  # fmt: skip
    rows = folder / "cases.jsonl"
    until = time.monotonic() + PATIENCE_S
    while not (rows.exists() and rows.stat().st_size):
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < until
        time.sleep(0.02)
    return process


def running(group):
    """Return the processes of a group that are not dead."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, pgrp = path.read_text().rpartition(") ")[2].split()[:3]
        except OSError:  # gone meanwhile
            continue
        if int(pgrp) == group and state not in "ZX":
            found.append(int(path.parent.name))
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The rows of the longer study, never interrupted."""
    return run_study(tmp_path_factory.mktemp("whole") / "study", LONG, jobs=1)[0]


def test_killed_half_way_and_restarted_a_study_gives_the_same_table(whole, tmp_path):
    process = start(tmp_path / "study", "--jobs", "2")
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == -signal.SIGKILL
    kept = (tmp_path / "study" / "cases.jsonl").read_bytes()
    assert 0 < kept.count(b"\n") < len(whole), "it was not half-way"
    until = time.monotonic() + PATIENCE_S
    while running(process.pid):
        assert time.monotonic() < until, "a worker outlives the study"
        time.sleep(0.05)
    assert run_study(tmp_path / "study", LONG, jobs=1)[0] == whole
    assert (tmp_path / "study" / "cases.jsonl").read_bytes().startswith(kept[: kept.rfind(b"\n") + 1])


def test_an_interrupt_ends_cleanly_and_keeps_what_is_finished(whole, tmp_path):
    process = start(tmp_path / "study", "--jobs", "2")
    os.killpg(process.pid, signal.SIGINT)  # as the keyboard does
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert output == ""
    assert errors.split("\n")[0].startswith("what was finished is kept in ")
    assert "Traceback" not in errors
    assert "Warning" not in errors
    kept = (tmp_path / "study" / "cases.jsonl").read_bytes()
    assert 0 < kept.count(b"\n") < len(whole)
    assert kept.endswith(b"\n")
    assert not (tmp_path / "study" / "study.csv").exists()
