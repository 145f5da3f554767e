"""From a plan and a track to a `Proof`, in that order: the flight, its path, the holds, what was received. Pure."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.geo import LocalPlane
from mavplan.proof.holds import Hold, find_holds, find_hovers
from mavplan.proof.model import FlownStop, Proof
from mavplan.proof.path import GAP_S, Path, cut, flown_path
from mavplan.proof.reasons import shortfall_reasons
from mavplan.proof.receive import Received, received_by_broadcast, received_by_turns, stop_of_piece
from mavplan.proof.recognise import recognise
from mavplan.proof.relay import relayed_by_broadcast, relayed_by_turns
from mavplan.radio import Channel
from mavplan.stored_plan import StoredPlan
from mavplan.track.flights import Flight, find_flight
from mavplan.track.model import Floats, ItemEvent, Span, Track


def prove(plan: StoredPlan, track: Track, in_flight: bool | None = None) -> Proof:
    """Return what each user of a plan received in a flight.

    Parameters
    ----------
    plan
        What was to be flown.
    track
        What was.
    in_flight
        Whether what users receive between stops counts; None: where the plan counts on it.

    Raises
    ------
    InputError
        The track holds no flight, or one that is not of this plan; or what is received in flight is to count over
        real ground.
    """
    scenario = plan.scenario
    in_flight = plan.in_flight if in_flight is None else in_flight
    if in_flight and plan.user_rel_m is not None:
        message = (
            "was made over real ground, which may hide users in flight: only what is received at stops counts"
        )
        raise InputError([Problem(plan.label, message, "no-in-flight")])
    flight = find_flight(track)
    plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
    places_m = plane.to_xy_m([stop.lat_deg for stop in plan.stops], [stop.lon_deg for stop in plan.stops])
    path = flown_path(
        track, flight.span, plane, scenario.vehicle.altitude_m, _planned_heights(plan, places_m)
    )
    if len(path.time_s) < 2:
        message = "holds no two positions of the flight: nothing can be said about it"
        raise InputError([Problem(track.label, message, "no-positions"), *track.notes])
    words = mission_words(plan, track, flight)
    items = [stop.items for stop in plan.stops]
    holds = find_holds(path, places_m, items, plan.hold_s, words, track.autopilot, track.in_mission)
    path = cut(path, [moment for hold in holds if hold for moment in (*hold.span, *hold.there)])
    # One at a time is served by the clock of the hold; a broadcast reaches everyone as long as the vehicle is there.
    by_turns = scenario.service.mode == "tdma"
    spans = [None if hold is None else hold.span if by_turns else hold.there for hold in holds]
    channel = Channel(scenario.radio, scenario.vehicle.altitude_m, scenario.d2d)
    stops = tuple(
        replace(
            _flown_stop(path, hold, place_m, planned.hold_s, planned.alt_rel_m),
            arrived_s=None if hold is None else hold.span.from_s - flight.mission_from_s,
            expected_s=expected_s,
        )
        for hold, place_m, planned, expected_s in zip(
            holds, places_m, plan.stops, plan.arrivals_s or [None] * len(plan.stops), strict=True
        )
    )
    odd = recognise(plan, track, stops, find_hovers(path), places_m, words, channel.radius_m, path.xy_m)
    received = _received(plan, path, spans, channel)
    if plan.user_rel_m is not None:
        received = replace(received, flight_bit=np.zeros(len(scenario.users)))
    counted = received if in_flight else replace(received, flight_bit=np.zeros(len(scenario.users)))
    relaying = path if in_flight else replace(path, counts=path.counts & (stop_of_piece(path, spans) >= 0))
    d2d_bit = _relayed(plan, relaying, spans, counted.total_bit, channel)
    reasons = shortfall_reasons(plan, stops, counted, d2d_bit, places_m, channel)
    rows = np.flatnonzero(np.isin(path.time_s, track.time_s))
    return Proof(
        plan=plan,
        track=track,
        flight=flight,
        flight_bit=received.flight_bit,
        hover_bit=received.hold_bit.sum(axis=0),
        d2d_bit=d2d_bit,
        in_flight=in_flight,
        stops=stops,
        reasons=reasons,
        path_xyz_m=np.column_stack((path.xy_m, path.height_m))[rows],
        known=path.known[rows[:-1]],
        notes=(*track.notes, *_flight_notes(plan, flight), *_gaps(path, track.label), *odd),
    )


def _planned_heights(plan: StoredPlan, places_m: Floats) -> Callable[[Floats], Floats] | None:
    """Return the planned height of the stop that is nearest to each place; None over a plane."""
    if plan.user_rel_m is None:
        return None
    from scipy.spatial import KDTree

    nearest = KDTree(places_m)
    height_m = np.array([stop.alt_rel_m for stop in plan.stops])
    return lambda xy_m: height_m[np.asarray(nearest.query(xy_m)[1], dtype=np.int64)]


def mission_words(plan: StoredPlan, track: Track, flight: Flight) -> list[ItemEvent]:
    """Return the vehicle's words about items in a flight, counted from 0 without home; none if not of this mission."""
    if track.autopilot not in (None, plan.autopilot):
        return []
    home = 1 if plan.autopilot == "ardupilot" else 0
    return [
        ItemEvent(event.time_s, event.seq - home)
        for event in track.reached
        if flight.span.from_s <= event.time_s <= flight.span.until_s
    ]


def _flown_stop(
    path: Path, hold: Hold | None, place_m: Floats, planned_s: float, planned_m: float
) -> FlownStop:
    if hold is None:
        near_m = float(np.hypot(*(path.xy_m - place_m).T).min()) if len(path.time_s) else np.inf
        return FlownStop(planned_s, None, None, near_m, near_m, None, 0.0)
    rows = path.rows(hold.span)
    away_m = np.hypot(*(path.xy_m[rows] - place_m).T)
    height_m = path.height_m[rows]
    weights = _weights(path.time_s[rows])
    return FlownStop(
        planned_s,
        hold.span,
        hold.by,
        float(away_m @ weights),
        float(away_m.max()),
        float(height_m @ weights) - planned_m,
        path.uncounted_s(hold.span),
    )


def _weights(time_s: Floats) -> Floats:
    """Return (K,) the share of each moment in a mean over time."""
    if len(time_s) < 2 or time_s[-1] == time_s[0]:
        return np.full(len(time_s), 1.0 / len(time_s))
    half_s = np.diff(time_s) / 2
    weights: Floats = (np.append(half_s, 0.0) + np.append(0.0, half_s)) / (time_s[-1] - time_s[0])
    return weights


def _received(plan: StoredPlan, path: Path, spans: Sequence[Span | None], channel: Channel) -> Received:
    users_m = plan.listeners_m
    if plan.scenario.service.mode == "tdma":
        return received_by_turns(path, spans, plan.schedule, users_m, channel)
    received = received_by_broadcast(path, spans, users_m, channel)
    if plan.hidden is None:
        return received
    return replace(received, hold_bit=np.where(plan.hidden.T, 0.0, received.hold_bit))


def _relayed(
    plan: StoredPlan, path: Path, spans: Sequence[Span | None], air_bit: Floats, channel: Channel
) -> Floats:
    """Return (N,) bits that users received from their mates: at most what they still lacked."""
    users = plan.scenario.users
    d2d_bit = np.zeros(len(users))
    relayed = np.flatnonzero(plan.d2d)
    if not len(relayed) or len(path.time_s) < 2:
        return d2d_bit
    mates = users.mate[relayed]
    apart_m = np.linalg.norm(users.xy_m[relayed] - users.xy_m[mates], axis=1)
    rates = channel.radio.bandwidth_hz * channel.d2d_rate(apart_m)
    own_bit = users.demand_bit[mates]
    if plan.scenario.service.mode == "tdma":
        sent = relayed_by_turns(
            path, spans, plan.schedule, plan.listeners_m, mates.tolist(), own_bit, rates, channel
        )
    else:
        seen = None if plan.hidden is None else ~plan.hidden.T[stop_of_piece(path, spans)]
        sent = relayed_by_broadcast(path, plan.listeners_m, mates.tolist(), own_bit, rates, channel, seen)
    lacking = np.maximum(users.demand_bit[relayed] - air_bit[relayed], 0.0)
    d2d_bit[relayed] = np.minimum(sent, lacking)
    return d2d_bit


def _flight_notes(plan: StoredPlan, flight: Flight) -> Iterator[Problem]:
    """Yield what is to be told of a flight; that it ended in the air only where it was to come down."""
    stays = plan.scenario.vehicle.end == "stay"
    yield from (note for note in flight.notes if not (stays and note.code == "ends-in-air"))


def _gaps(path: Path, label: str) -> Iterator[Problem]:
    """Yield a note on times of the flight without positions."""
    lasted_s = np.diff(path.time_s)[~path.known]
    if len(lasted_s):
        message = (
            f"no positions for {lasted_s.sum():,.1f} s of the flight, in {len(lasted_s):,} places of over {GAP_S:g} s "
            "or with jumps: nothing is counted there"
        )
        yield Problem(label, message, "gaps", "warning")
