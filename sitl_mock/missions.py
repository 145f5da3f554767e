"""The vehicle's side of a mission transfer, without I/O: what goes in, what comes out, who it is with.

The two firmwares differ too much for one machine with switches, so each has its own, `ardupilot_missions` and
`px4_missions`; both are a `MissionKeeper`. Time is an argument, in seconds of any steady clock.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Protocol

from sitl_mock.items import Result, StoredItem

SEVERITY_CRITICAL, SEVERITY_WARNING, SEVERITY_NOTICE, SEVERITY_INFO, SEVERITY_DEBUG = 2, 4, 5, 6, 7


@dataclass(frozen=True, slots=True)
class Partner:
    """Who a message came from: the link it came over, and the sender's ids."""

    link: Hashable
    system: int
    component: int


@dataclass(frozen=True, slots=True)
class Ack:
    """MISSION_ACK; `opaque_id` goes out as its extension field where it is not 0."""

    to: Partner
    result: Result
    mission_type: int
    opaque_id: int = 0


@dataclass(frozen=True, slots=True)
class Request:
    """MISSION_REQUEST_INT, or the older MISSION_REQUEST."""

    to: Partner
    seq: int
    mission_type: int
    as_int: bool


@dataclass(frozen=True, slots=True)
class Count:
    """MISSION_COUNT; `opaque_id` goes out as its extension field where it is not 0."""

    to: Partner
    count: int
    mission_type: int
    opaque_id: int = 0


@dataclass(frozen=True, slots=True)
class Item:
    """MISSION_ITEM_INT, or the older MISSION_ITEM."""

    to: Partner
    item: StoredItem
    mission_type: int
    as_int: bool


@dataclass(frozen=True, slots=True)
class Text:
    """STATUSTEXT, to one link or (None) to all."""

    severity: int
    text: str
    link: Hashable | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """EVENT, to all links: its name, its log levels and its packed arguments."""

    name: str
    levels: int
    arguments: bytes = b""


@dataclass(frozen=True, slots=True)
class Reached:
    """MISSION_ITEM_REACHED, to all."""

    seq: int


Reply = Ack | Request | Count | Item | Text | Event | Reached


@dataclass(frozen=True, slots=True)
class MissionStatus:
    """What MISSION_CURRENT says: fields of that message, and the ids of the three lists (0: not sent)."""

    seq: int
    total: int
    state: int
    mode: int
    ids: tuple[int, int, int] = (0, 0, 0)


class MissionKeeper(Protocol):
    """A firmware's mission, fence and rally lists and its manners of transferring them.

    Every call returns the replies in the order in which the vehicle sends them.
    """

    revision: int
    """Another number with every mission that is stored."""

    def on_count(self, sender: Partner, count: int, mission_type: int, now: float) -> list[Reply]:
        """MISSION_COUNT: somebody wants to upload."""

    def on_item(
        self, sender: Partner, item: StoredItem, mission_type: int, now: float, *, as_int: bool
    ) -> list[Reply]:
        """MISSION_ITEM_INT or MISSION_ITEM."""

    def on_request_list(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """MISSION_REQUEST_LIST: somebody wants to download."""

    def on_request(
        self, sender: Partner, seq: int, mission_type: int, now: float, *, as_int: bool
    ) -> list[Reply]:
        """MISSION_REQUEST_INT or MISSION_REQUEST."""

    def on_ack(self, sender: Partner, result: int, mission_type: int, now: float) -> list[Reply]:
        """MISSION_ACK from a ground station."""

    def on_clear_all(self, sender: Partner, mission_type: int, now: float) -> list[Reply]:
        """MISSION_CLEAR_ALL."""

    def on_set_current(self, sender: Partner, seq: int, now: float) -> list[Reply]:
        """MISSION_SET_CURRENT."""

    def tick(self, now: float) -> list[Reply]:
        """Repeat, give up, judge: whatever is due by now."""

    def next_timer(self) -> float | None:
        """Return when `tick` has something to do next, or None."""

    def stored(self, mission_type: int) -> Sequence[StoredItem]:
        """Return the list as it reads back."""

    def size(self) -> int:
        """Return how many items the mission has."""

    def item(self, seq: int) -> StoredItem | None:
        """Return an item of the mission with its number, None where there is none."""

    def flyable(self) -> bool:
        """Return whether there is a mission that may be flown."""

    def status(self) -> MissionStatus:
        """Return the fields of MISSION_CURRENT."""

    def forget(self, link: Hashable) -> None:
        """Drop what is known of a link that is gone; a transfer in progress runs to its time-out."""

    def reboot(self) -> None:
        """Lose what a power cycle loses: transfers, not lists."""
