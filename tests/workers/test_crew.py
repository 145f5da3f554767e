"""Crews of workers: the same results wherever tasks are worked out, in their order where that is wanted."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mavplan.errors import MavplanError
from mavplan.hppp import draw_users
from mavplan.planners import wide_path as wide
from mavplan.planners.path_problem import path_problem
from mavplan.planners.spread import hands, lent, spread_here
from mavplan.workers.crew import Here, crew_of, in_order, lending

R = 300.0


def squared(number):
    return number * number


def whose(_):
    return os.getpid()


def fails(number):
    if number == 2:
        raise ValueError("two")
    return number


@pytest.fixture(scope="module")
def path():
    """A problem of more users than are planned together, and its path made in this process."""
    xy_m, _ = draw_users(1500, 10_000.0, seed=1)
    problem = path_problem(xy_m - 5000.0, R, returns=False).without_met()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wide, "LEAST_ATTEMPTS", 0)
        assert len(problem.required) > wide.REGION
        yield problem, wide.wide_path(problem, 0, spread_here)


def test_results_come_in_the_order_of_the_tasks():
    class Backwards(Here):
        def results(self, function, tasks):
            return super().results(function, tasks[::-1])

    assert list(in_order(Backwards(), squared, range(7))) == [n * n for n in range(7)]


def test_hands_are_lent_for_a_while():
    assert lent() is spread_here
    with hands(lambda function, tasks: ["other"]):
        assert list(lent()(squared, [1])) == ["other"]
    assert lent() is spread_here


def test_one_task_is_worked_out_here_and_calls_nobody_together():
    with lending(2):
        assert list(lent()(whose, [0])) == [os.getpid()]


def test_a_path_made_by_two_processes_is_the_same(path):
    problem, here = path
    with lending(2):
        np.testing.assert_array_equal(wide.wide_path(problem, 0, lent()), here)
        assert os.getpid() not in set(lent()(whose, range(4)))


def test_a_path_made_by_a_local_dask_cluster_is_the_same(path):
    pytest.importorskip("distributed", reason="a cluster needs Dask distributed (extra 'study')")
    problem, here = path
    with lending(2, "local"):
        np.testing.assert_array_equal(wide.wide_path(problem, 0, lent()), here)
        assert os.getpid() not in set(lent()(whose, range(4)))


def test_what_a_task_raises_is_raised():
    with crew_of(2) as crew, pytest.raises(ValueError, match="two"):
        list(crew.results(fails, range(5)))


def test_a_worker_that_is_killed_is_told_of():
    with crew_of(2) as crew, pytest.raises(MavplanError, match=r"was killed, .*; run the same command again"):
        list(crew.results(os._exit, [1, 1, 1]))


LATE = """
from threadpoolctl import threadpool_info
from mavplan.workers.crew import alone

def task(_):
    import sys
    before = "sklearn.cluster" in sys.modules
    from mavplan.planners.one_thread import one_thread
    with one_thread():
        return before, {pool["num_threads"] for pool in threadpool_info()}, len(threadpool_info())

print(alone(task, 0))
"""


def test_a_task_that_clusters_is_added_up_by_one_thread_though_others_load_no_clustering():
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    output = subprocess.run(
        [sys.executable, "-c", LATE],
        cwd=Path(__file__).parents[2],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    before, threads, pools = eval(output)
    assert not before
    assert threads == {1}
    assert pools >= 3
