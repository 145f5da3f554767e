"""Recordings of real autopilots: 8 bytes of microseconds, then a frame, both directions."""

import struct
from pathlib import Path

from mavplan.link.codec import Codec
from mavplan.link.protocol import Message


def frames_of(path: Path) -> list[tuple[float, bytes]]:
    """Time in seconds from the first, and the frame."""
    data = path.read_bytes()
    frames = []
    at = 0
    while at + 8 < len(data):
        (micros,) = struct.unpack(">Q", data[at : at + 8])
        at += 8
        length = 12 + data[at + 1] + (13 if data[at + 2] & 1 else 0)
        frames.append((micros / 1e6, data[at : at + length]))
        at += length
    start = frames[0][0]
    return [(time - start, frame) for time, frame in frames]


def messages_of(path: Path) -> list[Message]:
    """All messages of a recording that the dialect knows."""
    return [message for _, frame in frames_of(path) for message in Codec().decode(frame, 0.0)]
