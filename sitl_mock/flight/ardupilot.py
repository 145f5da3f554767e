"""ArduCopter in the air: what arms it, what its modes do, how it takes off, returns and lands.

Its orders are in `ardupilot_orders`, its mission in `ardupilot_mission`. Measured on ArduCopter 4.7.0-dev (July 2025)
in simulation.
"""

import math
from abc import abstractmethod

from sitl_mock.feasibility import breaks_fence
from sitl_mock.flight import ardupilot_legs as legs
from sitl_mock.flight.agenda import FAR_S, Step
from sitl_mock.flight.battery import CELLS
from sitl_mock.flight.body import Part, Vector, minus, unit
from sitl_mock.flight.curves import Pieces
from sitl_mock.flight.modes import ARMABLE, COPTER_TITLES, STICK, Copter
from sitl_mock.flight.pilot import DOWN, UP, Pilot
from sitl_mock.flight.verticals import ardupilot_descent, ardupilot_takeoff
from sitl_mock.items import MissionType
from sitl_mock.missions import SEVERITY_NOTICE, SEVERITY_WARNING
from sitl_mock.vehicle import Landed

ACCEPTED, DENIED, FAILED = 0, 2, 4
TERRAIN_FRAMES = frozenset({10, 11})
THERE_M = 0.02
"""A leg shorter than this is no leg."""
RTL_PAUSE_S, RTL_LOITER_S = 0.5, 5.0
RTL_SLOPE = 3.0
LAND_DELAY_S, DISARM_S = 0.35, 2.1
STICK_DOWN_M_S = 1.5


class ArduPilotPilot(Pilot):
    """ArduCopter without orders and mission: `ardupilot_orders` and `ardupilot_mission` add those."""

    aim: Vector = (0.0, 0.0, 0.0)
    """Where the last leg led, or where it last stopped."""

    @property
    def mode(self) -> Copter:
        """Return the flight mode."""
        return Copter(self.vehicle.custom_mode)

    @property
    def radius_m(self) -> float:
        """Return WPNAV_RADIUS in metres."""
        return max(self.parameters.value("WPNAV_RADIUS") / 100, 0.1)

    def limits(self) -> legs.Limits:
        """Return what the parameters and DO_CHANGE_SPEED allow of a leg."""
        value = self.parameters.value
        return legs.Limits(
            min(value("WPNAV_SPEED") / 100, legs.FASTEST_M_S),
            value("WPNAV_SPEED_UP") / 100,
            value("WPNAV_SPEED_DN") / 100,
            value("WPNAV_ACCEL") / 100,
        )

    def halt(self, at: float) -> Vector:
        """Brake and return where it comes to rest."""
        self.aim = self.body.stop(at, self.decel)
        return self.aim

    def fly(self, place: Vector, at: float, limits: legs.Limits) -> float:
        """Begin a leg and return when it is finished: at once where the last one led here."""
        if math.dist(self.aim, place) < THERE_M:
            return at
        length = math.dist(self.aim, place)
        start = self.body.stop(at, self.decel)
        way = unit(minus(place, start))
        speed, accel = self.along(limits, way)
        swing, rest = self.swing(speed)
        curve, finish_s = legs.leg(length, math.dist(start, place), speed, accel, swing, rest)
        self.body.add(Part(at, way, curve))
        self.face(way, at)
        self.aim = place
        return at + finish_s

    def along(self, limits: legs.Limits, way: Vector) -> tuple[float, float]:
        """Return speed and acceleration along a direction, against the wind too."""
        speed, accel = limits.along(way)
        return min(speed, self.setting.wind.fastest(way)), accel

    def swing(self, speed: float) -> tuple[float, float]:
        """Return how far a leg swings over its end and where it settles, by chance."""
        share = min(1.0, speed / 8.0)
        return share * self.chance.uniform(0.45, 0.85), share * self.chance.uniform(-0.4, 0.15)

    # Arming

    def _refuses_arms(self, now: float) -> str | None:
        if not self.armable(now):
            return "Arm: Battery 1 unhealthy" if self.battery.left <= 0 else "Arm: Need Position Estimate"
        if self.mode not in ARMABLE:
            return f"Arm: {COPTER_TITLES[self.mode]} mode not armable"
        if any(item.frame in TERRAIN_FRAMES for item in self.missions.stored(MissionType.MISSION)):
            return "Arm: Terrain: waiting for data"
        return None

    def arm(self, now: float, *, force: bool) -> int:
        """Arm; the vehicle disarms itself if nothing makes it take off."""
        if self.vehicle.armed:
            return ACCEPTED
        why = self._refuses_arms(now)
        if why is not None and not (force and self.ready and self.battery.left > 0):
            self.critical(why)
            return FAILED
        self.take_arms(now)
        self.text("Arming motors")
        self.await_takeoff(now)
        return ACCEPTED

    def await_takeoff(self, at: float) -> None:
        """Stand armed, and disarm after DISARM_DELAY."""
        delay_s = self.parameters.value("DISARM_DELAY")
        if delay_s > 0:
            self.do(at, self.wait(delay_s), self.disarm)

    def disarm(self, at: float) -> float:
        """Disarm, as a step."""
        self.text("Disarming motors")
        self.lay_down_arms(at)
        self.vehicle.current_seq = 0
        self._jumps.clear()
        self.show_mode()
        return FAR_S

    def show_mode(self) -> None:
        """Keep HEARTBEAT's base mode: the guided bit tells whether it holds its position."""
        guided = self.vehicle.armed or self.mode == Copter.GUIDED
        self.vehicle.base_mode = 81 | (8 if guided and self.mode not in STICK else 0)

    # Modes

    def set_mode(self, custom_mode: int, now: float) -> bool:
        """Change the flight mode."""
        try:
            mode = Copter(custom_mode)
        except ValueError:
            return False
        if mode == self.mode:
            return True
        if mode not in {Copter.STABILIZE, Copter.ALT_HOLD, Copter.AUTO, Copter.LAND} and not self.ready:
            self.text(f"Mode change to {COPTER_TITLES[mode]} failed: requires position", SEVERITY_WARNING)
            return False
        if mode == Copter.AUTO and not self.may_fly_mission():
            return False
        self.enter(mode, now)
        return True

    def enter(self, mode: Copter, at: float) -> None:
        """Be in a mode and do what it does."""
        self.leave_mission()
        self.vehicle.custom_mode = int(mode)
        self.vehicle.in_mission_mode = mode == Copter.AUTO
        self.vehicle.mode_changes += 1
        self.show_mode()
        if not self.vehicle.armed:
            return
        if not self.vehicle.flying:
            if mode in {Copter.RTL, Copter.LAND}:
                self.do(at, self.disarm)
            elif self.vehicle.landed == Landed.TAKEOFF:
                self.stay_down(at)
                self.await_takeoff(at)
            return
        self.vehicle.landed = Landed.IN_AIR
        if mode == Copter.AUTO:
            self.resume_mission(at)
            return
        self.halt(at)
        if mode == Copter.RTL:
            self.do(at, *self.return_steps(), self.disarm)
        elif mode == Copter.LAND:
            self.do(at, *self.landing_steps(), self.disarm)
        elif mode in STICK:
            self.do(at, self._stick_down, self._touch, self.wait(DISARM_S), self.disarm)
        else:
            self.do(at)

    @abstractmethod
    def may_fly_mission(self) -> bool:
        """Return whether AUTO may be entered, and say why not."""

    @abstractmethod
    def resume_mission(self, at: float) -> None:
        """Go on with the mission, in the air."""

    def leave_mission(self) -> None:
        """Stop the mission where it is."""
        self.vehicle.mission_running = False

    # Steps

    def takeoff(self, up_m: float, delay_s: float) -> Step:
        """Return the step that climbs straight up to a height on the plane."""

        def climb(at: float) -> float:
            n, e, u = self.halt(at)
            curve, done_s = ardupilot_takeoff(up_m - u, self.limits().up, delay_s)
            self.body.add(Part(at, UP, curve))
            self.aim = (n, e, max(up_m, u))
            if not self.vehicle.flying:
                self.vehicle.landed = Landed.TAKEOFF
                self.lift_off_at(at + delay_s)
            return at + done_s

        return climb

    def in_air(self, at: float) -> float:
        """Have taken off, as a step."""
        self.vehicle.landed = Landed.IN_AIR
        return at

    def return_steps(self) -> tuple[Step, ...]:
        """Return the steps of a return: climb, fly home, wait, land."""
        to_home = (self.wait(RTL_PAUSE_S), self._climb_to_return, self._fly_home, self.calm)
        return (*to_home, self.wait(RTL_LOITER_S), *self.landing_steps())

    def landing_steps(self) -> tuple[Step, ...]:
        """Return the steps of a landing, until the vehicle knows that it stands."""
        return (self.wait(LAND_DELAY_S), self._descend, self._touch, self.wait(DISARM_S))

    def _climb_to_return(self, at: float) -> float:
        n, e, u = self.place(at)
        home = self.home_place()
        height = self.parameters.value("RTL_ALT") / 100
        cone = max(RTL_SLOPE * math.hypot(n - home[0], e - home[1]), u - home[2])
        up = max(u, home[2] + min(height, cone))
        return self.fly((n, e, up), at, self.limits()) if up > u + THERE_M * 10 else at

    def _fly_home(self, at: float) -> float:
        home = self.home_place()
        return self.fly((home[0], home[1], self.place(at)[2]), at, self.limits())

    def _descend(self, at: float) -> float:
        self.vehicle.landed = Landed.LANDING
        self.halt(at)
        curve = ardupilot_descent(max(self.place(at)[2], 0.0), self.limits().down)
        self.body.add(Part(at, DOWN, curve))
        return at + curve.end_s

    def _stick_down(self, at: float) -> float:
        self.halt(at)
        height = max(self.place(at)[2], 0.0)
        curve = Pieces().poly(1.5, STICK_DOWN_M_S / 1.5)
        curve = (
            curve.poly(max(height - curve.length_m, 0.0) / STICK_DOWN_M_S)
            if curve.length_m < height
            else (Pieces().poly(math.sqrt(2 * height), 1.0))
        )
        self.body.add(Part(at, DOWN, curve))
        return at + curve.end_s

    def _touch(self, at: float) -> float:
        self.touch_down(at)
        self.aim = self.place(at)
        return at

    # Failsafes

    def low_battery(self) -> float:
        """Return BATT_LOW_MAH as a share of BATT_CAPACITY; 0 where nothing is to be done."""
        if self.parameters.value("BATT_FS_LOW_ACT") == 0:
            return 0.0
        return self.parameters.value("BATT_LOW_MAH") / max(self.parameters.value("BATT_CAPACITY"), 1.0)

    def battery_low(self, at: float) -> None:
        """Return or land, as BATT_FS_LOW_ACT says."""
        volts, used = self.battery.cell_v * CELLS, self.battery.used_mah
        self.text(f"Battery 1 is low {volts:.2f}V used {used:.0f} mAh", SEVERITY_WARNING)
        self.text("Battery Failsafe", SEVERITY_WARNING)
        action = self.parameters.value("BATT_FS_LOW_ACT")
        if self.vehicle.landed != Landed.LANDING:
            self.enter(Copter.LAND if action == 1 else Copter.RTL, at)

    def watch_fence(self, at: float) -> None:
        """Return home outside the fence, if it is enabled."""
        value = self.parameters.value
        if not value("FENCE_ENABLE"):
            return
        kinds = int(value("FENCE_TYPE"))
        (n, e, u), _ = self.body.at(at)
        home = self.home_place()
        broken = []
        if kinds & 1 and u - home[2] > value("FENCE_ALT_MAX"):
            broken.append("Max Alt")
        if kinds & 2 and math.hypot(n - home[0], e - home[1]) > value("FENCE_RADIUS"):
            broken.append("Circle")
        fence = self.missions.stored(MissionType.FENCE)
        if kinds & 4 and fence and breaks_fence(*self.tangent.degrees_e7(n, e), fence):
            broken.append("Polygon")
        if broken:
            self.breached = True
            self.text(f"{' and '.join(broken)} fence breached", SEVERITY_NOTICE)
            if value("FENCE_ACTION") and self.mode not in {Copter.RTL, Copter.LAND}:
                self.enter(Copter.RTL, at)

    def crashed(self, at: float) -> None:
        """Fall; the crash check disarms."""
        self.critical("Crash: Disarming: AngErr=77>30, Accel=1.9<3.0")
        self.leave_mission()
        self.fall_down(at)
        self.show_mode()
