"""The errors that mavplan raises, and the exit code each of them means.

::

    MavplanError            1  a fault of ours
    ├── InputError          2  files, values or usage that cannot be taken; carries every problem found
    ├── NoLinkError         3  no vehicle answers
    ├── RefusedError        4  refused: the vehicle provably keeps its old mission (or judges the new one infeasible),
    │                          or stays on the ground
    ├── UncertainError      5  nobody knows what the vehicle holds now, or how a flight ended
    └── CheckError          6  a check, a verification or a proof found something wrong, a flight ended otherwise

A message says what is wrong, where, and what to do; the command line prints it without a traceback.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal


class ExitCode(IntEnum):
    """Exit codes of every mavplan command."""

    DONE = 0
    FAULT = 1
    BAD_INPUT = 2
    NO_LINK = 3
    REFUSED = 4
    UNCERTAIN = 5
    CHECK_FAILED = 6


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, said in one sentence.

    Attributes
    ----------
    where
        File and place in it, for instance ``users.csv, row 3, column lat_deg``.
    message
        The value that was found and what is allowed.
    code
        Short stable name for scripts and tests, for instance ``out-of-range``.
    severity
        ``error`` stops the work, ``warning`` is only told.
    """

    where: str
    message: str
    code: str
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        """``where: message``."""
        return f"{self.where}: {self.message}" if self.where else self.message


class MavplanError(Exception):
    """Base of the family; raised itself only for faults of our own."""

    exit_code = ExitCode.FAULT


class InputError(MavplanError):
    """Files, values or usage that cannot be taken: all problems that were found, raised once."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, problems: Iterable[Problem] | str) -> None:
        found = (Problem("", problems, "usage"),) if isinstance(problems, str) else tuple(problems)
        self.problems: tuple[Problem, ...] = found
        super().__init__("\n".join(str(problem) for problem in found))


class NoLinkError(MavplanError):
    """No vehicle answers on this connection."""

    exit_code = ExitCode.NO_LINK


class SilentLinkError(NoLinkError):
    """The connection is open, and nothing at all was heard on it."""


class RefusedError(MavplanError):
    """The mission was refused and the vehicle provably keeps its old one, or judges the new one infeasible."""

    exit_code = ExitCode.REFUSED


class UncertainError(MavplanError):
    """Nobody knows what the vehicle holds: a mixture, a failed read-back or a broken transfer."""

    exit_code = ExitCode.UNCERTAIN


class CheckError(MavplanError):
    """A check, a verification or a proof found something wrong."""

    exit_code = ExitCode.CHECK_FAILED
