"""What leaves the vehicle: replies, texts, events, telemetry and heartbeats as frames, and to which link each goes."""

import math
from collections.abc import Hashable, Iterable

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.events import EventBuffer
from sitl_mock.firmware import Firmware
from sitl_mock.mission_wire import message_of
from sitl_mock.missions import Event, Partner, Reached, Reply, Text
from sitl_mock.telemetry import Schedule
from sitl_mock.wire import Encoder, Message

GROUND_STATION_MEMORY_S = 2.5
"""How long a ground station's heartbeat counts for, by the station's clock."""
REACHED_AGAIN_S = 1.0
TEXT_CHUNK = 50
"""Bytes of a STATUSTEXT; what is longer goes on in the next, of the same id."""


class Voice:
    """The vehicle's outbox.

    Parameters
    ----------
    firmware
        Who hears texts and events, and how often an item reached is told.
    encoder
        Makes the frames.
    schedule
        Knows the links.
    speed
        How many times as fast as the ground stations' the vehicle's time goes.
    """

    def __init__(self, firmware: Firmware, encoder: Encoder, schedule: Schedule, speed: float = 1.0) -> None:
        self._firmware = firmware
        self._memory_s = GROUND_STATION_MEMORY_S * speed
        self._encoder = encoder
        self._schedule = schedule
        self.events = EventBuffer()
        self._outbox: list[tuple[Hashable | None, bytes]] = []
        self._heard: dict[Hashable, float] = {}
        self._text_id = 0
        self._repeats: list[float] = []
        self._repeated = Reached(0)
        self.due = math.inf
        """When `repeat` has something to do."""

    def take(self) -> list[tuple[Hashable | None, bytes]]:
        """Return the frames to send and to whom, in order; None means every peer there is."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def say(self, link: Hashable | None, message: Message, extension: bytes = b"") -> None:
        """Send a message to one link, or (None) to every peer."""
        self._outbox.append((link, self._encoder.encode(message, extension)))

    def say_to_all(self, message: Message) -> None:
        """Send one frame to every link that has spoken."""
        frame = self._encoder.encode(message)
        self._outbox += [(link, frame) for link in self._schedule.links()]

    def acknowledge(self, to: Partner, command: int, result: int) -> None:
        """Send COMMAND_ACK."""
        self.say(to.link, mavlink.MAVLink_command_ack_message(command, result, 0, 0, to.system, to.component))

    def hear_station(self, link: Hashable, now: float) -> bool:
        """Remember a ground station's heartbeat; return whether it was not heard of late."""
        greets = now >= self._heard.get(link, -math.inf) + self._memory_s
        self._heard[link] = now
        return greets

    def reply(self, replies: Iterable[Reply], now: float, uptime_s: float) -> None:
        """Send what the mission lists and the pilot have to say."""
        for reply in replies:
            match reply:
                case Text():
                    self._text(reply, now)
                case Event():
                    if self._firmware.sends_events:
                        event = self.events.add(reply.name, reply.levels, reply.arguments, uptime_s)
                        for link in self._schedule.links():
                            self.say(link, event)
                case Reached():
                    self.say_to_all(message_of(reply)[0])
                    times = range(1, self._firmware.reached_repeats + 1)
                    self._repeats, self._repeated = [now + REACHED_AGAIN_S * n for n in times], reply
                    self.due = min(self._repeats, default=math.inf)
                case _:
                    self.say(reply.to.link, *message_of(reply))

    def _text(self, text: Text, now: float) -> None:
        said = text.text.encode()
        chunks = [said[at : at + TEXT_CHUNK] for at in range(0, max(len(said), 1), TEXT_CHUNK)]
        number = 0
        if self._firmware.statustext_needs_heartbeat or len(chunks) > 1:
            self._text_id = number = self._text_id % 65535 + 1
        frames = [
            self._encoder.encode(mavlink.MAVLink_statustext_message(text.severity, chunk, number, at))
            for at, chunk in enumerate(chunks)
        ]
        for link in self._schedule.links() if text.link is None else [text.link]:
            heard = self._heard.get(link, -math.inf)
            if not self._firmware.statustext_needs_heartbeat or now < heard + self._memory_s:
                self._outbox += [(link, frame) for frame in frames]

    def repeat(self, now: float) -> None:
        """Tell the item reached last once more, if it is time."""
        if now >= self.due:
            self._repeats = [at for at in self._repeats if at > now]
            self.due = min(self._repeats, default=math.inf)
            self.say_to_all(message_of(self._repeated)[0])

    def forget(self, link: Hashable) -> None:
        """Drop a link that is gone."""
        self._heard.pop(link, None)

    def fall_silent(self) -> None:
        """Send nothing of what is waiting."""
        self._outbox.clear()

    def reboot(self) -> None:
        """Lose what a power cycle loses."""
        self.events = EventBuffer()
        self._outbox.clear()
        self._heard.clear()
        self._repeats.clear()
        self.due = math.inf
