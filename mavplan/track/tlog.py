"""The ``.tlog`` format, written and read: 8 bytes of big-endian microseconds, then one MAVLink frame, again and again.

Frames in, frames out; what their messages mean for a flight is `mavplan.track.telemetry`'s. Reading forgives what
logs suffer from: a cut end, foreign bytes between records, damaged frames.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

_TIME = struct.Struct(">Q")
_V1, _V2 = 0xFE, 0xFD
_MARKER = re.compile(b"[\xfd\xfe]")
_SIGNED = 0x01
_CHECKSUM = 2
_SIGNATURE = 13


def record(time_us: int, frame: bytes) -> bytes:
    """Return one record of a ``.tlog``: what stands in the file for a frame sent or received at this time.

    Parameters
    ----------
    time_us
        Microseconds since 1970 (UTC), as ground stations write them.
    frame
        A whole MAVLink 1 or 2 frame, its signature included.
    """
    return _TIME.pack(time_us) + frame


class Frame(NamedTuple):
    """One frame of a log; the payload is as it stood there, MAVLink 2's trailing zeros may be missing."""

    time_us: int
    message_id: int
    system: int
    component: int
    payload: bytes


@dataclass(slots=True)
class Losses:
    """What of a log could not be used.

    Attributes
    ----------
    skipped_bytes
        Bytes that belong to no good frame.
    stretches
        How many such places there are.
    cut_bytes
        Bytes of an unfinished record at the end.
    """

    skipped_bytes: int = 0
    stretches: int = 0
    cut_bytes: int = 0


@dataclass(slots=True)
class TlogFrames:
    """The good frames of a log in their order, once: an iterator that knows afterwards what it had to leave out."""

    data: bytes
    losses: Losses = field(default_factory=Losses)

    def __iter__(self) -> Iterator[Frame]:
        """Give every frame whose checksum is right; those of unknown messages are stepped over."""
        data, losses = self.data, self.losses
        at, bad_from = 0, None
        while at < len(data):
            start = at + _TIME.size
            found = _frame_at(data, start)
            if found is None:
                bad_from = at if bad_from is None else bad_from
                at = _next_start(data, at + 1)
                continue
            if bad_from is not None:
                losses.skipped_bytes += at - bad_from
                losses.stretches += 1
                bad_from = None
            frame, end = found
            if frame is not None:
                yield Frame(_TIME.unpack_from(data, at)[0], *frame)
            at = end
        if bad_from is not None and _is_cut(data, bad_from):
            losses.cut_bytes = len(data) - bad_from
        elif bad_from is not None:
            losses.skipped_bytes += len(data) - bad_from
            losses.stretches += 1


_Found = tuple[int, int, int, bytes]


def _frame_at(data: bytes, start: int) -> tuple[_Found | None, int] | None:
    """Return the frame that begins here and where it ends; no frame but an end where its message is not known."""
    sizes = _sizes_at(data, start)
    if sizes is None:
        return None
    header, payload, length = sizes
    end = start + length
    if end > len(data):
        return None
    if header == 10:
        system, component = data[start + 5], data[start + 6]
        message_id = int.from_bytes(data[start + 7 : start + 10], "little")
    else:
        system, component, message_id = data[start + 3 : start + 6]
    crc_extra = _crc_extras().get(message_id)
    body_end = start + header + payload
    if crc_extra is None:
        # Its checksum cannot be tested. Believed only where the log goes on behind it as a log does.
        return (None, end) if end == len(data) or _sizes_at(data, end + _TIME.size) else None
    crc = _crc(data[start + 1 : body_end] + bytes((crc_extra,)))
    if crc != int.from_bytes(data[body_end : body_end + _CHECKSUM], "little"):
        return None
    return (message_id, system, component, data[start + header : body_end]), end


def _sizes_at(data: bytes, start: int) -> tuple[int, int, int] | None:
    """Return the lengths of header, payload and whole of the frame that seems to begin here."""
    if start + 3 > len(data):
        return None
    marker, payload = data[start], data[start + 1]
    if marker == _V1:
        return 6, payload, 6 + payload + _CHECKSUM
    if marker != _V2 or data[start + 2] & ~_SIGNED:
        return None
    signature = _SIGNATURE if data[start + 2] & _SIGNED else 0
    return 10, payload, 10 + payload + _CHECKSUM + signature


def _is_cut(data: bytes, at: int) -> bool:
    """Return whether a record begins here and the log ends in the middle of it."""
    start = at + _TIME.size
    if len(data) - start < 3:
        return len(data) <= start or data[start] in (_V1, _V2)
    sizes = _sizes_at(data, start)
    return sizes is not None and start + sizes[2] > len(data)


def _next_start(data: bytes, at: int) -> int:
    """Return where the next record may begin at the earliest, judged by the frame's first byte; the end if nowhere."""
    found = _MARKER.search(data, at + _TIME.size)
    return found.start() - _TIME.size if found else len(data)


def _crc(data: bytes) -> int:
    from pymavlink.dialects.v20 import common

    crc: int = common.x25crc(data).crc
    return crc


@cache
def _crc_extras() -> dict[int, int]:
    from pymavlink.dialects.v20 import common

    return {number: kind.crc_extra for number, kind in common.mavlink_map.items()}
