"""PX4's multicopter in the air: what arms it, what its modes do, how it takes off, returns and lands.

Its orders are in `px4_orders`, its mission in `px4_mission`. Measured on PX4 main of 2025-08-18 with its SIH quadrotor.
"""

import math
import random
from abc import abstractmethod

from sitl_mock.feasibility import breaks_fence
from sitl_mock.flight import px4_legs as legs
from sitl_mock.flight.agenda import FAR_S, Step
from sitl_mock.flight.body import Part, Vector, unit
from sitl_mock.flight.curves import Pieces
from sitl_mock.flight.modes import PX4_STICK, Px4
from sitl_mock.flight.pilot import DOWN, UP, Pilot
from sitl_mock.flight.verticals import px4_descent, px4_takeoff
from sitl_mock.items import MissionType
from sitl_mock.missions import SEVERITY_WARNING
from sitl_mock.vehicle import Landed

ACCEPTED, REJECTED, DENIED = 0, 1, 2
DETECT_TAKEOFF_S = 1.85
LAND_DELAY_S, DETECT_LAND_S, DISARM_S = 0.65, 4.3, 2.0
PREFLIGHT_DISARM_S = 10.0
JITTER_M, JITTER_S = 0.9, 0.5
"""How wrong its height above home is, and how long at a time."""
TEXT_DELAY_S = 0.05


class Px4Pilot(Pilot):
    """PX4 without orders and mission: `px4_orders` and `px4_mission` add those."""

    turn_rate_deg_s = 45.0
    decel = 2.0
    wander_m = (0.2, 0.25)

    @property
    def mode(self) -> Px4:
        """Return the flight mode."""
        return Px4(self.vehicle.custom_mode)

    @property
    def radius_m(self) -> float:
        """Return NAV_ACC_RAD."""
        return max(self.parameters.value("NAV_ACC_RAD"), 0.1)

    def height_error_m(self, now: float) -> float:
        """Return how wrong its height above home is; it jumps, as in the recordings."""
        if not self.vehicle.flying:
            return 0.0
        return random.Random(self.setting.seed * 1_000_003 + int(now / JITTER_S)).uniform(-JITTER_M, JITTER_M)

    def cruise(self) -> float:
        """Return the speed as flown where nobody changed it."""
        return legs.flown_speed(
            min(self.parameters.value("MPC_XY_CRUISE"), self.parameters.value("MPC_XY_VEL_MAX"))
        )

    def fly(self, place: Vector, at: float, speed: float, through: Vector | None = None) -> float:
        """Begin a leg and return when it is near enough.

        Parameters
        ----------
        place
            Where to.
        speed
            As flown.
        through
            The place after that, where nothing holds it at this one.
        """
        velocity = self.body.rest(at)
        here = self.place(at)
        # What it brings along in the direction of the new leg is kept, the rest is braked away.
        way = unit((place[0] - here[0], place[1] - here[1], 0.0))
        if math.dist(here[:2], place[:2]) < 1e-6:
            way = (1.0, 0.0, 0.0)
        along = max(velocity[0] * way[0] + velocity[1] * way[1], 0.0)
        rest = (velocity[0] - along * way[0], velocity[1] - along * way[1], velocity[2])
        if math.hypot(*rest) > 0.05:
            self._brake_away(rest, at)
            here = self._comes_to
            way = (
                unit((place[0] - here[0], place[1] - here[1], 0.0))
                if math.dist(here[:2], place[:2]) > 1e-6
                else way
            )
        length = math.dist(here[:2], place[:2])
        speed = min(speed, self.setting.wind.fastest(way))
        end_speed = min(self._end_speed(way, place, through, speed), speed)
        if length <= self.radius_m and along > 0:
            # The same place again: what has entered the radius goes on as it would have, without a second stop.
            curve = legs.arriving(length, along)
        else:
            curve = legs.level_leg(length, speed, along, end_speed, self.radius_m)
        if self._just_up and length > self.radius_m:
            self._just_up = False
            at += legs.AFTER_TAKEOFF_S
        self.body.add(Part(at, way, curve))
        near_s = 0.0 if length <= self.radius_m else curve.when(length - self.radius_m)
        height = place[2] - here[2]
        rise = legs.vertical_leg(height)
        if rise.length_m > 0:
            self.body.add(Part(at, UP if height > 0 else DOWN, rise))
            if abs(height) > legs.ALTITUDE_RADIUS_M:
                near_s = max(near_s, rise.when(abs(height) - legs.ALTITUDE_RADIUS_M))
        if length > self.radius_m:
            self.face(way, at)
        return at + near_s

    _comes_to: Vector = (0.0, 0.0, 0.0)
    _just_up = False

    def _brake_away(self, velocity: Vector, at: float) -> None:
        """Add the braking of a velocity that the new leg does not want."""
        speed = math.hypot(*velocity)
        stop_m = max(legs.SWING_M * min(1.0, speed / 1.8) + speed, speed * speed / 4.0)
        curve = Pieces(speed).poly(2 * stop_m / speed, -speed * speed / (2 * stop_m))
        way = unit(velocity)
        self.body.add(Part(at, way, curve))
        here = self.place(at)
        self._comes_to = (here[0] + way[0] * stop_m, here[1] + way[1] * stop_m, here[2] + way[2] * stop_m)

    def _end_speed(self, way: Vector, place: Vector, through: Vector | None, speed: float) -> float:
        slow = legs.radius_speed(speed)
        if through is None or math.dist(place[:2], through[:2]) < 1e-6:
            return slow
        onward = unit((through[0] - place[0], through[1] - place[1], 0.0))
        return max(slow, legs.corner_speed(way[0] * onward[0] + way[1] * onward[1], self.radius_m))

    def halt(self, at: float) -> None:
        """Brake and hover."""
        self.body.stop(at, self.decel)

    # Arming

    def arm(self, now: float, *, force: bool, why: str = "Armed by external command") -> int:
        """Arm; the vehicle disarms itself if it does not take off."""
        if self.vehicle.armed:
            return ACCEPTED
        ready = self.armable(now) and (self.mode != Px4.MISSION or self.missions.flyable())
        if not (ready or (force and self.ready and self.battery.left > 0)):
            self.critical("Arming denied: Resolve system health failures first\t")
            return REJECTED
        if self.mode in {Px4.RETURN, Px4.LAND}:
            self.critical("Arming denied: switch to another mode first\t")
            return REJECTED
        self.take_arms(now)
        self.text(f"{why}\t")
        self.armed_in_mode(now)
        return ACCEPTED

    def armed_in_mode(self, at: float) -> None:
        """Do what the mode does with an armed vehicle on the ground."""
        if self.mode == Px4.TAKEOFF:
            self._take_off(at)
        else:
            self.do(at, self.wait(PREFLIGHT_DISARM_S), self._disarm_preflight)

    def _disarm_preflight(self, at: float) -> float:
        self.text("Disarmed by auto preflight disarming\t")
        self.lay_down_arms(at)
        return FAR_S

    # Modes

    def set_mode(self, custom_mode: int, now: float) -> bool:
        """Change the flight mode."""
        try:
            mode = Px4(custom_mode)
        except ValueError:
            return False
        if not self.ready and mode not in PX4_STICK:
            return False
        if mode != self.mode:
            self.enter(mode, now)
        return True

    def enter(self, mode: Px4, at: float) -> None:
        """Be in a mode and do what it does."""
        self.leave_mission()
        self.vehicle.custom_mode = int(mode)
        self.vehicle.in_mission_mode = mode == Px4.MISSION
        self.vehicle.base_mode = 29 if mode not in PX4_STICK else 81
        self.vehicle.mode_changes += 1
        if not self.vehicle.armed:
            return
        if not self.vehicle.flying:
            self.stay_down(at)
            self.armed_in_mode(at)
            return
        self.vehicle.landed = Landed.IN_AIR
        if mode == Px4.MISSION:
            self.fly_mission(at)
        elif mode == Px4.RETURN:
            self.do(at, *self.return_steps())
        elif mode == Px4.LAND:
            self.text("Landing at current position\t")
            self.halt(at)
            self.do(at, *self.landing_steps())
        else:
            self.halt(at)
            self.do(at)

    @abstractmethod
    def fly_mission(self, at: float) -> None:
        """Fly the mission from the item it is at."""

    def leave_mission(self) -> None:
        """Stop the mission where it is."""
        self.vehicle.mission_running = False

    # Steps

    def climb(self, up_m: float) -> Step:
        """Return the step that takes off straight up to a height on the plane."""

        def begin(at: float) -> float:
            u = self.place(at)[2]
            delay_s = 0.0 if self.vehicle.flying else legs.TAKEOFF_DELAY_S
            curve, done_s = px4_takeoff(up_m - u, delay_s)
            self.halt(at)
            self.body.add(Part(at, UP, curve))
            if not self.vehicle.flying:
                self.vehicle.landed = Landed.TAKEOFF
                self.later(at + DETECT_TAKEOFF_S, lambda _: self.text("Takeoff detected\t"))
                self.lift_off_at(at + delay_s)
            return at + done_s

        return begin

    def in_air(self, at: float) -> float:
        """Have taken off, as a step."""
        self.vehicle.landed = Landed.IN_AIR
        self._just_up = True
        return at

    def _take_off(self, at: float, up_m: float | None = None) -> None:
        height = self.parameters.value("MIS_TAKEOFF_ALT")
        up = self.place(at)[2] + height if up_m is None else up_m
        self.text(f"Using default takeoff altitude: {height:.1f} m\t" if up_m is None else "Taking off\t")
        self.do(at, self.climb(up), self.in_air, self._hold_after_takeoff)

    def _hold_after_takeoff(self, at: float) -> float:
        self.vehicle.custom_mode = int(Px4.HOLD)
        self.vehicle.mode_changes += 1
        return FAR_S

    def return_steps(self) -> tuple[Step, ...]:
        """Return the steps of a return."""
        return (
            self._say_return,
            self._climb_to_return,
            self._fly_home,
            self.calm,
            self._say_land,
            *self.landing_steps(),
        )

    def _return_up(self, at: float) -> float:
        n, e, u = self.place(at)
        home = self.home_place()
        distance = math.hypot(n - home[0], e - home[1])
        return max(u, home[2] + min(self.parameters.value("RTL_RETURN_ALT"), distance))

    def _say_return(self, at: float) -> float:
        up = self._return_up(at)
        above, home = self.origin_alt_m + up, self.home_place()
        self.text("Returning to launch\t")
        self.later(
            at + TEXT_DELAY_S,
            lambda _: self.text(
                f"RTL: start return at {above:.0f} m ({up - home[2]:.0f} m above destination)\t"
            ),
        )
        return at

    def _climb_to_return(self, at: float) -> float:
        u, up = self.place(at)[2], self._return_up(at)
        if up < u + 0.3:
            return at
        self.halt(at)
        rise = legs.vertical_leg(up - u)
        self.body.add(Part(at, UP, rise))
        return at + rise.end_s

    def _fly_home(self, at: float) -> float:
        home = self.home_place()
        return self.fly((home[0], home[1], self.place(at)[2]), at, self.cruise())

    def _say_land(self, at: float) -> float:
        self.text("RTL: land at destination\t")
        return at

    def landing_steps(self) -> tuple[Step, ...]:
        """Return the steps of a landing until it is disarmed."""
        return (
            self._descend,
            self._touch,
            self.wait(DETECT_LAND_S),
            self._detect_land,
            self.wait(DISARM_S),
            self.disarm_landed,
        )

    def _descend(self, at: float) -> float:
        self.vehicle.landed = Landed.LANDING
        curve = px4_descent(max(self.place(at)[2], 0.0))
        self.body.add(Part(at + LAND_DELAY_S, DOWN, curve))
        return at + LAND_DELAY_S + curve.end_s

    def _touch(self, at: float) -> float:
        self.touch_down(at)
        self.vehicle.landed = Landed.LANDING
        return at

    def _detect_land(self, at: float) -> float:
        self.text("Landing detected\t")
        self.vehicle.landed = Landed.ON_GROUND
        return at

    def disarm_landed(self, at: float) -> float:
        """Disarm, as a step."""
        self.text("Disarmed by landing\t")
        self.lay_down_arms(at)
        return FAR_S

    # Failsafes

    def low_battery(self) -> float:
        """Return BAT_CRIT_THR; 0 where COM_LOW_BAT_ACT does nothing."""
        return self.parameters.value("BAT_CRIT_THR") if self.parameters.value("COM_LOW_BAT_ACT") else 0.0

    def battery_low(self, at: float) -> None:
        """Return or land, as COM_LOW_BAT_ACT says."""
        self.critical("Critical battery level\t")
        self.critical("Failsafe activated\t")
        if self.vehicle.landed != Landed.LANDING:
            self.enter(Px4.LAND if self.parameters.value("COM_LOW_BAT_ACT") == 2 else Px4.RETURN, at)

    def watch_fence(self, at: float) -> None:
        """Do what GF_ACTION says outside the fence."""
        action = int(self.parameters.value("GF_ACTION"))
        if action == 0:
            return
        (n, e, u), _ = self.body.at(at)
        home = self.home_place()
        far, high = self.parameters.value("GF_MAX_HOR_DIST"), self.parameters.value("GF_MAX_VER_DIST")
        broken = (far > 0 and math.hypot(n - home[0], e - home[1]) > far) or (high > 0 and u - home[2] > high)
        fence = self.missions.stored(MissionType.FENCE)
        if broken or (fence and breaks_fence(*self.tangent.degrees_e7(n, e), fence)):
            self.breached = True
            self.text("Geofence violation\t", SEVERITY_WARNING)
            modes = {2: Px4.HOLD, 3: Px4.RETURN, 5: Px4.LAND}
            if action in modes and self.mode not in {Px4.RETURN, Px4.LAND}:
                self.enter(modes[action], at)

    def crashed(self, at: float) -> None:
        """Fall; the failure detector ends the flight."""
        self.critical("Critical failure detected: motors stopped\t")
        self.leave_mission()
        self.fall_down(at)
