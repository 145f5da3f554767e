"""The mission protocol's words: addresses, messages to send, what a received one says. No state, no time, no I/O.

https://mavlink.io/en/services/mission.html. Everything received was decoded by `mavplan.link.codec`.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

from pymavlink.dialects.v20 import common

from mavplan.mission.wire import WireItem


class Message(Protocol):
    """A message of pymavlink's dialect: its fields are attributes of their MAVLink names."""

    def get_type(self) -> str:
        """Name, for instance ``MISSION_COUNT``."""

    def get_srcSystem(self) -> int:  # noqa: N802
        """System that sent it."""

    def get_srcComponent(self) -> int:  # noqa: N802
        """Component that sent it."""

    def __getattr__(self, name: str) -> Any: ...


@dataclass(frozen=True, slots=True, order=True)
class Address:
    """A MAVLink system and component."""

    system: int
    component: int

    def __str__(self) -> str:
        """``system 1, component 1``."""
        return f"system {self.system}, component {self.component}"


GROUND = Address(255, 190)
"""Ours: the ids by which ground stations go."""


class MissionType(IntEnum):
    """MAV_MISSION_TYPE: each has a transfer of its own."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class Result(IntEnum):
    """MAV_MISSION_RESULT, as MISSION_ACK carries it."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


RESULT_WORDS: dict[int, str] = {
    Result.ACCEPTED: "accepted",
    Result.ERROR: "an error it does not name",
    Result.UNSUPPORTED_FRAME: "a coordinate frame it does not take",
    Result.UNSUPPORTED: "a command it does not know",
    Result.NO_SPACE: "no space for so many items",
    Result.INVALID: "an invalid item",
    Result.INVALID_PARAM1: "an invalid param1",
    Result.INVALID_PARAM2: "an invalid param2",
    Result.INVALID_PARAM3: "an invalid param3",
    Result.INVALID_PARAM4: "an invalid param4",
    Result.INVALID_PARAM5_X: "an invalid latitude",
    Result.INVALID_PARAM6_Y: "an invalid longitude",
    Result.INVALID_PARAM7: "an invalid altitude",
    Result.INVALID_SEQUENCE: "an item out of order",
    Result.DENIED: "busy with another ground station's transfer",
    Result.OPERATION_CANCELLED: "the transfer broken off",
}


def result_words(result: int) -> str:
    """Return what a MISSION_ACK means, for people."""
    return f"{RESULT_WORDS.get(result, 'a result it should not know')} (MISSION_ACK {result})"


PUT_OFF = frozenset({Result.ERROR, Result.DENIED, Result.OPERATION_CANCELLED})
"""Not the end: another transfer is in the way, or this one timed out on the vehicle. Try again."""

REFUSES_ITEM = frozenset(
    {
        Result.UNSUPPORTED_FRAME,
        Result.UNSUPPORTED,
        Result.INVALID,
        Result.INVALID_PARAM1,
        Result.INVALID_PARAM2,
        Result.INVALID_PARAM3,
        Result.INVALID_PARAM4,
        Result.INVALID_PARAM5_X,
        Result.INVALID_PARAM6_Y,
        Result.INVALID_PARAM7,
    }
)
"""The vehicle does not take an item and has ended the transfer."""


def sender(message: Message) -> Address:
    """Return who sent a message."""
    return Address(message.get_srcSystem(), message.get_srcComponent())


def is_for(message: Message, us: Address) -> bool:
    """Whether the message's target is ours or everybody."""
    return message.target_system in {0, us.system} and message.target_component in {0, us.component}


def heartbeat() -> Message:
    """Return our HEARTBEAT: a ground station, active."""
    return _made(
        common.MAVLink_heartbeat_message(
            common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, common.MAV_STATE_ACTIVE, 3
        )
    )


def timesync(stamp_ns: int) -> Message:
    """Return TIMESYNC: an autopilot sends the stamp back, which times the round trip."""
    return _made(common.MAVLink_timesync_message(0, stamp_ns))


def mission_count(to: Address, count: int, mission_type: int) -> Message:
    """Return MISSION_COUNT: opens an upload."""
    return _made(common.MAVLink_mission_count_message(to.system, to.component, count, mission_type))


def mission_item(to: Address, item: WireItem, mission_type: int) -> Message:
    """Return MISSION_ITEM_INT."""
    return _made(
        common.MAVLink_mission_item_int_message(
            to.system,
            to.component,
            item.seq,
            item.frame,
            item.command,
            item.current,
            item.autocontinue,
            item.param1,
            item.param2,
            item.param3,
            item.param4,
            item.x,
            item.y,
            item.z,
            mission_type,
        )
    )


def mission_request_list(to: Address, mission_type: int) -> Message:
    """Return MISSION_REQUEST_LIST: opens a download."""
    return _made(common.MAVLink_mission_request_list_message(to.system, to.component, mission_type))


def mission_request(to: Address, seq: int, mission_type: int) -> Message:
    """Return MISSION_REQUEST_INT."""
    return _made(common.MAVLink_mission_request_int_message(to.system, to.component, seq, mission_type))


def mission_ack(to: Address, result: int, mission_type: int) -> Message:
    """Return MISSION_ACK."""
    return _made(common.MAVLink_mission_ack_message(to.system, to.component, result, mission_type))


def mission_clear_all(to: Address, mission_type: int) -> Message:
    """Return MISSION_CLEAR_ALL."""
    return _made(common.MAVLink_mission_clear_all_message(to.system, to.component, mission_type))


def request_message(to: Address, message_id: int) -> Message:
    """Return the command REQUEST_MESSAGE: send this message once."""
    return _made(
        common.MAVLink_command_long_message(
            to.system, to.component, REQUEST_MESSAGE, 0, message_id, 0, 0, 0, 0, 0, 0
        )
    )


def param_request_read(to: Address, name: str) -> Message:
    """Return PARAM_REQUEST_READ of one parameter by its name."""
    return _made(common.MAVLink_param_request_read_message(to.system, to.component, name.encode("ascii"), -1))


REQUEST_MESSAGE: int = common.MAV_CMD_REQUEST_MESSAGE
AUTOPILOT_VERSION_ID: int = common.MAVLINK_MSG_ID_AUTOPILOT_VERSION
HOME_POSITION_ID: int = common.MAVLINK_MSG_ID_HOME_POSITION
MISSION_CURRENT_ID: int = common.MAVLINK_MSG_ID_MISSION_CURRENT
MISSION_STATE_UNKNOWN = 0
MISSION_STATE_NO_MISSION = 1


def _made(message: Any) -> Message:
    made: Message = message
    return made


def received_item(message: Message) -> WireItem:
    """Return the item in a MISSION_ITEM_INT."""
    return WireItem(
        seq=message.seq,
        frame=message.frame,
        command=message.command,
        current=message.current,
        autocontinue=message.autocontinue,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=message.x,
        y=message.y,
        z=message.z,
    )


def payload_of(message: Message) -> bytes:
    """Return the payload as it came; MAVLink 2 cuts zero bytes off its end."""
    frame: bytes = getattr(message, "_msgbuf", b"") or b""
    if not frame:
        return b""
    header = 10 if frame[0] == common.PROTOCOL_MARKER_V2 else 6
    return bytes(frame[header : header + frame[1]])


_OPAQUE_ID_OFFSET = {"MISSION_ACK": 4, "MISSION_COUNT": 5, "MISSION_CURRENT": 6}


def opaque_id(message: Message, mission_type: int = 0) -> int | None:
    """Return the autopilot's checksum of its mission, which pymavlink does not decode; None where it sends none.

    A uint32 after the fields pymavlink knows. MAVLink 2 cuts zero bytes off the end of a payload. MISSION_CURRENT has
    one for each mission type; the other messages speak of one list only.
    """
    offset = _OPAQUE_ID_OFFSET[message.get_type()]
    if message.get_type() == "MISSION_CURRENT":
        offset += 4 * mission_type
    frame: bytes | None = getattr(message, "_msgbuf", None)
    if not frame or frame[0] != common.PROTOCOL_MARKER_V2:
        return None
    payload = bytes(frame[10 : 10 + frame[1]])[offset : offset + 4]
    (value,) = struct.unpack("<I", payload.ljust(4, b"\0"))
    return int(value) or None


def seqs_in_words(seqs: Sequence[int]) -> str:
    """Return for instance ``items 3 to 7 and 9``; the sequence must be in order."""
    runs: list[list[int]] = []
    for seq in seqs:
        if runs and runs[-1][1] == seq - 1:
            runs[-1][1] = seq
        else:
            runs.append([seq, seq])
    parts = [f"{first} to {last}" if last > first else str(first) for first, last in runs]
    listed = f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts)
    return f"item{'s' if len(seqs) > 1 else ''} {listed}"
