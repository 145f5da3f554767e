"""How the autopilots fly through a point where the path only turns: how much of a stop is spared there.

A stop costs the ramp down to rest, the ramp up again and the time to settle. ArduPilot begins the next leg while this
one ends, as early as the way stays within a radius of the point and the turn within an acceleration
(libraries/AP_Math/SCurve.cpp, advance_target_along_track). PX4 slows to what a circle that meets both legs on its
acceptance radius allows (src/lib/motion_planning/TrajectoryConstraints.hpp): 1.7 m/s round a right angle, as recorded;
of its ramps that share is spared that the squares of the speeds have, and a sharp turn costs a moment until it is done.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mavplan.mission.flight_law import FlightLaw
from mavplan.mission.motion import Legs

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

STEPS = 60
"""Halvings of the search for when a leg may begin: beyond the last digit of a float."""


@dataclass(frozen=True, eq=False)
class Spared:
    """How much of the ramp at either end of L legs is not flown: 0 from or to rest, 1 at full speed.

    Attributes
    ----------
    first, last
        (L,) shares of the ramps at the legs' beginnings and ends.
    settle
        (L,) share of what a leg's end takes beyond its S-curve.
    wait_s
        (L,) what a turn costs at the legs' beginnings.
    """

    first: Floats
    last: Floats
    settle: Floats
    wait_s: Floats


def spared(legs: Legs, steps_m: Floats, speed_m_s: Floats, through: Bools, law: FlightLaw) -> Spared:
    """Return what is spared where the ends of legs are flown through.

    Parameters
    ----------
    legs
        L legs as they would be flown from rest to rest, in flying order.
    steps_m
        (L, 2) where each leg leads, metres from its beginning.
    speed_m_s
        (L,) asked for each, whether it is reached or not.
    through
        (L,) whether the point at the leg's end is flown through, to the next leg.
    law
        The autopilot's.
    """
    first, last, settle, wait_s = (np.zeros(len(through)) for _ in range(4))
    at = np.flatnonzero(through[:-1])
    lengths_m = np.hypot(*steps_m.T)
    at = at[(lengths_m[at] > 0) & (lengths_m[at + 1] > 0)]
    if len(at):
        inward, outward = (steps_m[legs_at] / lengths_m[legs_at, None] for legs_at in (at, at + 1))
        before, after = _chosen(legs, at), _chosen(legs, at + 1)
        if law.turn == "blend":
            limit = np.minimum(speed_m_s[at], speed_m_s[at + 1])
            shared_s = 2 * _half_turn_s(before, after, inward, outward, limit, law)
            last[at] = _ratio(shared_s, before.ramp_s)
            first[at + 1] = _ratio(shared_s, after.ramp_s)
            settle[at] = 1.0
        else:
            near = np.minimum(lengths_m[at], lengths_m[at + 1]) < law.turn_radius_m
            speed = np.where(near, 0.0, _corner_speed_m_s(inward, outward, law))
            speed = np.minimum(speed, np.minimum(before.peak_m_s, after.peak_m_s))
            last[at] = settle[at] = _ratio(speed, before.peak_m_s) ** 2
            first[at + 1] = _ratio(speed, after.peak_m_s) ** 2
            wait_s[at + 1] = np.where(near, 0.0, law.turn_wait_s * (1 - first[at + 1]))
    return Spared(first, last, settle, wait_s)


def _chosen(legs: Legs, at: NDArray[np.int64]) -> Legs:
    return replace(legs, peak_m_s=legs.peak_m_s[at], ramp_s=legs.ramp_s[at], plateau_s=legs.plateau_s[at])


def _ratio(part: Floats, whole: Floats) -> Floats:
    return np.divide(part, whole, out=np.ones_like(part), where=whole > 0)


def _half_turn_s(
    before: Legs, after: Legs, inward: Floats, outward: Floats, limit_m_s: Floats, law: FlightLaw
) -> Floats:
    """Return half the time for which two legs are flown at once: the middle of the turn is at its end.

    There both have as much of their ramps behind or before them. The sooner the next leg begins, the further from the
    point is that place, and the greater speed and acceleration; all three have limits.
    """
    low, high = np.zeros(len(inward)), np.minimum(before.ramp_s, after.ramp_s) / 2
    for _ in range(STEPS):
        middle = (low + high) / 2
        apart_m = _summed(after.way_m(middle), outward, -before.way_m(middle), inward)
        speed = _summed(after.speed_m_s(middle), outward, before.speed_m_s(middle), inward)
        pulled = _summed(after.acceleration_at(middle), outward, -before.acceleration_at(middle), inward)
        # At full overlap of straight legs the sum is the limit itself.
        fits = (
            (apart_m < law.turn_radius_m)
            & (speed <= limit_m_s * (1 + 1e-9))
            & (pulled < law.turn_acceleration_m_s2)
        )
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return low


def _summed(one: Floats, along: Floats, other: Floats, along_other: Floats) -> Floats:
    return np.asarray(np.hypot(*(one[:, None] * along + other[:, None] * along_other).T))


def _corner_speed_m_s(inward: Floats, outward: Floats, law: FlightLaw) -> Floats:
    """Return √(a·r·tan(α/2)) with the angle α between the legs: infinite straight on, 0 straight back."""
    # tan(α/2) of the angle between −inward and outward: √((1 − cos α)/(1 + cos α)), cos α = −inward·outward.
    straight = np.clip((inward * outward).sum(axis=1), -1.0, 1.0)
    with np.errstate(divide="ignore"):
        tangent = np.sqrt((1 + straight) / (1 - straight))
    return np.asarray(np.sqrt(law.turn_acceleration_m_s2 * law.turn_radius_m * tangent))
