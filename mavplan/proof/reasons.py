"""Why a user is short: the stop at which most of its bits were lost, and what was wrong there. Pure."""

from collections.abc import Sequence

import numpy as np

from mavplan.hover import DEMAND_TOLERANCE_BIT
from mavplan.proof.model import FlownStop
from mavplan.proof.receive import Received, rates_bit_s
from mavplan.radio import Channel
from mavplan.stored_plan import StoredPlan
from mavplan.track.model import Floats

SHORTER_S = 0.3
"""A hold shorter than planned by less is as planned: words about items come that late."""

AWAY_M, LOWER_M = 5.0, 5.0
"""Further from the planned place or height is worth a word."""


def shortfall_reasons(
    plan: StoredPlan,
    stops: Sequence[FlownStop],
    received: Received,
    d2d_bit: Floats,
    places_m: Floats,
    channel: Channel,
) -> dict[int, str]:
    """Return for each user that is short, by its index, a clause that names the stop and what was wrong.

    Parameters
    ----------
    plan
        With N users and M stops.
    stops
        M stops as flown.
    received
        From the vehicle.
    d2d_bit
        (N,) from mates.
    places_m
        (M, 2) planned places.
    channel
        As it is.
    """
    users = plan.scenario.users
    short = users.demand_bit - received.total_bit - d2d_bit
    reasons = {}
    for user in np.flatnonzero(short > DEMAND_TOLERANCE_BIT).tolist():
        served = int(users.mate[user]) if plan.d2d[user] else user
        lost_bit = _planned_bit(plan, served, places_m, channel) - received.hold_bit[:, served]
        stop = int(lost_bit.argmax())
        if lost_bit[stop] <= DEMAND_TOLERANCE_BIT:
            stop = int(plan.stop_of[user])
        clause = _clause(stop, stops[stop])
        if plan.d2d[user]:
            mate, own_bit = users.names[served], users.demand_bit[served]
            if received.total_bit[served] >= own_bit + users.demand_bit[user] - DEMAND_TOLERANCE_BIT:
                clause = f"its mate {mate} received enough, the link between the two is too slow"
            else:
                clause = f"through its mate {mate}: {clause}"
        reasons[user] = clause
    return reasons


def _planned_bit(plan: StoredPlan, user: int, places_m: Floats, channel: Channel) -> Floats:
    """Return (M,) bits that a user receives at each stop if it is held as planned, at its place."""
    height_m = np.array([stop.alt_rel_m for stop in plan.stops])
    rates = rates_bit_s(places_m, height_m, plan.listeners_m[[user]], channel)[:, 0]
    if plan.hidden is not None:
        rates = np.where(plan.hidden[user], 0.0, rates)
    if plan.scenario.service.mode == "tdma":
        turns_s = np.zeros(len(places_m))
        for slot in plan.schedule:
            if slot.user == user:
                turns_s[slot.stop] += slot.duration_s
        return rates * turns_s
    return rates * plan.hold_s


def _clause(stop: int, flown: FlownStop) -> str:
    """Return what was wrong at a stop."""
    name = f"stop {stop + 1}"
    if flown.span is None:
        return f"{name} was not held, the flight came as near as {flown.away_m:,.0f} m"
    found = []
    if flown.held_s < flown.planned_s - SHORTER_S:
        found.append(f"held {flown.held_s:,.1f} of {flown.planned_s:,.1f} s")
    if flown.most_away_m > 2 * flown.away_m + AWAY_M:
        found.append(f"pushed up to {flown.most_away_m:,.0f} m from its place")
    elif flown.away_m > AWAY_M:
        found.append(f"held {flown.away_m:,.0f} m from its place")
    if flown.higher_m is not None and abs(flown.higher_m) > LOWER_M:
        side = "above" if flown.higher_m > 0 else "below"
        found.append(f"held {abs(flown.higher_m):,.0f} m {side} the planned height")
    if flown.uncounted_s > SHORTER_S:
        found.append(f"{flown.uncounted_s:,.1f} s of its hold do not count (no positions, or too low)")
    return f"{name}: {', '.join(found)}" if found else f"{name}: held as planned, but too far for its rate"
