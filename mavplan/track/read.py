"""Any log to a `Track`: which format it is shows in its content, its name is only a hint for what to say."""

from collections.abc import Callable
from pathlib import Path

from mavplan.errors import InputError, Problem
from mavplan.track.model import Track

MAX_BYTES = 4 * 1024**3
"""A log larger than this is not read."""

SUFFIXES = (".tlog", ".bin", ".ulg", ".csv")
_LOOK = 65_536
"""Bytes in which the first frame of a tlog must begin for it to be told by its content."""


def read_track(path: Path, system: int | None = None) -> Track:
    """Read a flight from a ``.tlog``, an ArduPilot ``.bin``, a PX4 ``.ulg`` or CSV.

    Parameters
    ----------
    path
        The log.
    system
        MAVLink system of the vehicle, where a tlog holds several.

    Raises
    ------
    InputError
        It cannot be read, or nothing in it can be used.
    """
    label = str(path)
    try:
        if path.is_file() and path.stat().st_size > MAX_BYTES:
            message = f"has {path.stat().st_size:,} bytes; at most {MAX_BYTES:,} are read"
            raise InputError([Problem(label, message, "too-large")])
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError([Problem(label, "there is no such file", "missing-file")]) from error
    except IsADirectoryError as error:
        raise InputError([Problem(label, "is a folder, not a file", "unreadable")]) from error
    except (OSError, ValueError) as error:
        message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
        raise InputError([Problem(label, message, "unreadable")]) from error
    return parse_track(data, label, path.suffix.lower(), system)


def parse_track(data: bytes, label: str, suffix: str = "", system: int | None = None) -> Track:
    """Return the flight in a log's bytes; ``suffix`` decides only where the content does not.

    Raises
    ------
    InputError
        Nothing in it can be used.
    """
    if not data:
        raise InputError([Problem(label, "is empty", "empty")])
    reader = _reader_of(data, suffix)
    if reader is None:
        message = f"is none of the logs that can be read: {', '.join(SUFFIXES)}"
        raise InputError([Problem(label, message, "format")])
    return reader(data, label, system)


_Reader = Callable[[bytes, str, int | None], Track]


def _reader_of(data: bytes, suffix: str) -> _Reader | None:
    """Return what reads this content."""
    from mavplan.track.dataflash import HEAD
    from mavplan.track.ulog import MAGIC

    if data.startswith(MAGIC):
        return _ulg
    if data.startswith(HEAD):
        return _bin
    if _has_frame(data[:_LOOK]):
        return _tlog
    if _is_text(data[:_LOOK]):
        return _csv
    return {".tlog": _tlog, ".bin": _bin, ".ulg": _ulg, ".csv": _csv}.get(suffix)


def _has_frame(data: bytes) -> bool:
    from mavplan.track.tlog import TlogFrames

    return next(iter(TlogFrames(data)), None) is not None


def _is_text(data: bytes) -> bool:
    """Return whether this is text with a line that could be a header."""
    line = data.split(b"\n", 1)[0]
    return b"\0" not in data and any(name in line for name in (b"lat_deg", b"time_s"))


def _tlog(data: bytes, label: str, system: int | None) -> Track:
    from mavplan.track.telemetry import read_tlog

    return read_tlog(data, label, system)


def _bin(data: bytes, label: str, _system: int | None) -> Track:
    from mavplan.track.dataflash import read_bin

    return read_bin(data, label)


def _ulg(data: bytes, label: str, _system: int | None) -> Track:
    from mavplan.track.ulog import read_ulg

    return read_ulg(data, label)


def _csv(data: bytes, label: str, _system: int | None) -> Track:
    from mavplan.track.track_csv import read_track_csv

    return read_track_csv(data, label)
