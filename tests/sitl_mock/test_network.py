"""What each failure mode does, on a virtual clock."""

import random
from typing import Any

import pytest

from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.network import FaultyNetwork, Line
from sitl_mock.wire import Encoder

from .rig import HOME, Rig, count, good_mission, heartbeat, item, kinds, request_list

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def faulty(firmware: str, faults: str, seed: int = 0) -> Rig:
    autopilot = Autopilot(FIRMWARES[firmware], home=HOME)
    return Rig(firmware, vehicle=FaultyNetwork(autopilot, parse_faults(faults), seed))


def carried(faults: str, frames: list[bytes], seed: int = 0) -> list[tuple[float, bytes]]:
    line = Line(parse_faults(faults), parse_faults(faults).drop_up, random.Random(seed))
    arrivals = [arrival for n, frame in enumerate(frames) for arrival in line.carry(frame, n * 0.001)]
    return sorted(arrivals, key=lambda arrival: arrival[0])


FRAMES = [Encoder(255, 190).encode(count(n)) for n in range(2000)]


def test_without_faults_a_line_changes_nothing() -> None:
    """Every frame once, at once, in order."""
    assert carried("", FRAMES) == [(n * 0.001, frame) for n, frame in enumerate(FRAMES)]


@pytest.mark.parametrize(
    ("faults", "expected"), [("drop=0.3", 1400), ("dup=0.1", 2200), ("drop=1", 0), ("dup=1", 4000)]
)
def test_loss_and_doubling_come_as_often_as_asked(faults: str, expected: int) -> None:
    """Within four standard deviations."""
    assert len(carried(faults, FRAMES)) == pytest.approx(expected, abs=90 if 0 < expected < 4000 else 0)


def test_delay_keeps_the_order_and_jitter_too() -> None:
    """Each frame a fifth of a second later, or up to half a second."""
    assert [at for at, _ in carried("delay=200ms", FRAMES[:9])] == pytest.approx(
        [0.2 + n * 0.001 for n in range(9)]
    )
    jittered = carried("jitter=300ms", FRAMES)
    assert [frame for _, frame in jittered] == FRAMES
    assert all(0 <= at - n * 0.001 <= 0.3 for n, (at, _) in enumerate(jittered))


def test_reordered_frames_all_arrive_but_not_in_order() -> None:
    """Overtaken, not lost."""
    arrived = [frame for _, frame in carried("reorder=0.2", FRAMES)]
    assert sorted(arrived) == sorted(FRAMES)
    assert arrived != FRAMES


def test_corruption_changes_one_byte() -> None:
    """About one frame in ten here."""
    arrived = carried("corrupt=0.1", FRAMES)
    differences = [
        sum(a != b for a, b in zip(frame, sent, strict=True))
        for (_, frame), sent in zip(arrived, FRAMES, strict=True)
    ]
    assert set(differences) == {0, 1}
    assert sum(differences) == pytest.approx(200, abs=60)


@pytest.mark.parametrize("faults", ["drop=0.3,dup=0.2,reorder=0.3,jitter=0.1,corrupt=0.05"])
def test_the_same_seed_gives_the_same_faults(faults: str) -> None:
    """And another seed others."""
    assert carried(faults, FRAMES, 5) == carried(faults, FRAMES, 5)
    assert carried(faults, FRAMES, 5) != carried(faults, FRAMES, 6)


@BOTH
def test_without_faults_the_network_is_not_there(firmware: str) -> None:
    """The same answers at the same times as the bare vehicle."""
    bare, behind = Rig(firmware), faulty(firmware, "")
    for rig in (bare, behind):
        rig.send(heartbeat())
        rig.upload(good_mission(firmware))
        rig.send(count(3))
        rig.run(12)
    assert [(at, str(m)) for at, _, m in bare.heard] == [(at, str(m)) for at, _, m in behind.heard]


@BOTH
def test_a_delay_is_felt_both_ways(firmware: str) -> None:
    """Ask at 0 s, answered at 0.4 s."""
    rig = faulty(firmware, "delay=200ms")
    assert rig.send(request_list()) == []
    answers = rig.run(0.45)
    assert [(round(at, 6), kinds([message])[0]) for at, message in answers] == [(0.4, "COUNT 0")]


@BOTH
def test_silent_after_n_items_it_says_nothing_any_more(firmware: str) -> None:
    """Not even a heartbeat."""
    rig = faulty(firmware, "silent-after=1")
    rig.send(count(3))
    assert kinds(rig.send(item(0, 22)))[0].endswith(" 1")
    assert rig.send(item(1)) == []
    assert rig.run(30, telemetry=True) == []


@BOTH
def test_silent_after_a_time(firmware: str) -> None:
    """Heartbeats at 1 and 2 s, none later."""
    beats = [
        at
        for at, m in faulty(firmware, "silent-after=2.5s").run(10, telemetry=True)
        if m.get_type() == "HEARTBEAT"
    ]
    assert beats == [1.0, 2.0]


@BOTH
def test_reboot_at_an_item_loses_it_and_the_transfer(firmware: str) -> None:
    """Once: after the boot an upload succeeds."""
    rig = faulty(firmware, "reboot-at=2")
    rig.send(count(5))
    rig.send(item(0, 22))
    assert rig.send(item(1)) == []
    assert rig.run(0.9, telemetry=True) == []
    rig.run(4)
    rig.send(heartbeat())
    assert kinds(rig.send(item(1)))[0] in {"ACK 1", "TEXT REJ. MIS ITEM: partner id mismatch"}
    assert rig.upload(good_mission(firmware)).type == 0


@BOTH
def test_reboot_at_a_time(firmware: str) -> None:
    """No heartbeat between 2 and 3 s of silence after it."""
    beats = [
        at
        for at, m in faulty(firmware, "reboot-at=2.5s").run(6, telemetry=True)
        if m.get_type() == "HEARTBEAT"
    ]
    assert beats == [1.0, 2.0, 3.5, 4.5, 5.5]


@BOTH
def test_a_lost_ack_leaves_the_mission_stored(firmware: str) -> None:
    """The first one only, where so asked."""
    rig = faulty(firmware, "ack-lost=1")
    with pytest.raises(StopIteration):
        rig.upload(good_mission(firmware))
    assert rig.vehicle.stored()
    assert rig.upload(good_mission(firmware)).type == 0


@BOTH
def test_nack_answers_every_count_and_nothing_is_stored(firmware: str) -> None:
    """With the result that was named."""
    rig = faulty(firmware, "nack=NO_SPACE")
    assert rig.upload(good_mission(firmware)).type == 4
    assert rig.upload(good_mission(firmware)).type == 4
    assert rig.vehicle.stored() == ()


@BOTH
def test_early_ack_lies_before_the_first_item(firmware: str) -> None:
    """Whoever believes it has nothing on the vehicle."""
    rig = faulty(firmware, "early-ack")
    assert sorted(kinds(rig.send(count(2)))) in (["ACK 0", "REQUEST 0"], ["ACK 0", "REQUEST_INT 0"])
    assert rig.vehicle.stored() == ()


@BOTH
def test_an_altered_item_is_stored_a_metre_off_and_accepted(firmware: str) -> None:
    """Only a read-back can tell."""
    rig = faulty(firmware, "alter=1")
    mission = good_mission(firmware)
    assert rig.upload(mission).type == 0
    moved = [stored.x - sent.x for stored, sent in zip(rig.vehicle.stored(), mission, strict=True)]
    assert moved == [90 if n == 1 else 0 for n in range(len(mission))]


@BOTH
def test_no_heartbeat(firmware: str) -> None:
    """The rest of the vehicle works."""
    rig = faulty(firmware, "no-heartbeat")
    assert rig.upload(good_mission(firmware)).type == 0
    assert not [m for _, m in rig.run(5, telemetry=True) if m.get_type() == "HEARTBEAT"]


@BOTH
def test_first_lost_needs_everything_twice(firmware: str) -> None:
    """Each mission frame arrives when it is sent again, either way."""
    rig = faulty(firmware, "first-lost")
    assert rig.send(count(2)) == []
    assert rig.send(count(2)) == []
    assert kinds([m for _, m in rig.run(1.1)])[0].endswith(" 0")


@BOTH
def test_a_second_station_reads_and_its_traffic_is_heard(firmware: str) -> None:
    """Answers to system 254 reach everybody; the mission stays."""
    rig = faulty(firmware, "second-gcs")
    rig.upload(good_mission(firmware))
    before = [stored.command for stored in rig.vehicle.stored()]
    rig.run(10)
    foreign = {m.get_type() for _, _, m in rig.heard if getattr(m, "target_system", 0) == 254}
    assert foreign >= {"MISSION_COUNT", "MISSION_ITEM_INT"}
    assert [stored.command for stored in rig.vehicle.stored()] == before


@BOTH
def test_a_reading_second_station_on_a_doubling_radio_does_not_flood_it(firmware: str) -> None:
    """Answering every copy of an item with a request of its own would double them without end."""
    rig = faulty(firmware, "second-gcs,dup=1")
    rig.upload(good_mission(firmware))
    told = len(rig.heard)
    rig.run(60)
    foreign = [m for _, _, m in rig.heard[told:] if getattr(m, "target_system", 0) == 254]
    items = len(good_mission(firmware))
    assert 20 * items < len(foreign) < 20 * 8 * (items + 2)


@BOTH
def test_a_second_station_that_uploads_replaces_the_mission_after_ours_was_accepted(firmware: str) -> None:
    """By the time of a read-back another mission is there."""
    rig = faulty(firmware, "second-gcs=upload")
    rig.run(5)
    assert rig.vehicle.stored() == ()
    assert rig.upload(good_mission(firmware)).type == 0
    rig.run(3)
    assert [stored.command for stored in rig.vehicle.stored()][-1] == 16
    assert len(rig.vehicle.stored()) == 3


class PatientClient:
    """Uploads by answering what it is asked and starting again; it is here to show that the mock can be uploaded to."""

    def __init__(self, rig: Rig, mission: list[Any]) -> None:
        self.rig, self.mission = rig, mission

    def run(self, seconds: float) -> bool:
        until, rig = self.rig.now + seconds, self.rig
        told, next_count = len(rig.heard), rig.now
        while rig.now < until:
            if rig.now >= next_count:
                rig.send(count(len(self.mission)))
                next_count = rig.now + 3.0
            rig.run(0.05)
            while told < len(rig.heard):
                message = rig.heard[told][2]
                told += 1
                if message.get_type().startswith("MISSION_REQUEST") and message.target_system == 255:
                    rig.send(self.mission[message.seq])
                    next_count = rig.now + 9.0
                if message.get_type() == "MISSION_ACK" and message.type == 0 and message.target_system == 255:
                    return True
        return False


@BOTH
@pytest.mark.parametrize(
    "faults", ["drop=0.3", "dup=0.3", "reorder=0.3,jitter=0.05", "corrupt=0.05", "drop=0.2,dup=0.2,delay=0.1"]
)
def test_a_patient_client_gets_its_mission_over_a_bad_radio(firmware: str, faults: str) -> None:
    """An ACK of success, and the vehicle really holds it."""
    rig = faulty(firmware, faults, seed=3)
    mission = good_mission(firmware, 5)
    assert PatientClient(rig, mission).run(120)
    rig.run(1)
    assert [stored.command for stored in rig.vehicle.stored()] == [message.command for message in mission]
