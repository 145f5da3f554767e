"""Whether a mission keeps what its plan pins: stops at their places, held long enough, in their order. Pure."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mavplan.errors import Problem
from mavplan.mission.model import Mission
from mavplan.radio import planning_channel, spectral_rate
from mavplan.scenario.sections import PinnedStop

if TYPE_CHECKING:
    from mavplan.stored_plan import StoredPlan

PLACE_M = 0.05
"""What 1e-7 degrees may move a stop, and a little more."""

TOLERANCE_BIT = 2.0
"""A demand short of less than this is met."""


def pinned_faults(plan: "StoredPlan", mission: Mission) -> Iterator[Problem]:
    """Yield everything that a mission does not keep of the pinned stops of its plan.

    Parameters
    ----------
    plan
        Says which places are pinned, and which items of the mission are stops.
    mission
        What is flown.
    """
    from mavplan.geo import geodesic_distance_m

    items = [mission.items[stop.items.first] for stop in plan.stops]
    holds_s = [mission.items[stop.items.hold].params[0] for stop in plan.stops]
    visits: list[tuple[int, PinnedStop]] = []
    for pinned in plan.scenario.stops:
        if pinned.lat_deg is None or pinned.lon_deg is None:
            yield Problem(pinned.name, "has no place in the plan", "pinned-place")
            continue
        away_m = [
            float(geodesic_distance_m(pinned.lat_deg, pinned.lon_deg, item.lat_deg, item.lon_deg))
            for item in items
        ]
        at = min(range(len(away_m)), key=lambda stop: away_m[stop])
        if away_m[at] > PLACE_M:
            message = f"is pinned, and no stop is there: the nearest is {away_m[at]:,.1f} m away"
            yield Problem(pinned.name, message, "pinned-place")
            continue
        visits.append((at, pinned))
        least_s = max(pinned.hold_s, _served_s(plan, pinned, at))
        if holds_s[at] < least_s - 1e-3:
            message = f"is held {holds_s[at]:,.1f} s at stop {at + 1}, and needs {least_s:,.1f} s"
            yield Problem(pinned.name, message, "pinned-hold")
    yield from _order_faults(visits, len(items))


def _served_s(plan: "StoredPlan", pinned: PinnedStop, stop: int) -> float:
    """Return how long it takes to give the user below a stop all it needs; 0 where there is none."""
    users = plan.scenario.users
    if pinned.user not in users.names:
        return 0.0
    user, channel = users.names.index(pinned.user), planning_channel(plan.scenario)
    demand_bit = float(users.demand_bit[user])
    mate = int(users.mate[user])
    if mate >= 0 and plan.d2d[mate]:
        demand_bit += float(users.demand_bit[mate])
    if plan.d2d[user] or demand_bit <= TOLERANCE_BIT:
        return 0.0
    height_m = channel.altitude_m
    if plan.user_rel_m is not None:
        height_m = plan.stops[stop].alt_rel_m - float(plan.listeners_m[user, 2])
    slant_m = np.array([height_m + channel.position_error_m])
    rate = spectral_rate(slant_m**2, channel.gamma0, channel.radio.path_loss_exponent)
    return (demand_bit - TOLERANCE_BIT) / (channel.radio.bandwidth_hz * float(rate[0]))


def _order_faults(visits: list[tuple[int, PinnedStop]], stops: int) -> Iterator[Problem]:
    """Yield pinned stops that are flown out of their order; ``visits`` are stops from 0 with what is pinned there."""
    for at, pinned in visits:
        if pinned.order == "first" and at != 0:
            yield Problem(pinned.name, f"is to be the first stop, and is stop {at + 1}", "pinned-order")
        if pinned.order == "last" and at != stops - 1:
            message = f"is to be the last stop, and is stop {at + 1} of {stops}"
            yield Problem(pinned.name, message, "pinned-order")
    ordered = sorted(
        ((pinned.order, at, pinned) for at, pinned in visits if isinstance(pinned.order, int)),
        key=lambda visit: visit[0],
    )
    before = -math.inf
    for order, at, pinned in ordered:
        if at < before:
            message = f"has order {order}, and is flown at stop {at + 1}, before one with a lower order"
            yield Problem(pinned.name, message, "pinned-order")
        before = max(before, at)
