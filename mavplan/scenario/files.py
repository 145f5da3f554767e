"""Reading a file that a stranger made: whatever is wrong with it becomes a problem, never a traceback."""

import stat
from pathlib import Path

from mavplan.errors import Problem
from mavplan.scenario.report import Report, figure


def read_text(path: Path, label: str, limit_bytes: int, report: Report) -> str | None:
    """Return the text of a UTF-8 file, with or without a byte order mark; None with a problem noted.

    Parameters
    ----------
    path, label
        The file, and what to call it in problems.
    limit_bytes
        Larger files are refused unread.
    report
        Takes the problem.
    """
    data = read_bytes(path, label, limit_bytes, report)
    return None if data is None else decode(data, label, report)


def read_bytes(path: Path, label: str, limit_bytes: int, report: Report) -> bytes | None:
    """Return the content of a file; None with a problem noted. Parameters as for `read_text`."""
    try:
        fault = file_fault(path, limit_bytes)
        if fault is not None:
            report.error(label, fault, "unreadable")
            return None
        return path.read_bytes()
    except FileNotFoundError:
        report.error(label, "there is no such file", "missing-file")
        return None
    except OSError as error:
        report.error(label, f"cannot be read: {error.strerror or error}", "unreadable")
        return None


def decode(data: bytes, label: str, report: Report) -> str | None:
    """Return the text of UTF-8 bytes, with or without a byte order mark; None with a problem noted."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        report.add(_encoding_problem(data, label, error.start))
        return None


def file_fault(path: Path, limit_bytes: int | None = None) -> str | None:
    """Return why a file is not even opened, if there is a reason.

    Raises
    ------
    OSError
        It is not there, or may not be looked at.
    """
    try:
        status = path.stat()
    except ValueError:  # a NUL character in the name
        return "is no name that a file can have"
    if stat.S_ISDIR(status.st_mode):
        return "is a folder, not a file"
    if not stat.S_ISREG(status.st_mode):
        return "is not an ordinary file"
    if limit_bytes is not None and status.st_size > limit_bytes:
        return f"has {figure(status.st_size)} bytes; at most {figure(limit_bytes)} are read"
    return None


def json_fault(error: Exception) -> str:
    """Return why a text is no JSON, in words that do not name the program's insides."""
    if isinstance(error, RecursionError):
        return "it is nested too deep"
    return "a number in it has thousands of digits" if "digits" in str(error) else str(error)


def _encoding_problem(data: bytes, label: str, offset: int) -> Problem:
    """Return the problem of a file in another encoding, with the line of the first byte that is not UTF-8."""
    guess = "; it looks like UTF-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ""
    line = data.count(b"\n", 0, offset) + 1
    message = f"byte 0x{data[offset]:02x} is not UTF-8{guess}; save the file with the encoding UTF-8"
    return Problem(f"{label}, line {line}", message, "encoding")
