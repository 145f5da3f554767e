"""What is proved of a flight: met where it was flown as planned, and every shortfall named by user and stop."""

from dataclasses import replace

import numpy as np
import pytest

from mavplan.errors import InputError
from mavplan.proof.prove import prove
from mavplan.track.model import Span
from mavplan.track.read import parse_track
from tests.proof.plans import by_hand, flight_of, moved, places_m, stored
from tests.track.logs import fly, to_csv, to_tlog

USERS = [(0, 500), (700, 900), (900, -300), (0, -700)]


def proved(plan, flight, **options):
    """The proof of a flight that was recorded as a tlog."""
    return prove(plan, parse_track(to_tlog(flight, **options), "x"))


def refused(plan, track):
    """What is said where nothing can be proved."""
    with pytest.raises(InputError) as caught:
        prove(plan, track)
    return str(caught.value)


def short(proof):
    """Names of the users that are short, with the reason."""
    names = proof.plan.scenario.users.names
    return {names[user]: reason for user, reason in proof.reasons.items()}


@pytest.mark.parametrize("mode", ["broadcast", "tdma"])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_flight_as_planned_meets_every_demand(mode, autopilot):
    plan = stored([*USERS, (30, 480), (720, 930)], mode=mode, autopilot=autopilot, demand_mbit=15.0)
    proof = proved(plan, flight_of(plan))
    assert proof.all_met
    assert short(proof) == {}
    assert proof.notes == ()
    assert np.all(proof.short_bit == 0)
    if mode == "tdma":
        assert not proof.flight_bit.any()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_hold_cut_by_half_is_found_and_named(autopilot):
    plan = stored(USERS, autopilot=autopilot, demand_mbit=30.0)
    stop = int(plan.stop_of[1])
    holds_s = plan.hold_s.copy()
    holds_s[stop] /= 2
    proof = proved(plan, flight_of(plan, holds_s=holds_s))
    assert proof.met.tolist() == [True, False, True, True]
    assert short(proof) == {
        "u1": f"stop {stop + 1}: held {proof.stops[stop].held_s:,.1f} of {plan.hold_s[stop]:,.1f} s"
    }
    assert proof.stops[stop].held_s == pytest.approx(holds_s[stop], abs=0.1)
    assert proof.short_bit[1] == pytest.approx(proof.demand_bit[1] - proof.received_bit[1])


def test_a_stop_two_hundred_metres_off_is_found_and_named():
    plan = stored(USERS, demand_mbit=30.0)
    stop = int(plan.stop_of[0])
    aside = np.sign(places_m(plan)[stop, 0] - USERS[0][0]) or 1.0
    proof = proved(plan, flight_of(plan, stops_m=moved(places_m(plan), stop, 200.0 * aside)))
    assert not proof.met[0]
    assert short(proof)["u0"] == f"stop {stop + 1}: held 200 m from its place"
    assert [note.code for note in proof.notes] == ["far-from-place"]


def test_in_flight_counts_where_the_plan_counts_on_it_or_it_is_asked_for():
    plan = stored(USERS)
    track = parse_track(to_csv(flight_of(plan, holds_s=np.zeros(len(plan.stops))), reached=False), "x")
    assert not prove(plan, track).met.any()
    assert prove(plan, track).flight_bit[0] > 50e6
    assert prove(plan, track, in_flight=True).met.tolist() == [True, False, False, False]
    counting = replace(plan, in_flight=True)
    assert prove(counting, track).met.tolist() == [True, False, False, False]
    assert not prove(counting, track, in_flight=False).met.any()


def test_too_low_nothing_counts():
    plan = stored(USERS)
    flight = flight_of(plan)
    low = replace(flight, xyz_m=flight.xyz_m * (1, 1, 0.8))
    proof = proved(plan, low)
    assert not proof.received_bit.any()
    assert "m below the planned height" in short(proof)["u0"]


def test_positions_that_are_missing_during_a_hold_do_not_count():
    plan = stored(USERS, demand_mbit=30.0)
    flight = flight_of(plan)
    stop = int(plan.stop_of[2])
    hold = proved(plan, flight).stops[stop].span
    proof = proved(plan, flight.without(hold.from_s + 1.0, hold.from_s + 9.0))
    assert not proof.met[2]
    assert "s of its hold do not count (no positions, or too low)" in short(proof)["u2"]
    assert "gaps" in [note.code for note in proof.notes]
    assert proof.stops[stop].held_s == pytest.approx(plan.hold_s[stop], abs=0.11)


def test_a_log_cut_at_any_place_never_proves_what_was_not_flown():
    plan = stored(USERS, demand_mbit=30.0)
    data = to_tlog(flight_of(plan, hz=2.0))
    whole = prove(plan, parse_track(data, "x"))
    last_s = max(stop.span.until_s for stop in whole.stops)
    before = np.zeros(len(USERS))
    for share in np.linspace(0.1, 0.99, 12):
        try:
            proof = prove(plan, parse_track(data[: int(len(data) * share)], "x"))
        except InputError:
            assert share < 0.3
            continue
        assert np.all(proof.received_bit <= whole.received_bit + 1)
        assert np.all(proof.received_bit >= before - 1)
        before = proof.received_bit
        if not proof.flight.has_landed:
            assert "ends-in-air" in [note.code for note in proof.notes]
        if proof.track.time_s[-1] < last_s - 15:
            assert not proof.all_met


def test_an_aborted_flight_leaves_the_users_that_were_not_reached():
    plan = stored(USERS, demand_mbit=30.0)
    flight = flight_of(plan)
    whole = proved(plan, flight)
    half_s = whole.stops[1].span.until_s
    proof = proved(plan, replace(flight.cut(until_s=half_s), armed_s=(flight.armed_s[0], half_s + 1)))
    held = [stop.span is not None for stop in proof.stops]
    assert held == [True, True, *[False] * (len(held) - 2)]
    assert {user for user in range(4) if not proof.met[user]} >= {
        user for user in range(4) if plan.stop_of[user] > 1
    }
    assert all("was not held" in reason for reason in short(proof).values())


def test_another_plans_flight_is_refused_by_its_places():
    plan, other = stored(USERS), stored([(-2000, 2000), (-3000, 500), (-2500, -1500), (-1500, -2500)])
    data = to_tlog(flight_of(other))
    assert "x: is not a flight of x.mavplan.json: of " in refused(plan, parse_track(data, "x"))
    silent = parse_track(
        to_csv(flight_of(other, holds_s=np.full(len(other.stops), 10.0)), reached=False), "x"
    )
    assert "x: is not a flight of x.mavplan.json: it hovered " in refused(plan, silent)


def test_a_flight_that_held_mostly_elsewhere_is_refused_and_pauses_on_the_way_are_not():
    """By its hovers alone: one of the planned stops is held, and four or one of nobody's places."""
    plan = stored(USERS, demand_mbit=30.0)
    others = np.array([[-800.0, 0.0], [-900.0, 600.0], [-1500.0, 0.0], [-600.0, -800.0]])
    flown = np.vstack([others, places_m(plan)[:1]])
    track = parse_track(to_csv(fly(flown, np.full(5, 9.0)), reached=False), "x")
    assert "it hovered 4 times elsewhere and at 1 of the planned stops" in refused(plan, track)
    paused = np.vstack([others[:1], places_m(plan)])
    track = parse_track(to_csv(fly(paused, np.full(len(paused), 9.0)), reached=False), "x")
    assert sum(stop.span is not None for stop in prove(plan, track).stops) == len(plan.stops)


def test_a_flight_that_went_elsewhere_without_a_hold_is_refused_and_one_that_turned_back_is_not():
    plan = stored(USERS, demand_mbit=30.0)
    away = fly(np.array([[-3000.0, -3000.0]]), np.zeros(1))
    assert "it flew beyond the first stop" in refused(plan, parse_track(to_csv(away, reached=False), "x"))
    first_m = places_m(plan)[0]
    back = fly(first_m[None] * 0.6, np.zeros(1))
    assert not prove(plan, parse_track(to_csv(back, reached=False), "x")).met.any()


def test_another_plans_flight_is_refused_where_one_of_its_places_is_this_plans_too():
    """The vehicle says the same items as this plan has; only one of the places is the same."""
    plan = stored(USERS, demand_mbit=30.0)
    flown = places_m(plan)
    assert len(flown) > 2
    flown[1:] += 400.0
    said = refused(plan, parse_track(to_tlog(fly(flown, np.full(len(flown), 9.0))), "x"))
    assert f"{len(flown) - 1} of {len(flown)} stops that it held were more than 100 m" in said


def test_another_plans_flight_is_refused_by_its_items():
    plan, longer = stored(USERS), stored([*USERS, (2000, 2000), (-2000, 2000), (3000, 0), (-3000, 0)])
    said = refused(plan, parse_track(to_tlog(flight_of(longer)), "x"))
    assert "it reached item" in said
    assert "the plan's last is item" in said


def test_the_stops_in_another_order_are_another_plans():
    plan = stored(USERS, demand_mbit=30.0)
    backwards = places_m(plan)[::-1]
    track = parse_track(
        to_csv(flight_of(plan, stops_m=backwards, holds_s=np.full(len(backwards), 9.0)), reached=False), "x"
    )
    assert "of the planned stops, in another order" in refused(plan, track)


def test_a_vehicle_that_stayed_on_the_ground_has_no_flight():
    plan = stored(USERS)
    parked = replace(flight_of(plan), reached=(), current=())
    parked = replace(parked, xyz_m=parked.xyz_m * 0)
    assert "the vehicle never left the ground" in refused(plan, parse_track(to_tlog(parked), "x"))
    disarmed = replace(flight_of(plan), armed_s=(0.0, 0.0))
    assert "(and was never armed)" in refused(plan, parse_track(to_tlog(disarmed), "x"))


def test_of_two_flights_in_a_log_only_the_longest_counts():
    plan = stored(USERS)
    flight = flight_of(plan)
    hop = flight.cut(until_s=90)
    both = replace(
        flight,
        time_s=np.concatenate((hop.time_s, flight.time_s + 200)),
        xyz_m=np.concatenate((hop.xyz_m, flight.xyz_m)),
        reached=tuple((time_s + 200, seq) for time_s, seq in flight.reached),
    )
    armed = (Span(19.0, 90.5), Span(219.0, flight.armed_s[1] + 200))
    track = replace(parse_track(to_tlog(both, heartbeats=False), "x"), armed=armed, autopilot="ardupilot")
    track = replace(track, in_air=(Span(20.8, 90.0), Span(220.8, flight.armed_s[1] + 198)))
    proof = prove(plan, track)
    np.testing.assert_allclose(proof.hover_bit, proved(plan, flight).hover_bit, rtol=1e-6)
    np.testing.assert_allclose(proof.flight_bit, proved(plan, flight).flight_bit, rtol=1e-3)
    assert [note.code for note in proof.notes] == ["several-flights"]


def test_the_other_autopilots_words_are_not_used_and_that_is_said():
    plan = stored(USERS)
    flight = replace(flight_of(plan), autopilot="px4")
    proof = proved(plan, flight)
    assert [note.code for note in proof.notes] == ["other-autopilot"]
    assert {stop.by for stop in proof.stops if stop.span} == {"track"}


def d2d_plan(demand_mbit, mate_mbit, range_m=150.0):
    """A stop for one user, whose mate further out is served through it."""
    near, far = (46.5 + away_m / 111_194.93 for away_m in (350, 350 + range_m))
    return by_hand(
        [(46.5, 7.5, 60.0, 1, 1)],
        [("far", far, 7.5, demand_mbit, 0, "near"), ("near", near, 7.5, mate_mbit, 0, "far")],
        home=(46.5, 7.5),
        altitude_m=100.0,
    )  # fmt: skip


def test_a_mate_passes_on_what_it_received_beyond_its_own_demand():
    plan = d2d_plan(30.0, 20.0)
    proof = proved(plan, flight_of(plan))
    assert proof.all_met
    assert proof.d2d_bit[0] == pytest.approx(30e6)
    assert proof.d2d_bit[1] == 0
    heard_bit = proof.hover_bit[1]
    greedy = proved(d2d_plan(30.0, heard_bit / 1e6 - 10.0), flight_of(plan))
    assert proved(d2d_plan(9.0, heard_bit / 1e6 - 10.0), flight_of(plan)).all_met
    assert greedy.d2d_bit[0] == pytest.approx(10e6, rel=1e-3)
    assert greedy.met.tolist() == [False, True]
    assert short(greedy)["far"].startswith("through its mate near: stop 1")


def test_a_slow_link_between_mates_is_named():
    plan = d2d_plan(60.0, 1.0, range_m=199.0)
    slow = replace(plan, scenario=replace(plan.scenario, d2d=replace(plan.scenario.d2d, tx_power_dbm=-2.0)))
    proof = proved(slow, flight_of(slow))
    assert not proof.met[0]
    assert short(proof)["far"] == "its mate near received enough, the link between the two is too slow"


def test_a_turn_behind_the_end_of_a_short_hold_is_lost():
    plan = stored([(0, 300), (20, 320)], mode="tdma", demand_mbit=20.0)
    assert len({slot.stop for slot in plan.schedule}) == 1
    cut_s = plan.schedule[1].start_s + plan.schedule[1].duration_s / 2
    holds_s = plan.hold_s.copy()
    holds_s[plan.schedule[1].stop] = cut_s
    proof = proved(plan, flight_of(plan, holds_s=holds_s))
    assert proof.met[plan.schedule[0].user]
    last = plan.schedule[1].user
    assert proof.received_bit[last] == pytest.approx(proof.demand_bit[last] / 2, rel=0.05)
    assert "held" in proof.reasons[last]
