"""Who is heard from where over real ground, and stops for those whom nobody would serve. Pure.

Planners know a plane. Here every user stands on the ground at its place, every stop hangs at its altitude, and the
ground may stand between the two.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.planners.pinned import NO_PIN, Pins
from mavplan.planners.trajectory import NO_STOP, Assignment, Trajectory, mate_covered
from mavplan.radio import REACH_TOLERANCE_M, Channel, highest_altitude_m, spectral_rate
from mavplan.scenario.model import Bools, Floats, Users
from mavplan.terrain.grid import USER_M, Terrain

Route = Callable[[Floats, Floats], "list[Floats] | None"]
"""From one place to another: where the way turns; None where there is none."""


@dataclass(frozen=True, eq=False)
class Links:
    """What M stops give N users.

    Attributes
    ----------
    rates_bit_s_hz
        (N, M) log2(1+γ); 0 where the user is out of reach or the ground is in the way.
    hidden
        (N, M) whether the user would be in reach and the ground is in the way.
    """

    rates_bit_s_hz: Floats
    hidden: Bools

    def with_stop(self, number: int, other: "Links") -> "Links":
        """Return the links with those of one more stop, which becomes this number, from 0."""
        return Links(
            np.insert(self.rates_bit_s_hz, number, other.rates_bit_s_hz[:, 0], axis=1),
            np.insert(self.hidden, number, other.hidden[:, 0], axis=1),
        )

    def without_stop(self, number: int) -> "Links":
        """Return the links without those of a stop, from 0."""
        return Links(np.delete(self.rates_bit_s_hz, number, axis=1), np.delete(self.hidden, number, axis=1))


def links_of(
    terrain: Terrain, users_m: Floats, stops_m: Floats, stop_alt_m: Floats, channel: Channel
) -> Links:
    """Return who is heard from which stop.

    Parameters
    ----------
    terrain
        Known at all users.
    users_m, stops_m
        (N, 2) and (M, 2) places.
    stop_alt_m
        (M,) metres above sea level.
    channel
        Reach is the distance in space at which its threshold is met, less what it keeps for drift.
    """
    user_alt_m = terrain.height_m(users_m) + USER_M
    over_ground_m = np.linalg.norm(users_m[:, None, :] - stops_m[None, :, :], axis=2)
    slant_m = np.hypot(over_ground_m, stop_alt_m[None, :] - user_alt_m[:, None]) + channel.position_error_m
    reached = slant_m <= highest_altitude_m(channel.radio) + REACH_TOLERANCE_M
    user, stop = np.nonzero(reached)
    clear = terrain.sees(users_m[user], user_alt_m[user], stops_m[stop], stop_alt_m[stop])
    hidden = np.zeros_like(reached)
    hidden[user, stop] = ~clear
    rates = spectral_rate(slant_m**2, channel.gamma0, channel.radio.path_loss_exponent)
    return Links(np.where(reached & ~hidden, rates, 0.0), hidden)


def assign_by(links: Links, users: Users, channel: Channel) -> Assignment:
    """Serve each user from the stop that gives it most, else through a mate that is so served; ties go to the first."""
    rate = links.rates_bit_s_hz.max(axis=1, initial=0.0)
    reached = rate > 0
    best = (
        links.rates_bit_s_hz.argmax(axis=1)
        if links.rates_bit_s_hz.shape[1]
        else np.zeros(len(users), np.int64)
    )
    stop = np.where(reached, best, NO_STOP)
    d2d = ~reached & mate_covered(users, reached)
    mates = users.mate[d2d]
    apart_m = np.linalg.norm(users.xy_m[d2d] - users.xy_m[mates], axis=1)
    stop[d2d] = stop[mates]
    rate[d2d] = np.minimum(rate[mates], channel.d2d_rate(apart_m))
    return Assignment(stop=stop, d2d=d2d, rate_bit_s_hz=rate)


@dataclass(frozen=True, eq=False)
class Served:
    """A trajectory that serves everybody over real ground, its links, and where the way back turns."""

    trajectory: Trajectory
    links: Links
    back_m: Floats


def serve_all(
    trajectory: Trajectory,
    users: Users,
    channel: Channel,
    altitudes_of: Callable[[Floats], Floats],
    terrain: Terrain,
    *,
    back_m: Floats,
    returns: bool,
    closed: Callable[[Floats], Bools],
    route: Route,
    pins: Pins,
) -> Served:
    """Return the trajectory with a stop straight above each user whom none of its stops serves as the ground is.

    Parameters
    ----------
    trajectory
        As it was planned in the plane.
    users, channel
        Whom it serves, and how.
    altitudes_of
        Takes places of stops, gives their altitudes above sea level.
    terrain
        The ground.
    back_m
        (B, 2) where the way back turns.
    returns
        Whether there is one.
    closed
        Takes places (K, 2), gives which of them no vehicle may be at.
    route
        The way between two places.
    pins
        Stops that stay, and keep their place in the order.

    Raises
    ------
    InputError
        Every user above whom no stop may be.
    """
    ranks = [float(pins.rank[pin]) for pin in pins.at(trajectory.stops_m).tolist() if pin != NO_PIN]
    ends = -math.inf in ranks, math.inf in ranks
    way = _Way(list(trajectory.path_m), trajectory.stop_at.tolist(), list(back_m), route, returns, ends)
    own_stop, problems = [], []

    def links_to(stops_m: Floats) -> Links:
        return links_of(terrain, users.xy_m, stops_m, altitudes_of(stops_m), channel)

    links = links_to(trajectory.stops_m)
    assignment = assign_by(links, users, channel)
    for user in range(len(users)):
        if assignment.served[user]:
            continue
        place = users.xy_m[user]
        number = None if closed(place[None])[0] else way.insert(place)
        if number is None:
            why = _why(links.hidden[user], list(range(len(way.stop_at))), trajectory.assignment.d2d[user])
            message = f"cannot be served: {why}, and no-fly zones leave no way to a stop straight above it"
            problems.append(Problem(users.names[user], message, "no-sight"))
            continue
        own_stop.append(user)
        links = links.with_stop(number, links_to(place[None]))
        assignment = assign_by(links, users, channel)
    if problems:
        raise InputError(problems)
    hidden, kept = links.hidden, list(range(len(way.stop_at)))
    if own_stop:
        # A stop that lost all its users to others is flown to for nobody.
        pinned = np.flatnonzero(pins.at(np.array([way.path[at] for at in way.stop_at])) != NO_PIN)
        for number in reversed(np.setdiff1d(kept, [*assignment.stop.tolist(), *pinned.tolist()]).tolist()):
            way.drop(number)
            kept.remove(number)
            links = links.without_stop(number)
        assignment = assign_by(links, users, channel)
    told = [
        Problem(
            users.names[user],
            "has a stop of its own, straight above it: "
            + _why(hidden[user], kept, trajectory.assignment.d2d[user]),
            "terrain-stop",
            "warning",
        )
        for user in own_stop
    ]
    found = replace(
        trajectory,
        path_m=np.array(way.path),
        stop_at=np.array(way.stop_at, dtype=np.int64),
        assignment=assignment,
        notes=(*trajectory.notes, *told),
    )
    return Served(found, links, np.array(way.back).reshape(-1, 2))


@dataclass
class _Way:
    """A path that stops are put into and taken out of: its points, the rows of its stops, where the way back turns.

    ``ends`` says whether its first stop must stay the first, and the last one the last.
    """

    path: list[Floats]
    stop_at: list[int]
    back: list[Floats]
    route: Route
    returns: bool
    ends: tuple[bool, bool] = (False, False)

    def insert(self, place: Floats) -> int | None:
        """Put a stop where its detour is least; return its number, from 0, or None where there is no way to it."""
        low = self.stop_at[0] if self.ends[0] else 0
        high = self.stop_at[-1] - 1 if self.ends[1] else len(self.path) - 1
        row = _insertion(self.path, place, low, high, returns=self.returns)
        to = self.route(self.path[row], place)
        on = self.route(place, self.path[row + 1]) if row + 1 < len(self.path) else []
        if to is None or on is None:
            return None
        number = sum(at <= row for at in self.stop_at)
        added = len(to) + 1 + len(on)
        self.path[row + 1 : row + 1] = [*to, place, *on]
        later = [at + added for at in self.stop_at[number:]]
        self.stop_at = [*self.stop_at[:number], row + 1 + len(to), *later]
        self._turn_back()
        return number

    def drop(self, number: int) -> None:
        """Take a stop out; where zones leave no straight way past it, it stays as a turning point."""
        row = self.stop_at.pop(number)
        if row + 1 == len(self.path):
            del self.path[self.stop_at[-1] + 1 :]
            self._turn_back()
        elif self.route(self.path[row - 1], self.path[row + 1]) == []:
            del self.path[row]
            self.stop_at[number:] = [at - 1 for at in self.stop_at[number:]]

    def _turn_back(self) -> None:
        if self.returns:
            self.back = self.route(self.path[-1], np.zeros(2)) or []


def _why(hidden: Bools, kept: list[int], by_mate: bool) -> str:
    """Return why the stops of a plan in the plane do not serve a user.

    Parameters
    ----------
    hidden
        (M,) from which stops the ground hides it.
    kept
        Which of them are flown to, in their order: the names of stops count these.
    by_mate
        Whether it was to be served through its mate.
    """
    hiding = [kept.index(stop) + 1 for stop in np.flatnonzero(hidden).tolist() if stop in kept]
    if hiding:
        more = " and more" if len(hiding) > 5 else ""
        stops = ", ".join(map(str, hiding[:5]))
        return f"the ground hides it from stop{'s' if len(hiding) > 1 else ''} {stops}{more}"
    if hidden.any():
        return "the ground hides it from where it was to be served"
    if by_mate:
        return "its mate, through which it was to be served, is not served from the air"
    return "as high as it and the stops really are, none of them is near enough"


def _insertion(path: list[Floats], place: Floats, low: int, high: int, *, returns: bool) -> int:
    """Return the row of a path, from low to high, behind which a place costs the least detour."""
    points = np.array(path)
    ends = np.vstack([points[1:], np.zeros((1, 2))]) if returns else points[1:]
    starts = points if returns else points[:-1]
    detour = (
        np.linalg.norm(starts - place, axis=1)
        + np.linalg.norm(ends - place, axis=1)
        - np.linalg.norm(ends - starts, axis=1)
    )
    if not returns:
        detour = np.append(detour, np.linalg.norm(points[-1] - place))
    return low + int(detour[low : high + 1].argmin())
