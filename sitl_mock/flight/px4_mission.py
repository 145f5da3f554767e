"""How PX4 flies a mission: from place to place, its hold counting from the first moment within the radius.

An item is reported reached when its hold is over. Items without a place are done at once when the one before them is
over; the last of them is then the one reported. A return is reported when it begins, and is another mode.
"""

import math

from sitl_mock.flight import px4_legs as legs
from sitl_mock.flight.agenda import FAR_S, Step
from sitl_mock.flight.body import Vector
from sitl_mock.flight.item_steps import ItemSteps
from sitl_mock.flight.modes import Px4
from sitl_mock.flight.pilot import MAX_DO_ITEMS
from sitl_mock.flight.px4 import ACCEPTED, DENIED, TEXT_DELAY_S
from sitl_mock.flight.px4_orders import Px4OrderedPilot
from sitl_mock.items import StoredItem

WAYPOINT, LOITER_UNLIM, LOITER_TIME, RTL, LAND, TAKEOFF, LOITER_TO_ALT = 16, 17, 19, 20, 21, 22, 31
DELAY, JUMP, CHANGE_SPEED = 93, 177, 178
PLACES = frozenset({WAYPOINT, LOITER_UNLIM, LOITER_TIME, LAND, TAKEOFF, LOITER_TO_ALT, 84, 85})
ACTING = PLACES | {RTL, DELAY}
"""Items that are flown; all others are done at once."""
VERDICT_LATER_S = 0.05


class Px4MissionPilot(ItemSteps, Px4OrderedPilot):
    """PX4 with its mission."""

    _speed: float | None = None
    _flown_revision = -1

    def armed_in_mode(self, at: float) -> None:
        """Take off where the mode is Mission."""
        if self.mode == Px4.MISSION and self.missions.flyable():
            self.fly_mission(at)
        else:
            super().armed_in_mode(at)

    def start_mission(self, now: float) -> int:
        """Switch to Mission, arm and take off: all on one command."""
        if not self.missions.flyable() or not (self.vehicle.armed or self.armable(now)):
            return DENIED
        if self.vehicle.armed:
            self.set_mode(Px4.MISSION, now)
            return ACCEPTED
        self.set_mode(Px4.MISSION, now)
        return self.arm(now, force=False, why="Armed by mission start")

    def fly_mission(self, at: float) -> None:
        """Fly the item it is at, from its beginning."""
        if self.vehicle.mission_finished:
            self.vehicle.current_seq = 0
        self.vehicle.mission_finished = False
        if self.missions.item(self.vehicle.current_seq) is None:
            self.halt(at)
            self.do(at)
            return
        self.vehicle.mission_running = True
        self._flown_revision = self.missions.revision
        self.later(at + TEXT_DELAY_S, lambda _: self.text("Executing Mission\t"))
        self.go_on(self.vehicle.current_seq, None, at)

    def leave_mission(self) -> None:
        """Leave the mission; the item number stays."""
        super().leave_mission()
        self._speed = None

    def mission_changed(self, now: float) -> None:
        """Fly another mission at once, at the same number."""
        if not self.vehicle.mission_running or self.missions.revision == self._flown_revision:
            return
        self._flown_revision = self.missions.revision
        self._jumps.clear()
        self.later(now + self.firmware.verdict_delay_s + VERDICT_LATER_S, self._heed_verdict)
        if self.missions.item(self.vehicle.current_seq) is None:
            self._finish(now)
        else:
            self.go_on(self.vehicle.current_seq, None, now)

    def _heed_verdict(self, at: float) -> None:
        """Stop flying a new mission that was judged infeasible."""
        if self.vehicle.mission_running and not self.missions.flyable():
            self.enter(Px4.HOLD, at)

    def set_current(self, seq: int, now: float) -> bool:
        """Fly another item now, if the mission is being flown."""
        if self.missions.item(seq) is None:
            return False
        self.vehicle.current_seq = seq
        self.vehicle.mission_finished = False
        if self.vehicle.mission_running:
            self.go_on(seq, None, now)
        return True

    def change_speed(self, kind: float, speed: float) -> bool:
        """Remember a speed for the legs that come; −1 is the default again."""
        if kind not in {0, 1} or math.isnan(speed):
            return kind in {2, 3}
        self._speed = legs.flown_speed(speed) if speed > 0 else None
        return True

    # From item to item

    def go_on(self, seq: int, done: int | None, at: float) -> None:
        """Do the items without a place from `seq` on, report, and begin the next one that is flown."""
        item = self.missions.item(seq)
        for _ in range(MAX_DO_ITEMS):
            if item is None or item.command in ACTING:
                break
            onward = self.jump(item) if item.command == JUMP else None
            if item.command != JUMP:
                done = seq
                if item.command == CHANGE_SPEED:
                    self.change_speed(item.param1, item.param2)
            seq = seq + 1 if onward is None else onward
            item = self.missions.item(seq)
        else:
            item = None
        if item is not None and item.command == RTL:
            self._return(seq, at)
            return
        if done is not None:
            self.reached(done)
        if item is None:
            self._finish(at)
            return
        self.vehicle.current_seq = seq
        self._begin(item, at)

    def _finish(self, at: float) -> None:
        """End the mission: hover, in another mode."""
        self.text("Mission finished, loitering\t")
        landed = not self.vehicle.flying
        self.vehicle.mission_running, self.vehicle.mission_finished = False, True
        if landed:
            return
        self.enter(Px4.HOLD, at)
        self.vehicle.mission_finished = True

    def _return(self, seq: int, at: float) -> None:
        self.vehicle.current_seq = seq
        self.text("Mission finished, loitering\t")
        self.reached(seq)
        self.vehicle.mission_running, self.vehicle.mission_finished = False, True
        if self.vehicle.flying:
            self.enter(Px4.RETURN, at)

    def _speed_now(self) -> float:
        return self.cruise() if self._speed is None else self._speed

    def _begin(self, item: StoredItem, at: float) -> None:
        seq = item.seq
        place = self.target(item, at)
        climbs: tuple[Step, ...] = ()
        if not self.vehicle.flying:
            height = place[2] - self.home_up_m
            self.later(
                at + 2 * TEXT_DELAY_S, lambda _: self.text(f"Climb to {height:.1f} meters above home\t")
            )
            climbs = (self.climb(place[2]), self.in_air)
        match item.command:
            case 22 | 84:
                self.do(
                    at,
                    *climbs,
                    self._go(place, None),
                    self.calm,
                    self.hold_step(seq, 0.0),
                    self.leave_step(seq),
                )
            case 21 | 85:
                above = self._go_above(place)
                *down, disarm = self.landing_steps()
                self.do(at, *climbs, above, self.calm, *down, self._landed(seq), disarm)
            case 93:
                self.do(at, *climbs, self.hold_step(seq, max(item.param1, 0.0)), self.leave_step(seq))
            case 17:
                self.do(at, *climbs, self._go(place, None), self.calm, self.hold_step(seq, FAR_S))
            case _:
                seconds = item.param1 if item.param1 > 0 and item.command in {WAYPOINT, LOITER_TIME} else 0.0
                through = self._after(seq, at) if seconds == 0 else None
                self.do(
                    at,
                    *climbs,
                    self._go(place, through),
                    self.calm,
                    self.hold_step(seq, seconds),
                    self.leave_step(seq),
                )

    def _go(self, place: Vector, through: Vector | None) -> Step:
        return lambda at: self.fly(place, at, self._speed_now(), through)

    def _go_above(self, place: Vector) -> Step:
        return lambda at: self.fly((place[0], place[1], self.place(at)[2]), at, self._speed_now())

    def _after(self, seq: int, at: float) -> Vector | None:
        """Return the place of the next item that has one."""
        item = self.missions.item(seq + 1)
        while item is not None and item.command not in ACTING and item.command != JUMP:
            item = self.missions.item(item.seq + 1)
        return self.target(item, at) if item is not None and item.command in PLACES else None

    def _landed(self, seq: int) -> Step:
        def landed(at: float) -> float:
            self.reached(seq)
            self.vehicle.mission_running, self.vehicle.mission_finished = False, True
            return at

        return landed
