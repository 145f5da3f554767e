"""One table of what the two autopilots do differently, as mavplan's side needs to know it.

Measured on ArduCopter 4.7.0-dev (July 2025, SITL) and PX4 main (2025-08-18, SIH quadrotor), each with its default
parameters. Nothing here is used by the mock vehicle, which has a table of its own.
"""

import math
from dataclasses import dataclass

from mavplan.mission.model import Autopilot, Frame


@dataclass(frozen=True, slots=True)
class AutopilotRules:
    """How one firmware wants its missions.

    Attributes
    ----------
    name, title
        Key in files and on the command line; the name people use.
    mav_autopilot
        MAV_AUTOPILOT in HEARTBEAT and in ``.plan``.
    home_on_wire
        Item 0 of a transfer is home and not flown.
    hold_step_s, min_hold_s, max_hold_s
        Resolution, least and greatest hold that is stored as meant.
    bare_frame
        Frame of items without a position.
    current_on_first
        Item 0 must carry ``current=1``, else the vehicle keeps its old index.
    loiter_param4
        param4 of LOITER_TIME: what keeps the heading harmless.
    default_speed_limit_m_s
        Cruise speed beyond which default parameters change nothing.
    max_first_leg_m
        Distance of the first stop beyond which the autopilot warns; infinite where it does not.
    measured_items
        Items, home counted where it is one, beyond which it refused a mission in simulation; boards hold fewer, or more
        where a memory card is used.
    hover_error_m
        How far off its place, in any direction, it may be while a hold is counted.
    """

    name: Autopilot
    title: str
    mav_autopilot: int
    home_on_wire: bool
    hold_step_s: float
    min_hold_s: float
    max_hold_s: float
    bare_frame: Frame
    current_on_first: bool
    loiter_param4: float
    default_speed_limit_m_s: float
    max_first_leg_m: float
    measured_items: int
    hover_error_m: float


ARDUPILOT = AutopilotRules(
    name="ardupilot",
    title="ArduPilot",
    mav_autopilot=3,
    home_on_wire=True,
    hold_step_s=1.0,
    min_hold_s=1.0,
    max_hold_s=65535.0,
    bare_frame=Frame.GLOBAL,
    current_on_first=False,
    loiter_param4=0.0,
    default_speed_limit_m_s=10.0,
    max_first_leg_m=math.inf,
    measured_items=650,
    hover_error_m=1.0,  # 0.73 m was the most, over the ground
)

PX4 = AutopilotRules(
    name="px4",
    title="PX4",
    mav_autopilot=12,
    home_on_wire=False,
    hold_step_s=0.1,
    min_hold_s=0.1,
    max_hold_s=65535.0,
    bare_frame=Frame.MISSION,
    current_on_first=True,
    loiter_param4=math.nan,
    default_speed_limit_m_s=10.0,
    max_first_leg_m=10_000.0,
    measured_items=10_000,
    hover_error_m=3.0,  # the hold counts from 2 m away, the height was up to 1.8 m off
)

AUTOPILOTS: dict[Autopilot, AutopilotRules] = {"ardupilot": ARDUPILOT, "px4": PX4}
