"""What a pilot is told and what it tells: a command as it came, and where the vehicle is."""

import math
from dataclasses import dataclass

from sitl_mock.flight.body import Vector

FORCE = 21196
"""``param2`` of an order to arm or disarm whatever speaks against it."""


@dataclass(frozen=True, slots=True)
class Order:
    """A command as COMMAND_LONG or COMMAND_INT brings it; `x_e7` and `y_e7` are NaN where it has no place."""

    command: int
    p1: float = 0.0
    p2: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    x_e7: float = math.nan
    y_e7: float = math.nan
    z: float = math.nan
    relative: bool = True


@dataclass(frozen=True, slots=True)
class Sample:
    """Where the vehicle is and how it moves: degrees, metres, metres per second."""

    lat_e7: int
    lon_e7: int
    alt_m: float
    relative_m: float
    velocity: Vector
    heading_deg: float
    throttle: float
