"""What a bound on mission time needs to know of a scenario: needs, rates, and how fast any mission can be flown."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.phases import Vehicle as Flyer
from mavplan.mission.wind import Wind
from mavplan.radio import REACH_TOLERANCE_M, Channel
from mavplan.scenario.model import UNPAIRED, Users
from mavplan.scenario.sections import Service, Vehicle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHORT_M, LONG_M, FARTHEST_M = 3.0, 30.0, 1000.0
"""Legs below the first are left aside: no autopilot's forecast is exact to that. Between the second and the third the
time that a leg takes beyond its way is as good as the same."""


@dataclass(frozen=True, eq=False)
class TimeCase:
    """What a mission's time depends on, as far as a bound needs to know it.

    Attributes
    ----------
    users_xy_m, mate, need_s
        (N, 2) metres from home, (N,) mates or `UNPAIRED`, (N,) seconds of need at the rate straight below.
    channel
        Rates and R, all margins kept.
    tdma, in_flight
        One user at a time; what is received on legs counts.
    speed_m_s, return_m_s
        The most that legs are flown at, and the way home; None where the mission ends elsewhere.
    fixed_s
        Take-off and what ends the mission, but for the way home.
    steep_s_m, level_s
        A leg of d metres takes at least d/speed + min(steep·d, level), d ≥ 3 m.
    """

    users_xy_m: Floats
    mate: Ints
    need_s: Floats
    channel: Channel
    tdma: bool
    in_flight: bool
    speed_m_s: float
    return_m_s: float | None
    fixed_s: float
    steep_s_m: float
    level_s: float

    @classmethod
    def of(
        cls,
        users: Users,
        channel: Channel,
        vehicle: Vehicle,
        service: Service,
        *,
        wind: Wind | None,
        in_flight: bool,
    ) -> "TimeCase":
        """Return the case of a scenario's parts, over a plane."""
        flyer = Flyer(AUTOPILOTS[vehicle.autopilot], vehicle.acceleration_m_s2, wind=wind)
        fixed_s = flyer.take_off(vehicle.altitude_m).seconds.total + ending_s(flyer, vehicle)
        best_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(np.zeros(1))[0])
        steep_s_m, level_s = slow_legs(flyer, vehicle.speed_m_s)
        return cls(
            users.xy_m,
            users.mate,
            users.demand_bit / best_bit_s,
            channel,
            service.mode == "tdma",
            in_flight,
            top_speed_m_s(flyer, vehicle.speed_m_s),
            top_speed_m_s(flyer, flyer.law.return_m_s) if vehicle.end == "rtl" else None,
            fixed_s,
            steep_s_m,
            level_s,
        )

    def beside_s(self, share: float) -> float:
        """Return what every mission takes beside its way at full speed and its tolls.

        d/v + min(steep·d, level) is concave and 0 at 0, so legs take no less in all than one leg as long as all of
        them, and they are no shorter than to within R of the farthest user whose mate is no nearer.
        """
        away_m = np.linalg.norm(self.users_xy_m, axis=1)
        away_m = np.where(self.mate == UNPAIRED, away_m, np.minimum(away_m, away_m[self.mate]))
        least_m = max(float(away_m.max()) - self.channel.radius_m - REACH_TOLERANCE_M, 0.0)
        return self.fixed_s + (1.0 - share) * min(self.steep_s_m * least_m, self.level_s)


def ending_s(flyer: Flyer, vehicle: Vehicle) -> float:
    """Return what ends the mission, but for the way home: seconds that no plan changes."""
    if vehicle.end == "rtl":
        return flyer.come_home(np.zeros(2), vehicle.altitude_m).seconds.total
    return flyer.land(vehicle.altitude_m).seconds.total if vehicle.end == "land" else 0.0


def top_speed_m_s(flyer: Flyer, asked_m_s: float) -> float:
    """Return the most that a leg is flown at: what is asked within the autopilot's limit, less against any wind."""
    most = min(asked_m_s, flyer.rules.default_speed_limit_m_s)
    if flyer.wind is None or flyer.wind.from_deg is not None:
        return most
    step = np.array([[1.0, 0.0]])
    return float(flyer.wind.ground_m_s(step, np.array([most]), flyer.law.airspeed_limit_m_s)[0])


def slow_legs(flyer: Flyer, asked_m_s: float) -> tuple[float, float]:
    """Return seconds by the metre and at most that legs take beyond their way at full speed, in the kindest wind."""
    metres = np.concatenate([np.linspace(SHORT_M, LONG_M, 100), np.geomspace(LONG_M, FARTHEST_M, 100)])
    steps = np.stack([metres, np.zeros(len(metres))], axis=1)
    still = (
        flyer
        if flyer.wind is None or flyer.wind.from_deg is None
        else Flyer(flyer.rules, flyer.acceleration_m_s2)
    )
    more = still.legs(steps, asked_m_s)[0] - metres / top_speed_m_s(still, asked_m_s)
    steep, level = (more / metres)[metres <= LONG_M].min(), more[metres >= LONG_M].min()
    return max(float(steep), 0.0), max(float(level), 0.0)
