"""Fetch the mission that a vehicle holds, its fence, its rally points and its home. No I/O; see `mavplan.link.session`.

::

    connecting ── found ──> mission ──> fence ──> rally points ──> home known, or waited for ──> mission
                               ^          ^            ^      │
                               └──────────┴────────────┴──────┘ another station has written to it: fetched again

Each list is a transfer of its own. A vehicle that has no fence or rally points to speak of, because it refuses the list
or never answers for it, gives the rest.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.errors import CheckError, Problem, RefusedError, UncertainError
from mavplan.link.discovery import Vehicle, refusal
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.home import HomeQuery
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Message, MissionType, result_words
from mavplan.link.report import THINGS
from mavplan.link.session import Session
from mavplan.link.transfers import OWN, Transfers
from mavplan.link.watch import Watch
from mavplan.mission.fence_wire import fence_from_wire, rally_from_wire
from mavplan.mission.model import Autopilot, Mission
from mavplan.mission.unread import with_headings
from mavplan.mission.wire import WireItem, from_wire, has_home_item

QUIET_S = 1.0
"""Pause after another station's writing, before a list is fetched again."""
HOME_PATIENCE_S = 5.0
"""A vehicle that has no home yet stays silent."""
ROUND_TRIPS_BELIEVED = 6
"""A vehicle that has sent back so many of our time stamps, one a second, and never answered for a list that it was
asked for twice a second does not know it: at half of all packets lost each way that is wrong once in 100,000 times."""
LIST_PATIENCE_S = 20.0
"""For a vehicle that sends no time stamps back."""
HEARD_S = 3.0
"""Only one that was heard so recently is silent on purpose."""


HEADINGS_UNREAD = Problem(
    "mission",
    "PX4 does not give back the heading of a hold (param4 of LOITER_TIME): written as along the track",
    "heading-unread",
    "warning",
)


@dataclass(frozen=True, slots=True)
class Held:
    """What a vehicle gave of one list.

    Attributes
    ----------
    items
        Its items; None where it did not give them.
    signs
        How much of other stations' writing to this list had been noticed when it ended.
    why_not
        In words, where it gave none.
    opaque_id
        The vehicle's checksum of the list, where it has one.
    """

    items: tuple[WireItem, ...] | None
    signs: int
    why_not: str = ""
    opaque_id: int | None = None


class DownloadSession(Session):
    """Fetch what the one vehicle on a link holds.

    Parameters
    ----------
    wanted
        The firmware it must run; None takes either.
    mission_only
        Leave out its fence and its rally points.
    transfers
        Who carries out the transfers.
    now, deadline_s, system, place
        As for `Session`.
    """

    def __init__(
        self,
        *,
        now: float,
        deadline_s: float,
        system: int | None = None,
        place: str = "this connection",
        wanted: Autopilot | None = None,
        mission_only: bool = False,
        transfers: Transfers = OWN,
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=wanted)
        self.mission: Mission | None = None
        self.held: dict[int, Held] = {}
        """By MAV_MISSION_TYPE, as far as it is fetched."""
        self.warnings: tuple[Problem, ...] = ()
        self._kinds = (MissionType.MISSION,) if mission_only else tuple(MissionType)
        self._transfers = transfers
        self._kind = MissionType.MISSION
        self._download: Download | None = None
        self._signs = 0
        self._reboots = 0
        self._asked_at = now
        self._trips_before = 0
        self._written_at: dict[int, float] = {}
        self._home: HomeQuery | None = None

    @property
    def done(self) -> bool:
        """Whether there is a mission or an error."""
        return self.mission is not None or self.error is not None

    def count(self, kind: int) -> int | None:
        """Return how many items the vehicle holds of a list; None where that was not asked for or not told."""
        held = self.held.get(kind)
        return len(held.items) if held is not None and held.items is not None else None

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        return refusal(vehicle, self.wanted, "download")

    def _found(self, vehicle: Vehicle, now: float) -> None:
        self._home = HomeQuery(
            vehicle.address,
            self._pace,
            now=now,
            deadline=min(self.deadline, now + HOME_PATIENCE_S),
            asked_alone=False,
        )
        self._on_tick(now)

    # -- time and messages ------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        for part in (self._download, self._home):
            if part is not None:
                part.receive(message, now)

    def _on_tick(self, now: float) -> None:
        watch, vehicle, home = self._watch, self.vehicle, self._home
        if watch is None or vehicle is None or home is None:
            return
        home.tick(now)
        self._outbox += home.to_send()
        self._look_round(watch, now)
        while not self.done:
            if self._download is None:
                missing = [kind for kind in self._kinds if kind not in self.held]
                if not missing:
                    break
                self._fetch(missing[0], watch, vehicle, now)
            if not self._let_download(watch, vehicle, now):
                return
        if not self.done and (home.done or self._has_home_item()):
            self._finish(vehicle)

    def _let_download(self, watch: Watch, vehicle: Vehicle, now: float) -> bool:
        """Let the list that is being fetched go on; return whether it has ended."""
        download = self._download
        if download is None:
            return True
        download.tick(now)
        self._outbox += download.to_send()
        self._notes += download.events()
        self._list_ended(download, watch, vehicle, now)
        return self._download is None

    def _fetch(self, kind: MissionType, watch: Watch, vehicle: Vehicle, now: float) -> None:
        self._kind, self._signs, self._reboots = kind, watch.signs_of(kind), watch.reboots
        self._asked_at, self._trips_before = now, self._round_trips
        self._download = self._transfers.download(
            self.manners,
            vehicle.address,
            self.us,
            kind,
            now=now,
            deadline=self.deadline,
            pace=self._pace,
            phase="downloading" if kind == MissionType.MISSION else f"downloading {THINGS[kind]}",
        )
        quiet_s = self._written_at.get(kind, -QUIET_S) + QUIET_S - now
        if quiet_s > 0:
            self._download.restart(now, quiet_s)

    def _look_round(self, watch: Watch, now: float) -> None:
        """Fetch anew what another station writes to: half of what came may be the old list."""
        for kind, held in list(self.held.items()):
            if watch.signs_of(kind) != held.signs:
                self._written_at[kind] = now
                del self.held[kind]
                self._notes.append(Progress("downloading", 0, 0, "another station writes: reading again"))
        if self._download is None:
            return
        signs, reboots = watch.signs_of(self._kind), watch.reboots
        if (signs, reboots) != (self._signs, self._reboots):
            self._signs, self._reboots = signs, reboots
            self._asked_at, self._trips_before = now, self._round_trips
            self._download.restart(now, QUIET_S)

    def _list_ended(self, download: Download, watch: Watch, vehicle: Vehicle, now: float) -> None:
        outcome, kind = download.outcome, self._kind
        if outcome is None:
            if self._is_given_up(download, watch, now):
                self._keep(None, f"{vehicle.address} does not answer for it")
            return
        if outcome.end is DownloadEnd.COMPLETE:
            self._keep(outcome.items, opaque_id=download.opaque_id)
        elif outcome.end is DownloadEnd.EXPIRED:
            self._expire(now, f"no end within {self.deadline_s:g} s")
        elif kind == MissionType.MISSION:
            why = result_words(outcome.result or 0)
            self.error = RefusedError(f"{vehicle.address} does not give its mission: {why}")
        else:
            self._keep(None, f"{vehicle.address} does not give it: {result_words(outcome.result or 0)}")

    def _keep(
        self, items: tuple[WireItem, ...] | None, why_not: str = "", opaque_id: int | None = None
    ) -> None:
        self.held[self._kind] = Held(items, self._signs, why_not, opaque_id)
        self._download = None

    def _is_given_up(self, download: Download, watch: Watch, now: float) -> bool:
        """Whether the vehicle has had time enough to answer for a list, and has not; one out of reach has not."""
        if self._kind == MissionType.MISSION or download.answered or watch.heard_at is None:
            return False
        if self._round_trips - self._trips_before >= ROUND_TRIPS_BELIEVED:
            return True
        return now >= self._asked_at + LIST_PATIENCE_S and now <= watch.heard_at + HEARD_S

    def _has_home_item(self) -> bool:
        return has_home_item(self._items(MissionType.MISSION), self.rules)

    def _items(self, kind: int) -> Sequence[WireItem]:
        held = self.held.get(kind)
        return held.items if held is not None and held.items is not None else ()

    def _timers(self) -> list[float | None]:
        return [part.next_timer() for part in (self._download, self._home) if part is not None]

    # -- the end ----------------------------------------------------------------------------------------------

    def _finish(self, vehicle: Vehicle) -> None:
        mission_items, fence_items, rally_items = (self._items(kind) for kind in MissionType)
        if len(mission_items) <= int(self.rules.home_on_wire):
            self.error = CheckError(f"{vehicle.address} holds no mission{self._but()}")
            return
        home = self._home.home if self._home is not None else None
        unread: tuple[Problem, ...] = ()
        if self.rules.name == "px4":
            mission_items, sure = with_headings(mission_items, self.held[MissionType.MISSION].opaque_id)
            unread = () if sure else (HEADINGS_UNREAD,)
        mission, warnings = from_wire(mission_items, self.rules, home, vehicle.mav_type)
        told_home = mission.home if not any(problem.code == "no-home" for problem in warnings) else None
        fence, of_fence = fence_from_wire(fence_items)
        rally, of_rally = rally_from_wire(rally_items, told_home)
        not_given = tuple(
            Problem(THINGS[kind], f"{held.why_not}: left out", "not-given", "warning")
            for kind, held in self.held.items()
            if held.items is None
        )
        self.warnings = (*warnings, *unread, *not_given, *of_fence, *of_rally)
        self.mission = dataclasses.replace(mission, fence=fence, rally=rally)

    def _but(self) -> str:
        """Say what it holds instead of a mission."""
        fence, rally = (self.count(kind) for kind in (MissionType.FENCE, MissionType.RALLY))
        parts = [f"a fence of {fence} items"] if fence else []
        if rally:
            parts.append(f"{rally} rally point{'s' if rally > 1 else ''}")
        return f", only {' and '.join(parts)}: a file needs a mission" if parts else ""

    def _expire(self, now: float, cause: str) -> None:
        if self._watch is not None:
            self._look_round(self._watch, now)
        missing = [THINGS[kind] for kind in self._kinds if kind not in self.held]
        if not missing and self.vehicle is not None:
            self._finish(self.vehicle)
            return
        what = " and ".join(missing or [THINGS[MissionType.MISSION]])
        alone = "; --mission-only leaves them out" if MissionType.MISSION in self.held else ""
        self.error = UncertainError(
            f"{cause}: the vehicle's {what} could not be read; the vehicle was not changed{alone}"
        )
