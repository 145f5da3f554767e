"""More attacks: an armed vehicle that is written to, a "verified" or "same" that is not so, a "keeps" that is wrong."""

import dataclasses

import pytest
from pymavlink.dialects.v20 import common

from benchmarks.transfer_case import put
from mavplan.errors import RefusedError, UncertainError
from mavplan.link.clear_session import ClearSession
from mavplan.link.codec import Codec
from mavplan.link.home import HomeQuery
from mavplan.link.store import Phase
from mavplan.link.transfer import Pace
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.checksum import px4_id
from mavplan.mission.model import Command
from mavplan.mission.wire import to_wire
from sitl_mock.wire import message_id
from tests.link.fenced import fenced, stored
from tests.link.harness import Radio, make_mission, make_network, run, upload
from tests.link.script import OTHER_STATION, US, VEHICLE, ack, count, said

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
COUNT, CLEAR, ACK = 44, 45, 47


def arm(network):
    network.autopilot.vehicle.armed = True
    network.autopilot.vehicle.base_mode |= 0x80


class Arming(Radio):
    """A vehicle that does not hear the first counts (or clears), and is armed before the next one."""

    deaf_to, heard_at = COUNT, None

    def receive(self, data, sender, now):
        if message_id(data) == self.deaf_to and self.heard_at is None:
            self.heard_at = now
            arm(self)
            return
        super().receive(data, sender, now)


def times(ended, number):
    return [at for at, frame in ended.sent if message_id(frame) == number]


@BOTH
def test_a_count_is_not_sent_again_to_a_vehicle_that_has_been_armed_since(firmware):
    network = make_network(firmware)
    network.__class__ = Arming
    ended = run(UploadSession(make_mission(firmware, 1), now=network.clock_s, deadline_s=60.0), network)
    assert isinstance(ended.error, UncertainError)  # the first one may have arrived
    assert "armed" in str(ended.error)
    assert max(times(ended, COUNT)) - network.heard_at < 1.5  # its heartbeat tells once a second
    assert stored(network, 0) == ()


@BOTH
def test_a_clear_is_not_sent_again_to_a_vehicle_that_has_been_armed_since(firmware):
    network = make_network(firmware)
    assert upload(make_mission(firmware, 1), network).verified
    network.__class__ = Arming
    network.deaf_to = CLEAR
    ended = run(ClearSession((0,), now=network.clock_s, deadline_s=60.0), network)
    assert isinstance(ended.error, UncertainError)
    assert "armed" in str(ended.error)
    assert max(times(ended, CLEAR)) - network.heard_at < 1.5
    assert len(stored(network, 0)) > 2


@BOTH
def test_armed_vehicles_are_written_to_again_where_that_is_allowed(firmware):
    network = make_network(firmware)
    network.__class__ = Arming
    session = UploadSession(make_mission(firmware, 1), now=network.clock_s, deadline_s=60.0, allow_armed=True)
    assert run(session, network).verified
    network.deaf_to, network.heard_at = CLEAR, None
    session = ClearSession((0,), now=network.clock_s, deadline_s=60.0, allow_armed=True)
    assert run(session, network).session.report is not None


def test_answers_to_another_stations_requests_do_not_shorten_the_wait_for_home():
    """Else a few refusals of a camera's messages let a vehicle at another place have the mission."""
    query = HomeQuery(VEHICLE, Pace(), now=0.0, deadline=10.0, us=US)
    for to, done in ((OTHER_STATION, False), (US, True)):
        for _ in range(4):
            answer = common.MAVLink_command_ack_message(512, 3, 0, 0, to.system, to.component)
            query.receive(said(answer), 0.1)
        query.tick(0.2)
        assert query.done is done


def nose(mission, heading):
    """The mission with another heading in its holds."""
    items = tuple(
        dataclasses.replace(item, params=(*item.params[:3], heading))
        if item.command == Command.NAV_LOITER_TIME
        else item
        for item in mission.items
    )
    return dataclasses.replace(mission, items=items)


def between(session, network, phase, action):
    """Run a session and do something when it first reaches a phase of its mission's store."""
    plain, did = session.tick, []

    def tick(now):
        store = getattr(session, "_store", None)
        if store is not None and store.kind == 0 and store.phase is phase and not did:
            did.append(now)
            action(now)
        plain(now)

    session.tick = tick
    ended = run(session, network)
    assert did
    return ended


def test_px4s_checksum_tells_what_its_read_back_hides():
    """A hold's heading reads back as a flag: a mission with another one, come over another link, looks the same."""
    network = make_network("px4")
    mission = make_mission("px4", 2)
    other = to_wire(nose(mission, 90.0), AUTOPILOTS["px4"])
    session = UploadSession(mission, now=network.clock_s, deadline_s=60.0)
    ended = between(session, network, Phase.READING, lambda now: put(network.autopilot, other, now=now))
    assert ended.verified
    assert network.autopilot._missions._ids[0] == px4_id(to_wire(mission, AUTOPILOTS["px4"]))
    assert session.report.uploads == 2


def test_a_checksum_that_stays_another_one_is_uncertain(monkeypatch):
    """The vehicle acknowledges ours, and holds another mission each time."""
    network = make_network("px4")
    missions = network.autopilot._missions
    plain = missions.on_request_list

    def on_request_list(sender, kind, now):
        return [dataclasses.replace(reply, opaque_id=77) for reply in plain(sender, kind, now)]

    monkeypatch.setattr(missions, "on_request_list", on_request_list)
    ended = upload(make_mission("px4", 1), network)
    assert isinstance(ended.error, UncertainError)
    assert "the vehicle's checksum is 77" in str(ended.error)


@BOTH
@pytest.mark.parametrize("kind", [1, 2])
def test_a_list_that_another_station_writes_to_after_it_was_compared_is_compared_again(firmware, kind):
    network = make_network(firmware)
    mission = fenced(firmware)
    assert upload(mission, network).verified
    session = VerifySession(mission, now=network.clock_s, deadline_s=60.0)
    plain, told = session.tick, []

    def tick(now):
        plain(now)
        session._announced_by = None
        if session._todo == [0] and not told:
            told.append(now)
            clear = common.MAVLink_mission_clear_all_message(1, 1, kind)
            session.receive(said(clear, OTHER_STATION), now)
            network.autopilot.receive(Codec(OTHER_STATION).encode(clear), "elsewhere", now)

    session.tick = tick
    ended = run(session, network)
    assert told
    assert session.report is None
    assert "holds no" in str(ended.error)


def test_px4s_announcement_is_not_believed_while_another_station_writes():
    network, mission = make_network("px4"), make_mission("px4", 1)
    assert upload(mission, network).verified
    session = VerifySession(mission, now=network.clock_s, deadline_s=60.0)
    plain = session.tick

    def tick(now):
        if session._watch is not None and not session._watch.writes[0]:
            session.receive(count(1, to=VEHICLE, by=OTHER_STATION), now)
        plain(now)

    session.tick = tick
    run(session, network)
    assert session.report.by == "download"


class Refusing(Radio):
    """An acknowledgement of something else arrives in place of the answer to a clear, which was carried out."""

    result = 13

    def _leave(self, link, frame, now):
        if message_id(frame) == ACK:
            frame = Codec(VEHICLE).encode(ack(self.result))
        super()._leave(link, frame, now)


@BOTH
@pytest.mark.parametrize("result", [3, 13, 5])
def test_a_list_that_is_cleared_is_not_said_to_be_kept_whatever_the_acknowledgement(firmware, result):
    network = make_network(firmware)
    assert upload(make_mission(firmware, 1), network).verified
    network.__class__ = Refusing
    network.result = result
    ended = run(ClearSession((0,), now=network.clock_s, deadline_s=60.0), network)
    assert len(stored(network, 0)) <= 1
    assert not isinstance(ended.error, RefusedError)
    assert ended.session.report is not None


def test_a_refusal_that_comes_after_px4_has_stored_everything_is_not_the_old_mission():
    """A late answer to an earlier upload; PX4's own acknowledgement is lost."""
    network = make_network("px4")
    assert upload(make_mission("px4", 3), network).verified
    network.__class__ = Refusing
    network.result = 3
    mission = make_mission("px4", 2)
    ended = run(UploadSession(mission, now=network.clock_s, deadline_s=60.0), network)
    assert ended.holds(mission)
    assert not isinstance(ended.error, RefusedError), ended.error


@pytest.mark.parametrize("seed", range(4))
def test_an_old_judgement_that_comes_late_is_not_the_new_missions(seed):
    """PX4 took up to 1.3 s; a radio that delays by up to a second brings what was said before that after two."""
    network = make_network("px4", "jitter=1s", seed, home=(37.4, -122.1, 500.0))
    vehicle = network.autopilot
    vehicle.firmware = dataclasses.replace(vehicle.firmware, verdict_delay_s=1.29)
    vehicle._missions._firmware = vehicle.firmware
    options = {"deadline_s": 120.0, "max_home_height_m": 1_000.0}
    first = UploadSession(make_mission("px4", 0), now=network.clock_s, **options)
    assert run(first, network).verified
    mission = make_mission("px4", 0, hold_s=9.0)
    takeoff = dataclasses.replace(mission.items[0], frame=0, alt_m=20.0)
    mission = dataclasses.replace(mission, items=(takeoff, *mission.items[1:]))
    ended = run(UploadSession(mission, now=network.clock_s, **options), network)
    assert isinstance(ended.error, RefusedError)
