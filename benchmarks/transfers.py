"""Thousands of uploads over bad radios, on a virtual clock: ``python -m benchmarks.transfers --runs 20000 --jobs 2``.

Every run is the real session against the real mock through bytes; what it claims is held against the vehicle's
memory. The same seed gives the same figures whatever the number of jobs. Ends with 1 where a claim was untrue, a
deadline was outlived, an item was sent too often, or fewer were verified than a cell asks for.
"""

import argparse
import itertools
import math
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

from benchmarks.timing import show_table
from benchmarks.transfer_cells import CELLS, Cell
from benchmarks.transfer_judge import Result, run_case
from mavplan.cli.console import progress
from mavplan.mission.model import Autopilot

RUNS = 20_000
CHUNK = 10
SHOWN = 20
OUTCOMES = ("verified", "refused", "uncertain", "no link", "other")

Job = tuple[int, Autopilot, int]
"""Cell (its place in `CELLS`), firmware, number of the run in it."""


@dataclass
class Row:
    """What came of the runs of one cell and firmware."""

    cell: Cell
    firmware: Autopilot
    runs: int = 0
    wrong: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    verified_s: list[float] = field(default_factory=list)
    worst_s: float = 0.0

    def add(self, result: Result) -> None:
        """Take a result in."""
        self.runs += 1
        self.wrong += bool(result.wrong)
        self.outcomes[result.outcome] += 1
        self.worst_s = max(self.worst_s, result.took_s)
        if result.outcome == "verified":
            self.verified_s.append(result.took_s)

    @property
    def verified_part(self) -> float:
        """Part of the runs that were verified."""
        return self.outcomes["verified"] / self.runs if self.runs else 1.0

    @property
    def too_few(self) -> bool:
        """Whether fewer were verified than the cell asks for."""
        least = self.cell.least_verified
        return least is not None and self.verified_part < least

    def quantile_s(self, part: float) -> float | None:
        """Return the time within which this part of the verified uploads was through."""
        times = sorted(self.verified_s)
        return times[min(len(times) - 1, int(part * len(times)))] if times else None


def jobs_of(runs: int) -> list[Job]:
    """Share the runs out over all cells, no fewer than asked for; each gets at least one for each of its firmwares."""
    weights = sum(cell.weight * len(cell.firmwares) for cell in CELLS)
    return [
        (place, firmware, number)
        for place, cell in enumerate(CELLS)
        for firmware in cell.firmwares
        for number in range(math.ceil(runs * cell.weight / weights))
    ]


def run_jobs(seed: int, jobs: Sequence[Job]) -> list[tuple[Job, Result]]:
    """Run some of the campaign."""
    return [
        (job, run_case(CELLS[place].case(firmware, seed, number)))
        for job in jobs
        for place, firmware, number in [job]
    ]


def results_of(seed: int, jobs: Sequence[Job], processes: int) -> Iterator[tuple[Job, Result]]:
    """Run the campaign and give the results as they come."""
    if processes == 1:
        yield from itertools.chain.from_iterable(run_jobs(seed, [job]) for job in jobs)
        return
    chunks = [jobs[at : at + CHUNK] for at in range(0, len(jobs), CHUNK)]
    with ProcessPoolExecutor(processes) as pool:
        for part in pool.map(run_jobs, itertools.repeat(seed), chunks):
            yield from part


def rows_of(results: Iterable[tuple[Job, Result]]) -> dict[tuple[int, Autopilot], Row]:
    """Count outcomes, a row for each cell and firmware."""
    rows: dict[tuple[int, Autopilot], Row] = {}
    for (place, firmware, _), result in results:
        rows.setdefault((place, firmware), Row(CELLS[place], firmware)).add(result)
    return rows


def show(rows: Iterable[Row]) -> None:
    """Print the table."""
    show_table(
        ("fault", "firmware", "runs", *OUTCOMES, "wrong", "p50 s", "p99 s", "worst s"),
        (
            (
                *(row.cell.name, row.firmware, str(row.runs)),
                *(str(row.outcomes[name]) for name in OUTCOMES),
                str(row.wrong),
                *(
                    "–" if seconds is None else f"{seconds:.1f}"
                    for seconds in (row.quantile_s(0.5), row.quantile_s(0.99), row.worst_s)
                ),
            )
            for row in rows
        ),
        words=2,
    )


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.transfers", description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help=f"transfers in all (default {RUNS})")
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: all cores)"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cell", help="only this cell")
    parser.add_argument("--firmware", choices=("ardupilot", "px4"), help="only this firmware")
    parser.add_argument("--run", type=int, metavar="N", help="only the run of this number in its cell")
    arguments = parser.parse_args(argv)
    jobs = [
        job
        for job in jobs_of(arguments.runs)
        if arguments.cell in {None, CELLS[job[0]].name}
        and arguments.firmware in {None, job[1]}
        and arguments.run in {None, job[2]}
    ]
    begin = time.perf_counter()
    results: list[tuple[Job, Result]] = []
    with progress("transfers") as move:
        for found in results_of(arguments.seed, jobs, arguments.jobs):
            results.append(found)
            move(len(results), len(jobs))
    rows = rows_of(results)
    show(rows.values())
    wrong = [(job, result) for job, result in results if result.wrong]
    for (place, firmware, number), result in wrong[:SHOWN]:
        print(f"WRONG: {'; '.join(result.wrong)}: {result.case}; {result.words}")
        print(
            f"  again: --seed {arguments.seed} --cell {CELLS[place].name!r} --firmware {firmware} --run {number}"
        )
    short = [row for row in rows.values() if row.too_few]
    for row in short:
        print(f"TOO FEW: {row.cell.name}, {row.firmware}: {row.verified_part:.2%} verified")
    print(
        f"{len(results):,} transfers in {time.perf_counter() - begin:.0f} s, seed {arguments.seed}: "
        f"{len(wrong)} wrong, {len(short)} cells with too few verified"
    )
    return int(bool(wrong or short))


if __name__ == "__main__":
    sys.exit(main())
