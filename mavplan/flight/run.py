"""The one place where a flight meets a clock, a connection and a recording: `fly`."""

import time
from collections.abc import Callable
from typing import Protocol

from mavplan.flight.conductor import FlySession
from mavplan.link.codec import Codec
from mavplan.link.connection import Connection
from mavplan.link.protocol import Message, sender

MAX_SLEEP_S = 0.2
"""How late at most whoever watches gets to see something, or to say something."""

Recorder = Callable[[int, bytes], None]
"""Takes microseconds since 1970 and a frame that was sent or received."""


class Hands(Protocol):
    """Whoever watches and decides; called several times a second."""

    def see(self, session: FlySession, now: float) -> None:
        """Show what there is, and do what the user wants: approve, order, leave."""


def fly(
    session: FlySession,
    connection: Connection,
    hands: Hands,
    record: Recorder | None = None,
) -> None:
    """Run a flight over a connection until it is done.

    Parameters
    ----------
    session
        What to do; made with the time of `time.monotonic`.
    connection
        Over what.
    hands
        Whom to show it, and who decides. It must not wait for anybody: the link goes on meanwhile.
    record
        Gets every frame, of both directions.
    """
    codec = Codec(session.us, connection.signing)
    while not session.done:
        now = time.monotonic()
        session.tick(now)
        _send(session, connection, codec, record)
        hands.see(session, now)
        timer = session.next_timer()
        wait_s = MAX_SLEEP_S if timer is None else min(MAX_SLEEP_S, max(0.0, timer - time.monotonic()))
        data = connection.read(wait_s)
        now = time.monotonic()
        for message in codec.decode(data, now):
            if record is not None:
                record(time.time_ns() // 1000, _frame(message))
            if session.vehicle is not None and sender(message) == session.vehicle.address:
                connection.hold_peer()
            session.receive(message, now)
    _send(session, connection, codec, record)
    hands.see(session, time.monotonic())


def _send(session: FlySession, connection: Connection, codec: Codec, record: Recorder | None) -> None:
    for message in session.to_send():
        frame = codec.encode(message)
        connection.write(frame)
        if record is not None:
            record(time.time_ns() // 1000, frame)


def _frame(message: Message) -> bytes:
    """Return the frame as it came."""
    return bytes(message.get_msgbuf())
