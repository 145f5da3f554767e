"""Who gets what in which sortie: each user's demand dealt out to the flights that serve it. Pure.

A user is served by one sortie where one is enough, else by several in flying order. A user served through D2D goes with
its mate, which receives for both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.hover import DEMAND_TOLERANCE_BIT, Holds, broadcast_rates, demand_on_air, hold_times
from mavplan.inflight import counts_in_flight, received_in_flight
from mavplan.mission.autopilots import AutopilotRules
from mavplan.planners.ordering import from_origin
from mavplan.planners.pinned import NO_PIN, pins_of
from mavplan.planners.trajectory import Trajectory, cut_out
from mavplan.radio import Channel, planning_channel
from mavplan.scenario.model import Bools, Floats, Ints, Scenario, Users
from mavplan.scenario.sections import PinnedStop
from mavplan.sorties.split import Leaf


@dataclass(frozen=True, eq=False)
class Share:
    """One sortie: a scenario of its own users with what each receives in it, its trajectory and its holds."""

    scenario: Scenario
    trajectory: Trajectory
    holds: Holds


def shares(
    scenario: Scenario, trajectory: Trajectory, holds: Holds, leaves: Sequence[Leaf], rules: AutopilotRules
) -> list[Share] | None:
    """Return the sorties with their users; None where they do not give everybody what it needs.

    Parameters
    ----------
    scenario, trajectory, holds
        The whole plan; its stops lie outside of all zones.
    leaves
        The sorties.
    rules
        The autopilot.
    """
    channel = planning_channel(scenario)
    needed_bit = demand_on_air(scenario.users, trajectory)
    received_bit = _received(scenario, trajectory, holds, leaves, channel, rules)
    _where_pinned(received_bit, scenario, trajectory, leaves)
    parts_bit = _dealt(needed_bit, received_bit)
    if (parts_bit.sum(axis=1) < needed_bit - DEMAND_TOLERANCE_BIT).any():
        return None
    served = parts_bit > 0
    _reach_the_rest(served, scenario, trajectory, leaves)
    pins = pins_of(scenario).at(trajectory.stops_m)
    found = []
    for number, leaf in enumerate(leaves):
        here = pins[list(leaf.stops)]
        if not served[:, number].any():
            if (here == NO_PIN).all():
                continue  # others serve all its users: nobody needs it
            raise InputError([_nobody_there(scenario, int(here[here != NO_PIN][0]))])
        some = _sub_scenario(scenario, trajectory, parts_bit[:, : number + 1], served[:, number])
        some = replace(some, stops=_pinned_parts(scenario, here, leaf))
        flown = cut_out(trajectory, some.users, channel, trajectory.stops_m[list(leaf.stops)])
        found.append(Share(some, flown, _held(some, flown, leaf, holds, rules)))
    return found


ALONE = (
    "would have a sortie of its own in which nobody is served, and a flight is planned for somebody: pin it nearer to "
    "users, or give the vehicle a bigger battery"
)
"""What is wrong with a pinned stop that no sortie with users can take along."""


def _nobody_there(scenario: Scenario, pin: int) -> Problem:
    return Problem(scenario.stops[pin].name, ALONE, "stop-alone")


def _pinned_parts(scenario: Scenario, pins: Ints, leaf: Leaf) -> tuple[PinnedStop, ...]:
    """Return the pinned stops of a sortie, each with what it is held there of the least hold."""
    here = [(int(pin), hold_s) for pin, hold_s in zip(pins, leaf.holds_s, strict=True) if pin != NO_PIN]
    stops = scenario.stops
    return tuple(replace(stops[pin], hold_s=min(stops[pin].hold_s, hold_s)) for pin, hold_s in here)


def _where_pinned(
    received_bit: Floats, scenario: Scenario, trajectory: Trajectory, leaves: Sequence[Leaf]
) -> None:
    """Take from a user with a pinned stop above it what sorties give that do not stop there."""
    names, stops = scenario.users.names, scenario.stops
    for stop, pin in enumerate(pins_of(scenario).at(trajectory.stops_m).tolist()):
        user = None if pin == NO_PIN else stops[pin].user
        if user in names:
            elsewhere = [number for number, leaf in enumerate(leaves) if stop not in leaf.stops]
            received_bit[names.index(user), elsewhere] = 0.0


def _received(
    scenario: Scenario,
    trajectory: Trajectory,
    holds: Holds,
    leaves: Sequence[Leaf],
    channel: Channel,
    rules: AutopilotRules,
) -> Floats:
    """Return (N, K) bits that each user can receive in each sortie."""
    users, stops_m = scenario.users, trajectory.stops_m
    received = np.zeros((len(users), len(leaves)))
    if scenario.service.mode == "tdma":
        _turns(received, trajectory, holds, leaves, channel, scenario)
        return received
    rates = broadcast_rates(users, stops_m, channel)
    for number, leaf in enumerate(leaves):
        stops = list(leaf.stops)
        received[:, number] = rates[:, stops] @ np.asarray(leaf.holds_s, dtype=np.float32)
        if counts_in_flight(scenario):
            path = from_origin(stops_m[stops])
            flown = replace(trajectory, path_m=path, stop_at=np.arange(1, len(path)))
            received[:, number] += received_in_flight(users.xy_m, flown, channel, scenario.vehicle, rules)
    # What a user receives by air counts only where a stop of the sortie reaches it: others have no link to hold on to.
    for number, leaf in enumerate(leaves):
        received[~(rates[:, list(leaf.stops)] > 0).any(axis=1), number] = 0.0
    return received


def _turns(
    received: Floats,
    trajectory: Trajectory,
    holds: Holds,
    leaves: Sequence[Leaf],
    channel: Channel,
    scenario: Scenario,
) -> None:
    """Note what each user receives in its turn, a turn cut in two where a hold is."""
    xy_m, stops_m = scenario.users.xy_m, trajectory.stops_m
    begun_s = np.zeros(len(stops_m))
    for number, leaf in enumerate(leaves):
        for stop, hold_s in zip(leaf.stops, leaf.holds_s, strict=True):
            here = [slot for slot in holds.schedule if slot.stop == stop]
            # What the autopilot is given, a float32, and no more than what a sortie stores.
            start_s, end_s = begun_s[stop], begun_s[stop] + min(hold_s, float(np.float32(hold_s)))
            begun_s[stop] = end_s
            for slot in here:
                within_s = min(slot.start_s + slot.duration_s, end_s) - max(slot.start_s, start_s)
                apart_m = np.linalg.norm(xy_m[slot.user : slot.user + 1] - stops_m[stop], axis=1)
                rate_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(apart_m)[0])
                received[slot.user, number] += rate_bit_s * max(within_s, 0.0)


def _dealt(needed_bit: Floats, received_bit: Floats) -> Floats:
    """Return (N, K) bits: all of a demand in the first sortie that can give it, else what each gives, in order."""
    parts = np.zeros_like(received_bit)
    enough = received_bit >= needed_bit[:, None] - DEMAND_TOLERANCE_BIT
    one = enough.any(axis=1) & (needed_bit > 0)
    parts[one, enough[one].argmax(axis=1)] = needed_bit[one]
    left = np.where(one, 0.0, needed_bit)
    for number in range(received_bit.shape[1]):
        given = np.minimum(left, received_bit[:, number])
        # The last bit of a demand is no reason to serve a user twice.
        given = np.where(left - given < DEMAND_TOLERANCE_BIT, left, given)
        given = np.where(given < DEMAND_TOLERANCE_BIT, 0.0, given)
        parts[:, number] += given
        left = left - given
    return parts


def _reach_the_rest(
    served: Bools, scenario: Scenario, trajectory: Trajectory, leaves: Sequence[Leaf]
) -> None:
    """Mark, in (N, K), where users that need nothing are reached, and mates that receive nothing themselves."""
    users, assignment = scenario.users, trajectory.assignment
    first_at: dict[int, int] = {}
    for number, leaf in enumerate(leaves):
        for stop in leaf.stops:
            first_at.setdefault(stop, number)
    for user in np.flatnonzero((users.demand_bit == 0) & ~served.any(axis=1) & ~assignment.d2d).tolist():
        served[user, first_at[int(assignment.stop[user])]] = True
    # A relayed user goes where its mate is; which sorties bring its own bits is settled with them.
    for user in np.flatnonzero(assignment.d2d).tolist():
        mate = int(users.mate[user])
        if not served[mate].any():
            served[mate, first_at[int(assignment.stop[user])]] = True


def _sub_scenario(scenario: Scenario, trajectory: Trajectory, parts_bit: Floats, served: Bools) -> Scenario:
    """Return the scenario of the last of some sorties: users reached by air, and those that they relay to.

    Parameters
    ----------
    parts_bit
        (N, k) what comes by air in the sorties up to and with this one.
    served
        (N,) whom this one reaches by air.
    """
    users, d2d = scenario.users, trajectory.assignment.d2d
    before_bit, now_bit = parts_bit[:, :-1].sum(axis=1), parts_bit[:, -1]
    demand_bit = np.where(served, now_bit, 0.0)
    kept = served.copy()
    for user in np.flatnonzero(d2d).tolist():
        mate = int(users.mate[user])
        if not served[mate]:
            continue
        # The mate's own demand first, then what it passes on.
        own_bit = users.demand_bit[mate]
        its_bit = min(max(own_bit - before_bit[mate], 0.0), now_bit[mate])
        demand_bit[mate], demand_bit[user] = its_bit, now_bit[mate] - its_bit
        kept[user] = demand_bit[user] > 0 or (users.demand_bit[user] == 0 and before_bit[mate] == 0)
    return as_sortie(scenario, users.some(np.flatnonzero(kept), demand_bit))


def as_sortie(scenario: Scenario, users: Users) -> Scenario:
    """Return the scenario of a sortie that serves some of the users."""
    home = replace(scenario.vehicle, end="rtl")
    return replace(scenario.with_some(users), vehicle=home, warnings=())


def _held(
    scenario: Scenario,
    trajectory: Trajectory,
    leaf: Leaf,
    holds: Holds,
    rules: AutopilotRules,
) -> Holds:
    """Return the holds of a sortie: those that its own users take, where they are less than the plan's."""
    fresh = hold_times(scenario, trajectory, rules)
    planned_s = np.array(leaf.holds_s)
    if scenario.service.mode == "tdma" or fresh.hover_s <= round(float(planned_s.sum()), 6):
        return fresh
    stops: Ints = np.array(leaf.stops)
    return replace(fresh, asked_s=np.minimum(holds.asked_s[stops], planned_s), stored_s=planned_s)
