"""The few parameters the mock has: those of fence, speeds, return, battery failsafe and a lost ground station.

Defaults as measured or as the firmware ships them, but for the battery's: the firmwares do nothing about it by default.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.firmware import PARAM_BYTEWISE, Firmware
from sitl_mock.wire import Message

INT8, INT32, REAL32 = 2, 6, 9
"""MAV_PARAM_TYPE."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter's value and MAV_PARAM_TYPE."""

    value: float
    kind: int


ARDUPILOT_DEFAULTS: Mapping[str, Parameter] = {
    "BATT_CAPACITY": Parameter(0, INT32),
    "BATT_FS_LOW_ACT": Parameter(2, INT8),
    "BATT_LOW_MAH": Parameter(0.0, REAL32),
    "DISARM_DELAY": Parameter(10, INT8),
    "FENCE_ACTION": Parameter(1, INT8),
    "FENCE_ALT_MAX": Parameter(100.0, REAL32),
    "FENCE_ENABLE": Parameter(0, INT8),
    "FENCE_MARGIN": Parameter(2.0, REAL32),
    "FENCE_RADIUS": Parameter(150.0, REAL32),
    "FENCE_TOTAL": Parameter(0, INT8),
    "FENCE_TYPE": Parameter(7, INT8),
    "FS_GCS_ENABLE": Parameter(0, INT8),
    "RTL_ALT": Parameter(1500, INT32),
    "WPNAV_ACCEL": Parameter(250.0, REAL32),
    "WPNAV_RADIUS": Parameter(200.0, REAL32),
    "WPNAV_SPEED": Parameter(1000.0, REAL32),
    "WPNAV_SPEED_DN": Parameter(150.0, REAL32),
    "WPNAV_SPEED_UP": Parameter(250.0, REAL32),
}

PX4_DEFAULTS: Mapping[str, Parameter] = {
    "BAT_CRIT_THR": Parameter(0.07, REAL32),
    "COM_LOW_BAT_ACT": Parameter(3, INT32),
    "GF_ACTION": Parameter(2, INT32),
    "GF_MAX_HOR_DIST": Parameter(0.0, REAL32),
    "GF_MAX_VER_DIST": Parameter(0.0, REAL32),
    "MIS_TAKEOFF_ALT": Parameter(2.5, REAL32),
    "MPC_XY_CRUISE": Parameter(5.0, REAL32),
    "MPC_XY_VEL_MAX": Parameter(12.0, REAL32),
    "NAV_ACC_RAD": Parameter(2.0, REAL32),
    "NAV_DLL_ACT": Parameter(0, INT32),
    "RTL_RETURN_ALT": Parameter(30.0, REAL32),
}


class Parameters:
    """One vehicle's parameters and the answers to PARAM_REQUEST_READ, PARAM_REQUEST_LIST and PARAM_SET."""

    def __init__(self, firmware: Firmware) -> None:
        self._values = dict(ARDUPILOT_DEFAULTS if firmware.name == "ardupilot" else PX4_DEFAULTS)
        self._names = list(self._values)
        self._bytewise = bool(firmware.capabilities & PARAM_BYTEWISE)

    def value(self, name: str) -> float:
        """Return a parameter's value; KeyError where there is none of this name."""
        return self._values[name].value

    def put(self, name: str, value: float) -> None:
        """Change a parameter of this name from inside."""
        self._values[name] = Parameter(value, self._values[name].kind)

    def all(self) -> list[Message]:
        """Return a PARAM_VALUE for each."""
        return [self._message(name) for name in self._names]

    def read(self, name: bytes | str, index: int) -> list[Message]:
        """Return the PARAM_VALUE asked for by index, or by name where the index is −1; nothing if there is none."""
        if index >= 0:
            return [self._message(self._names[index])] if index < len(self._names) else []
        known = _text(name)
        return [self._message(known)] if known in self._values else []

    def set(self, name: bytes | str, raw: float) -> list[Message]:
        """Remember a new value and return it as PARAM_VALUE; nothing if there is no such parameter."""
        known = _text(name)
        old = self._values.get(known)
        if old is None:
            return []
        value = raw
        if old.kind != REAL32:
            value = struct.unpack("<i", struct.pack("<f", raw))[0] if self._bytewise else raw
        if abs(value) < 2**31:
            self._values[known] = Parameter(float(value) if old.kind == REAL32 else int(value), old.kind)
        return [self._message(known)]

    def _message(self, name: str) -> Message:
        parameter = self._values[name]
        raw = parameter.value
        if self._bytewise and parameter.kind != REAL32:
            raw = struct.unpack("<f", struct.pack("<i", int(raw)))[0]
        index = self._names.index(name)
        return mavlink.MAVLink_param_value_message(
            name.encode(), raw, parameter.kind, len(self._names), index
        )


def _text(name: bytes | str) -> str:
    raw = name if isinstance(name, bytes) else name.encode("utf-8", "replace")
    return raw.split(b"\0")[0].decode("ascii", "replace")
