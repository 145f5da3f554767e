"""The supplementary phase: the paper's stop-point selection strategy (SPSS)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavplan.planners.geometry import least_detour_on_circle, nearest_of, nearest_on_path, towards
from mavplan.radio import Channel
from mavplan.scenario.model import UNPAIRED, Floats, Users


@dataclass(frozen=True, eq=False)
class Place:
    """Where an uncovered user stands to the reference trajectory; all points are (2,) metres.

    Attributes
    ----------
    user_m, foot_m, distance_m
        The user, the nearest point of the reference, and how far that is.
    left_m, right_m
        Ends of the nearest segment; ``right_m`` is None at the free end, where ``left_m`` is the only neighbour.
    """

    user_m: Floats
    foot_m: Floats
    distance_m: float
    left_m: Floats
    right_m: Floats | None


PlaceStop = Callable[[Place], Floats]
"""Where the stop (2,) for one uncovered user goes."""


def nearest_to_reference(channel: Channel) -> PlaceStop:
    """Return SPSS cases 2 and 3: the foot of the perpendicular where that is within R, else a point of the circle.

    On the circle of radius R round the user the path grows least, (9) to (12); at the free end the stop is on the
    straight line to the one neighbour.
    """

    def place(where: Place) -> Floats:
        if channel.reaches(np.asarray(where.distance_m)):
            return where.foot_m
        if where.right_m is None:
            return towards(where.user_m, channel.radius_m, where.left_m)
        return least_detour_on_circle(where.user_m, channel.radius_m, where.left_m, where.right_m)

    return place


def supplementary_stops(
    users: Users, initial_stops_m: Floats, reference_m: Floats, channel: Channel, place_stop: PlaceStop
) -> Floats:
    """Return the stops that are added so that every user is covered or has a covered mate (section 4).

    Users whose mate is covered need nothing (case 1). Then, in the order of their lowest index, pairs with nobody
    covered, for which the member nearest to the reference stands, and single users get a stop from ``place_stop``.
    Coverage and D2D are worked out again after each. The reference trajectory never changes.

    Parameters
    ----------
    initial_stops_m
        (K, 2) stops of the clustering phase.
    reference_m
        (S + 1, 2) reference polyline from the origin.

    Returns
    -------
    (A, 2) stops in the order in which they were made.
    """
    covered = channel.reaches(nearest_of(users.xy_m, initial_stops_m)[0])
    left_over = np.flatnonzero(~covered)
    nearest = nearest_on_path(users.xy_m[left_over], reference_m)
    row_of = dict(zip(left_over.tolist(), range(len(left_over)), strict=True))
    new_stops: list[Floats] = []
    for user in left_over.tolist():
        mate = int(users.mate[user])
        if covered[user] or (mate != UNPAIRED and covered[mate]):
            continue
        row = row_of[user]
        if mate != UNPAIRED and nearest.distance_m[row_of[mate]] < nearest.distance_m[row]:
            row = row_of[mate]
        segment = nearest.segment[row]
        left, right = reference_m[segment], reference_m[segment + 1]
        stop = place_stop(
            Place(
                user_m=users.xy_m[left_over[row]],
                foot_m=nearest.foot_m[row],
                distance_m=float(nearest.distance_m[row]),
                left_m=right if nearest.at_end[row] else left,
                right_m=None if nearest.at_end[row] else right,
            )
        )
        new_stops.append(stop)
        covered |= channel.reaches(np.linalg.norm(users.xy_m - stop, axis=1))
    return np.array(new_stops).reshape(-1, 2)
