"""The table of a study: per setting and planner the means over its seeds, with intervals."""

import dataclasses
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mavplan.study.cases import Case, Row
from mavplan.study.intervals import Interval, mean_interval, ratio_of_means_interval
from mavplan.study.regime import BENCHMARK, ORDER_OF_INDEX

Group = tuple[float, float, float, int]
"""λ, H, γ_th and K."""


@dataclass(frozen=True)
class Line:
    """What one planner does at one setting.

    Attributes
    ----------
    mean_users, altitude_m, snr_threshold_db, clusters, planner
        The setting.
    cases
        Number of seeds.
    users, stops
        Means.
    length, sum_rate
        L and Σ rate as ratios of means to SBW's.
    rho_e
        Mean of the ratios ρ_e, over the cases in which it has a value.
    less, rho_e_difference
        The planner that follows in the published order of ρ_e, and the mean of the paired difference to it: on the
        same users, minus ρ_e of that one. None for the last, and where it was not run.
    """

    mean_users: float
    altitude_m: float
    snr_threshold_db: float
    clusters: int
    planner: str
    cases: int
    users: float
    stops: float
    length: Interval
    sum_rate: Interval
    rho_e: Interval | None
    less: str | None
    rho_e_difference: Interval | None

    @property
    def group(self) -> Group:
        """The setting without the planner."""
        return self.mean_users, self.altitude_m, self.snr_threshold_db, self.clusters


def group_of(case: Case) -> Group:
    """Return the setting of a case."""
    return case.mean_users, case.altitude_m, case.snr_threshold_db, case.clusters


def summarise(rows: Sequence[Row]) -> list[Line]:
    """Return a line for each setting and planner, in the order of the rows, which must be sorted by case."""
    lines: list[Line] = []
    for group, members in itertools.groupby(rows, key=lambda row: group_of(row.case)):
        by_planner: dict[str, list[Row]] = {}
        for row in members:
            by_planner.setdefault(row.planner, []).append(row)
        lines += [_line(group, planner, by_planner) for planner in by_planner]
    return lines


def _line(group: Group, planner: str, by_planner: dict[str, list[Row]]) -> Line:
    rows = by_planner[planner]
    less = next_in_order(planner, by_planner)
    rho_e = [row.rho_e for row in rows if row.rho_e is not None]
    difference = []
    if less is not None:
        other = {row.case: row.rho_e for row in by_planner[less]}
        for row in rows:
            of_other = other[row.case]
            if row.rho_e is not None and of_other is not None:
                difference.append(row.rho_e - of_other)
    return Line(
        *group,
        planner=planner,
        cases=len(rows),
        users=float(np.mean([row.users for row in rows])),
        stops=float(np.mean([row.stops for row in rows])),
        length=_ratio(rows, "length_m"),
        sum_rate=_ratio(rows, "sum_rate_bit_s_hz"),
        rho_e=mean_interval(np.array(rho_e)) if rho_e else None,
        less=less,
        rho_e_difference=mean_interval(np.array(difference)) if difference else None,
    )


def _ratio(rows: Sequence[Row], figure: str) -> Interval:
    """Return a figure of the plans over that of the benchmark, as a ratio of means."""
    own = np.array([getattr(row, figure) for row in rows])
    return ratio_of_means_interval(own, np.array([getattr(row, f"benchmark_{figure}") for row in rows]))


def next_in_order(planner: str, present: Iterable[str]) -> str | None:
    """Return the planner behind this one in the published order of ρ_e; for one not in it, the benchmark."""
    there = set(present)
    if planner not in ORDER_OF_INDEX:
        return BENCHMARK if BENCHMARK in there else None
    behind = ORDER_OF_INDEX[ORDER_OF_INDEX.index(planner) + 1 :]
    return next((name for name in behind if name in there), None)


def flat(line: Line) -> dict[str, Any]:
    """Return a line as one flat table: an interval takes three columns, ``length``, ``length_low``, ``length_high``."""
    values: dict[str, Any] = {}
    for field in dataclasses.fields(Line):
        value = getattr(line, field.name)
        if field.name in ("length", "sum_rate", "rho_e", "rho_e_difference"):
            values[field.name] = None if value is None else value.value
            values[f"{field.name}_low"] = None if value is None else value.low
            values[f"{field.name}_high"] = None if value is None else value.high
        else:
            values[field.name] = value
    return values
