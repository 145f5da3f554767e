"""How ArduCopter flies a mission: item by item from its list, which may change under it.

An item is reported reached when it is complete. Items without a place are done in between; where one follows, only
its number is reported. A place where nothing holds the vehicle is flown through.
"""

import math
from dataclasses import dataclass

from sitl_mock.flight import ardupilot_legs as legs
from sitl_mock.flight.agenda import FAR_S
from sitl_mock.flight.ardupilot import ACCEPTED, DENIED, FAILED, THERE_M
from sitl_mock.flight.ardupilot_orders import ArduPilotOrderedPilot
from sitl_mock.flight.body import Part, Vector, minus, unit
from sitl_mock.flight.curves import Pieces, s_curve
from sitl_mock.flight.item_steps import ItemSteps
from sitl_mock.flight.modes import Copter
from sitl_mock.flight.orders import Order
from sitl_mock.flight.pilot import MAX_DO_ITEMS
from sitl_mock.items import MissionType, StoredItem
from sitl_mock.missions import SEVERITY_WARNING

WAYPOINT, LOITER_UNLIM, LOITER_TURNS, LOITER_TIME, RTL, LAND, TAKEOFF = 16, 17, 18, 19, 20, 21, 22
LOITER_TO_ALT, SPLINE, DELAY, JUMP, CHANGE_SPEED = 31, 82, 93, 177, 178
NAVIGATION = frozenset(
    {WAYPOINT, LOITER_UNLIM, LOITER_TURNS, LOITER_TIME, RTL, LAND, TAKEOFF, LOITER_TO_ALT, SPLINE, DELAY}
)
FLOWN_THROUGH_TO = frozenset({WAYPOINT, LOITER_UNLIM, LOITER_TIME, SPLINE})
SAYS_REACHED = frozenset({WAYPOINT, LOITER_TIME, SPLINE, LOITER_TURNS, DELAY})
NAMES = {
    WAYPOINT: "WP",
    LOITER_UNLIM: "LoitUnlim",
    LOITER_TURNS: "LoitTurns",
    LOITER_TIME: "LoitTime",
    RTL: "RTL",
    LAND: "Land",
    TAKEOFF: "Takeoff",
    LOITER_TO_ALT: "LoitAltitude",
    SPLINE: "SplineWP",
    DELAY: "Delay",
    112: "CondDelay",
    114: "CondDist",
    115: "CondYaw",
    CHANGE_SPEED: "ChangeSpeed",
    179: "SetHome",
    181: "SetRelay",
    183: "SetServo",
    206: "SetCamTrigDst",
    211: "Gripper",
}
TURN_S = 18.0
"""A turn of LOITER_TURNS at 20 degrees a second; the mock hovers instead."""


@dataclass(frozen=True, slots=True)
class _Leg:
    """A leg of the mission that is in the body already."""

    seq: int
    place: Vector
    way: Vector
    start_s: float
    target: Pieces
    arrive_s: float
    finish_s: float
    speed: float
    accel: float


class ArduPilotMissionPilot(ItemSteps, ArduPilotOrderedPilot):
    """ArduCopter with its mission."""

    _speed: legs.Limits | None = None
    _ahead: _Leg | None = None
    _paused = False

    # Starting and leaving

    def may_fly_mission(self) -> bool:
        """Refuse AUTO without a mission, and armed on the ground without a take-off."""
        if self.missions.size() <= 1:
            self.text("Mode change to Auto failed: init failed", SEVERITY_WARNING)
            return False
        if self.vehicle.armed and not self.vehicle.flying and not self._starts_with_takeoff():
            self.critical("Auto: Missing Takeoff Cmd")
            return False
        return True

    def _starts_with_takeoff(self) -> bool:
        items = self.missions.stored(MissionType.MISSION)[1:]
        first = next((item for item in items if item.command in NAVIGATION), None)
        return first is not None and first.command == TAKEOFF

    def start_mission(self, order: Order, now: float) -> int:
        """Switch to AUTO and take off; disarmed it answers 0 whatever there is."""
        if order.p1 != 0 or order.p2 != 0:
            return DENIED
        if not self.vehicle.armed:
            if self.missions.size() > 1:
                self.set_mode(Copter.AUTO, now)
            return ACCEPTED
        if self.mode != Copter.AUTO and not self.set_mode(Copter.AUTO, now):
            return FAILED
        if not self.vehicle.mission_running:
            self.resume_mission(now)
        return ACCEPTED

    def resume_mission(self, at: float) -> None:
        """Fly the item it was at, from its beginning."""
        seq = 1 if self.vehicle.mission_finished else max(self.vehicle.current_seq, 1)
        self.vehicle.mission_finished, self._paused = False, False
        self.vehicle.mission_running = True
        self.go_on(seq, None, at)

    def leave_mission(self) -> None:
        """Forget the leg ahead; the item number stays."""
        super().leave_mission()
        self._ahead, self._speed, self._paused = None, None, False

    def set_current(self, seq: int, now: float) -> bool:
        """Fly another item now, if the mission is being flown."""
        if not 0 <= seq < max(self.missions.size(), 1):
            return False
        self.vehicle.current_seq = seq
        if self.vehicle.mission_running:
            self.go_on(max(seq, 1), None, now)
        return True

    def pause(self, now: float, *, stop: bool) -> bool:
        """Hover within AUTO, or fly the item again."""
        if self.mode != Copter.AUTO or not self.vehicle.flying or not self.vehicle.mission_running:
            return False
        if stop and not self._paused:
            self.halt(now)
            self._ahead = None
            self.do(now)
        elif not stop and self._paused:
            self.go_on(max(self.vehicle.current_seq, 1), None, now)
        self._paused = stop
        return True

    def change_speed(self, kind: float, speed: float) -> bool:
        """Remember a speed for the legs that come."""
        if not speed > 0:
            return False
        old = self._speed or self.limits()
        level = min(speed, legs.FASTEST_M_S)
        if kind in {0, 1}:
            self._speed = legs.Limits(level, old.up, old.down, old.accel)
        elif kind == 2:
            self._speed = legs.Limits(old.level, speed, old.down, old.accel)
        elif kind == 3:
            self._speed = legs.Limits(old.level, old.up, speed, old.accel)
        else:
            return False
        return True

    # From item to item

    def go_on(self, seq: int, done: int | None, at: float) -> None:
        """Do the items without a place from `seq` on, report, and begin the next one with a place."""
        between: list[StoredItem] = []
        item = self.missions.item(seq)
        for _ in range(MAX_DO_ITEMS):
            if item is None or item.command in NAVIGATION:
                break
            onward = self.jump(item) if item.command == JUMP else None
            if item.command != JUMP:
                between.append(item)
                if item.command == CHANGE_SPEED:
                    self.change_speed(item.param1, item.param2)
            seq = seq + 1 if onward is None else onward
            item = self.missions.item(seq)
        else:
            item = None
        if between or done is not None:
            self.reached(between[-1].seq if between else done or 0)
        if done is not None and self._says_reached(done):
            self.text(f"Reached command #{done}")
        for step in between:
            self.text(f"Mission: {step.seq} {NAMES.get(step.command, f'Cmd{step.command}')}")
        if item is None:
            self._complete(at)
            return
        self.vehicle.current_seq = seq
        self._nav_command = item.command
        self.text(f"Mission: {seq} {NAMES[item.command]}")
        self._begin(item, at)

    _nav_command = 0

    def _says_reached(self, seq: int) -> bool:
        return self._nav_command in SAYS_REACHED

    def _complete(self, at: float) -> None:
        """End the mission: hover, or disarm on the ground."""
        self.vehicle.mission_running, self.vehicle.mission_finished = False, True
        self.vehicle.current_seq, self._ahead, self._speed = 0, None, None
        self._jumps.clear()
        self.do(at)
        if self.vehicle.flying:
            if self.body.at(at, pushed=False)[1] != (0.0, 0.0, 0.0):
                self.halt(at)
        elif self.vehicle.armed:
            self.disarm(at)

    def _begin(self, item: StoredItem, at: float) -> None:
        seq = item.seq
        if item.command not in {TAKEOFF, DELAY}:
            self.lift_off(at)

        def hold(seconds: float) -> None:
            self.do(
                at,
                lambda begun: self._leg(item, begun),
                self.calm,
                self.hold_step(seq, seconds),
                self.leave_step(seq),
            )

        match item.command:
            case 22:
                up = self.target(item, at)[2]
                delay_s = 0.0 if self.vehicle.flying else legs.TAKEOFF_DELAY_S
                self.do(
                    at, self.takeoff(up, delay_s), self.in_air, self.hold_step(seq, 0.0), self.leave_step(seq)
                )
            case 16 | 19:
                hold(item.param1)
            case 18:
                hold(item.param1 * TURN_S)
            case 82 | 31:
                hold(item.param1 if item.command == SPLINE else 0.0)
            case 17:
                hold(FAR_S)
            case 93:
                self.do(at, self.hold_step(seq, max(item.param1, 0.0)), self.leave_step(seq))
            case 20:
                self._speed = None
                self.do(at, *self.return_steps(), self.leave_step(seq))
            case 21:
                self.do(
                    at,
                    lambda begun: self._land_place(item, begun),
                    self.calm,
                    *self.landing_steps(),
                    self.leave_step(seq),
                )

    # Legs

    def _target(self, item: StoredItem, at: float, before: Vector) -> Vector:
        n, e, u = self.target(item, at)
        return (before[0], before[1], u) if item.x == 0 and item.y == 0 else (n, e, u)

    def _land_place(self, item: StoredItem, at: float) -> float:
        n, e, _ = self._target(item, at, self.aim)
        return self.fly((n, e, self.aim[2]), at, self._speed or self.limits())

    def _leg(self, item: StoredItem, at: float) -> float:
        place = self._target(item, at, self.aim)
        leg, self._ahead = self._ahead, None
        if leg is None or leg.seq != item.seq or leg.place != place:
            if math.dist(self.aim, place) < THERE_M:
                return at
            through = self._through(item, place, at)
            if through is None:
                return self.fly(place, at, self._speed or self.limits())
            leg = self._set_out(item, place, at)
            self.face(leg.way, at)
        else:
            through = self._through(item, place, at)
        self.aim = place
        return leg.finish_s if through is None else self._roll_on(leg, through, at)

    def _through(self, item: StoredItem, place: Vector, at: float) -> tuple[StoredItem, Vector] | None:
        """Return the next item with its place if this one is flown through on the way there."""
        if item.command not in {WAYPOINT, SPLINE} or item.param1 > 0:
            return None
        seq = item.seq + 1
        after = self.missions.item(seq)
        while after is not None and after.command not in NAVIGATION and after.command != JUMP:
            seq += 1
            after = self.missions.item(seq)
        if after is None or after.command not in FLOWN_THROUGH_TO:
            return None
        next_place = self._target(after, at, place)
        return None if math.dist(place, next_place) < THERE_M else (after, next_place)

    def _set_out(self, item: StoredItem, place: Vector, at: float) -> _Leg:
        """Begin a leg that will be flown through, from rest."""
        start = self.body.stop(at, self.decel)
        way = unit(minus(place, start))
        speed, accel = self.along(self._speed or self.limits(), way)
        target = s_curve(math.dist(start, place), speed, accel, legs.JERK)
        arrive = legs.START_LAG_S + target.end_s + legs.THROUGH_LAG_S
        self.body.add(
            Part(at, way, legs.Followed(target.length_m, target, legs.START_LAG_S, arrive, 0.0, 0.0))
        )
        return _Leg(item.seq, place, way, at, target, at + arrive, math.inf, speed, accel)

    def _roll_on(self, leg: _Leg, through: tuple[StoredItem, Vector], at: float) -> float:
        """Add the next leg, which begins before this one ends; return when this one counts as finished."""
        item, place = through
        way = unit(minus(place, leg.place))
        speed, accel = self.along(self._speed_after(leg.seq), way)
        stops = self._through(item, place, at) is None
        length = math.dist(leg.place, place)
        swing, rest = self.swing(speed) if stops else (0.0, 0.0)
        target = s_curve(length, speed, accel, legs.JERK)
        overlap = legs.overlap_s(
            leg.target, target, (leg.way, way), self.radius_m, min(leg.speed, speed), min(leg.accel, accel)
        )
        start = leg.arrive_s - overlap
        finish = start + target.end_s + legs.FINISH_LAG_S - legs.START_LAG_S - legs.THROUGH_LAG_S
        arrive = finish - legs.SWING_S if stops else start + target.end_s
        flown = s_curve(length + swing, speed, accel, legs.JERK)
        self.body.add(Part(start, way, legs.Followed(length, flown, 0.0, arrive - start, swing, rest)))
        self.face(way, start)
        self._ahead = _Leg(item.seq, place, way, start, target, arrive, finish, speed, accel)
        return leg.arrive_s - overlap / 2

    def _speed_after(self, seq: int) -> legs.Limits:
        """Return the limits that hold behind an item: a DO_CHANGE_SPEED may come first."""
        kept, found = self._speed, self._speed or self.limits()
        item = self.missions.item(seq + 1)
        while item is not None and item.command not in NAVIGATION:
            if item.command == CHANGE_SPEED:
                self.change_speed(item.param1, item.param2)
                found = self._speed or found
            item = self.missions.item(item.seq + 1)
        self._speed = kept
        return found
