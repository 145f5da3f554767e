"""What the ways between home and stops take, each by itself: what a flight takes is the sum of its ways and holds.

Every stop is a point of rest, so that neither the way before it nor the one behind it changes a way. The sums are those
of `mavplan.mission.forecast`; no-fly zones are led round.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mavplan.energy import rotor_of
from mavplan.geo import LocalPlane
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.phases import Flown, Vehicle
from mavplan.mission.wind import Wind
from mavplan.scenario import sections
from mavplan.scenario.model import Floats, Scenario

HOME_M = np.zeros(2)


class Cost(NamedTuple):
    """Seconds, and watt-hours: 0 where the mass is not known."""

    seconds: float
    wh: float

    def plus(self, other: "Cost") -> "Cost":
        """Return both one after the other."""
        return Cost(self.seconds + other.seconds, self.wh + other.wh)


NOTHING = Cost(0.0, 0.0)


@dataclass(frozen=True)
class Budget:
    """What one battery gives, the reserve taken off; infinite where that is not known."""

    seconds: float = math.inf
    wh: float = math.inf

    def allows(self, cost: Cost) -> bool:
        """Return whether a flight of this cost comes home with the reserve."""
        return cost.seconds <= self.seconds and cost.wh <= self.wh


def budget_of(vehicle: sections.Vehicle) -> Budget | None:
    """Return what a battery gives; None where the scenario does not say."""
    usable = 1 - vehicle.reserve_fraction
    if vehicle.endurance_s is None and vehicle.battery_wh is None:
        return None
    return Budget(
        math.inf if vehicle.endurance_s is None else vehicle.endurance_s * usable,
        math.inf if vehicle.battery_wh is None else vehicle.battery_wh * usable,
    )


class Ways:
    """The ways between home and M stops that a vehicle may fly, each worked out once.

    Parameters
    ----------
    scenario
        The vehicle, the wind, the no-fly zones. A flight returns home, whatever ``[vehicle] end`` says.
    stops_m
        (M, 2) stops, in any order, none of them in a zone.
    """

    def __init__(self, scenario: Scenario, stops_m: Floats) -> None:
        vehicle = scenario.vehicle
        self._stops_m = stops_m
        self._height_m, self._speed_m_s = vehicle.altitude_m, vehicle.speed_m_s
        self._vehicle = Vehicle(
            AUTOPILOTS[vehicle.autopilot],
            vehicle.acceleration_m_s2,
            None if vehicle.mass_kg is None else rotor_of(vehicle.mass_kg),
            Wind.of(scenario.wind),
        )
        self._routes, self._out = None, None
        if scenario.no_fly is not None:
            from mavplan.airspace.routes import Routes
            from mavplan.airspace.zones import keep_out

            plane = LocalPlane(scenario.home.lat_deg, scenario.home.lon_deg)
            self._out = keep_out(scenario.no_fly, plane, scenario.fence_options.margin_m)
            self._routes = Routes(self._out)
        self._rows: dict[int, tuple[Floats, Floats]] = {}
        self._home: dict[int, Cost] = {}
        climb = _cost(self._vehicle.take_off(self._height_m))
        seconds, wh = self._row(-1)
        self._out_s, self._out_wh = seconds + climb.seconds, wh + climb.wh

    def __len__(self) -> int:
        """Return the number of stops."""
        return len(self._stops_m)

    def out(self, stop: int) -> Cost:
        """Return take-off, climb and the way from home to a stop."""
        return Cost(float(self._out_s[stop]), float(self._out_wh[stop]))

    def leg(self, start: int, end: int) -> Cost:
        """Return the way from one stop to another."""
        seconds, wh = self._row(start)
        return Cost(float(seconds[end]), float(wh[end]))

    def home(self, stop: int) -> Cost:
        """Return the way from a stop home until the motors stop."""
        if stop not in self._home:
            self._home[stop] = self._way_home(stop)
        return self._home[stop]

    def hold(self, seconds: float) -> Cost:
        """Return a hold."""
        return _cost(self._vehicle.hover(seconds))

    def flight(self, stops: list[int], holds_s: list[float]) -> Cost:
        """Return a whole flight over some stops in this order."""
        cost = self.out(stops[0]).plus(self.home(stops[-1]))
        for start, end in pairwise(stops):
            cost = cost.plus(self.leg(start, end))
        return cost.plus(self.hold(sum(holds_s)))

    def _way_home(self, stop: int) -> Cost:
        vehicle, here_m = self._vehicle, self._stops_m[stop]
        if self._out is None:
            return _cost(vehicle.come_home(HOME_M - here_m, self._height_m))
        seconds, wh = self._straight(here_m, HOME_M[None])
        if self._out.crossed(here_m, HOME_M[None])[0]:
            seconds, wh = self._round(here_m, HOME_M)
        return Cost(float(seconds[0]), float(wh[0])).plus(_cost(vehicle.land(self._height_m)))

    def _row(self, start: int) -> tuple[Floats, Floats]:
        """Return seconds and watt-hours of the ways from a stop, or from home (-1), to every stop."""
        if start not in self._rows:
            start_m = HOME_M if start < 0 else self._stops_m[start]
            seconds, wh = self._straight(start_m, self._stops_m)
            if self._out is not None:
                for end in np.flatnonzero(self._out.crossed(start_m, self._stops_m)):
                    ((seconds[end],), (wh[end],)) = self._round(start_m, self._stops_m[end])
            self._rows[start] = seconds, wh
        return self._rows[start]

    def _straight(self, start_m: Floats, ends_m: Floats) -> tuple[Floats, Floats]:
        seconds, wh = self._vehicle.legs(ends_m - start_m, self._speed_m_s)
        return seconds, np.nan_to_num(wh)

    def _round(self, start_m: Floats, end_m: Floats) -> tuple[Floats, Floats]:
        """Return what the shortest way round the zones takes; infinite where there is none."""
        turns = None if self._routes is None else self._routes.between(start_m, end_m)
        if turns is None:
            return np.array([math.inf]), np.array([math.inf])
        steps_m = np.diff(np.array([start_m, *turns, end_m]), axis=0)
        through = np.arange(len(steps_m)) < len(turns)
        seconds, wh = self._vehicle.legs(steps_m, self._speed_m_s, through)
        return np.array([seconds.sum()]), np.nan_to_num(np.array([wh.sum()]))


def _cost(flown: Flown) -> Cost:
    wh = flown.energy_wh.total
    return Cost(flown.seconds.total, 0.0 if math.isnan(wh) else wh)
