"""PX4's id of a list of items, from the items as sent: so that a vehicle can be asked which mission it holds."""

import struct
import zlib
from collections.abc import Iterable

from mavplan.mission.wire import WireItem

_INVERT = 0xFFFF_FFFF


def px4_id(items: Iterable[WireItem]) -> int:
    """Return the ``opaque_id`` that PX4 gives a list: in MISSION_ACK, MISSION_COUNT and MISSION_CURRENT.

    CRC-32 (ISO-HDLC polynomial) without its two inversions over frame, command, autocontinue, param1 to param4, x, y
    and z of every item as it came over the link, little-endian and packed. Neither ``seq`` nor ``current`` counts. It
    reproduces the ids that PX4 of August 2025 was recorded to send.

    Raises
    ------
    struct.error
        A field does not fit its type; `mavplan.mission.uploadable.check_uploadable` finds those.
    """
    crc = 0
    for item in items:
        data = struct.pack(
            "<BHB4fiif", item.frame, item.command, item.autocontinue, *item.params, item.x, item.y, item.z
        )
        crc = zlib.crc32(data, crc ^ _INVERT) ^ _INVERT
    return crc
