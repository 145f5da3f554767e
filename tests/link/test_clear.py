"""Clearing against a vehicle that loses the order, is busy, or will not."""

import pytest

from mavplan.link.clear import Clear, ClearEnd
from tests.link.script import OTHER_STATION, US, VEHICLE, ack, outgoing, until


def opened():
    clear = Clear(VEHICLE, US, 1, now=0.0, deadline=20.0)
    clear.tick(0.0)
    assert outgoing(clear) == ["CLEAR"]
    return clear


def test_an_ack_clears():
    clear = opened()
    clear.receive(ack(0, kind=1), 0.1)
    assert clear.outcome.end is ClearEnd.CLEARED
    assert clear.next_timer() is None


def test_lost_order_or_ack_the_order_is_given_again_until_the_deadline():
    clear = opened()
    assert [time for time, _ in until(clear, 30.0)] == [float(t) for t in range(1, 20)]
    assert clear.outcome.end is ClearEnd.EXPIRED


def test_busy_vehicle_is_told_again_later():
    clear = opened()
    clear.receive(ack(14, kind=1), 0.5)
    assert until(clear, 1.6) == [(1.5, "CLEAR")]


def test_ardupilot_that_flies_the_mission_refuses_with_error_and_is_believed_the_third_time():
    clear = opened()
    for attempt in range(3):
        assert clear.outcome is None
        clear.receive(ack(1, kind=1), attempt + 0.1)
        until(clear, attempt + 1.1)
    assert (clear.outcome.end, clear.outcome.result) == (ClearEnd.REFUSED, 1)


@pytest.mark.parametrize("message", [ack(0), ack(0, kind=1, to=OTHER_STATION)])
def test_an_ack_of_something_else_clears_nothing(message):
    clear = opened()
    clear.receive(message, 0.1)
    assert clear.outcome is None
