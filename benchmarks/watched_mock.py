"""The mock with a stopwatch: ``python -m benchmarks.watched_mock`` takes what ``python -m sitl_mock`` takes.

For every mission that the vehicle accepts it prints a line of JSON: the seconds from the first MISSION_COUNT's arrival
to the departure of the MISSION_ACK, and what the vehicle holds then. So a client's speed is measured by the vehicle,
and never by the client.
"""

import dataclasses
import json
import sys
import time
from collections.abc import Hashable
from typing import Any

from sitl_mock.__main__ import main
from sitl_mock.items import StoredItem
from sitl_mock.network import ACK, COUNT
from sitl_mock.wire import START_V1, Splitter, message_id

MISSION = 0
ACCEPTED = 0


@dataclasses.dataclass(frozen=True, slots=True)
class Upload:
    """One accepted upload: how long it took, and what the vehicle then held."""

    seconds: float
    stored: tuple[StoredItem, ...]

    def to_json(self) -> str:
        """Return it in one line."""
        return json.dumps([self.seconds, [dataclasses.astuple(item) for item in self.stored]])

    @classmethod
    def from_json(cls, line: str) -> "Upload":
        """Read the line."""
        seconds, stored = json.loads(line)
        return cls(seconds, tuple(StoredItem(*fields) for fields in stored))


class Watched:
    """A vehicle, called as the one inside it (an `Autopilot` or a `FaultyNetwork`), with a stopwatch at its door."""

    def __init__(self, vehicle: Any) -> None:
        self._vehicle = vehicle
        self._splitters: dict[Hashable, Splitter] = {}
        self._begun: dict[Hashable, float] = {}
        self._took: list[float] = []

    def __getattr__(self, name: str) -> Any:
        """Return whatever is not watched from the vehicle itself."""
        return getattr(self._vehicle, name)

    def receive(self, data: bytes, sender: Hashable, now: float) -> None:
        """Take bytes; the first count of a sender starts its watch."""
        arrived = time.monotonic()
        for frame in self._splitters.setdefault(sender, Splitter()).feed(data):
            if message_id(frame) == COUNT and _payload(frame)[4] == MISSION:
                self._begun.setdefault(sender, arrived)
        self._vehicle.receive(data, sender, now)

    def to_send(self) -> list[tuple[Hashable | None, bytes]]:
        """Give frames; an acknowledgement of success stops the watch."""
        leaving: list[tuple[Hashable | None, bytes]] = self._vehicle.to_send()
        for link, frame in leaving:
            if link in self._begun and message_id(frame) == ACK:
                _, _, result, mission_type = _payload(frame)[:4]
                if (result, mission_type) == (ACCEPTED, MISSION):
                    self._took.append(time.monotonic() - self._begun.pop(link))
        return leaving

    def tick(self, now: float) -> None:
        """Let time pass. What was measured is told here: by now it has been sent."""
        while self._took:
            print(Upload(self._took.pop(0), self._vehicle.stored(MISSION)).to_json(), flush=True)
        self._vehicle.tick(now)


def _payload(frame: bytes) -> bytes:
    """Return a frame's payload with the zeros that MAVLink 2 leaves out at its end."""
    return frame[6 if frame[0] == START_V1 else 10 : -2].ljust(9, b"\0")


if __name__ == "__main__":
    sys.exit(main(watch=Watched))
