"""How far a mission has been flown, from MISSION_CURRENT and MISSION_ITEM_REACHED as each autopilot sends them. No I/O.

REACHED(n) comes when item n is complete and stands for all before it: an item directly followed by a speed, or on PX4
by a return, never gets one of its own; PX4 repeats each ten times. Times are the vehicle's own clock where it tells
it, so that a simulator may run faster than we do.
"""

import math

from mavplan.flight.route import Route, Stop
from mavplan.flight.telemetry import MissionCurrent, Position
from mavplan.link.home import distance_m
from mavplan.mission.model import HomePosition

RUNNING, FINISHED = 3, 5
"""MISSION_STATE."""
ARRIVED_M = 2.0
"""The autopilots' radius of acceptance."""
SLACK_S = 3.0
"""What messages a second apart may add to a hold, or take from it."""
SLACK_SHARE = 0.05


class MissionProgress:
    """Keeps count of one flight.

    Parameters
    ----------
    route
        The mission as it was verified to be on the vehicle.
    """

    def __init__(self, route: Route) -> None:
        self.route = route
        self.current: int | None = None
        """The item it is at."""
        self.entered_s: float | None = None
        """When that was first told, on the vehicle's clock."""
        self.done_through = route.first_seq - 1
        """All items up to this one are done."""
        self.finished = False
        """It said that the mission is."""
        self.skipped: set[int] = set()
        """Items whose hold was passed over: somebody has moved the mission on."""
        self._running = False
        self._was_finished = False
        self._last_at: dict[int, float] = {}
        self._back: int | None = None
        self._arrived_s: float | None = None

    # -- what is told -----------------------------------------------------------------------------------------

    def before_start(self, mission: MissionCurrent) -> None:
        """Note what MISSION_CURRENT says on the ground, which is not about this flight."""
        self._was_finished = mission.state == FINISHED

    def on_current(self, mission: MissionCurrent, clock_s: float) -> None:
        """Take a MISSION_CURRENT of this flight."""
        self._running = self._running or mission.state == RUNNING
        if mission.state == FINISHED and (self._running or not self._was_finished):
            self.finished = True
            self._begin_end(clock_s)
            return
        seq = mission.seq
        if seq is None or not self.route.first_seq <= seq <= self.route.last_seq:
            return
        if self.current is None or seq >= self.current:
            self._back = None
            self._advance(seq, clock_s)
            self._enter(seq, clock_s)
        elif self._back == seq:  # told twice: it really went back
            self._back = None
            self._enter(seq, clock_s)
        else:
            self._back = seq

    def on_reached(self, seq: int, clock_s: float) -> None:
        """Take a MISSION_ITEM_REACHED of this flight."""
        if seq >= self.route.end_seq:
            self._begin_end(clock_s)  # PX4 says so of a return as it begins, ArduPilot when the motors stop
        elif self.route.first_seq <= seq and seq > self.done_through:
            self._advance(seq + 1, clock_s)

    def on_position(self, position: Position, clock_s: float) -> None:
        """Take a position: it may be the arrival at a stop."""
        stop = self.stop
        if stop is None or self._arrived_s is not None or self.current != stop.hold_seq:
            return
        if _away_m(position, stop) <= ARRIVED_M:
            self._arrived_s = clock_s

    def left_the_mission(self) -> None:
        """Note that another mode flies: a hold that it comes back to begins anew."""
        self._arrived_s = None

    def came_down(self) -> None:
        """Note that the mission has ended as it should: its last item is done, too."""
        self.done_through = self.route.last_seq

    def _begin_end(self, clock_s: float) -> None:
        """Every item before the end is done; the end itself is when the vehicle has come down."""
        self._advance(self.route.end_seq, clock_s)
        if self.route.end_seq <= self.route.last_seq:
            self._enter(self.route.end_seq, clock_s)

    def _advance(self, seq: int, clock_s: float) -> None:
        """Everything before an item is done."""
        jumped = seq > self.done_through + 1 and not self.route.jumps
        if jumped:
            self._look_for_skipped(seq, clock_s)
        self.done_through = max(self.done_through, seq - 1)

    def _look_for_skipped(self, seq: int, clock_s: float) -> None:
        """Find holds that cannot have been kept in the time since the vehicle was last known before them.

        The narrowest stretch that was too short is it: wider ones around it are too short only for its sake, now and
        later.
        """
        for before in sorted(self._last_at, reverse=True):
            between = [item for item in range(before + 1, seq) if item not in self.skipped]
            held_s = math.fsum(self.route.hold_s.get(item, 0.0) for item in between)
            if held_s - SLACK_S - SLACK_SHARE * held_s > clock_s - self._last_at[before]:
                self.skipped |= {item for item in between if self.route.hold_s.get(item)}
                return

    def _enter(self, seq: int, clock_s: float) -> None:
        if seq != self.current:
            self.current, self.entered_s = seq, clock_s
            stop = self.stop
            goes_there = stop is not None and stop.first_seq < stop.hold_seq == seq
            # Behind its own waypoint the hold begins as the item does; else the position tells.
            self._arrived_s = clock_s if goes_there else None
        self._last_at[seq] = clock_s

    # -- what that means --------------------------------------------------------------------------------------

    @property
    def complete(self) -> bool:
        """Whether every item before the mission's end has been flown."""
        return self.done_through >= self.route.end_seq - 1

    @property
    def at_end(self) -> bool:
        """Whether the item that ends the mission is the current one, or done."""
        if self.route.end_seq > self.route.last_seq:
            return self.finished or self.complete
        return self.finished or self.current == self.route.end_seq

    @property
    def stop(self) -> Stop | None:
        """The stop that it flies to or holds at."""
        return self.route.stop_at(self.current)

    @property
    def stops_done(self) -> tuple[Stop, ...]:
        """The stops whose holds are over, without those passed over."""
        return tuple(
            stop
            for stop in self.route.stops
            if stop.hold_seq <= self.done_through and stop.hold_seq not in self.skipped
        )

    @property
    def items_done(self) -> int:
        """Number of items that are done."""
        return min(self.done_through, self.route.last_seq) - self.route.first_seq + 1

    @property
    def holding(self) -> bool:
        """Whether it has arrived at the stop where it is to hold."""
        return self._arrived_s is not None

    def hold_left_s(self, clock_s: float) -> float | None:
        """Return the seconds left at the current stop; None where it does not hold."""
        if self.stop is None or self._arrived_s is None:
            return None
        return max(0.0, self.stop.hold_s - (clock_s - self._arrived_s))

    def left_s(self, clock_s: float) -> float:
        """Return the seconds left of the whole mission, by its forecast."""
        expected = self.route.expected_s
        here = self.current if self.current is not None else self.route.first_seq
        seq = max(here, self.done_through + 1)
        left_s = math.fsum(seconds for item, seconds in expected.items() if item > seq)
        at_item_s = clock_s - self.entered_s if self.entered_s is not None and seq == self.current else 0.0
        here_s = max(0.0, expected.get(seq, 0.0) - at_item_s)
        hold_s = self.hold_left_s(clock_s)
        return left_s + (here_s if hold_s is None else hold_s)


def _away_m(position: Position, stop: Stop) -> float:
    here = HomePosition(position.lat_e7, position.lon_e7, 0.0)
    return distance_m(here, HomePosition(stop.lat_e7, stop.lon_e7, 0.0))
