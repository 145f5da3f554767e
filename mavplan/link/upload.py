"""The upload: our count, the vehicle's requests, our items, its ACK. No I/O; see `mavplan.link.transfer`.

What made other ground stations fail on a bad radio, and what is done here:

- The count gets lost: it is sent again every second until the first request.
- A request or an item gets lost: after a short silence the item last asked for is sent again unasked, then the one
  after it (the vehicle may have the first and we not its next request), in turn, never the same within 0.25 s.
- A request comes twice: it is answered again, but not within 0.25 s of the last answer.
- INVALID_SEQUENCE is the answer to such a repeat on ArduPilot, and not the end.
- The last ACK gets lost: the outcome is `UploadEnd.UNRESOLVED`, and reading back decides.
- "Busy", "error" and "cancelled" are waited out, and the whole upload is sent again.

An ACK is never proof: whoever holds this transfer reads back what the vehicle has.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from mavplan.link.manners import Manners
from mavplan.link.outbox import Progress
from mavplan.link.protocol import (
    PUT_OFF,
    REFUSES_ITEM,
    Address,
    Message,
    Result,
    mission_count,
    mission_item,
    opaque_id,
)
from mavplan.link.transfer import Move, Pace, State, Transfer
from mavplan.mission.wire import WireItem

SAME_ITEM_S = 0.25
"""The same item is not sent again sooner: a flood of requests is not fed."""
COUNT_AGAIN_S = 1.0
PUT_OFF_S = 1.5
"""Pause after "busy" or "error"; longer than ArduPilot's request interval, so that a live transfer shows itself."""
FORGETTING_MARGIN_S = 0.5
LAST_ITEM_S = 1.5
"""Silence after the last item for this long: read back instead of waiting for an ACK that may be lost."""
REFUSALS_BELIEVED = 3
"""Counts in a row that must be refused where a refusal could be a late answer to something else."""
FULL_BELIEVED = 8
"""Counts in a row without room where the vehicle may be starting: the text that would say so may be lost."""


class UploadEnd(Enum):
    """How an upload ended, as far as the transfer alone can tell."""

    ACCEPTED = "accepted"
    UNRESOLVED = "all sent, no answer"
    REFUSED = "refused"
    EXPIRED = "out of time"


@dataclass(frozen=True, slots=True)
class UploadOutcome:
    """The end of an upload.

    Attributes
    ----------
    end
        How it ended.
    result
        The MISSION_ACK's result where it was refused.
    seq
        The item that was refused; None if it was the count.
    """

    end: UploadEnd
    result: int | None = None
    seq: int | None = None


class Upload(Transfer):
    """Send a list of items to a vehicle.

    Parameters
    ----------
    items
        What to send, ``seq`` 0 to n−1; at least one.
    manners
        The vehicle's firmware.
    """

    def __init__(
        self,
        items: Sequence[WireItem],
        manners: Manners,
        vehicle: Address,
        us: Address,
        mission_type: int = 0,
        *,
        now: float,
        deadline: float,
        pace: Pace | None = None,
    ) -> None:
        super().__init__(
            vehicle, us, mission_type, now=now, deadline=deadline, ask_again_s=COUNT_AGAIN_S, pace=pace
        )
        self.items = tuple(items)
        self.manners = manners
        self.outcome: UploadOutcome | None = None
        self.attempts = 0
        self.started_at: float | None = None
        """When the first count was sent."""
        self.accepted_at: float | None = None
        self.count_sent_at: float | None = None
        """When the last count was sent."""
        self.opaque_id: int | None = None
        """The vehicle's checksum of what it accepted."""
        self.taken = False
        """Whether the vehicle ever asked for an item: from then on ArduPilot's old mission is gone."""
        self.highest_asked = -1
        """Highest item ever asked for."""
        self.was_whole = False
        """Whether an earlier try sent every item: the vehicle may have stored that."""
        self.put_off_by: int | None = None
        """The last result that put us off."""
        self._counts_unheard = 0
        self._count_is_open = False
        self._counted = False
        self._refused_counts = 0
        self._space_told: int | None = None
        self._boots = False
        self._sent_at: dict[int, float] = {}
        self._sends: dict[int, int] = {}
        self._asked = 0
        self._due: float | None = None
        self._heard_at = now
        self._last_send_at = now
        self._ahead = False
        self._begin(now)

    @property
    def all_sent(self) -> bool:
        """Whether every item has been sent since the last count."""
        return len(self._sent_at) == len(self.items)

    @property
    def unanswered_counts(self) -> int:
        """Counts of which nothing was heard: they may have arrived all the same."""
        return self._counts_unheard + int(self._count_is_open)

    def restart(self, now: float, pause_s: float = 0.0) -> None:
        """Do it all again, after a pause."""
        self.outcome = None
        if self.state is State.ENDED:
            self._move(Move.RESTARTED)
        self._begin(now)
        self._ask_at = now + pause_s

    def tell_space(self, items: int) -> None:
        """Take the number of items the vehicle says it has room for (home included); it comes after the ACK."""
        self._space_told = items
        self._boots = items == 0  # it is still starting
        refused = self.state is State.PAUSED and self.put_off_by == Result.NO_SPACE
        if refused and 0 < items < len(self.items):
            self._end(Move.REFUSED, UploadOutcome(UploadEnd.REFUSED, Result.NO_SPACE))

    def vehicle_rebooted(self, now: float) -> None:
        """Take note that the vehicle has started anew and forgotten the transfer."""
        if self.state in {State.MOVING, State.ASKING}:
            self._note(Progress("uploading", 0, len(self.items), "the vehicle restarted"))
            self._pause(now, PUT_OFF_S)

    # -- sending ----------------------------------------------------------------------------------------------

    def _ask(self, now: float) -> None:
        self._counts_unheard += int(self._count_is_open)
        self._count_is_open = self._counted = True
        self.started_at = now if self.started_at is None else self.started_at
        self.count_sent_at = now
        self._space_told = None
        self._send(mission_count(self.vehicle, len(self.items), self.mission_type))

    def _begin(self, now: float) -> None:
        self.attempts += 1
        self.was_whole = self.was_whole or (self.attempts > 1 and self.all_sent)
        self._counted = False
        self._sent_at.clear()
        self._sends.clear()
        self._asked = 0
        self._due = None
        self._ask_at = now
        if self.attempts > 1:
            self._note(Progress("uploading", 0, len(self.items), "starting again"))

    def _send_item(self, seq: int, now: float) -> None:
        self._sent_at[seq] = now
        self._sends[seq] = self._sends.get(seq, 0) + 1
        self._last_send_at = now
        self._send(mission_item(self.vehicle, self.items[seq], self.mission_type))

    def _on_moving(self, now: float) -> None:
        if self._due is not None and now >= self._due:
            self._due = None
            self._ahead = False
            self._send_item(self._asked, now)
        if now >= self._unresolved_at():
            self._end(Move.FINISHED, UploadOutcome(UploadEnd.UNRESOLVED))
        elif now >= self._forgotten_at():
            self._move(Move.SILENT)
            self._begin(now)
        elif now >= self._repeat_at():
            self._repeat(now)

    def _repeat(self, now: float) -> None:
        ahead = self._asked + 1
        self._ahead = not self._ahead
        if self._ahead or ahead >= len(self.items):
            self._send_item(self._asked, now)
        else:
            self._send_item(ahead, now)

    def _repeat_at(self) -> float:
        return self._last_send_at + self.pace.repeat_s

    def _forgotten_at(self) -> float:
        return self._heard_at + self.manners.forgets_after_s + FORGETTING_MARGIN_S

    def _unresolved_at(self) -> float:
        if not self.all_sent or self._asked < len(self.items) - 1:
            return math.inf
        return self._heard_at + max(LAST_ITEM_S, 3 * self.pace.repeat_s)

    def _moving_timer(self) -> float:
        timers = [self._repeat_at(), self._forgotten_at()]
        if self._due is not None:
            timers.append(self._due)
        return min(*timers, self._unresolved_at())

    # -- receiving --------------------------------------------------------------------------------------------

    def _on_message(self, message: Message, now: float) -> None:
        match message.get_type():
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                self._on_request(message.seq, now)
            case "MISSION_ACK":
                self._on_ack(message, now)

    def _on_request(self, seq: int, now: float) -> None:
        # Before the count of this try is out, a request is an answer to an earlier one's.
        if not 0 <= seq < len(self.items) or not self._counted:
            return
        if self.outcome is not None and self.outcome.end in {UploadEnd.REFUSED, UploadEnd.EXPIRED}:
            self.taken = True  # a late copy of the count was taken after all
            return
        if self.state is State.ENDED:
            self.outcome = None
        self._move(Move.ANSWERED)
        self.taken = True
        self._count_is_open = False
        self._refused_counts = 0
        self._heard_at = now
        if self._sends.get(seq - 1) == 1 and seq not in self._sent_at:
            self.pace.saw(now - self._sent_at[seq - 1])
        if seq > self.highest_asked:
            self.highest_asked = seq
            self._note(Progress("uploading", seq, len(self.items)))
        self._asked = seq
        sent_at = self._sent_at.get(seq)
        self._due = now if sent_at is None else max(now, sent_at + SAME_ITEM_S)
        self._on_moving(now)

    def _on_ack(self, message: Message, now: float) -> None:
        if self.state is State.ENDED or not self._counted:
            return
        result = int(message.type)
        self._count_is_open = False
        if result == Result.ACCEPTED:
            if self.all_sent:  # else it answers an earlier transfer
                self.opaque_id = opaque_id(message)
                self.accepted_at = now
                self._end(Move.FINISHED, UploadOutcome(UploadEnd.ACCEPTED))
        elif result in PUT_OFF or (result == Result.NO_SPACE and self.state is not State.ASKING):
            self._on_put_off(result, now)
        elif result == Result.NO_SPACE:
            self._on_no_space(now)
        elif result in REFUSES_ITEM:
            self._on_refusal(result, now)

    def _on_put_off(self, result: int, now: float) -> None:
        self.put_off_by = result
        if self.all_sent and result != Result.OPERATION_CANCELLED:
            # "Error" is also ArduPilot's answer to a repeat of the last item after it has taken all.
            self._end(Move.FINISHED, UploadOutcome(UploadEnd.UNRESOLVED))
        elif self.state is not State.PAUSED:
            self._pause(now, PUT_OFF_S)

    def _on_no_space(self, now: float) -> None:
        self._refused_counts += 1
        booting = self.manners.boots_without_space
        told = self._space_told
        if (
            not booting
            or (told and told < len(self.items))
            or (told is None and not self._boots and self._refused_counts >= FULL_BELIEVED)
        ):
            self._end(Move.REFUSED, UploadOutcome(UploadEnd.REFUSED, Result.NO_SPACE))
        else:
            self.put_off_by = Result.NO_SPACE
            self._pause(now, COUNT_AGAIN_S)

    def _on_refusal(self, result: int, now: float) -> None:
        if self._sent_at:
            ahead = self._asked + 1
            seq = ahead if ahead in self._sent_at else self._asked
            self._end(Move.REFUSED, UploadOutcome(UploadEnd.REFUSED, result, seq))
            return
        self._refused_counts += 1
        if self._refused_counts >= REFUSALS_BELIEVED:
            self._end(Move.REFUSED, UploadOutcome(UploadEnd.REFUSED, result))
        elif self.state is State.ASKING:
            self._pause(now, COUNT_AGAIN_S)

    def _end(self, move: Move, outcome: UploadOutcome) -> None:
        self._move(move)
        self.outcome = outcome

    def _expire(self, now: float) -> None:
        self._end(Move.EXPIRED, UploadOutcome(UploadEnd.EXPIRED))
