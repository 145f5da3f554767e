"""The commands that ArduCopter takes: COMMAND_LONG and COMMAND_INT, each with the result it is answered with."""

import math
from abc import abstractmethod

from sitl_mock.flight import ardupilot_legs as legs
from sitl_mock.flight.ardupilot import ACCEPTED, DENIED, FAILED, ArduPilotPilot
from sitl_mock.flight.modes import Copter
from sitl_mock.flight.orders import FORCE, Order
from sitl_mock.vehicle import Landed

CUSTOM_MODE_ENABLED = 1


class ArduPilotOrderedPilot(ArduPilotPilot):
    """ArduCopter that takes orders: `ardupilot_mission` adds the mission."""

    def order(self, order: Order, now: float) -> tuple[int, ...]:  # noqa: PLR0911 - one return a command
        """Carry out a command."""
        match order.command:
            case 400:
                return (self._arm_or_disarm(order, now),)
            case 176:
                custom = int(order.p1) & CUSTOM_MODE_ENABLED
                return (ACCEPTED if custom and self.set_mode(int(order.p2), now) else FAILED,)
            case 300:
                return (self.start_mission(order, now),)
            case 22:
                return (self._take_off(order, now),)
            case 20 | 21:
                mode = Copter.RTL if order.command == 20 else Copter.LAND
                return (ACCEPTED if self.set_mode(mode, now) else FAILED,)
            case 178:
                return (ACCEPTED if self.change_speed(order.p1, order.p2) else FAILED,)
            case 192:
                return (self._reposition(order, now),)
            case 193:
                return (ACCEPTED if self.pause(now, stop=order.p1 == 0) else FAILED,)
            case 224:
                return (ACCEPTED if self.set_current(int(order.p1), now) else FAILED,)
        return ()

    def _arm_or_disarm(self, order: Order, now: float) -> int:
        force = order.p2 == FORCE
        if order.p1 == 1:
            return self.arm(now, force=force)
        if self.vehicle.flying and not force:
            return FAILED
        if self.vehicle.flying:
            self.text("Disarming motors")
            self.leave_mission()
            self.fall_down(now)
            self.show_mode()
        elif self.vehicle.armed:
            self.disarm(now)
        return ACCEPTED

    def _take_off(self, order: Order, now: float) -> int:
        if self.mode != Copter.GUIDED or not self.vehicle.armed or self.vehicle.flying or not order.z > 0:
            return FAILED
        if self.vehicle.landed == Landed.TAKEOFF:
            return ACCEPTED
        self.do(now, self.takeoff(self.home_up_m + order.z, legs.TAKEOFF_DELAY_S), self.in_air)
        return ACCEPTED

    def _reposition(self, order: Order, now: float) -> int:
        if self.mode != Copter.GUIDED and not int(order.p2) & 1:
            return DENIED
        if not self.vehicle.flying or not (math.isfinite(order.x_e7) and math.isfinite(order.y_e7)):
            return FAILED
        self.enter(Copter.GUIDED, now)
        n, e = self.tangent.metres(order.x_e7, order.y_e7)
        u = order.z + (self.home_up_m if order.relative else -self.origin_alt_m)
        place = (n, e, max(u, 0.0) if math.isfinite(u) else self.place(now)[2])
        self.do(now, lambda at: self.fly(place, at, self.limits()))
        return ACCEPTED

    @abstractmethod
    def start_mission(self, order: Order, now: float) -> int:
        """Carry out MISSION_START."""

    @abstractmethod
    def change_speed(self, kind: float, speed: float) -> bool:
        """Carry out DO_CHANGE_SPEED."""

    @abstractmethod
    def pause(self, now: float, *, stop: bool) -> bool:
        """Carry out DO_PAUSE_CONTINUE."""
