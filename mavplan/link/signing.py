"""MAVLink 2 signing: who may be believed on a link, by a key that both ends hold. No files; `signing_key` has those.

A signed frame ends in a link id, a time stamp and six bytes of a SHA-256 over the key and everything before them
(https://mavlink.io/en/guide/message_signing.html). What is not signed with our key, or is signed with an old time
stamp, is dropped and counted. The key itself is never sent: SETUP_SIGNING does not exist here.
"""

import hashlib
import hmac
import struct
import time
from collections import Counter
from collections.abc import Callable
from enum import Enum

from pymavlink.dialects.v20 import common

from mavplan.errors import InputError

KEY_BYTES = 32
UNITS_PER_S = 100_000
"""Time stamps count 10 µs."""
EPOCH_S = 1_420_070_400
"""They begin on 1 January 2015, 0:00 UTC, in Unix time."""
MAX_TIMESTAMP = (1 << 48) - 1
"""Of 48 bits: the year 2104."""
OLD = 60 * UNITS_PER_S
"""A frame whose stamp is further behind ours is refused."""
RESERVE = 10 * UNITS_PER_S
"""Stamps are kept so far ahead, so that none is given twice even if the program is killed."""

_V2 = 0xFD
_FLAGS = 2
_SIGNED = 0x01
_HEADER = 10
_SIGNATURE = 13


class Signature(Enum):
    """What is found of a frame's signature."""

    GOOD = "good"
    MISSING = "without a signature"
    WRONG = "with a wrong signature"
    OLD = "with an old time stamp"


def timestamp_now() -> int:
    """Return this machine's time as a stamp."""
    return max(0, int((time.time() - EPOCH_S) * UNITS_PER_S))


class Signing:
    """One key on one link: signs what is sent, judges what is received.

    Parameters
    ----------
    key
        32 bytes.
    last
        The last time stamp that was used with this key, in an earlier run too.
    link_id
        Our link's number; one per key and way to a vehicle.
    clock
        This machine's time as a stamp.
    keep
        Called with a time stamp before any stamp from there on is given out.

    Raises
    ------
    ValueError
        The key is not 32 bytes long.
    """

    def __init__(
        self,
        key: bytes,
        *,
        last: int = 0,
        link_id: int = 0,
        clock: Callable[[], int] = timestamp_now,
        keep: Callable[[int], None] = lambda _: None,
    ) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self.link_id = link_id
        self.timestamp = last
        """The greatest stamp that was given out or accepted."""
        self.dropped: Counter[Signature] = Counter()
        """Frames that were not believed."""
        self._key = key
        self._clock = clock
        self._keep = keep
        self._kept = last
        self._streams: dict[tuple[int, int, int], int] = {}

    def __repr__(self) -> str:
        """Without the key."""
        return f"Signing(link_id={self.link_id}, timestamp={self.timestamp})"

    def reserve(self) -> None:
        """Keep a time stamp ahead of those that are given out next.

        Raises
        ------
        InputError
            No stamps are left: the last one was in the year 2104.
        """
        ahead = max(self.timestamp, self._clock()) + RESERVE
        if ahead > MAX_TIMESTAMP:
            raise InputError(
                "the time stamps of this signing key are used up: one of the year 2104 was used with it; make a new key"
            )
        self._keep(ahead)
        self._kept = ahead

    def sign(self, frame: bytes, crc_extra: int) -> bytes:
        """Return an unsigned MAVLink 2 frame as a signed one.

        Parameters
        ----------
        frame
            A whole frame.
        crc_extra
            The checksum seed of its message: the flag of a signed frame is covered by the checksum.
        """
        stamp = max(self._clock(), self.timestamp + 1)
        if stamp >= self._kept:
            self.timestamp = stamp
            self.reserve()
        self.timestamp = stamp
        body = bytearray(frame[:-2])
        body[_FLAGS] |= _SIGNED
        crc = common.x25crc(bytes(body[1:]) + bytes([crc_extra])).crc
        body += struct.pack("<HB", crc, self.link_id) + stamp.to_bytes(6, "little")
        return bytes(body) + self._digest(bytes(body))

    def accepts(self, frame: bytes, message_id: int) -> bool:
        """Whether a frame, its checksum tested, may be believed; else it is counted in ``dropped``.

        RADIO_STATUS is believed without a signature: telemetry radios put it in and hold no key.
        """
        found = self.judge(frame)
        if found is Signature.MISSING and message_id == common.MAVLINK_MSG_ID_RADIO_STATUS:
            return True
        if found is not Signature.GOOD:
            self.dropped[found] += 1
        return found is Signature.GOOD

    def judge(self, frame: bytes) -> Signature:
        """Return what a frame's signature is worth; a good one moves the clock of its stream on.

        A stream is a system, a component and a link id. Its stamps must grow, and none may be more than a minute
        behind ours. Only a right signature changes anything: a forged stamp cannot shut the vehicle out.
        """
        if len(frame) < _HEADER + 2 + _SIGNATURE or frame[0] != _V2 or not frame[_FLAGS] & _SIGNED:
            return Signature.MISSING
        if not hmac.compare_digest(self._digest(frame[:-6]), frame[-6:]):
            return Signature.WRONG
        stamp = int.from_bytes(frame[-12:-6], "little")
        stream = (frame[5], frame[6], frame[-13])
        if stamp <= self._streams.get(stream, -1) or stamp + OLD < max(self._clock(), self.timestamp):
            return Signature.OLD
        self._streams[stream] = stamp
        self.timestamp = max(self.timestamp, stamp)
        return Signature.GOOD

    def dropped_words(self) -> str:
        """Return for instance ``12 frames without a signature and 3 with a wrong one were dropped``; or nothing."""
        parts = [f"{self.dropped[kind]} {kind.value}" for kind in Signature if self.dropped[kind]]
        if not parts:
            return ""
        listed = f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]
        number, rest = listed.split(" ", 1)
        one = sum(self.dropped.values()) == 1
        return f"{number} {'frame' if one else 'frames'} {rest} {'was' if one else 'were'} dropped"

    def _digest(self, body: bytes) -> bytes:
        return hashlib.sha256(self._key + body).digest()[:6]
