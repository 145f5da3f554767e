"""MAVLink 2 bytes: messages to frames, bytes to messages, bytes to frames. pymavlink knows the dialect.

MISSION_ACK, MISSION_COUNT and MISSION_CURRENT have newer extension fields that the dialect does not know; they are
appended to the payload here, which the checksum seed of a message allows.
"""

import struct
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.signing import CheckedMavlink, signature

START_V1, START_V2 = 0xFE, 0xFD
SIGNED = 0x01
MAX_FRAME = 280

Message = Any
"""A message of pymavlink's generated dialect, which has no types."""

Signing = Any
"""pymavlink's MAVLinkSigning, as `sitl_mock.signing.make_signing` fills it in."""


class Encoder:
    """Turns messages into MAVLink 2 frames of one system and component, signed where there is a key."""

    def __init__(self, system_id: int, component_id: int, signing: Signing = None) -> None:
        self.system_id = system_id
        self.component_id = component_id
        self._mav = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._signing = signing
        if signing is not None:
            self._mav.signing = signing

    def encode(self, message: Message, extension: bytes = b"") -> bytes:
        """Return the frame of a message, with the bytes of extension fields behind the ones pymavlink knows."""
        frame = bytes(message.pack(self._mav))
        if extension.rstrip(b"\0"):
            payload = bytes(message.get_payload()).ljust(message.unpacker.size, b"\0") + extension
            frame = self._frame(message.get_msgId(), payload, message.crc_extra)
        self._mav.seq = (self._mav.seq + 1) % 256
        return frame

    def _frame(self, message_id: int, payload: bytes, crc_extra: int) -> bytes:
        payload = payload.rstrip(b"\0") or payload[:1]
        header = struct.pack(
            "<BBBBBBHB",
            len(payload),
            0 if self._signing is None else SIGNED,
            0,
            self._mav.seq,
            self.system_id,
            self.component_id,
            message_id & 0xFFFF,
            message_id >> 16,
        )
        crc = mavlink.x25crc(header + payload + bytes([crc_extra])).crc
        frame = bytes([START_V2]) + header + payload + struct.pack("<H", crc)
        return frame if self._signing is None else frame + signature(frame, self._signing)


class Parser:
    """Turns a link's bytes into messages; whatever is not a whole, good message is dropped.

    With a key whatever is not signed with it is dropped too.
    """

    def __init__(self, signing: Signing = None) -> None:
        self._mav = CheckedMavlink(None)
        if signing is not None:
            self._mav.signing = signing
        self._mav.robust_parsing = True

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages completed by these bytes."""
        messages = self._mav.parse_buffer(data) or []
        return [message for message in messages if message.get_msgId() >= 0]


class Splitter:
    """Turns a link's bytes into frames without looking into them; bytes between frames are dropped."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Return the frames completed by these bytes."""
        buffer = self._rest + data
        frames: list[bytes] = []
        at = 0
        while at < len(buffer):
            if buffer[at] not in {START_V1, START_V2}:
                at += 1
                continue
            size = frame_size(buffer[at : at + 3])
            if size is None or at + size > len(buffer):
                break
            frames.append(buffer[at : at + size])
            at += size
        self._rest = buffer[at:]
        return frames


def frame_size(head: bytes) -> int | None:
    """Return the size of a whole frame from its first three bytes; None while they are not all there."""
    if len(head) < 3:
        return None
    if head[0] == START_V1:
        return head[1] + 8
    return head[1] + 12 + (13 if head[2] & SIGNED else 0)


def message_id(frame: bytes) -> int:
    """Return the message id of a whole frame."""
    return frame[5] if frame[0] == START_V1 else frame[7] | frame[8] << 8 | frame[9] << 16
