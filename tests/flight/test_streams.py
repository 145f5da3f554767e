"""Asking for messages: one at a time, again when lost or stopped, the old way where the new one is refused."""

from pymavlink.dialects.v20 import common

from mavplan.flight.streams import WANTED, Streams
from mavplan.link.transfer import Pace
from tests.flight.script import acked, beat, current
from tests.link.script import US, VEHICLE

SET_MESSAGE_INTERVAL = 511


class Asking:
    """Streams on a clock, and what they ask for."""

    def __init__(self):
        self.streams = Streams(VEHICLE, US, Pace())
        self.now = 0.0
        self.asked = []

    def on(self, seconds, *heard, answer=None):
        for _ in range(round(seconds / 0.25)):
            self.now += 0.25
            if self.now % 1.0 == 0.0:
                for message in (beat("ardupilot", 0), *heard):
                    self.streams.receive(message, self.now)
            self.streams.tick(self.now)
            for message in self.streams.to_send():
                old = message.get_type() == "REQUEST_DATA_STREAM"
                self.asked.append(
                    (self.now, "old" if old else "new", int(message.req_stream_id if old else message.param1))
                )
                if answer is not None and not old:
                    self.streams.receive(acked(SET_MESSAGE_INTERVAL, answer), self.now)
        return self

    def names(self, way="new"):
        return [number for _, kind, number in self.asked if kind == way]


def test_everything_wanted_is_asked_for_one_by_one():
    asking = Asking().on(5.0, answer=0)
    assert asking.names()[:6] == [stream.message_id for stream in WANTED]
    assert len({at for at, _, _ in asking.asked[:6]}) == 6


def test_nothing_is_asked_of_a_vehicle_that_is_not_heard():
    asking = Asking()
    for _ in range(100):
        asking.now += 0.25
        asking.streams.tick(asking.now)
        assert asking.streams.to_send() == []


def test_a_lost_request_is_made_again_and_what_comes_is_not_asked_for():
    asking = Asking().on(12.0, current(1, 3))
    assert asking.names().count(common.MAVLINK_MSG_ID_MISSION_CURRENT) <= 1
    assert asking.names().count(common.MAVLINK_MSG_ID_SYS_STATUS) >= 2


def test_what_is_asked_for_in_vain_is_asked_for_the_old_way_too_and_more_and_more_seldom():
    asking = Asking().on(30.0, answer=3)
    assert set(asking.names("old")) == {2, 6}
    early = len([at for at, kind, _ in asking.asked if kind == "new" and at <= 30.0])
    asking.on(30.0, answer=3)
    late = len([at for at, kind, _ in asking.asked if kind == "new" and at > 30.0])
    assert late < early / 2


def test_after_a_restart_everything_is_asked_for_anew():
    asking = Asking().on(10.0, current(1, 3), answer=0)
    before = len(asking.asked)
    asking.streams.forget()
    asking.on(5.0, answer=0)
    assert {number for _, _, number in asking.asked[before:]} >= {stream.message_id for stream in WANTED}
    assert asking.streams.missing(asking.now)
