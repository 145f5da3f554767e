"""Setting a mission to its first item before it is started: PX4 keeps its old index, and so may others. No I/O."""

import math

from pymavlink.dialects.v20 import common

from mavplan.flight.manners import FlightManners
from mavplan.flight.telemetry import Telemetry
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Message
from mavplan.link.transfer import Pace

REWIND_S = 15.0
AGAIN_S = 1.0


class Rewind(Outbox):
    """Sees at which item a vehicle would start, and sets it to the first until it says that it is there.

    Parameters
    ----------
    manners
        The firmware.
    telemetry, pace
        What is known of the vehicle and of the link; others feed them.
    now
        Only what the vehicle says from now on counts.
    """

    def __init__(self, manners: FlightManners, telemetry: Telemetry, pace: Pace, now: float) -> None:
        self.sent_at = -math.inf
        """When it was last set."""
        self._manners, self._telemetry, self._pace = manners, telemetry, pace
        self._since = now
        self._deadline = now + REWIND_S
        self._ask_at = now
        self._stood_at: int | None = None
        super().__init__()

    @property
    def done(self) -> bool:
        """Whether it would start at the first item."""
        return self._told() in self._manners.start_seqs

    @property
    def words(self) -> str:
        """What was done, for people; empty where nothing had to be."""
        if self._stood_at is None:
            return ""
        return f"the mission stood at item {self._stood_at}: set back to item {self._manners.first_seq}"

    def failure(self, now: float) -> str:
        """Return why it cannot be started, once time is over; else nothing."""
        if self.done or now < self._deadline:
            return ""
        told = self._told()
        if told is None:
            return "does not tell at which item it would start"
        return f"would start at item {told} and does not let itself be set to the first"

    def tick(self, now: float) -> None:
        """Set it to its first item, again where that was lost; the vehicle must be heard, and not armed."""
        told = self._told()
        if told is None or self.done or now < self._ask_at:
            return
        self._ask_at = now + max(AGAIN_S, 2 * self._pace.repeat_s)
        self._stood_at = told if self._stood_at is None else self._stood_at
        self.sent_at = now
        vehicle = self._telemetry.vehicle
        to_first: Message = common.MAVLink_mission_set_current_message(
            vehicle.system, vehicle.component, self._manners.first_seq
        )
        self._outbox.append(to_first)

    def _told(self) -> int | None:
        mission = self._telemetry.mission
        return mission.seq if mission is not None and mission.at >= self._since else None
