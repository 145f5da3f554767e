"""What every piece of work over a link has in common: find the vehicle, send our heartbeat, watch, keep to a deadline.

A session does no I/O and looks at no clock, so that the same object runs against a radio and in a test's virtual
time. `mavplan.link.vehicle` drives it; `upload_session` and `download_session` are the two kinds.
"""

from abc import ABC, abstractmethod

from mavplan.errors import MavplanError, RefusedError
from mavplan.link.discovery import Discovery, Vehicle, refusal
from mavplan.link.manners import MANNERS, Manners
from mavplan.link.outbox import NotedOutbox, Progress
from mavplan.link.protocol import GROUND, Message, heartbeat, timesync
from mavplan.link.transfer import Pace
from mavplan.link.watch import Watch
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Autopilot

HEARTBEAT_S = 1.0
CONNECT_S = 15.0
"""A vehicle that is there sends a heartbeat every second."""
LINK_LOST_S = 30.0
"""Longer than a restart of the autopilot takes: nobody will answer any more."""


class Session(NotedOutbox, ABC):
    """Work with one vehicle, from its first heartbeat to an outcome.

    Parameters
    ----------
    now
        The caller's clock, seconds.
    deadline_s
        Seconds until everything is over, whatever happens.
    system
        The MAVLink system wanted; None takes the only one on the line.
    place
        What to call the connection in messages.
    wanted
        The firmware it must run; None takes either.
    """

    def __init__(
        self, *, now: float, deadline_s: float, system: int | None, place: str, wanted: Autopilot | None
    ) -> None:
        self.us = GROUND
        self.started_at = now
        self.deadline = now + deadline_s
        self.deadline_s = deadline_s
        self.wanted = wanted
        self.vehicle: Vehicle | None = None
        self.error: MavplanError | None = None
        self._connect_by = min(self.deadline, now + CONNECT_S)
        self._discovery = Discovery(self.us, system, place, now=now, deadline=self._connect_by)
        self._heartbeat_at = now
        self._pace = Pace()
        self._stamps: set[int] = set()
        self._round_trips = 0
        """Time stamps of ours that the vehicle has sent back: the link carried each both ways."""
        super().__init__()
        self._notes.append(Progress("connecting"))
        self._watch: Watch | None = None

    # -- the outside ------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def done(self) -> bool:
        """Whether there is an outcome, good or bad (`error`)."""

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        if self.done:
            return
        if message.get_type() == "TIMESYNC" and message.ts1 in self._stamps and message.tc1:
            self._stamps.remove(message.ts1)
            self._round_trips += 1
            self._pace.saw(now - message.ts1 / 1e9)
        if self._watch is None:
            self._discovery.receive(message, now)
        else:
            self._watch.receive(message, now)
            self._on_message(message, now)
        self.tick(now)

    def tick(self, now: float) -> None:
        """Let time pass."""
        if self.done:
            return
        if now >= self._heartbeat_at:
            self._heartbeat_at = now + HEARTBEAT_S
            self._stamps.add(stamp := int(now * 1e9))
            self._outbox += [heartbeat(), timesync(stamp)]
        if self._watch is None:
            self._discovery.tick(now)
            self._discovered(now)
        elif now >= self.deadline:
            self._expire(now, self._too_long())
        elif now >= self._lost_at():
            self._expire(now, f"nothing was heard of the vehicle for {LINK_LOST_S:g} s")
        else:
            self._on_tick(now)

    def interrupt(self, now: float) -> None:
        """End at once because the user wants it; before a vehicle is found there is nothing to say."""
        if not self.done and self._watch is not None:
            self._expire(now, "interrupted")

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters; None when all is over."""
        if self.done:
            return None
        if self._watch is None:
            timers = [self._discovery.next_timer()]
        else:
            timers = [self.deadline, self._lost_at(), *self._timers()]
        return min(self._heartbeat_at, *(timer for timer in timers if timer is not None))

    # -- for the kinds ----------------------------------------------------------------------------------------

    @property
    def rules(self) -> AutopilotRules:
        """The firmware's rules, once the vehicle is known."""
        if self.vehicle is None or self.vehicle.rules is None:
            raise AssertionError("no vehicle yet")
        return self.vehicle.rules

    @property
    def manners(self) -> Manners:
        """The firmware's manners, once the vehicle is known."""
        return MANNERS[self.rules.name]

    @abstractmethod
    def _found(self, vehicle: Vehicle, now: float) -> None:
        """Begin the work with a vehicle that may have it; sets `error` if it may not."""

    @abstractmethod
    def _on_message(self, message: Message, now: float) -> None:
        """Take a message."""

    @abstractmethod
    def _on_tick(self, now: float) -> None:
        """Let time pass."""

    @abstractmethod
    def _timers(self) -> list[float | None]:
        """Return the times of the parts' next ticks."""

    @abstractmethod
    def _expire(self, now: float, cause: str) -> None:
        """End with what is known."""

    def _too_long(self) -> str:
        return f"no end within {self.deadline_s:g} s"

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        return refusal(vehicle, self.wanted)

    def _discovered(self, now: float) -> None:
        found = self._discovery.outcome
        if found is None:
            return
        if isinstance(found, MavplanError):
            self.error = found
            return
        self.error = self._refusal(found)
        if self.error is None:
            self.vehicle = found
            self._watch = Watch(found.address, self.us)
            self._watch.heard_at = now
            self._found(found, now)

    def _lost_at(self) -> float:
        heard_at = self._watch.heard_at if self._watch is not None else None
        return (heard_at if heard_at is not None else self.started_at) + LINK_LOST_S
