"""Bytes to messages and back: MAVLink framing that finds its way again after corruption; the fields are pymavlink's.

pymavlink's own parser swallows as many bytes as a damaged length says, good frames among them. Here a frame that
fails its checksum costs one byte, and the search goes on behind it.
"""

from typing import Any

from pymavlink.dialects.v20 import common

from mavplan.link.event_messages import LAYOUTS, read_frame
from mavplan.link.protocol import GROUND, Address, Message
from mavplan.link.signing import Signing

_V1, _V2 = 0xFE, 0xFD
_HEADER = {_V1: 6, _V2: 10}
_CHECKSUM = 2
_SIGNATURE = 13
_SIGNED = 0x01
_STALE_S = 0.5


class Codec:
    """One side of one link: keeps the unfinished end of what was received, and the number of what was sent.

    Parameters
    ----------
    us
        System and component in what we send.
    signing
        With a key everything sent is signed, and what is not signed with it is dropped, and counted there.
    """

    def __init__(self, us: Address = GROUND, signing: Signing | None = None) -> None:
        self._mavlink: Any = common.MAVLink(None, srcSystem=us.system, srcComponent=us.component)
        self._buffer = bytearray()
        self._arrivals: list[tuple[int, float]] = []
        """End of what came together, counted from the buffer's start, and when it came."""
        self.bad = 0
        """Frames and stretches of bytes that were thrown away."""
        self.signing = signing
        self.signed = 0
        """Signed frames that came, whether or not they could be judged."""

    def encode(self, message: Message) -> bytes:
        """Return the message as a MAVLink 2 frame, numbered in sequence.

        Raises
        ------
        struct.error
            A value does not fit its field; `mavplan.mission.wire.wire_problems` finds those in a mission.
        """
        frame = bytes(message.pack(self._mavlink))
        if self.signing is not None:
            frame = self.signing.sign(frame, message.crc_extra)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return frame

    def decode(self, data: bytes, now: float) -> list[Message]:
        """Return the messages that are complete with these bytes; damaged and unknown ones are left out.

        Parameters
        ----------
        data
            What was received, cut anywhere.
        now
            Seconds on any steady clock: an unfinished frame that stays so for half a second is given up.
        """
        self._buffer += data
        if data:
            self._arrivals.append((len(self._buffer), now))
        messages: list[Message] = []
        start = 0
        while start < len(self._buffer):
            length = self._frame_length(start)
            if length is None:
                if now - next(at for end, at in self._arrivals if end > start) < _STALE_S:
                    break
                length = 0  # the rest never came: look for a frame inside what did
            message = self._read(start, length) if length else None
            if message is None:
                start = self._next_marker(start + 1)
                self.bad += 1
                continue
            frame = bytes(self._buffer[start : start + length])
            start += length
            if not isinstance(message, common.MAVLink_unknown) and self._is_believed(frame, message):
                messages.append(message)
        del self._buffer[:start]
        self._arrivals = [(end - start, at) for end, at in self._arrivals if end > start]
        return messages

    def _is_believed(self, frame: bytes, message: Any) -> bool:
        self.signed += frame[0] == _V2 and frame[2] & _SIGNED
        return self.signing is None or self.signing.accepts(frame, message.get_msgId())

    def _frame_length(self, start: int) -> int | None:
        """Whole length of the frame that begins here; 0 if none does, None if its end is still to come."""
        buffer = self._buffer
        header = _HEADER.get(buffer[start])
        if header is None:
            return 0
        if len(buffer) - start < 3:
            return None
        length = header + buffer[start + 1] + _CHECKSUM
        if buffer[start] == _V2:
            if buffer[start + 2] & ~_SIGNED:
                return 0
            length += _SIGNATURE if buffer[start + 2] & _SIGNED else 0
        return length if len(buffer) - start >= length else None

    def _message_id(self, start: int) -> int:
        at, size = (start + 7, 3) if self._buffer[start] == _V2 else (start + 5, 1)
        return int.from_bytes(self._buffer[at : at + size], "little")

    def _read(self, start: int, length: int) -> Any:
        end = start + length
        message_id = self._message_id(start)
        if message_id in LAYOUTS:
            return read_frame(message_id, bytes(self._buffer[start:end]))
        try:
            message = self._mavlink.decode(self._buffer[start:end])
        except common.MAVError:
            return None
        if isinstance(message, common.MAVLink_unknown):
            # Its checksum cannot be tested. Believe it only where another frame follows at once, and none is inside.
            followed = end == len(self._buffer) or self._buffer[end] in _HEADER
            return message if followed and not self._hides_a_frame(start + 1, end) else None
        return message

    def _hides_a_frame(self, start: int, end: int) -> bool:
        """Whether a good frame of a known message lies in this stretch of bytes."""
        while (start := self._next_marker(start)) < end:
            length = self._frame_length(start)
            if length and start + length <= end and self._is_known(start, length):
                return True
            start += 1
        return False

    def _is_known(self, start: int, length: int) -> bool:
        frame = self._buffer[start : start + length]
        if (message_id := self._message_id(start)) in LAYOUTS:
            return read_frame(message_id, bytes(frame)) is not None
        try:
            return not isinstance(self._mavlink.decode(frame), common.MAVLink_unknown)
        except common.MAVError:
            return False

    def _next_marker(self, start: int) -> int:
        found = [at for marker in _HEADER if (at := self._buffer.find(marker, start)) >= 0]
        return min(found, default=len(self._buffer))
