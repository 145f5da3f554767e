"""What the three transfers have in common: their states, the legal transitions as one table, the timing of repeats.

Rules of the house:

- A transfer does no I/O and looks at no clock. It is given messages and the time, and gives messages back.
- Whatever arrives, in whatever order and however often, moves it along `TRANSITIONS` or not at all; a move that is
  not in the table raises `IllegalMoveError` and changes nothing.
- Every transfer has a deadline; at it, it ends.
- It listens only to its own vehicle (system and component), speaking to us (or to all), of its own mission type.

Upload, download and clear are in the modules of their names.
"""

from abc import ABC, abstractmethod
from enum import Enum

from mavplan.link.outbox import NotedOutbox, Progress
from mavplan.link.protocol import Address, Message, is_for, sender


class State(Enum):
    """Where a transfer stands."""

    ASKING = "asking"
    """The opening message (count, list, clear all) is sent again and again until it is answered."""
    MOVING = "moving"
    """The vehicle has answered; items are on their way."""
    PAUSED = "paused"
    """The vehicle put us off; the transfer opens anew when the pause is over."""
    ENDED = "ended"
    """There is an outcome."""


class Move(Enum):
    """What takes a transfer from one state to another."""

    ANSWERED = "answered"
    """The vehicle takes part: it asks for an item, or says how many it has."""
    PUT_OFF = "put off"
    """It is busy, lost the thread or has restarted."""
    SILENT = "silent"
    """Nothing was heard for longer than the vehicle remembers a transfer."""
    RESUMED = "resumed"
    """The pause is over."""
    FINISHED = "finished"
    """All that there is to send or to fetch has been, and the vehicle said so, or says nothing more."""
    REFUSED = "refused"
    """The vehicle will not have it, and trying again would not help."""
    EXPIRED = "expired"
    """The deadline has come."""
    RESTARTED = "restarted"
    """Whoever holds the transfer wants it done again."""


TRANSITIONS: dict[tuple[State, Move], State] = {
    (State.ASKING, Move.ANSWERED): State.MOVING,
    (State.ASKING, Move.PUT_OFF): State.PAUSED,
    (State.ASKING, Move.FINISHED): State.ENDED,
    (State.ASKING, Move.REFUSED): State.ENDED,
    (State.ASKING, Move.EXPIRED): State.ENDED,
    (State.MOVING, Move.ANSWERED): State.MOVING,
    (State.MOVING, Move.PUT_OFF): State.PAUSED,
    (State.MOVING, Move.SILENT): State.ASKING,
    (State.MOVING, Move.FINISHED): State.ENDED,
    (State.MOVING, Move.REFUSED): State.ENDED,
    (State.MOVING, Move.EXPIRED): State.ENDED,
    (State.PAUSED, Move.ANSWERED): State.MOVING,
    (State.PAUSED, Move.PUT_OFF): State.PAUSED,
    (State.PAUSED, Move.RESUMED): State.ASKING,
    (State.PAUSED, Move.FINISHED): State.ENDED,
    (State.PAUSED, Move.REFUSED): State.ENDED,
    (State.PAUSED, Move.EXPIRED): State.ENDED,
    # A count of ours that was late on its way opens the upload anew on the vehicle: serve it.
    (State.ENDED, Move.ANSWERED): State.MOVING,
    (State.ENDED, Move.RESTARTED): State.ASKING,
}


class IllegalMoveError(Exception):
    """A move that `TRANSITIONS` does not hold: a fault of ours."""


class Pace:
    """How long to wait before a repeat: 0.25 s, or more where the link's own round trip is longer.

    Only round trips that are beyond doubt count: of something that was sent once, or of a time stamp that came back.
    Their mean follows slowly. It is not widened by their deviation, as TCP would: a repeat too many costs less here
    than waiting on a bad radio.
    """

    LEAST_S = 0.25
    MOST_S = 3.0
    FIRST_S = 0.5

    def __init__(self) -> None:
        self._mean_s: float | None = None

    def saw(self, round_trip_s: float) -> None:
        """Take note of a round trip."""
        if self._mean_s is None:
            self._mean_s = round_trip_s
        else:
            self._mean_s += (round_trip_s - self._mean_s) / 8

    @property
    def repeat_s(self) -> float:
        """Silence after which a message is taken for lost."""
        if self._mean_s is None:
            return self.FIRST_S
        return min(self.MOST_S, max(self.LEAST_S, 1.25 * self._mean_s + 0.05))


class Transfer(NotedOutbox, ABC):
    """One transfer of one mission type between us and one vehicle.

    Parameters
    ----------
    vehicle, us
        The two addresses.
    mission_type
        MAV_MISSION_TYPE.
    deadline
        When it ends at the latest, on the caller's clock, in seconds.
    ask_again_s
        Silence after which the opening message is sent again, if the link is not slower.
    pace
        What is known of the link's round trip from an earlier transfer.
    """

    def __init__(
        self,
        vehicle: Address,
        us: Address,
        mission_type: int,
        *,
        now: float,
        deadline: float,
        ask_again_s: float,
        pace: Pace | None = None,
    ) -> None:
        self.vehicle = vehicle
        self.us = us
        self.mission_type = int(mission_type)
        self.deadline = deadline
        self.state = State.ASKING
        self.pace = Pace() if pace is None else pace
        self._ask_again_s = ask_again_s
        self._ask_at = now
        self._resume_at = deadline
        super().__init__()

    # -- the outside ------------------------------------------------------------------------------------------

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link, whoever it is from."""
        if self._concerns_us(message):
            self._on_message(message, now)

    def tick(self, now: float) -> None:
        """Let time pass: repeats, pauses and the deadline."""
        if self.state is State.ENDED:
            return
        if now >= self.deadline:
            self._expire(now)
            return
        if self.state is State.PAUSED and now >= self._resume_at:
            self._move(Move.RESUMED)
            self._begin(now)
        if self.state is State.ASKING and now >= self._ask_at:
            self._ask_at = now + max(self._ask_again_s, self.pace.repeat_s)
            self._ask(now)
        if self.state is State.MOVING:
            self._on_moving(now)

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters; None when there is none."""
        match self.state:
            case State.ASKING:
                due = self._ask_at
            case State.PAUSED:
                due = self._resume_at
            case State.MOVING:
                due = self._moving_timer()
            case State.ENDED:
                return None
        return min(due, self.deadline)

    # -- for the three kinds ----------------------------------------------------------------------------------

    @abstractmethod
    def _ask(self, now: float) -> None:
        """Send the opening message."""

    @abstractmethod
    def _begin(self, now: float) -> None:
        """Forget the last attempt; the opening message follows."""

    @abstractmethod
    def _on_message(self, message: Message, now: float) -> None:
        """Take a message of our vehicle, for us, of our mission type."""

    @abstractmethod
    def _on_moving(self, now: float) -> None:
        """Repeat what got lost."""

    @abstractmethod
    def _moving_timer(self) -> float:
        """Time of the next repeat."""

    @abstractmethod
    def _expire(self, now: float) -> None:
        """End at the deadline."""

    def _move(self, move: Move) -> None:
        target = TRANSITIONS.get((self.state, move))
        if target is None:
            raise IllegalMoveError(f"a transfer that is {self.state.value} cannot be {move.value}")
        self.state = target

    def _pause(self, now: float, seconds: float) -> None:
        self._move(Move.PUT_OFF)
        self._resume_at = now + seconds

    def _send(self, message: Message) -> None:
        self._outbox.append(message)

    def _note(self, progress: Progress) -> None:
        self._notes.append(progress)

    def _concerns_us(self, message: Message) -> bool:
        if not message.get_type().startswith("MISSION_") or sender(message) != self.vehicle:
            return False
        if not hasattr(message, "mission_type"):  # MISSION_CURRENT and its like are telemetry
            return False
        return message.mission_type == self.mission_type and is_for(message, self.us)
