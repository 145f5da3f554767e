"""How long a mission will take and what it will cost, item by item, before anybody flies it. Pure.

What a phase takes is in `mavplan.mission.phases`; here the items of a mission are walked as a vehicle would.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mavplan.energy import RotaryWing
from mavplan.geo import LocalPlane
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.phases import NOT_FLOWN, Flown, Phases, Vehicle
from mavplan.mission.wind import Wind

Floats = NDArray[np.float64]
End = Literal["rtl", "land", "stay"]

STOPPING = frozenset({Command.NAV_LOITER_TIME, Command.NAV_LOITER_UNLIM, Command.NAV_LAND})
"""Commands that end a leg at rest; a waypoint without a hold is flown through, where a leg follows."""

HORIZONTAL = frozenset({Command.NAV_WAYPOINT, *STOPPING})
"""Commands to which a leg leads. A take-off climbs where it is."""


@dataclass(frozen=True, slots=True)
class ItemForecast:
    """What one item of a mission takes, its way there included.

    Attributes
    ----------
    item
        Index among the items, counted from 0 without home.
    command
        MAV_CMD.
    seconds
        Of each phase; a take-off's wait is climb, what settles at the end of a leg cruise, a landing's last seconds
        until the motors stop descent.
    energy_wh
        The same in watt-hours; None where the vehicle's mass is not known.
    done_s
        From the start of the mission until it is complete.
    used_wh
        Energy until then.
    """

    item: int
    command: int
    seconds: Phases
    energy_wh: Phases | None
    done_s: float
    used_wh: float | None


@dataclass(frozen=True, slots=True)
class Forecast:
    """A whole mission, from its start until the motors stop; until its last place is reached where it stays there.

    Attributes
    ----------
    items
        One for each item of the mission, in its order.
    """

    items: tuple[ItemForecast, ...]

    @property
    def seconds(self) -> Phases:
        """Sums of each phase; hover is the holds and the pauses of a return."""
        return sum((item.seconds for item in self.items), Phases())

    @property
    def energy_wh(self) -> Phases | None:
        """Sums of each phase in watt-hours, or None."""
        known = [item.energy_wh for item in self.items if item.energy_wh is not None]
        return sum(known, Phases()) if len(known) == len(self.items) else None

    @property
    def takeoff_s(self) -> float:
        """From the start of the mission until the climb is over."""
        return math.fsum(i.seconds.total for i in self.items if i.command == Command.NAV_TAKEOFF)

    @property
    def legs_s(self) -> tuple[float, ...]:
        """One for each point that is flown to: from the one before it, the first from home, until its hold begins."""
        legs = (item for item in self.items if item.command in HORIZONTAL)
        return tuple(
            item.seconds.total - item.seconds.hover for item in legs if item.command != Command.NAV_LAND
        )

    @property
    def end_s(self) -> float:
        """Return and landing until the motors stop, landing at the last place, or 0."""
        ends = (Command.NAV_RETURN_TO_LAUNCH, Command.NAV_LAND)
        return math.fsum(item.seconds.total for item in self.items if item.command in ends)

    @property
    def hover_s(self) -> float:
        """Sum of the holds; the pauses of a return belong to the flight."""
        pausing = Command.NAV_RETURN_TO_LAUNCH
        return math.fsum(item.seconds.hover for item in self.items if item.command != pausing)

    @property
    def flight_s(self) -> float:
        """All but the holds."""
        return self.mission_s - self.hover_s

    @property
    def mission_s(self) -> float:
        """From the start to the end."""
        return self.items[-1].done_s if self.items else 0.0

    @property
    def used_wh(self) -> float | None:
        """Energy from the start to the end, or None."""
        return self.items[-1].used_wh if self.items else None

    def hold_begins_s(self, item: int) -> float:
        """Return when the hold of an item begins, on the clock of the mission."""
        return self.items[item].done_s - self.items[item].seconds.hover


def forecast_mission(
    mission: Mission,
    *,
    rules: AutopilotRules,
    acceleration_m_s2: float | None = None,
    rotor: RotaryWing | None = None,
    wind: Wind | None = None,
) -> Forecast:
    """Forecast a mission from its items.

    Parameters
    ----------
    mission
        Without jumps; its first leg begins at home. Altitudes above terrain count as above home.
    rules
        The autopilot; beyond its default speed limit a greater speed changes nothing, and what no item says is its
        own cruise speed.
    acceleration_m_s2
        Of the legs and of the return; 0 reaches speed at once, None is the autopilot's measured law.
    rotor
        What flying costs; None where that is not known.
    wind
        None for still air.

    Returns
    -------
    Forecast

    Raises
    ------
    ValueError
        The mission jumps.
    """
    home = mission.home
    plane = LocalPlane(home.lat_e7 / 1e7, home.lon_e7 / 1e7)
    placed = [item for item in mission.items if item.command in HORIZONTAL]
    places = (
        iter(plane.to_xy_m([i.lat_deg for i in placed], [i.lon_deg for i in placed])) if placed else iter(())
    )
    steps = [
        _Step(
            item.command,
            tuple(next(places).tolist()) if item.command in HORIZONTAL else None,
            _height_m(item, home),
            _hold_s(item),
            item.params[1] if item.command == Command.DO_CHANGE_SPEED else 0.0,
        )
        for item in mission.items
    ]
    return _walk(steps, Vehicle(rules, acceleration_m_s2, rotor, wind), (0.0, 0.0))


def forecast(
    stops_m: ArrayLike,
    holds_s: Sequence[float | None] | Floats,
    *,
    rules: AutopilotRules,
    altitude_m: float,
    speed_m_s: float,
    acceleration_m_s2: float | None = None,
    end: End = "rtl",
    home_xy: tuple[float, float] = (0.0, 0.0),
    rotor: RotaryWing | None = None,
) -> Forecast:
    """Forecast a mission from its stops, before there are items: take-off, an item a point, the end.

    Parameters
    ----------
    stops_m
        (M, 2) metres east and north, in flying order.
    holds_s
        (M,) holds as the autopilot stores them; None: a point that is only turned at.
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
    rotor
        What flying costs; None where that is not known.

    Returns
    -------
    Forecast

    Raises
    ------
    ValueError
        ``stops_m`` and ``holds_s`` do not fit together.
    """
    stops = np.asarray(stops_m, dtype=np.float64).reshape(-1, 2)
    if len(stops) != len(holds_s):
        raise ValueError(f"{len(stops)} stops and {len(holds_s)} holds")
    steps = [
        _Step(Command.DO_CHANGE_SPEED, speed_m_s=speed_m_s),
        _Step(Command.NAV_TAKEOFF, height_m=altitude_m),
    ]
    for (east_m, north_m), hold_s in zip(stops.tolist(), holds_s, strict=True):
        command = Command.NAV_WAYPOINT if hold_s is None else Command.NAV_LOITER_TIME
        steps.append(_Step(command, (east_m, north_m), altitude_m, hold_s or 0.0))
    if end == "rtl":
        steps.append(_Step(Command.NAV_RETURN_TO_LAUNCH))
    elif end == "land":
        last = (float(stops[-1, 0]), float(stops[-1, 1])) if len(stops) else home_xy
        steps.append(_Step(Command.NAV_LAND, last))
    return _walk(steps, Vehicle(rules, acceleration_m_s2, rotor), home_xy)


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
    return _apart(distance_m, speed_m_s, Vehicle(rules, acceleration_m_s2))[0]


def leg_energy_wh(
    distance_m: ArrayLike,
    *,
    rules: AutopilotRules,
    speed_m_s: float,
    rotor: RotaryWing,
    acceleration_m_s2: float | None = None,
) -> Floats:
    """Return what legs cost from rest until the hold at their end begins: the power at each speed on the way.

    Parameters
    ----------
    distance_m, rules, speed_m_s, acceleration_m_s2
        As for `leg_time_s`.
    rotor
        The vehicle's.

    Returns
    -------
    ndarray
        Watt-hours, same shape.
    """
    return _apart(distance_m, speed_m_s, Vehicle(rules, acceleration_m_s2, rotor))[1]


def _apart(distance_m: ArrayLike, speed_m_s: float, vehicle: Vehicle) -> tuple[Floats, Floats]:
    """Return time and energy of legs that have nothing to do with one another, in the shape of their distances."""
    distance = np.asarray(distance_m, dtype=np.float64)
    steps_m = np.column_stack((distance.ravel(), np.zeros(distance.size)))
    seconds, energy_wh = vehicle.legs(steps_m, speed_m_s)
    return seconds.reshape(distance.shape), energy_wh.reshape(distance.shape)


@dataclass(frozen=True, slots=True)
class _Step:
    """An item in the plane: what it does, where it leads, how high, how long it stays, which speed it sets."""

    command: int
    to_xy: tuple[float, float] | None = None
    height_m: float = 0.0
    hold_s: float = 0.0
    speed_m_s: float = 0.0


def _walk(steps: Sequence[_Step], vehicle: Vehicle, home_xy: tuple[float, float]) -> Forecast:
    """Return the forecast of steps flown one after the other."""
    legs = iter(_level_legs(steps, vehicle, home_xy))
    flown = []
    at, height_m = home_xy, 0.0
    for step in steps:
        part = NOT_FLOWN
        match step.command:
            case Command.NAV_TAKEOFF:
                part, height_m = vehicle.take_off(step.height_m), step.height_m
            case Command.NAV_RETURN_TO_LAUNCH:
                part = vehicle.come_home(np.subtract(home_xy, at), height_m)
                at, height_m = home_xy, 0.0
            case Command.NAV_LAND:
                part, height_m = next(legs) + vehicle.land(height_m - step.height_m), step.height_m
            case Command.NAV_DELAY:
                part = vehicle.hover(step.hold_s)
            case Command.DO_JUMP:
                raise ValueError("a mission that jumps has no forecast")
            case command if command in HORIZONTAL:
                part = vehicle.change_height(step.height_m - height_m, next(legs))
                part, height_m = part + vehicle.hover(step.hold_s), step.height_m
        at = step.to_xy or at
        flown.append(part)
    return _summed(steps, flown, vehicle.rotor is not None)


def _level_legs(steps: Sequence[_Step], vehicle: Vehicle, home_xy: tuple[float, float]) -> list[Flown]:
    """Return what the way to each place takes at one height, all of them at once."""
    speed_m_s = vehicle.law.return_m_s
    path, speeds, through = [home_xy], [], []
    for step, leads_on in zip(steps, _leading_on(steps), strict=True):
        if step.command == Command.DO_CHANGE_SPEED and step.speed_m_s > 0:
            speed_m_s = step.speed_m_s
        if step.to_xy is not None:
            path.append(step.to_xy)
            speeds.append(speed_m_s)
            through.append(leads_on and step.command == Command.NAV_WAYPOINT and step.hold_s == 0)
    steps_m = np.diff(np.array(path), axis=0)
    seconds, energy_wh = vehicle.legs(steps_m, speeds, np.array(through, dtype=bool))
    flown = zip(seconds.tolist(), energy_wh.tolist(), strict=True)
    return [Flown(Phases(cruise=second), Phases(cruise=wh)) for second, wh in flown]


def _leading_on(steps: Sequence[_Step]) -> list[bool]:
    """Return for each step whether the next one, changes of speed aside, leads to another place in flight."""
    found, leads = [], False
    for step in reversed(steps):
        found.append(leads)
        if step.command != Command.DO_CHANGE_SPEED:
            leads = step.command in HORIZONTAL and step.command != Command.NAV_LAND
    return found[::-1]


def _summed(steps: Sequence[_Step], flown: Sequence[Flown], known: bool) -> Forecast:
    clock_s = accumulate(part.seconds.total for part in flown)
    used_wh = accumulate(part.energy_wh.total for part in flown)
    return Forecast(
        tuple(
            ItemForecast(
                index,
                step.command,
                part.seconds,
                part.energy_wh if known else None,
                done_s,
                wh if known else None,
            )
            for index, (step, part, done_s, wh) in enumerate(zip(steps, flown, clock_s, used_wh, strict=True))
        )
    )


def _height_m(item: MissionItem, home: HomePosition) -> float:
    above_sea = item.frame in (Frame.GLOBAL, Frame.GLOBAL_INT)
    return item.alt_m - home.alt_amsl_m if above_sea and item.has_position else item.alt_m


def _hold_s(item: MissionItem) -> float:
    holding = (Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME, Command.NAV_DELAY)
    # NaN means none on PX4.
    return item.params[0] if item.command in holding and item.params[0] > 0 else 0.0
