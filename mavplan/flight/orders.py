"""What the user orders in flight: hold or return. No I/O.

An order is sent until the vehicle does it, and never against anybody else.
"""

import math
from enum import Enum

from mavplan.flight.command import CommandCall, CommandResult, command_result_words
from mavplan.flight.manners import FlightManners, set_mode
from mavplan.flight.telemetry import Telemetry
from mavplan.link.modes import CUSTOM_MODE, mode_name
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Pace
from mavplan.mission.model import Autopilot

AGAIN_S = 1.0
ACCEPTED_AGAIN_S = 4.0
"""An accepted order shows in the heartbeat by then, or is sent again."""
REFUSALS_BELIEVED = 3
"""Of the last mode there is: one may be a late copy of an answer to something else."""


class Order(Enum):
    """What the user may order."""

    HOLD = "hold"
    RETURN = "return"


class OrderCall(Outbox):
    """One order until it is done, refused, or somebody else has decided otherwise.

    Parameters
    ----------
    order
        What is wanted.
    autopilot, manners
        The firmware.
    own_modes
        Where the vehicle may be while it has not heeded: its mission's modes, and that of an order before.
    vehicle, us, telemetry, pace
        As for `mavplan.flight.launch.Launch`.
    """

    def __init__(
        self,
        order: Order,
        autopilot: Autopilot,
        manners: FlightManners,
        own_modes: "frozenset[int | None]",
        *,
        vehicle: Address,
        us: Address,
        telemetry: Telemetry,
        pace: Pace,
    ) -> None:
        self.order = order
        self.done = False
        """Nothing more is sent."""
        self.granted_mode: int | None = None
        """The mode that it led to."""
        self.words: list[str] = []
        self._autopilot = autopilot
        self._modes = manners.hold_modes if order is Order.HOLD else (manners.return_mode,)
        self._at = 0
        self._refusals = 0
        self._own_modes = {*own_modes, *self._modes}
        self._vehicle, self._us = vehicle, us
        self._telemetry = telemetry
        self._pace = pace
        self._call = CommandCall(set_mode(autopilot, self._modes[0]), vehicle, us)
        super().__init__()
        self._ticked_at = -math.inf

    @property
    def mode(self) -> int:
        """The mode that is asked for."""
        return self._modes[self._at]

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        self._call.receive(message, now)

    def tick(self, now: float) -> None:
        """Send it again, or see that it is done."""
        self._ticked_at = now
        if self.done:
            return
        telemetry, call = self._telemetry, self._call
        told_since = call.first_sent_at is not None and telemetry.beat_at > call.first_sent_at
        if told_since and telemetry.mode_now in self._modes:
            self.granted_mode, self.done = telemetry.mode_now, True
            self.words.append(f"{self._name(telemetry.mode_now)}, as you ordered")
        elif telemetry.armed.value is False:
            self._drop("the motors do not turn any more")
        elif telemetry.mode.value not in self._own_modes and telemetry.mode_now not in self._own_modes:
            self._drop(f"somebody else switched to {self._name(telemetry.mode.value)}")
        elif call.result is not None and call.result != CommandResult.ACCEPTED:
            self._refused(call.result)
        else:
            self._send(now)

    def next_timer(self) -> float:
        """Time of the next `tick` that matters."""
        return math.inf if self.done else self._ticked_at + AGAIN_S / 4

    def _send(self, now: float) -> None:
        call = self._call
        pause_s = ACCEPTED_AGAIN_S if call.accepted else max(AGAIN_S, self._pace.repeat_s)
        if call.waiting_since is None or now >= call.waiting_since + pause_s:
            self._outbox.append(call.send(now))

    def _refused(self, result: int) -> None:
        why = f"{self._name(self.mode)} was refused, {command_result_words(result)}"
        self._refusals += 1
        if self._at + 1 < len(self._modes):
            self._at += 1
            self._refusals = 0
            self.words.append(f"{why}; {self._name(self.mode)} is tried")
            self._call = CommandCall(set_mode(self._autopilot, self.mode), self._vehicle, self._us)
        elif self._refusals >= REFUSALS_BELIEVED:
            self.done = True
            self.words.append(f"your order to {self.order.value} was not heeded: {why}")
        else:
            self._call.renew()

    def _drop(self, why: str) -> None:
        self.done = True
        self.words.append(f"your order to {self.order.value} is not sent any more: {why}")

    def _name(self, mode: int | None) -> str:
        return mode_name(self._autopilot, CUSTOM_MODE, mode if mode is not None else 0)
