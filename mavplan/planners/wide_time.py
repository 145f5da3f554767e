"""A short mission for very many users: a short path region by region, then its stops made quicker stretch by stretch.

Some stops in a row are improved as the small planner's local search does, with the stop before them and the one behind
them held; each user belongs to the stretch that serves it best and is served there. The second time the held stops are
others. Stretches do not wait for one another.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mavplan.planners.path_problem import path_problem
from mavplan.planners.setting import Setting
from mavplan.planners.spread import spread_here
from mavplan.planners.time_passing import PassTable
from mavplan.planners.time_problem import Onward, TimeProblem
from mavplan.planners.time_search import TimeSearch
from mavplan.planners.trajectory import assign
from mavplan.planners.wide_path import wide_path
from mavplan.planners.wide_stops import stops_on_long_path
from mavplan.progress import tell_share
from mavplan.radio import Channel
from mavplan.scenario.model import Floats, Users

TOGETHER = 200
"""Users up to which all of a mission is searched together."""

STOPS, STOPS_BRIEFLY = 13, 9
"""Of a stretch, with the one that is held behind it; and where stretches are improved briefly."""

TASK = 12
"""Stretches that are one task."""

SHIFTS = (STOPS, STOPS // 2)
"""Stops of the first stretch, each time."""

MANY = 5000
"""With more users the stretches are improved once only and briefly: all the rest gains about one per cent."""

BRIEF_EFFORT = 0.6
"""Of the path then, for the same reason."""

PATH_PART = 0.5
"""Of the work, for progress."""

RETURN = 0.0
"""As the speed of a way on: as fast as the vehicle returns."""


@dataclass(frozen=True, eq=False)
class _Stretch:
    users: Users
    start_m: Floats
    stops_m: Floats
    onward: Onward | None
    seed: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Task:
    stretches: tuple[_Stretch, ...]
    channel: Channel
    setting: Setting
    brief: bool


def stops_of_many(users: Users, channel: Channel, setting: Setting) -> Floats:
    """Return stops (M, 2) in flying order, from which each user or its mate is reached."""

    def tell(share: float) -> None:
        tell_share(setting.progress, share)

    brief = len(users) > MANY
    problem = path_problem(users.xy_m, channel.radius_m, returns=setting.returns, mate=users.mate)
    needed = problem.without_met()
    points = np.empty((0, 2))
    if len(needed.required):
        points = wide_path(
            needed,
            setting.seed,
            setting.spread,
            lambda done, whole: tell(PATH_PART * done / whole),
            effort=BRIEF_EFFORT if brief else 1.0,
        )
    stops = stops_on_long_path(users, channel, problem.path_m(points), setting.spread)
    each, shifts = (STOPS_BRIEFLY, (STOPS_BRIEFLY,)) if brief else (STOPS, SHIFTS)
    for number, first in enumerate(shifts):
        cuts = [0, *range(first, len(stops), each), len(stops)]
        stretches = _stretches(users, channel, setting, stops, cuts, number)
        bare = replace(setting, progress=None, spread=spread_here)
        tasks = [
            _Task(tuple(stretches[at : at + TASK]), channel, bare, brief)
            for at in range(0, len(stretches), TASK)
        ]
        parts: list[Floats] = []
        for found in setting.spread(worked_out, tasks):
            parts += found
            tell(PATH_PART + (1 - PATH_PART) * (number + len(parts) / len(stretches)) / len(shifts))
        stops = np.vstack(parts)
    return stops


def _stretches(
    users: Users, channel: Channel, setting: Setting, stops_m: Floats, cuts: list[int], number: int
) -> list[_Stretch]:
    """Return stretches of the stops, from each cut to the next, with their users; all but the end's hold their last."""
    stop = assign(users, stops_m, channel, d2d=True).stop
    order = np.argsort(stop, kind="stable")
    home = np.zeros(2)
    found = []
    for index, (first, end) in enumerate(pairwise(cuts)):
        last = index + 2 == len(cuts)
        inner = end if last else end - 1
        low, high = np.searchsorted(stop[order], (first, inner))
        onward = None
        if not last:
            onward = Onward(stops_m[inner], setting.vehicle.speed_m_s, serves=True)
        elif setting.vehicle.end == "rtl":
            onward = Onward(home, RETURN, serves=False)
        found.append(
            _Stretch(
                users.some(np.sort(order[low:high]), users.demand_bit),
                home if first == 0 else stops_m[first - 1],
                stops_m[first:inner],
                onward,
                (setting.seed, number, index),
            )
        )
    return found


def worked_out(task: _Task) -> list[Floats]:
    """Return the stops of some stretches, with the held ones behind them; what every worker does."""
    table = PassTable.of(task.channel) if task.setting.in_flight else None
    return [_quicker(stretch, task, table) for stretch in task.stretches]


def _quicker(stretch: _Stretch, task: _Task, table: PassTable | None) -> Floats:
    """Return the stops of a stretch after a local search."""
    setting, start_m, onward = task.setting, stretch.start_m, stretch.onward
    held = np.empty((0, 2))
    if onward is not None and onward.serves:
        held = onward.place_m[None]
    if not len(stretch.users) or not len(stretch.stops_m):
        return np.vstack([stretch.stops_m, held])
    problem = TimeProblem.of(
        replace(stretch.users, xy_m=stretch.users.xy_m - start_m),
        task.channel,
        replace(setting.vehicle, end="stay"),
        setting.service,
        wind=setting.wind,
        in_flight=False,
    )
    if onward is not None:
        speed = problem.flyer.law.return_m_s if onward.speed_m_s == RETURN else onward.speed_m_s
        onward = replace(onward, place_m=onward.place_m - start_m, speed_m_s=speed)
    problem = replace(problem, onward=onward, in_flight=table is not None, table=table)
    search = TimeSearch(problem, np.random.default_rng(stretch.seed), task.brief)
    search.consider([stretch.stops_m - start_m], lambda: True)
    return np.vstack([search.best_m + start_m, held])
