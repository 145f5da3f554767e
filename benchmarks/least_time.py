"""The least mission time beside the paper's planners: ``python -m benchmarks.least_time [SEEDS] [OPTIONS]``.

The regime of `benchmarks.regime`; 10 m/s at once, end "stay", the climb not counted. 2, 20 and 100 Mbit a user, without
in-flight service and with it; the paper's planners, the best of TLOAIK, STOAIK and BOAIK with their numbers of
clusters, hold by the linear programme and always without. A plan has ten seconds of one core, however busy it is.
Each row goes to ``out/benchmarks/least_time.jsonl`` with the state of the code that it was measured on, so that a run
that was broken off goes on where it stopped.

Holds and in-flight service come from `mavplan.hover` and `mavplan.inflight`, not from the planner. Ends with 1 where a
plan is longer than one of the paper's with the same service, leaves somebody out or is below its bound, or where the
checker does not confirm the bound.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from benchmarks.regime import DENSITIES, regime_channel, regime_users
from benchmarks.timing import show_table
from mavplan.bounds.time import from_json, proved_time_s
from mavplan.bounds.time_case import TimeCase
from mavplan.cli.console import progress
from mavplan.hover import broadcast_rates, demand_on_air, least_broadcast_holds
from mavplan.inflight import received_in_flight
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.planners.least_time import PAPERS, least_time
from mavplan.planners.limits import Limits
from mavplan.planners.one_thread import one_thread
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory
from mavplan.scenario import Service, Vehicle
from mavplan.scenario.model import Users

SEEDS = 10
LIMIT_S = 10.0
ROOT = Path(__file__).parents[1]
STORE = ROOT / "out" / "benchmarks" / "least_time.jsonl"

WANTED = {
    (2.0, False): (0.825, 0.04),
    (20.0, False): (0.80, 0.12),
    (100.0, False): (0.83, 0.20),
    (2.0, True): (0.815, 0.04),
    (20.0, True): (0.72, 0.18),
    (100.0, True): (0.56, 0.35),
}
"""Megabits a user, in-flight service: ratio to the paper's planners, and gap at 16 users, that are wanted at most."""

MEASURED = ("planners", "bounds", "mission", "hover.py", "hppp.py", "inflight.py", "radio.py")
"""What in the package the figures depend on."""

SAME_S = 1e-6
"""Seconds by which arithmetic may differ."""

VEHICLE = Vehicle(acceleration_m_s2=0.0, position_error_m=0.0, end="stay")


@dataclass(frozen=True)
class CoreLimits(Limits):
    """A limit in seconds of the core that this process had, so that other work beside it changes little."""

    _begun_s: float = field(default_factory=time.process_time)

    @property
    def elapsed_s(self) -> float:
        """Seconds of the core since this was made."""
        return time.process_time() - self._begun_s


@dataclass(frozen=True, order=True)
class Case:
    """One draw, what each user needs and how it is served; cases sort as they are run."""

    seed: int
    mean: int
    mbit: float
    in_flight: bool


@dataclass(frozen=True)
class Row:
    """What came out of a case, seconds without the climb.

    Attributes
    ----------
    seed, mean, mbit, in_flight
        The case.
    code, commit, limit_s
        Digest of what is measured, the commit below it, and the time limit.
    plan_s, paper_s, same_s
        The plan; the best of the paper's planners without in-flight service, and with the plan's.
    bound_s, checked_s
        The bound, and what the checker confirms from the certificate alone.
    seconds, check_seconds
        Of a core: what the plan took, and its proof with the check.
    wrong
        Claims that do not hold.
    """

    seed: int
    mean: int
    mbit: float
    in_flight: bool
    code: str
    commit: str
    limit_s: float
    plan_s: float
    paper_s: float
    same_s: float
    bound_s: float
    checked_s: float
    seconds: float
    check_seconds: float
    wrong: tuple[str, ...] = ()

    @property
    def case(self) -> Case:
        """What was measured."""
        return Case(self.seed, self.mean, self.mbit, self.in_flight)

    @property
    def ratio(self) -> float:
        """The plan's time over that of the best of the paper's planners, without in-flight service."""
        return self.plan_s / self.paper_s if self.paper_s else 1.0

    @property
    def floor(self) -> float:
        """What no plan's ratio is below."""
        return self.bound_s / self.paper_s if self.paper_s else 1.0

    @property
    def gap(self) -> float:
        """What is left between plan and bound, as a share of the plan."""
        return (self.plan_s - self.bound_s) / self.plan_s if self.plan_s else 0.0


def cases_of(
    seeds: int, demands_mbit: Sequence[float] = (), service: str = "both", means: Sequence[int] = ()
) -> list[Case]:
    """Cases of the seeds from 0, those of a seed together; those of some demands, a service or a density alone."""
    return [
        Case(seed, mean, mbit, in_flight)
        for seed in range(seeds)
        for mean in means or DENSITIES
        for mbit, in_flight in WANTED
        if (not demands_mbit or mbit in demands_mbit)
        and service in ("both", "with" if in_flight else "without")
    ]


def mission_s(users: Users, trajectory: Trajectory, in_flight: bool) -> float:
    """Return the time of a plan without the climb: its way at full speed, and the least holds."""
    channel, demand_bit = regime_channel(), demand_on_air(users, trajectory)
    if in_flight:
        rules = AUTOPILOTS[VEHICLE.autopilot]
        demand_bit = demand_bit - received_in_flight(users.xy_m, trajectory, channel, VEHICLE, rules)
    rates = broadcast_rates(users, trajectory.stops_m, channel)
    holds_s = least_broadcast_holds(rates, np.maximum(demand_bit, 0.0))
    return trajectory.length_m / VEHICLE.speed_m_s + float(holds_s.sum())


@lru_cache(maxsize=8)
def papers_plans(mean: int, seed: int) -> tuple[Trajectory, ...]:
    """Return the plans of the paper's planners, each with each of its numbers of clusters; demands do not matter."""
    users, channel = regime_users(mean, seed), regime_channel()
    places = len(np.unique(users.xy_m, axis=0))
    return tuple(
        planner(users, channel, Setting(clusters, np.random.default_rng([seed, min(clusters, places)])))
        for clusters in DENSITIES[mean]
        for planner in PAPERS
    )


@one_thread()
def measure(case: Case, limit_s: float, code: str, commit: str) -> Row:
    """Plan one case and check what is claimed of it."""
    users, channel = regime_users(case.mean, case.seed, case.mbit), regime_channel()
    papers = papers_plans(case.mean, case.seed)
    service = Service(in_flight=case.in_flight)
    begin = time.process_time()
    found = least_time(
        users,
        channel,
        Setting(
            0,
            np.random.default_rng([case.seed, 0]),
            limits=CoreLimits(limit_s),
            seed=case.seed,
            tried=DENSITIES[case.mean],
            vehicle=VEHICLE,
            service=service,
            in_flight=case.in_flight,
        ),
    )
    seconds = time.process_time() - begin
    assert found.bound is not None
    assert found.bound.certificate is not None
    timed = TimeCase.of(users, channel, VEHICLE, service, wind=None, in_flight=case.in_flight)
    climb_s = timed.fixed_s
    begin = time.process_time()
    written = json.loads(json.dumps(found.bound.certificate(None)))
    checked_s = proved_time_s(from_json(written), timed) - climb_s
    check_seconds = time.process_time() - begin
    plan_s, bound_s = mission_s(users, found, case.in_flight), found.bound.bound - climb_s
    paper_s = min(mission_s(users, plan, False) for plan in papers)
    same_s = min(mission_s(users, plan, True) for plan in papers) if case.in_flight else paper_s
    wrong = (
        ("somebody is not served", not found.assignment.served.all()),
        ("longer than a plan of the paper's", plan_s > same_s + SAME_S),
        ("below its bound", plan_s < bound_s - SAME_S),
        ("the checker confirms less than the file says", checked_s + climb_s < written["bound"] - SAME_S),
        ("below what the checker confirms", plan_s < checked_s - SAME_S),
    )
    return Row(
        **asdict(case),
        code=code,
        commit=commit,
        limit_s=limit_s,
        plan_s=plan_s,
        paper_s=paper_s,
        same_s=same_s,
        bound_s=bound_s,
        checked_s=checked_s,
        seconds=seconds,
        check_seconds=check_seconds,
        wrong=tuple(words for words, is_so in wrong if is_so),
    )


def code_state() -> tuple[str, str]:
    """Return a digest of the code that is measured, and the commit that is checked out."""
    digest = hashlib.sha256()
    for place in (ROOT / "mavplan" / name for name in MEASURED):
        for path in sorted(place.rglob("*.py")) if place.is_dir() else (place,):
            digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    git = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return digest.hexdigest()[:12], git.stdout.strip()


def stored_rows(store: Path, code: str, limit_s: float) -> list[Row]:
    """Return the rows that were measured on this code with this time limit; a line cut off is none."""
    rows: dict[Case, Row] = {}
    for line in store.read_text().splitlines() if store.exists() else ():
        try:
            content = json.loads(line)
        except ValueError:
            continue
        row = Row(**{**content, "wrong": tuple(content["wrong"])})
        if row.code == code and row.limit_s == limit_s:
            rows[row.case] = row
    return list(rows.values())


def measured(cases: Sequence[Case], limit_s: float, state: tuple[str, str], jobs: int) -> Iterator[Row]:
    """Measure cases, and give their rows as they come."""
    if jobs == 1:
        yield from (measure(case, limit_s, *state) for case in cases)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(measure, cases, *([value] * len(cases) for value in (limit_s, *state)))


def show(rows: Iterable[Row]) -> None:
    """Print the table, a line for each demand and service."""
    lines = []
    found = list(rows)
    for (mbit, in_flight), (ratio, gap) in WANTED.items():
        by_mean = {
            mean: [row for row in found if (row.mean, row.mbit, row.in_flight) == (mean, mbit, in_flight)]
            for mean in DENSITIES
        }
        if not all(by_mean.values()):
            continue
        ratios = [np.mean([row.ratio for row in part]) for part in by_mean.values()]
        floors = [np.mean([row.floor for row in part]) for part in by_mean.values()]
        few = np.array([row.gap for row in by_mean[16]])
        many = np.array([row.gap for row in by_mean[60]])
        times = [
            f"{np.median(s):.1f}, {max(s):.1f}" for s in ([r.seconds for r in p] for p in by_mean.values())
        ]
        lines.append(
            (
                f"{mbit:g} Mbit, {'with' if in_flight else 'without'}",
                *(f"{value:.3f}" for value in ratios),
                f"{np.mean(ratios):.3f}",
                f"{ratio:.3f}",
                f"{np.mean(floors):.3f}",
                f"{few.mean():.1%}, {few.max():.1%}",
                f"{gap:.0%}",
                f"{many.mean():.1%}",
                *times,
            )
        )
    columns = (
        "demand, in flight",
        "16",
        "60",
        "both",
        "wanted",
        "no plan below",
        "gap 16: mean, most",
        "wanted",
        "gap 60",
    )
    show_table((*columns, "s 16: median, most", "s 60"), lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.least_time", description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=SEEDS, help=f"(default {SEEDS})")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument(
        "--limit", type=float, default=LIMIT_S, help=f"seconds of a core for each plan (default {LIMIT_S:g})"
    )
    parser.add_argument(
        "--mbit", type=float, nargs="+", default=(), help="demands a user: 2, 20, 100 (default all)"
    )
    parser.add_argument(
        "--in-flight", choices=("without", "with", "both"), default="both", help="(default both)"
    )
    parser.add_argument(
        "--mean", type=int, nargs="+", default=(), help="mean numbers of users: 16, 60 (default both)"
    )
    parser.add_argument("--store", type=Path, default=STORE, help="where rows are kept")
    arguments = parser.parse_args(argv)
    state = code_state()
    wanted = cases_of(arguments.seeds, arguments.mbit, arguments.in_flight, arguments.mean)
    known = set(wanted)
    rows = [row for row in stored_rows(arguments.store, state[0], arguments.limit) if row.case in known]
    done = {row.case for row in rows}
    left = [case for case in wanted if case not in done]
    arguments.store.parent.mkdir(parents=True, exist_ok=True)
    with arguments.store.open("a") as store, progress("plans") as move:
        for row in measured(left, arguments.limit, state, arguments.jobs):
            rows.append(row)
            store.write(json.dumps(asdict(row)) + "\n")
            store.flush()
            move(len(rows), len(wanted))
    show(rows)
    wrong = [row for row in rows if row.wrong]
    for row in wrong:
        print(f"WRONG: {row.case}: {'; '.join(row.wrong)}")
    print(
        f"{len({row.seed for row in rows})} seeds, {len(rows):,} plans, at most {arguments.limit:g} s each, commit "
        f"{state[1]}, code {state[0]}: {len(wanted) - len(rows)} not measured, {len(wrong)} wrong"
    )
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
