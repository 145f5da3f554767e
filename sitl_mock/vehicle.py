"""The state of the vehicle that is not its mission lists: home, mode, armed or not, where it is.

Who flies it, `flight.pilot`, writes here; missions and messages read.
"""

from dataclasses import dataclass
from enum import IntEnum

from sitl_mock.firmware import Firmware


@dataclass(frozen=True, slots=True)
class Home:
    """Home as vehicles keep it: 1e-7 degrees and centimetres above mean sea level."""

    lat_e7: int
    lon_e7: int
    alt_cm: int

    @classmethod
    def from_degrees(cls, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> "Home":
        """Round degrees and metres to what is kept.

        Raises
        ------
        ValueError
            If a coordinate is outside its range.
        """
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180 and abs(alt_amsl_m) < 83_000):
            raise ValueError(
                f"home {lat_deg:g}, {lon_deg:g}, {alt_amsl_m:g} is no place: latitude, longitude, metres"
            )
        return cls(round(lat_deg * 1e7), round(lon_deg * 1e7), round(alt_amsl_m * 100))


class Landed(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


@dataclass(slots=True)
class VehicleState:
    """What HEARTBEAT, telemetry and the mission lists need to know of the vehicle.

    Attributes
    ----------
    home
        None before the vehicle has one.
    base_mode, custom_mode
        As HEARTBEAT says them.
    ready
        It has booted; before, ArduPilot has room for no item at all.
    armed
        Motors may turn.
    in_mission_mode
        AUTO (ArduPilot) or Mission (PX4) is the mode.
    mission_running, mission_finished
        The mission is being flown; it has been flown to its end.
    current_seq
        The item being flown or next to be flown.
    flying
        It is off the ground.
    landed
        As EXTENDED_SYS_STATE says it.
    mode_changes
        How often the flight mode has changed.
    """

    home: Home | None
    base_mode: int
    custom_mode: int
    ready: bool = True
    armed: bool = False
    in_mission_mode: bool = False
    mission_running: bool = False
    mission_finished: bool = False
    current_seq: int = 0
    flying: bool = False
    landed: Landed = Landed.ON_GROUND
    mode_changes: int = 0

    @classmethod
    def on_ground(cls, firmware: Firmware, home: Home | None) -> "VehicleState":
        """Return a vehicle that has just been switched on."""
        return cls(home, firmware.base_mode, firmware.custom_mode)
