"""One seeded transfer of the campaign: the real session, the real mock, bytes on a virtual clock, and a judge.

The judge looks into the vehicle's memory and at the bytes that were sent. What it holds against a transfer is in
`Result.wrong`, one sentence each.
"""

import random
import struct
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

from benchmarks.transfer_oracle import HOME, Sample, make_sample
from mavplan.errors import InputError, MavplanError, NoLinkError, RefusedError, UncertainError
from mavplan.link.protocol import GROUND, Message
from mavplan.link.upload_session import UploadSession
from mavplan.mission.model import Autopilot as AutopilotName
from mavplan.mission.model import Mission
from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.feasibility import infeasible_because
from sitl_mock.firmware import FIRMWARES
from sitl_mock.items import StoredItem
from sitl_mock.wire import Encoder, message_id
from tests.link.harness import Radio, run, settle

COUNT, ITEM = common.MAVLINK_MSG_ID_MISSION_COUNT, common.MAVLINK_MSG_ID_MISSION_ITEM_INT
REQUESTS = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})
UNASKED_S = 0.25
"""An item may go out again, or unasked, only so often."""
ROUNDING_S = 1e-6
LANDING_S = 20.0
"""After this long nothing of the transfer is in the air any more."""
OUTCOMES: dict[type[MavplanError], str] = {
    RefusedError: "refused",
    UncertainError: "uncertain",
    NoLinkError: "no link",
}


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
    """

    firmware: AutopilotName
    faults: str
    items: int
    deadline_s: float
    seed: int
    vehicle: str = ""


@dataclass(frozen=True, slots=True)
class Result:
    """What came of it: ``verified``, ``refused``, ``uncertain``, ``no link``; how long it took; what was wrong."""

    case: Case
    outcome: str
    took_s: float
    words: str
    wrong: tuple[str, ...]


class Listening(UploadSession):
    """The real session, which remembers when it was asked for which item."""

    def __init__(self, mission: Mission, *, now: float, deadline_s: float) -> None:
        super().__init__(mission, now=now, deadline_s=deadline_s)
        self.requests: list[tuple[float, int]] = []

    def receive(self, message: Message, now: float) -> None:
        """Take a message."""
        if message.get_type() in REQUESTS and message.target_system == self.us.system:
            self.requests.append((now, message.seq))
        super().receive(message, now)


class Observed(Radio):
    """A radio that remembers what the vehicle held when it sent its last item to us."""

    def __init__(self, vehicle: Autopilot, faults: str, seed: int) -> None:
        super().__init__(vehicle, parse_faults(faults), seed)
        self.held_at_last_item: tuple[StoredItem, ...] = ()

    def _leave(self, link: Hashable | None, frame: bytes, now: float) -> None:
        if message_id(frame) == ITEM and self.faults.second_gcs:
            seq, _, system = struct.unpack_from("<HHB", frame[10:-2].ljust(37, b"\0"), 28)
            held = self.stored(0)
            if system == GROUND.system and seq == len(held) - 1:
                self.held_at_last_item = held
        super()._leave(link, frame, now)


def run_case(case: Case) -> Result:
    """Run a transfer and judge it."""
    chance = random.Random(case.seed)
    sample = make_sample(case.firmware, case.items, chance, too_low=case.vehicle == "high")
    vehicle = _vehicle(case, chance)
    old = vehicle.stored(0)
    network = Observed(vehicle, case.faults, case.seed)
    session = Listening(sample.mission, now=network.clock_s, deadline_s=case.deadline_s)
    ended = run(session, network)
    outcome = "verified" if session.report is not None else OUTCOMES.get(type(session.error), "")
    outcome = outcome or next(
        (name for kind, name in OUTCOMES.items() if isinstance(session.error, kind)), "fault"
    )
    wrong = [] if outcome != "fault" else [f"ended with {session.error!r}"]
    if isinstance(session.error, InputError):
        wrong.append("the campaign made a mission that cannot be sent")
    if ended.ended_s > case.deadline_s + 1e-3:
        wrong.append(f"outlived its deadline: {ended.ended_s:.3f} s")
    wrong += _untrue(outcome, sample, old, network)
    wrong += flooding(ended.sent, session.requests)
    return Result(case, outcome, ended.ended_s, str(session.error or ""), tuple(wrong))


def _vehicle(case: Case, chance: random.Random) -> Autopilot:
    """Make the vehicle, with another mission on it already."""
    capacity = chance.randrange(1, case.items) if case.vehicle == "small" else None
    stands_m = HOME.alt_amsl_m + (20.0 if case.vehicle == "high" else 0.0)
    home = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, stands_m)
    boot_time_s = chance.uniform(1.0, 15.0) if case.vehicle == "booting" else 0.0
    vehicle = Autopilot(FIRMWARES[case.firmware], home=home, capacity=capacity, boot_time_s=boot_time_s)
    vehicle.vehicle.ready = True
    _put_old_mission(vehicle, chance.choice([0, 3, 20, case.items, case.items + 7]), capacity)
    vehicle.vehicle.ready = boot_time_s == 0
    if case.vehicle == "armed":
        vehicle.vehicle.armed = True
        vehicle.vehicle.base_mode |= common.MAV_MODE_FLAG_SAFETY_ARMED
    return vehicle


def _put_old_mission(vehicle: Autopilot, count: int, capacity: int | None) -> None:
    """Let somebody else have uploaded a mission before."""
    earlier, now = Encoder(201, 190), Radio.clock_s
    count = min(count, 65_535 if capacity is None else capacity)
    vehicle.receive(earlier.encode(common.MAVLink_mission_count_message(1, 1, count, 0)), "earlier", now)
    for seq in range(count):
        place = (HOME.lat_e7 + 1000 * seq, HOME.lon_e7 + 77, 55.0)
        command = 22 if seq == 0 else 16
        item = common.MAVLink_mission_item_int_message(
            1, 1, seq, 3, command, int(seq == 0), 1, 0, 0, 0, 0, *place, 0
        )
        vehicle.receive(earlier.encode(item), "earlier", now)
    vehicle.tick(now + 1e-9)
    vehicle.to_send()
    vehicle.forget("earlier")
    if len(vehicle.stored(0)) != count:
        raise AssertionError("the mission before the campaign's was not stored")


def _untrue(outcome: str, sample: Sample, old: Sequence[StoredItem], network: Observed) -> list[str]:
    """Compare what is claimed with the vehicle's memory, at the end and when all has landed."""
    wrong: list[str] = []
    foreign = network.faults.second_gcs == "upload"
    for when in ("at the end", "when all had landed"):
        held = network.stored(0)
        if outcome == "verified" and not sample.is_held(held):
            # Another station may have written since: then what counts is what was held at the last item sent.
            if not (foreign and sample.is_held(network.held_at_last_item)):
                wrong.append(f"verified, but {when} the vehicle holds something else")
        elif outcome == "refused" and not foreign and not _kept(held, sample, old, network):
            wrong.append(f"refused, but {when} the vehicle does not hold its old mission")
        settle(network, LANDING_S)
    return wrong


def _kept(held: Sequence[StoredItem], sample: Sample, old: Sequence[StoredItem], network: Observed) -> bool:
    if [_but_current(item) for item in held] == [_but_current(item) for item in old]:
        return True
    vehicle = network.autopilot
    judged = vehicle.firmware.name == "px4" and infeasible_because(held, (), vehicle.vehicle.home) is not None
    return judged and sample.is_held(held)


def _but_current(item: StoredItem) -> StoredItem:
    return item.numbered(item.seq, current=0)


def flooding(sent: Sequence[tuple[float, bytes]], requests: Sequence[tuple[float, int]]) -> list[str]:
    """Find items that were sent again, or unasked, sooner than they may be.

    Parameters
    ----------
    sent
        Time and frame of all that was sent.
    requests
        Time and item of every request that arrived.
    """
    last: dict[int, float] = {}
    last_unasked = -UNASKED_S
    coming = iter(sorted(requests))
    following = next(coming, None)
    asked: dict[int, float] = {}
    for at, frame in sent:
        kind = message_id(frame)
        if kind == COUNT:
            last.clear()  # the whole upload started again
        if kind != ITEM:
            continue
        while following is not None and following[0] <= at:
            asked[following[1]] = following[0]
            following = next(coming, None)
        (seq,) = struct.unpack_from("<H", frame[10:-2].ljust(37, b"\0"), 28)
        if seq in last and at - last[seq] < UNASKED_S - ROUNDING_S:
            return [f"item {seq} was sent again after {at - last[seq]:.3f} s"]
        if asked.pop(seq, None) is None:
            if at - last_unasked < UNASKED_S - ROUNDING_S:
                return [f"item {seq} was sent unasked {at - last_unasked:.3f} s after another"]
            last_unasked = at
        last[seq] = at
    return []
