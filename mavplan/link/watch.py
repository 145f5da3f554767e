"""What goes on around a transfer: restarts of the vehicle, other stations' mission traffic, its texts and events.

No I/O.
"""

import re
from collections import Counter

from mavplan.link.event_log import EventLog
from mavplan.link.protocol import Address, Message, MissionType, Result, sender

CLOCK_SLIP_S = 3.0
"""A clock that jumps back by more is a restart; less can be the link's reordering."""
KEPT_TEXTS = 20
ALL_TYPES = 255
"""MAV_MISSION_TYPE_ALL, of a CLEAR_ALL."""
WARNING = 4
"""MAV_SEVERITY: this and below is worse."""

_SPACE = re.compile(r"Only (\d+) items are supported")
_WRITES = frozenset(
    {"MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST"}
)
_REQUESTS = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})


class Watch:
    """Keeps an eye on one vehicle.

    Parameters
    ----------
    vehicle, us
        The two addresses.
    """

    def __init__(self, vehicle: Address, us: Address) -> None:
        self.vehicle = vehicle
        self.us = us
        self.heard_at: float | None = None
        """When the vehicle was last heard."""
        self.reboots = 0
        """Restarts of the vehicle that were noticed."""
        self.mission_type = int(MissionType.MISSION)
        """The list that `foreign_writes` and `foreign_signs` are about."""
        self.writes: Counter[int] = Counter()
        """Messages of another station's writing to the vehicle, by MAV_MISSION_TYPE."""
        self._denials: Counter[int] = Counter()
        self.armed = False
        self.texts: list[str] = []
        """STATUSTEXTs of severity WARNING and worse, oldest first."""
        self.texts_heard = 0
        """How many of those there were in all; the oldest are forgotten."""
        self.events = EventLog(us)
        """PX4's events."""
        self.uptime_s = 0.0
        """The vehicle's clock as last heard."""
        self.space: int | None = None
        """Number of items the vehicle last said it has room for."""
        self._text_id = 0

    @property
    def foreign_writes(self) -> int:
        """Messages of another station's writing this list to the vehicle."""
        return self.writes[self.mission_type]

    @property
    def foreign_signs(self) -> int:
        """The same, and refusals that another station got: it may try again."""
        return self.signs_of(self.mission_type)

    def signs_of(self, mission_type: int) -> int:
        """Return as `foreign_signs`, of any list."""
        return self.writes[mission_type] + self._denials[mission_type]

    def texts_since(self, heard: int) -> list[str]:
        """Return the texts that came after so many of them had been heard, as far as they are kept."""
        new = min(len(self.texts), self.texts_heard - heard)
        return self.texts[len(self.texts) - new :]

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        kind = message.get_type()
        if sender(message) != self.vehicle:
            self._on_stranger(message, kind)
            return
        self.heard_at = now
        self._watch_clock(message, kind)
        self.events.receive(message, now)
        if kind == "HEARTBEAT":
            self.armed = bool(message.base_mode & 0x80)
        elif kind == "STATUSTEXT":
            self._on_text(message)
        elif kind in _REQUESTS | {"MISSION_ACK"} and not self._is_for_us(message):
            self._on_answer_to_stranger(message, kind)

    def _is_for_us(self, message: Message) -> bool:
        return message.target_system in {0, self.us.system} and message.target_component in {
            0,
            self.us.component,
        }

    def _on_answer_to_stranger(self, message: Message, kind: str) -> None:
        if kind in _REQUESTS or message.type == Result.ACCEPTED:
            self._wrote(message.mission_type)
        elif message.type == Result.DENIED:
            self._denials[message.mission_type] += 1

    def _on_stranger(self, message: Message, kind: str) -> None:
        if kind not in _WRITES or message.target_system not in {0, self.vehicle.system}:
            return
        self._wrote(message.mission_type)

    def _wrote(self, mission_type: int) -> None:
        self.writes.update(MissionType if mission_type == ALL_TYPES else (mission_type,))

    def _watch_clock(self, message: Message, kind: str) -> None:
        uptime_s = _uptime_s(message, kind)
        if uptime_s is None:
            return
        if uptime_s < self.uptime_s - CLOCK_SLIP_S:
            self.reboots += 1
            self.events.vehicle_restarted()
            self.uptime_s = uptime_s
        self.uptime_s = max(self.uptime_s, uptime_s)

    def _on_text(self, message: Message) -> None:
        text = str(message.text).rstrip("\t\r\n")
        if space := _SPACE.search(text):
            self.space = int(space[1])
        if message.severity > WARNING:
            return
        if message.id and message.id == self._text_id and message.chunk_seq and self.texts:
            self.texts[-1] += text
        elif not self.texts or self.texts[-1] != text:
            self.texts.append(text)
            self.texts_heard += 1
        self._text_id = message.id
        del self.texts[:-KEPT_TEXTS]


def _uptime_s(message: Message, kind: str) -> float | None:
    """Seconds since the vehicle's start, where a message says so."""
    if kind == "TIMESYNC":
        # A request of its own (tc1 is 0) carries its uptime in nanoseconds; an answer carries our time.
        return float(message.ts1) / 1e9 if message.tc1 == 0 else None
    boot_ms = getattr(message, "time_boot_ms", None)
    return float(boot_ms) / 1e3 if boot_ms is not None else None
