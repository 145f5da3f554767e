"""A recording of a flight as it goes: every frame of both directions into a ``.tlog`` that no crash of ours can take.

Each frame is handed to the operating system at once. A file that is there is never written over, and a disk that is
full ends the recording and not the flight.
"""

import contextlib
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from mavplan.errors import InputError, Problem
from mavplan.track.tlog import record


def recording_path(mission_file: Path, at: datetime) -> Path:
    """Return where a flight is recorded: ``out/valley.plan`` → ``out/valley.20250818T143005Z.tlog``.

    Parameters
    ----------
    mission_file
        What is flown.
    at
        When, in UTC.
    """
    return mission_file.with_name(f"{mission_file.stem}.{at:%Y%m%dT%H%M%SZ}.tlog")


class Recording:
    """A ``.tlog`` that is being written; a context manager.

    Parameters
    ----------
    path
        A file that is not there yet.

    Raises
    ------
    InputError
        It is there, or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames = 0
        """Frames written."""
        self.failed = ""
        """Why it ended early, or empty."""
        try:
            self._file = path.open("xb", buffering=0)
        except FileExistsError as error:
            message = "is there already: a recording is never written over; name another file with --record"
            raise InputError([Problem(str(path), message, "exists")]) from error
        except OSError as error:
            message = (
                f"the recording cannot be made: {error.strerror or error}; name another file with --record"
            )
            raise InputError([Problem(str(path), message, "unwritable")]) from error

    def write(self, time_us: int, frame: bytes) -> None:
        """Write a frame; see `mavplan.flight.run.Recorder`."""
        if self.failed:
            return
        data = record(time_us, frame)
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            self.failed = error.strerror or str(error)
            return
        self.frames += 1

    def discard(self) -> None:
        """Take the file away: nothing happened that is worth keeping."""
        self._file.close()
        with contextlib.suppress(OSError):
            self.path.unlink()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._file.close()
