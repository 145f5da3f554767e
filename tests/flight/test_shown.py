"""What is shown of a flight ends with it: the clock at disarming, the mission's rest where an order is followed."""

import pytest

from mavplan.flight.orders import Order
from mavplan.flight.phases import Phase
from tests.flight.harness import fly, make_fly_session, say_yes
from tests.link.harness import make_mission, make_network

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


@BOTH
def test_the_clock_shown_stops_when_the_motors_do(firmware):
    network = make_network(firmware)
    flown = fly(make_fly_session(make_mission(firmware, 2), network.clock_s), network)
    end_s = flown.session.report.flight_s
    assert max(picture.flight_s for _, picture in flown.pictures) == pytest.approx(end_s, abs=0.1)
    told_s = [event.flight_s for event in flown.session.report.events]
    assert told_s == sorted(told_s)
    assert told_s[-1] == pytest.approx(end_s, abs=0.1)


@BOTH
def test_a_vehicle_that_returns_as_ordered_has_no_time_left_of_its_mission_also_when_landed(firmware):
    network, ordered_at = make_network(firmware), []

    def hands(session, now):
        say_yes(session, now)
        if not ordered_at and session.phase is Phase.FLYING and session.flight.picture(now).items_done >= 2:
            ordered_at.append(now)
            session.order(Order.RETURN, now)

    flown = fly(make_fly_session(make_mission(firmware, 4), network.clock_s), network, hands)
    later = [picture for at, picture in flown.pictures if at > ordered_at[0] + 5.0]
    assert not later[-1].armed
    assert {(picture.follows, picture.left_s) for picture in later} == {("return", None)}


def test_a_flight_given_up_says_by_whose_clock():
    network = make_network("px4")
    session = make_fly_session(make_mission("px4", 4), network.clock_s, flight_s=30.0)
    flown = fly(session, network)
    assert "no end within 30 s by this machine's clock" in str(flown.session.error)
