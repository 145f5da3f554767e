"""What the vehicle says of itself unasked or on request: which messages, how often, with what in them."""

import math
import struct
from collections.abc import Callable, Hashable, Mapping
from typing import NamedTuple

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.firmware import Firmware
from sitl_mock.flight.battery import CELLS
from sitl_mock.flight.orders import Sample
from sitl_mock.flight.pilot import Pilot
from sitl_mock.missions import MissionKeeper, MissionStatus
from sitl_mock.vehicle import VehicleState
from sitl_mock.wire import Message

STREAMS = {
    "status": ("SYS_STATUS", "MISSION_CURRENT", "GPS_RAW_INT"),
    "position": ("GLOBAL_POSITION_INT",),
    "extra1": ("ATTITUDE",),
    "extra2": ("VFR_HUD",),
    "extra3": ("BATTERY_STATUS", "SYSTEM_TIME"),
}
DATA_STREAMS: Mapping[int, tuple[str, ...]] = {
    0: sum(STREAMS.values(), ()),
    2: STREAMS["status"],
    6: STREAMS["position"],
    10: STREAMS["extra1"],
    11: STREAMS["extra2"],
    12: STREAMS["extra3"],
}
"""MAV_DATA_STREAM: all, extended status, position, extras: what a REQUEST_DATA_STREAM turns on."""

QUADROTOR = 2
STANDBY, ACTIVE = 3, 4
ARMED = 128
UNKNOWN_U16 = 65535
SENSORS = 0x0320_402F
"""MAV_SYS_STATUS_SENSOR of a healthy vehicle: gyroscope, accelerometer, compass, barometer, GPS, attitude and more."""
PREARM_CHECK = 0x1000_0000
FIX_3D = 3
EPOCH_US = 1_790_000_000_000_000
"""The vehicle's clock starts here: its seconds are those of the driver, not of the day."""


class _Now(NamedTuple):
    """When a message is written, and of whom."""

    boot_ms: int
    now: float
    pilot: Pilot


class Telemetry:
    """Writes each message of one vehicle; None where there is nothing to say yet."""

    def __init__(self, firmware: Firmware, vehicle: VehicleState, system_id: int) -> None:
        self._firmware = firmware
        self._vehicle = vehicle
        self._system_id = system_id
        self._writers: Mapping[str, Callable[[_Now], Message | None]] = {
            "GLOBAL_POSITION_INT": self._position,
            "GPS_RAW_INT": self._gps,
            "VFR_HUD": self._hud,
            "ATTITUDE": self._attitude,
            "SYS_STATUS": self._sys_status,
            "BATTERY_STATUS": self._battery,
        }

    def names(self) -> Mapping[int, str]:
        """Return the messages that can be asked for, by message id."""
        return REQUESTABLE

    def message(
        self, name: str, uptime_s: float, now: float, missions: MissionKeeper, pilot: Pilot
    ) -> tuple[Message, bytes] | None:
        """Return a message and its extension bytes, or None where the vehicle does not know (no home yet)."""
        if name == "MISSION_CURRENT":
            return self._mission_current(missions.status())
        writer = self._writers.get(name)
        if writer is not None:
            message = writer(_Now(int(uptime_s * 1000) & 0xFFFFFFFF, now, pilot))
        else:
            message = self._plain(name, uptime_s)
        return None if message is None else (message, b"")

    def _plain(self, name: str, uptime_s: float) -> Message | None:
        """Write a message that does not depend on the flight."""
        boot_ms = int(uptime_s * 1000)
        match name:
            case "TIMESYNC":
                message = mavlink.MAVLink_timesync_message(0, int(uptime_s * 1e9))
            case "SYSTEM_TIME":
                message = mavlink.MAVLink_system_time_message(EPOCH_US + boot_ms * 1000, boot_ms & 0xFFFFFFFF)
            case "HEARTBEAT":
                message = self.heartbeat()
            case "AUTOPILOT_VERSION":
                message = self._autopilot_version()
            case "EXTENDED_SYS_STATE":
                message = mavlink.MAVLink_extended_sys_state_message(0, self._vehicle.landed)
            case _:
                message = self._home_position()
        return message

    def _home_position(self) -> Message | None:
        home = self._vehicle.home
        if home is None:
            return None
        level = [1.0, 0.0, 0.0, 0.0]
        return mavlink.MAVLink_home_position_message(
            home.lat_e7, home.lon_e7, home.alt_cm * 10, 0, 0, 0, level, 0, 0, 0
        )

    def heartbeat(self) -> Message:
        """Return HEARTBEAT: a quadrotor."""
        vehicle = self._vehicle
        base_mode = vehicle.base_mode | (ARMED if vehicle.armed else 0)
        active = vehicle.armed and (vehicle.flying or not self._firmware.mode_heartbeat)
        return mavlink.MAVLink_heartbeat_message(
            QUADROTOR,
            self._firmware.mav_autopilot,
            base_mode,
            vehicle.custom_mode,
            ACTIVE if active else STANDBY,
            3,
        )

    @staticmethod
    def _position(asked: _Now) -> Message | None:
        at = asked.pilot.sample(asked.now)
        if at is None:
            return None
        north, east, up = (_cm(speed) for speed in at.velocity)
        return mavlink.MAVLink_global_position_int_message(
            asked.boot_ms,
            at.lat_e7,
            at.lon_e7,
            round(at.alt_m * 1000),
            round(at.relative_m * 1000),
            north,
            east,
            -up,
            round(at.heading_deg * 100) % 36000,
        )

    @staticmethod
    def _gps(asked: _Now) -> Message:
        at = asked.pilot.sample(asked.now)
        if at is None:
            return mavlink.MAVLink_gps_raw_int_message(
                asked.boot_ms * 1000, 1, 0, 0, 0, UNKNOWN_U16, UNKNOWN_U16, 0, UNKNOWN_U16, 0
            )
        course = math.degrees(math.atan2(at.velocity[1], at.velocity[0])) % 360
        return mavlink.MAVLink_gps_raw_int_message(
            asked.boot_ms * 1000,
            FIX_3D,
            at.lat_e7,
            at.lon_e7,
            round(at.alt_m * 1000),
            121,
            200,
            min(round(_level(at) * 100), UNKNOWN_U16),
            round(course * 100) % 36000,
            10,
        )

    @staticmethod
    def _hud(asked: _Now) -> Message | None:
        at = asked.pilot.sample(asked.now)
        if at is None:
            return None
        speed = _level(at)
        wind = asked.pilot.setting.wind.vector
        air = math.hypot(at.velocity[0] - wind[0], at.velocity[1] - wind[1])
        heading, throttle = round(at.heading_deg) % 360, round(at.throttle * 100)
        return mavlink.MAVLink_vfr_hud_message(air, speed, heading, throttle, at.alt_m, at.velocity[2])

    @staticmethod
    def _attitude(asked: _Now) -> Message:
        yaw = math.radians((asked.pilot.heading(asked.now) + 180) % 360 - 180)
        return mavlink.MAVLink_attitude_message(asked.boot_ms, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)

    def _sys_status(self, asked: _Now) -> Message:
        battery = asked.pilot.battery
        health = SENSORS | (PREARM_CHECK if self._vehicle.armed or asked.pilot.armable(asked.now) else 0)
        volts_mv, tens_ma = round(battery.cell_v * CELLS * 1000), round(battery.current_a * 100)
        return mavlink.MAVLink_sys_status_message(
            SENSORS | PREARM_CHECK,
            SENSORS | PREARM_CHECK,
            health,
            120,
            volts_mv,
            tens_ma,
            battery.percent,
            0,
            0,
            0,
            0,
            0,
            0,
        )

    @staticmethod
    def _battery(asked: _Now) -> Message:
        battery = asked.pilot.battery
        cells = [round(battery.cell_v * 1000)] * CELLS + [UNKNOWN_U16] * (10 - CELLS)
        used_mah, used_hj = round(battery.used_mah), round(battery.used_wh * 36)
        return mavlink.MAVLink_battery_status_message(
            0, 1, 1, 32767, cells, round(battery.current_a * 100), used_mah, used_hj, battery.percent
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


def _cm(metres: float) -> int:
    return max(-32768, min(32767, round(metres * 100)))


def _level(at: Sample) -> float:
    return math.hypot(at.velocity[0], at.velocity[1])


REQUESTABLE: Mapping[int, str] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: "HEARTBEAT",
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: "SYS_STATUS",
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: "SYSTEM_TIME",
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: "GPS_RAW_INT",
    mavlink.MAVLINK_MSG_ID_ATTITUDE: "ATTITUDE",
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: "GLOBAL_POSITION_INT",
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: "MISSION_CURRENT",
    mavlink.MAVLINK_MSG_ID_VFR_HUD: "VFR_HUD",
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
        self.due = math.inf
        """When the next message is due."""

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

    def take(self, now: float) -> list[tuple[Hashable, str]]:
        """Return what is to be sent by now, each once however late it is."""
        ready: list[tuple[Hashable, str]] = []
        for link, streams in self._links.items():
            for name, (at, period) in streams.items():
                if now >= at:
                    streams[name] = (at + period if at + period > now else now + period, period)
                    ready.append((link, name))
        self._changed()
        return ready

    def _changed(self) -> None:
        times = (at for streams in self._links.values() for at, _ in streams.values())
        self.due = min(times, default=math.inf)

    def forget(self, link: Hashable) -> None:
        """Stop all streams of a link that is gone."""
        self._links.pop(link, None)
        self._changed()
