"""How long a mission will take, phase by phase, before anybody flies it. Pure: plane positions in, seconds out.

The autopilots' constants and the motion law are in `mavplan.mission.flight_law`.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.flight_law import LAWS, FlightLaw, s_curve_time_s, trapezoid_time_s

Floats = NDArray[np.float64]
End = Literal["rtl", "land", "stay"]


@dataclass(frozen=True, slots=True)
class Forecast:
    """Seconds of each phase of a mission, from its start to the end.

    Attributes
    ----------
    takeoff_s
        From the start of the mission until the climb is over.
    legs_s
        One for each stop: from the one before it, the first from home, until its hold begins.
    end_s
        Return and landing until the motors stop (``rtl``), landing at the last stop (``land``), 0 (``stay``).
    flight_s
        Take-off, legs and end.
    hover_s
        Sum of the holds.
    mission_s
        Flight and hover.
    """

    takeoff_s: float
    legs_s: tuple[float, ...]
    end_s: float
    flight_s: float
    hover_s: float
    mission_s: float


def forecast(
    stops_m: ArrayLike,
    holds_s: ArrayLike,
    *,
    rules: AutopilotRules,
    altitude_m: float,
    speed_m_s: float,
    acceleration_m_s2: float | None = None,
    end: End = "rtl",
    home_xy: tuple[float, float] = (0.0, 0.0),
) -> Forecast:
    """Forecast a mission.

    Parameters
    ----------
    stops_m
        (M, 2) metres east and north, in flying order.
    holds_s
        (M,) holds as the autopilot stores them.
    rules
        The autopilot; beyond its default speed limit a greater speed changes nothing.
    altitude_m
        Of the stops, above home.
    speed_m_s
        Asked between stops. A return to launch flies at the autopilot's own speed.
    acceleration_m_s2
        Of the legs and of the return; 0 reaches speed at once, None is the autopilot's measured law.
    end
        What ends the mission.
    home_xy
        Where it takes off, in the plane of the stops.

    Returns
    -------
    Forecast

    Raises
    ------
    ValueError
        ``stops_m`` and ``holds_s`` do not fit together.
    """
    stops = np.asarray(stops_m, dtype=np.float64).reshape(-1, 2)
    holds = np.asarray(holds_s, dtype=np.float64).reshape(-1)
    if len(stops) != len(holds):
        raise ValueError(f"{len(stops)} stops and {len(holds)} holds")
    law = LAWS[rules.name]
    path = np.vstack((np.asarray(home_xy, dtype=np.float64), stops))
    legs = leg_time_s(
        np.hypot(*np.diff(path, axis=0).T),
        rules=rules,
        speed_m_s=speed_m_s,
        acceleration_m_s2=acceleration_m_s2,
    )
    takeoff_s = _climb_s(altitude_m, law)
    end_s = 0.0
    if end == "rtl":
        home_leg_m = math.hypot(*(path[-1] - path[0]))
        end_s = _return_s(home_leg_m, altitude_m, rules, acceleration_m_s2)
    elif end == "land":
        end_s = _descent_s(altitude_m, law)
    flight_s = math.fsum((takeoff_s, *legs.tolist(), end_s))
    hover_s = math.fsum(holds.tolist())
    return Forecast(takeoff_s, tuple(legs.tolist()), end_s, flight_s, hover_s, flight_s + hover_s)


def leg_time_s(
    distance_m: ArrayLike, *, rules: AutopilotRules, speed_m_s: float, acceleration_m_s2: float | None = None
) -> Floats:
    """Return the time of legs from rest until the hold at their end begins.

    Parameters
    ----------
    distance_m
        Any shape, not negative.
    rules
        The autopilot.
    speed_m_s
        Asked; what lies beyond the autopilot's default limit is not flown.
    acceleration_m_s2
        0 reaches speed at once; None is the autopilot's measured law.

    Returns
    -------
    ndarray
        Seconds, same shape; 0 for a distance of 0.
    """
    distance = np.asarray(distance_m, dtype=np.float64)
    flown_m_s = min(speed_m_s, rules.default_speed_limit_m_s)
    if acceleration_m_s2 is not None:
        return trapezoid_time_s(distance, flown_m_s, acceleration_m_s2)
    law = LAWS[rules.name]
    moving = s_curve_time_s(distance, flown_m_s, law.acceleration_m_s2, law.jerk_m_s3)
    return np.where(distance > 0, moving + law.settle_s, 0.0)


def _climb_s(height_m: float, law: FlightLaw) -> float:
    slow_m = min(height_m, law.climb_slow_below_m)
    fast_m = height_m - slow_m
    slow_s = slow_m / law.climb_slow_m_s
    return law.takeoff_wait_s + slow_s + _vertical_s(fast_m, law)


def _vertical_s(height_m: float, law: FlightLaw) -> float:
    if math.isinf(law.climb_acceleration_m_s2):
        return height_m / law.climb_m_s
    return float(s_curve_time_s(height_m, law.climb_m_s, law.climb_acceleration_m_s2, law.climb_jerk_m_s3))


def _return_s(
    distance_m: float, height_m: float, rules: AutopilotRules, acceleration_m_s2: float | None
) -> float:
    law = LAWS[rules.name]
    return_height_m = max(height_m, law.return_height_m)
    climb_s = _vertical_s(return_height_m - height_m, law)
    leg_s = leg_time_s(distance_m, rules=rules, speed_m_s=law.return_m_s, acceleration_m_s2=acceleration_m_s2)
    return climb_s + float(leg_s) + law.return_wait_s + _descent_s(return_height_m, law)


def _descent_s(height_m: float, law: FlightLaw) -> float:
    total_s, below_m = law.landing_s, height_m
    for (_, speed_m_s), (until_m, _) in zip(law.descent, (*law.descent[1:], (0.0, 0.0)), strict=True):
        part_m = max(below_m - until_m, 0.0)
        total_s += part_m / speed_m_s
        below_m -= part_m
    return total_s
