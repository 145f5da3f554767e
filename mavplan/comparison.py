"""Every planner on the same users, beside the SBW benchmark, and how few stops would do at all."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.plan import Plan, make_plan
from mavplan.planners import PLANNERS
from mavplan.planners.cover import minimum_cover, minimum_pair_cover
from mavplan.planners.index import joint_index
from mavplan.progress import Progress, part_of
from mavplan.scenario.model import Scenario

BENCHMARK = "sbw"
PAPERS = ("tloaik", "stoaik", "boaik", "sbw")
"""Planners of the paper, which take no more than seconds among thousands of users."""
COVER_LIMIT_S = 10.0
"""For the proof of each of the two least numbers of stops; what is proved by then is said."""


@dataclass(frozen=True, slots=True)
class Row:
    """The figures of one planner; ratios are to the benchmark's, None where that is 0, as where no battery is known."""

    planner: str
    clusters: int
    stops: int
    d2d_users: int
    length_m: float
    length_ratio: float | None
    sum_rate_bit_s_hz: float
    sum_rate_ratio: float | None
    joint_index: float | None
    hover_s: float
    mission_s: float
    energy_wh: float | None
    within_battery: bool | None
    altitude_m: float


@dataclass(frozen=True, slots=True)
class LeastStops:
    """The fewest stops known to do, and a number below which it is proved that none do."""

    size: int
    bound: int

    def __str__(self) -> str:
        """Return ``5``, or ``5 (4 proved)`` where the search ended early."""
        return str(self.size) if self.size == self.bound else f"{self.size} ({self.bound} proved)"


@dataclass(frozen=True, eq=False)
class Comparison:
    """All planners' plans and figures, the benchmark last, and the fewest stops without and with D2D."""

    plans: tuple[Plan, ...]
    rows: tuple[Row, ...]
    least_stops: LeastStops
    least_stops_with_d2d: LeastStops


def compare(
    scenario: Scenario,
    progress: Progress | None = None,
    planners: Sequence[str] | None = None,
) -> Comparison:
    """Plan a scenario with several planners.

    Parameters
    ----------
    scenario
        The name of its planner does not count, its other options do.
    progress
        Told what is done and what there is to do.
    planners
        Their names; the benchmark is planned in any case. None: every planner of the registry.

    Raises
    ------
    InputError
        As `mavplan.plan.make_plan`.
    """
    names = [*(name for name in planners or PLANNERS if name != BENCHMARK), BENCHMARK]
    parts = len(names) + 2

    def tell(number: int) -> Progress:
        return part_of(progress, number, parts)

    plans: list[Plan] = []
    for done, name in enumerate(names):
        tell(done)(0, 1)
        options = dataclasses.replace(scenario.planner, name=name)
        plans.append(make_plan(dataclasses.replace(scenario, planner=options), progress=tell(done)))
    # Where each planner has an altitude of its own, the lowest reaches farthest.
    radius_m = max(plan.trajectory.radius_m for plan in plans)
    tell(len(names))(0, 1)
    cover = minimum_cover(scenario.users.xy_m, radius_m, time_limit_s=COVER_LIMIT_S)
    tell(len(names) + 1)(0, 1)
    pair_cover = minimum_pair_cover(scenario.users, radius_m, time_limit_s=COVER_LIMIT_S)
    return Comparison(
        plans=tuple(plans),
        rows=tuple(_row(plan, plans[-1]) for plan in plans),
        least_stops=LeastStops(cover.size, cover.bound),
        least_stops_with_d2d=LeastStops(pair_cover.size, pair_cover.bound),
    )


def _row(plan: Plan, benchmark: Plan) -> Row:
    """Return the figures of one plan."""
    found, base = plan.trajectory, benchmark.trajectory
    return Row(
        planner=found.planner,
        clusters=found.clusters,
        stops=len(found.stop_at),
        d2d_users=int(found.assignment.d2d.sum()),
        length_m=found.length_m,
        length_ratio=found.length_m / base.length_m if base.length_m else None,
        sum_rate_bit_s_hz=found.sum_rate_bit_s_hz,
        sum_rate_ratio=found.sum_rate_bit_s_hz / base.sum_rate_bit_s_hz if base.sum_rate_bit_s_hz else None,
        joint_index=joint_index(found, base),
        hover_s=plan.holds.hover_s,
        mission_s=plan.forecast.mission_s,
        energy_wh=plan.forecast.used_wh,
        within_battery=plan.within_battery,
        altitude_m=plan.scenario.vehicle.altitude_m,
    )
