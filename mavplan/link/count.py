"""How many items a vehicle holds of one list, without fetching them: our list request, its count, our ACK. No I/O."""

from mavplan.link.protocol import Message, Result, mission_ack, mission_request_list, opaque_id
from mavplan.link.transfer import Move, State, Transfer

LIST_AGAIN_S = 0.5
BUSY_S = 1.0


class Count(Transfer):
    """Ask a vehicle how long one of its lists is. Parameters as of `Transfer`."""

    count: int | None = None
    """Items, home included on ArduPilot; None until it is told, or when time was over."""
    opaque_id: int | None = None
    """The vehicle's checksum of the list, where it has one."""
    _asked = False

    @property
    def done(self) -> bool:
        """Whether it is over."""
        return self.state is State.ENDED

    def _ask(self, now: float) -> None:
        self._asked = True
        self._send(mission_request_list(self.vehicle, self.mission_type))

    def _begin(self, now: float) -> None:
        self._ask_at = now

    def _on_message(self, message: Message, now: float) -> None:
        if self.done or not self._asked:
            return
        if message.get_type() == "MISSION_COUNT":
            self.count = int(message.count)
            self.opaque_id = opaque_id(message)
            # A vehicle that has listed waits for requests, and PX4 takes nothing else until it hears this.
            self._send(mission_ack(self.vehicle, Result.ACCEPTED, self.mission_type))
            self._move(Move.FINISHED)
        elif (
            message.get_type() == "MISSION_ACK"
            and self.state is State.ASKING
            and message.type != Result.ACCEPTED  # which answers an earlier transfer
        ):
            self._pause(now, BUSY_S)

    def _on_moving(self, now: float) -> None:
        raise AssertionError("a count moves no items")

    def _moving_timer(self) -> float:
        raise AssertionError("a count moves no items")

    def _expire(self, now: float) -> None:
        self._move(Move.EXPIRED)
