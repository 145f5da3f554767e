"""The download: our list request, the vehicle's count, our requests, its items, our ACK. No I/O; see `transfer`.

One item at a time, each request repeated after a short silence. PX4 ends a download when a request comes out of
order (a link that doubles or reorders can do that) and sends nothing again by itself: the list is asked for anew, from
the start, and each time more slowly, so that a late copy of a request arrives before the next one is sent. It also
stays busy until it has our ACK, so every download ends with one.
"""

from dataclasses import dataclass
from enum import Enum

from mavplan.link.manners import Manners
from mavplan.link.outbox import Progress
from mavplan.link.protocol import (
    Address,
    Message,
    Result,
    mission_ack,
    mission_request,
    mission_request_list,
    opaque_id,
    received_item,
)
from mavplan.link.transfer import Move, Pace, State, Transfer
from mavplan.mission.wire import WireItem

LIST_AGAIN_S = 0.5
BUSY_S = 1.0
FORGETTING_MARGIN_S = 0.5
UNSUPPORTED_BELIEVED = 3
FIRST_SPACING_S = 0.1
MOST_SPACING_S = 2.0
"""Pause between an item and the next request, after downloads that the vehicle has ended; doubled each time."""


class DownloadEnd(Enum):
    """How a download ended."""

    COMPLETE = "complete"
    REFUSED = "refused"
    EXPIRED = "out of time"


@dataclass(frozen=True, slots=True)
class DownloadOutcome:
    """The end of a download.

    Attributes
    ----------
    end
        How it ended.
    items
        All items in order, if it is complete.
    result
        The MISSION_ACK's result where it was refused.
    """

    end: DownloadEnd
    items: tuple[WireItem, ...] = ()
    result: int | None = None


class Download(Transfer):
    """Fetch what a vehicle holds of one mission type.

    Parameters
    ----------
    manners
        The vehicle's firmware.
    """

    def __init__(
        self,
        manners: Manners,
        vehicle: Address,
        us: Address,
        mission_type: int = 0,
        *,
        now: float,
        deadline: float,
        pace: Pace | None = None,
        phase: str = "downloading",
    ) -> None:
        super().__init__(
            vehicle, us, mission_type, now=now, deadline=deadline, ask_again_s=LIST_AGAIN_S, pace=pace
        )
        self.outcome: DownloadOutcome | None = None
        self.attempts = 0
        self.answered = False
        """Whether the vehicle has said anything to a request for this list."""
        self.opaque_id: int | None = None
        """The vehicle's checksum of what it gave."""
        self._phase = phase
        self._silence_s = manners.forgets_download_after_s + FORGETTING_MARGIN_S
        self._listed = False
        self._count = 0
        self._items: list[WireItem] = []
        self._requests = 0
        self._sent_at = now
        self._request_at = now
        self._spacing_s = 0.0
        self._heard_at = now
        self._refusals = 0
        self._begin(now)

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        self.answered = self.answered or self._concerns_us(message)
        super().receive(message, now)

    def restart(self, now: float, pause_s: float = 0.0) -> None:
        """Do it all again, after a pause: what was fetched so far may be out of date."""
        self.outcome = None
        if self.state is State.ENDED:
            self._move(Move.RESTARTED)
            self._begin(now)
            self._ask_at = now + pause_s
        else:
            self._pause(now, pause_s)

    def _begin(self, now: float) -> None:
        self.attempts += 1
        self._listed = False
        self._count = 0
        self._items = []
        self._requests = 0
        self._ask_at = now
        if self.attempts > 1:
            self._note(Progress(self._phase, 0, 0, "starting again"))

    def _ask(self, now: float) -> None:
        self._listed = True
        self._send(mission_request_list(self.vehicle, self.mission_type))

    def _on_message(self, message: Message, now: float) -> None:
        if self.state is State.ENDED:
            return
        match message.get_type():
            case "MISSION_COUNT":
                self._on_count(message, now)
            case "MISSION_ITEM_INT":
                self._on_item(received_item(message), now)
            case "MISSION_ACK":
                self._on_ack(int(message.type), now)

    def _on_count(self, message: Message, now: float) -> None:
        if self.state is not State.ASKING:
            if self.state is State.MOVING and message.count != self._count:
                self._pause(now, BUSY_S)  # it is another mission than the one begun
            return
        if not self._listed:  # it answers an earlier request
            return
        self._move(Move.ANSWERED)
        self._heard_at = now
        self._count = int(message.count)
        self.opaque_id = opaque_id(message)
        if self._count == 0:
            self._complete()
        else:
            self._next(now)

    def _on_item(self, item: WireItem, now: float) -> None:
        if self.state is not State.MOVING or item.seq != len(self._items):
            return
        if self._requests == 0:  # it answers an earlier request
            return
        if self._requests == 1:
            self.pace.saw(now - self._sent_at)
        self._heard_at = now
        self._refusals = 0
        self._items.append(item)
        self._note(Progress(self._phase, len(self._items), self._count))
        if len(self._items) == self._count:
            self._complete()
        else:
            self._next(now)

    def _on_ack(self, result: int, now: float) -> None:
        if result in {Result.UNSUPPORTED, Result.NO_SPACE} and self.state is State.ASKING:
            self._refusals += 1
            if self._refusals >= UNSUPPORTED_BELIEVED:
                self._move(Move.REFUSED)
                self.outcome = DownloadOutcome(DownloadEnd.REFUSED, result=result)
            return
        if result == Result.ACCEPTED or self.state is State.PAUSED:
            return
        busy = result == Result.DENIED or self.state is State.ASKING
        if not busy:
            self._slow_down()
        self._pause(now, BUSY_S if busy else max(self._spacing_s, self.pace.repeat_s))

    def _slow_down(self) -> None:
        self._spacing_s = min(MOST_SPACING_S, max(FIRST_SPACING_S, 2 * self._spacing_s))

    def _next(self, now: float) -> None:
        """Request the next item as soon as the spacing allows."""
        self._requests = 0
        self._request_at = now + self._spacing_s
        self._on_moving(now)

    def _on_moving(self, now: float) -> None:
        if now >= self._heard_at + self._silence_s + self._spacing_s:
            self._slow_down()
            self._move(Move.SILENT)
            self._begin(now)
        elif now >= self._request_at:
            self._requests += 1
            self._sent_at = now
            self._request_at = now + self.pace.repeat_s
            self._send(mission_request(self.vehicle, len(self._items), self.mission_type))

    def _moving_timer(self) -> float:
        return min(self._request_at, self._heard_at + self._silence_s + self._spacing_s)

    def _complete(self) -> None:
        self._send(mission_ack(self.vehicle, Result.ACCEPTED, self.mission_type))
        self._move(Move.FINISHED)
        self.outcome = DownloadOutcome(DownloadEnd.COMPLETE, tuple(self._items))

    def _expire(self, now: float) -> None:
        self._move(Move.EXPIRED)
        self.outcome = DownloadOutcome(DownloadEnd.EXPIRED)
