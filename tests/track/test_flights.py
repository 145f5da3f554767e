"""Which part of a track is the flight."""

from dataclasses import replace

import numpy as np
import pytest

from mavplan.errors import InputError, Problem
from mavplan.track.flights import find_flight
from mavplan.track.model import Span, Track


def track(armed, in_air, *, until_s=100.0, **options):
    """A track of a vehicle that stood at one place; only its spans matter."""
    time_s = np.arange(0.0, until_s, 1.0)
    flat = np.zeros(len(time_s))
    return Track("x", time_s, flat + 46.5, flat + 7.5, flat, armed, in_air, **options)


def test_a_flight_goes_from_arming_to_disarming():
    flight = find_flight(track((Span(10, 80),), (Span(15, 70),)))
    assert flight.span == Span(10, 80)
    assert flight.flown_s == 70
    assert flight.has_landed
    assert flight.notes == ()


def test_its_mission_begins_with_its_mode_where_that_came_later():
    armed, air = (Span(10, 80),), (Span(30, 70),)
    assert find_flight(track(armed, air, in_mission=(Span(25, 80),))).mission_from_s == 25
    assert find_flight(track(armed, air, in_mission=(Span(5, 80),))).mission_from_s == 10
    assert find_flight(track(armed, air, in_mission=(Span(5, 8),))).mission_from_s == 10


def test_where_arming_is_not_known_a_touch_of_the_ground_ends_no_flight():
    flight = find_flight(track(None, (Span(10, 40), Span(50, 90)), until_s=200.0))
    assert flight.span == Span(10, 90)


def test_where_arming_is_not_known_a_long_time_on_the_ground_ends_a_flight():
    flight = find_flight(track(None, (Span(10, 30), Span(100, 190)), until_s=300.0))
    assert flight.span == Span(100, 190)
    assert [note.code for note in flight.notes] == ["several-flights"]


def test_a_track_that_ends_in_the_air_says_so():
    flight = find_flight(track((Span(10, 99),), (Span(15, 98),)))
    assert not flight.has_landed
    assert [note.code for note in flight.notes] == ["ends-in-air"]


def test_arming_without_leaving_the_ground_is_no_flight():
    for armed in ((Span(10, 80),), (), None):
        with pytest.raises(InputError, match="never left the ground"):
            find_flight(track(armed, ()))


def test_what_was_noted_of_the_track_is_told_with_the_refusal():
    noted = replace(track((), ()), notes=(Problem("x", "the log was cut there", "cut", "warning"),))
    with pytest.raises(InputError, match=r"was never armed[^\n]*\nx: the log was cut there"):
        find_flight(noted)
