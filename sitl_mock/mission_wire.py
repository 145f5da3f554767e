"""Mission items and replies of a `missions.MissionKeeper` as MAVLink messages, and back."""

import struct
from types import MappingProxyType

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.items import StoredItem, clamp_int32, float32
from sitl_mock.missions import Ack, Count, Item, Reached, Request
from sitl_mock.wire import Message

FLOAT_FRAMES = MappingProxyType({5: 0, 6: 3})
"""Frames of MISSION_ITEM_INT as MISSION_ITEM says them."""


def item_of(message: Message, *, as_int: bool) -> StoredItem:
    """Return the fields of MISSION_ITEM_INT or MISSION_ITEM; a float item loses digits of its place."""
    x, y = message.x, message.y
    if not as_int:
        x, y = clamp_int32(float32(x * 1e7)), clamp_int32(float32(y * 1e7))
    return StoredItem(
        message.seq,
        message.frame,
        message.command,
        message.current,
        message.autocontinue,
        message.param1,
        message.param2,
        message.param3,
        message.param4,
        x,
        y,
        message.z,
    )


def message_of(reply: Ack | Request | Count | Item | Reached) -> tuple[Message, bytes]:
    """Return the message of a reply and the bytes of its extension fields."""
    if isinstance(reply, Reached):
        return mavlink.MAVLink_mission_item_reached_message(reply.seq), b""
    to = (reply.to.system, reply.to.component)
    match reply:
        case Ack():
            opaque_id = struct.pack("<I", reply.opaque_id)
            return mavlink.MAVLink_mission_ack_message(*to, reply.result, reply.mission_type), opaque_id
        case Count():
            opaque_id = struct.pack("<I", reply.opaque_id)
            return mavlink.MAVLink_mission_count_message(*to, reply.count, reply.mission_type), opaque_id
        case Request():
            kind = (
                mavlink.MAVLink_mission_request_int_message
                if reply.as_int
                else mavlink.MAVLink_mission_request_message
            )
            return kind(*to, reply.seq, reply.mission_type), b""
        case Item():
            item = reply.item
            head = (item.current, item.autocontinue, *item.params)
            if reply.as_int:
                message = mavlink.MAVLink_mission_item_int_message(
                    *to, item.seq, item.frame, item.command, *head, item.x, item.y, item.z, reply.mission_type
                )
            else:
                frame = FLOAT_FRAMES.get(item.frame, item.frame)
                message = mavlink.MAVLink_mission_item_message(
                    *to,
                    item.seq,
                    frame,
                    item.command,
                    *head,
                    item.x / 1e7,
                    item.y / 1e7,
                    item.z,
                    reply.mission_type,
                )
            return message, b""
