"""One case of a study: users drawn from its own values, every planner on them, a row of figures each.

A pure function of the case: the same bits in any order, alone or among thousands, and, within `one_thread`, on any
worker.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavplan.hppp import draw_pairs, draw_users
from mavplan.planners import PLANNERS
from mavplan.planners.index import joint_index
from mavplan.planners.setting import Setting
from mavplan.radio import Channel
from mavplan.scenario.model import Users
from mavplan.study.regime import BENCHMARK, IDEAL_LINK, Held, radio_of

Generator = Literal["pairs", "users"]
"""What the points of the Poisson process are: a user and its mate, or single users."""


@dataclass(frozen=True, order=True)
class Case:
    """One draw of users, and the setting that they are planned for. Cases sort as their results are listed.

    Attributes
    ----------
    mean_users
        λ, mean number of users in the whole square.
    altitude_m, snr_threshold_db
        H and γ_th.
    clusters
        K, clipped to the number of distinct places where there are fewer.
    seed
        With λ and the generator it decides the users, with K the planners' draws.
    generator
        What is drawn.
    held
        What stays the same while H and γ_th vary, see `radio_of`.
    """

    mean_users: float
    altitude_m: float
    snr_threshold_db: float
    clusters: int
    seed: int
    generator: Generator = "pairs"
    held: Held = "radius"


@dataclass(frozen=True)
class Row:
    """What one planner made of one case.

    Attributes
    ----------
    case, planner
        What it is of.
    users, clusters_used
        Number of users drawn; K as clipped, 0 where the planner has no clusters.
    stops, length_m, sum_rate_bit_s_hz
        Number of stops, L and Σ rate of the plan.
    rho_e
        ρ_e; None where it has no value.
    benchmark_length_m, benchmark_sum_rate_bit_s_hz
        μ_b and υ_b, SBW on the same users.
    """

    case: Case
    planner: str
    users: int
    clusters_used: int
    stops: int
    length_m: float
    sum_rate_bit_s_hz: float
    rho_e: float | None
    benchmark_length_m: float
    benchmark_sum_rate_bit_s_hz: float


def draw_case(case: Case) -> Users:
    """Return the users of a case: those of `mavplan.hppp` for its λ and seed, whatever K, H and γ_th are."""
    draw = draw_pairs if case.generator == "pairs" else draw_users
    xy_m, mate = draw(case.mean_users, seed=case.seed)
    nowhere = np.full(len(xy_m), np.nan)  # a drawn user has no place on earth, and no planner asks for one
    return Users(
        names=tuple(f"u{number}" for number in range(len(xy_m))),
        lat_deg=nowhere,
        lon_deg=nowhere,
        xy_m=xy_m,
        demand_bit=np.zeros(len(xy_m)),
        mate=mate,
    )


def run_case(case: Case, planners: Sequence[str]) -> tuple[Row, ...]:
    """Return a row for each planner, in the order given.

    All planners start from a generator made of seed and K, as `mavplan.planners.plan_trajectory` makes it: they share
    the first draw of centres, and ``mavplan plan`` finds the same stops for the same users.

    Parameters
    ----------
    case
        Its altitude must leave a coverage radius.
    planners
        Names in the registry.
    """
    users = draw_case(case)
    channel = Channel(
        radio_of(case.altitude_m, case.snr_threshold_db, case.held), case.altitude_m, IDEAL_LINK
    )

    def setting() -> Setting:
        return Setting(case.clusters, np.random.default_rng([case.seed, case.clusters]))

    benchmark = PLANNERS[BENCHMARK].plan(users, channel, setting())
    rows = []
    for name in planners:
        found = benchmark if name == BENCHMARK else PLANNERS[name].plan(users, channel, setting())
        rows.append(
            Row(
                case=case,
                planner=name,
                users=len(users),
                clusters_used=found.clusters,
                stops=len(found.stops_m),
                length_m=found.length_m,
                sum_rate_bit_s_hz=found.sum_rate_bit_s_hz,
                rho_e=joint_index(found, benchmark),
                benchmark_length_m=benchmark.length_m,
                benchmark_sum_rate_bit_s_hz=benchmark.sum_rate_bit_s_hz,
            )
        )
    return tuple(rows)
