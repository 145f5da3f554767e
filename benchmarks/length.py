"""The shortest path beside TLOAIK's, and how long its proof takes: ``python -m benchmarks.length [SEEDS [LIMIT_S]]``.

Users HPPP over 2 km × 2 km, mean 16 and 60, home at a corner; R 300 m from 100 m, threshold 0 dB, no D2D, end "stay".
TLOAIK with the best of its K: 3, 5, 7 for 16 users and 8, 12, 16 for 60. Then 1,960 hydrants of a city, and one tour in
a given order beside CVXPY with Clarabel.
"""

import sys
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.planning import hydrants
from benchmarks.regime import DENSITIES, RADIUS_M, regime_channel, regime_users
from benchmarks.timing import best_s, show
from mavplan.bounds.path import proved_length_m
from mavplan.hppp import SIDE_M
from mavplan.planners.length import length
from mavplan.planners.limits import Limits
from mavplan.planners.one_thread import one_thread
from mavplan.planners.path_bound import path_lower_bound
from mavplan.planners.path_certificate import path_certificate
from mavplan.planners.setting import Setting
from mavplan.planners.tloaik import tloaik
from mavplan.planners.touring import tour_discs

LIMIT_S = 30.0
SEEDS = 20
HOME_M = np.zeros(2)


@dataclass(frozen=True)
class Outcome:
    """One draw: lengths, the gap left, seconds of search and proof, size and strength of the certificate."""

    length_m: float
    ratio: float
    gap: float
    seconds: float
    proof_s: float
    leaves: int
    certified: float


@one_thread()
def measure(mean: int, seed: int, limit_s: float) -> Outcome:
    channel, users = regime_channel(), regime_users(mean, seed)
    best_m = min(
        tloaik(users, channel, Setting(clusters, np.random.default_rng([seed, clusters]))).length_m
        for clusters in DENSITIES[mean]
    )
    begin = time.perf_counter()
    found = length(users, channel, Setting(0, np.random.default_rng(seed), limits=Limits(limit_s)))
    seconds = time.perf_counter() - begin
    bound = found.bound
    assert bound is not None
    assert bound.bound <= found.length_m <= best_m * (1 + 1e-9), (
        "longer than the paper's planner, or below its bound"
    )
    again = path_lower_bound(
        users.xy_m, channel.radius_m, closed=False, mate=users.mate, time_limit_s=limit_s
    )
    begin = time.perf_counter()
    certificate = path_certificate(again, users.xy_m, users.mate)
    proof_s = time.perf_counter() - begin
    proved_m = proved_length_m(certificate, users.xy_m, users.mate, channel.radius_m)
    return Outcome(
        length_m=found.length_m,
        ratio=found.length_m / best_m if best_m else 1.0,
        gap=bound.gap,
        seconds=seconds,
        proof_s=proof_s,
        leaves=len(certificate.leaves),
        certified=proved_m / found.length_m if found.length_m else 1.0,
    )


def main(seeds: int = SEEDS, limit_s: float = LIMIT_S) -> None:
    rows, ratios = [], []
    for mean in DENSITIES:
        found = [measure(mean, seed, limit_s) for seed in range(seeds)]
        seconds = np.array([one.seconds for one in found])
        proved = np.array([one.gap <= 2e-6 for one in found])
        ratios.append(np.mean([one.ratio for one in found]))
        wanted_s = 1.0 if mean == 16 else 30.0
        in_time = float((proved & (seconds <= wanted_s)).mean())
        certified = [one.certified for one in found]
        rows += [
            (f"{mean} users, path / TLOAIK's", f"{ratios[-1]:.3f}", f"mean of {seeds} seeds"),
            (
                f"{mean} users, proved within {wanted_s:g} s",
                f"{in_time:.0%}",
                "wanted: 100 %" if mean == 16 else "wanted: 90 %",
            ),
            (
                f"{mean} users, seconds",
                f"{np.median(seconds):.2f} s",
                f"median; 90 % within {np.quantile(seconds, 0.9):.2f} s, the longest {seconds.max():.2f} s",
            ),
            (
                f"{mean} users, certificate",
                f"{np.median([one.leaves for one in found]):.0f} leaves",
                f"median; at most {max(one.leaves for one in found)}, in {max(one.proof_s for one in found):.1f} s "
                f"or less; proves {min(certified):.6f} of the length or more",
            ),
        ]
    rows.append(("both, path / TLOAIK's", f"{np.mean(ratios):.3f}", "wanted: at most 0.84"))
    show(f"the shortest path, {seeds} seeds", rows)
    show_city(limit_s)
    show_tours()


def show_city(limit_s: float) -> None:
    city = hydrants()
    if city is None:
        return
    rows = []
    for radius_m, numbers in ((300.0, (40, 60, 80)), (100.0, (300, 400, 500))):
        channel, users = regime_channel(radius_m), city.users
        best_m = min(
            tloaik(users, channel, Setting(clusters, np.random.default_rng([0, clusters]))).length_m
            for clusters in numbers
        )
        found = path_lower_bound(users.xy_m, radius_m, closed=False, mate=users.mate, time_limit_s=limit_s)
        rows.append(
            (
                f"1,960 hydrants, R {radius_m:g} m, after {limit_s:g} s",
                f"{found.path.length_m:,.0f} m",
                f"{found.path.length_m / best_m:.2f} of TLOAIK's; {found.bound_m:,.0f} m proved",
            )
        )
    show("a city", rows)


def show_tours() -> None:
    import cvxpy as cp

    rows = []
    for discs in (10, 60):
        centres = np.random.default_rng(discs).uniform(0.0, SIDE_M, (256, discs, 2))
        points, order = cp.Variable((discs, 2)), cp.Parameter((discs, 2))
        path = cp.vstack([np.zeros((1, 2)), points])
        programme = cp.Problem(
            cp.Minimize(cp.sum(cp.norm(path[1:] - path[:-1], axis=1))),
            [cp.norm(points - order, axis=1) <= RADIUS_M],
        )
        order.value = centres[0]
        exact_s = best_s(lambda programme=programme: programme.solve(solver="CLARABEL"))
        exact_m = programme.value
        one_s, many_s = (
            best_s(lambda some=some: tour_discs(some, RADIUS_M, HOME_M)) for some in (centres[:1], centres)
        )
        off = abs(float(tour_discs(centres[:1], RADIUS_M, HOME_M).length_m[0]) / exact_m - 1)
        rows += [
            (f"{discs} discs, CVXPY and Clarabel again", f"{exact_s * 1e3:.1f} ms", ""),
            (f"{discs} discs, alone", f"{one_s * 1e3:.1f} ms", f"{off:.0e} off"),
            (
                f"{discs} discs, one of 256",
                f"{many_s / 256 * 1e3:.3f} ms",
                f"{exact_s / many_s * 256:.0f} times as fast",
            ),
        ]
    show("one tour in a given order, to 1e-7", rows)


if __name__ == "__main__":
    main(*(kind(word) for kind, word in zip((int, float), sys.argv[1:], strict=False)))
