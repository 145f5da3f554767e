"""How the autopilots fly: their constants, in one place.

A leg is flown from rest to rest with a limit on speed, acceleration and jerk (an S-curve, `mavplan.mission.motion`),
plus a time to settle until the hold begins; a point without a hold is flown through (`mavplan.mission.turning`). The
constants are default parameters where the firmware names them; the rest was read from recorded flights in simulation
(ArduCopter 4.7.0-dev of July 2025; PX4 main of 2025-08-18, SIH quadrotor; times of the vehicle's own clock).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavplan.mission.model import Autopilot


@dataclass(frozen=True, slots=True)
class FlightLaw:
    """Times and limits of one autopilot with its default parameters.

    Attributes
    ----------
    acceleration_m_s2, jerk_m_s3
        Of horizontal legs.
    start_lag_s
        From the order to fly a leg until the S-curve begins.
    nearing_loss_s, nearing_s
        What a long leg loses by nearing its speed slowly, and how long that takes (by the factor e); 0 for neither.
    settle_s
        From the end of the S-curve to the beginning of the hold, where there is no arrival radius.
    arrival_radius_m
        Within this distance of its end the hold begins, still moving; 0 where it settles.
    turn
        How a point without a hold is flown through: the next leg begins while this one ends (``blend``), or the
        corner is taken as fast as its circle allows (``slow``).
    turn_radius_m
        How far from the point the way may pass.
    turn_acceleration_m_s2
        Limit on acceleration in the corner.
    turn_wait_s
        What a slow corner costs until the nose of the way points along the next leg.
    takeoff_ground_s
        From the start of the mission to leaving the ground.
    climb_end_s_per_m_s
        What slows beginning and end of a take-off, for each m/s of its climb.
    climb_slow_m_s, climb_slow_below_m
        Speed of the climb below a height; no slow part where the height is 0.
    climb_m_s, climb_acceleration_m_s2, climb_jerk_m_s3
        Of the climb above that; at once where the acceleration is infinite.
    return_m_s
        Cruise speed of a return to launch, which obeys no DO_CHANGE_SPEED.
    return_height_m
        A return flies at this height or the present one, whichever is greater.
    return_wait_s
        Pauses of a return: before it moves and above home.
    descent
        Pairs (height m, speed m/s) from high to low: below this height, this speed; the first has height infinity.
    landing_slow_s
        What slows beginning and end of a descent to the ground.
    landing_ground_s
        From touching the ground until the motors stop.
    airspeed_limit_m_s
        The most that is made through the air.
    """

    acceleration_m_s2: float
    jerk_m_s3: float
    start_lag_s: float
    nearing_loss_s: float
    nearing_s: float
    settle_s: float
    arrival_radius_m: float
    turn: Literal["blend", "slow"]
    turn_radius_m: float
    turn_acceleration_m_s2: float
    turn_wait_s: float
    takeoff_ground_s: float
    climb_end_s_per_m_s: float
    climb_slow_m_s: float
    climb_slow_below_m: float
    climb_m_s: float
    climb_acceleration_m_s2: float
    climb_jerk_m_s3: float
    return_m_s: float
    return_height_m: float
    return_wait_s: float
    descent: tuple[tuple[float, float], ...]
    landing_slow_s: float
    landing_ground_s: float
    airspeed_limit_m_s: float = 11.8  # ArduPilot: against 6 m/s it was left with 5.8; of PX4 it is assumed


ARDUPILOT_LAW = FlightLaw(
    acceleration_m_s2=2.5,  # WPNAV_ACCEL
    jerk_m_s3=1.0,  # WPNAV_JERK
    start_lag_s=0.0,
    nearing_loss_s=0.0,
    nearing_s=0.0,
    settle_s=0.85,  # mean of eight measured legs of 20 to 300 m at 3 to 10 m/s; each within 0.2 s
    arrival_radius_m=0.0,
    turn="blend",
    turn_radius_m=2.0,  # WPNAV_RADIUS
    turn_acceleration_m_s2=5.0,  # WPNAV_ACCEL_C 0: twice WPNAV_ACCEL
    turn_wait_s=0.0,
    takeoff_ground_s=2.7,  # 30 m in 18.2 s, leaving the ground 2.8 s after the start
    climb_end_s_per_m_s=0.0,
    climb_slow_m_s=1.0,
    climb_slow_below_m=0.0,
    climb_m_s=2.5,  # WPNAV_SPEED_UP
    climb_acceleration_m_s2=1.0,  # WPNAV_ACCEL_Z
    climb_jerk_m_s3=1.0,  # read from the recorded climb
    return_m_s=10.0,  # RTL_SPEED 0: that of WPNAV_SPEED
    return_height_m=15.0,  # RTL_ALT
    return_wait_s=5.9,  # RTL_LOIT_TIME 5 s, and 0.9 s before it moves
    descent=((np.inf, 1.5), (10.0, 0.5)),  # WPNAV_SPEED_DN, LAND_SPEED below LAND_ALT_LOW
    landing_slow_s=1.5,
    landing_ground_s=2.1,
)

PX4_LAW = FlightLaw(
    acceleration_m_s2=3.0,  # MPC_ACC_HOR
    jerk_m_s3=4.0,  # MPC_JERK_AUTO
    start_lag_s=0.5,  # these three: recorded, three quarters of the speed at once and the rest within some 20 s
    nearing_loss_s=1.5,
    nearing_s=6.5,
    settle_s=0.0,
    arrival_radius_m=2.0,  # NAV_ACC_RAD as recorded
    turn="slow",
    turn_radius_m=2.0,
    turn_acceleration_m_s2=1.5,  # MPC_XY_TRAJ_P 0.5 of MPC_ACC_HOR: 1.7 m/s round a right angle, as recorded
    turn_wait_s=1.3,  # recorded: about 1.7 m/s until it is round the corner
    takeoff_ground_s=4.0,
    climb_end_s_per_m_s=1.27,  # 30 m in 21.5 s recorded, 20 to 22 s over several flights
    climb_slow_m_s=1.5,  # MPC_TKO_SPEED
    climb_slow_below_m=10.0,  # MPC_LAND_ALT1
    climb_m_s=2.75,  # recorded; MPC_Z_V_AUTO_UP is 3
    climb_acceleration_m_s2=np.inf,
    climb_jerk_m_s3=np.inf,
    return_m_s=5.0,  # MPC_XY_CRUISE
    return_height_m=30.0,  # recorded: no climb at 30 m
    return_wait_s=0.0,
    descent=((np.inf, 1.5), (10.0, 1.0), (5.0, 0.6)),  # recorded; MPC_Z_V_AUTO_DN, MPC_LAND_ALT1 and _ALT2
    landing_slow_s=1.8,
    landing_ground_s=5.8,  # recorded: 3.8 s to "Landing detected", 2 s to disarm (COM_DISARM_LAND)
)

LAWS: dict[Autopilot, FlightLaw] = {"ardupilot": ARDUPILOT_LAW, "px4": PX4_LAW}
