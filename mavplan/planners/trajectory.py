"""A `Trajectory`, what every planner gives back: ordered stop points, and for every user who serves it and how."""

from dataclasses import dataclass, replace

import numpy as np

from mavplan.bounds import Bound
from mavplan.errors import Problem
from mavplan.planners.geometry import nearest_of
from mavplan.planners.ordering import from_origin, minimum_path_order, path_length_m
from mavplan.radio import Channel
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints, Users

NO_STOP = -1
"""In `Assignment.stop`: nobody serves this user."""


@dataclass(frozen=True, eq=False)
class Assignment:
    """Who is served where. N users.

    Attributes
    ----------
    stop
        (N,) index of the stop with the best rate; for a D2D user the one of its mate; `NO_STOP` if unserved.
    d2d
        (N,) whether the user is served through its mate.
    rate_bit_s_hz
        (N,) log2(1 + SNR) of the link that serves the user, 0 if unserved.
    """

    stop: Ints
    d2d: Bools
    rate_bit_s_hz: Floats

    @property
    def served(self) -> Bools:
        """(N,) whether anybody serves the user."""
        return np.not_equal(self.stop, NO_STOP)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A path from the origin (0, 0), the stop points on it in flying order, and who is served where; no return.

    Attributes
    ----------
    planner, clusters
        Name in the registry; the number of clusters used, 0 where the planner has none.
    path_m
        (P + 1, 2) metres east and north of home: the origin, then every point that is flown to.
    stop_at
        (M,) rows of ``path_m`` that are stop points; the others are only turned at.
    reference_m
        (S + 1, 2) reference polyline from the origin that supplementary stops were measured against; may be empty.
    assignment
        Who is served where; its stops count as ``stop_at`` does.
    radius_m
        Coverage radius R.
    notes
        What the planner had to change or decide that a user should know.
    bound
        What no plan can be below, where the planner proves one.
    """

    planner: str
    clusters: int
    path_m: Floats
    stop_at: Ints
    reference_m: Floats
    assignment: Assignment
    radius_m: float
    notes: tuple[Problem, ...] = ()
    bound: Bound | None = None

    @property
    def stops_m(self) -> Floats:
        """(M, 2) the stop points in flying order."""
        return self.path_m[self.stop_at]

    @property
    def length_m(self) -> float:
        """Length of the path, from the origin to its last point."""
        return path_length_m(self.path_m)

    @property
    def sum_rate_bit_s_hz(self) -> float:
        """Sum of the users' rates, each counted once where it is served best: the paper's sum throughput."""
        return float(self.assignment.rate_bit_s_hz.sum())


def shortest_steps(
    planner: str,
    users: Users,
    channel: Channel,
    stops_m: Floats,
    *,
    reference_m: Floats,
    d2d: bool,
    clusters: int,
    notes: tuple[Problem, ...],
) -> Trajectory:
    """Return the trajectory through these stops in MPSS order, its users assigned: how TLOAIK and its kin end.

    Parameters
    ----------
    stops_m
        (M, 2) stops of both phases, in any order.
    """
    ordered_m = stops_m[minimum_path_order(stops_m)]
    found = through(planner, users, channel, ordered_m, d2d=d2d)
    return replace(found, clusters=clusters, reference_m=reference_m, notes=notes)


def through(
    planner: str,
    users: Users,
    channel: Channel,
    stops_m: Floats,
    *,
    d2d: bool = True,
    bound: Bound | None = None,
) -> Trajectory:
    """Return the trajectory from the origin straight through (M, 2) stops in this order, its users assigned."""
    path = from_origin(stops_m)
    return Trajectory(
        planner=planner,
        clusters=0,
        path_m=path,
        stop_at=np.arange(1, len(path)),
        reference_m=np.empty((0, 2)),
        assignment=assign(users, stops_m, channel, d2d=d2d),
        radius_m=channel.radius_m,
        bound=bound,
    )


def moved(found: Trajectory, users: Users, channel: Channel, stops_m: Floats) -> Trajectory:
    """Return a trajectory with what else it says, but straight through other (M, 2) stops and for other users."""
    other = through(found.planner, users, channel, stops_m)
    return replace(
        found,
        path_m=other.path_m,
        stop_at=other.stop_at,
        assignment=other.assignment,
        radius_m=other.radius_m,
    )


def cut_out(found: Trajectory, users: Users, channel: Channel, stops_m: Floats) -> Trajectory:
    """Return the part of a trajectory straight through (M, 2) of its stops for some users, without notes and bound."""
    return replace(through(found.planner, users, channel, stops_m), clusters=found.clusters)


def assign(users: Users, stops_m: Floats, channel: Channel, *, d2d: bool) -> Assignment:
    """Serve each user from its nearest stop within R, else, where ``d2d``, through a mate that is so served.

    D2D does not chain. Its rate is the smaller of the mate's best air rate and that of the link between the two.
    """
    distance_m, nearest = nearest_of(users.xy_m, stops_m)
    reached = channel.reaches(distance_m)
    stop = np.where(reached, nearest, NO_STOP)
    rate = np.where(reached, channel.air_rate(distance_m), 0.0)
    through_mate = np.zeros(len(users), dtype=bool)
    if d2d:
        through_mate = ~reached & mate_covered(users, reached)
        mates = users.mate[through_mate]
        apart_m = np.linalg.norm(users.xy_m[through_mate] - users.xy_m[mates], axis=1)
        stop[through_mate] = nearest[mates]
        rate[through_mate] = np.minimum(rate[mates], channel.d2d_rate(apart_m))
    return Assignment(stop=stop, d2d=through_mate, rate_bit_s_hz=rate)


def mate_covered(users: Users, covered: Bools) -> Bools:
    """(N,) whether the user has a mate and that mate is covered."""
    paired: Bools = users.mate != UNPAIRED
    return paired & covered[users.mate]
