"""What the vehicle says of itself unasked or on request: which messages, how often, with what in them.

A vehicle on the ground that stands still: there is no flight here.
"""

import struct
from collections.abc import Hashable, Mapping

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.firmware import Firmware
from sitl_mock.missions import MissionStatus
from sitl_mock.vehicle import VehicleState
from sitl_mock.wire import Message

DATA_STREAMS: Mapping[int, tuple[str, ...]] = {
    0: ("SYS_STATUS", "MISSION_CURRENT", "GLOBAL_POSITION_INT", "BATTERY_STATUS", "EXTENDED_SYS_STATE"),
    2: ("SYS_STATUS", "MISSION_CURRENT"),
    6: ("GLOBAL_POSITION_INT",),
    12: ("BATTERY_STATUS",),
}
"""MAV_DATA_STREAM: all, extended status, position, extra 3: what a REQUEST_DATA_STREAM turns on."""

QUADROTOR = 2
LANDED_ON_GROUND = 1
STANDBY, ACTIVE = 3, 4
ARMED = 128
UNKNOWN_U16 = 65535


class Telemetry:
    """Writes each message of one vehicle; None where there is nothing to say yet."""

    def __init__(self, firmware: Firmware, vehicle: VehicleState, system_id: int) -> None:
        self._firmware = firmware
        self._vehicle = vehicle
        self._system_id = system_id

    def names(self) -> Mapping[int, str]:
        """Return the messages that can be asked for, by message id."""
        return REQUESTABLE

    def message(self, name: str, uptime_s: float, status: MissionStatus) -> tuple[Message, bytes] | None:
        """Return a message and its extension bytes, or None where the vehicle does not know (no home yet)."""
        boot_ms = int(uptime_s * 1000) & 0xFFFFFFFF
        vehicle = self._vehicle
        home = vehicle.home
        if name == "MISSION_CURRENT":
            return self._mission_current(status)
        if name == "TIMESYNC":
            return mavlink.MAVLink_timesync_message(0, int(uptime_s * 1e9)), b""
        if name in {"GLOBAL_POSITION_INT", "HOME_POSITION"}:
            if home is None:
                return None
            lat, lon, alt_mm = home.lat_e7, home.lon_e7, home.alt_cm * 10
            if name == "HOME_POSITION":
                level = [1.0, 0.0, 0.0, 0.0]
                return mavlink.MAVLink_home_position_message(lat, lon, alt_mm, 0, 0, 0, level, 0, 0, 0), b""
            return mavlink.MAVLink_global_position_int_message(boot_ms, lat, lon, alt_mm, 0, 0, 0, 0, 0), b""
        return self._fixed(name), b""

    def _fixed(self, name: str) -> Message:
        if name == "HEARTBEAT":
            return self.heartbeat()
        if name == "AUTOPILOT_VERSION":
            return self._autopilot_version()
        if name == "EXTENDED_SYS_STATE":
            return mavlink.MAVLink_extended_sys_state_message(0, LANDED_ON_GROUND)
        if name == "SYS_STATUS":
            return mavlink.MAVLink_sys_status_message(0, 0, 0, 120, 16200, -1, 100, 0, 0, 0, 0, 0, 0)
        cells = [4050] * 4 + [UNKNOWN_U16] * 6
        return mavlink.MAVLink_battery_status_message(0, 1, 1, 32767, cells, -1, 0, -1, 100)

    def heartbeat(self) -> Message:
        """Return HEARTBEAT: a quadrotor."""
        vehicle = self._vehicle
        base_mode = vehicle.base_mode | (ARMED if vehicle.armed else 0)
        state = ACTIVE if vehicle.armed else STANDBY
        return mavlink.MAVLink_heartbeat_message(
            QUADROTOR, self._firmware.mav_autopilot, base_mode, vehicle.custom_mode, state, 3
        )

    def _autopilot_version(self) -> Message:
        version = self._firmware.software_version
        return mavlink.MAVLink_autopilot_version_message(
            self._firmware.capabilities, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, self._system_id
        )

    @staticmethod
    def _mission_current(status: MissionStatus) -> tuple[Message, bytes]:
        message = mavlink.MAVLink_mission_current_message(status.seq, status.total, status.state, status.mode)
        return message, struct.pack("<3I", *status.ids)


REQUESTABLE: Mapping[int, str] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: "HEARTBEAT",
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: "SYS_STATUS",
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: "GLOBAL_POSITION_INT",
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: "MISSION_CURRENT",
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: "BATTERY_STATUS",
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: "AUTOPILOT_VERSION",
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: "HOME_POSITION",
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: "EXTENDED_SYS_STATE",
}


class Schedule:
    """When each link gets each message: the firmware's own streams and what a link has asked for."""

    def __init__(self, defaults: Mapping[str, float]) -> None:
        self._defaults = defaults
        self._links: dict[Hashable, dict[str, tuple[float, float]]] = {}
        self._next: float | None = None

    def links(self) -> list[Hashable]:
        """Return the links that have spoken."""
        return list(self._links)

    def greet(self, link: Hashable, now: float) -> None:
        """Start the firmware's own streams on a link that speaks for the first time."""
        if link not in self._links:
            self._links[link] = {name: (now + period, period) for name, period in self._defaults.items()}
            self._changed()

    def set_period(self, link: Hashable, name: str, period_s: float | None, now: float) -> None:
        """Send a message every so often (None: as by default; 0 or less: never)."""
        streams = self._links.setdefault(link, {})
        period = self._defaults.get(name, 0.0) if period_s is None else period_s
        if period > 0:
            streams[name] = (now, period)
        else:
            streams.pop(name, None)
        self._changed()

    def period(self, link: Hashable, name: str) -> float | None:
        """Return how often a link gets a message, None for never."""
        known = self._links.get(link, {}).get(name)
        return None if known is None else known[1]

    def due(self, now: float) -> list[tuple[Hashable, str]]:
        """Return what is to be sent by now, each once however late it is."""
        if self._next is None or now < self._next:
            return []
        ready: list[tuple[Hashable, str]] = []
        for link, streams in self._links.items():
            for name, (at, period) in streams.items():
                if now >= at:
                    streams[name] = (at + period if at + period > now else now + period, period)
                    ready.append((link, name))
        self._changed()
        return ready

    def next_timer(self) -> float | None:
        """Return when the next message is due."""
        return self._next

    def _changed(self) -> None:
        times = (at for streams in self._links.values() for at, _ in streams.values())
        self._next = min(times, default=None)

    def forget(self, link: Hashable) -> None:
        """Stop all streams of a link that is gone."""
        self._links.pop(link, None)
        self._changed()
