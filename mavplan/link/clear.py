"""Clearing one mission type: MISSION_CLEAR_ALL until an ACK answers. No I/O; see `mavplan.link.transfer`."""

from dataclasses import dataclass
from enum import Enum

from mavplan.link.protocol import PUT_OFF, Address, Message, Result, mission_clear_all
from mavplan.link.transfer import Move, Transfer

CLEAR_AGAIN_S = 1.0
BUSY_S = 1.0
ERRORS_BELIEVED = 3
"""ArduPilot refuses with "error" while it flies the mission; the same word may be a late answer to something else."""


class ClearEnd(Enum):
    """How a clear ended."""

    CLEARED = "cleared"
    REFUSED = "refused"
    EXPIRED = "out of time"


@dataclass(frozen=True, slots=True)
class ClearOutcome:
    """The end of a clear; ``result`` is the MISSION_ACK's where it was refused."""

    end: ClearEnd
    result: int | None = None


class Clear(Transfer):
    """Delete what a vehicle holds of one mission type. Download afterwards: an ACK is no proof."""

    def __init__(
        self, vehicle: Address, us: Address, mission_type: int = 0, *, now: float, deadline: float
    ) -> None:
        super().__init__(vehicle, us, mission_type, now=now, deadline=deadline, ask_again_s=CLEAR_AGAIN_S)
        self.outcome: ClearOutcome | None = None
        self.sent = False
        self._errors = 0

    def _ask(self, now: float) -> None:
        self.sent = True
        self._send(mission_clear_all(self.vehicle, self.mission_type))

    def _begin(self, now: float) -> None:
        self._ask_at = now

    def _on_message(self, message: Message, now: float) -> None:
        if self.outcome is not None or not self.sent or message.get_type() != "MISSION_ACK":
            return
        result = int(message.type)
        if result == Result.ACCEPTED:
            self._move(Move.FINISHED)
            self.outcome = ClearOutcome(ClearEnd.CLEARED)
            return
        self._errors += 1
        if result not in PUT_OFF or (result == Result.ERROR and self._errors >= ERRORS_BELIEVED):
            self._move(Move.REFUSED)
            self.outcome = ClearOutcome(ClearEnd.REFUSED, result)
        else:
            self._pause(now, BUSY_S)

    def _on_moving(self, now: float) -> None:
        raise AssertionError("a clear moves no items")

    def _moving_timer(self) -> float:
        raise AssertionError("a clear moves no items")

    def _expire(self, now: float) -> None:
        self._move(Move.EXPIRED)
        self.outcome = ClearOutcome(ClearEnd.EXPIRED)
