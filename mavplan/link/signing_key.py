"""A signing key's file, and the file beside it that keeps the last time stamp: `open_signing`."""

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from mavplan.errors import InputError, Problem
from mavplan.formats.atomic import atomic_write
from mavplan.link.signing import KEY_BYTES, MAX_TIMESTAMP, Signing

MODE = 0o600
_MOST_BYTES = 4 * KEY_BYTES


@contextlib.contextmanager
def open_signing(path: Path | None) -> Iterator[Signing | None]:
    """Read a key and its last time stamp; keep the last time stamp in the end.

    Parameters
    ----------
    path
        The key's file; None: no signing.

    Raises
    ------
    InputError
        The file is no key, others may read it, or the time stamp beside it cannot be read or kept.
    """
    if path is None:
        yield None
        return
    key = read_key(path)
    beside = timestamp_file(path)
    kept = 0

    def keep(stamp: int) -> None:
        nonlocal kept
        atomic_write(beside, f"{stamp}\n")
        kept = stamp

    signing = Signing(key, last=read_timestamp(beside), keep=keep)
    signing.reserve()
    try:
        yield signing
    finally:
        # Another process that uses the key may have kept a later one. A disk that has become full meanwhile must not
        # hide what became of the vehicle; the reserve that is kept there is later than any stamp that was used.
        with contextlib.suppress(InputError):
            if read_timestamp(beside) == kept:
                atomic_write(beside, f"{signing.timestamp}\n")


def timestamp_file(path: Path) -> Path:
    """Return where the last time stamp of a key is kept."""
    return path.with_name(f"{path.name}.timestamp")


def read_key(path: Path) -> bytes:
    """Return the 32 bytes of a key file.

    Raises
    ------
    InputError
        There is no such file, its mode is not 0600, or it holds neither 32 bytes nor 64 hexadecimal digits. What it
        holds is never in the message.
    """
    try:
        # A pipe must not hold us up.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb") as stream:
            info = os.fstat(descriptor)
            if not stat.S_ISREG(info.st_mode):
                raise _bad(path, "is no ordinary file")
            mode = stat.S_IMODE(info.st_mode)
            if mode != MODE:
                raise _bad(
                    path,
                    f"has mode {mode:04o}, where a key needs {MODE:04o}: chmod 600, and make a new key "
                    "if others have read it",
                )
            content = stream.read(_MOST_BYTES + 1)
    except OSError as error:
        raise _bad(path, f"cannot be read: {error.strerror or error}") from error
    return _key_in(path, content)


def _key_in(path: Path, content: bytes) -> bytes:
    key = content
    if len(content) != KEY_BYTES:
        digits = content.strip()
        if len(digits) != 2 * KEY_BYTES or not all(digit in b"0123456789abcdefABCDEF" for digit in digits):
            size = (
                f"{len(content)} bytes" if len(content) <= _MOST_BYTES else f"more than {_MOST_BYTES} bytes"
            )
            raise _bad(path, f"holds {size}; a key is 32 raw bytes or 64 hexadecimal digits")
        key = bytes.fromhex(digits.decode("ascii"))
    if not any(key):
        raise _bad(path, "holds a key of zeros, which MAVLink takes for none")
    return key


def read_timestamp(path: Path) -> int:
    """Return the time stamp in a file, 0 where there is no file.

    Raises
    ------
    InputError
        It cannot be read, or is no time stamp.
    """
    try:
        text = path.read_bytes()[:100].strip()
    except FileNotFoundError:
        return 0
    except OSError as error:
        raise _bad(path, f"cannot be read: {error.strerror or error}") from error
    stamp = int(text) if text.isdigit() and len(text) <= 15 else -1
    if not 0 <= stamp <= MAX_TIMESTAMP:
        raise _bad(
            path,
            "holds no time stamp of a signing key; remove it if this machine's clock is right",
        )
    return stamp


def _bad(path: Path, why: str) -> InputError:
    return InputError([Problem(f"signing key {path}", why, "signing-key")])
