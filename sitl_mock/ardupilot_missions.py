"""ArduPilot's manners of mission transfer, as measured on ArduCopter 4.7.0-dev.

Each list has its own upload, shared by all links. A mission upload is not atomic: COUNT truncates the stored
mission and every item is written as it comes, so whatever breaks off leaves a mixture. A download has no state.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass

from sitl_mock import ardupilot_items as rules
from sitl_mock.ardupilot_lists import FenceList, MissionList, RallyList
from sitl_mock.firmware import Firmware
from sitl_mock.items import MissionType, RefusedItemError, Result, StoredItem
from sitl_mock.missions import (
    SEVERITY_WARNING,
    Ack,
    Count,
    Item,
    MissionStatus,
    Partner,
    Reply,
    Request,
    Text,
)
from sitl_mock.vehicle import VehicleState

GUIDED_CURRENT = frozenset({2, 3})
"""``current`` of an item that is no mission item but an order to fly there at once."""


@dataclass(slots=True)
class _Upload:
    partner: Partner
    next_seq: int
    last_seq: int
    last_item_s: float
    last_request_s: float
    warned_of_float: bool = False


class ArduPilotMissions:
    """ArduPilot's `MissionKeeper`.

    Parameters
    ----------
    firmware
        Times; its capacities are not used.
    vehicle
        Read for home, ready and what is being flown; its current item is reset by a new mission.
    capacity
        Greatest COUNT taken, by mission type; the mission's with home.
    """

    def __init__(self, firmware: Firmware, vehicle: VehicleState, capacity: Mapping[int, int]) -> None:
        self._firmware = firmware
        self._vehicle = vehicle
        self._capacity = capacity
        self._lists: dict[int, RallyList] = {
            MissionType.MISSION: MissionList(vehicle),
            MissionType.FENCE: FenceList(),
            MissionType.RALLY: RallyList(),
        }
        self._uploads: dict[int, _Upload] = {}
        self.revision = 0

    def on_count(self, sender: Partner, count: int, mission_type: int, now: float) -> list[Reply]:
        """COUNT truncates at once; the same sender may start again, another is denied."""
        if mission_type not in self._lists:
            return [Ack(sender, Result.UNSUPPORTED, mission_type)]
        running = self._uploads.get(mission_type)
        if running is not None and running.partner != sender:
            return [Ack(sender, Result.DENIED, mission_type)]
        capacity = self._capacity[mission_type] if self._vehicle.ready else 0
        if count > capacity:
            text = f"Only {capacity} items are supported"
            return [Ack(sender, Result.NO_SPACE, mission_type), Text(SEVERITY_WARNING, text, sender.link)]
        self._lists[mission_type].begin(count)
        if count == 0:
            return self._finish(sender, mission_type)
        self._uploads[mission_type] = _Upload(sender, 0, count - 1, now, now)
        return [Request(sender, 0, mission_type, as_int=False)]

    def on_item(  # noqa: PLR0911 - one return a rule
        self, sender: Partner, item: StoredItem, mission_type: int, now: float, *, as_int: bool
    ) -> list[Reply]:
        """Only the requested item is taken; a duplicate gets INVALID_SEQUENCE and the upload goes on."""
        if mission_type not in self._lists:
            return [Ack(sender, Result.UNSUPPORTED, mission_type)]
        if mission_type == MissionType.MISSION and item.current in GUIDED_CURRENT:
            return [Ack(sender, self._guided(item), mission_type)]
        upload = self._uploads.get(mission_type)
        if upload is None:
            return [Ack(sender, Result.ERROR, mission_type)]
        if sender != upload.partner:
            return [Ack(sender, Result.DENIED, mission_type)]
        texts: list[Reply] = []
        if not as_int and not upload.warned_of_float:
            upload.warned_of_float = True
            texts.append(Text(SEVERITY_WARNING, "got MISSION_ITEM; use MISSION_ITEM_INT!", sender.link))
        if item.seq != upload.next_seq:
            return [Ack(sender, Result.INVALID_SEQUENCE, mission_type), *texts]
        try:
            self._lists[mission_type].put(item, upload.last_seq)
        except RefusedItemError as refusal:
            del self._uploads[mission_type]
            return [Ack(sender, refusal.result, mission_type), *texts]
        upload.next_seq += 1
        upload.last_item_s = now
        if upload.next_seq > upload.last_seq:
            return [*self._finish(sender, mission_type), *texts]
        upload.last_request_s = now
        return [Request(sender, upload.next_seq, mission_type, as_int=False), *texts]

    @staticmethod
    def _guided(item: StoredItem) -> Result:
        try:
            rules.keep_mission_item(item)
        except RefusedItemError as refusal:
            return refusal.result
        return Result.ERROR  # only a vehicle flying in GUIDED would go there

    def _finish(self, sender: Partner, mission_type: int) -> list[Reply]:
        self._uploads.pop(mission_type, None)
        result, texts = self._lists[mission_type].finish()
        self.revision += mission_type == MissionType.MISSION
        if mission_type == MissionType.MISSION and not self._vehicle.mission_running:
            self._vehicle.current_seq = 0
            self._vehicle.mission_finished = False
        return [Ack(sender, result, mission_type), *texts]

    def on_request_list(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """LIST is answered unless an upload of this list is running, be it the same station's."""
        if mission_type not in self._lists:
            return [Ack(sender, Result.UNSUPPORTED, mission_type)]
        if mission_type in self._uploads:
            return [Ack(sender, Result.DENIED, mission_type)]
        return [Count(sender, self._lists[mission_type].count(), mission_type)]

    def on_request(
        self,
        sender: Partner,
        seq: int,
        mission_type: int,
        now: float,
        *,
        as_int: bool,
    ) -> list[Reply]:
        """Serve an item whether LIST came before or not; home even from an empty mission."""
        if mission_type not in self._lists:
            return [Ack(sender, Result.UNSUPPORTED, mission_type)]
        if mission_type in self._uploads:
            return [Ack(sender, Result.DENIED, mission_type)]
        item = self._lists[mission_type].read(seq)
        if item is None:
            return [Ack(sender, Result.INVALID_SEQUENCE, mission_type)]
        return [Item(sender, item.numbered(seq, current=0), mission_type, as_int)]

    def on_ack(self, sender: Partner, result: int, mission_type: int, now: float) -> list[Reply]:
        """Nothing a client says in an ACK matters: not even OPERATION_CANCELLED ends an upload."""
        return []

    def on_clear_all(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """Clear one list; never all at once, and not the mission while it is flown."""
        if mission_type not in self._lists:
            return [Ack(sender, Result.UNSUPPORTED, mission_type)]
        upload = self._uploads.get(mission_type)
        if upload is not None:
            error = Ack(sender, Result.ERROR, mission_type)
            return [error] if sender == upload.partner else [Ack(sender, Result.DENIED, mission_type), error]
        if not self._lists[mission_type].clear():
            return [Ack(sender, Result.ERROR, mission_type)]
        if mission_type == MissionType.MISSION:
            self._vehicle.current_seq = 0
            self._vehicle.mission_finished = False
        return [Ack(sender, Result.ACCEPTED, mission_type)]

    def on_set_current(self, sender: Partner, seq: int, now: float) -> list[Reply]:
        """Go on with another item, if there is one."""
        if 0 <= seq < self._lists[MissionType.MISSION].count():
            self._vehicle.current_seq = seq
        return []

    def tick(self, now: float) -> list[Reply]:
        """Repeat a request after a second of silence; give up after eight without a good item."""
        replies: list[Reply] = []
        for mission_type, upload in list(self._uploads.items()):
            if now >= upload.last_item_s + self._firmware.upload_timeout_s:
                del self._uploads[mission_type]
                text = self._lists[mission_type].timeout_text
                replies.append(Ack(upload.partner, Result.OPERATION_CANCELLED, mission_type))
                replies.append(Text(SEVERITY_WARNING, text, upload.partner.link))
            elif now >= upload.last_request_s + self._firmware.request_retry_s:
                upload.last_request_s = now
                replies.append(Request(upload.partner, upload.next_seq, mission_type, as_int=False))
        return replies

    def next_timer(self) -> float | None:
        """Return when the next request is repeated or an upload given up."""
        if not self._uploads:
            return None
        due = [
            min(
                upload.last_item_s + self._firmware.upload_timeout_s,
                upload.last_request_s + self._firmware.request_retry_s,
            )
            for upload in self._uploads.values()
        ]
        return min(due, default=None)

    def stored(self, mission_type: int) -> list[StoredItem]:
        """Return the list as it reads back, the mission with home as item 0."""
        items = (self._lists[mission_type].read(seq) for seq in range(self._lists[mission_type].count()))
        return [item.numbered(seq, current=0) for seq, item in enumerate(items) if item is not None]

    def size(self) -> int:
        """Return how many items the mission has, with home."""
        return self._lists[MissionType.MISSION].count()

    def item(self, seq: int) -> StoredItem | None:
        """Return an item of the mission."""
        item = self._lists[MissionType.MISSION].read(seq) if 0 <= seq < self.size() else None
        return None if item is None else item.numbered(seq, current=0)

    def flyable(self) -> bool:
        """Return whether there is more than home."""
        return self.size() > 1

    def status(self) -> MissionStatus:
        """Total is the number of items without home; state 1 none, 2 waiting, 3 flown, 5 finished."""
        count = self._lists[MissionType.MISSION].count()
        if count <= 1:
            state = 1
        elif self._vehicle.mission_running:
            state = 3
        else:
            state = 5 if self._vehicle.mission_finished else 2
        mode = 1 if self._vehicle.in_mission_mode else 2
        return MissionStatus(self._vehicle.current_seq, max(count - 1, 0), state, mode)

    def forget(self, link: Hashable) -> None:
        """Nothing is kept of a link: its upload runs to the time-out."""

    def reboot(self) -> None:
        """Lose the uploads; what was written of them stays."""
        self._uploads.clear()
