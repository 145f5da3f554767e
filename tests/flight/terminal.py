"""``mavplan fly`` at a terminal: what it shows, and a hand that types and presses Ctrl-C."""

import contextlib
import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

WAIT_S = 60.0


class Terminal:
    """A running command, all that it has shown, and its keyboard."""

    def __init__(self, process: "subprocess.Popen[bytes]", keyboard: int) -> None:
        self.process = process
        self._keyboard = keyboard
        self.shown = ""

    def until(self, words: str, since: int = 0) -> int:
        """Wait until something is shown; return where it ends."""
        end_s = time.monotonic() + WAIT_S
        while (at := self.shown.find(words, since)) < 0:
            assert time.monotonic() < end_s, f"never shown: {words!r}; shown: {self.shown[-2000:]}"
            assert self._read(0.5) or self.process.poll() is None, f"ended: {self.shown[-2000:]}"
        return at + len(words)

    def type(self, line: str) -> None:
        os.write(self._keyboard, f"{line}\n".encode())

    def interrupt(self) -> None:
        self.process.send_signal(signal.SIGINT)

    def code(self) -> int:
        """Wait for the end."""
        end_s = time.monotonic() + WAIT_S
        while self.process.poll() is None:
            assert time.monotonic() < end_s, f"never ended: {self.shown[-2000:]}"
            self._read(0.2)
        self._read(0.1)
        return self.process.returncode

    def _read(self, timeout_s: float) -> bool:
        if not select.select([self._keyboard], [], [], timeout_s)[0]:
            return False
        try:
            data = os.read(self._keyboard, 65_536)
        except OSError:
            time.sleep(0.05)
            return False
        self.shown += data.decode(errors="replace")
        return bool(data)


@contextlib.contextmanager
def at_terminal(*arguments: object, folder: Path) -> Iterator[Terminal]:
    """Run mavplan with a terminal at all its ends."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "mavplan", *(str(argument) for argument in arguments)]
    environment = {**os.environ, "COLUMNS": "140", "LINES": "50", "TERM": "xterm"}
    with subprocess.Popen(
        command, cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        try:
            yield Terminal(process, ours)
        finally:
            if process.poll() is None:
                process.kill()
            os.close(ours)
