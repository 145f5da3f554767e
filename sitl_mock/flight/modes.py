"""Flight modes of both firmwares: numbers as HEARTBEAT says them and names as texts say them."""

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType


class Copter(IntEnum):
    """ArduCopter's modes that the mock has; the number is ``custom_mode``."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    POSHOLD = 16
    BRAKE = 17


ARMABLE = frozenset({Copter.STABILIZE, Copter.ALT_HOLD, Copter.GUIDED, Copter.LOITER, Copter.POSHOLD})
STICK = frozenset({Copter.STABILIZE, Copter.ALT_HOLD, Copter.LOITER, Copter.POSHOLD})
"""Modes in which the throttle stick decides on the height; nobody holds it here, so it is down."""

COPTER_TITLES: Mapping[Copter, str] = MappingProxyType(
    {
        Copter.STABILIZE: "Stabilize",
        Copter.ALT_HOLD: "Altitude Hold",
        Copter.AUTO: "Auto",
        Copter.GUIDED: "Guided",
        Copter.LOITER: "Loiter",
        Copter.RTL: "RTL",
        Copter.LAND: "Land",
        Copter.POSHOLD: "Position Hold",
        Copter.BRAKE: "Brake",
    }
)


def px4_mode(main: int, sub: int = 0) -> int:
    """Return the ``custom_mode`` of PX4's main and sub mode."""
    return (main << 16) | (sub << 24)


class Px4(IntEnum):
    """PX4's modes that the mock has; the number is ``custom_mode``."""

    MANUAL = 1 << 16
    ALTITUDE = 2 << 16
    POSITION = 3 << 16
    TAKEOFF = (4 << 16) | (2 << 24)
    HOLD = (4 << 16) | (3 << 24)
    MISSION = (4 << 16) | (4 << 24)
    RETURN = (4 << 16) | (5 << 24)
    LAND = (4 << 16) | (6 << 24)


PX4_STICK = frozenset({Px4.MANUAL, Px4.ALTITUDE, Px4.POSITION})
"""Modes for a stick; nobody holds it here, so the vehicle hovers where it is."""
