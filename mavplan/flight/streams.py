"""Getting the messages that a flight is watched by: asks for those that do not come, and again when they stop. No I/O.

ArduPilot sends hardly anything unasked and forgets what it was asked when it restarts; PX4 sends most by itself. One
message is asked for at a time, so that each COMMAND_ACK is known for what it answers; whether it helped shows in the
message itself. https://mavlink.io/en/messages/common.html#MAV_CMD_SET_MESSAGE_INTERVAL
"""

import math
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

from mavplan.flight.command import CommandCall, CommandLong, CommandResult
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address, Message, sender
from mavplan.link.transfer import Pace

SET_MESSAGE_INTERVAL = 511
ANSWER_S = 0.5
"""A request that is not answered so soon (or in the link's own time) is taken for lost."""
MISSED = 3.0
"""A message that is late by so many of its periods does not come."""
LEAST_MISSED_S = 2.0
AGAIN_S = 2.0
MOST_AGAIN_S = 30.0
"""Between two requests for the same message: twice as long after each one in vain."""
TRIES = 4
"""Requests in vain, or one refusal, after which the old REQUEST_DATA_STREAM is tried as well."""
HEARD_S = 3.0
"""A vehicle that was not heard for so long is not asked: it would not hear it."""


@dataclass(frozen=True, slots=True)
class Stream:
    """One message: how often it is wanted, and the MAV_DATA_STREAM that it is in."""

    name: str
    message_id: int
    period_s: float
    data_stream: int
    pressing: bool = False
    """Asked for once even where it comes, perhaps more seldom."""


WANTED = (
    Stream("GLOBAL_POSITION_INT", common.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 0.2, 6, pressing=True),
    Stream("MISSION_CURRENT", common.MAVLINK_MSG_ID_MISSION_CURRENT, 1.0, 2),
    Stream("SYS_STATUS", common.MAVLINK_MSG_ID_SYS_STATUS, 1.0, 2),
    Stream("EXTENDED_SYS_STATE", common.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 1.0, 2),
    Stream("GPS_RAW_INT", common.MAVLINK_MSG_ID_GPS_RAW_INT, 1.0, 2),
    Stream("BATTERY_STATUS", common.MAVLINK_MSG_ID_BATTERY_STATUS, 2.0, 2),
)


@dataclass(slots=True)
class _Asked:
    """How it stands with one message."""

    heard_at: float | None = None
    asked_at: float | None = None
    tries: int = 0
    """Requests since it was last heard."""
    pressed: int = 0
    """Requests in all."""
    answered: bool = False
    refused: bool = False


class Streams(Outbox):
    """Keeps the wanted messages of one vehicle coming.

    Parameters
    ----------
    vehicle, us
        The two addresses.
    pace
        The link's round trip.
    """

    def __init__(
        self, vehicle: Address, us: Address, pace: Pace, wanted: tuple[Stream, ...] = WANTED
    ) -> None:
        self._vehicle = vehicle
        self._us = us
        self._pace = pace
        self._streams = {stream.name: stream for stream in wanted}
        self._state = {stream.name: _Asked() for stream in wanted}
        self._heard_at: float | None = None
        self._call: tuple[str, CommandCall] | None = None
        super().__init__()
        self._at = 0.0

    def forget(self) -> None:
        """Ask anew: the vehicle has restarted."""
        self._state = {name: _Asked() for name in self._streams}
        self._call = None

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        if sender(message) != self._vehicle:
            return
        self._heard_at = now
        if (state := self._state.get(message.get_type())) is not None:
            state.heard_at = now
            state.tries = 0
        if self._call is not None:
            name, call = self._call
            call.receive(message, now)
            if call.result is not None:
                self._state[name].answered = True
                self._state[name].refused = call.result != CommandResult.ACCEPTED
                self._call = None

    def tick(self, now: float) -> None:
        """Ask for the next message that is missing."""
        self._at = now
        if self._call is not None:
            sent_at = self._call[1].waiting_since
            if sent_at is not None and now < sent_at + max(ANSWER_S, self._pace.repeat_s):
                return
            self._call = None
        if self._heard_at is None or now >= self._heard_at + HEARD_S:
            return
        name = min(self._due(now), default=None, key=self._asked_at)
        if name is not None:
            self._ask(self._streams[name], now)

    def next_timer(self) -> float:
        """Time of the next `tick` that matters."""
        return self._at + ANSWER_S / 2

    def missing(self, now: float) -> tuple[str, ...]:
        """Return the names of the messages that do not come."""
        return tuple(name for name in self._streams if self._is_missing(name, now))

    def _is_missing(self, name: str, now: float) -> bool:
        heard_at = self._state[name].heard_at
        patience_s = max(LEAST_MISSED_S, MISSED * self._streams[name].period_s)
        return heard_at is None or now >= heard_at + patience_s

    def _asked_at(self, name: str) -> float:
        asked_at = self._state[name].asked_at
        return -math.inf if asked_at is None else asked_at

    def _due(self, now: float) -> list[str]:
        found = []
        for name, state in self._state.items():
            pressing = self._streams[name].pressing and not state.answered and state.pressed < TRIES
            if not (pressing or self._is_missing(name, now)):
                continue
            pause_s = min(MOST_AGAIN_S, AGAIN_S * 2 ** max(0, state.tries - TRIES))
            if state.asked_at is None or now >= state.asked_at + pause_s:
                found.append(name)
        return found

    def _ask(self, stream: Stream, now: float) -> None:
        state = self._state[stream.name]
        state.asked_at = now
        state.tries += 1
        state.pressed += 1
        period_us = round(stream.period_s * 1e6)
        call = CommandCall(
            CommandLong(SET_MESSAGE_INTERVAL, (float(stream.message_id), float(period_us))),
            self._vehicle,
            self._us,
        )
        self._outbox.append(call.send(now))
        self._call = (stream.name, call)
        if state.refused or state.tries >= TRIES:
            rate_hz = max(1, round(1 / stream.period_s))
            old: Message = common.MAVLink_request_data_stream_message(
                self._vehicle.system, self._vehicle.component, stream.data_stream, rate_hz, 1
            )
            self._outbox.append(old)
