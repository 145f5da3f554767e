"""The order of stops: our own searches beside PyVRP and OR-Tools, open paths with a free end, in equal time.

Ours are the search by small changes that plans very many users (`quick_path`, here with discs of a millimetre), and the
2-opt and Or-opt that puts regions in order (`coarse_order`), which stops by itself. The two libraries are needed for
this comparison only: ``pip install pyvrp ortools``.
"""

import time
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from benchmarks.timing import show
from mavplan.hppp import draw_users
from mavplan.planners.coarse_order import ordered
from mavplan.planners.one_thread import one_thread
from mavplan.planners.path_problem import path_problem
from mavplan.planners.quick_path import FIXED, Pieces, improved
from mavplan.planners.spread import spread_here
from mavplan.planners.wide_path import wide_path
from mavplan.scenario.model import Floats

CASES = ((60, 0.5), (100, 1.0), (500, 3.0), (2000, 10.0))
"""Stops, and seconds for each search."""

SEEDS = (0, 1, 2)
SIDE_M = 2000.0
REACH_M = 300.0
POINT_M = 1e-3
METRE = 1000
"""The libraries count in whole numbers: millimetres."""

Order = Callable[[Floats, float], Floats]
"""(places, seconds) → places in an order, the start first."""


def length_m(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def small_changes(places: Floats, seconds: float) -> Floats:
    """As many attempts as fit into the time, a trial run told how many that is."""
    required = path_problem(places, POINT_M, returns=False).without_met().required

    def run(attempts: int) -> Floats:
        begin = Pieces(np.zeros((1, 2)), np.array([FIXED]), np.zeros(0, dtype=np.bool_), open_end=True)
        return improved(required, POINT_M, begin, np.random.default_rng(0), attempts).points_m

    begun = time.perf_counter()
    run(0)
    made = time.perf_counter()
    trial = max(len(places) // 4, 20)
    run(trial)
    each_s = (time.perf_counter() - made - (made - begun)) / trial
    return run(max(int((seconds - (made - begun)) / each_s), 1))


def two_opt(places: Floats, _seconds: float) -> Floats:
    return np.vstack([np.zeros((1, 2)), places[ordered(places, np.zeros(2), None)]])


def pyvrp(places: Floats, seconds: float, *, begin: bool = False) -> Floats:
    """With ``begin`` from the places' own order."""
    from pyvrp import Client, Depot, Location, ProblemData, Solution, VehicleType, solve
    from pyvrp.stop import MaxRuntime

    line = np.vstack([np.zeros((1, 2)), places])
    matrix = distances(line)
    data = ProblemData(
        locations=[Location(x, y) for x, y in (line * METRE).tolist()],
        clients=[Client(number) for number in range(1, len(line))],
        depots=[Depot(0)],
        vehicle_types=[VehicleType(num_available=1)],
        distance_matrices=[matrix],
        duration_matrices=[np.zeros_like(matrix)],
    )
    first = Solution(data, [list(range(len(places)))]) if begin else None
    found = solve(data, stop=MaxRuntime(seconds), seed=0, display=False, initial_solution=first)
    (route,) = found.best.routes()
    return line[[0, *(stop.idx + 1 for stop in route if stop.is_client())]]


def ortools(places: Floats, seconds: float) -> Floats:
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    line = np.vstack([np.zeros((1, 2)), places])
    matrix = distances(line)
    manager = pywrapcp.RoutingIndexManager(len(line), 1, 0)
    routing = pywrapcp.RoutingModel(manager)
    transit = routing.RegisterTransitMatrix(matrix.tolist())
    routing.SetArcCostEvaluatorOfAllVehicles(transit)
    options = pywrapcp.DefaultRoutingSearchParameters()
    options.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    options.local_search_metaheuristic = routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    options.time_limit.FromMilliseconds(int(seconds * 1000))
    found = routing.SolveWithParameters(options)
    order, at = [], routing.Start(0)
    while not routing.IsEnd(at):
        order.append(manager.IndexToNode(at))
        at = found.Value(routing.NextVar(at))
    return line[order]


def distances(line: Floats) -> Floats:
    """Whole millimetres; back to the start costs nothing, so the path ends anywhere."""
    apart = np.linalg.norm(line[:, None] - line[None], axis=2)
    matrix = (apart * METRE).round().astype(np.int64)
    matrix[:, 0] = 0
    return matrix


def paths() -> None:
    """Order the points of paths through discs anew, from their own order, for as long as they took."""
    rows = []
    for users in (1_000, 4_000):
        before_m = after_m = taken_s = points = 0.0
        for seed in SEEDS:
            side_m = SIDE_M * (users / 60) ** 0.5
            xy_m, _ = draw_users(users, side_m, seed=seed)
            problem = path_problem(xy_m - side_m / 2, REACH_M, returns=False).without_met()
            begun = time.perf_counter()
            places = wide_path(problem, 0, spread_here)
            seconds = time.perf_counter() - begun
            line = pyvrp(places, seconds, begin=True)
            before_m += length_m(problem.path_m(places)) / len(SEEDS)
            after_m += length_m(line) / len(SEEDS)
            taken_s += seconds / len(SEEDS)
            points += len(places) / len(SEEDS)
        rows.append(
            (
                f"{users:,} users, {points:.0f} points",
                f"{after_m / before_m - 1:+.2%}",
                f"{taken_s:.1f} s each",
            )
        )
    show("PyVRP on the points of our path through discs: length against ours", rows)


def check(line: Floats, places: Floats, name: str) -> None:
    """Raise where a search left a place out."""
    apart = np.linalg.norm(places[:, None] - line[None, 1:], axis=2).min(axis=1)
    if apart.max() > 2 * POINT_M or len(line) < len(places) + 1:
        raise AssertionError(f"{name} left a place out")


def main() -> None:
    searches: dict[str, Order] = {"small changes": small_changes, "2-opt and Or-opt": two_opt}
    for name, search in (("pyvrp", pyvrp), ("ortools", ortools)):
        if find_spec(name) is None:
            print(f"{name} is not installed here: it is left out (pip install {name})")
        else:
            searches[name] = search
    with one_thread():
        for stops, seconds in CASES:
            rows = []
            lengths: dict[str, list[float]] = {}
            taken: dict[str, float] = {}
            for seed in SEEDS:
                places = np.random.default_rng(seed).uniform(0.0, SIDE_M, (stops, 2))
                for name, search in searches.items():
                    begun = time.perf_counter()
                    line = search(places, seconds)
                    taken[name] = taken.get(name, 0.0) + (time.perf_counter() - begun) / len(SEEDS)
                    check(line, places, name)
                    lengths.setdefault(name, []).append(length_m(line))
            best = np.min(list(lengths.values()), axis=0)
            for name, found in lengths.items():
                above = float(np.mean(np.array(found) / best)) - 1
                rows.append((f"{stops} stops, {name}", f"+{above:.2%}", f"{taken[name]:.2f} s"))
            show(f"above the shortest of all found, mean of {len(SEEDS)} draws", rows)
    if "pyvrp" in searches:
        with one_thread():
            paths()


if __name__ == "__main__":
    main()
