"""The vehicle's side of MAVLink 2 signing: pymavlink's own, without its weakness, and the key's file.

Time stamps begin with this machine's clock and then grow with every message sent and every greater one received, as on
an autopilot without GPS.
"""

import hashlib
import stat
import struct
import time
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock import events

KEY_BYTES = 32
EPOCH_2015_S = 1_420_070_400
STAMPS_PER_S = 100_000


class CheckedMavlink(mavlink.MAVLink):  # type: ignore[misc]  # pymavlink has no types
    """pymavlink's parser; a frame whose signature is wrong leaves the time stamps as they were.

    It knows the messages of `events`, too.
    """

    def decode(self, msgbuf: bytearray) -> Any:
        """Return the message of a whole frame.

        Raises
        ------
        mavlink.MAVError
            Its checksum or its signature is wrong.
        """
        number = int.from_bytes(msgbuf[7:10], "little") if msgbuf[0] == mavlink.PROTOCOL_MARKER_V2 else -1
        if number not in events.FORMATS:
            return super().decode(msgbuf)
        end = 10 + msgbuf[1]
        crc = mavlink.x25crc(bytes(msgbuf[1:end]) + bytes([events.FORMATS[number][1]])).crc
        if bytes(msgbuf[end : end + 2]) != struct.pack("<H", crc):
            raise mavlink.MAVError(f"invalid MAVLink CRC in message {number}")
        system, component = msgbuf[5], msgbuf[6]
        if self.signing.secret_key is not None and not (
            msgbuf[2] & mavlink.MAVLINK_IFLAG_SIGNED and self.check_signature(msgbuf, system, component)
        ):
            raise mavlink.MAVError("Invalid signature")
        message: Any = events.decode(number, bytes(msgbuf[10:end]))
        message._header = mavlink.MAVLink_header(
            number, mlen=msgbuf[1], seq=msgbuf[4], srcSystem=system, srcComponent=component
        )
        message._msgbuf = msgbuf
        return message

    def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:
        """Return whether a frame is signed with the key and newer than the last of its stream.

        pymavlink takes the stamp of a forged frame for its stream's last, which shuts the right sender out; the
        autopilots, by MAVLink's C library, test the signature first.
        """
        before = dict(self.signing.stream_timestamps)
        good = bool(super().check_signature(msgbuf, srcSystem, srcComponent))
        if not good:
            self.signing.stream_timestamps = before
        return good


def wall_time() -> int:
    """Return this machine's time in units of 10 µs since 2015."""
    return int((time.time() - EPOCH_2015_S) * STAMPS_PER_S)


def make_signing(key: bytes, timestamp: int) -> Any:
    """Return what makes an encoder sign and a parser check, shared by all links of a vehicle.

    Parameters
    ----------
    key
        32 bytes.
    timestamp
        The first time stamp, in units of 10 µs since 2015.
    """
    signing = mavlink.MAVLinkSigning()
    signing.secret_key = key
    signing.timestamp = timestamp
    signing.sign_outgoing = True
    return signing


def signature(frame: bytes, signing: Any) -> bytes:
    """Return link id, time stamp and signature that follow a frame, and count the stamp on."""
    tail = struct.pack("<BQ", signing.link_id, signing.timestamp)[:7]
    signing.timestamp += 1
    return tail + hashlib.sha256(signing.secret_key + frame + tail).digest()[:6]


def read_key(path: str) -> bytes:
    """Read a key file.

    Raises
    ------
    ValueError
        With a sentence: no such file, not of mode 0600, neither 32 bytes nor 64 hexadecimal digits.
    """
    try:
        info = Path(path).stat()
        if not stat.S_ISREG(info.st_mode):
            raise ValueError(f"{path} is no file with a key")
        if info.st_mode & 0o777 != 0o600:
            raise ValueError(f"{path} has mode {info.st_mode & 0o777:04o}; a key needs 0600")
        with Path(path).open("rb") as stream:
            content = stream.read(200)
    except OSError as wrong:
        raise ValueError(f"{path} cannot be read: {wrong.strerror or wrong}") from None
    if len(content) == KEY_BYTES:
        return content
    try:
        key = bytes.fromhex(content.decode("ascii"))
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError(f"{path} holds neither 32 bytes nor 64 hexadecimal digits")
    return key
