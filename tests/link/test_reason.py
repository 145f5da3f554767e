"""Why PX4 judges a mission not flyable: what counts as its reason, and what is asked for again, how long."""

import dataclasses
import itertools

import pytest

from mavplan.errors import RefusedError
from mavplan.link.codec import Codec
from mavplan.link.event_log import EventLog, Mark, comes_after
from mavplan.link.event_messages import EventMessage
from mavplan.link.px4_events import event_id
from mavplan.link.reason import PATIENCE_S, Reason
from mavplan.link.transfer import Pace
from mavplan.link.upload_session import UploadSession
from mavplan.link.watch import Watch
from mavplan.mission.model import Frame
from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.firmware import PX4
from sitl_mock.wire import message_id
from tests.link.harness import Radio, make_mission, make_network, run
from tests.link.script import OTHER_STATION, US, VEHICLE, said, text
from tests.link.test_fence_query import SMALL
from tests.link.test_watch import system_time

LOW = "navigator_mis_takeoff_too_low"
LOW_WORDS = "the take-off is too low; it must be above 500.0 m"


def event(sequence, name=LOW, *, time_s=50.0, to=(0, 0), by=VEHICLE, levels=0x63):
    number = name if isinstance(name, int) else event_id(name)
    values = (number, int(time_s * 1000), sequence, to[1], to[0], levels, bytes(40))
    return said(EventMessage(410, values), by)


def current(sequence, flags=0):
    return said(EventMessage(411, (sequence, flags)))


def gone(sequence, oldest):
    return said(EventMessage(413, (sequence, oldest, US.system, US.component, 0)))


def log_of(*messages):
    log = EventLog(US)
    for at, message in enumerate(messages):
        log.receive(message, float(at))
    return log


def new(log, mark):
    return [event.sequence for event in log.since(mark)]


def missing(log, mark):
    return log.missing(mark)


START = Mark(None, 0.0, 0)


def test_numbers_come_round():
    assert comes_after(2, 65_534)
    assert not comes_after(65_534, 2)
    assert not comes_after(7, 7)


def test_an_event_counts_once_and_in_order_however_often_and_in_whatever_order_it_comes():
    for order in itertools.permutations([65_535, 0, 1]):
        log = log_of(*(event(number) for number in order for _ in range(2)))
        assert new(log, START) == [65_535, 0, 1]


def test_an_event_for_another_station_or_of_another_vehicle_is_none_of_ours():
    assert new(log_of(event(5, to=(254, 190))), START) == []
    assert new(log_of(event(5, to=(US.system, US.component))), START) == [5]
    watch = Watch(VEHICLE, US)
    watch.receive(event(5, by=OTHER_STATION), 0.0)
    assert watch.events.since(START) == []


def test_an_old_event_that_another_station_asked_for_is_old_by_its_number_or_by_its_time():
    log = log_of(event(7), current(9))
    mark = log.mark(60.0)
    for message in (event(8), event(9, time_s=59.0), event(10, time_s=59.0), event(11, time_s=60.0)):
        log.receive(message, 10.0)
    assert new(log, mark) == [11]
    assert new(log, Mark(None, 60.0, 0)) == [11]


def test_after_a_restart_the_numbers_begin_anew():
    log = log_of(event(900))
    mark = log.mark(60.0)
    log.vehicle_restarted()
    log.receive(event(65_526, time_s=1.0), 5.0)
    assert new(log, mark) == [65_526]


def test_what_is_missing_is_known_by_the_last_number_told():
    log = log_of(event(3))
    mark = log.mark(0.0)
    assert missing(log, mark) is None
    log.receive(current(3), 1.0)
    assert missing(log, mark) is None
    log.receive(current(5), 1.0)
    assert missing(log, mark) == (4, 5)
    log.receive(event(5), 1.0)
    assert missing(log, mark) == (4, 4)
    log.receive(gone(4, 5), 1.0)
    assert missing(log, mark) is None


def test_of_many_only_the_last_twenty_are_missed_and_none_where_the_numbers_went_back():
    log = log_of(event(3))
    mark = log.mark(0.0)
    log.receive(current(500), 1.0)
    assert missing(log, mark) == (481, 500)
    log.receive(gone(481, 490), 1.0)
    assert missing(log, mark) == (490, 500)
    assert missing(log, Mark(600, 0.0, 0)) is None


# -- asking ---------------------------------------------------------------------------------------------------


def reason_after(*before):
    watch = Watch(VEHICLE, US)
    for message in before:
        watch.receive(message, 0.0)
    reason = Reason(watch, Pace(), deadline=1_000.0)
    reason.mission_sent()
    return watch, reason


def asked(reason, until):
    """The ranges asked for and when."""
    sent = []
    while (timer := reason.next_timer()) is not None and timer <= until:
        reason.tick(timer)
        sent += [(round(timer, 3), m.first_sequence, m.last_sequence) for m in reason.to_send()]
    return sent


def test_a_reason_that_is_there_already_is_not_waited_for():
    watch, reason = reason_after(current(3))
    watch.receive(event(4), 1.0)
    assert not reason.done
    reason.ask(2.0)
    assert reason.done
    assert reason.to_send() == []
    assert reason.events == ("the take-off is too low; it must be above 0.0 m",)


def test_a_lost_one_is_asked_for_until_it_comes():
    watch, reason = reason_after(current(3))
    watch.receive(event(5, "something_else", levels=0x66), 1.0)
    reason.ask(2.0)
    assert [m.first_sequence for m in reason.to_send()] == [4]
    assert asked(reason, 3.2) == [(2.5, 4, 4), (3.0, 4, 4)]
    watch.receive(event(4), 3.3)
    reason.tick(3.3)
    assert reason.done


def test_where_nothing_is_missing_it_is_over_as_soon_as_the_vehicle_has_said_so():
    watch, reason = reason_after(current(3))
    reason.ask(2.0)
    assert asked(reason, 4.0) == []
    assert not reason.done
    watch.receive(current(3), 4.5)
    reason.tick(4.5)
    assert reason.done
    assert reason.events == ()


def test_a_vehicle_without_events_is_waited_for_a_few_seconds():
    _, reason = reason_after()
    reason.ask(2.0)
    assert reason.next_timer() == 2.0 + PATIENCE_S
    reason.tick(2.0 + PATIENCE_S)
    assert reason.done


def test_events_and_texts_of_before_do_not_count():
    watch, reason = reason_after(system_time(51_000), event(3), text("Geofence violation for waypoint 2"))
    watch.receive(event(4, time_s=50.0), 1.0)  # it happened before, and came late
    assert (reason.events, reason.texts) == ((), [])
    watch.receive(text("Geofence violation for waypoint 3"), 1.5)
    assert reason.texts == ["Geofence violation for waypoint 3"]


# -- in a whole upload ----------------------------------------------------------------------------------------


def too_low(stops=2):
    """A take-off 480 m below the vehicle."""
    mission = make_mission("px4", stops)
    takeoff = dataclasses.replace(mission.items[0], frame=int(Frame.GLOBAL), alt_m=20.0)
    return dataclasses.replace(mission, items=(takeoff, *mission.items[1:]))


def high(faults="", seed=0):
    return make_network("px4", faults, seed, home=(37.4, -122.1, 500.0))


def refused(network, mission=None, deadline_s=120.0):
    session = UploadSession(
        mission or too_low(), now=network.clock_s, deadline_s=deadline_s, max_home_height_m=1_000.0
    )
    ended = run(session, network)
    assert isinstance(ended.error, RefusedError), ended.error
    return ended


def test_the_reason_is_in_the_report():
    ended = refused(high())
    assert str(ended.error) == f"PX4 stored all 7 items but judges the mission not flyable: {LOW_WORDS}"


@pytest.mark.parametrize("seed", range(12))
def test_on_a_bad_radio_the_reason_is_asked_for(seed):
    ended = refused(high("drop=0.4,dup=0.2,reorder=0.2", seed))
    assert LOW_WORDS in str(ended.error)


class Deaf(Radio):
    """A radio that loses each event but the repeats."""

    def _leave(self, link, frame, now):
        if message_id(frame) == 410 and not self.lost:
            self.lost.append(frame)
            return
        super()._leave(link, frame, now)


def test_an_event_that_is_lost_once_is_asked_for_and_told():
    network = high()
    network.__class__ = Deaf
    network.lost = []
    ended = refused(network)
    assert len(network.lost) == 1
    assert LOW_WORDS in str(ended.error)
    requests = [m for _, f in ended.sent for m in Codec().decode(f, 0.0) if m.get_type() == "REQUEST_EVENT"]
    assert requests


def test_an_event_nobody_knows_is_told_by_its_number(monkeypatch):
    monkeypatch.setattr("mavplan.link.px4_events.BY_ID", {})
    assert f"it sent event 0x{event_id(LOW):08x}, whose meaning" in str(refused(high()).error)


def silent():
    """A vehicle behind the same, of a firmware without the events protocol."""
    streams = {name: s for name, s in PX4.streams.items() if name != "CURRENT_EVENT_SEQUENCE"}
    firmware = dataclasses.replace(PX4, sends_events=False, streams=streams)
    return Radio(Autopilot(firmware, home=(37.4, -122.1, 500.0)), parse_faults(""))


def test_a_vehicle_that_sends_no_events_gives_no_reason_and_costs_a_few_seconds():
    ended = refused(silent())
    assert str(ended.error).endswith("judges the mission not flyable, without a reason that it would tell")
    assert ended.ended_s < 6.0 + PATIENCE_S


def test_an_infeasible_mission_is_refused_also_where_the_time_for_its_reason_is_cut_short():
    whole_s = refused(silent()).ended_s
    ended = refused(silent(), deadline_s=whole_s - PATIENCE_S / 2)
    assert "judges the mission not flyable" in str(ended.error)
    assert ended.ended_s == pytest.approx(whole_s - PATIENCE_S / 2)


def test_the_judgement_of_the_old_mission_under_the_new_fence_is_not_the_new_missions_reason():
    """The fence goes first, and PX4 judges the mission it holds anew: that event is not about ours."""
    network = high()
    old = make_mission("px4", 4)
    session = UploadSession(old, now=network.clock_s, deadline_s=60.0, max_home_height_m=1_000.0)
    assert run(session, network).verified
    mission = dataclasses.replace(too_low(0), fence=SMALL)
    ended = refused(network, mission)
    assert LOW_WORDS in str(ended.error)
    assert "geofence" not in str(ended.error)
