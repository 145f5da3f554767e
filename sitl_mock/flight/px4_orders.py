"""The commands that PX4 takes: COMMAND_LONG and COMMAND_INT, each with the result it is answered with."""

import math
from abc import abstractmethod

from sitl_mock.flight import px4_legs as legs
from sitl_mock.flight.modes import Px4
from sitl_mock.flight.orders import FORCE, Order
from sitl_mock.flight.px4 import ACCEPTED, DENIED, REJECTED, Px4Pilot
from sitl_mock.vehicle import Landed


class Px4OrderedPilot(Px4Pilot):
    """PX4 that takes orders: `px4_mission` adds the mission."""

    def order(self, order: Order, now: float) -> tuple[int, ...]:  # noqa: PLR0911 - one return a command
        """Carry out a command."""
        match order.command:
            case 400:
                return (self._arm_or_disarm(order, now),)
            case 176:
                custom = (int(order.p2) << 16) | (int(order.p3) << 24)
                result = ACCEPTED if int(order.p1) & 1 and self.set_mode(custom, now) else REJECTED
                return (result, result) if result == ACCEPTED else (result,)
            case 300:
                return (self.start_mission(now),)
            case 22:
                return (self._order_takeoff(order, now),)
            case 20 | 21:
                mode = Px4.RETURN if order.command == 20 else Px4.LAND
                return (ACCEPTED if self.set_mode(mode, now) else REJECTED,)
            case 178:
                return (ACCEPTED if self.change_speed(order.p1, order.p2) else DENIED,)
            case 192:
                return (self._reposition(order, now),)
            case 193:
                mode = Px4.HOLD if order.p1 == 0 else Px4.MISSION
                return (ACCEPTED if self.vehicle.armed and self.set_mode(mode, now) else REJECTED,)
            case 224:
                return (ACCEPTED if self.set_current(int(order.p1), now) else DENIED,)
        return ()

    def _arm_or_disarm(self, order: Order, now: float) -> int:
        force = order.p2 == FORCE
        if order.p1 == 1:
            return self.arm(now, force=force)
        if self.vehicle.flying and not force:
            self.critical("Disarming denied: not landed\t")
            return REJECTED
        if self.vehicle.armed:
            self.text("Disarmed by external command\t")
            self.leave_mission()
            if self.vehicle.flying:
                self.fall_down(now)
            else:
                self.lay_down_arms(now)
        return ACCEPTED

    def _order_takeoff(self, order: Order, now: float) -> int:
        if not self.ready or self.vehicle.flying:
            return REJECTED
        if self.vehicle.landed == Landed.TAKEOFF:
            return ACCEPTED
        self.leave_mission()
        self.vehicle.custom_mode, self.vehicle.in_mission_mode = int(Px4.TAKEOFF), False
        self.vehicle.mode_changes += 1
        up = order.z - self.origin_alt_m if math.isfinite(order.z) else None
        if self.vehicle.armed:
            self._take_off(now, up)
        return ACCEPTED

    def _reposition(self, order: Order, now: float) -> int:
        if not self.vehicle.flying:
            return DENIED
        self.enter(Px4.HOLD, now)
        here = self.place(now)
        n, e = here[0], here[1]
        if math.isfinite(order.x_e7) and math.isfinite(order.y_e7):
            n, e = self.tangent.metres(order.x_e7, order.y_e7)
        u = order.z + (self.home_up_m if order.relative else -self.origin_alt_m)
        place = (n, e, max(u, 0.0) if math.isfinite(u) else here[2])
        if math.dist(place, here) > legs.ALTITUDE_RADIUS_M:
            self.do(now, lambda at: self.fly(place, at, self.cruise()))
        return ACCEPTED

    @abstractmethod
    def start_mission(self, now: float) -> int:
        """Carry out MISSION_START."""

    @abstractmethod
    def change_speed(self, kind: float, speed: float) -> bool:
        """Carry out DO_CHANGE_SPEED."""
