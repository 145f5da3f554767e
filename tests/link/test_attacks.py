"""What the campaign and its author's malice found: each test is one way in which an outcome was untrue, or a flood."""

import random

import pytest
from pymavlink.dialects.v20 import common

from benchmarks.transfer_case import Observed, put
from benchmarks.transfer_oracle import make_sample
from mavplan.errors import RefusedError, UncertainError
from mavplan.link.download_session import DownloadSession
from mavplan.link.manners import MANNERS
from mavplan.link.protocol import mission_count, mission_item
from mavplan.link.report import broken_off, refused
from mavplan.link.upload import Upload, UploadEnd
from mavplan.link.upload_session import UploadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.wire import to_wire
from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES
from sitl_mock.wire import Encoder
from tests.link.harness import HOME, LINK, make_mission, run
from tests.link.script import US, VEHICLE, ack, outgoing, request, text, until

PLACE = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, HOME.alt_amsl_m)


def make(autopilot, deadline=60.0):
    items = to_wire(make_mission(autopilot, 0), AUTOPILOTS[autopilot])
    upload = Upload(items, MANNERS[autopilot], VEHICLE, US, now=0.0, deadline=deadline)
    upload.tick(0.0)
    outgoing(upload)
    return upload


def told(upload, autopilot, outcome=None):
    """The error that the user would see."""
    rules, manners = AUTOPILOTS[autopilot], MANNERS[autopilot]
    if outcome is None:
        return broken_off(upload, rules, manners, "no end")
    return refused(upload, outcome, rules, manners, texts=(), space=None, stored=None, found=())


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_request_that_comes_before_the_count_of_a_new_try_is_not_answered(autopilot):
    """A doubled count reopens the vehicle's upload at once; the item went out twice within a quarter second."""
    upload = make(autopilot)
    for seq in range(len(upload.items)):
        upload.receive(request(seq), 0.01)
    upload.receive(ack(0), 0.02)
    outgoing(upload)
    upload.restart(0.02, 1.0)
    upload.receive(request(0), 0.03)
    assert outgoing(upload) == []
    assert until(upload, 1.02) == [(1.02, f"COUNT {len(upload.items)}")]
    upload.receive(request(0), 1.03)
    assert outgoing(upload) == ["ITEM 0"]


def test_a_refusal_that_comes_before_the_count_of_a_new_try_does_not_refuse_it():
    upload = make("px4")
    for seq in range(len(upload.items)):
        upload.receive(request(seq), 0.01)
    upload.receive(ack(0), 0.02)
    upload.restart(0.02, 1.0)
    for _ in range(5):
        upload.receive(ack(2), 0.03)
    upload.receive(ack(4), 0.04)
    assert upload.outcome is None


def test_a_count_on_its_way_at_the_deadline_may_have_arrived_so_the_old_mission_is_not_sure():
    """ArduPilot cuts its mission off at the count: put off once, then silence, is no refusal."""
    upload = make("ardupilot", deadline=2.0)
    upload.receive(ack(14), 0.1)
    assert [words[:5] for _, words in until(upload, 1.65)] == ["COUNT"]
    until(upload, 2.0)
    assert upload.outcome.end is UploadEnd.EXPIRED
    assert isinstance(told(upload, "ardupilot"), UncertainError)


def test_every_count_put_off_is_a_refusal():
    upload = make("ardupilot", deadline=3.0)
    upload.receive(ack(14), 0.1)
    until(upload, 1.65)
    upload.receive(ack(14), 1.7)
    until(upload, 3.0)
    assert isinstance(told(upload, "ardupilot"), RefusedError)


def test_a_request_after_the_refusals_means_that_a_count_was_taken_after_all():
    """Then ArduPilot's old mission is cut off: no word of "keeps its old mission"."""
    upload = make("ardupilot")
    upload.receive(ack(3), 0.1)
    until(upload, 1.2)
    upload.receive(ack(3), 1.3)
    until(upload, 2.4)
    upload.receive(ack(3), 2.5)
    outcome = upload.outcome
    assert outcome.end is UploadEnd.REFUSED
    assert isinstance(told(upload, "ardupilot", outcome), RefusedError)
    upload.receive(request(0), 2.6)
    assert outgoing(upload) == []
    assert isinstance(told(upload, "ardupilot", outcome), UncertainError)


def test_a_refusal_after_a_whole_try_is_no_proof_of_the_old_mission():
    """PX4 may have stored the first try before it refuses the second."""
    upload = make("px4")
    for seq in range(len(upload.items)):
        upload.receive(request(seq), 0.01)
    until(upload, 3.0)
    assert upload.outcome.end is UploadEnd.UNRESOLVED
    upload.restart(3.0, 1.0)
    until(upload, 4.0)
    upload.receive(ack(4), 4.1)
    assert upload.outcome.end is UploadEnd.REFUSED
    assert isinstance(told(upload, "px4", upload.outcome), UncertainError)


def test_an_ardupilot_that_once_said_it_boots_is_waited_for_though_its_later_texts_are_lost():
    upload = make("ardupilot")
    upload.tell_space(0)
    now = 0.0
    for _ in range(20):
        upload.receive(ack(4), now + 0.1)
        assert upload.outcome is None
        until(upload, now := now + 1.15)
    upload.receive(request(0), now)
    assert outgoing(upload) == ["ITEM 0"]


def test_a_booting_ardupilot_is_not_refused_however_many_of_its_words_are_lost():
    for seed in range(30):
        sample = make_sample("ardupilot", 12, random.Random(seed))
        vehicle = Autopilot(FIRMWARES["ardupilot"], home=PLACE, boot_time_s=20.0)
        network = Observed(vehicle, "drop-down=0.3", seed)
        session = UploadSession(sample.mission, now=network.clock_s, deadline_s=150.0)
        run(session, network)
        assert session.report is not None, (seed, session.error)


class Meddler(Observed):
    """Another station writes the vehicle's mission anew behind an item that we are sent; on a link we do not hear."""

    link = "elsewhere"

    def __init__(self, vehicle, items, at_item, faults=""):
        super().__init__(vehicle, faults, 1)
        self.items, self.at_item, self.served, self.wrote = items, at_item, 0, False

    def _leave(self, link, frame, now):
        super()._leave(link, frame, now)
        self.served += frame[7] == common.MAVLINK_MSG_ID_MISSION_ITEM_INT
        if self.served == self.at_item and not self.wrote:
            self.wrote = True
            station = Encoder(77, 190)
            for message in [mission_count(VEHICLE, len(self.items), 0)] + [
                mission_item(VEHICLE, item, 0) for item in self.items
            ]:
                self.autopilot.receive(station.encode(message), self.link, now)


@pytest.mark.parametrize("faults", ["", "delay=100ms", "delay=100ms,ack-lost", "drop=0.3"])
def test_a_mission_written_unheard_during_the_read_back_is_told_by_its_id(faults):
    """PX4's id changes: the other mission differs in an item that was read back before it came."""
    sample = make_sample("px4", 30, random.Random(5))
    items = list(to_wire(sample.mission, AUTOPILOTS["px4"]))
    items[2] = type(items[2])(
        *(getattr(items[2], f) + (5 if f == "z" else 0) for f in items[2].__dataclass_fields__)
    )
    network = Meddler(Autopilot(FIRMWARES["px4"], home=PLACE), items, 20, faults)
    session = UploadSession(sample.mission, now=network.clock_s, deadline_s=150.0)
    run(session, network)
    assert network.wrote
    assert session.report is None or sample.is_held(network.stored(0))


def test_texts_name_no_space_after_the_last_of_many_silent_refusals():
    """A number that is told ends it at once, however often the vehicle said that it boots."""
    upload = make("ardupilot")
    upload.tell_space(0)
    upload.receive(ack(4), 0.1)
    until(upload, 1.2)
    upload.receive(ack(4), 1.3)
    assert upload.outcome is None
    upload.tell_space(3)
    assert upload.outcome.end is UploadEnd.REFUSED
    assert text("Only 3 items are supported").text.startswith("Only 3")


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_mission_written_during_a_download_does_not_make_a_mixture(firmware):
    """Heard on the same link: what comes out is one of the two missions, whole."""
    rules = AUTOPILOTS[firmware]
    old, new = (make_sample(firmware, 30, random.Random(seed)) for seed in (1, 2))
    vehicle = Autopilot(FIRMWARES[firmware], home=PLACE)
    put(vehicle, to_wire(old.mission, rules))
    network = Meddler(vehicle, list(to_wire(new.mission, rules)), 20)
    network.link = LINK
    session = DownloadSession(now=network.clock_s, deadline_s=60.0)
    run(session, network)
    assert network.wrote
    places = [(item.lat_e7, item.lon_e7) for item in session.mission.items]
    assert places in [[(item.lat_e7, item.lon_e7) for item in sample.mission.items] for sample in (old, new)]
