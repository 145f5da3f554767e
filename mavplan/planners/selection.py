"""The supplementary phase: the paper's stop-point selection strategy (SPSS)."""

from typing import Protocol

import numpy as np

from mavplan.planners.geometry import least_detour_on_circle, nearest_of, nearest_on_path, towards
from mavplan.radio import Channel
from mavplan.scenario.model import UNPAIRED, Floats, Users


class PlaceStop(Protocol):
    """Where the stop for one uncovered user goes."""

    def __call__(self, user_m: Floats, left_m: Floats, right_m: Floats | None) -> Floats:
        """Return the stop (2,) for a user beyond R of the reference; ``right_m`` None: a free end, one neighbour."""
        ...


def least_detour(radius_m: float) -> PlaceStop:
    """Return SPSS case 3: on the circle of radius R round the user, where the path grows least, (9) to (12)."""

    def place(user_m: Floats, left_m: Floats, right_m: Floats | None) -> Floats:
        if right_m is None:
            return towards(user_m, radius_m, left_m)
        return least_detour_on_circle(user_m, radius_m, left_m, right_m)

    return place


def supplementary_stops(
    users: Users, initial_stops_m: Floats, reference_m: Floats, channel: Channel, place_far: PlaceStop
) -> Floats:
    """Return the stops that SPSS adds so that every user is covered or has a covered mate (section 4).

    Users whose mate is covered need nothing (case 1). Then, in the order of their lowest index, pairs with nobody
    covered, for which the member nearest to the reference stands, and single users: within R of the reference
    the stop is the foot of the perpendicular (case 2), else ``place_far`` places it (case 3). Coverage and D2D
    are worked out again after each. The reference trajectory never changes.

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
    nearest = nearest_on_path(users.xy_m, reference_m)
    new_stops: list[Floats] = []
    for user in np.flatnonzero(~covered):
        mate = users.mate[user]
        if covered[user] or (mate != UNPAIRED and covered[mate]):
            continue
        chosen = user
        if mate != UNPAIRED and nearest.distance_m[mate] < nearest.distance_m[user]:
            chosen = mate
        if channel.reaches(nearest.distance_m[chosen]):
            stop = nearest.foot_m[chosen]
        else:
            segment = nearest.segment[chosen]
            left, right = reference_m[segment], reference_m[segment + 1]
            if nearest.at_end[chosen]:
                stop = place_far(users.xy_m[chosen], right, None)
            else:
                stop = place_far(users.xy_m[chosen], left, right)
        new_stops.append(stop)
        covered |= channel.reaches(np.linalg.norm(users.xy_m - stop, axis=1))
    return np.array(new_stops).reshape(-1, 2)
