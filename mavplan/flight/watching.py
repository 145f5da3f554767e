"""Watching one flight: what happens in it, when it is over, what is known of it then. Sends nothing. No I/O."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from mavplan.flight.ending import Facts
from mavplan.flight.manners import FlightManners
from mavplan.flight.places import Staying, landed_off_m
from mavplan.flight.progress import MissionProgress
from mavplan.flight.telemetry import TWICE_S, Telemetry
from mavplan.link.modes import mode_name
from mavplan.link.watch import Watch
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import HomePosition

SILENT_S = 5.0
"""Heartbeats come once a second: after so long it is said that none come."""
BLIND_S = 8.0
"""In a longer silence an end of the flight may be missed; see `mavplan.flight.launch.GAP_S`."""
FOREIGN_S = 4.0
"""A mode that the mission may have led to itself is called foreign after so long without a word that it has."""
LAST_WORDS_S = 3.0
"""After the motors have stopped: MISSION_CURRENT and texts that belong to the flight."""
NEVER_ARMED_S = 15.0
"""A start that was broken off shows by then whether anything came of it."""
LANDED_S = 30.0
"""A vehicle that stands on the ground so long and does not stop its motors is not waited for."""


class Happened(NamedTuple):
    """Kind and words of a `mavplan.flight.report.FlightEvent`, and when it was; None: just now."""

    kind: str
    words: str
    at: float | None = None


class Watching:
    """Keeps an eye on one flight.

    Parameters
    ----------
    rules, manners
        The firmware.
    telemetry, progress, watch
        What is known; others feed them.
    mission_id
        PX4's id of the verified mission, where it told one.
    started
        The flight was started by us; else somebody is to start it, or has.
    reason
        Why the start was broken off, or empty.
    ends
        Where it may come down: at a return, home and the rally points.
    since, now
        When the start began; from when on it is watched.
    """

    def __init__(
        self,
        rules: AutopilotRules,
        manners: FlightManners,
        telemetry: Telemetry,
        progress: MissionProgress,
        watch: Watch,
        *,
        mission_id: int | None,
        started: bool,
        reason: str,
        ends: Sequence[HomePosition],
        since: float,
        now: float,
    ) -> None:
        self.longest_silence_s = 0.0
        self.order_modes: frozenset[int] = frozenset()
        """What the user's orders have led to, or are to lead to."""
        self.meddled = False
        """Another station wrote to the vehicle's mission."""
        self.ordered = ""
        """The user's order that was granted last."""
        self._rules, self._manners = rules, manners
        self._telemetry, self._progress, self._watch = telemetry, progress, watch
        telemetry.settle(now)
        self._end_modes = manners.end_modes.get(progress.route.end, frozenset())
        self._mission_id = mission_id
        self._started = started
        self._reason = reason
        self._ends = tuple(ends)
        self._since = since
        self._now = self._begun_at = now
        self._armed_at: float | None = now if telemetry.armed_now else None
        self._mode_told: int | None = manners.mission_mode if started and not reason else telemetry.mode.value
        self._flown_mode: int | None = telemetry.mode_now
        self._foreign = False
        self._heard_at = now
        self._beat_at = telemetry.heartbeat_at if telemetry.heartbeat_at is not None else now
        self._silent = False
        self._unheard_at_end = False
        self.off_since: float | None = None
        """When the motors were first heard not to turn any more."""
        self._off_at: float | None = None
        self._stopped_told = False
        self._airborne_since: float | None = None
        self._writes = watch.writes[0]
        self._reboots = watch.reboots
        self._restarted = False
        self._other_mission = 0
        self._other_at = -math.inf
        self._replaced = False
        self._landed_since: float | None = None
        self._staying = Staying(progress.route.end_place)
        self._holding_at: int | None = None
        self._stops_told = 0
        self._skipped_told = 0

    # -- time -------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> list[Happened]:
        """Let time pass; what has happened."""
        self._now = now
        route, mode = self._progress.route, self._telemetry.mode_now
        own = self.is_own(mode) and mode not in self.order_modes
        may_stay = route.end == "stay" and self._progress.at_end and own
        self._staying.see(self._telemetry.position, may_stay, now)
        return [
            *self._link(now),
            *self._state(now),
            *self._modes(now),
            *self._mission(),
            *self._stops(),
        ]

    def _link(self, now: float) -> Iterator[Happened]:
        heard_at = self._telemetry.heard_at if self._telemetry.heard_at is not None else self._heard_at
        if heard_at > self._heard_at:
            if self._silent:
                yield Happened("link", f"heard again after {heard_at - self._heard_at:.0f} s")
            self.longest_silence_s = max(self.longest_silence_s, heard_at - self._heard_at)
            self._silent = False
            self._heard_at = heard_at
        elif now > self._heard_at + SILENT_S and not self._silent:
            self._silent = True
            yield Happened(
                "link",
                f"nothing heard for {SILENT_S:.0f} s; it flies on by itself; last: {self.known(now)}",
            )
        self.longest_silence_s = max(self.longest_silence_s, now - self._heard_at)

    def _state(self, now: float) -> Iterator[Happened]:
        telemetry = self._telemetry
        if telemetry.armed_now and self._armed_at is None:
            self._armed_at = now
            yield Happened("vehicle", "armed")
        beat_at = telemetry.heartbeat_at
        if beat_at is not None and beat_at > self._beat_at:
            blind = beat_at > self._beat_at + BLIND_S or self._unheard_at_end
            self._unheard_at_end = blind and not telemetry.armed_now
            self._beat_at = beat_at
            if telemetry.armed_now:
                self.off_since = self._off_at = None
            elif self.off_since is None:
                self.off_since = beat_at
            elif beat_at >= self.off_since + TWICE_S and self._off_at is None:
                self._off_at = beat_at
        if self.airborne and self._airborne_since is None:
            self._airborne_since = now
            yield Happened("air", "in the air")
        if self._watch.reboots > self._reboots:
            self._reboots = self._watch.reboots
            self._restarted = True
            yield Happened("vehicle", "the autopilot has restarted")
        since, told_at = telemetry.on_ground_since, telemetry.on_ground_at
        if since is None or self._airborne_since is None or since <= self._airborne_since:
            self._landed_since = None
        elif told_at is not None and told_at >= since + TWICE_S and self._landed_since is None:
            self._landed_since = since
            if not self._stopped_told:
                yield Happened("air", "on the ground", since)
        if self._armed_at is not None and self._off_at is not None and not self._stopped_told:
            self._stopped_told = True
            yield Happened("vehicle", "the motors have stopped", self.off_since)

    def _modes(self, now: float) -> Iterator[Happened]:
        telemetry = self._telemetry
        mode = telemetry.mode.value
        if telemetry.armed.value and telemetry.armed_now:
            self._flown_mode = mode
        if mode is None or mode == self._mode_told or not telemetry.armed_now:
            return
        name = self._name(mode)
        if self.is_own(mode):
            self._mode_told = mode
            if mode in self.order_modes:
                return  # the order itself is told
            back = self._foreign and mode == self._manners.mission_mode
            self._foreign = False
            yield Happened("mode", f"{name}: {'the mission goes on' if back else 'the mission leads there'}")
        elif self._is_surely_foreign(mode, now):
            self._mode_told = mode
            self._foreign = True
            self._progress.left_the_mission()
            yield Happened(
                "mode",
                f"{name}: neither the mission nor you switched there, but a pilot, a station or a failsafe",
            )

    def _is_surely_foreign(self, mode: int, now: float) -> bool:
        if mode not in self._end_modes:
            return True
        since, mission = self._telemetry.mode.since, self._telemetry.mission
        told_since = mission is not None and mission.at > since + 1.0
        return now >= since + FOREIGN_S and told_since

    def _mission(self) -> Iterator[Happened]:
        if self._watch.writes[0] > self._writes:
            self._writes = self._watch.writes[0]
            if not self.meddled:
                yield Happened("mission", "another ground station writes to the vehicle's mission")
            self.meddled = True
        mission = self._telemetry.mission
        if mission is None or mission.at <= self._other_at or mission.at < self._begun_at:
            return
        self._other_at = mission.at
        count = self._progress.route.count
        other = (mission.total is not None and mission.total != count) or (
            None not in (mission.mission_id, self._mission_id) and mission.mission_id != self._mission_id
        )
        self._other_mission = self._other_mission + 1 if other else 0
        if self._other_mission > 1 and not self._replaced and not self._progress.complete:
            self._replaced = True
            yield Happened("mission", "the vehicle holds another mission now")

    def _stops(self) -> Iterator[Happened]:
        progress = self._progress
        stops = len(progress.route.stops)
        if len(progress.skipped) > self._skipped_told:
            self._skipped_told = len(progress.skipped)
            yield Happened("mission", "the mission went on before a hold can have been over")
        done = progress.stops_done
        for stop in done[self._stops_told :]:
            yield Happened("stop", f"stop {stop.number} of {stops} done")
        self._stops_told = max(self._stops_told, len(done))
        here = progress.stop
        if here is not None and progress.holding and self._holding_at != here.number:
            self._holding_at = here.number
            served = f" for {', '.join(here.users)}" if here.users else ""
            yield Happened("stop", f"stop {here.number} of {stops}: holds {here.hold_s:g} s{served}")

    # -- what is known ----------------------------------------------------------------------------------------

    @property
    def begun(self) -> bool:
        """Whether there is a flight: started by us, or its motors were seen to turn."""
        return self._started or self._armed_at is not None

    @property
    def airborne(self) -> bool:
        """Whether it was seen in the air since the start."""
        at = self._telemetry.airborne_at
        return at is not None and at >= self._since

    @property
    def silent_s(self) -> float:
        """Seconds since it was last heard."""
        return self._now - self._heard_at

    def is_own(self, mode: int | None) -> bool:
        """Whether the mission, or the user's order, leads to a mode."""
        if mode == self._manners.mission_mode or mode in self.order_modes:
            return True
        return mode in self._end_modes and self._progress.at_end

    def over(self, now: float) -> bool:
        """Whether the flight is over."""
        if self._staying.stays:
            return True
        if self._armed_at is not None and self._off_at is not None:
            return now >= self._off_at + LAST_WORDS_S
        if self._armed_at is None and self._started:
            return self._telemetry.beat_at >= self._begun_at + NEVER_ARMED_S
        told_at = self._telemetry.on_ground_at
        if self._landed_since is None or told_at is None:
            return False
        return told_at >= self._landed_since + LANDED_S

    def facts(self, now: float) -> Facts:
        """Return what is known."""
        telemetry, progress = self._telemetry, self._progress
        disarmed = self._off_at is not None or (self._armed_at is None and not telemetry.armed_now)
        mode = self._flown_mode
        by_itself = progress.complete and mode in self._end_modes
        ordered = self.ordered if mode in self.order_modes and not by_itself else ""
        return Facts(
            complete=progress.complete,
            airborne=self.airborne,
            disarmed=disarmed,
            stays=self._staying.stays,
            mode=self._name(mode),
            own_mode=self.is_own(mode),
            heard=now < telemetry.beat_at + SILENT_S,
            ordered=ordered,
            replaced=self._replaced,
            meddled=self.meddled,
            skipped=tuple(stop.number for stop in progress.route.stops if stop.hold_seq in progress.skipped),
            restarted=self._restarted,
            unheard_at_end=self._unheard_at_end,
            landed_off_m=landed_off_m(telemetry.position, self.off_since, self._ends) if disarmed else None,
            where=self.where(),
            known=self.known(now),
            reason=self._reason,
            texts=[text for text in telemetry.texts if text.at >= self._since],
        )

    def where(self) -> str:
        """Return how far it has come, in words: ``at item 7, stop 2 of 5``."""
        progress = self._progress
        if progress.complete:
            return "after its last stop" if progress.route.stops else "after its last item"
        seq = max(progress.current or 0, progress.done_through + 1)
        stop = progress.route.stop_at(seq)
        at = f", stop {stop.number} of {len(progress.route.stops)}" if stop is not None else ""
        return f"at item {seq}{at}"

    def known(self, now: float) -> str:
        """Return the last words of the vehicle on its state, and their age."""
        telemetry = self._telemetry
        if telemetry.heartbeat_at is None:
            return "nothing is known of it"
        armed = "armed" if telemetry.armed_now else "not armed"
        parts = [f"{armed}, {self._name(telemetry.mode_now)}"]
        if telemetry.position is not None:
            parts.append(f"{telemetry.position.alt_rel_m:.0f} m above home")
        return f"{', '.join(parts)}, {now - telemetry.heartbeat_at:.0f} s ago"

    def _name(self, mode: int | None) -> str:
        if mode is None:
            return "an unknown mode"
        return mode_name(self._rules.name, self._telemetry.base_mode, mode)
