"""What a HEARTBEAT and an AUTOPILOT_VERSION say, in words: flight modes, versions, capabilities.

https://ardupilot.org/copter/docs/parameters.html#fltmode1,
https://github.com/PX4/PX4-Autopilot/blob/main/src/modules/commander/px4_custom_mode.h,
https://mavlink.io/en/messages/common.html#MAV_PROTOCOL_CAPABILITY
"""

from typing import Any

from pymavlink.dialects.v20 import common

from mavplan.mission.model import Autopilot

CUSTOM_MODE = 0x01
"""MAV_MODE_FLAG: ``custom_mode`` means something."""

_ARDUCOPTER = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 5: "LOITER", 6: "RTL", 7: "CIRCLE", 9: "LAND",
    11: "DRIFT", 13: "SPORT", 14: "FLIP", 15: "AUTOTUNE", 16: "POSHOLD", 17: "BRAKE", 18: "THROW", 19: "AVOID_ADSB",
    20: "GUIDED_NOGPS", 21: "SMART_RTL", 22: "FLOWHOLD", 23: "FOLLOW", 24: "ZIGZAG", 25: "SYSTEMID",
    26: "AUTOROTATE", 27: "AUTO_RTL", 28: "TURTLE",
}  # fmt: skip
_PX4_MAIN = {
    1: "MANUAL", 2: "ALTITUDE", 3: "POSITION", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE",
}  # fmt: skip
_PX4_AUTO = {
    1: "READY", 2: "TAKEOFF", 3: "HOLD", 4: "MISSION", 5: "RETURN", 6: "LAND", 8: "FOLLOW_TARGET",
    9: "PRECISION_LAND", 10: "VTOL_TAKEOFF",
}  # fmt: skip
_RELEASE = {0: "development", 64: "alpha", 128: "beta", 192: "release candidate", 255: ""}
_PX4_AUTO_MODE = 4
_CAPABILITY = "MAV_PROTOCOL_CAPABILITY_"

MISSION_STATES = {
    0: "unknown",
    1: "no mission, or none that can be flown",
    2: "not started",
    3: "running",
    4: "paused",
    5: "finished",
}
"""MISSION_STATE of MISSION_CURRENT."""


def mode_name(autopilot: Autopilot, base_mode: int, custom_mode: int) -> str:
    """Return the flight mode's name, or its number where it is none of those known."""
    if not base_mode & CUSTOM_MODE:
        return f"base mode {base_mode}"
    if autopilot == "ardupilot":
        return _ARDUCOPTER.get(custom_mode, f"mode {custom_mode}")
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    if main == _PX4_AUTO_MODE:
        return _PX4_AUTO.get(sub, f"AUTO {sub}")
    return _PX4_MAIN.get(main, f"mode {main}")


def version_words(flight_sw_version: int) -> str:
    """Return for instance ``4.7.0 development``."""
    major, minor, patch, kind = (flight_sw_version >> shift & 0xFF for shift in (24, 16, 8, 0))
    release = _RELEASE.get(kind, f"type {kind}")
    return f"{major}.{minor}.{patch} {release}".rstrip()


def capability_names(bits: int) -> tuple[str, ...]:
    """Return the names of MAV_PROTOCOL_CAPABILITY bits in lower case, for instance ``mission_int``."""
    known: dict[int, Any] = common.enums["MAV_PROTOCOL_CAPABILITY"]
    return tuple(
        entry.name.removeprefix(_CAPABILITY).lower()
        for value, entry in sorted(known.items())
        if entry.name.startswith(_CAPABILITY) and value.bit_count() == 1 and bits & value
    )
