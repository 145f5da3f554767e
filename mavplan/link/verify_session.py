"""Whether a vehicle still holds a mission, its fence and its rally points; changes nothing. No I/O; see `session`.

PX4 announces an id of each list, which can be computed from what would be sent: where they agree, that is the answer.
Everywhere else, and where they do not, the lists are downloaded and compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from mavplan.errors import CheckError, InputError, Problem, RefusedError, UncertainError
from mavplan.link.discovery import Vehicle
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.outbox import Progress
from mavplan.link.protocol import (
    MISSION_CURRENT_ID,
    MISSION_STATE_NO_MISSION,
    Address,
    Message,
    opaque_id,
    request_message,
    result_words,
    sender,
)
from mavplan.link.report import THINGS
from mavplan.link.session import Session
from mavplan.link.watch import Watch
from mavplan.mission.checksum import px4_id
from mavplan.mission.model import Autopilot, Mission
from mavplan.mission.readback import Difference, differences
from mavplan.mission.uploadable import MISSION_TYPE, check_uploadable, lists_to_send
from mavplan.mission.wire import WireItem

ASK_AGAIN_S = 0.5
ANNOUNCED_S = 3.0
"""For the quick answer; then the lists are downloaded."""
QUIET_S = 1.0


@dataclass(frozen=True, slots=True)
class VerifyReport:
    """A vehicle that holds this very mission.

    Attributes
    ----------
    autopilot, vehicle
        Firmware and address.
    items
        Items of the mission on the wire.
    by
        ``id``: by the ids that the vehicle announces; ``download``: item by item.
    opaque_id
        The vehicle's id of its mission, where it told one.
    lists
        Names of the lists that were looked at.
    warnings
        What else should be known.
    """

    autopilot: Autopilot
    vehicle: Address
    items: int
    by: Literal["id", "download"]
    opaque_id: int | None
    lists: tuple[str, ...]
    warnings: tuple[Problem, ...] = ()


class HoldsOtherError(CheckError):
    """The vehicle holds something else; ``differences`` has every field."""

    def __init__(self, message: str, found: Sequence[Difference] = ()) -> None:
        self.differences = tuple(found)
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class _Compared:
    """What came of one list, and how much of other stations' writing to it had been noticed by then."""

    found: tuple[Difference, ...]
    words: str
    signs: int


class VerifySession(Session):
    """Compare what the one vehicle of a link holds with a mission.

    Parameters
    ----------
    mission
        What it should hold.
    source
        Where the mission comes from, for messages about it.
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
        source: str = "",
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=None)
        self.mission = mission
        self.report: VerifyReport | None = None
        self._source = source
        self._lists: dict[int, tuple[WireItem, ...]] = {}
        self._todo: list[int] = []
        self._announced_by: float | None = None
        self._ask_at = now
        self._download: Download | None = None
        self._signs: tuple[int, int] = (0, 0)
        self._id: int | None = None
        self._infeasible = False
        self._compared: dict[int, _Compared] = {}

    @property
    def done(self) -> bool:
        """Whether there is a report or an error."""
        return self.report is not None or self.error is not None

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        return super()._refusal(vehicle) if vehicle.rules is None else None

    def _found(self, vehicle: Vehicle, now: float) -> None:
        if self.mission.autopilot is not None and self.rules.name != self.mission.autopilot:
            self.error = HoldsOtherError(
                f"the mission is for another autopilot, {vehicle.address} runs {vehicle.firmware}"
            )
            return
        try:
            check_uploadable(self.mission, self.rules, self._source)
        except InputError as error:
            self.error = error
            return
        self._lists = lists_to_send(self.mission, self.rules)
        self._todo = list(self._lists)
        if self.rules.name == "px4":
            self._announced_by = now + ANNOUNCED_S
            self._ask_at = now
        self._on_tick(now)

    # -- time and messages ------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        if self._download is not None:
            self._download.receive(message, now)
        if (
            message.get_type() == "MISSION_CURRENT"
            and self.vehicle is not None
            and sender(message) == self.vehicle.address
        ):
            self._infeasible = message.mission_state == MISSION_STATE_NO_MISSION
            if self._announced_by is not None:
                self._on_announced(message, self.vehicle)

    def _on_announced(self, message: Message, vehicle: Vehicle) -> None:
        told = {kind: opaque_id(message, kind) for kind in self._lists}
        self._announced_by = None
        if self._watch is not None and any(self._watch.signs_of(kind) for kind in self._lists):
            return  # another station is at it: look at every item
        if message.total == len(self._lists[MISSION_TYPE]) and all(
            told[kind] == px4_id(items) for kind, items in self._lists.items()
        ):
            self._id = told[MISSION_TYPE]
            self._same("id", vehicle)

    def _on_tick(self, now: float) -> None:
        vehicle = self.vehicle
        if vehicle is None:
            return
        if self._announced_by is not None:
            if now >= self._announced_by:
                self._announced_by = None
            elif now >= self._ask_at:
                self._ask_at = now + ASK_AGAIN_S
                self._outbox.append(request_message(vehicle.address, MISSION_CURRENT_ID))
        if self._announced_by is None and not self.done:
            self._read(vehicle, now)

    def _read(self, vehicle: Vehicle, now: float) -> None:
        watch = self._watch
        if watch is None:
            return
        for kind, compared in list(self._compared.items()):
            if watch.signs_of(kind) != compared.signs:
                del self._compared[kind]
                self._todo.append(kind)
        if self._download is None:
            self._begin(self._todo[0], watch, vehicle, now)
        elif (signs := (watch.signs_of(self._todo[0]), watch.reboots)) != self._signs:
            self._signs = signs
            self._notes.append(Progress("reading", 0, 0, "another station or a restart: reading again"))
            self._download.restart(now, QUIET_S)
        if self._download is not None:
            self._download.tick(now)
            self._outbox += self._download.to_send()
            self._notes += self._download.events()
            if self._download.outcome is not None:
                self._list_read(self._download, vehicle, now)

    def _begin(self, kind: int, watch: Watch, vehicle: Vehicle, now: float) -> None:
        self._signs = (watch.signs_of(kind), watch.reboots)
        self._download = Download(
            self.manners,
            vehicle.address,
            self.us,
            kind,
            now=now,
            deadline=self.deadline,
            pace=self._pace,
            phase=f"reading {THINGS[kind]}",
        )
        if watch.signs_of(kind):
            self._download.restart(now, QUIET_S)

    def _list_read(self, download: Download, vehicle: Vehicle, now: float) -> None:
        kind, outcome = self._todo[0], download.outcome
        if outcome is None:
            return
        if outcome.end is not DownloadEnd.COMPLETE:
            why = f": {result_words(outcome.result)}" if outcome.result is not None else " in time"
            self.error = UncertainError(
                f"{vehicle.address} did not give its {THINGS[kind]}{why}: what it holds is not known"
            )
            return
        if kind == MISSION_TYPE:
            self._id = download.opaque_id
        found = differences(self._lists[kind], outcome.items, self.rules, kind)
        words = self._difference_words(kind, outcome.items, found) if found else ""
        self._compared[kind] = _Compared(tuple(found), words, self._signs[0])
        self._todo.pop(0)
        self._download = None
        if self._todo:
            self._on_tick(now)
            return
        wrong = [self._compared[kind] for kind in self._lists if self._compared[kind].found]
        if wrong:
            every = [difference for compared in wrong for difference in compared.found]
            self.error = HoldsOtherError("; ".join(compared.words for compared in wrong), every)
        else:
            self._same("download", vehicle)

    def _difference_words(self, kind: int, held: Sequence[WireItem], found: Sequence[Difference]) -> str:
        if len(held) <= int(kind == MISSION_TYPE and self.rules.home_on_wire):
            return f"{self.rules.title} holds no {THINGS[kind]}"
        shown = "; ".join(difference.words for difference in found[:3]).replace(" was sent", " was expected")
        shown = shown.replace(" were sent", " were expected")
        more = f"; and {len(found) - 3} more" if len(found) > 3 else ""
        thing = "" if kind == MISSION_TYPE else f" as its {THINGS[kind]}"
        return f"{self.rules.title} holds something else{thing}: {shown}{more}"

    def _same(self, by: Literal["id", "download"], vehicle: Vehicle) -> None:
        warnings = []
        if self._infeasible and self.rules.name == "px4":
            found = "holds this mission but judges it not flyable"
            warnings.append(Problem(self.rules.title, found, "not-flyable", "warning"))
        self.report = VerifyReport(
            autopilot=self.rules.name,
            vehicle=vehicle.address,
            items=len(self._lists[MISSION_TYPE]),
            by=by,
            opaque_id=self._id,
            lists=tuple(THINGS[kind] for kind in self._lists),
            warnings=tuple(warnings),
        )

    def _timers(self) -> list[float | None]:
        if self._announced_by is not None:
            return [min(self._ask_at, self._announced_by)]
        return [self._download.next_timer()] if self._download is not None else []

    def _expire(self, now: float, cause: str) -> None:
        del now
        self.error = UncertainError(f"{cause}: what the vehicle holds could not be read; it was not changed")
