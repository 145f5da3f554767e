"""Mission items as they travel on the wire and as a vehicle keeps them; the words a vehicle refuses them with.

No rules of any firmware: those are in `ardupilot_items` and `px4_items`.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

INT32_MAX = 2**31 - 1
INT32_MIN = -(2**31)


class MissionType(IntEnum):
    """MAV_MISSION_TYPE: the three lists a vehicle holds, and "all of them"."""

    MISSION = 0
    FENCE = 1
    RALLY = 2
    ALL = 255


STORED_TYPES = (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY)


class Result(IntEnum):
    """MAV_MISSION_RESULT, the ``type`` of a MISSION_ACK."""

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


class RefusedItemError(Exception):
    """The vehicle does not take this item; `result` is what its MISSION_ACK says."""

    def __init__(self, result: Result) -> None:
        self.result = result
        super().__init__(f"refused: {result.name}")


class VehicleKilledError(Exception):
    """A value that ended the real simulator with a floating point exception; the message says which."""


@dataclass(frozen=True, slots=True)
class StoredItem:
    """One item with the fields of MISSION_ITEM_INT.

    ``x`` and ``y`` are 1e-7 degrees where the item has a position, ``z`` is in metres. Floats hold exactly what
    a 32-bit float of the wire holds.
    """

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

    @property
    def params(self) -> tuple[float, float, float, float]:
        """``param1`` to ``param4``."""
        return (self.param1, self.param2, self.param3, self.param4)

    def numbered(self, seq: int, *, current: int) -> "StoredItem":
        """Return the same item at another place in its list."""
        kept = (self.frame, self.command, current, self.autocontinue, *self.params)
        return StoredItem(seq, *kept, self.x, self.y, self.z)  # five times as fast as dataclasses.replace


def float32(value: float) -> float:
    """Round to the nearest 32-bit float; beyond its range to infinity."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


def clamp_int32(value: float) -> int:
    """Cut a float off to the 32-bit integers; NaN becomes the largest, which is no coordinate."""
    if math.isnan(value):
        return INT32_MAX
    return int(max(INT32_MIN, min(INT32_MAX, value)))
