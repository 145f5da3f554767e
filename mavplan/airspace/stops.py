"""Stops moved out of no-fly zones: to the nearest place from which the same users are reached, or to several."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mavplan.airspace.zones import ROUNDING_M, KeepOut, Shape
from mavplan.scenario.model import Floats, Ints

DISC_SEGMENTS = 32
"""Sides of a quarter of a coverage disc; the polygon lies within it."""


@dataclass(frozen=True, eq=False)
class MovedStop:
    """The places that stand for one stop, and the users that none of them can reach."""

    places_m: Floats
    left_over: Ints


def moved_stop(stop_m: Floats, users_m: Floats, served: Ints, radius_m: float, out: KeepOut) -> MovedStop:
    """Return where to stop in place of a stop that lies in what is closed.

    Parameters
    ----------
    stop_m
        (2,) the stop.
    users_m
        (N, 2) all users.
    served
        Which of them it serves from the air.
    radius_m
        Coverage radius.
    out
        The zones.

    Returns
    -------
    MovedStop
        One place where that does; else users are taken nearest first, each with all others that a place has room for.
        A stop that serves nobody has none.
    """
    import shapely

    centre = shapely.Point(stop_m)
    apart_m = np.linalg.norm(users_m[served] - stop_m, axis=1)
    waiting = served[np.argsort(apart_m, kind="stable")].tolist()
    places: list[Floats] = []
    left_over: list[int] = []
    while waiting:
        region, rest = None, []
        for user in waiting:
            disc = allowed_disc(users_m[user], radius_m, out)
            together = disc if region is None else region.intersection(disc)
            if not disc.is_empty and not together.is_empty:
                region = together
            elif disc.is_empty:
                left_over.append(user)
            else:
                rest.append(user)
        if region is not None:
            nearest = shapely.get_coordinates(shapely.shortest_line(region, centre))[0]
            places.append(nearest)
        waiting = rest
    return MovedStop(np.array(places).reshape(-1, 2), np.array(sorted(left_over), dtype=np.int64))


def allowed_disc(user_m: Floats, radius_m: float, out: KeepOut) -> Shape:
    """Return the places from which a user is reached and that are not closed."""
    import shapely

    disc = shapely.Point(user_m).buffer(radius_m, quad_segs=DISC_SEGMENTS)
    return disc.difference(out.closed.buffer(ROUNDING_M / 2))


def unreachable_because(user_m: Floats, radius_m: float, out: KeepOut) -> str:
    """Return the clause that says which zones keep a user from being reached."""
    import shapely

    zones = out.zones_on(shapely.Point(user_m).buffer(radius_m))
    return f"{' and '.join(zones)} and the margin leave no place within {radius_m:,.0f} m of it"


def in_closed(places_m: Floats, out: KeepOut) -> Iterator[int]:
    """Yield the rows of places that lie in what is closed."""
    yield from np.flatnonzero(out.holds(places_m)).tolist()
