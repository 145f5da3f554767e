"""What ArduCopter makes of one mission, fence or rally item: kept, cut off, replaced or refused.

Measured on ArduCopter 4.7.0-dev (July 2025) in simulation; commands that were not measured follow the storage
layout of AP_Mission. A mission item has fifteen bytes of storage there, which is why so much of it is lost.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sitl_mock.items import RefusedItemError, Result, StoredItem, VehicleKilledError, float32

Params = tuple[float, float, float, float]

MAX_LAT_E7 = 900_000_000
MAX_LON_E7 = 1_800_000_000
MAX_ALT_M = 83_000.0
FRAME_KEPT_AS = {0: 0, 2: 0, 5: 0, 3: 3, 6: 3, 10: 10, 11: 10}
"""Frames of items with a position; any other is refused."""

FENCE_FRAMES = frozenset({0, 3, 5, 6, 10, 11})
FENCE_INCLUSION, FENCE_EXCLUSION = 5001, 5002
FENCE_CIRCLES = frozenset({5003, 5004})
FENCE_RETURN_POINT = 5000
FENCE_STORAGE_BYTES = 560
"""Room for the whole fence: 70 items are taken one by one, but a polygon of 70 vertices does not fit."""

RALLY_POINT = 5100
RALLY_FRAMES = frozenset({3, 6})


def _cast(value: float, what: str) -> int:
    """Cut off to an integer as the C++ does; outside 32 bits the simulator dies of it."""
    if not -(2.0**31) <= value < 2.0**31:  # also true for NaN
        raise VehicleKilledError(f"{what} {value:g} cannot be an integer")
    return int(value)


def _u16(value: float) -> float:
    return float(_cast(value, "parameter") & 0xFFFF)


def _u8(value: float) -> float:
    return float(_cast(value, "parameter") & 0xFF)


def _i16(value: float) -> float:
    return float((_cast(value, "parameter") + 0x8000) % 0x10000 - 0x8000)


def _i8(value: float) -> float:
    return float((_cast(value, "parameter") + 0x80) % 0x100 - 0x80)


def _loiter_unlimited(p: Params) -> Params:
    radius = _u16(abs(p[2]))
    return (0.0, 0.0, -radius if p[2] < 0 else radius, 0.0)


def _loiter_turns(p: Params) -> Params:
    radius = _u8(abs(p[2]))
    return (_u8(p[0]), 0.0, -radius if p[2] < 0 else radius, float(p[3] > 0))


def _loiter_time(p: Params) -> Params:
    return (_u16(p[0]), 0.0, -1.0 if p[2] < 0 else 1.0, float(p[3] > 0))


def _loiter_to_alt(p: Params) -> Params:
    radius = _u16(abs(p[1]))
    return (0.0, -radius if p[1] < 0 else radius, 0.0, float(p[3] > 0))


def _land(p: Params) -> Params:
    return (_u16(p[0]), 0.0, 0.0, -1.0 if p[3] < 0 else 1.0)


def _first(cast: Callable[[float], float]) -> Callable[[Params], Params]:
    return lambda p: (cast(p[0]), 0.0, 0.0, 0.0)


def _nothing(_: Params) -> Params:
    return (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class _Command:
    keep: Callable[[Params], Params]
    position: bool = False
    nan_param4: bool = False


COMMANDS: dict[int, _Command] = {
    16: _Command(_first(_u16), position=True, nan_param4=True),  # NAV_WAYPOINT
    17: _Command(_loiter_unlimited, position=True, nan_param4=True),
    18: _Command(_loiter_turns, position=True),
    19: _Command(_loiter_time, position=True),
    20: _Command(_nothing),  # NAV_RETURN_TO_LAUNCH
    21: _Command(_land, position=True, nan_param4=True),
    22: _Command(_first(_u16), position=True, nan_param4=True),  # NAV_TAKEOFF
    31: _Command(_loiter_to_alt, position=True),
    82: _Command(_first(_u16), position=True),  # NAV_SPLINE_WAYPOINT
    93: _Command(lambda p: (p[0], _i8(p[1]), _i8(p[2]), _i8(p[3]))),  # NAV_DELAY
    112: _Command(_first(float)),  # CONDITION_DELAY
    114: _Command(_first(float)),  # CONDITION_DISTANCE
    115: _Command(lambda p: (p[0], p[1], _i8(p[2]), _u8(p[3]))),  # CONDITION_YAW
    177: _Command(lambda p: (_u16(p[0]), _i16(p[1]), 0.0, 0.0)),  # DO_JUMP
    178: _Command(lambda p: (_u8(p[0]), p[1], p[2], 0.0)),  # DO_CHANGE_SPEED
    179: _Command(_first(_u16), position=True),  # DO_SET_HOME
    181: _Command(lambda p: (_u8(p[0]), _u8(p[1]), 0.0, 0.0)),  # DO_SET_RELAY
    183: _Command(lambda p: (_u8(p[0]), _u16(p[1]), 0.0, 0.0)),  # DO_SET_SERVO
    189: _Command(_nothing, position=True),  # DO_LAND_START
    195: _Command(_nothing, position=True),  # DO_SET_ROI_LOCATION
    197: _Command(_nothing),  # DO_SET_ROI_NONE
    201: _Command(_first(_u16), position=True),  # DO_SET_ROI
    206: _Command(lambda p: (p[0], 0.0, _u8(p[2]), 0.0)),  # DO_SET_CAM_TRIGG_DIST
    207: _Command(_first(_u16)),  # DO_FENCE_ENABLE
    211: _Command(lambda p: (_u8(p[0]), _u8(p[1]), 0.0, 0.0)),  # DO_GRIPPER
}
DO_JUMP = 177
PARAM_RESULTS = (
    Result.INVALID_PARAM1,
    Result.INVALID_PARAM2,
    Result.INVALID_PARAM3,
    Result.INVALID_PARAM4,
)


def keep_mission_item(item: StoredItem) -> StoredItem:
    """Return the item as it reads back.

    Raises
    ------
    RefusedItemError
        With the result of the MISSION_ACK.
    VehicleKilledError
        For a number of seconds that no 32-bit integer holds.
    """
    rule = COMMANDS.get(item.command)
    for index, value in enumerate(item.params):
        nan_taken = index == 3 and rule is not None and rule.nan_param4
        if math.isinf(value) or (math.isnan(value) and not nan_taken):
            raise RefusedItemError(PARAM_RESULTS[index])
    if item.command in {0, 1}:
        raise RefusedItemError(Result.INVALID)
    if rule is None:
        raise RefusedItemError(Result.UNSUPPORTED)
    p1, p2, p3, p4 = rule.keep(item.params)
    if not rule.position:
        return StoredItem(item.seq, 0, item.command, 0, 1, p1, p2, p3, p4, 0, 0, 0.0)
    _check_position(item)
    if not abs(item.z) < MAX_ALT_M:
        raise RefusedItemError(Result.INVALID_PARAM7)
    frame = FRAME_KEPT_AS.get(item.frame)
    if frame is None:
        raise RefusedItemError(Result.UNSUPPORTED_FRAME)
    z = metres_from_cm(int(float32(float32(item.z) * 100.0)))
    return StoredItem(item.seq, frame, item.command, 0, 1, p1, p2, p3, p4, item.x, item.y, z)


def metres_from_cm(cm: int) -> float:
    """Return metres as the vehicle computes them: 32-bit centimetres times a 32-bit 0.01."""
    return float32(float32(cm) * float32(0.01))


def _check_position(item: StoredItem) -> None:
    if abs(item.x) > MAX_LAT_E7:
        raise RefusedItemError(Result.INVALID_PARAM5_X)
    if abs(item.y) > MAX_LON_E7:
        raise RefusedItemError(Result.INVALID_PARAM6_Y)


def keep_fence_item(item: StoredItem) -> StoredItem:
    """Return one fence item as it reads back; whether the fence makes sense is looked at when it is whole."""
    if item.frame not in FENCE_FRAMES:
        raise RefusedItemError(Result.UNSUPPORTED_FRAME)
    if item.command in {FENCE_INCLUSION, FENCE_EXCLUSION}:
        param1 = float(_cast(item.param1, "vertex count") & 0xFF)
    elif item.command in FENCE_CIRCLES:
        if math.isnan(item.param1):
            raise VehicleKilledError("fence radius NaN")
        param1 = item.param1
    elif item.command == FENCE_RETURN_POINT:
        param1 = 0.0
    else:
        raise RefusedItemError(Result.UNSUPPORTED)
    return StoredItem(item.seq, 0, item.command, 0, 0, param1, 0.0, 0.0, 0.0, item.x, item.y, 0.0)


def fence_fault(items: Sequence[StoredItem]) -> str | None:  # noqa: PLR0911 - one return a fault, in the vehicle's order
    """Return the text with which a whole fence is refused, or None for a good one."""
    vertices_left = 0
    polygon: tuple[int, float] = (0, 0.0)
    return_points = 0
    for item in items:
        if item.command in {FENCE_INCLUSION, FENCE_EXCLUSION}:
            if item.param1 < 3:
                return f"Invalid vertex count ({item.param1:.0f})"
            if vertices_left == 0:
                polygon, vertices_left = (item.command, item.param1), int(item.param1)
            elif (item.command, item.param1) != polygon:
                return "Received incorrect vertex type"
            vertices_left -= 1
        elif vertices_left:
            return "Received incorrect type"
        elif item.command in FENCE_CIRCLES:
            if not item.param1 > 0:
                return "Non-positive circle radius"
        else:
            return_points += 1
            if return_points > 1:
                return "Multiple return points"
        if abs(item.x) > MAX_LAT_E7 or abs(item.y) > MAX_LON_E7:
            return "Bad lat or lon"
    if vertices_left:
        return "Incorrect item count"
    return None


def fence_bytes(items: Sequence[StoredItem]) -> int:
    """Return the storage a good fence needs: a header, then polygons, circles and the return point."""
    total, index = 4, 0
    while index < len(items):
        item = items[index]
        if item.command in {FENCE_INCLUSION, FENCE_EXCLUSION}:
            total += 2 + 8 * int(item.param1)
            index += int(item.param1)
        else:
            total += 13 if item.command in FENCE_CIRCLES else 9
            index += 1
    return total


def keep_rally_item(item: StoredItem) -> StoredItem:
    """Return one rally point as it reads back: whole metres above home."""
    if item.command != RALLY_POINT:
        raise RefusedItemError(Result.UNSUPPORTED)
    if item.frame not in RALLY_FRAMES:
        raise RefusedItemError(Result.UNSUPPORTED_FRAME)
    _check_position(item)
    if not -32768 <= item.z <= 32767:
        raise RefusedItemError(Result.INVALID_PARAM7)
    return StoredItem(item.seq, 3, RALLY_POINT, 0, 0, 0.0, 0.0, 0.0, 0.0, item.x, item.y, float(int(item.z)))
