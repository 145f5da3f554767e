"""Stops on a very long path: stretch by stretch, as `path_stops` puts them on a short one."""

from dataclasses import dataclass

import numpy as np

from mavplan.planners.cover_candidates import requirements_of
from mavplan.planners.path_stops import stops_on_path
from mavplan.planners.spread import Spread
from mavplan.planners.wide_path import meetings
from mavplan.radio import Channel
from mavplan.scenario.model import Floats, Ints, Users

LEGS = 24
"""Of a stretch."""

TOGETHER = 16
"""Stretches that are one task."""


@dataclass(frozen=True, eq=False)
class _Task:
    users: tuple[Users, ...]
    channel: Channel
    paths_m: tuple[Floats, ...]


def stops_on_long_path(users: Users, channel: Channel, path_m: Floats, spread: Spread) -> Floats:
    """Return stops (M, 2) in the order of the path, from which each user or its mate is reached.

    Each user belongs to the first stretch of the path that comes within R of it or of its mate.
    """
    required = requirements_of(users.xy_m, users.mate)
    leg, met = meetings(required, path_m, channel.radius_m)
    first = np.full(len(required), len(path_m))
    np.minimum.at(first, met, leg)
    stretch = (first // LEGS)[_requirement_of(users)]
    order = np.argsort(stretch, kind="stable")
    wanted, begins = np.unique(stretch[order], return_index=True)
    groups = np.split(order, begins[1:])
    parts = [
        (users.some(np.sort(own), users.demand_bit), path_m[at * LEGS : (at + 1) * LEGS + 1])
        for at, own in zip(wanted.tolist(), groups, strict=True)
    ]
    tasks = [
        _Task(tuple(own for own, _ in some), channel, tuple(line for _, line in some))
        for some in (parts[at : at + TOGETHER] for at in range(0, len(parts), TOGETHER))
    ]
    return np.vstack([stops for found in spread(worked_out, tasks) for stops in found])


def worked_out(task: _Task) -> list[Floats]:
    """Return the stops of some stretches; what every worker does."""
    return [
        stops_on_path(users, task.channel, path) for users, path in zip(task.users, task.paths_m, strict=True)
    ]


def _requirement_of(users: Users) -> Ints:
    """Return (N,) the requirement that each user belongs to, as `requirements_of` numbers them."""
    _, at = np.unique(users.xy_m, axis=0, return_inverse=True)
    at = at.reshape(-1)
    other = np.where(users.mate < 0, at, at[users.mate])
    _, found = np.unique(np.sort(np.column_stack((at, other)), axis=1), axis=0, return_inverse=True)
    return np.asarray(found, dtype=np.int64).reshape(-1)
