"""PX4's judgement of a stored mission, which comes after its ACK: waits for MISSION_CURRENT's mission_state. No I/O."""

from enum import Enum

from mavplan.link.outbox import Outbox
from mavplan.link.protocol import (
    MISSION_CURRENT_ID,
    MISSION_STATE_NO_MISSION,
    MISSION_STATE_UNKNOWN,
    Address,
    Message,
    opaque_id,
    request_message,
    sender,
)

ASK_AGAIN_S = 0.5
GIVE_UP_S = 10.0
"""Twenty times asked in vain: this firmware does not tell."""


class Judgement(Enum):
    """What the vehicle thinks of the mission it has stored."""

    FLYABLE = "flyable"
    INFEASIBLE = "infeasible"
    UNKNOWN = "not told"


class Verdict(Outbox):
    """Asks until the vehicle tells.

    Parameters
    ----------
    vehicle
        Its address.
    count
        Items of the mission; a MISSION_CURRENT with another total speaks of another mission.
    mission_id
        The checksum of the ACK, where there was one.
    not_before
        Earlier words may still be about the mission before.
    """

    def __init__(self, vehicle: Address, count: int, mission_id: int | None, *, not_before: float) -> None:
        self._vehicle = vehicle
        self._count = count
        self._mission_id = mission_id
        self._not_before = not_before
        self._ask_at = not_before
        super().__init__()
        self.outcome: Judgement | None = None
        self.other_mission = False
        """The vehicle speaks of another mission than the one it accepted."""

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if message.get_type() != "MISSION_CURRENT" or sender(message) != self._vehicle:
            return
        if self.outcome is not None:
            return
        if message.mission_state == MISSION_STATE_UNKNOWN:  # a firmware from before the field
            self.outcome = Judgement.UNKNOWN
            return
        if now < self._not_before:
            return
        said = opaque_id(message)
        if message.total != self._count or (said and self._mission_id and said != self._mission_id):
            self.other_mission = True
        elif message.mission_state == MISSION_STATE_NO_MISSION:
            self.outcome = Judgement.INFEASIBLE
        else:
            self.outcome = Judgement.FLYABLE

    def tick(self, now: float) -> None:
        """Ask again, or give up."""
        if self.outcome is not None:
            return
        if now >= self._not_before + GIVE_UP_S:
            self.outcome = Judgement.UNKNOWN
        elif now >= self._ask_at:
            self._ask_at = now + ASK_AGAIN_S
            self._outbox.append(request_message(self._vehicle, MISSION_CURRENT_ID))

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        return None if self.outcome is not None else min(self._ask_at, self._not_before + GIVE_UP_S)
