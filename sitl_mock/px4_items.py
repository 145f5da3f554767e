"""What PX4 makes of one mission, fence or rally item: kept, wrapped or refused; and its checksum of a mission.

Measured on PX4 main of 2025-08-18 in simulation; commands that were not measured follow the same version's
command lists. Coordinates are not checked at all: latitude 91 is taken.
"""

import math
import struct
import zlib
from collections.abc import Callable, Iterable

from sitl_mock.items import MissionType, RefusedItemError, Result, StoredItem, clamp_int32, float32

Params = tuple[float, float, float, float]

GLOBAL, MISSION, RELATIVE, GLOBAL_INT, RELATIVE_INT = 0, 2, 3, 5, 6
FENCE_POLYGONS = frozenset({5001, 5002})
FENCE_CIRCLES = frozenset({5003, 5004})
FENCE_AND_RALLY = frozenset({5000, 5001, 5002, 5003, 5004, 5100})


_RAD_PER_DEG = float32(float32(math.pi) / 180.0)
_DEG_PER_RAD = float32(180.0 / float32(math.pi))
_TURN_RAD = float32(2.0 * math.pi)


def _heading_deg(degrees: float) -> float:
    """Wrap to 0..360 by way of 32-bit radians, as the vehicle does; NaN stays NaN."""
    if not math.isfinite(degrees):
        return math.nan
    radians = float32(degrees * _RAD_PER_DEG)
    return float32(float32(radians % _TURN_RAD) * _DEG_PER_RAD)


POSITION_COMMANDS: dict[int, Callable[[Params], Params]] = {
    16: lambda p: (p[0], p[1], 0.0, _heading_deg(p[3])),  # NAV_WAYPOINT
    17: lambda p: (0.0, 0.0, p[2], _heading_deg(p[3])),  # NAV_LOITER_UNLIM
    19: lambda p: (p[0], float(p[1] > 0), p[2], float(p[3] > 0)),  # NAV_LOITER_TIME
    21: lambda p: (0.0, p[1], 0.0, _heading_deg(p[3])),  # NAV_LAND
    22: lambda p: (0.0, 0.0, 0.0, _heading_deg(p[3])),  # NAV_TAKEOFF
    31: lambda p: (float(p[0] > 0), p[1], 0.0, float(p[3] > 0)),  # NAV_LOITER_TO_ALT
    84: lambda p: (0.0, 0.0, 0.0, _heading_deg(p[3])),  # NAV_VTOL_TAKEOFF
    85: lambda p: (0.0, 0.0, 0.0, _heading_deg(p[3])),  # NAV_VTOL_LAND
    195: lambda _: (0.0, 0.0, 0.0, 0.0),  # DO_SET_ROI_LOCATION
    4501: lambda _: (0.0, 0.0, 0.0, 0.0),  # CONDITION_GATE
    5000: lambda _: (0.0, 0.0, 0.0, 0.0),
    5001: lambda p: (_vertices(p[0]), 0.0, 0.0, 0.0),
    5002: lambda p: (_vertices(p[0]), 0.0, 0.0, 0.0),
    5003: lambda p: (p[0], 0.0, 0.0, 0.0),
    5004: lambda p: (p[0], 0.0, 0.0, 0.0),
    5100: lambda _: (0.0, 0.0, 0.0, 0.0),
}
"""What is kept of the parameters of commands with a position: frames 0, 3, 5 and 6 only."""

BARE_COMMANDS = frozenset(
    {20, 93, 112, 114, 177, 178, 179, 187, 189, 196, 197, 200, 203, 204, 205, 206, 211, 212, 214, 260, 400}
    | {530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
)
"""Commands that must come in frame 2 (MISSION): their seven parameters are kept as they are."""


def _vertices(value: float) -> float:
    return float(int(value + 0.5) & 0xFFFF) if math.isfinite(value) else 0.0


def keep_item(item: StoredItem, mission_type: int, *, as_int: bool) -> StoredItem:
    """Return the item as it reads back in integers.

    Parameters
    ----------
    item
        As it came; the coordinates of a float item already turned into 1e-7 degrees.
    mission_type
        The list it is meant for.
    as_int
        It came as MISSION_ITEM_INT: the frames 5 and 6 are for these only.

    Raises
    ------
    RefusedItemError
        With the result of the MISSION_ACK.
    """
    if item.frame in {GLOBAL, RELATIVE} or (as_int and item.frame in {GLOBAL_INT, RELATIVE_INT}):
        kept = _keep_place(item)
    elif item.frame == MISSION:
        if item.command not in BARE_COMMANDS:
            raise RefusedItemError(Result.UNSUPPORTED)
        x, y = clamp_int32(float32(item.x)), clamp_int32(float32(item.y))
        kept = StoredItem(
            item.seq, MISSION, item.command, 0, item.autocontinue & 1, *item.params, x, y, item.z
        )
    else:
        raise RefusedItemError(Result.UNSUPPORTED_FRAME)
    if mission_type == MissionType.MISSION and item.command in FENCE_AND_RALLY:
        raise RefusedItemError(Result.ERROR)
    if mission_type == MissionType.FENCE:
        if item.command in FENCE_POLYGONS and kept.param1 < 3:
            raise RefusedItemError(Result.ERROR)
        return StoredItem(
            item.seq, GLOBAL_INT, item.command, 0, 0, kept.param1, 0.0, 0.0, 0.0, kept.x, kept.y, 0.0
        )
    return kept


def _keep_place(item: StoredItem) -> StoredItem:
    keep = POSITION_COMMANDS.get(item.command)
    if keep is None:
        raise RefusedItemError(Result.UNSUPPORTED)
    frame = RELATIVE_INT if item.frame in {RELATIVE, RELATIVE_INT} else GLOBAL_INT
    autocontinue = item.autocontinue & 1
    return StoredItem(
        item.seq, frame, item.command, 0, autocontinue, *keep(item.params), item.x, item.y, item.z
    )


def checksum(items: Iterable[StoredItem], start: int = 0) -> int:
    """Return PX4's mission id of items as they came: CRC-32 without its two inversions.

    It reproduces the ids in recordings of a real vehicle. Sequence numbers and the current flag do not count.
    """
    crc = start
    for item in items:
        data = struct.pack(
            "<BHB4fiif", item.frame, item.command, item.autocontinue, *item.params, item.x, item.y, item.z
        )
        crc = ~zlib.crc32(data, ~crc & 0xFFFFFFFF) & 0xFFFFFFFF
    return crc
