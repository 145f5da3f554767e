"""PX4's manners of mission transfer, as measured on PX4 main of 2025-08-18.

Every link has one transfer at a time, whatever the list; the lists are shared. An upload is atomic: it goes into
a second store and takes the first one's place with its last item. Whether the mission can be flown is judged
after the ACK. A download keeps the link busy until the client acknowledges it.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from sitl_mock.feasibility import reasons
from sitl_mock.firmware import Firmware
from sitl_mock.items import STORED_TYPES, MissionType, RefusedItemError, Result, StoredItem
from sitl_mock.missions import (
    SEVERITY_CRITICAL,
    SEVERITY_INFO,
    Ack,
    Count,
    Event,
    Item,
    MissionStatus,
    Partner,
    Reply,
    Request,
    Text,
)
from sitl_mock.px4_items import checksum, keep_item
from sitl_mock.vehicle import VehicleState

NO_ITEM = 65535
"""``total`` of an empty mission, and ``seq`` before the vehicle has looked at a new one."""


def _critical(text: str) -> Text:
    return Text(SEVERITY_CRITICAL, text + "\t")


@dataclass(slots=True)
class _Link:
    """One link's transfer. What an old transfer left behind is looked at by late messages, as on the vehicle."""

    state: Literal["idle", "uploading", "downloading"] = "idle"
    partner: Partner | None = None
    mission_type: int = MissionType.MISSION
    seq: int = 0
    count: int = 0
    current_seq: int | None = None
    checksum: int = 0
    items: list[StoredItem] = field(default_factory=list)
    as_int: bool = True
    last_received_s: float = 0.0
    last_sent_s: float = 0.0


class Px4Missions:
    """PX4's `MissionKeeper`.

    Parameters
    ----------
    firmware
        Times; its capacities are not used.
    vehicle
        Read for home and for what is being flown; its current item is set by a new mission.
    capacity
        Greatest COUNT taken, by mission type.
    """

    def __init__(self, firmware: Firmware, vehicle: VehicleState, capacity: Mapping[int, int]) -> None:
        self._firmware = firmware
        self._vehicle = vehicle
        self._capacity = capacity
        self._lists: dict[int, list[StoredItem]] = {kind: [] for kind in STORED_TYPES}
        self._ids: dict[int, int] = dict.fromkeys(STORED_TYPES, 0)
        self._links: dict[Hashable, _Link] = {}
        self._uploading: _Link | None = None
        self._feasible = False
        self._judge_at: float | None = None
        self._new_seq: int | None = None
        self.revision = 0

    def _link(self, sender: Partner) -> _Link:
        return self._links.setdefault(sender.link, _Link())

    # Upload

    def on_count(  # noqa: PLR0911 - one return a rule
        self, sender: Partner, count: int, mission_type: int, now: float
    ) -> list[Reply]:
        """COUNT while busy is an ERROR; again before item 0 it only repeats the request."""
        link = self._link(sender)
        if link.state == "downloading":
            return [Ack(sender, Result.ERROR, link.mission_type), _critical("WPM: IGN MISSION_COUNT: Busy")]
        if link.state == "uploading":
            link.last_received_s = now
            if sender != link.partner:
                return [Ack(sender, Result.ERROR, link.mission_type)]
            if link.seq > 0:
                return [Ack(sender, Result.ERROR, link.mission_type), _critical("WPM: REJ. CMD: Busy")]
            return [self._request(link, now)]
        if self._uploading is not None:  # over another link
            return [Ack(sender, Result.ERROR, link.mission_type)]
        link.last_received_s = now
        link.partner, link.mission_type, link.checksum = sender, mission_type, 0
        if count > self._capacity.get(mission_type, 0):
            return [Ack(sender, Result.NO_SPACE, mission_type)]
        if count == 0:
            if mission_type in self._lists:
                self._store(mission_type, [], 0, 0, now)
            return [Ack(sender, Result.ACCEPTED, mission_type)]
        link.state, link.seq, link.count, link.current_seq, link.items = "uploading", 0, count, None, []
        self._uploading = link
        return [self._request(link, now)]

    def _request(self, link: _Link, now: float) -> Request:
        assert link.partner is not None
        link.last_sent_s = now
        return Request(link.partner, link.seq, link.mission_type, link.as_int)

    def on_item(  # noqa: PLR0911 - one return a rule
        self, sender: Partner, item: StoredItem, mission_type: int, now: float, *, as_int: bool
    ) -> list[Reply]:
        """Take the requested item and ignore others in silence; the last one again after the end is ACCEPTED."""
        link = self._link(sender)
        link.as_int = as_int
        if sender != link.partner:
            return [_critical("REJ. MIS ITEM: partner id mismatch")]
        if mission_type != link.mission_type:
            return [Ack(sender, Result.ERROR, link.mission_type)]
        if link.state == "idle":
            if item.seq + 1 == link.seq:
                return [Ack(sender, Result.ACCEPTED, link.mission_type, link.checksum)]
            return [Ack(sender, Result.ERROR, link.mission_type), _critical("IGN MISSION_ITEM: No transfer")]
        if link.state == "downloading":
            return [Ack(sender, Result.ERROR, link.mission_type), _critical("IGN MISSION_ITEM: Busy")]
        link.last_received_s = now
        if item.seq != link.seq:
            return []
        try:
            kept = keep_item(item, mission_type, as_int=as_int)
        except RefusedItemError as refusal:
            self._end_upload(link)
            texts = [] if refusal.result == Result.ERROR else [_critical("IGN MISSION_ITEM: Invalid item")]
            return [Ack(sender, refusal.result, mission_type), *texts]
        link.checksum = checksum([item], link.checksum)
        link.items.append(kept)
        if item.current:
            link.current_seq = item.seq
        link.seq += 1
        if link.seq < link.count:
            return [self._request(link, now)]
        if link.checksum != self._ids[mission_type]:
            self._store(mission_type, link.items, link.checksum, link.current_seq, now)
        self._end_upload(link)
        return [Ack(sender, Result.ACCEPTED, mission_type, link.checksum)]

    def _end_upload(self, link: _Link) -> None:
        link.state = "idle"
        if self._uploading is link:
            self._uploading = None

    def _store(
        self, mission_type: int, items: list[StoredItem], list_id: int, current: int | None, now: float
    ) -> None:
        self._lists[mission_type] = items
        self._ids[mission_type] = list_id
        if mission_type == MissionType.MISSION:
            self._new_seq = current
            self.revision += 1
            self._vehicle.mission_finished = False
            if not items:
                self._feasible, self._judge_at, self._vehicle.current_seq = False, None, 0
                return
            if current is not None:
                self._vehicle.current_seq = current
        if self._lists[MissionType.MISSION] and mission_type != MissionType.RALLY:
            self._judge_at = now + self._firmware.verdict_delay_s

    # Download

    def on_request_list(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """LIST starts a download, or starts one's own again; to others and during an upload it is not answered."""
        link = self._link(sender)
        if link.state == "downloading" and link.seq == len(self._lists.get(link.mission_type, [])):
            link.state = "idle"  # all was sent; only the client's ACK is missing
        own = link.partner == sender and link.mission_type == mission_type
        if link.state == "uploading" or (link.state == "downloading" and not own):
            return [Text(SEVERITY_INFO, "Mission download request ignored, already active\t")]
        count = len(self._lists.get(mission_type, []))
        link.state, link.partner, link.mission_type, link.seq, link.count = (
            "downloading",
            sender,
            mission_type,
            0,
            count,
        )
        link.last_received_s = link.last_sent_s = now
        return [Count(sender, count, mission_type, self._ids.get(mission_type, 0))]

    def on_request(  # noqa: PLR0911 - one return a rule
        self, sender: Partner, seq: int, mission_type: int, now: float, *, as_int: bool
    ) -> list[Reply]:
        """Serve the next item or the same again; any other request ends the download."""
        link = self._link(sender)
        link.as_int = as_int
        if sender != link.partner:
            return [_critical("WPM: REJ. CMD: partner id mismatch")]
        if link.state == "idle":
            return []
        if link.state == "uploading":
            return [_critical("WPM: REJ. CMD: Busy")]
        if mission_type != link.mission_type:
            return []
        link.last_received_s = now
        items = self._lists.get(mission_type, [])
        if seq == link.seq and link.seq < link.count:
            link.seq += 1
        elif seq != link.seq - 1 or seq >= len(items):
            link.state = "idle"
            return [
                Ack(sender, Result.ERROR, mission_type),
                _critical("WPM: REJ. CMD: Req. WP was unexpected"),
            ]
        if seq >= len(items):  # another link has cleared or replaced the list
            link.state = "idle"
            return [
                Ack(sender, Result.ERROR, mission_type),
                _critical("WPM: REJ. CMD: Req. WP was unexpected"),
            ]
        return [Item(sender, self._read(mission_type, seq), mission_type, as_int)]

    def _read(self, mission_type: int, seq: int) -> StoredItem:
        current = mission_type == MissionType.MISSION and seq == self._vehicle.current_seq
        return self._lists[mission_type][seq].numbered(seq, current=int(current))

    def on_ack(self, sender: Partner, result: int, mission_type: int, now: float) -> list[Reply]:
        """End the download; OPERATION_CANCELLED ends the upload, UNSUPPORTED asks in the other format."""
        link = self._link(sender)
        if sender != link.partner:
            return [_critical("REJ. WP CMD: partner id mismatch")]
        if link.state == "downloading" and mission_type == link.mission_type:
            link.state = "idle"
        elif link.state == "uploading" and result == Result.OPERATION_CANCELLED:
            self._end_upload(link)
        elif link.state == "uploading" and result == Result.UNSUPPORTED:
            link.as_int = not link.as_int
            return [self._request(link, now)]
        return []

    # The rest

    def on_clear_all(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """Clear one list or all; not answered while a transfer is running."""
        link = self._link(sender)
        if link.state != "idle":
            return [_critical("WPM: IGN CLEAR CMD: Busy")]
        link.mission_type = mission_type
        for kind in STORED_TYPES:
            if mission_type in {kind, MissionType.ALL}:
                self._store(kind, [], 0, 0, now)
        return [Ack(sender, Result.ACCEPTED, mission_type)]

    def on_set_current(self, sender: Partner, seq: int, now: float) -> list[Reply]:
        """Go on with another item, if there is one and nothing is being transferred."""
        if self._link(sender).state != "idle":
            return [_critical("WPM: IGN WP CURR CMD: Busy")]
        if seq >= len(self._lists[MissionType.MISSION]):
            return [_critical("WPM: WP CURR CMD: Not in list")]
        self._vehicle.current_seq = seq
        return []

    def tick(self, now: float) -> list[Reply]:
        """Repeat requests, give up silent transfers, judge a new mission."""
        replies: list[Reply] = []
        for link in self._links.values():
            timeout = self._timeout_s(link)
            if link.state == "idle" or timeout is None:
                continue
            if now >= link.last_received_s + timeout:
                self._end_upload(link)
                replies.append(_critical("Operation timeout"))
            elif link.state == "uploading" and now >= link.last_sent_s + self._firmware.request_retry_s:
                replies.append(self._request(link, now))
        if self._judge_at is not None and now >= self._judge_at:
            replies.extend(self._judge())
        return replies

    def _timeout_s(self, link: _Link) -> float | None:
        if link.state == "idle":
            return None
        uploading = link.state == "uploading"
        return self._firmware.upload_timeout_s if uploading else self._firmware.download_timeout_s

    def _judge(self) -> list[Reply]:
        self._judge_at = None
        mission = self._lists[MissionType.MISSION]
        if self._new_seq is None and self._vehicle.current_seq >= len(mission):
            self._vehicle.current_seq = 0  # without a current flag the old index is kept where it exists
        self._new_seq = self._vehicle.current_seq
        found = reasons(mission, self._lists[MissionType.FENCE], self._vehicle.home)
        self._feasible = not found
        replies: list[Reply] = []
        for reason in found:
            if reason.in_text:
                replies.append(_critical(reason.words))
            replies.append(Event(reason.event, reason.levels, reason.arguments))
        return replies

    def next_timer(self) -> float | None:
        """Return when a request is repeated, a transfer given up or a mission judged."""
        due = [] if self._judge_at is None else [self._judge_at]
        for link in self._links.values():
            timeout = self._timeout_s(link)
            if timeout is not None:
                due.append(link.last_received_s + timeout)
                if link.state == "uploading":
                    due.append(link.last_sent_s + self._firmware.request_retry_s)
        return min(due, default=None)

    def stored(self, mission_type: int) -> list[StoredItem]:
        """Return the list as it reads back."""
        return [self._read(mission_type, seq) for seq in range(len(self._lists[mission_type]))]

    def size(self) -> int:
        """Return how many items the mission has."""
        return len(self._lists[MissionType.MISSION])

    def item(self, seq: int) -> StoredItem | None:
        """Return an item of the mission."""
        items = self._lists[MissionType.MISSION]
        return items[seq].numbered(seq, current=0) if 0 <= seq < len(items) else None

    def flyable(self) -> bool:
        """Return whether the mission was judged to be flyable."""
        return self._feasible and self.size() > 0

    def status(self) -> MissionStatus:
        """State 1: none or infeasible, 2 waiting, 3 flown, 4 paused, 5 finished; before the verdict the old one."""
        count = len(self._lists[MissionType.MISSION])
        vehicle = self._vehicle
        if count == 0 or not self._feasible:
            state = 1
        elif vehicle.mission_finished:
            state = 5
        elif vehicle.mission_running:
            state = 3
        else:
            state = 4 if vehicle.current_seq > 0 and vehicle.armed else 2
        unseen = self._judge_at is not None and self._new_seq is None
        seq = NO_ITEM if unseen else vehicle.current_seq
        mode = 1 if vehicle.in_mission_mode else 2
        mission, fence, rally = (self._ids[kind] for kind in STORED_TYPES)
        return MissionStatus(seq, count or NO_ITEM, state, mode, (mission, fence, rally))

    def forget(self, link: Hashable) -> None:
        """Drop a link unless it still has a transfer to time out of."""
        known = self._links.get(link)
        if known is not None and known.state == "idle":
            del self._links[link]

    def reboot(self) -> None:
        """Transfers are lost, the lists stay; the mission is judged again from its beginning."""
        self._links.clear()
        self._uploading = None
        self._feasible = False
        self._judge_at = 0.0 if self._lists[MissionType.MISSION] else None
        self._vehicle.current_seq = 0
