"""A vehicle in the hands of a test: says what it is told to, as real bytes through the real codec."""

from typing import Any

from pymavlink.dialects.v20 import common

from mavplan.link.codec import Codec
from mavplan.link.protocol import Address, Message
from mavplan.link.transfer import Transfer

US = Address(255, 190)
VEHICLE = Address(1, 1)
OTHER_STATION = Address(254, 190)


def said(message: Any, by: Address = VEHICLE) -> Message:
    """The message as it arrives from `by`."""
    (arrived,) = Codec().decode(Codec(by).encode(message), 0.0)
    return arrived


def request(
    seq: int, *, to: Address = US, by: Address = VEHICLE, kind: int = 0, as_int: bool = False
) -> Message:
    make = common.MAVLink_mission_request_int_message if as_int else common.MAVLink_mission_request_message
    return said(make(to.system, to.component, seq, kind), by)


def ack(result: int, *, to: Address = US, by: Address = VEHICLE, kind: int = 0) -> Message:
    return said(common.MAVLink_mission_ack_message(to.system, to.component, result, kind), by)


def count(number: int, *, to: Address = US, by: Address = VEHICLE, kind: int = 0) -> Message:
    return said(common.MAVLink_mission_count_message(to.system, to.component, number, kind), by)


def item(seq: int, *, to: Address = US, by: Address = VEHICLE, kind: int = 0, lat_e7: int = 1) -> Message:
    return said(
        common.MAVLink_mission_item_int_message(
            to.system, to.component, seq, 3, 16, 0, 1, 0, 0, 0, 0, lat_e7, 1, 30, kind
        ),
        by,
    )


def heartbeat(by: Address = VEHICLE, *, autopilot: int = 3, kind: int = 2, base_mode: int = 81) -> Message:
    return said(common.MAVLink_heartbeat_message(kind, autopilot, base_mode, 0, 3, 3), by)


def text(words: str, severity: int = 4) -> Message:
    return said(common.MAVLink_statustext_message(severity, words.encode(), 0, 0))


def outgoing(transfer: Transfer) -> list[str]:
    """What a transfer sends now, in short: ``COUNT 3``, ``ITEM 0``, ``LIST``, ``REQUEST 2``, ``ACK 0``."""
    names = {
        "MISSION_COUNT": lambda m: f"COUNT {m.count}",
        "MISSION_ITEM_INT": lambda m: f"ITEM {m.seq}",
        "MISSION_REQUEST_LIST": lambda m: "LIST",
        "MISSION_REQUEST_INT": lambda m: f"REQUEST {m.seq}",
        "MISSION_ACK": lambda m: f"ACK {m.type}",
        "MISSION_CLEAR_ALL": lambda m: "CLEAR",
    }
    return [names[message.get_type()](message) for message in transfer.to_send()]


def until(transfer: Transfer, end: float) -> list[tuple[float, str]]:
    """Let a transfer alone until a time, and return what it sent when."""
    sent = []
    while (timer := transfer.next_timer()) is not None and timer <= end:
        transfer.tick(timer)
        sent += [(round(timer, 3), words) for words in outgoing(transfer)]
    return sent
