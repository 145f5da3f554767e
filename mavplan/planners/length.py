"""Length: the shortest path that comes within R of everybody, for when only reaching people counts.

The close-enough travelling salesman problem: D. J. Gulczynski, J. W. Heath and C. C. Price, "The close enough
traveling salesman problem: a discussion of several heuristics", in: Perspectives in Operations Research, 2006,
doi 10.1007/978-0-387-39934-8_16. Solved to proof by branch and bound, see `path_search`.
"""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from mavplan.bounds import Bound
from mavplan.bounds.path import proved_length_m, to_json
from mavplan.errors import Problem
from mavplan.planners.limits import Limits
from mavplan.planners.ordering import ORIGIN_M, from_origin, path_length_m
from mavplan.planners.path_bound import PathBound, shortest_path
from mavplan.planners.path_certificate import path_certificate
from mavplan.planners.path_problem import PathProblem, path_problem
from mavplan.planners.path_stops import stops_on_path
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory, through
from mavplan.planners.wide_path import REGION, wide_path
from mavplan.planners.wide_stops import stops_on_long_path
from mavplan.progress import Progress
from mavplan.radio import Channel
from mavplan.scenario.model import Users


def length(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan the shortest path from home that comes within R of each user, or of one of each D2D pair.

    Where the mission returns, the way back counts. Stops stand on that path, as few as do.
    """
    problem = path_problem(users.xy_m, channel.radius_m, returns=setting.returns, mate=users.mate)
    needed = problem.without_met()
    if len(needed.required) > REGION:
        return _in_regions(users, channel, setting, needed)
    found = shortest_path(
        needed, setting.limits, setting.rng, lambda _bound_m, _length_m: setting.tell_limits()
    )
    stops = stops_on_path(users, channel, problem.path_m(found.path.points_m))
    path = from_origin(stops)
    way_m = path_length_m(np.vstack([path, ORIGIN_M]) if setting.returns else path)
    bound = Bound(
        objective="tour_m" if setting.returns else "path_m",
        plan=way_m,
        bound=min(found.bound_m, way_m),
        certificate=partial(_certificate, found, users, channel.radius_m),
    )
    return replace(through("length", users, channel, stops, bound=bound), notes=_notes(found, setting.limits))


def _in_regions(users: Users, channel: Channel, setting: Setting, problem: PathProblem) -> Trajectory:
    """Plan a path for more users than are searched together."""
    points = wide_path(problem, setting.seed, setting.spread, setting.progress)
    stops = stops_on_long_path(users, channel, problem.path_m(points), setting.spread)
    message = (
        f"more than {REGION:,} users are planned region by region: a short path, of which nothing is proved"
    )
    note = Problem("[planner] name", message, "no-bound", "warning")
    return replace(through("length", users, channel, stops), notes=(note,))


def _certificate(
    found: PathBound, users: Users, radius_m: float, progress: Progress | None = None
) -> dict[str, Any]:
    """Return the proof for the plan's file, with what it proves: where it would be too long, less than is known."""
    certificate = path_certificate(found, users.xy_m, users.mate, progress=progress)
    proved_m = proved_length_m(certificate, users.xy_m, users.mate, radius_m)
    return {**to_json(certificate), "bound": math.floor(proved_m * 1e3) / 1e3}


def _notes(found: PathBound, limits: Limits) -> tuple[Problem, ...]:
    """Return what to know where the search was cut off."""
    if found.proved or limits.seconds is None:
        return ()
    left = f"{found.gap:.2%} of the length above what is proved" if found.gap < 1.0 else "nothing is proved"
    message = (
        f"the search for the shortest path was cut off after {limits.seconds:g} s, {left}: another run may find "
        "another path"
    )
    return (Problem("[planner] time_limit_s", message, "not-proved", "warning"),)
