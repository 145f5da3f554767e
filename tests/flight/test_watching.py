"""A flight in the air: what is told of it, what is never sent, and how it is judged in the end."""

import dataclasses

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import CheckError, UncertainError
from mavplan.flight.orders import Order
from mavplan.flight.phases import Phase
from mavplan.mission.model import Command, Frame, MissionItem
from tests.flight.script import (
    AUTO,
    BRAKE,
    GUIDED,
    PX4_HOLD,
    PX4_MISSION,
    PX4_RETURN,
    RTL,
    acked,
    battery,
    beat,
    begin,
    current,
    landed,
    on_the_ground,
    position,
    reached,
)
from tests.link.harness import HOME, make_mission
from tests.link.script import OTHER_STATION, VEHICLE, item, text

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
MISSION_MODE = {"ardupilot": AUTO, "px4": PX4_MISSION}
ALTITUDE = {"ardupilot": 2, "px4": 2 << 16}
"""A mode that a pilot chooses."""
USERS = [("Ann",), ("Bob", "Cy")]
# Two stops: 0 TAKEOFF, 1 DO_CHANGE_SPEED, 2 and 3 the first stop with 8 s, 4 and 5 the second with 9 s, 6 RTL.


class InTheAir:
    """A vehicle in its mission, told of once a second; the clock is its own."""

    def __init__(self, firmware, mission=None, **options):
        self.firmware = firmware
        self.script = begin(mission or make_mission(firmware, 2), users=USERS, **options)
        self.session = self.script.session
        self.first = 1 if firmware == "ardupilot" else 0
        self.mode, self.armed = MISSION_MODE[firmware], True
        self.up_m, self.north_m, self.speed_m_s = 30.0, 0.0, 5.0
        self.state, self.total = 3, 65_535
        self.item = 0
        before = GUIDED if firmware == "ardupilot" else PX4_HOLD
        on_the_ground(self.script, firmware, before, until=6.0)
        self.session.approve(self.script.now)
        self.script.hear(beat(firmware, before), current(self.first, 2))
        self.script.hear_at(6.2, acked(400))
        self.script.hear_at(6.4, acked(300))
        self.script.hear(beat(firmware, self.mode, armed=True), position(HOME, boot_s=7.4))
        assert self.session.phase is Phase.FLYING, self.session.error
        self.sent = len(self.script.doings)

    def on(self, seconds, **changes):
        """So it goes on for some seconds."""
        for name, value in changes.items():
            assert hasattr(self, name), name
            setattr(self, name, value)
        for _ in range(seconds):
            at = self.script.now + 1.0
            self.script.hear_at(at, beat(self.firmware, self.mode, armed=self.armed))
            self.script.hear(
                position(
                    HOME, north_m=self.north_m, up_m=self.up_m, speed_m_s=self.speed_m_s, boot_s=at + 1.0
                ),
                current(self.first + self.item, self.state, self.total),
            )
            if self.session.done:
                break
        return self

    def say(self, *messages):
        self.script.hear(*messages)
        return self

    def fly_stops(self, count=2):
        """Take-off and stops, with the time that they need."""
        self.on(20, item=0)
        for stop in range(count):
            self.on(10, item=2 + 2 * stop, north_m=100.0 * (stop + 1))
            self.on(9 + stop, item=3 + 2 * stop)
        return self.on(1, item=2 + 2 * count)

    def come_home(self):
        """The return at the mission's end, until the motors stop."""
        mode = PX4_RETURN if self.firmware == "px4" else self.mode
        state = 5 if self.firmware == "px4" else 3
        self.on(20, item=6, mode=mode, state=state)
        self.on(3, up_m=0.0, north_m=0.0)
        return self.on(8, armed=False)

    @property
    def doings(self):
        return self.script.doings[self.sent :]

    @property
    def error(self):
        return self.session.error


def flying(firmware, **options):
    return InTheAir(firmware, **options)


# -- to the end -------------------------------------------------------------------------------------------------


@BOTH
def test_a_flight_to_its_end_is_flown_and_nothing_was_sent_in_it(firmware):
    air = flying(firmware).fly_stops().on(5, item=6, mode=PX4_RETURN if firmware == "px4" else AUTO)
    assert air.session.picture(air.script.now).left_s > 20.0  # the way home is still to come
    air.come_home()
    assert air.error is None
    report = air.session.report
    assert (report.items_done, report.items) == (7, 7)
    assert (report.outcome, report.stops_done, report.users_served) == ("flown", (1, 2), ("Ann", "Bob", "Cy"))
    assert air.doings == []
    assert (report.battery_before, report.battery_after) == (95, 95)


@BOTH
def test_the_picture_tells_where_it_is_and_how_long_it_stays(firmware):
    air = flying(firmware).on(20, item=0)
    picture = air.session.picture(air.script.now)
    assert (picture.stop, picture.hold_left_s, picture.stops_done) == (None, None, 0)
    air.on(10, item=2, north_m=100.0).on(4, item=3)
    picture = air.session.picture(air.script.now)
    assert (picture.stop.number, picture.stops) == (1, 2)
    assert picture.hold_left_s == pytest.approx(5.0, abs=0.1)
    air.on(5).on(4, item=4)
    picture = air.session.picture(air.script.now)
    assert (picture.stop.number, picture.hold_left_s, picture.stops_done, picture.users_served) == (
        2,
        None,
        1,
        1,
    )
    assert picture.users == 3
    assert picture.alt_rel_m == pytest.approx(30.0)
    air.script.wait(air.script.now + 2.5)
    assert air.session.picture(air.script.now).silent_s == pytest.approx(2.5)


@BOTH
def test_reached_stands_for_all_before_it(firmware):
    air = flying(firmware)
    air.script.wait(air.script.now + 60.0)
    air.say(beat(firmware, air.mode, armed=True), reached(air.first + 3))
    assert air.session.picture(air.script.now).items_done == 4
    assert air.session.picture(air.script.now).stops_done == 1
    air.say(*(reached(air.first + 3) for _ in range(10)), reached(air.first + 1))
    assert air.session.picture(air.script.now).items_done == 4


@BOTH
def test_landed_with_motors_that_do_not_stop_is_flown_with_a_warning_in_words(firmware):
    air = flying(firmware).fly_stops()
    air.on(20, item=6, state=5 if firmware == "px4" else 3).say(landed(4)).on(1)
    for _ in range(40):
        air.on(1, up_m=0.0).say(landed(1))
    assert air.error is None
    assert "keep away" in air.session.report.words


@BOTH
@pytest.mark.parametrize("away_m", [20.0, 30.0])
def test_a_return_that_comes_down_elsewhere_did_not_end_as_planned(firmware, away_m):
    air = flying(firmware).fly_stops()
    air.on(20, item=6, mode=PX4_RETURN if firmware == "px4" else AUTO, state=5 if firmware == "px4" else 3)
    air.say(text("Critical battery level", 2)).on(10, up_m=0.0, north_m=away_m, armed=False)
    if away_m > 25.0:
        assert isinstance(air.error, CheckError)
        assert str(air.error).startswith("it came down 30 m from where the mission ends")
    else:
        assert air.error is None
        assert air.session.report.words.endswith("it said 'Critical battery level'")


# -- somebody else ----------------------------------------------------------------------------------------------


@BOTH
def test_a_pilot_who_takes_over_is_told_of_and_never_fought(firmware):
    air = flying(firmware).fly_stops(1)
    air.on(60, mode=ALTITUDE[firmware]).on(8, up_m=0.0, armed=False)
    assert air.doings == []
    (told,) = air.script.told("mode")
    assert "neither the mission nor you switched there" in told
    assert isinstance(air.error, CheckError)
    assert "which is not the mission's, at item" in str(air.error)
    assert air.session.report.stops_done == (1,)


@BOTH
def test_a_pilot_who_gives_the_mission_back_lets_it_end_flown(firmware):
    air = flying(firmware).on(20, item=0).on(10, item=2, north_m=100.0).on(3, item=3)
    air.on(10, mode=ALTITUDE[firmware]).on(3, mode=MISSION_MODE[firmware])
    air.on(9).on(10, item=4).on(10, item=5).come_home()
    assert air.error is None
    assert air.script.told("mode")[1].endswith("the mission goes on")


@BOTH
def test_a_failsafe_return_before_the_end_is_not_the_missions_and_its_text_is_the_reason(firmware):
    air = flying(firmware).fly_stops(1)
    air.say(text("Battery 1 is low", 4)).on(40, mode=RTL if firmware == "ardupilot" else PX4_RETURN)
    air.on(8, up_m=0.0, armed=False)
    assert isinstance(air.error, CheckError)
    assert "'Battery 1 is low'" in str(air.error)
    assert air.script.told("text") == ["'Battery 1 is low'"]
    assert air.doings == []


def test_px4s_return_at_the_missions_end_is_its_own_even_if_the_mode_is_told_first():
    air = flying("px4").fly_stops()
    air.on(3, mode=PX4_RETURN).on(20, item=6, state=5).on(8, up_m=0.0, north_m=0.0, armed=False)
    assert air.error is None
    assert air.script.told("mode") == ["RETURN: the mission leads there"]


@BOTH
def test_a_hold_that_somebody_cuts_short_is_found_by_the_vehicles_clock(firmware):
    air = flying(firmware).on(20, item=0).on(10, item=2, north_m=100.0).on(2, item=3)
    air.on(10, item=4, north_m=200.0).on(10, item=5).come_home()
    assert isinstance(air.error, CheckError)
    assert "the hold was not kept at stop 1" in str(air.error)
    assert air.session.report.users_served == ("Bob", "Cy")


@BOTH
def test_a_second_station_that_writes_makes_it_uncertain_what_was_flown(firmware):
    air = flying(firmware).fly_stops(1)
    air.say(item(2, to=VEHICLE, by=OTHER_STATION))
    air.on(10, item=4, north_m=200.0).on(10, item=5).come_home()
    assert air.script.told("mission") == ["another ground station writes to the vehicle's mission"]
    assert isinstance(air.error, UncertainError)


@BOTH
def test_a_mission_of_another_length_is_another_mission(firmware):
    air = flying(firmware).fly_stops(1).on(5, total=3).on(10, total=7)
    assert air.script.told("mission") == ["the vehicle holds another mission now"]
    air.on(10, item=4).on(10, item=5).come_home()
    assert isinstance(air.error, CheckError)


@BOTH
def test_an_autopilot_that_restarts_in_flight_is_told_of_and_not_flown(firmware):
    air = flying(firmware).fly_stops(1)
    air.script.wait(air.script.now + 3.0)
    air.armed, air.up_m = False, 0.0
    for second in range(1, 15):
        air.script.hear_at(
            air.script.now + 1.0, beat(firmware, GUIDED if firmware == "ardupilot" else PX4_HOLD)
        )
        air.say(position(HOME, boot_s=float(second)), current(air.first, 2))
    assert "the autopilot has restarted" in air.script.told("vehicle")
    assert isinstance(air.error, CheckError)
    assert "the autopilot restarted at item" in str(air.error)
    assert air.doings == []


# -- the link ---------------------------------------------------------------------------------------------------


@BOTH
def test_minutes_of_silence_change_nothing_and_are_told_with_what_is_known(firmware):
    air = flying(firmware).fly_stops(1)
    at_s = air.script.now
    air.script.wait(at_s + 240.0)
    assert air.session.phase is Phase.FLYING
    assert air.doings == []
    (told,) = air.script.told("link")
    assert told.startswith("nothing heard for 5 s; it flies on by itself; last: armed, ")
    assert "30 m above home" in told
    air.on(10, item=4, north_m=200.0).on(10, item=5).come_home()
    assert air.script.told("link")[1] == "heard again after 241 s"
    assert air.error is None


@BOTH
def test_a_link_that_never_comes_back_ends_uncertain_at_the_deadline_and_not_before(firmware):
    air = flying(firmware).fly_stops(1)
    allowed_s = 1.5 * air.session.route.mission_s + 120.0
    air.script.wait(6.0 + allowed_s - 2.0)
    assert air.session.phase is Phase.FLYING
    air.script.wait(6.0 + allowed_s + 2.0)
    assert isinstance(air.error, UncertainError)
    assert "its mission was left alone" in str(air.error)
    assert "it was at item" in str(air.error)
    assert air.session.report.outcome == "uncertain"


@BOTH
@pytest.mark.parametrize("finished", [True, False])
def test_a_flight_that_ends_unheard_is_flown_only_where_the_vehicle_tells_so(firmware, finished):
    air = flying(firmware).fly_stops(1)
    air.script.wait(air.script.now + 120.0)
    end = air.first + 6 if firmware == "px4" else 0
    air.item, air.state = (end - air.first, 5) if finished else (0, 2)
    air.on(10, armed=False, up_m=0.0, north_m=0.0)
    if finished:
        assert air.error is None
    else:
        assert isinstance(air.error, UncertainError)
        assert "how it came down is not known" in str(air.error)


def test_a_state_of_an_earlier_flight_is_not_this_ones_end():
    script = begin(make_mission("px4", 2))
    on_the_ground(script, "px4", PX4_HOLD, until=6.0, current=current(0, 5))
    script.session.approve(script.now)
    script.hear(beat("px4", PX4_HOLD), current(0, 5))
    script.hear_at(6.3, beat("px4", PX4_MISSION, armed=True))
    script.hear(current(0, 5))
    assert script.session.picture(script.now).items_done == 0
    script.hear(current(1, 3), current(6, 5))
    assert script.session.picture(script.now).items_done == 6  # the return itself is not over


@BOTH
def test_messages_are_asked_for_again_when_they_stop_and_only_those(firmware):
    air = flying(firmware).fly_stops(1)
    before = len(air.script.sent)
    for _ in range(12):
        air.script.hear_at(air.script.now + 1.0, beat(firmware, air.mode, armed=True))
    asked = {
        round(sent.message.param1)
        for sent in air.script.sent[before:]
        if sent.message.get_type() == "COMMAND_LONG" and sent.message.command == 511
    }
    assert {common.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, common.MAVLINK_MSG_ID_MISSION_CURRENT} <= asked
    old = [sent.message for sent in air.script.sent if sent.message.get_type() == "REQUEST_DATA_STREAM"]
    assert {message.req_stream_id for message in old} >= {2, 6}


# -- an end that stays ------------------------------------------------------------------------------------------


def staying(firmware):
    mission = make_mission(firmware, 2)
    place = (mission.items[5].lat_e7, mission.items[5].lon_e7, 30.0)
    stay = MissionItem(Command.NAV_LOITER_UNLIM, Frame.GLOBAL_RELATIVE_ALT, (0, 0, 0, 0), *place)
    return dataclasses.replace(mission, items=(*mission.items[:-1], stay))


@BOTH
def test_a_mission_that_stays_is_over_when_it_is_where_it_stays(firmware):
    mission = staying(firmware)
    script = begin(mission)
    before = GUIDED if firmware == "ardupilot" else PX4_HOLD
    on_the_ground(script, firmware, before, until=6.0)
    script.session.approve(script.now, every_question=True)
    first = 1 if firmware == "ardupilot" else 0
    script.hear(beat(firmware, before), current(first, 2))
    script.hear_at(6.2, acked(400))
    script.hear_at(6.4, acked(300))
    script.hear(beat(firmware, MISSION_MODE[firmware], armed=True), position(HOME, boot_s=7.4))
    place = dataclasses.replace(HOME, lat_e7=mission.items[6].lat_e7, lon_e7=mission.items[6].lon_e7)
    steps = [(0, 20, 5.0), (2, 20, 5.0), (3, 9, 0.0), (4, 20, 5.0), (5, 10, 0.0), (6, 6, 0.0)]
    for number, seconds, speed_m_s in steps:
        for _ in range(seconds):
            at = script.now + 1.0
            script.hear_at(at, beat(firmware, MISSION_MODE[firmware], armed=True))
            script.hear(
                position(place, up_m=30.0, speed_m_s=speed_m_s, boot_s=at + 1), current(first + number, 3)
            )
    assert script.session.error is None
    assert script.session.report.outcome == "stays"


# -- orders -----------------------------------------------------------------------------------------------------


HOLDS = {"ardupilot": BRAKE, "px4": PX4_HOLD}
RETURNS = {"ardupilot": RTL, "px4": PX4_RETURN}
WORDS = {
    ("ardupilot", Order.HOLD): "MODE 17",
    ("px4", Order.HOLD): "MODE 4/3",
    ("ardupilot", Order.RETURN): "MODE 6",
    ("px4", Order.RETURN): "MODE 4/5",
}


@BOTH
@pytest.mark.parametrize("order", Order)
def test_an_order_is_sent_until_the_vehicle_does_it_and_then_no_more(firmware, order):
    air = flying(firmware).fly_stops(1)
    air.session.order(order, air.script.now)
    assert len(air.script.doings) == air.sent  # not before it is collected
    air.on(3)
    assert set(air.doings) == {WORDS[firmware, order]}
    assert 3 <= len(air.doings) <= 5
    air.on(1, mode=(HOLDS if order is Order.HOLD else RETURNS)[firmware])
    sent = len(air.doings)
    air.on(20)
    assert len(air.doings) == sent
    assert air.script.told("order")[-1].endswith("as you ordered")
    assert air.script.told("mode") == []
    air.on(8, up_m=0.0, armed=False)
    assert isinstance(air.error, CheckError)
    assert f"it was to {order.value} by your order" in str(air.error)


def test_ardupilot_without_brake_holds_in_guided_and_never_in_loiter():
    air = flying("ardupilot").fly_stops(1)
    air.session.order(Order.HOLD, air.script.now)
    air.on(1).say(acked(176, 4)).on(2).on(10, mode=GUIDED)
    assert list(dict.fromkeys(air.doings)) == ["MODE 17", "MODE 4"]
    assert "BRAKE was refused, failed (COMMAND_ACK 4); GUIDED is tried" in air.script.told("order")
    assert air.script.told("order")[-1] == "GUIDED, as you ordered"


@BOTH
def test_an_order_is_not_sent_against_a_pilot(firmware):
    air = flying(firmware).fly_stops(1)
    air.session.order(Order.RETURN, air.script.now)
    air.on(3, mode=ALTITUDE[firmware])
    sent = len(air.doings)
    air.on(30)
    assert len(air.doings) == sent
    assert "is not sent any more: somebody else switched to" in air.script.told("order")[-1]


@BOTH
def test_an_order_that_is_refused_three_times_is_told_and_given_up(firmware):
    air = flying(firmware).fly_stops(1)
    air.session.order(Order.RETURN, air.script.now)
    for _ in range(4):
        air.on(2).say(acked(176, 4))
    sent = len(air.doings)
    air.on(10)
    assert len(air.doings) == sent
    assert "was not heeded" in air.script.told("order")[-1]


@BOTH
def test_leaving_a_vehicle_that_holds_by_order_is_known_and_leaving_a_mission_is_not(firmware):
    held = flying(firmware).fly_stops(1)
    held.session.order(Order.HOLD, held.script.now)
    held.on(5, mode=HOLDS[firmware])
    held.session.leave(held.script.now, "interrupted")
    assert isinstance(held.error, CheckError)
    left = flying(firmware).fly_stops(1)
    left.session.leave(left.script.now, "interrupted")
    assert isinstance(left.error, UncertainError)
    assert "its mission was left alone" in str(left.error)
    left.script.wait(left.script.now + 10.0)
    assert left.doings == []


@BOTH
def test_a_pilot_who_ends_an_ordered_hold_by_the_mission_lets_it_end_flown(firmware):
    air = flying(firmware).fly_stops(1)
    air.session.order(Order.HOLD, air.script.now)
    air.on(5, mode=HOLDS[firmware]).on(3, mode=MISSION_MODE[firmware])
    air.on(10, item=4, north_m=200.0).on(10, item=5).come_home()
    assert air.error is None


# -- only watched -----------------------------------------------------------------------------------------------


@BOTH
def test_a_flight_that_is_only_watched_gets_nothing_but_requests_for_messages(firmware):
    script = begin(make_mission(firmware, 2), watch_only=True)
    for second in range(1, 100):
        script.hear_at(float(second), beat(firmware, MISSION_MODE[firmware], armed=second < 90))
        first = 1 if firmware == "ardupilot" else 0
        number = min(6, second // 12)
        state = 5 if firmware == "px4" and number == 6 else 3
        up_m = 30.0 if second < 88 else 0.0
        script.hear(
            position(HOME, up_m=up_m, boot_s=float(second)), current(first + number, state), battery()
        )
    assert script.session.error is None
    assert script.session.report.outcome == "flown"
    assert script.doings == []


@BOTH
def test_a_vehicle_that_nobody_has_started_yet_is_waited_for(firmware):
    script = begin(make_mission(firmware, 2), watch_only=True)
    for second in range(1, 60):
        script.hear_at(float(second), beat(firmware, GUIDED if firmware == "ardupilot" else PX4_HOLD))
        script.hear(position(HOME, boot_s=float(second)), current(0, 5))
    assert script.session.phase is Phase.FLYING
    assert script.session.picture(script.now).items_done == 0
    assert script.doings == []
