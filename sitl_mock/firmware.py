"""The two firmwares as data: names, numbers, times and capacities, as measured.

What needs code is beside it: `ardupilot_items` and `px4_items` (what is kept of an item), `ardupilot_missions` and
`px4_missions` (the manners of a transfer), `feasibility` (PX4's judgement after the upload).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from sitl_mock.items import MissionType

PROTOCOL_BITS = 2 | 4 | 8 | 8192 | 16384 | 32768
"""MAV_PROTOCOL_CAPABILITY: float parameters, MISSION_INT, COMMAND_INT, MAVLink 2, fence, rally."""
PARAM_BYTEWISE = 16
"""MAV_PROTOCOL_CAPABILITY: integer parameters travel as bytes in the float field."""


@dataclass(frozen=True, slots=True)
class Firmware:
    """How one firmware presents itself and how its transfers are timed.

    Attributes
    ----------
    name, title
        Key on the command line; the name people use.
    mav_autopilot
        MAV_AUTOPILOT in HEARTBEAT.
    software_version
        ``flight_sw_version`` of AUTOPILOT_VERSION: major, minor, patch and release type, a byte each.
    capabilities
        MAV_PROTOCOL_CAPABILITY bits of AUTOPILOT_VERSION: what the mock can do, not all that the firmware can.
    base_mode, custom_mode
        HEARTBEAT of a disarmed vehicle on the ground.
    mission_mode
        ``custom_mode`` in which the mission runs.
    boot_s
        From power to ready, after a reboot.
    request_retry_s, upload_timeout_s
        A request is repeated after this silence; the upload is given up after that.
    download_timeout_s
        How long a download keeps the vehicle busy without a word from its client; 0 where it never does.
    verdict_delay_s
        From the ACK of an upload to the judgement whether the mission can be flown; 0 where there is none.
    capacity
        Items of each list (ArduPilot's mission with home).
    item_pace_s
        Time from a message to its answer, as measured; an `Autopilot` answers at once unless told.
    streams
        Messages sent unasked to every link that has spoken: period in seconds by name.
    statustext_needs_heartbeat
        Texts go only to links on which a ground station's heartbeat arrives.
    old_system_zero
        Messages to target system 0 are taken for its own.
    answers_ping
        PING is answered.
    sends_events
        It speaks the events protocol.
    armable_s
        From power to "may be armed".
    reached_repeats
        How often MISSION_ITEM_REACHED is sent again, once a second.
    mode_heartbeat
        A change of flight mode sends a HEARTBEAT at once.
    """

    name: str
    title: str
    mav_autopilot: int
    software_version: int
    capabilities: int
    base_mode: int
    custom_mode: int
    mission_mode: int
    boot_s: float
    request_retry_s: float
    upload_timeout_s: float
    download_timeout_s: float
    verdict_delay_s: float
    capacity: Mapping[int, int]
    item_pace_s: float
    streams: Mapping[str, float]
    statustext_needs_heartbeat: bool
    old_system_zero: bool
    answers_ping: bool
    sends_events: bool
    armable_s: float
    reached_repeats: int
    mode_heartbeat: bool


ARDUPILOT = Firmware(
    name="ardupilot",
    title="ArduPilot",
    mav_autopilot=3,
    software_version=(4 << 24) | (7 << 16),
    capabilities=PROTOCOL_BITS,
    base_mode=81,  # custom mode enabled, stabilised, manual input: STABILIZE
    custom_mode=0,
    mission_mode=3,  # AUTO
    boot_s=2.0,
    request_retry_s=1.0,
    upload_timeout_s=8.0,
    download_timeout_s=0.0,
    verdict_delay_s=0.0,
    capacity=MappingProxyType({MissionType.MISSION: 650, MissionType.FENCE: 70, MissionType.RALLY: 46}),
    item_pace_s=0.0056,
    streams=MappingProxyType({"TIMESYNC": 10.0}),
    statustext_needs_heartbeat=False,
    old_system_zero=True,
    answers_ping=False,
    sends_events=False,
    armable_s=42.0,
    reached_repeats=0,
    mode_heartbeat=True,
)

PX4 = Firmware(
    name="px4",
    title="PX4",
    mav_autopilot=12,
    software_version=(1 << 24) | (17 << 16) | 64,  # 1.17.0, alpha
    capabilities=PROTOCOL_BITS | PARAM_BYTEWISE,
    base_mode=29,  # custom mode enabled, auto, guided, stabilised: HOLD
    custom_mode=(4 << 16) | (3 << 24),
    mission_mode=(4 << 16) | (4 << 24),
    boot_s=2.0,
    request_retry_s=0.25,
    upload_timeout_s=5.0,
    download_timeout_s=5.0,
    verdict_delay_s=0.3,
    capacity=MappingProxyType({MissionType.MISSION: 10_000, MissionType.FENCE: 64, MissionType.RALLY: 32}),
    item_pace_s=0.00045,
    streams=MappingProxyType(
        {
            "MISSION_CURRENT": 1.02,
            "SYS_STATUS": 1.0,
            "EXTENDED_SYS_STATE": 1.0,
            "GLOBAL_POSITION_INT": 0.5,
            "HOME_POSITION": 2.0,
            "BATTERY_STATUS": 2.0,
            "CURRENT_EVENT_SEQUENCE": 3.0,
        }
    ),
    statustext_needs_heartbeat=True,
    old_system_zero=False,
    answers_ping=True,
    sends_events=True,
    armable_s=10.0,
    reached_repeats=10,
    mode_heartbeat=False,
)

FIRMWARES: Mapping[str, Firmware] = MappingProxyType({"ardupilot": ARDUPILOT, "px4": PX4})
