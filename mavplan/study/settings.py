"""What one study varies: every combination of its values is a case, once for each seed."""

import dataclasses
import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

from mavplan.errors import InputError, Problem
from mavplan.planners import PLANNERS
from mavplan.radio import coverage_radius_m, highest_altitude_m
from mavplan.scenario.reference import keys_of
from mavplan.scenario.report import figure, listed, shown
from mavplan.study import regime
from mavplan.study.cases import Case, Generator
from mavplan.study.regime import Held, radio_of

AXES = ("mean_users", "clusters", "altitude_m", "snr_threshold_db", "planners", "seeds")
"""Values of which a study may be given more later."""

MOST_USERS = 100_000.0
MOST_SEED = 2**63 - 1
MOST_SEEDS = 10_000_000

_NUMBER = r"\s*([0-9]{1,19})\s*"


@dataclass(frozen=True)
class Settings:
    """The values of a study; those that are left out are the paper's regime.

    Numbers stand in ascending order and once each, planners in the order given.

    Raises
    ------
    InputError
        With every value that cannot be taken.
    """

    mean_users: tuple[float, ...] = regime.MEAN_USERS
    clusters: tuple[int, ...] = (regime.CLUSTERS,)
    altitude_m: tuple[float, ...] = (regime.ALTITUDE_M,)
    snr_threshold_db: tuple[float, ...] = (regime.SNR_THRESHOLD_DB,)
    planners: tuple[str, ...] = regime.PLANNERS
    seeds: tuple[int, ...] = tuple(range(regime.SEEDS))
    generator: Generator = "pairs"
    held: Held = "radius"

    def __post_init__(self) -> None:
        for axis in ("mean_users", "altitude_m", "snr_threshold_db"):
            # Adding 0.0 makes one zero of the two.
            object.__setattr__(
                self, axis, tuple(sorted({float(value) + 0.0 for value in getattr(self, axis)}))
            )
        for axis in ("clusters", "seeds"):
            object.__setattr__(self, axis, tuple(sorted({int(value) for value in getattr(self, axis)})))
        object.__setattr__(self, "planners", tuple(dict.fromkeys(self.planners)))
        problems = [*self._bad_values(), *self._bad_names()]
        if not problems:
            problems += self._without_coverage()
        if problems:
            raise InputError(problems)

    def groups(self) -> Iterator[Case]:
        """Give every combination of values but the seeds, as a case with the first seed, in the order of listing."""
        for mean_users, altitude_m, snr_threshold_db, clusters in itertools.product(
            self.mean_users, self.altitude_m, self.snr_threshold_db, self.clusters
        ):
            yield Case(
                mean_users,
                altitude_m,
                snr_threshold_db,
                clusters,
                self.seeds[0],
                self.generator,
                self.held,
            )

    def cases(self) -> Iterator[Case]:
        """Give every case; all combinations of one seed before the next, so that a part of a study is an even part."""
        groups = tuple(self.groups())
        for seed in self.seeds:
            for group in groups:
                yield dataclasses.replace(group, seed=seed)

    def not_extending(self, older: "Settings") -> list[Problem]:
        """Return why these settings do not extend older ones: a value of theirs is missing, or the draws differ."""
        problems = []
        for axis in AXES:
            missing = [value for value in getattr(older, axis) if value not in getattr(self, axis)]
            if missing:
                shown = ranges_text(missing) if axis == "seeds" else listed(as_text(v) for v in missing)
                message = (
                    f"the study there also has {shown}; more values can be added to a study, none left out"
                )
                problems.append(Problem(axis, message, "other-study"))
        for name in ("generator", "held"):
            if getattr(older, name) != getattr(self, name):
                message = f"found {getattr(self, name)!r}; the study there is of {getattr(older, name)!r}"
                problems.append(Problem(name, message, "other-study"))
        return problems

    def to_json(self) -> dict[str, Any]:
        """Return the settings as JSON holds them; seeds as ranges."""
        return dataclasses.asdict(self) | {"seeds": ranges_text(self.seeds)}

    @classmethod
    def from_json(cls, found: dict[str, Any]) -> "Settings":
        """Return the settings from what `to_json` returned.

        Raises
        ------
        InputError, TypeError, ValueError, KeyError
            It is something else.
        """
        lists: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in found.items()
        }
        return cls(**lists | {"seeds": seeds_of(found["seeds"])})

    def _bad_values(self) -> Iterator[Problem]:
        for axis in AXES:
            if not getattr(self, axis):
                yield Problem(axis, "at least one value is needed", "no-values")
        for mean in self.mean_users:
            if not 0.0 < mean <= MOST_USERS:
                message = (
                    f"found {figure(mean)}; allowed is a number above 0 and at most {figure(MOST_USERS)}"
                )
                yield Problem("mean_users", message, "out-of-range")
        for clusters in self.clusters:
            if clusters < 1:
                message = f"found {clusters}; allowed is a whole number from 1"
                yield Problem("clusters", message, "out-of-range")
        for seed in self.seeds:
            if not 0 <= seed <= MOST_SEED:
                message = f"found {seed}; allowed is a whole number from 0 to {MOST_SEED}"
                yield Problem("seeds", message, "out-of-range")
        keys = keys_of("vehicle")["altitude_m"], keys_of("radio")["snr_threshold_db"]
        for key in keys:
            for value in getattr(self, key.name):
                if not (math.isfinite(value) and key.holds(value)):
                    message = f"found {figure(value)}; allowed is {key.allowed_with_unit}"
                    yield Problem(key.name, message, "out-of-range")

    def _bad_names(self) -> Iterator[Problem]:
        for name in self.planners:
            if name not in PLANNERS:
                message = f"unknown planner {name!r}; known: {', '.join(PLANNERS)}"
                yield Problem("planners", message, "unknown-planner")
        for key, allowed in (("generator", get_args(Generator)), ("held", get_args(Held))):
            if getattr(self, key) not in allowed:
                message = f"found {getattr(self, key)!r}; allowed is {' or '.join(allowed)}"
                yield Problem(key, message, "unknown-name")

    def _without_coverage(self) -> Iterator[Problem]:
        """Give the combinations at which nobody on the ground is reached, or the power is no radio's."""
        power = keys_of("radio")["tx_power_dbm"]
        for altitude_m, threshold_db in itertools.product(self.altitude_m, self.snr_threshold_db):
            where = f"altitude_m {figure(altitude_m)}, snr_threshold_db {figure(threshold_db)}"
            needed_dbm = regime.power_dbm(altitude_m, threshold_db, self.held)
            if not power.holds(needed_dbm):
                message = (
                    f"takes a transmit power of {needed_dbm:.1f} dBm; allowed is {power.allowed_with_unit}"
                )
                yield Problem(where, message, "out-of-range")
                continue
            radio = radio_of(altitude_m, threshold_db, self.held)
            if not coverage_radius_m(radio, altitude_m) > 0.0:
                message = (
                    "nobody on the ground can be reached; with this power the coverage radius is positive only "
                    f"below {highest_altitude_m(radio):,.1f} m"
                )
                yield Problem(where, message, "no-coverage")


def as_text(value: float | str) -> str:
    """Return a value as a person writes it: 16 and not 16.0."""
    return value if isinstance(value, str) else f"{value:.12g}"


def ranges_text(seeds: "tuple[int, ...] | list[int]") -> str:
    """Return ascending seeds as ranges, ``0-299,400-400``."""
    found: list[list[int]] = []
    for seed in seeds:
        if found and found[-1][1] == seed - 1:
            found[-1][1] = seed
        else:
            found.append([seed, seed])
    return ",".join(f"{first}-{last}" for first, last in found)


def seeds_of(text: str) -> tuple[int, ...]:
    """Return the seeds of a text: ``300`` is the seeds 0 to 299, ``0-99,200-299`` those of the ranges.

    Raises
    ------
    ValueError
        It is neither; the message says what is allowed.
    """
    allowed = "allowed is a number of seeds (300) or ranges of them (0-99,200-299)"
    if number := re.fullmatch(_NUMBER, text):
        parts = [(0, int(number[1]) - 1)]
    else:
        found = [re.fullmatch(f"{_NUMBER}-{_NUMBER}", part) for part in text.split(",")]
        parts = [(int(part[1]), int(part[2])) for part in found if part is not None]
        if len(parts) < len(found):
            raise ValueError(f"found {shown(text)}; {allowed}")
    if any(first > last for first, last in parts):
        raise ValueError(f"found {shown(text)}, which holds no seed; {allowed}")
    if sum(last - first + 1 for first, last in parts) > MOST_SEEDS:
        raise ValueError(f"found {shown(text)}, more than {MOST_SEEDS:,} seeds; {allowed}")
    return tuple(sorted({seed for first, last in parts for seed in range(first, last + 1)}))
