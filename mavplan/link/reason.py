"""Why PX4 judges a stored mission not flyable: it says so in an event, which a bad radio may lose. No I/O.

The event is sent once, right after the judgement. What was lost is asked for again; what happened before all of the
mission was sent does not count, for it is about another one.
"""

from mavplan.link.event_log import Mark
from mavplan.link.event_messages import request_event
from mavplan.link.outbox import Outbox
from mavplan.link.protocol import Address
from mavplan.link.px4_events import decides, reason_words
from mavplan.link.transfer import Pace
from mavplan.link.watch import Watch

ASK_AGAIN_S = 0.4
PATIENCE_S = 8.0
"""The vehicle says every 3 s which number its last event had: after two of those it is not waited for any longer."""


class Reason(Outbox):
    """Collects what a vehicle says of a mission, and asks for what was lost.

    Parameters
    ----------
    watch
        Hears the vehicle's events and texts.
    pace
        The link's round trip.
    deadline
        When to give up.
    """

    def __init__(self, watch: Watch, pace: Pace, *, deadline: float) -> None:
        self.done = False
        """Whether there is nothing more to wait for."""
        self._watch = watch
        self._vehicle: Address = watch.vehicle
        self._pace = pace
        self._deadline = deadline
        self._mark: Mark | None = None
        self._texts_before = 0
        self._asked_at: float | None = None
        self._ask_at = 0.0
        super().__init__()

    def mission_sent(self) -> None:
        """Take note that the last item goes out; from the first time on the vehicle may speak of this mission."""
        if self._mark is None:
            self._mark = self._watch.events.mark(self._watch.uptime_s)
            self._texts_before = self._watch.texts_heard

    def ask(self, now: float) -> None:
        """Begin to look for the reason, if that has not begun yet."""
        if self._asked_at is None:
            self._asked_at = self._ask_at = now
            self._deadline = min(self._deadline, now + PATIENCE_S)
            self.tick(now)

    def drop(self) -> None:
        """Begin again when the vehicle has judged anew."""
        self._asked_at = None
        self.done = False

    @property
    def events(self) -> tuple[str, ...]:
        """What the vehicle's events say of the mission."""
        return reason_words(self._watch.events.since(self._mark)) if self._mark is not None else ()

    @property
    def texts(self) -> list[str]:
        """What the vehicle's texts say since the mission was sent."""
        return self._watch.texts_since(self._texts_before)

    def tick(self, now: float) -> None:
        """Ask again for lost events; end where one decides, none is lost, or patience is over."""
        mark, log = self._mark, self._watch.events
        if self._asked_at is None or self.done:
            return
        if mark is None or now >= self._deadline:
            self.done = True
            return
        missing = log.missing(mark)
        told = log.told_at is not None and log.told_at >= self._asked_at
        self.done = any(decides(event) for event in log.since(mark)) or (told and missing is None)
        if not self.done and missing is not None and now >= self._ask_at:
            self._ask_at = now + max(ASK_AGAIN_S, self._pace.repeat_s)
            self._outbox.append(request_event(self._vehicle, *missing))

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters."""
        if self._asked_at is None or self.done or self._mark is None:
            return None
        lost = self._watch.events.missing(self._mark) is not None
        return min(self._ask_at, self._deadline) if lost else self._deadline
