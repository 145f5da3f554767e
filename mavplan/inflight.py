"""In-flight service: what users receive while the vehicle flies past, section 9. Pure.

The rate of each user is integrated along each leg: from rest to rest between stops, 0 beyond R, nothing during climb,
descent and return. Where the hold at its end begins before the rest, a leg counts until then. What the vehicle's real
flight adds is left out: the time to settle at a stop, legs slower than planned, and the brakes at a point that is only
turned at.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.motion import Legs, rest_to_rest
from mavplan.mission.phases import Vehicle as Flyer
from mavplan.planners.trajectory import Trajectory
from mavplan.radio import Channel
from mavplan.scenario.model import Bools, Floats, Ints, Scenario
from mavplan.scenario.sections import Vehicle

TOLERANCE = 1e-9
"""Share of the time in reach, at the best rate in it, by which an integral may be off."""

MOST_SPLITS = 30
"""A piece of a leg is cut in two so often at most."""

HALVINGS = 60
"""Of a phase, until a moment in it is found: to its length over 2⁶⁰."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


COUNTED_BY = frozenset({"time"})
"""Planners whose holds count what is received in flight where the scenario does not say."""


def counts_in_flight(scenario: Scenario) -> bool:
    """Return whether the hold times of a scenario count what users receive in flight: not over real ground."""
    service = scenario.service
    if service.mode != "broadcast" or scenario.terrain_options.file is not None:
        return False
    return scenario.planner.name in COUNTED_BY if service.in_flight is None else service.in_flight


def received_in_flight(
    users_m: Floats, trajectory: Trajectory, channel: Channel, vehicle: Vehicle, rules: AutopilotRules
) -> Floats:
    """Return (N,) bits that each of (N, 2) users receives from the vehicle on the legs of a trajectory.

    The legs are flown at the vehicle's planned speed also where the autopilot's default limit is below it: slower
    flight only gives more. A point that is no stop is flown through: the legs there count at full speed, and not
    within the radius by which the corner may be cut.
    """
    path = trajectory.path_m
    at_rest = np.zeros(len(path), dtype=bool)
    at_rest[0] = at_rest[trajectory.stop_at] = True
    resting = at_rest[:-1] & at_rest[1:]
    flyer, speed_m_s = Flyer(rules, vehicle.acceleration_m_s2), vehicle.speed_m_s
    start, end = _uncut(path, at_rest, flyer.law.turn_radius_m)
    length_m = np.linalg.norm(end - start, axis=1)
    slowed = flyer.motion(length_m[resting], speed_m_s)
    early_s = flyer.held_early_s(slowed, length_m[resting], speed_m_s)
    bits = received_on_legs(users_m, start[resting], end[resting], slowed, channel, early_s)
    steady = rest_to_rest(length_m[~resting], speed_m_s)
    return bits + received_on_legs(users_m, start[~resting], end[~resting], steady, channel)


def _uncut(path_m: Floats, at_rest: Bools, radius_m: float) -> tuple[Floats, Floats]:
    """Return the ends (L, 2) of the legs of a path, without what lies within a radius of points flown through."""
    steps = np.diff(path_m, axis=0)
    length_m = np.linalg.norm(steps, axis=1)
    along = steps / np.where(length_m > 0, length_m, 1.0)[:, None]
    cut_m = np.where(at_rest, 0.0, radius_m)
    first_m = np.minimum(cut_m[:-1], length_m / 2)
    last_m = np.minimum(cut_m[1:], length_m / 2)
    return path_m[:-1] + first_m[:, None] * along, path_m[1:] - last_m[:, None] * along


def received_on_legs(
    users_m: Floats,
    start_m: Floats,
    end_m: Floats,
    legs: Legs,
    channel: Channel,
    early_s: Floats | None = None,
) -> Floats:
    """Return (N,) bits that each user receives on straight legs.

    Parameters
    ----------
    users_m
        (N, 2) users.
    start_m, end_m
        (L, 2) ends of the legs.
    legs
        How the L legs are flown.
    channel
        Rates and R.
    early_s
        (L,) seconds before the end of each that do not count any more.
    """
    bits = np.zeros(len(users_m))
    length_m = np.linalg.norm(end_m - start_m, axis=1)
    leg, user = _near(users_m, start_m, end_m, length_m, channel.radius_m)
    along = (end_m - start_m) / np.where(length_m > 0, length_m, 1.0)[:, None]
    offset = users_m[user] - start_m[leg]
    abeam_m = np.einsum("ij,ij->i", offset, along[leg])
    aside_m2 = np.maximum(np.einsum("ij,ij->i", offset, offset) - abeam_m**2, 0.0)
    half_chord_m = np.sqrt(np.maximum(channel.radius_m**2 - aside_m2, 0.0))
    pairs = _of(legs, leg)
    counts_s = legs.time_s[leg] - (0.0 if early_s is None else early_s[leg])
    for phase in PHASES:
        enter_s = _moment_s(pairs, length_m[leg], phase, abeam_m - half_chord_m)
        leave_s = _moment_s(pairs, length_m[leg], phase, abeam_m + half_chord_m)
        leave_s = np.minimum(leave_s, counts_s)
        counts_s = counts_s - phase.lasts_s(pairs)
        inside = np.flatnonzero(leave_s > enter_s)

        def rate_bit_s(which: Ints, time_s: Floats, phase: Phase = phase, inside: Ints = inside) -> Floats:
            pair = inside[which][:, None]
            place_m = phase.place_m(_of(pairs, pair), length_m[leg[pair]], time_s)
            away_m = np.sqrt(aside_m2[pair] + (place_m - abeam_m[pair]) ** 2)
            return channel.radio.bandwidth_hz * channel.air_rate(away_m)

        received = integrate(rate_bit_s, enter_s[inside], leave_s[inside])
        bits += np.bincount(user[inside], received, minlength=len(bits))
    return bits


@dataclass(frozen=True)
class Phase:
    """A part of every leg: how long it lasts, and where the vehicle is a time after it began."""

    lasts_s: Callable[[Legs], Floats]
    place_m: Callable[[Legs, Floats, Floats], Floats]


PHASES = (
    Phase(lambda legs: legs.ramp_s, lambda legs, _, time_s: legs.way_m(time_s)),
    Phase(
        lambda legs: legs.plateau_s,
        lambda legs, _, time_s: legs.peak_m_s * (legs.ramp_s / 2 + time_s),
    ),
    Phase(
        lambda legs: legs.ramp_s,
        lambda legs, length_m, time_s: length_m - legs.way_m(legs.ramp_s - time_s),
    ),
)
"""Up the ramp, on at the peak speed, down the ramp."""


def _of(legs: Legs, which: Ints) -> Legs:
    """Return some of the legs, in the shape of their indices."""
    return replace(
        legs,
        peak_m_s=legs.peak_m_s[which],
        ramp_s=legs.ramp_s[which],
        plateau_s=legs.plateau_s[which],
    )


def _moment_s(legs: Legs, length_m: Floats, phase: Phase, place_m: Floats) -> Floats:
    """Return how long after the beginning of a phase a place is passed; its first or last moment if in no other."""
    before, after = np.zeros(len(length_m)), phase.lasts_s(legs)
    for _ in range(HALVINGS):
        middle = (before + after) / 2
        beyond = phase.place_m(legs, length_m, middle) >= place_m
        after, before = np.where(beyond, middle, after), np.where(beyond, before, middle)
    return (before + after) / 2


def _near(
    users_m: Floats, start_m: Floats, end_m: Floats, length_m: Floats, radius_m: float
) -> tuple[Ints, Ints]:
    """Return pairs of leg and user that may be within R of each other."""
    from scipy.spatial import KDTree

    moved = np.flatnonzero(length_m > 0)
    around = KDTree(users_m).query_ball_point(
        (start_m[moved] + end_m[moved]) / 2, length_m[moved] / 2 + radius_m, return_sorted=True
    )
    counts = np.array([len(found) for found in around], dtype=np.int64)
    user = np.concatenate([np.asarray(found, dtype=np.int64) for found in around] or [counts])
    return np.repeat(moved, counts), user


def integrate(
    function: Callable[[Ints, Floats], Floats], lower: Floats, upper: Floats, tolerance: float = TOLERANCE
) -> Floats:
    """Return the integrals of K functions, each by Gauss-Legendre on halves of its interval until they agree.

    Parameters
    ----------
    function
        Takes (J,) indices of functions and (J, Q) arguments; gives (J, Q) values, not negative.
    lower, upper
        (K,) limits.
    tolerance
        Share of length times greatest value seen by which an integral may be off.
    """
    total = np.zeros(len(lower))
    which = np.arange(len(lower))
    low, high = lower, upper
    whole, allowed = _gauss(function, which, low, high)
    allowed = allowed * (high - low) * tolerance
    for _ in range(MOST_SPLITS):
        middle = (low + high) / 2
        left, _ = _gauss(function, which, low, middle)
        right, _ = _gauss(function, which, middle, high)
        rough = np.abs(left + right - whole) > allowed[which]
        total += np.bincount(which[~rough], (left + right)[~rough], minlength=len(total))
        if not rough.any():
            return total
        which = np.tile(which[rough], 2)
        low = np.concatenate([low[rough], middle[rough]])
        high = np.concatenate([middle[rough], high[rough]])
        whole = np.concatenate([left[rough], right[rough]])
    return total + np.bincount(which, whole, minlength=len(total))


def _gauss(
    function: Callable[[Ints, Floats], Floats], which: Ints, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Return integrals by one rule, and the greatest value that each met."""
    half = (high - low) / 2
    values = function(which, (low + half)[:, None] + half[:, None] * _NODES)
    return half * (values @ _WEIGHTS), values.max(axis=1, initial=0.0)
