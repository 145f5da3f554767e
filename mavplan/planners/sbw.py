"""SBW: strip-based waypoints, the benchmark of section 7.

The smallest axis-parallel rectangle round the users is cut into strips of width R, whose centre lines are flown in a
snake. Direction, stops abeam and axis-parallel strips are assumed: our copy of the paper does not show them.
"""

import math

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.planners.ordering import ORIGIN_M
from mavplan.planners.trajectory import Trajectory, assign
from mavplan.radio import Channel
from mavplan.scenario.model import Floats, Ints, Users

BORDER = 1e-9
"""Share of a strip by which arithmetic may put a user beyond the border on which it stands."""

MOST_STRIPS = 10_000

WIDER = 1.001
"""Neighbours are looked for within so many R, then measured."""


def sbw(users: Users, channel: Channel) -> Trajectory:
    """Plan strip-based waypoints: all of every strip, southernmost first from its western end; no D2D.

    Stops are on the centre line abeam of each user of the strip that is not yet within R of a stop, in flying order.
    The length is that of the whole snake, the way from the origin included.

    Raises
    ------
    InputError
        The coverage radius is so small that there would be more strips than anybody flies.
    """
    radius_m = channel.radius_m
    (west, south), (east, north) = users.xy_m.min(axis=0), users.xy_m.max(axis=0)
    strips = max(1, math.ceil((north - south) / radius_m - BORDER))
    if strips > MOST_STRIPS:
        message = (
            f"a coverage radius of {radius_m:g} m makes {strips:,} strips, at most {MOST_STRIPS:,} are flown"
        )
        raise InputError([Problem("[radio]", message, "too-many-strips")])
    from scipy.spatial import KDTree

    tree = KDTree(users.xy_m)
    strip = strip_of(users.xy_m[:, 1] - south, radius_m, strips)
    by_strip = np.argsort(strip, kind="stable")
    ends = np.cumsum(np.bincount(strip, minlength=strips))
    covered = np.zeros(len(users), dtype=bool)
    path: list[Floats] = [ORIGIN_M]
    stop_at: list[int] = []
    for index in range(strips):
        centre_line = south + (index + 0.5) * radius_m
        eastward = index % 2 == 0
        first, last = (west, east) if eastward else (east, west)
        path.append(np.array([first, centre_line]))
        own = by_strip[ends[index - 1] if index else 0 : ends[index]]
        along = users.xy_m[own, 0]
        for user in own[np.argsort(along if eastward else -along, kind="stable")]:
            if not covered[user]:
                stop = np.array([users.xy_m[user, 0], centre_line])
                near = np.array(tree.query_ball_point(stop, WIDER * radius_m), dtype=np.int64)
                covered[near] |= channel.reaches(np.linalg.norm(users.xy_m[near] - stop, axis=1))
                if (stop != path[-1]).any():
                    path.append(stop)
                stop_at.append(len(path) - 1)
        if last != path[-1][0]:
            path.append(np.array([last, centre_line]))
    flown = np.array(path)
    return Trajectory(
        planner="sbw",
        clusters=0,
        path_m=flown,
        stop_at=np.array(stop_at),
        reference_m=np.empty((0, 2)),
        assignment=assign(users, flown[stop_at], channel, d2d=False),
        radius_m=radius_m,
    )


def strip_of(height_m: Floats, width_m: float, strips: int) -> Ints:
    """Return the strip of each height above the southern edge; a user on a border belongs to the first of the two."""
    return np.clip(np.ceil(height_m / width_m - BORDER).astype(np.int64) - 1, 0, strips - 1)
