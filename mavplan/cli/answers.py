"""Questions to a person that nothing waits for: a line is taken from the terminal when there is one."""

import os
import select
import sys

END_OF_INPUT = "\x04"
"""What stands for nobody being there any more."""
CHUNK = 4096


class Answers:
    """Lines that a person types on standard input, one at a time, as they come."""

    def __init__(self) -> None:
        self._typed = b""
        self._ended = False

    def forget(self) -> None:
        """Drop what was typed before the question was asked."""
        while self._more():
            pass
        self._typed = b""

    def line(self) -> str | None:
        """Return the next whole line without its end; None: there is none yet; `END_OF_INPUT`: there will be none."""
        while b"\n" not in self._typed and self._more():
            pass
        if b"\n" in self._typed:
            line, _, self._typed = self._typed.partition(b"\n")
            return line.decode(errors="replace").strip()
        return END_OF_INPUT if self._ended else None

    def _more(self) -> bool:
        """Take what is there now; whether there was anything."""
        try:
            # Not by sys.stdin, which may have read more than it shows: a line in its buffer is none to select.
            number = sys.stdin.fileno()
            if self._ended or not select.select([number], [], [], 0)[0]:
                return False
            data = os.read(number, CHUNK)
        except (OSError, ValueError, AttributeError):
            data = b""
        self._typed += data
        self._ended = not data
        return bool(data)
