"""Holds of recorded flights come out as they are known, from the vehicle's words and without them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mavplan.proof.prove import prove
from mavplan.track.model import Span
from mavplan.track.read import parse_track, read_track
from tests.proof.plans import by_hand, flight_of, moved, places_m, stored
from tests.track.logs import to_csv, to_tlog

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
captured = pytest.mark.skipif(not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here")

HERE = (37.4, -122.1)
ARDUPILOT = by_hand(
    [(37.4013475, -122.1, 8, 1, 2), (37.4013475, -122.0983038, 8, 3, 3), (37.4, -122.0983038, 8, 5, 5)],
    [("a", 37.4013475, -122.1, 10, 0, None)],
    home=HERE,
)
"""The recorded mission: TAKEOFF, WAYPOINT and LOITER_TIME, LOITER_TIME, DO_CHANGE_SPEED, LOITER_TIME, RTL."""
PX4 = by_hand(
    [
        (37.4008993, -122.0983019, 8, 2, 2),
        (37.3998201, -122.0973963, 8, 3, 3),
        (37.3989208, -122.0987547, 8, 5, 5),
    ],
    [("a", 37.4008993, -122.0983019, 10, 0, None)],
    home=HERE,
    autopilot="px4",
)
"""The recorded mission: TAKEOFF, WAYPOINT, LOITER_TIME, LOITER_TIME, DO_CHANGE_SPEED, LOITER_TIME, RTL."""


def held(proof):
    """The seconds at each stop."""
    return [stop.held_s for stop in proof.stops]


@captured
def test_ardupilots_recorded_holds_are_eight_seconds_at_their_places():
    proof = prove(ARDUPILOT, read_track(CAPTURES / "ardupilot_flight_loiter.tlog"))
    assert held(proof)[0] == pytest.approx(8.0, abs=0.02)
    # Of a single item only the end is told; that of the second one by the number of the speed item behind it.
    np.testing.assert_allclose(held(proof)[1:], 8.0, atol=0.2)
    assert [stop.by for stop in proof.stops] == ["vehicle", "track", "track"]
    assert all(stop.away_m < 0.3 and stop.most_away_m < 1.0 for stop in proof.stops)
    assert proof.notes == ()
    assert proof.flight.flown_s == pytest.approx(187.6, abs=1.5)


@captured
@pytest.mark.parametrize("planned_s", [4.0, 9.0, 16.0])
def test_what_was_planned_makes_no_hold_longer_or_shorter(planned_s):
    for plan, name in ((ARDUPILOT, "ardupilot_flight_loiter"), (PX4, "px4_flight_full")):
        otherwise = replace(plan, stops=tuple(replace(stop, hold_s=planned_s) for stop in plan.stops))
        proof = prove(otherwise, read_track(CAPTURES / f"{name}.tlog"))
        np.testing.assert_allclose(held(proof), 8.0, atol=0.25)


@captured
@pytest.mark.parametrize("name", ["px4_flight", "px4_flight_full"])
def test_px4s_recorded_holds_are_eight_seconds_from_the_acceptance_radius_on(name):
    proof = prove(PX4, read_track(CAPTURES / f"{name}.tlog"))
    np.testing.assert_allclose(held(proof), 8.0, atol=0.1)
    assert all(0.5 < stop.away_m < 1.3 and stop.most_away_m < 2.1 for stop in proof.stops)
    assert proof.notes == ()


@captured
@pytest.mark.parametrize(
    ("plan", "name", "off_s"),
    [(ARDUPILOT, "ardupilot_flight_loiter", 0.8), (PX4, "px4_flight_full", 0.4), (PX4, "px4_flight", 0.9)],
)
def test_without_the_vehicles_words_the_track_alone_shows_the_holds(plan, name, off_s):
    track = replace(read_track(CAPTURES / f"{name}.tlog"), reached=())
    proof = prove(plan, track)
    np.testing.assert_allclose(held(proof), 8.0, atol=off_s)
    assert {stop.by for stop in proof.stops} == {"track"}


USERS = [(0, 500), (700, 900), (900, -300), (0, -700)]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("read", [to_tlog, to_csv])
def test_holds_of_a_flight_along_the_plan_are_the_planned_ones(autopilot, read):
    plan = stored(USERS, autopilot=autopilot)
    proof = prove(plan, parse_track(read(flight_of(plan)), "x"))
    np.testing.assert_allclose(held(proof), plan.hold_s, atol=0.11)
    assert all(stop.away_m < 0.5 for stop in proof.stops)


def test_a_lost_word_costs_no_more_than_a_look_at_the_track():
    plan = stored(USERS)
    track = parse_track(to_tlog(flight_of(plan)), "x")
    for lost in range(len(track.reached)):
        reached = track.reached[:lost] + track.reached[lost + 1 :]
        proof = prove(plan, replace(track, reached=reached))
        # This vehicle brakes at once: within the second over which speed is taken, it is slow later and leaves earlier.
        np.testing.assert_allclose(held(proof), plan.hold_s, atol=2.1)


def test_a_hold_that_was_broken_off_counts_from_when_the_mission_was_taken_up_again():
    plan = stored(USERS)
    track = parse_track(to_tlog(flight_of(plan)), "x")
    hold = prove(plan, track).stops[0].span
    broken = (Span(track.armed[0].from_s, hold.from_s + 1.0), Span(hold.from_s + 3.0, track.armed[0].until_s))
    proof = prove(plan, replace(track, in_mission=broken))
    assert proof.stops[0].held_s == pytest.approx(hold.length_s - 3.0)
    assert proof.stops[2].held_s == pytest.approx(plan.hold_s[2], abs=0.11)


def test_a_stop_that_was_left_out_is_not_held():
    plan = stored(USERS)
    places = np.delete(places_m(plan), 2, axis=0)
    skipped = flight_of(plan)
    flown = replace(
        flight_of(replace(plan, stops=plan.stops[:2] + plan.stops[3:]), stops_m=places), home=skipped.home
    )
    proof = prove(plan, replace(parse_track(to_csv(flown, reached=False), "x")))
    assert proof.stops[2].span is None
    assert proof.stops[2].away_m > 30
    np.testing.assert_allclose(np.delete(held(proof), 2), np.delete(plan.hold_s, 2), atol=1.1)


def test_a_stop_held_elsewhere_is_found_where_it_was_by_the_vehicles_words():
    plan = stored(USERS)
    flight = flight_of(plan, stops_m=moved(places_m(plan), 1, 200.0))
    proof = prove(plan, parse_track(to_tlog(flight), "x"))
    assert proof.stops[1].away_m == pytest.approx(200.0, abs=0.5)
    assert proof.stops[1].held_s == pytest.approx(plan.hold_s[1], abs=0.11)
    assert [note.code for note in proof.notes] == ["far-from-place"]


def test_without_words_a_stop_held_elsewhere_is_not_held():
    plan = stored(USERS)
    flight = flight_of(plan, stops_m=moved(places_m(plan), 1, 200.0))
    proof = prove(plan, parse_track(to_csv(flight, reached=False), "x"))
    assert proof.stops[1].span is None
