"""What waits to be taken: messages to send, and steps that a person may want to see."""

from dataclasses import dataclass

from mavplan.link.protocol import Message


@dataclass(frozen=True, slots=True)
class Progress:
    """A step that a person may want to see.

    Attributes
    ----------
    phase
        ``connecting``, ``uploading``, ``reading back``, ``downloading``, ``settling``.
    done, total
        Items; total 0 where it is not known yet.
    note
        Something out of the ordinary in a few words, or empty.
    """

    phase: str
    done: int = 0
    total: int = 0
    note: str = ""


class Outbox:
    """Messages that wait to be sent."""

    def __init__(self) -> None:
        self._outbox: list[Message] = []

    def to_send(self) -> list[Message]:
        """Return what is to be sent now; each message once."""
        messages, self._outbox = self._outbox, []
        return messages


class NotedOutbox(Outbox):
    """Messages that wait to be sent, and what has happened."""

    def __init__(self) -> None:
        super().__init__()
        self._notes: list[Progress] = []

    def events(self) -> list[Progress]:
        """Return what has happened since the last call."""
        notes, self._notes = self._notes, []
        return notes
