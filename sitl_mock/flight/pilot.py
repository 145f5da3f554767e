"""What both firmwares have in common in the air: place, arming, landing, mishaps, the watch on battery and fence."""

import math
import random
from abc import abstractmethod
from dataclasses import dataclass, field

from sitl_mock.firmware import Firmware
from sitl_mock.flight.agenda import FAR_S, WATCH_S, Agenda
from sitl_mock.flight.air import Wander, Wind
from sitl_mock.flight.battery import Battery
from sitl_mock.flight.body import Body, Part, Vector
from sitl_mock.flight.curves import Pieces
from sitl_mock.flight.earth import Tangent
from sitl_mock.flight.faults import FlightFaults
from sitl_mock.flight.orders import Order, Sample
from sitl_mock.flight.power import REFERENCE_MASS_KG, electric_w
from sitl_mock.flight.verticals import fall
from sitl_mock.items import StoredItem
from sitl_mock.missions import SEVERITY_CRITICAL, SEVERITY_INFO, MissionKeeper, Reached, Reply, Text
from sitl_mock.parameters import Parameters
from sitl_mock.vehicle import Home, Landed, VehicleState

PUSHED_LOOK_S = 0.1
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
EMPTY_SINK_M_S = 3.0
ITEM_S = 0.02
"""The least time an item takes: a round of the firmware's main loop. A jump back and forth costs time, too."""
MAX_DO_ITEMS = 1000
"""So many items without a place are done in a row; a jump onto itself would never end."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The world and the vehicle of one flight.

    Attributes
    ----------
    seed
        Of everything that is left to chance.
    wind
        Steady wind.
    battery_wh
        Energy when full; 0: it does not run down.
    mass_kg
        Of the vehicle with all it carries.
    faults
        What goes wrong.
    armable_s
        From power to "may be armed".
    """

    seed: int = 0
    wind: Wind = field(default_factory=Wind)
    battery_wh: float = 0.0
    mass_kg: float = REFERENCE_MASS_KG
    faults: FlightFaults = field(default_factory=FlightFaults)
    armable_s: float = 0.0

    def __post_init__(self) -> None:
        if not (0 <= self.battery_wh < 1e6 and 0 < self.mass_kg < 1e4):
            raise ValueError(
                f"battery {self.battery_wh:g} Wh and mass {self.mass_kg:g} kg must be positive and sensible"
            )


class Pilot(Agenda):
    """One vehicle in the air or on the ground; the two firmwares' pilots extend it.

    Parameters
    ----------
    firmware, vehicle, missions, parameters
        What it flies for, what it writes to, what it flies, how.
    setting
        World and vehicle.
    standing_e7
        Latitude and longitude where it stands; by default at home.
    """

    turn_rate_deg_s = 60.0
    decel = 2.5
    wander_m = (0.1, 0.03)

    def __init__(
        self,
        firmware: Firmware,
        vehicle: VehicleState,
        missions: MissionKeeper,
        parameters: Parameters,
        setting: Setting,
        standing_e7: tuple[int, int] | None = None,
    ) -> None:
        super().__init__()
        self.firmware, self.vehicle, self.missions, self.parameters = firmware, vehicle, missions, parameters
        self.setting = setting
        self.chance = random.Random(setting.seed)
        self.battery = Battery(setting.battery_wh)
        self.body = Body()
        self._wander = Wander(*self.wander_m, self.chance)
        self._heading = (0.0, 0.0, 0.0)
        self._origin = vehicle.home
        home = vehicle.home or Home(0, 0, 0)
        self.tangent = Tangent(home.lat_e7, home.lon_e7)
        if standing_e7 is not None:
            self.body = Body((*self.tangent.metres(*standing_e7), 0.0))
        self._said: list[Reply] = []
        self._booted_at: float | None = None
        self._lost_until = -FAR_S
        self._struck: set[str] = set()
        self._jumps: dict[int, int] = {}
        self._warned = False
        self.breached = False

    # Time

    def begin(self, now: float) -> None:
        """Start its clock: power is on."""
        self._booted_at = now

    # What is said

    def said(self) -> list[Reply]:
        """Return what there is to say since the last call."""
        said, self._said = self._said, []
        return said

    def text(self, text: str, severity: int = SEVERITY_INFO) -> None:
        """Say a STATUSTEXT."""
        self._said.append(Text(severity, text))

    def critical(self, text: str) -> None:
        """Say a STATUSTEXT of severity 2."""
        self.text(text, SEVERITY_CRITICAL)

    def reached(self, seq: int) -> None:
        """Say MISSION_ITEM_REACHED."""
        self._said.append(Reached(seq))

    # Where it is

    @property
    def ready(self) -> bool:
        """Whether it knows where it is."""
        return self._origin is not None and self.vehicle.ready

    def armable(self, now: float) -> bool:
        """Whether it is long enough awake and knows where it is."""
        awake = self._booted_at is not None and now >= self._booted_at + self.setting.armable_s
        return self.ready and awake and self.battery.left > 0

    @property
    def origin_alt_m(self) -> float:
        """Height above sea level of the plane that places are measured on."""
        return 0.0 if self._origin is None else self._origin.alt_cm / 100

    @property
    def home_up_m(self) -> float:
        """Height of home on that plane."""
        home = self.vehicle.home
        return 0.0 if home is None else home.alt_cm / 100 - self.origin_alt_m

    def home_place(self) -> Vector:
        """Return where home is."""
        home = self.vehicle.home
        if home is None:
            return 0.0, 0.0, 0.0
        return (*self.tangent.metres(home.lat_e7, home.lon_e7), self.home_up_m)

    def place(self, at: float) -> Vector:
        """Return where it wants to be, without what the wind does."""
        return self.body.at(at, pushed=False)[0]

    def sample(self, now: float) -> Sample | None:
        """Return where it is, None while it does not know."""
        if not self.ready or now < self._lost_until:
            return None
        (n, e, u), (vn, ve, vu) = self.body.at(now)
        if self.vehicle.flying:
            (dn, de, du), (wn, we, wu) = self._wander.at(now)
            part = min(1.0, max(u, 0.0) / 3.0)
            n, e, u = n + part * dn, e + part * de, u + part * du
            vn, ve, vu = vn + part * wn, ve + part * we, vu + part * wu
        lat_e7, lon_e7 = self.tangent.degrees_e7(n, e)
        return Sample(
            lat_e7,
            lon_e7,
            self.origin_alt_m + u,
            u - self.home_up_m + self.height_error_m(now),
            (vn, ve, vu),
            self.heading(now),
            0.0 if not self.vehicle.armed else 0.5 if self.vehicle.flying else 0.1,
        )

    def height_error_m(self, now: float) -> float:
        """Return how wrong the height above home is that it tells."""
        return 0.0

    def heading(self, at: float) -> float:
        """Return where its nose points, in degrees."""
        since, start, change = self._heading
        turned = min(abs(change), max(0.0, at - since) * self.turn_rate_deg_s)
        return (start + math.copysign(turned, change)) % 360.0

    def face(self, direction: Vector, at: float) -> None:
        """Turn the nose along a direction, if it is a level one."""
        if math.hypot(direction[0], direction[1]) > 0.2:
            now = self.heading(at)
            wanted = math.degrees(math.atan2(direction[1], direction[0]))
            self._heading = (at, now, (wanted - now + 180.0) % 360.0 - 180.0)

    def target(self, item: StoredItem, at: float) -> Vector:
        """Return the place of a mission item, no deeper than the ground, which is flat."""
        n, e = self.tangent.metres(item.x, item.y)
        u = item.z - (self.origin_alt_m if item.frame in {0, 5} else -self.home_up_m)
        return n, e, max(u, 0.0) if math.isfinite(u) else self.place(at)[2]

    # Arming, landing, the end

    def take_arms(self, at: float) -> None:
        """Arm: home is here from now on."""
        n, e, u = self.place(at)
        self.vehicle.home = Home(*self.tangent.degrees_e7(n, e), round((self.origin_alt_m + u) * 100))
        self.vehicle.armed = True
        self._warned = self.breached = False
        self.set_watch(at)

    def lift_off_at(self, at: float) -> None:
        """Leave the ground then, if it is still doing what it is doing now."""
        still = self.still_at_it()
        self.later(at, lambda due: self.lift_off(due) if still() else None)

    def stay_down(self, at: float) -> None:
        """Break off a take-off on the ground."""
        self.body.rest(at)
        self.vehicle.landed = Landed.ON_GROUND

    def lift_off(self, at: float) -> None:
        """Leave the ground."""
        if not self.vehicle.flying:
            self.vehicle.flying = True
            carried = self.setting.wind.carries(at)
            if carried is not None:
                self.body.push(carried)

    def touch_down(self, at: float) -> None:
        """Stand on the ground where it is now."""
        self.body.crash(at)
        n, e, _ = self.place(at)
        self.body.rest(at, (n, e, 0.0))
        self.vehicle.flying = False
        self.vehicle.landed = Landed.ON_GROUND

    def lay_down_arms(self, at: float) -> None:
        """Stop the motors, on the ground."""
        self.do(at)
        self.vehicle.armed = False
        self.vehicle.mission_running = False
        self.vehicle.landed = Landed.ON_GROUND
        self.end_watch()
        self.battery.power_w = 0.0
        self._struck.clear()

    def fall_down(self, at: float) -> None:
        """Motors are off in the air: it falls to the ground and stays there."""
        velocity = self.body.at(at)[1]
        self.body.crash(at)
        curve = fall(self.place(at)[2], -velocity[2])
        self.body.add(Part(at, DOWN, curve))
        speed = math.hypot(velocity[0], velocity[1])
        if speed > 0.1 and curve.end_s > 0:
            way = (velocity[0] / speed, velocity[1] / speed, 0.0)
            self.body.add(Part(at, way, Pieces(speed).poly(curve.end_s, -speed / curve.end_s)))
        self.lay_down_arms(at)
        self.do(at + curve.end_s, self._lie)

    def _lie(self, at: float) -> float:
        self.touch_down(at)
        return FAR_S

    def sink(self, at: float) -> float:
        """Come down where it is with the last of the energy, and stay there."""
        self.body.stop(at, self.decel)
        height = max(self.place(at)[2], 0.0)
        curve = Pieces().ramp(EMPTY_SINK_M_S, 1.0)
        if curve.length_m < height:
            curve.poly((height - curve.length_m) / EMPTY_SINK_M_S)
        else:
            curve = Pieces().poly(math.sqrt(2 * height / 1.5), 1.5) if height > 0 else Pieces()
        self.body.add(Part(at, DOWN, curve))
        self.vehicle.landed = Landed.LANDING
        self.vehicle.mission_running = False
        return at + curve.end_s

    # Arriving

    def calm(self, at: float) -> float:
        """Wait, as a step, until the wind no longer holds it away from where it wants to be."""
        if self.body.off_m(at) < self.radius_m:
            return at
        self.next_step(self.calm)
        return at + PUSHED_LOOK_S

    @property
    @abstractmethod
    def radius_m(self) -> float:
        """Return how near is there."""

    @abstractmethod
    def crashed(self, at: float) -> None:
        """Say what the firmware says of a crash, and fall."""

    # The watch

    def look(self, at: float) -> None:
        """Count energy, look at battery and fence."""
        if self.vehicle.flying:
            self.battery.draw(self._power_w(at - WATCH_S / 2), WATCH_S)
            if self.battery.capacity_wh > 0:
                self._watch_battery(at)
        if self.vehicle.flying and not self.breached:
            self.watch_fence(at)

    def _power_w(self, at: float) -> float:
        velocity, wind = self.body.at(at)[1], self.setting.wind.vector
        airspeed = math.hypot(velocity[0] - wind[0], velocity[1] - wind[1])
        return electric_w(self.setting.mass_kg, airspeed, velocity[2])

    def _watch_battery(self, at: float) -> None:
        if self.battery.left <= 0:
            self.do(at, self.sink, self._lie_empty)
            self.end_watch()
        elif not self._warned and self.battery.left <= self.low_battery():
            self._warned = True
            self.battery_low(at)

    def _lie_empty(self, at: float) -> float:
        self.touch_down(at)
        self.lay_down_arms(at)
        return FAR_S

    @abstractmethod
    def low_battery(self) -> float:
        """Return the share that is left when the failsafe acts."""

    @abstractmethod
    def battery_low(self, at: float) -> None:
        """Do what the firmware does then."""

    @abstractmethod
    def watch_fence(self, at: float) -> None:
        """Do what the firmware does about a fence that is broken."""

    # What it is told

    @abstractmethod
    def order(self, order: Order, now: float) -> tuple[int, ...]:
        """Carry out a command and return the results of its COMMAND_ACKs; none where it does not know it."""

    @abstractmethod
    def set_mode(self, custom_mode: int, now: float) -> bool:
        """Change the flight mode; False where that may not be."""

    def mission_changed(self, now: float) -> None:
        """Take notice of another mission in the vehicle."""

    @abstractmethod
    def set_current(self, seq: int, now: float) -> bool:
        """Go on with another item; False where there is none."""
