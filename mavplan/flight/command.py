"""One command to a vehicle until it is answered: its copies with their confirmation count, its COMMAND_ACK. No I/O.

https://mavlink.io/en/services/command.html. Whether another copy may go out is for whoever holds it to decide: a lost
answer must not start anything twice.
"""

from dataclasses import dataclass
from enum import IntEnum

from pymavlink.dialects.v20 import common

from mavplan.link.protocol import Address, Message, is_for, sender

MOST_CONFIRMATIONS = 255
IN_PROGRESS_S = 5.0
"""So long a vehicle that said "in progress" is given from its last word on."""


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    COMMAND_LONG_ONLY = 7
    COMMAND_INT_ONLY = 8


_RESULT_WORDS: dict[int, str] = {
    CommandResult.ACCEPTED: "accepted",
    CommandResult.TEMPORARILY_REJECTED: "not now",
    CommandResult.DENIED: "denied",
    CommandResult.UNSUPPORTED: "a command it does not know",
    CommandResult.FAILED: "failed",
    CommandResult.CANCELLED: "cancelled",
}


def command_result_words(result: int) -> str:
    """Return what a COMMAND_ACK means, for people."""
    return f"{_RESULT_WORDS.get(result, 'a result it should not know')} (COMMAND_ACK {result})"


@dataclass(frozen=True, slots=True)
class CommandLong:
    """A MAV_CMD and its first parameters; the others are 0."""

    command: int
    params: tuple[float, ...]

    def message(self, to: Address, confirmation: int = 0) -> Message:
        """Return the COMMAND_LONG."""
        params = (*self.params, *(0.0,) * (7 - len(self.params)))
        made: Message = common.MAVLink_command_long_message(
            to.system, to.component, self.command, min(confirmation, MOST_CONFIRMATIONS), *params
        )
        return made


class CommandCall:
    """One command on its way.

    Parameters
    ----------
    what
        The command.
    vehicle, us
        The two addresses.
    """

    def __init__(self, what: CommandLong, vehicle: Address, us: Address) -> None:
        self.what = what
        self.result: int | None = None
        """The vehicle's answer to the copies sent since the last `renew`; None: none yet."""
        self.accepted = False
        """It has accepted a copy at some time."""
        self.sent_at: float | None = None
        """When the last copy went out."""
        self.first_sent_at: float | None = None
        self.sent = 0
        """Copies in all."""
        self._copies = 0
        self._vehicle = vehicle
        self._us = us
        self._in_progress_at: float | None = None

    def send(self, now: float) -> Message:
        """Return a copy to be sent now."""
        message = self.what.message(self._vehicle, self._copies)
        self.sent_at = now
        self._in_progress_at = None
        self.first_sent_at = now if self.first_sent_at is None else self.first_sent_at
        self.sent += 1
        self._copies += 1
        return message

    def renew(self) -> None:
        """Forget a refusal: the next copy is a new request and not a repeat."""
        self.result = None
        self._copies = 0
        self._in_progress_at = None

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if message.get_type() != "COMMAND_ACK" or sender(message) != self._vehicle:
            return
        if message.command != self.what.command or not is_for(message, self._us) or not self._copies:
            return
        if message.result == CommandResult.IN_PROGRESS:
            self._in_progress_at = now
            return
        self.result = int(message.result)
        self.accepted = self.accepted or self.result == CommandResult.ACCEPTED

    @property
    def waiting_since(self) -> float | None:
        """When the vehicle's time to answer began; None: not sent yet.

        That is the last copy, or where it said "in progress" so much later.
        """
        if self._in_progress_at is not None:
            return self._in_progress_at + IN_PROGRESS_S
        return self.sent_at
