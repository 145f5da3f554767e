"""EVENT and its three companions as messages, for pymavlink's dialect does not know them. No state, no I/O.

https://mavlink.io/en/services/events.html. What PX4's events mean is in `px4_events`, which of them were heard in
`event_log`.
"""

import struct
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common

from mavplan.link.protocol import Address, Message

EVENT_ID, CURRENT_EVENT_SEQUENCE_ID, REQUEST_EVENT_ID, RESPONSE_EVENT_ERROR_ID = 410, 411, 412, 413
_HEADER = {0xFE: 6, 0xFD: 10}


@dataclass(frozen=True, slots=True)
class Layout:
    """How a message travels: name, checksum seed, and the fields with their types in the order of the payload."""

    name: str
    crc_extra: int
    types: str
    fields: tuple[str, ...]


LAYOUTS: dict[int, Layout] = {
    EVENT_ID: Layout(
        "EVENT",
        160,
        "<IIHBBB40s",
        (
            "id",
            "event_time_boot_ms",
            "sequence",
            "destination_component",
            "destination_system",
            "log_levels",
            "arguments",
        ),
    ),
    CURRENT_EVENT_SEQUENCE_ID: Layout("CURRENT_EVENT_SEQUENCE", 106, "<HB", ("sequence", "flags")),
    REQUEST_EVENT_ID: Layout(
        "REQUEST_EVENT", 33, "<HHBB", ("first_sequence", "last_sequence", "target_system", "target_component")
    ),
    RESPONSE_EVENT_ERROR_ID: Layout(
        "RESPONSE_EVENT_ERROR",
        77,
        "<HHBBB",
        ("sequence", "sequence_oldest_available", "target_system", "target_component", "reason"),
    ),
}
"""By message id."""


class EventMessage(common.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """One of the four, as if the dialect had it.

    Parameters
    ----------
    message_id
        A key of `LAYOUTS`.
    values
        Its fields in the order of the payload.
    """

    def __init__(self, message_id: int, values: tuple[Any, ...]) -> None:
        self._layout = LAYOUTS[message_id]
        super().__init__(message_id, self._layout.name)
        self.crc_extra = self._layout.crc_extra
        self._fieldnames = list(self._layout.fields)
        for name, value in zip(self._layout.fields, values, strict=True):
            setattr(self, name, value)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """Return the frame."""
        payload = struct.pack(self._layout.types, *(getattr(self, name) for name in self._layout.fields))
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


def read_frame(message_id: int, frame: bytes) -> Message | None:
    """Return the message of a whole frame, or None where its checksum is wrong.

    Parameters
    ----------
    message_id
        A key of `LAYOUTS`.
    frame
        Its length is that of its header, its payload, its checksum and, where its flag says so, its signature.
    """
    layout = LAYOUTS[message_id]
    start = _HEADER[frame[0]]
    end = start + frame[1]
    (crc,) = struct.unpack("<H", frame[end : end + 2])
    if common.x25crc(frame[1:end] + bytes([layout.crc_extra])).crc != crc:
        return None
    size = struct.calcsize(layout.types)
    message: Any = EventMessage(
        message_id, struct.unpack(layout.types, frame[start:end].ljust(size, b"\0")[:size])
    )
    system, component = (frame[5], frame[6]) if frame[0] == common.PROTOCOL_MARKER_V2 else frame[3:5]
    message._header = common.MAVLink_header(
        message_id, mlen=frame[1], srcSystem=system, srcComponent=component
    )
    message._msgbuf = bytearray(frame)
    message._crc = crc
    found: Message = message
    return found


def request_event(to: Address, first_sequence: int, last_sequence: int) -> Message:
    """Return REQUEST_EVENT: send these events again, both ends included."""
    made: Message = EventMessage(REQUEST_EVENT_ID, (first_sequence, last_sequence, to.system, to.component))
    return made
