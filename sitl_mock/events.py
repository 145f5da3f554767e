"""PX4's events: their ids, the last twenty of them, and the four messages of their protocol, which pymavlink lacks.

https://mavlink.io/en/services/events.html. Every event goes once to every link, numbered; a station that missed some
asks for them. The numbers begin shortly before 65,536, as on the vehicle, so that they soon wrap.
"""

import struct
from collections import deque
from types import MappingProxyType
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

EVENT, CURRENT_SEQUENCE, REQUEST, ERROR = 410, 411, 412, 413
FIRST_SEQUENCE = 65_525
KEPT = 20
RESET = 1
"""Flag of CURRENT_EVENT_SEQUENCE: no event has happened yet."""
LEVEL_ERROR = 3

FORMATS = MappingProxyType(
    {
        EVENT: (
            "EVENT",
            160,
            "<IIHBBB40s",
            "id event_time_boot_ms sequence destination_component destination_system log_levels arguments",
        ),
        CURRENT_SEQUENCE: ("CURRENT_EVENT_SEQUENCE", 106, "<HB", "sequence flags"),
        REQUEST: (
            "REQUEST_EVENT",
            33,
            "<HHBB",
            "first_sequence last_sequence target_system target_component",
        ),
        ERROR: (
            "RESPONSE_EVENT_ERROR",
            77,
            "<HHBBB",
            "sequence sequence_oldest_available target_system target_component reason",
        ),
    }
)
"""Name, checksum seed, layout and fields, by message id."""


class EventMessage(mavlink.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """One of the four messages; ``values`` in the order of the payload."""

    def __init__(self, number: int, values: tuple[Any, ...]) -> None:
        name, self.crc_extra, self._layout, fields = FORMATS[number]
        super().__init__(number, name)
        self._fieldnames = fields.split()
        for field, value in zip(self._fieldnames, values, strict=True):
            setattr(self, field, value)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """Return the frame."""
        payload = struct.pack(self._layout, *(getattr(self, field) for field in self._fieldnames))
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


def decode(number: int, payload: bytes) -> EventMessage:
    """Return the message of a payload, which may have lost zero bytes at its end."""
    layout = FORMATS[number][2]
    size = struct.calcsize(layout)
    return EventMessage(number, struct.unpack(layout, payload.ljust(size, b"\0")[:size]))


def event_id(name: str) -> int:
    """Return the id of an event: 24 bits of the FNV-1a hash of its name, behind the autopilot's component, 1."""
    state = 2_166_136_261
    for letter in name.encode():
        state = (state ^ letter) * 16_777_619 % 2**32
    return 0x0100_0000 + state % 2**24


class EventBuffer:
    """The events of one vehicle since its start, as far as they are kept."""

    def __init__(self) -> None:
        self._kept: deque[EventMessage] = deque(maxlen=KEPT)
        self._latest = FIRST_SEQUENCE

    def add(self, name: str, levels: int, arguments: bytes, uptime_s: float) -> EventMessage:
        """Return a new event, numbered, as it is sent to everybody."""
        self._latest = (self._latest + 1) % 2**16
        values = (
            event_id(name),
            int(uptime_s * 1000),
            self._latest,
            0,
            0,
            levels,
            arguments.ljust(40, b"\0"),
        )
        event = EventMessage(EVENT, values)
        self._kept.append(event)
        return event

    def current(self) -> EventMessage:
        """Return CURRENT_EVENT_SEQUENCE."""
        return EventMessage(CURRENT_SEQUENCE, (self._latest, 0 if self._kept else RESET))

    def answer(self, first: int, last: int, system: int, component: int) -> list[EventMessage]:
        """Return what answers REQUEST_EVENT: each event again, or that it is not there any more."""
        kept = {event.sequence: event for event in self._kept}
        answers: list[EventMessage] = []
        count = (last - first + 1) % 2**16
        if count > KEPT:
            answers.append(self._gone(first, system, component))
            first, count = (last - KEPT + 1) % 2**16, KEPT
        for number in ((first + step) % 2**16 for step in range(count)):
            answers.append(kept[number] if number in kept else self._gone(number, system, component))
        return answers

    def _gone(self, number: int, system: int, component: int) -> EventMessage:
        later = [(event.sequence - number) % 2**16 for event in self._kept if event.sequence != number]
        oldest = (number + min(later)) % 2**16 if later else self._latest
        return EventMessage(ERROR, (number, oldest, system, component, 0))
