"""Which of a vehicle's events were heard, and which were lost. No I/O.

A vehicle numbers its events and sends each once, to everybody; it says now and then which number was the last
(CURRENT_EVENT_SEQUENCE). Who misses one asks for it, and all hear the answer: so an event that comes now may be an old
one that another station asked for. `Mark` tells old from new.
"""

from dataclasses import dataclass

from mavplan.link.protocol import Address, Message
from mavplan.link.px4_events import Event

KEPT = 64
MOST_ASKED = 20
"""PX4 keeps so many."""
CLOCK_ROUNDING_S = 0.01
_NUMBERS = 1 << 16


@dataclass(frozen=True, slots=True)
class Mark:
    """A moment in a vehicle's events: the last number known then, its clock, and how often it had started.

    ``sequence`` is None where no number was known.
    """

    sequence: int | None
    uptime_s: float
    starts: int


def comes_after(sequence: int, other: int) -> bool:
    """Whether a number of 16 bits is a later one than another."""
    return 0 < (sequence - other) % _NUMBERS < _NUMBERS // 2


class EventLog:
    """Keeps the events of one vehicle, each once.

    Parameters
    ----------
    us
        Events that are for somebody else are left out.
    """

    def __init__(self, us: Address) -> None:
        self.told_at: float | None = None
        """When the vehicle last said which number was its last."""
        self._us = us
        self._events: dict[int, Event] = {}
        self._gone: set[int] = set()
        self._latest: int | None = None
        self._starts = 0

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle."""
        match message.get_type():
            case "EVENT":
                for_us = message.destination_system in {0, self._us.system}
                if for_us and message.destination_component in {0, self._us.component}:
                    self._take(_event(message))
            case "CURRENT_EVENT_SEQUENCE":
                self.told_at = now
                self._reached(int(message.sequence))
            case "RESPONSE_EVENT_ERROR":
                self._lose(int(message.sequence), int(message.sequence_oldest_available))

    def vehicle_restarted(self) -> None:
        """Forget everything: the numbers begin anew."""
        self._events.clear()
        self._gone.clear()
        self._latest = None
        self._starts += 1

    def mark(self, uptime_s: float) -> Mark:
        """Return this moment; ``uptime_s`` is the vehicle's clock as last heard."""
        return Mark(self._latest, uptime_s, self._starts)

    def since(self, mark: Mark) -> list[Event]:
        """Return the events that happened after a mark, in their order."""
        new = [event for event in self._events.values() if self._is_new(event, mark)]
        first = new[0].sequence if new else 0
        return sorted(new, key=lambda event: (event.sequence - first + KEPT) % _NUMBERS)

    def missing(self, mark: Mark) -> tuple[int, int] | None:
        """Return the first and the last number since a mark that was not heard, or None."""
        if self._latest is None:
            return None
        count = MOST_ASKED
        if mark.starts == self._starts and mark.sequence is not None:
            new = (self._latest - mark.sequence) % _NUMBERS
            count = min(MOST_ASKED, new if new < _NUMBERS // 2 else 0)
        numbers = ((self._latest - back) % _NUMBERS for back in reversed(range(count)))
        lost = [number for number in numbers if number not in self._events and number not in self._gone]
        return (lost[0], lost[-1]) if lost else None

    def _take(self, event: Event) -> None:
        self._events[event.sequence] = event
        while len(self._events) > KEPT:
            self._events.pop(next(iter(self._events)))
        self._reached(event.sequence)

    def _lose(self, sequence: int, oldest: int) -> None:
        """Take note of numbers that the vehicle has no more: from the one it was asked for to before its oldest."""
        count = (oldest - sequence) % _NUMBERS
        self._gone.update((sequence + step) % _NUMBERS for step in range(max(1, min(count, MOST_ASKED))))

    def _reached(self, sequence: int) -> None:
        if self._latest is None or comes_after(sequence, self._latest):
            self._latest = sequence

    def _is_new(self, event: Event, mark: Mark) -> bool:
        if mark.starts != self._starts:
            return True
        by_number = mark.sequence is None or comes_after(event.sequence, mark.sequence)
        return by_number and event.time_boot_s >= mark.uptime_s - CLOCK_ROUNDING_S


def _event(message: Message) -> Event:
    return Event(
        id=int(message.id),
        sequence=int(message.sequence),
        time_boot_s=message.event_time_boot_ms / 1000,
        level=int(message.log_levels) & 0xF,
        arguments=bytes(message.arguments),
    )
