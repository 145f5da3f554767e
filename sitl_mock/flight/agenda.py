"""What a pilot does and when: steps in a row, and single things at their times.

A step is called with the time it begins and returns the time it ends; the last one may give a new row. So a flight goes
from event to event and nothing happens between them.
"""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable

Step = Callable[[float], float]

FAR_S = math.inf
WATCH_S = 0.5
"""How often the watch looks."""


class Agenda(ABC):
    """Steps, timers and a watch."""

    def __init__(self) -> None:
        self._steps: deque[Step] = deque()
        self._next_at = FAR_S
        self._watch_at = FAR_S
        self._timers: list[tuple[float, Callable[[float], None]]] = []
        self._turn = 0
        self.due = FAR_S
        """When the next thing happens."""

    def _plan(self) -> None:
        self.due = min(self._next_at if self._steps else FAR_S, self._watch_at)
        for at, _ in self._timers:
            self.due = min(self.due, at)

    def tick(self, now: float) -> None:
        """Do whatever is due by now, each at its own time."""
        while (due := self.due) <= now:
            ready = next((timer for timer in self._timers if timer[0] == due), None)
            if ready is not None:
                self._timers.remove(ready)
                ready[1](due)
            elif self._watch_at == due:
                self._watch_at = due + WATCH_S
                self.look(due)
            else:
                self._step(due)
            self._plan()

    def _step(self, at: float) -> None:
        turn, step = self._turn, self._steps.popleft()
        end = step(at)
        if self._turn == turn:
            self._next_at = end

    def do(self, at: float, *steps: Step) -> None:
        """Drop what it was doing and do this from now on."""
        self._turn += 1
        self._steps, self._next_at = deque(steps), at
        self._plan()

    def next_step(self, step: Step) -> None:
        """Put a step before all others."""
        self._steps.appendleft(step)

    def later(self, at: float, what: Callable[[float], None]) -> None:
        """Do something at a time, whatever the steps are."""
        self._timers.append((at, what))
        self._plan()

    @staticmethod
    def wait(seconds: float) -> Step:
        """Return a step that lets time pass."""
        return lambda at: at + seconds

    def still_at_it(self) -> Callable[[], bool]:
        """Return a question: whether it is still doing what it is doing now."""
        turn = self._turn
        return lambda: self._turn == turn

    # The watch

    def set_watch(self, at: float) -> None:
        """Begin to look at a time and again and again."""
        self._watch_at = at + WATCH_S
        self._plan()

    def end_watch(self) -> None:
        """Look no more."""
        self._watch_at = FAR_S
        self._plan()

    @abstractmethod
    def look(self, at: float) -> None:
        """Do what the watch does."""
