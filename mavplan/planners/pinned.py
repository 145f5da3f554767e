"""Pinned stops put among those of a planner: places where the vehicle must stop, some of them in a given order. Pure.

Stops that pinned ones make superfluous are left out, then pinned stops are flown in the manner of the planner: MPSS for
those of the paper, the least detour for the others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mavplan.planners.geometry import nearest_of
from mavplan.planners.ordering import ORIGIN_M, from_origin, path_length_m
from mavplan.planners.pinned_order import Ranks, inserted, nearest_first, shortened
from mavplan.planners.trajectory import Trajectory, assign, mate_covered
from mavplan.radio import REACH_TOLERANCE_M, Channel
from mavplan.scenario.model import Bools, Floats, Ints, Scenario, Users

SAME_PLACE_M = 1e-3
"""A stop so near to a pinned one is that one."""

NO_PIN = -1
"""In `pins_at`: a stop that nobody pinned."""

MPSS = frozenset({"tloaik", "stoaik", "boaik"})
"""Planners that fly always to the nearest stop."""

LENGTH_ALONE = frozenset({"tloaik", "length"})
"""Planners that leave out every stop without which everybody is still reached: only the length counts."""

WITHOUT_D2D = frozenset({"stoaik", "sbw"})
"""Planners that serve nobody through a mate."""

SWEEPS = 4
"""Rounds in which stops that are not pinned move towards the straight way between their neighbours."""

BISECTIONS = 40

Cost = Callable[[Floats], Floats]
"""Takes plans (B, M, 2), gives (B,) seconds; infinite where somebody is not reached."""


@dataclass(frozen=True, eq=False)
class Pins:
    """The pinned stops of a scenario.

    Attributes
    ----------
    names
        P names.
    places_m
        (P, 2) metres from home.
    rank
        (P,) ascending in the order in which they are flown: -inf the first of all stops, inf the last, NaN anywhere.
    """

    names: tuple[str, ...]
    places_m: Floats
    rank: Floats

    def at(self, stops_m: Floats) -> Ints:
        """Return (M,) which pinned stop each stop is, or `NO_PIN`; each is found once, at the nearest stop."""
        found = np.full(len(stops_m), NO_PIN, dtype=np.int64)
        for pin, place in enumerate(self.places_m if len(stops_m) else ()):
            away_m = np.where(found == NO_PIN, np.linalg.norm(stops_m - place, axis=1), np.inf)
            if away_m.min() <= SAME_PLACE_M:
                found[int(away_m.argmin())] = pin
        return found


def pins_of(scenario: Scenario) -> Pins:
    """Return the pinned stops of a scenario; one above a user stands where the user does."""
    from mavplan.geo import LocalPlane

    users, stops = scenario.users, scenario.stops
    plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    places_m = plane.to_xy_m(
        [math.nan if stop.lat_deg is None else stop.lat_deg for stop in stops],
        [math.nan if stop.lon_deg is None else stop.lon_deg for stop in stops],
    ).reshape(-1, 2)
    for number, stop in enumerate(stops):
        if stop.user is not None and stop.user in users.names:
            places_m[number] = users.xy_m[users.names.index(stop.user)]
    rank = [_rank(stop.order) for stop in stops]
    return Pins(tuple(stop.name for stop in stops), places_m, np.array(rank, dtype=np.float64))


def _rank(order: int | str | None) -> float:
    ends = {"first": -math.inf, "last": math.inf}
    return math.nan if order is None else ends[order] if isinstance(order, str) else float(order)


def with_pins(
    found: Trajectory, pins: Pins, users: Users, channel: Channel, *, returns: bool, cost: Cost | None = None
) -> Trajectory:
    """Return a planner's trajectory with the pinned stops in it.

    Parameters
    ----------
    found
        Of the planner, without them.
    pins
        At least one.
    users, channel
        Whom it serves, and how.
    returns
        Whether the mission ends at home.
    cost
        Mission times of plans, for a planner that makes them short; None: the length counts.
    """
    d2d = found.planner not in WITHOUT_D2D
    if found.planner == "sbw":
        path, stop_at = _in_snake(found, pins, users, returns=returns)
    else:
        stops = _Stops.of(found.stops_m, pins, users, channel, d2d=d2d)
        if found.planner in MPSS:
            stops = stops.that_serve()
            stops = stops.without_superfluous() if found.planner in LENGTH_ALONE else stops
            stops = stops.taken(nearest_first(stops.places_m, stops.ranks))
        else:
            stops = _short(stops, found.planner, returns=returns, cost=cost)
        path = from_origin(stops.places_m)
        stop_at = np.arange(1, len(path))
    served = assign(users, path[stop_at], channel, d2d=d2d)
    bound = found.bound
    if bound is not None and bound.objective != "mission_s":
        way_m = path_length_m(np.vstack([path, ORIGIN_M]) if bound.objective == "tour_m" else path)
        bound = replace(bound, plan=way_m, bound=min(bound.bound, way_m))
    return replace(found, path_m=path, stop_at=stop_at, assignment=served, bound=bound)


def _short(stops: "_Stops", planner: str, *, returns: bool, cost: Cost | None) -> "_Stops":
    """Return the stops of a planner that makes paths or missions short, pinned ones where the detour is least."""
    whole = stops.taken(inserted(stops.places_m, stops.ranks, returns=returns))
    found = whole
    for _ in range(SWEEPS):
        found = found.without_superfluous(returns=returns)
        found = found.taken(shortened(found.places_m, found.ranks, returns=returns)).slid(returns=returns)
    if cost is None or planner in LENGTH_ALONE:
        return found
    whole = whole.taken(shortened(whole.places_m, whole.ranks, returns=returns))
    return min((whole, _sooner(whole, cost), found), key=lambda some: float(cost(some.places_m[None])[0]))


def _sooner(stops: "_Stops", cost: Cost) -> "_Stops":
    """Return the stops without those that cost time, one after the other."""
    best_s = float(cost(stops.places_m[None])[0])
    while True:
        free = np.flatnonzero(~stops.ranks.pinned & stops.reach_all_without())
        if not len(free):
            return stops
        rows = np.arange(len(stops.places_m))
        seconds = cost(stops.places_m[np.array([np.delete(rows, row) for row in free])])
        at = int(seconds.argmin())
        if seconds[at] >= best_s:
            return stops
        stops, best_s = stops.without(int(free[at])), float(seconds[at])


@dataclass(frozen=True, eq=False)
class _Stops:
    """Stops in flying order, planned and pinned, and whom they reach."""

    places_m: Floats
    ranks: Ranks
    users: Users
    channel: Channel
    d2d: bool

    @classmethod
    def of(cls, planned_m: Floats, pins: Pins, users: Users, channel: Channel, *, d2d: bool) -> "_Stops":
        """Return planned stops, those on a pinned place left out, and behind them the pinned ones."""
        apart_m = np.linalg.norm(planned_m[:, None] - pins.places_m[None], axis=2)
        planned_m = planned_m[(apart_m > SAME_PLACE_M).all(axis=1)]
        count = len(planned_m)
        places = np.vstack([planned_m, pins.places_m])
        rank = np.concatenate([np.full(count, math.nan), pins.rank])
        return cls(places, Ranks(np.arange(len(places)) >= count, rank), users, channel, d2d)

    def that_serve(self) -> "_Stops":
        """Return the stops without planned ones to which nobody is nearest."""
        # Of stops equally near the pinned one serves: it is there anyway.
        order = np.argsort(~self.ranks.pinned, kind="stable")
        best = assign(self.users, self.places_m[order], self.channel, d2d=self.d2d).stop
        return self.taken(np.union1d(order[best[best >= 0]], np.flatnonzero(self.ranks.pinned)))

    def taken(self, order: Ints) -> "_Stops":
        """Return these stops in this order."""
        return replace(self, places_m=self.places_m[order], ranks=self.ranks.taken(order))

    def without(self, row: int) -> "_Stops":
        """Return the stops without one of them."""
        return self.taken(np.delete(np.arange(len(self.places_m)), row))

    def reach_all_without(self) -> Bools:
        """Return (M,) whether each user, or its mate where that counts, is reached without each stop."""
        reached = self._reached()
        count = reached.sum(axis=1)
        return np.array([bool(self._met(count > column).all()) for column in reached.T], dtype=np.bool_)

    def without_superfluous(self, *, returns: bool = False) -> "_Stops":
        """Return the stops without those that nobody needs, the one with the longest detour first."""
        stops = self
        while True:
            spare = np.flatnonzero(~stops.ranks.pinned & stops.reach_all_without())
            if not len(spare):
                return stops
            stops = stops.without(int(spare[int(stops._detours_m(returns=returns)[spare].argmax())]))

    def slid(self, *, returns: bool) -> "_Stops":
        """Return the stops with those that are not pinned nearer to the straight way past them.

        A stop keeps within R of everybody whom only it reaches, so that the path only grows shorter.
        """
        places, reached = self.places_m.copy(), self._reached()
        for row in np.flatnonzero(~self.ranks.pinned).tolist():
            others = self._met(reached.sum(axis=1) > reached[:, row])
            mine = np.flatnonzero(~others & reached[:, row])
            before = places[row - 1] if row else ORIGIN_M
            last = row + 1 == len(places)
            after = None if last and not returns else ORIGIN_M if last else places[row + 1]
            aim = before if after is None else _foot(places[row], before, after)
            step = _longest_step(places[row], aim, self.users.xy_m[mine], self.channel.radius_m)
            places[row] = places[row] + step * (aim - places[row])
            reached[:, row] = self.channel.reaches(np.linalg.norm(self.users.xy_m - places[row], axis=1))
        return replace(self, places_m=places)

    def _reached(self) -> Bools:
        """Return (N, M) whom each stop reaches."""
        from scipy.spatial.distance import cdist

        return self.channel.reaches(cdist(self.users.xy_m, self.places_m))

    def _met(self, covered: Bools) -> Bools:
        return covered | mate_covered(self.users, covered) if self.d2d else covered

    def _detours_m(self, *, returns: bool) -> Floats:
        """Return (M,) how much shorter the path is without each stop."""
        ends = np.vstack([ORIGIN_M, self.places_m, ORIGIN_M])
        legs_m = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        past_m = np.linalg.norm(ends[2:] - ends[:-2], axis=1)
        if not returns:
            legs_m[-1] = past_m[-1] = 0.0
        return np.asarray(legs_m[:-1] + legs_m[1:] - past_m)


def _foot(place: Floats, start: Floats, end: Floats) -> Floats:
    """Return the place between two others that is nearest to a place."""
    along = end - start
    squared = float(along @ along)
    share = 0.0 if squared == 0.0 else min(max(float((place - start) @ along) / squared, 0.0), 1.0)
    return start + share * along


def _longest_step(place: Floats, aim: Floats, users_m: Floats, radius_m: float) -> float:
    """Return how far, from 0 to 1, a place may go towards another and stay within R of these users."""
    if not len(users_m):
        return 1.0

    def within(step: float) -> bool:
        away_m = np.linalg.norm(users_m - (place + step * (aim - place)), axis=1)
        return bool((away_m <= radius_m + REACH_TOLERANCE_M / 2).all())

    if within(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if within(middle) else (low, middle)
    return low


def _in_snake(found: Trajectory, pins: Pins, users: Users, *, returns: bool) -> tuple[Floats, Ints]:
    """Return the path of strips with pinned stops where the detour is least, and which of its points are stops.

    All of the snake is flown; a stop of its own to which nobody is nearest any more is none.
    """
    path = found.path_m[1:]
    places = np.vstack([path, pins.places_m])
    count = len(path)
    pinned = np.arange(len(places)) >= count
    # Of stops equally near the pinned one serves: it is there anyway.
    rows = np.concatenate([np.flatnonzero(pinned), found.stop_at - 1])
    nearest = rows[nearest_of(users.xy_m, places[rows])[1]]
    is_stop = pinned.copy()
    is_stop[nearest] = True
    ranks = Ranks(pinned, np.concatenate([np.full(count, math.nan), pins.rank]))
    order = inserted(places, ranks, returns=returns)
    return from_origin(places[order]), np.flatnonzero(is_stop[order]) + 1
