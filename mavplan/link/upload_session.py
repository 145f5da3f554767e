"""A mission onto a vehicle, list by list: to `UploadReport`, or an error that says what the vehicle holds.

::

    connecting ── found ──> home ── near ──> fence ──> rally points ──> mission ──> fence in force? ──> report
                  │                 │         │            │               │
                  └─ not for it     └─ far    └────────────┴───────────────┴─ refused, uncertain

Each list is stored, read back and compared by a `mavplan.link.store.Store`; the first one that is not verified ends it,
and what comes behind it is not sent. What the mission does not have is left alone on the vehicle.
"""

from mavplan.errors import InputError, MavplanError, Problem, RefusedError, UncertainError
from mavplan.link.discovery import Vehicle
from mavplan.link.fence_query import FenceQuery, judge_fence
from mavplan.link.home import (
    MAX_HOME_DISTANCE_M,
    MAX_HOME_HEIGHT_M,
    PATIENCE_S,
    PATIENCE_SHARE,
    HomeQuery,
    home_refusal,
    no_home_warning,
)
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Message
from mavplan.link.report import THINGS, UploadReport, told_besides
from mavplan.link.session import Session
from mavplan.link.store import Store, Stored
from mavplan.link.transfers import OWN, Transfers
from mavplan.link.upload import Upload
from mavplan.link.verdict import Judgement
from mavplan.mission.model import Mission
from mavplan.mission.uploadable import FENCE_TYPE, MISSION_TYPE, RALLY_TYPE, check_uploadable, lists_to_send
from mavplan.mission.wire import WireItem


class UploadSession(Session):
    """Store a mission, its fence and its rally points on the one vehicle of a link, and know that they are there.

    Parameters
    ----------
    mission
        What to store.
    allow_armed
        Write also to a vehicle whose motors may turn.
    max_home_distance_m, max_home_height_m
        How far the vehicle's home may be from the mission's.
    source
        Where the mission comes from, for messages about it.
    transfers
        Who carries out the transfers.
    now, deadline_s, system, place
        As for `Session`.
    """

    def __init__(
        self,
        mission: Mission,
        *,
        now: float,
        deadline_s: float,
        system: int | None = None,
        place: str = "this connection",
        allow_armed: bool = False,
        max_home_distance_m: float = MAX_HOME_DISTANCE_M,
        max_home_height_m: float = MAX_HOME_HEIGHT_M,
        source: str = "",
        transfers: Transfers = OWN,
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=mission.autopilot)
        self.mission = mission
        self.report: UploadReport | None = None
        self.items: tuple[WireItem, ...] = ()
        self._allow_armed = allow_armed
        self._max_home_distance_m = max_home_distance_m
        self._max_home_height_m = max_home_height_m
        self._source = source
        self._transfers = transfers
        self._home: HomeQuery | None = None
        self._todo: list[tuple[int, tuple[WireItem, ...]]] = []
        self._store: Store | None = None
        self._stored: dict[int, Stored] = {}
        self._writes: dict[int, int] = {}
        self._fence: FenceQuery | None = None
        self._warnings: list[Problem] = []

    @property
    def done(self) -> bool:
        """Whether there is a report or an error."""
        return self.report is not None or self.error is not None

    @property
    def _upload(self) -> Upload | None:
        return self._store.upload if self._store is not None else None

    # -- the vehicle is found ---------------------------------------------------------------------------------

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        if (error := super()._refusal(vehicle)) is not None:
            return error
        return armed_refusal(vehicle, vehicle.armed and not self._allow_armed)

    def _found(self, vehicle: Vehicle, now: float) -> None:
        try:
            self._warnings += check_uploadable(self.mission, self.rules, self._source)
        except InputError as error:
            self.error = error
            return
        lists = lists_to_send(self.mission, self.rules)
        self.items = lists[MISSION_TYPE]
        self._todo = list(lists.items())
        patience_s = min(PATIENCE_S, PATIENCE_SHARE * self.deadline_s)
        self._home = HomeQuery(vehicle.address, self._pace, now=now, deadline=now + patience_s)
        self._on_tick(now)

    # -- time and messages ------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        for part in (self._home, self._store, self._fence):
            if part is not None:
                part.receive(message, now)

    def _on_tick(self, now: float) -> None:
        for part in (self._home, self._store, self._fence):
            if part is not None:
                part.tick(now)
        self._advance(now)
        for part in (self._home, self._store, self._fence):
            if part is not None:
                self._outbox += part.to_send()
        if self._store is not None:
            self._notes += self._store.events()

    def _timers(self) -> list[float | None]:
        timers = [part.next_timer() for part in (self._home, self._fence) if part is not None]
        return timers + (self._store.timers() if self._store is not None else [])

    # -- the way ----------------------------------------------------------------------------------------------

    def _advance(self, now: float) -> None:
        if self._store is None:
            if self._home is not None and self._home.done and self._home_is_near(self._home):
                self._next_list(now)
        elif isinstance(self._store.outcome, MavplanError):
            self.error = self._with_what_is_new(self._store.outcome)
        elif self._store.outcome is not None:
            if self._store.kind not in self._stored:
                self._list_stored(self._store.kind, self._store.outcome, now)
            if self._fence is not None and self._fence.done:
                self._finish(now)

    def _home_is_near(self, query: HomeQuery) -> bool:
        if query.home is None:
            self._warnings.append(no_home_warning(self._max_home_distance_m))
            return True
        self.error = home_refusal(
            self.mission.home, query.home, self._max_home_distance_m, self._max_home_height_m
        )
        return self.error is None

    def _next_list(self, now: float) -> None:
        vehicle, watch = self.vehicle, self._watch
        if vehicle is None or watch is None:
            return
        if watch.armed and not self._allow_armed:
            said = f"{vehicle.address} has been armed meanwhile: nothing more was sent"
            self.error = self._with_what_is_new(RefusedError(said))
            return
        kind, items = self._todo.pop(0)
        self._store = Store(
            kind,
            items,
            vehicle=vehicle.address,
            us=self.us,
            rules=self.rules,
            manners=self.manners,
            watch=watch,
            pace=self._pace,
            now=now,
            deadline=self.deadline,
            deadline_s=self.deadline_s,
            allow_armed=self._allow_armed,
            transfers=self._transfers,
        )
        self._store.tick(now)

    def _list_stored(self, kind: int, stored: Stored, now: float) -> None:
        self._stored[kind] = stored
        if self._watch is not None:
            self._writes[kind] = self._watch.writes[kind]
        if self._todo:
            self._next_list(now)
        elif self.vehicle is not None:
            self._notes.append(Progress("fence in force?"))
            self._fence = FenceQuery(
                self.mission.fence or None,
                vehicle=self.vehicle.address,
                us=self.us,
                rules=self.rules,
                manners=self.manners,
                pace=self._pace,
                now=now,
                deadline=self.deadline,
            )
            self._fence.tick(now)

    # -- the end ----------------------------------------------------------------------------------------------

    def _with_what_is_new(self, error: MavplanError) -> MavplanError:
        """Say also which lists are new on the vehicle, and which were not sent."""
        here = self._store.kind if self._store is not None else MISSION_TYPE
        if here != MISSION_TYPE:
            error = told_besides(error, "the mission was not sent")
        if new := [THINGS[kind] for kind in self._stored if kind != MISSION_TYPE]:
            verb = "are" if len(new) > 1 or new[0].endswith("s") else "is"
            error = told_besides(error, f"the {' and the '.join(new)} of this mission {verb} on the vehicle")
        return error

    def _finish(self, now: float) -> None:
        stored, watch = self._stored.get(MISSION_TYPE), self._watch
        if self.vehicle is None or watch is None or stored is None:
            return
        for kind, writes in self._writes.items():
            if watch.writes[kind] > writes:
                self.error = UncertainError(
                    f"another ground station has written to the vehicle's {THINGS[kind]} after they were verified: "
                    "upload again"
                )
                return
        if stored.judgement is Judgement.UNKNOWN:
            words = "did not tell whether it takes the stored mission for flyable"
            self._warnings.append(Problem(self.rules.title, words, "not-judged", "warning"))
        home = self._home.home if self._home is not None else None
        force = judge_fence(self.mission, self.rules, self._fence, home)
        lists = self._stored.values()
        self.report = UploadReport(
            items=len(self.items),
            autopilot=self.rules.name,
            vehicle=self.vehicle.address,
            judgement=stored.judgement,
            opaque_id=stored.opaque_id,
            upload_s=stored.upload_s,
            total_s=now - self.started_at,
            uploads=max(found.uploads for found in lists),
            read_backs=max(found.read_backs for found in lists),
            stored=stored.items,
            warnings=(*self._warnings, *force.problems),
            fence_items=self._count(FENCE_TYPE),
            rally_items=self._count(RALLY_TYPE),
            fence_force=force,
        )

    def _count(self, kind: int) -> int:
        return len(self._stored[kind].items) if kind in self._stored else 0

    def _expire(self, now: float, cause: str) -> None:
        store = self._store
        if store is None:
            self.error = RefusedError(f"{cause}: nothing was sent")
            return
        store.expire(now, cause)
        if isinstance(store.outcome, MavplanError):
            self.error = self._with_what_is_new(store.outcome)
        elif store.outcome is not None and store.kind == MISSION_TYPE:
            self._stored.setdefault(MISSION_TYPE, store.outcome)
            self._finish(now)
        elif store.outcome is not None:
            self._stored[store.kind] = store.outcome
            self.error = self._with_what_is_new(RefusedError(cause))


def armed_refusal(vehicle: Vehicle, refused: bool) -> RefusedError | None:
    """Return the refusal to write to an armed vehicle, if it is to be refused."""
    if not refused:
        return None
    return RefusedError(f"{vehicle.address} is armed: nothing was sent to a vehicle that may be flying")
