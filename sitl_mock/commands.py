"""COMMAND_LONG and COMMAND_INT: what the vehicle does at once and answers with COMMAND_ACK.

Commands about messages are carried out here; all others are orders for the pilot of `flight`.
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from enum import IntEnum

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.flight.orders import Order
from sitl_mock.flight.pilot import Pilot
from sitl_mock.telemetry import Schedule, Telemetry
from sitl_mock.wire import Message

GET_HOME_POSITION = 410
GET_MESSAGE_INTERVAL = 510
SET_MESSAGE_INTERVAL = 511
REQUEST_MESSAGE = 512
REQUEST_AUTOPILOT_CAPABILITIES = 520


ABOUT_MESSAGES = frozenset(
    {
        GET_HOME_POSITION,
        GET_MESSAGE_INTERVAL,
        SET_MESSAGE_INTERVAL,
        REQUEST_MESSAGE,
        REQUEST_AUTOPILOT_CAPABILITIES,
    }
)
WHOLE_NUMBERS = frozenset({176, 192, 224, 300, 400})
"""Orders whose first parameters are whole numbers; ground stations send NaN where they mean nothing by them."""
RELATIVE_FRAMES = frozenset({3, 6, 10, 11})


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    UNSUPPORTED = 3
    FAILED = 4


def order_of(message: Message) -> Order:
    """Return a COMMAND_LONG or COMMAND_INT as the pilot reads it; COMMAND_LONG's heights are above home."""
    params = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_LONG":
        x_e7, y_e7 = message.param5 * 1e7, message.param6 * 1e7
        return Order(message.command, *params, x_e7, y_e7, message.param7)
    nowhere = 2**31 - 1
    x_e7, y_e7 = (math.nan if value in {nowhere, -nowhere - 1} else value for value in (message.x, message.y))
    return Order(message.command, *params, x_e7, y_e7, message.z, message.frame in RELATIVE_FRAMES)


def carry_out(order: Order, now: float, pilot: Pilot) -> tuple[int, ...]:
    """Give the pilot an order and return the results to answer with; what is no number where one must be is 0."""
    if order.command in WHOLE_NUMBERS:
        p1, p2, p3 = (value if abs(value) < 2**31 else 0.0 for value in (order.p1, order.p2, order.p3))
        order = replace(order, p1=p1, p2=p2, p3=p3)
    return pilot.order(order, now) or (CommandResult.UNSUPPORTED,)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result, telemetry to send by name, and ready messages to send behind the COMMAND_ACK."""

    result: CommandResult
    telemetry: tuple[str, ...] = ()
    messages: list[Message] = field(default_factory=list)


def execute(  # noqa: PLR0911 - one return a command
    command: int,
    params: tuple[float, ...],
    link: Hashable,
    now: float,
    telemetry: Telemetry,
    schedule: Schedule,
) -> Outcome:
    """Do what a command asks for on one link and return what to answer."""
    if command == REQUEST_AUTOPILOT_CAPABILITIES:
        return Outcome(CommandResult.ACCEPTED, ("AUTOPILOT_VERSION",))
    if command == GET_HOME_POSITION:
        return Outcome(CommandResult.ACCEPTED, ("HOME_POSITION",))
    message_id = int(params[0]) if abs(params[0]) < 2**24 else -1  # NaN is not less than anything
    name = telemetry.names().get(message_id)
    if name is None:
        return Outcome(CommandResult.FAILED)
    if command == REQUEST_MESSAGE:
        return Outcome(CommandResult.ACCEPTED, (name,))
    if command == GET_MESSAGE_INTERVAL:
        period = schedule.period(link, name)
        interval_us = -1 if period is None else round(period * 1e6)
        return Outcome(
            CommandResult.ACCEPTED,
            messages=[mavlink.MAVLink_message_interval_message(message_id, interval_us)],
        )
    interval_us_asked = params[1]
    if math.isnan(interval_us_asked) or name == "HEARTBEAT":
        return Outcome(CommandResult.FAILED)
    schedule.set_period(link, name, None if interval_us_asked == 0 else interval_us_asked / 1e6, now)
    return Outcome(CommandResult.ACCEPTED)
