"""A trajectory that keeps out of no-fly zones: stops moved, legs led round, the way back too."""

from dataclasses import dataclass, replace

import numpy as np

from mavplan.airspace.routes import Routes
from mavplan.airspace.stops import moved_stop, unreachable_because
from mavplan.airspace.zones import KeepOut
from mavplan.errors import InputError, Problem
from mavplan.planners.trajectory import Trajectory, assign
from mavplan.radio import Channel
from mavplan.scenario.model import Floats, Users


@dataclass(frozen=True, eq=False)
class ClearTrajectory:
    """A trajectory whose stops and legs keep out of the zones, and where the way back to above home turns."""

    trajectory: Trajectory
    back_m: Floats


def keep_clear(
    trajectory: Trajectory, users: Users, channel: Channel, out: KeepOut, *, returns: bool
) -> ClearTrajectory:
    """Return a trajectory round the zones.

    Stops keep their order; one that lies in a zone or its margin is moved to the nearest place from which its users are
    reached, or stands for several such places. Users that no place reaches are left to their mates.

    Parameters
    ----------
    trajectory
        As a planner made it, without regard to the zones.
    users, channel
        Whom it serves, and how.
    out
        The zones; home lies outside.
    returns
        Whether the mission ends at home.

    Raises
    ------
    InputError
        Every user that cannot be served from any place that is allowed, and every leg to which there is no way.
    """
    if out.holds(np.zeros((1, 2)))[0]:
        raise InputError([Problem("[home]", "lies in a no-fly zone or its margin", "home-in-zone")])
    points, is_stop = _moved(trajectory, users, channel, out)
    stops = points[is_stop]
    served = assign(users, stops, channel, d2d=True) if len(stops) else None
    left_over = np.arange(len(users)) if served is None else np.flatnonzero(~served.served)
    problems = [
        Problem(users.names[n], f"cannot be served: {_why(n, users, channel, out)}", "no-allowed-place")
        for n in left_over.tolist()
    ]
    if problems or served is None:
        raise InputError(problems)
    routes, path = Routes(out), [np.zeros(2)]
    stop_at: list[int] = []
    for point, stops_here in zip(points, is_stop, strict=True):
        turns = routes.between(path[-1], point)
        if turns is None:
            place = f"stop {len(stop_at) + 1}"
            raise InputError([Problem(place, "no-fly zones leave no way to it", "no-way")])
        path += [*turns, point]
        if stops_here:
            stop_at.append(len(path) - 1)
    back = routes.between(path[-1], np.zeros(2)) if returns else []
    if back is None:
        raise AssertionError("a way out is a way back")
    found = replace(
        trajectory, path_m=np.array(path), stop_at=np.array(stop_at, dtype=np.int64), assignment=served
    )
    return ClearTrajectory(found, np.array(back).reshape(-1, 2))


def _moved(
    trajectory: Trajectory, users: Users, channel: Channel, out: KeepOut
) -> tuple[Floats, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return the path's points behind home, stops moved, and which are stops; turning points in zones are dropped."""
    closed = out.holds(trajectory.path_m)
    stop_of = {int(row): number for number, row in enumerate(trajectory.stop_at)}
    assignment = trajectory.assignment
    points: list[Floats] = []
    is_stop: list[bool] = []
    for row in range(1, len(trajectory.path_m)):
        point, number = trajectory.path_m[row], stop_of.get(row)
        if not closed[row]:
            places = point[None]
        elif number is None:
            continue
        else:
            served = np.flatnonzero((assignment.stop == number) & ~assignment.d2d)
            places = moved_stop(point, users.xy_m, served, channel.radius_m, out).places_m
        points += list(places)
        is_stop += [number is not None] * len(places)
    return np.array(points).reshape(-1, 2), np.array(is_stop, dtype=bool)


def _why(n: int, users: Users, channel: Channel, out: KeepOut) -> str:
    return unreachable_because(users.xy_m[n], channel.radius_m, out)


def straight_returns(trajectory: Trajectory, out: KeepOut) -> tuple[Problem, ...]:
    """Return a warning that names the stops from which a failsafe's straight return would cross a zone."""
    import shapely

    stops = trajectory.stops_m
    lines = shapely.linestrings(np.stack([stops, np.zeros_like(stops)], axis=1))
    crossing = [
        (label, (np.flatnonzero(shapely.intersects(zone, lines)) + 1).tolist())
        for label, zone in zip(out.labels, out.zones, strict=True)
    ]
    return tuple(
        Problem(
            label,
            f"a failsafe's return flies straight and would cross it from {_named(stops_)}: know that before you fly",
            "failsafe-crosses",
            "warning",
        )
        for label, stops_ in crossing
        if stops_
    )


def _named(stops: list[int]) -> str:
    shown = ", ".join(str(stop) for stop in stops[:12])
    more = f" and {len(stops) - 12} more" if len(stops) > 12 else ""
    return f"{'stop' if len(stops) == 1 else 'stops'} {shown}{more}"
