"""One list onto a vehicle: upload, read back, compare, judge. No I/O; `mavplan.link.upload_session` goes list by list.

::

    uploading ── all sent ──> reading ── equal ──> settling ──> stored and verified
       ^  │                    │  │ ^                 │
       │  │     vehicle asks   │  │ └─ foreign traffic, restart, other mission id
       │  └<── for items again ┘  │
       └──── differs, first time ─┘── differs the same way twice, ──> uncertain
                                      or others have written

Nothing is believed but a read-back. A refusal is followed by one too, for the report. A mission that PX4 judges not
flyable is asked about for the reason.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from mavplan.errors import MavplanError, RefusedError
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.manners import Manners
from mavplan.link.outbox import NotedOutbox, Progress
from mavplan.link.protocol import Address, Message, MissionType, Result
from mavplan.link.reason import Reason
from mavplan.link.report import THINGS, broken_off, differing, infeasible, refused, unread, unsettled
from mavplan.link.transfer import Pace, State
from mavplan.link.transfers import OWN, Transfers
from mavplan.link.upload import UploadEnd, UploadOutcome
from mavplan.link.verdict import Judgement, Verdict
from mavplan.link.watch import Watch
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.checksum import px4_id
from mavplan.mission.readback import Difference, differences
from mavplan.mission.wire import WireItem

QUIET_S = 1.0
"""Pause before doing it again, so that what is still on its way belongs to the past; and a count of ours that is
younger than this may still come late and open the upload anew: nothing is called verified before."""
REFUSAL_READ_S = 15.0
"""For the read-back after a refusal, which only adds to the report."""


class Phase(Enum):
    """What is going on."""

    UPLOADING = "uploading"
    READING = "reading back"
    SETTLING = "settling"
    REPORTING = "reading what is held"


@dataclass(frozen=True, slots=True)
class Stored:
    """A list that is stored and verified.

    Attributes
    ----------
    items
        As the vehicle gave them back.
    judgement
        What PX4 thinks of a mission; None where nothing is judged.
    opaque_id
        The vehicle's checksum, where it has one.
    upload_s
        Seconds from the first count to the ACK (or to the last item, if the ACK was lost).
    uploads, read_backs
        How often it took.
    """

    items: tuple[WireItem, ...]
    judgement: Judgement | None
    opaque_id: int | None
    upload_s: float
    uploads: int
    read_backs: int


class Store(NotedOutbox):
    """Store one list on a vehicle, and know that it is there.

    Parameters
    ----------
    kind
        MAV_MISSION_TYPE of the list.
    items
        What to store, at least one.
    vehicle, us, rules, manners
        The two addresses; the vehicle's firmware.
    watch, pace
        What goes on around; the link's round trip. Others feed them too.
    now, deadline, deadline_s
        Start; when it ends at the latest; how long that was, for messages.
    allow_armed
        Begin again also when the vehicle has been armed meanwhile.
    transfers
        Who carries out the transfers.
    """

    def __init__(
        self,
        kind: int,
        items: Sequence[WireItem],
        *,
        vehicle: Address,
        us: Address,
        rules: AutopilotRules,
        manners: Manners,
        watch: Watch,
        pace: Pace,
        now: float,
        deadline: float,
        deadline_s: float,
        allow_armed: bool = False,
        transfers: Transfers = OWN,
    ) -> None:
        self.kind = int(kind)
        self.items = tuple(items)
        self.phase = Phase.UPLOADING
        self.outcome: Stored | MavplanError | None = None
        self.deadline = deadline
        self.deadline_s = deadline_s
        self.rules = rules
        self.manners = dataclasses.replace(
            manners, atomic=manners.atomic or self.kind in manners.atomic_lists
        )
        self._vehicle = vehicle
        self._us = us
        self._watch = watch
        self._pace = pace
        self._allow_armed = allow_armed
        self._transfers = transfers
        self.upload = transfers.upload(
            self.items, self.manners, vehicle, us, self.kind, now=now, deadline=deadline, pace=pace
        )
        self._download: Download | None = None
        self._verdict: Verdict | None = None
        self._reason = Reason(watch, pace, deadline=deadline)
        self._stored: tuple[WireItem, ...] = ()
        self._opaque_id: int | None = None
        self._differed: list[str] | None = None
        self._space: int | None = None
        self._read_backs = 0
        self._uploaded_at = now
        super().__init__()
        self._notes = [Progress(f"uploading{self._suffix}", 0, len(self.items))]
        watch.mission_type = self.kind
        watch.space = None
        self._reboots = watch.reboots
        self._foreign_signs = watch.foreign_signs
        self._foreign_writes = watch.foreign_writes

    # -- time and messages ------------------------------------------------------------------------------------

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        for part in (self.upload, self._download, self._verdict):
            if part is not None:
                part.receive(message, now)

    def tick(self, now: float) -> None:
        """Let time pass."""
        if self.outcome is not None:
            return
        self._look_round(now)
        if self._would_begin() and self._watch.armed and not self._allow_armed:
            cause = "the vehicle has been armed meanwhile, so nothing more was sent"
            self.outcome = broken_off(self.upload, self.rules, self.manners, cause)
            return
        parts = (self.upload, self._download, self._verdict, self._reason)
        for part in parts:
            if part is not None:
                part.tick(now)
        if self.upload.all_sent:
            self._reason.mission_sent()
        self._advance(now)
        for part in (*parts, self._download):
            if part is not None:
                self._outbox += part.to_send()
        for transfer in (self.upload, self._download):
            if transfer is not None:
                self._notes += transfer.events()

    def timers(self) -> list[float | None]:
        """Return the times of the next ticks that matter."""
        if self.outcome is not None:
            return []
        parts = (self.upload, self._download, self._verdict, self._reason)
        timers = [part.next_timer() for part in parts if part is not None]
        judged = self._verdict is None or self._verdict.outcome is not None
        waiting = self.phase is Phase.SETTLING and judged and self._reason.next_timer() is None
        return [*timers, self._settled_at() if waiting else None]

    def _look_round(self, now: float) -> None:
        """Take note of what others did to the vehicle meanwhile."""
        watch = self._watch
        if watch.space is not None:
            self._space, watch.space = watch.space, None
            self.upload.tell_space(self._space)
        rebooted = watch.reboots != self._reboots
        disturbed = rebooted or watch.foreign_signs != self._foreign_signs
        self._reboots, self._foreign_signs = watch.reboots, watch.foreign_signs
        if self.phase is Phase.UPLOADING and rebooted:
            self.upload.vehicle_rebooted(now)
        elif self.phase in {Phase.READING, Phase.SETTLING} and disturbed:
            self._read_again(now)

    def _would_begin(self) -> bool:
        """Whether the next thing to be sent is a count: on ArduPilot it cuts off what is there."""
        return self.phase is Phase.UPLOADING and self.upload.state in {State.ASKING, State.PAUSED}

    # -- the way through the phases ---------------------------------------------------------------------------

    def _advance(self, now: float) -> None:
        if self.phase in {Phase.READING, Phase.SETTLING} and self.upload.state is not State.ENDED:
            self._download = None  # the vehicle asks for items again: a late count has opened the upload anew
            self._verdict = None
            self.phase = Phase.UPLOADING
        download_ended = self._download is not None and self._download.outcome is not None
        if self.phase is Phase.UPLOADING and self.upload.outcome is not None:
            self._upload_ended(self.upload.outcome, now)
        elif self.phase is Phase.READING and self._download is not None and download_ended:
            self._read_ended(self._download, now)
        elif self.phase is Phase.REPORTING and self._download is not None and download_ended:
            self._refusal_read(self._download)
        if self.phase is Phase.SETTLING:
            self._settle(now)

    def _upload_ended(self, outcome: UploadOutcome, now: float) -> None:
        match outcome.end:
            case UploadEnd.ACCEPTED | UploadEnd.UNRESOLVED:
                self._uploaded_at = now
                self._foreign_writes = self._watch.foreign_writes
                self.phase = Phase.READING
                self._verdict = None
                self._read(now)
            case UploadEnd.REFUSED:
                self.phase = Phase.REPORTING
                self._read(now, deadline=min(self.deadline, now + REFUSAL_READ_S))
            case UploadEnd.EXPIRED:
                cause = f"no end within {self.deadline_s:g} s"
                self.outcome = broken_off(self.upload, self.rules, self.manners, cause)

    def _new_verdict(self, now: float) -> Verdict | None:
        """Return one that hears only what is said after the read-back, and of the mission that was read back."""
        wait_s = self.manners.judges_after_s
        if wait_s is None or self.kind != MissionType.MISSION:
            return None
        not_before = max(now, self._uploaded_at + wait_s)
        return Verdict(self._vehicle, len(self.items), self._opaque_id, not_before=not_before)

    def _read(self, now: float, deadline: float | None = None) -> None:
        self._read_backs += 1
        self._download = self._transfers.download(
            self.manners,
            self._vehicle,
            self._us,
            self.kind,
            now=now,
            deadline=self.deadline if deadline is None else deadline,
            pace=self._pace,
            phase=f"reading back{self._suffix}",
        )
        self._download.tick(now)

    def _read_again(self, now: float) -> None:
        self._note("reading back", "another station or a restart: reading again")
        self.phase = Phase.READING
        self._verdict = None
        if self._download is None:
            self._read(now)
        else:
            self._read_backs += 1
            self._download.restart(now, QUIET_S)

    def _read_ended(self, download: Download, now: float) -> None:
        outcome, watch = download.outcome, self._watch
        if outcome is None or outcome.end is not DownloadEnd.COMPLETE:
            self.outcome = unread(self.upload, self.rules, f"no end within {self.deadline_s:g} s")
            return
        found = differences(self.items, outcome.items, self.rules, self.kind)
        found += self._other_id(download) if not found else []
        if not found:
            self._stored = outcome.items
            self._opaque_id = download.opaque_id or self.upload.opaque_id
            self._verdict = self._new_verdict(now)
            self._reason.drop()
            self.phase = Phase.SETTLING
        elif watch.foreign_writes > self._foreign_writes:
            reason = "another ground station has written to the vehicle: "
            self.outcome = differing(found, self.rules, reason, self.kind)
        elif (words := [difference.words for difference in found]) == self._differed:
            if self._refused_as_a_whole():
                refusal = UploadOutcome(UploadEnd.REFUSED, Result.ERROR)
                self.outcome = self._refused(refusal, outcome.items)
            else:
                self.outcome = differing(found, self.rules, mission_type=self.kind)
        elif watch.armed and not self._allow_armed:
            reason = "the vehicle has been armed, so nothing more was sent: "
            self.outcome = differing(found, self.rules, reason, self.kind)
        else:
            self._differed = words
            self._download = None
            self._verdict = None
            self.phase = Phase.UPLOADING
            self._note("uploading", "the read-back differs: uploading again")
            self.upload.restart(now, QUIET_S)

    def _other_id(self, download: Download) -> list[Difference]:
        """Find that the vehicle's id of the list is another one: not every field reads back as it is flown."""
        announced, acked = download.opaque_id, self.upload.opaque_id
        if announced is None:
            return []
        ours = px4_id(self.items)
        if announced == ours or (announced == acked and acked != ours):  # a version that counts otherwise
            return []
        words = f"all fields read back as sent, but the vehicle's checksum is {announced}, not {ours}"
        return [Difference(None, "checksum", ours, announced, words)]

    def _refused_as_a_whole(self) -> bool:
        """Whether the vehicle looked at a whole fence, said no without a better word, and kept its old one."""
        judged = self.kind != MissionType.MISSION and self.manners.atomic
        return judged and self.upload.accepted_at is None and self.upload.put_off_by == Result.ERROR

    def _refusal_read(self, download: Download) -> None:
        outcome = download.outcome
        if outcome is not None and self.upload.outcome is not None:
            stored = outcome.items if outcome.end is DownloadEnd.COMPLETE else None
            self.outcome = self._refused(self.upload.outcome, stored)

    def _refused(self, ended: UploadOutcome, stored: Sequence[WireItem] | None) -> MavplanError:
        return refused(
            self.upload,
            ended,
            self.rules,
            self.manners,
            texts=self._watch.texts,
            space=self._space,
            stored=stored,
            found=differences(self.items, stored, self.rules, self.kind) if stored is not None else (),
        )

    def _settled_at(self) -> float:
        last_count = self.upload.count_sent_at
        return (last_count if last_count is not None else self._uploaded_at) + QUIET_S

    def _settle(self, now: float) -> None:
        verdict = self._verdict
        if verdict is not None and verdict.other_mission:
            self._read_again(now)
            return
        if now < self._settled_at() or (verdict is not None and verdict.outcome is None):
            return
        if verdict is not None and verdict.outcome is Judgement.INFEASIBLE:
            self._reason.ask(now)
            if self._reason.done:
                self.outcome = self._infeasible()
            return
        self._succeed(now, verdict.outcome if verdict is not None else None)

    def _infeasible(self) -> RefusedError:
        return infeasible(len(self.items), self.rules, self._reason.events, self._reason.texts)

    def _succeed(self, now: float, judgement: Judgement | None) -> None:
        upload = self.upload
        self.outcome = Stored(
            items=self._stored,
            judgement=judgement,
            opaque_id=self._opaque_id,
            upload_s=self._uploaded_at - (upload.started_at if upload.started_at is not None else now),
            uploads=upload.attempts,
            read_backs=self._read_backs,
        )

    def expire(self, now: float, cause: str) -> None:
        """End with what is known."""
        if self.outcome is not None:
            return
        self._look_round(now)
        if self.phase is Phase.SETTLING:
            self._expire_settling(now, cause)
        elif self.phase is Phase.READING:
            self.outcome = unread(self.upload, self.rules, cause)
        elif self.phase is Phase.REPORTING and self.upload.outcome is not None:
            self.outcome = self._refused(self.upload.outcome, None)
        elif self.upload.count_sent_at is None:
            self.outcome = RefusedError(f"{cause}: nothing of the {THINGS[self.kind]} was sent")
        else:
            self.outcome = broken_off(self.upload, self.rules, self.manners, cause)

    def _expire_settling(self, now: float, cause: str) -> None:
        verdict = self._verdict
        if self.upload.state is not State.ENDED:  # a late count has opened the upload anew
            self.outcome = broken_off(self.upload, self.rules, self.manners, cause)
        elif verdict is not None and verdict.outcome is Judgement.INFEASIBLE:
            self.outcome = self._infeasible()
        elif now < self._settled_at() or (verdict is not None and verdict.other_mission):
            self.outcome = unsettled(self.upload, self.rules, cause)
        else:
            self._succeed(now, Judgement.UNKNOWN if verdict is not None else None)

    @property
    def _suffix(self) -> str:
        return "" if self.kind == MissionType.MISSION else f" {THINGS[self.kind]}"

    def _note(self, phase: str, words: str) -> None:
        self._notes.append(Progress(f"{phase}{self._suffix}", 0, len(self.items), words))
