"""The deadline just before an upload is settled: what is not sure by then is not called verified."""

import pytest

from mavplan.errors import UncertainError
from mavplan.link.codec import Codec
from mavplan.link.protocol import GROUND
from mavplan.link.store import Phase
from mavplan.link.upload_session import UploadSession
from tests.link.harness import LINK, make_mission, make_network
from tests.link.script import OTHER_STATION, VEHICLE, count, request

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def settling(firmware):
    """A session whose read-back was equal and that only waits; and the time."""
    network = make_network(firmware)
    session = UploadSession(make_mission(firmware, 2), now=network.clock_s, deadline_s=60.0)
    codec, now = Codec(), network.clock_s
    while session._store is None or session._store.phase is not Phase.SETTLING:
        session.tick(now)
        for message in session.to_send():
            network.receive(codec.encode(message), LINK, now)
        network.tick(now)
        for _, frame in network.to_send():
            for message in codec.decode(frame, now):
                session.receive(message, now)
        now += 0.001
    return session, now


def ended(session, now, *heard):
    """What comes of it when the time is over now, and this is heard in the same moment."""
    session.deadline = now
    for message in heard:
        session.receive(message, now)
    session.tick(now)
    return session.error


@BOTH
def test_within_a_second_of_the_last_count_a_late_copy_of_it_could_still_come(firmware):
    session, now = settling(firmware)
    error = ended(session, now)
    assert isinstance(error, UncertainError)
    assert "gave all" in str(error)
    assert session.report is None


@BOTH
def test_a_vehicle_that_asks_for_items_again_in_the_last_moment_is_uncertain(firmware):
    session, now = settling(firmware)
    now = session._store._settled_at() + 0.1
    error = ended(session, now, request(0, to=GROUND))
    assert isinstance(error, UncertainError)
    assert session.report is None


@BOTH
def test_another_stations_writing_in_the_last_moment_is_uncertain(firmware):
    session, now = settling(firmware)
    now = session._store._settled_at() + 0.1
    error = ended(session, now, count(3, by=OTHER_STATION, to=VEHICLE))
    assert isinstance(error, UncertainError)
    assert session.report is None


def test_a_settled_list_without_the_judgement_is_stored_and_said_to_be_without_it():
    session, now = settling("px4")
    now = session._store._settled_at() + 0.1
    assert ended(session, now) is None
    assert [problem.code for problem in session.report.warnings if problem.code == "not-judged"]
