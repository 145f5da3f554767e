"""One seeded transfer of the campaign: the real session, the real mock, bytes on a virtual clock.

What came of it is judged by `transfer_judge`.
"""

import random
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal

from pymavlink.dialects.v20 import common

from benchmarks.transfer_oracle import HOME, Sample, make_sample, with_areas
from mavplan.link.clear_session import ClearSession
from mavplan.link.download_session import DownloadSession
from mavplan.link.protocol import Address, Message, mission_count, mission_item
from mavplan.link.session import Session
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot as AutopilotName
from mavplan.mission.model import Mission
from mavplan.mission.uploadable import lists_to_send
from mavplan.mission.wire import WireItem
from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.items import StoredItem
from sitl_mock.wire import Encoder
from tests.link.harness import Radio, Run, run

Work = Literal["upload", "verify", "download", "clear"]
Lists = dict[int, tuple[StoredItem, ...]]
"""What a vehicle holds, by MAV_MISSION_TYPE."""

TELLING = frozenset({common.MAVLINK_MSG_ID_MISSION_COUNT, common.MAVLINK_MSG_ID_MISSION_ITEM_INT})
LISTS = (0, 1, 2)
REQUESTS = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})
VEHICLE = Address(1, 1)


@dataclass(frozen=True, slots=True)
class Case:
    """What one transfer is about; the same case goes the same way every time.

    Attributes
    ----------
    firmware
        Of the vehicle, and of the mission.
    faults
        As ``--fault`` takes them.
    items
        Items on the wire.
    deadline_s
        The session's.
    seed
        Of mission, old mission and faults.
    vehicle
        What is the matter with the vehicle: ``small`` (less capacity than items), ``high`` (it stands above the
        mission's take-off), ``booting``, ``armed``, or nothing.
    areas
        A fence and rally points go with the mission.
    work
        What is done.
    """

    firmware: AutopilotName
    faults: str
    items: int
    deadline_s: float
    seed: int
    vehicle: str = ""
    areas: bool = False
    work: Work = "upload"


@dataclass(frozen=True, slots=True)
class Transfer:
    """A transfer that has ended.

    Attributes
    ----------
    case, sample
        What it was about.
    before
        What the vehicle held before.
    run
        How it went, with the session and the network.
    requests
        Time, mission type and item of every request of the vehicle that arrived.
    """

    case: Case
    sample: Sample
    before: Lists
    run: Run
    requests: list[tuple[float, int, int]]


class Observed(Radio):
    """A radio that remembers what the vehicle held when it last sent the end of a list: its last item, or none."""

    def __init__(self, vehicle: Autopilot, faults: str, seed: int) -> None:
        super().__init__(vehicle, parse_faults(faults), seed)
        self.held_when_told: Lists = {}

    def held(self) -> Lists:
        """Return what the vehicle holds now."""
        return {kind: self.stored(kind) for kind in LISTS}

    def _leave(self, link: Hashable | None, frame: bytes, now: float) -> None:
        payload = frame[10:-2].ljust(38, b"\0")
        kind, seq = payload[4], -1  # of a count: the end of an empty list
        if frame[7] == common.MAVLINK_MSG_ID_MISSION_ITEM_INT:
            kind, seq = payload[37], int.from_bytes(payload[28:30], "little")
        is_end = frame[7] in TELLING and kind in LISTS and seq == len(self.stored(kind)) - 1
        if self.faults.second_gcs and is_end:
            self.held_when_told[kind] = self.stored(kind)
        super()._leave(link, frame, now)


class Listening(UploadSession):
    """The real session, which remembers when it was asked for which item of which list."""

    def __init__(self, mission: Mission, *, now: float, deadline_s: float) -> None:
        super().__init__(mission, now=now, deadline_s=deadline_s)
        self.requests: list[tuple[float, int, int]] = []

    def receive(self, message: Message, now: float) -> None:
        """Take a message."""
        if message.get_type() in REQUESTS and message.target_system == self.us.system:
            self.requests.append((now, message.mission_type, message.seq))
        super().receive(message, now)


def transfer(case: Case) -> Transfer:
    """Run a transfer to its end."""
    chance = random.Random(case.seed)
    sample = make_sample(case.firmware, case.items, chance, too_low=case.vehicle == "high")
    if case.areas:
        sample = with_areas(sample, chance)
    network = Observed(_vehicle(case, sample, chance), case.faults, case.seed)
    before, session = network.held(), _session(case, sample, network.clock_s)
    ended = run(session, network)
    return Transfer(case, sample, before, ended, session.requests if isinstance(session, Listening) else [])


def _session(case: Case, sample: Sample, now: float) -> Session:
    match case.work:
        case "upload":
            return Listening(sample.mission, now=now, deadline_s=case.deadline_s)
        case "verify":
            return VerifySession(sample.mission, now=now, deadline_s=case.deadline_s)
        case "download":
            return DownloadSession(now=now, deadline_s=case.deadline_s)
        case "clear":
            return ClearSession(LISTS, now=now, deadline_s=case.deadline_s)


def _vehicle(case: Case, sample: Sample, chance: random.Random) -> Autopilot:
    """Make the vehicle, with another mission on it; where nothing is uploaded half the time with this one.

    What is downloaded may have the fence and the rally points of this one beside another mission, or beside none.
    """
    capacity = chance.randrange(1, case.items) if case.vehicle == "small" else None
    stands_m = HOME.alt_amsl_m + (20.0 if case.vehicle == "high" else 0.0)
    home = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, stands_m)
    boot_time_s = chance.uniform(1.0, 15.0) if case.vehicle == "booting" else 0.0
    vehicle = Autopilot(FIRMWARES[case.firmware], home=home, capacity=capacity, boot_time_s=boot_time_s)
    vehicle.vehicle.ready = True
    if case.work != "upload" and chance.random() < 0.5:
        for kind, items in lists_to_send(sample.mission, AUTOPILOTS[case.firmware]).items():
            put(vehicle, items, kind)
    else:
        count = min(
            chance.choice([0, 3, 20, case.items, case.items + 7]), 65_535 if capacity is None else capacity
        )
        if case.firmware == "ardupilot" and count == 1:
            count = 0  # home alone is no mission
        put(vehicle, _other_mission(count))
        if case.work == "download":
            for kind, items in lists_to_send(sample.mission, AUTOPILOTS[case.firmware]).items():
                if kind and chance.random() < 0.5:
                    put(vehicle, items, kind)
    vehicle.vehicle.ready = boot_time_s == 0
    if case.vehicle == "armed":
        vehicle.vehicle.armed = True
        vehicle.vehicle.base_mode |= common.MAV_MODE_FLAG_SAFETY_ARMED
    return vehicle


def _other_mission(count: int) -> tuple[WireItem, ...]:
    return tuple(
        WireItem(
            seq,
            3,
            22 if seq == 0 else 16,
            int(seq == 0),
            1,
            *(0.0, 0.0, 0.0, 0.0),
            HOME.lat_e7 + 1000 * seq,
            HOME.lon_e7 + 77,
            55.0,
        )
        for seq in range(count)
    )


def put(vehicle: Autopilot, items: tuple[WireItem, ...], kind: int = 0, now: float = Radio.clock_s) -> None:
    """Let another station, on a link of its own, upload a list to the vehicle in no time."""
    station = Encoder(201, 190)
    vehicle.receive(station.encode(mission_count(VEHICLE, len(items), kind)), "elsewhere", now)
    for item in items:
        vehicle.receive(station.encode(mission_item(VEHICLE, item, kind)), "elsewhere", now)
    if len(vehicle.stored(kind)) != len(items):
        raise AssertionError("the list of another station was not stored")
    vehicle.tick(now + 1e-9)
    vehicle.to_send()
    vehicle.forget("elsewhere")
