"""What a vehicle is and holds, without fetching its mission and without changing anything. No I/O; see `session`.

Everything is asked for on its own and until time is over; what a vehicle does not tell stays None in `VehicleInfo`.
"""

from dataclasses import dataclass, field

from mavplan.errors import Problem, RefusedError
from mavplan.link.count import LIST_AGAIN_S, Count
from mavplan.link.discovery import NO_AUTOPILOT, Vehicle
from mavplan.link.fence_query import FenceQuery, judge_fence
from mavplan.link.home import HomeQuery
from mavplan.link.modes import MISSION_STATES, capability_names, mode_name, version_words
from mavplan.link.outbox import Progress
from mavplan.link.protocol import (
    AUTOPILOT_VERSION_ID,
    MISSION_CURRENT_ID,
    Address,
    Message,
    MissionType,
    opaque_id,
    request_message,
    sender,
)
from mavplan.link.report import THINGS
from mavplan.link.session import Session
from mavplan.mission.model import Autopilot, HomePosition, Mission

ASK_AGAIN_S = 0.5
QUERY_S = 10.0
"""For each question: what was not told by then is not told."""
HOME_S = 5.0
"""A vehicle that has no home yet stays silent."""
LISTEN_S = 2.5
"""Heartbeats come once a second: so long it takes to hear the other stations."""
GROUND_STATION_TYPE = 6
"""MAV_TYPE_GCS."""


@dataclass(slots=True)
class VehicleInfo:
    """What a vehicle told; None: it did not.

    Attributes
    ----------
    autopilot, vehicle, mav_type
        Firmware, address, MAV_TYPE.
    version, capabilities
        Of AUTOPILOT_VERSION, in words.
    armed, mode
        Of HEARTBEAT.
    home
        HOME_POSITION.
    counts
        Items held, by the name of the list; the mission's without home.
    mission_state, current_item, mission_id
        Of MISSION_CURRENT: in words, item on the wire, PX4's id.
    fence
        Which fence is in force, in a sentence.
    others
        Other stations and vehicles that were heard.
    warnings
        What else should be known.
    """

    autopilot: Autopilot
    vehicle: Address
    mav_type: int
    armed: bool = False
    mode: str | None = None
    version: str | None = None
    capabilities: tuple[str, ...] | None = None
    home: HomePosition | None = None
    counts: dict[str, int | None] = field(default_factory=dict)
    mission_state: str | None = None
    current_item: int | None = None
    mission_id: int | None = None
    fence: str | None = None
    others: tuple[str, ...] = ()
    warnings: tuple[Problem, ...] = ()


class InfoSession(Session):
    """Ask the one vehicle of a link about itself. Parameters as of `Session`."""

    def __init__(
        self, *, now: float, deadline_s: float, system: int | None = None, place: str = "this connection"
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=None)
        self.info: VehicleInfo | None = None
        self._over = False
        self._listen_until = now + LISTEN_S
        self._heard: dict[Address, str] = {}
        self._ask_at = now
        self._ask_until = now
        self._asked = {AUTOPILOT_VERSION_ID: "AUTOPILOT_VERSION", MISSION_CURRENT_ID: "MISSION_CURRENT"}
        self._home: HomeQuery | None = None
        self._counts: list[Count] = []
        self._fence: FenceQuery | None = None

    @property
    def done(self) -> bool:
        """Whether all is told that will be, or there is an error."""
        return self._over or self.error is not None

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        return super()._refusal(vehicle) if vehicle.rules is None else None

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, and note who sends heartbeats."""
        if message.get_type() == "HEARTBEAT" and sender(message) != self.us:
            self._heard.setdefault(sender(message), _kind(message))
        super().receive(message, now)

    def _found(self, vehicle: Vehicle, now: float) -> None:
        self.info = VehicleInfo(self.rules.name, vehicle.address, vehicle.mav_type, vehicle.armed)
        self._ask_at = now
        self._ask_until = now + QUERY_S
        self._home = HomeQuery(
            vehicle.address,
            self._pace,
            now=now,
            deadline=min(self.deadline, now + HOME_S),
            asked_alone=False,
        )
        self._on_tick(now)

    # -- time and messages ------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        for part in (self._home, *self._counts, self._fence):
            if part is not None:
                part.receive(message, now)
        info = self.info
        if info is None or sender(message) != info.vehicle:
            return
        match message.get_type():
            case "HEARTBEAT":
                info.armed = bool(message.base_mode & 0x80)
                info.mode = mode_name(info.autopilot, int(message.base_mode), int(message.custom_mode))
            case "AUTOPILOT_VERSION":
                self._asked.pop(AUTOPILOT_VERSION_ID, None)
                info.version = version_words(int(message.flight_sw_version))
                info.capabilities = capability_names(int(message.capabilities))
            case "MISSION_CURRENT":
                self._asked.pop(MISSION_CURRENT_ID, None)
                info.mission_state = MISSION_STATES.get(message.mission_state)
                info.current_item = None if message.seq == 65_535 else int(message.seq)
                info.mission_id = opaque_id(message)

    def _on_tick(self, now: float) -> None:
        if self._home is None or self.vehicle is None or self.info is None:
            return
        if self._asked and now >= self._ask_until:
            self._asked.clear()
        if self._asked and now >= self._ask_at:
            self._ask_at = now + ASK_AGAIN_S
            self._outbox += [request_message(self.vehicle.address, number) for number in self._asked]
        self._home.tick(now)
        self._outbox += self._home.to_send()
        self._ask_lists(self.vehicle, now)
        everything = self._fence is not None and self._fence.done and self._home.done and not self._asked
        if everything and self.info.mode is not None and now >= self._listen_until:
            self._finish(self.info)

    def _ask_lists(self, vehicle: Vehicle, now: float) -> None:
        """One list after the other, for PX4 takes part in one transfer at a time; then the fence's parameters."""
        if self._counts:
            self._counts[-1].tick(now)
            self._outbox += self._counts[-1].to_send()
        if not self._counts or (self._counts[-1].done and len(self._counts) < len(MissionType)):
            kind = list(MissionType)[len(self._counts)]
            self._notes.append(Progress(f"asking for {THINGS[kind]}"))
            until = min(self.deadline, now + QUERY_S)
            self._counts.append(
                Count(
                    vehicle.address,
                    self.us,
                    kind,
                    now=now,
                    deadline=until,
                    ask_again_s=LIST_AGAIN_S,
                    pace=self._pace,
                )
            )
            self._ask_lists(vehicle, now)
        elif self._counts[-1].done and self._fence is None:
            self._fence = FenceQuery(
                None,
                vehicle=vehicle.address,
                us=self.us,
                rules=self.rules,
                manners=self.manners,
                pace=self._pace,
                now=now,
                deadline=self.deadline,
            )
        if self._fence is not None:
            self._fence.tick(now)
            self._outbox += self._fence.to_send()

    def _timers(self) -> list[float | None]:
        parts = (self._home, *self._counts, self._fence)
        timers = [part.next_timer() for part in parts if part is not None]
        if self._asked:
            timers.append(min(self._ask_at, self._ask_until))
        elif all(timer is None for timer in timers) and self.info is not None and self.info.mode is not None:
            timers.append(self._listen_until)
        return timers

    # -- the end ----------------------------------------------------------------------------------------------

    def _finish(self, info: VehicleInfo) -> None:
        info.home = self._home.home if self._home is not None else None
        info.counts = {THINGS[kind]: None for kind in MissionType}
        for count in self._counts:
            home = int(count.mission_type == MissionType.MISSION and self.rules.home_on_wire)
            held = None if count.count is None else max(0, count.count - home)
            info.counts[THINGS[count.mission_type]] = held
        nothing = Mission((), info.home or HomePosition(0, 0, 0.0), info.autopilot)
        force = judge_fence(nothing, self.rules, self._fence, info.home)
        info.fence = force.words if force.enforced is not None else None
        info.others = tuple(
            f"{address} ({kind})" for address, kind in sorted(self._heard.items()) if address != info.vehicle
        )
        info.warnings = tuple(
            problem
            for problem in force.problems
            if problem.code not in {"fence-breach", "fence-would-breach"}
        )
        self._over = True

    def _expire(self, now: float, cause: str) -> None:
        del now
        if self.info is not None:
            self._finish(self.info)
            self.info.warnings += (Problem("", f"{cause}: not all was told", "incomplete", "warning"),)


def _kind(message: Message) -> str:
    if message.type == GROUND_STATION_TYPE:
        return "a ground station"
    return f"MAV_TYPE {message.type}" if message.autopilot == NO_AUTOPILOT else "another vehicle"
