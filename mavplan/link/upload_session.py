"""Upload, read back, compare, judge: from a mission to `UploadReport` or an error that says what the vehicle holds.

::

    connecting ── vehicle found ──> uploading ── all sent ──> reading ── equal ──> settling ──> stored and verified
                                       ^  │                    │  │ ^                 │
                                       │  │     vehicle asks   │  │ └─ foreign traffic, restart, other mission id
                                       │  └<── for items again ┘  │
                                       └──── differs, first time ─┘── differs the same way twice, ──> uncertain
                                                                      or others have written

Nothing is believed but a read-back. A refusal is followed by one too, for the report.
"""

from enum import Enum

from mavplan.errors import InputError, Problem, RefusedError
from mavplan.link.discovery import Vehicle
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.protocol import Message
from mavplan.link.report import UploadReport, broken_off, differing, infeasible, refused, unread
from mavplan.link.session import Session
from mavplan.link.transfer import Progress, State
from mavplan.link.upload import Upload, UploadEnd
from mavplan.link.verdict import Judgement, Verdict
from mavplan.mission.model import Mission
from mavplan.mission.readback import differences
from mavplan.mission.sendable import check_sendable
from mavplan.mission.wire import WireItem, to_wire

QUIET_S = 1.0
"""Pause before doing it again, so that what is still on its way belongs to the past; and a count of ours that is
younger than this may still come late and open the upload anew: nothing is called verified before."""
REFUSAL_READ_S = 15.0
"""For the read-back after a refusal, which only adds to the report."""


class Phase(Enum):
    """What is going on."""

    CONNECTING = "connecting"
    UPLOADING = "uploading"
    READING = "reading back"
    SETTLING = "settling"
    REPORTING = "reading what is held"


class UploadSession(Session):
    """Store a mission on the one vehicle of a link, and know that it is there.

    Parameters
    ----------
    mission
        What to store.
    allow_armed
        Write also to a vehicle whose motors may turn.
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
        allow_armed: bool = False,
        source: str = "",
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=mission.autopilot)
        self.mission = mission
        self.phase = Phase.CONNECTING
        self.report: UploadReport | None = None
        self.items: tuple[WireItem, ...] = ()
        self._allow_armed = allow_armed
        self._source = source
        self._upload: Upload | None = None
        self._download: Download | None = None
        self._verdict: Verdict | None = None
        self._stored: tuple[WireItem, ...] = ()
        self._differed: list[str] | None = None
        self._space: int | None = None
        self._read_backs = 0
        self._uploaded_at = now
        self._reboots = 0
        self._foreign_signs = 0
        self._foreign_writes = 0

    @property
    def done(self) -> bool:
        """Whether there is a report or an error."""
        return self.report is not None or self.error is not None

    # -- the vehicle is found ---------------------------------------------------------------------------------

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        if (error := super()._refusal(vehicle)) is not None:
            return error
        if vehicle.armed and not self._allow_armed:
            return RefusedError(
                f"{vehicle.address} is armed: nothing was sent to a vehicle that may be flying"
            )
        return None

    def _found(self, vehicle: Vehicle, now: float) -> None:
        try:
            check_sendable(self.mission, self.rules, self._source)
        except InputError as error:
            self.error = error
            return
        self.items = to_wire(self.mission, self.rules)
        self._upload = Upload(
            self.items,
            self.manners,
            vehicle.address,
            self.us,
            now=now,
            deadline=self.deadline,
            pace=self._pace,
        )
        self.phase = Phase.UPLOADING
        self._notes.append(Progress("uploading", 0, len(self.items)))
        self._on_tick(now)

    # -- time and messages ------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        for part in (self._upload, self._download, self._verdict):
            if part is not None:
                part.receive(message, now)

    def _on_tick(self, now: float) -> None:
        upload = self._upload
        if upload is None:
            return
        self._look_round(upload, now)
        parts = (upload, self._download, self._verdict)
        for part in parts:
            if part is not None:
                part.tick(now)
        self._advance(upload, now)
        for part in (*parts, self._download):
            if part is not None:
                self._outbox += part.to_send()
        for transfer in (upload, self._download):
            if transfer is not None:
                self._notes += transfer.events()

    def _timers(self) -> list[float | None]:
        parts = (self._upload, self._download, self._verdict)
        timers = [part.next_timer() for part in parts if part is not None]
        waiting = self.phase is Phase.SETTLING and (
            self._verdict is None or self._verdict.outcome is not None
        )
        return [*timers, self._settled_at() if waiting else None]

    def _look_round(self, upload: Upload, now: float) -> None:
        """Take note of what others did to the vehicle meanwhile."""
        watch = self._watch
        if watch is None:
            return
        if watch.space is not None:
            self._space, watch.space = watch.space, None
            upload.tell_space(self._space)
        rebooted = watch.reboots != self._reboots
        disturbed = rebooted or watch.foreign_signs != self._foreign_signs
        self._reboots, self._foreign_signs = watch.reboots, watch.foreign_signs
        if self.phase is Phase.UPLOADING and rebooted:
            upload.vehicle_rebooted(now)
        elif self.phase in {Phase.READING, Phase.SETTLING} and disturbed:
            self._read_again(now)

    # -- the way through the phases ---------------------------------------------------------------------------

    def _advance(self, upload: Upload, now: float) -> None:
        if self.phase in {Phase.READING, Phase.SETTLING} and upload.state is not State.ENDED:
            self._download = None  # the vehicle asks for items again: a late count has opened the upload anew
            self._verdict = None
            self.phase = Phase.UPLOADING
        if self.phase is Phase.UPLOADING and upload.outcome is not None:
            self._upload_ended(upload, now)
        elif (
            self.phase is Phase.READING and self._download is not None and self._download.outcome is not None
        ):
            self._read_ended(upload, self._download, now)
        elif (
            self.phase is Phase.REPORTING
            and self._download is not None
            and self._download.outcome is not None
        ):
            self._refusal_read(upload, self._download)
        if self.phase is Phase.SETTLING:
            self._settle(upload, now)

    def _upload_ended(self, upload: Upload, now: float) -> None:
        outcome = upload.outcome
        if outcome is None:
            return
        match outcome.end:
            case UploadEnd.ACCEPTED | UploadEnd.UNRESOLVED:
                self._uploaded_at = now
                self._foreign_writes = self._watch.foreign_writes if self._watch is not None else 0
                self.phase = Phase.READING
                self._read(now)
                self._verdict = self._new_verdict(upload, now)
            case UploadEnd.REFUSED:
                self.phase = Phase.REPORTING
                self._read(now, deadline=min(self.deadline, now + REFUSAL_READ_S))
            case UploadEnd.EXPIRED:
                self.error = broken_off(
                    upload, self.rules, self.manners, f"no end within {self.deadline_s:g} s"
                )

    def _new_verdict(self, upload: Upload, now: float) -> Verdict | None:
        wait_s = self.manners.judges_after_s
        if wait_s is None or self.vehicle is None:
            return None
        return Verdict(self.vehicle.address, len(self.items), upload.opaque_id, not_before=now + wait_s)

    def _read(self, now: float, deadline: float | None = None) -> None:
        if self.vehicle is None:
            return
        self._read_backs += 1
        until = self.deadline if deadline is None else deadline
        self._download = Download(
            self.manners,
            self.vehicle.address,
            self.us,
            now=now,
            deadline=until,
            pace=self._pace,
            phase="reading back",
        )
        self._download.tick(now)

    def _read_again(self, now: float) -> None:
        self._notes.append(
            Progress("reading back", 0, len(self.items), "another station or a restart: reading again")
        )
        self.phase = Phase.READING
        if self._download is None:
            self._read(now)
        else:
            self._read_backs += 1
            self._download.restart(now, QUIET_S)

    def _read_ended(self, upload: Upload, download: Download, now: float) -> None:
        outcome = download.outcome
        if outcome is None or outcome.end is not DownloadEnd.COMPLETE:
            self.error = unread(upload, self.rules, f"no end within {self.deadline_s:g} s")
            return
        found = differences(self.items, outcome.items, self.rules)
        if not found:
            self._stored = outcome.items
            self.phase = Phase.SETTLING
        elif self._watch is not None and self._watch.foreign_writes > self._foreign_writes:
            self.error = differing(found, self.rules, "another ground station has written to the vehicle: ")
        elif (words := [difference.words for difference in found]) == self._differed:
            self.error = differing(found, self.rules)
        else:
            self._differed = words
            self._download = None
            self._verdict = None
            self.phase = Phase.UPLOADING
            self._notes.append(
                Progress("uploading", 0, len(self.items), "the read-back differs: uploading again")
            )
            upload.restart(now, QUIET_S)

    def _refusal_read(self, upload: Upload, download: Download) -> None:
        ended, outcome, watch = upload.outcome, download.outcome, self._watch
        if ended is None or outcome is None or watch is None:
            return
        stored = outcome.items if outcome.end is DownloadEnd.COMPLETE else None
        self.error = refused(
            upload,
            ended,
            self.rules,
            self.manners,
            texts=watch.texts,
            space=self._space,
            stored=stored,
            found=differences(self.items, stored, self.rules) if stored is not None else (),
        )

    def _settled_at(self) -> float:
        last_count = self._upload.count_sent_at if self._upload is not None else None
        return (last_count if last_count is not None else self.started_at) + QUIET_S

    def _settle(self, upload: Upload, now: float) -> None:
        verdict, watch = self._verdict, self._watch
        if verdict is not None and verdict.other_mission:
            verdict.other_mission = False
            self._read_again(now)
            return
        if now < self._settled_at() or (verdict is not None and verdict.outcome is None):
            return
        if verdict is not None and verdict.outcome is Judgement.INFEASIBLE:
            self.error = infeasible(len(self.items), self.rules, watch.texts if watch is not None else ())
            return
        self._succeed(upload, now, verdict.outcome if verdict is not None else None)

    def _succeed(self, upload: Upload, now: float, judgement: Judgement | None) -> None:
        if self.vehicle is None:
            return
        warnings: list[Problem] = []
        if judgement is Judgement.UNKNOWN:
            words = "did not tell whether it takes the stored mission for flyable"
            warnings.append(Problem(self.rules.title, words, "not-judged", "warning"))
        self.report = UploadReport(
            items=len(self.items),
            autopilot=self.rules.name,
            vehicle=self.vehicle.address,
            judgement=judgement,
            opaque_id=upload.opaque_id,
            upload_s=self._uploaded_at - (upload.started_at if upload.started_at is not None else now),
            total_s=now - self.started_at,
            uploads=upload.attempts,
            read_backs=self._read_backs,
            stored=self._stored,
            warnings=tuple(warnings),
        )

    def _expire(self, now: float, cause: str) -> None:
        upload = self._upload
        if upload is None:
            self.error = RefusedError(f"{cause}: nothing was sent")
        elif self.phase is Phase.SETTLING:
            self._succeed(upload, now, Judgement.UNKNOWN if self._verdict is not None else None)
        elif self.phase is Phase.READING:
            self.error = unread(upload, self.rules, cause)
        elif self.phase is Phase.REPORTING and upload.outcome is not None and self._watch is not None:
            self.error = refused(
                upload,
                upload.outcome,
                self.rules,
                self.manners,
                texts=self._watch.texts,
                space=self._space,
                stored=None,
                found=(),
            )
        else:
            self.error = broken_off(upload, self.rules, self.manners, cause)
