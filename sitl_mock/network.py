"""A bad radio and a failing vehicle, without I/O: the same calls as an `Autopilot`, with faults in between.

Everything that goes in or out is cut into frames; each frame is lost, doubled, held back or spoilt by a seeded
generator, and delivered at its time. The same code runs in a process and on a test's virtual clock.
"""

import heapq
import math
import random
from collections.abc import Hashable
from typing import Any, Literal

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import Faults, Moment
from sitl_mock.items import StoredItem
from sitl_mock.second_station import SecondStation
from sitl_mock.wire import Encoder, Parser, Splitter, message_id

OVERTAKEN_S = (0.02, 0.3)
"""How long a frame is held back that later ones shall overtake."""
DUPLICATE_S = 0.01
MAX_IDLE_STEPS = 3
"""How often in a row a moment may ask for another step without anything on its way: a guard against standing still."""
MOVED_E7 = 90
"""A metre, in 1e-7 degrees of latitude."""

COUNT, ACK, HEARTBEAT = mavlink.MAVLINK_MSG_ID_MISSION_COUNT, mavlink.MAVLINK_MSG_ID_MISSION_ACK, 0
ITEMS = frozenset({mavlink.MAVLINK_MSG_ID_MISSION_ITEM, mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT})
MISSION_FRAMES = frozenset(range(37, 48)) | {51, 73}


class Line:
    """One direction of a radio link: a frame goes in, frames with their times of arrival come out.

    Parameters
    ----------
    faults
        Its network faults are used.
    drop
        Probability of loss in this direction.
    chance
        Shared by all lines of a run.
    """

    def __init__(self, faults: Faults, drop: float, chance: random.Random) -> None:
        self._faults = faults
        self._drop = drop
        self._chance = chance
        self._last_s = -math.inf
        self._seen: set[bytes] = set()

    def carry(self, frame: bytes, now: float) -> list[tuple[float, bytes]]:
        """Return ``(deliver_at, frame)`` for every copy that arrives."""
        faults, chance = self._faults, self._chance
        if faults.first_lost and message_id(frame) in MISSION_FRAMES:
            content = frame[7:-2]
            if content not in self._seen:
                self._seen.add(content)
                return []
        arrivals: list[tuple[float, bytes]] = []
        copies = 1 + (chance.random() < faults.dup if faults.dup else 0)
        for copy in range(copies):
            if self._drop and chance.random() < self._drop:
                continue
            at = now + faults.delay_s + copy * DUPLICATE_S
            if faults.jitter_s:
                at += chance.uniform(0.0, faults.jitter_s)
            if faults.reorder and chance.random() < faults.reorder:
                at += chance.uniform(*OVERTAKEN_S)
            elif copy == 0:
                at = self._last_s = max(at, self._last_s)
            spoilt = faults.corrupt and chance.random() < faults.corrupt
            arrivals.append((at, self._spoil(frame) if spoilt else frame))
        return arrivals

    def _spoil(self, frame: bytes) -> bytes:
        at = self._chance.randrange(len(frame))
        return frame[:at] + bytes([frame[at] ^ self._chance.randrange(1, 256)]) + frame[at + 1 :]


class FaultyNetwork:
    """An autopilot behind a bad radio: call it as you would call the `Autopilot`.

    Parameters
    ----------
    autopilot
        The vehicle.
    faults
        What goes wrong.
    seed
        The same seed and the same calls give the same faults.
    """

    def __init__(self, autopilot: Autopilot, faults: Faults, seed: int = 0) -> None:
        self.autopilot = autopilot
        self.faults = faults
        chance = random.Random(seed)
        self._up = Line(faults, faults.drop_up, chance)
        self._down = Line(faults, faults.drop_down, chance)
        self._splitters: dict[Hashable, Splitter] = {}
        self._way: list[tuple[float, int, Literal["up", "down"], Hashable, bytes]] = []
        self._order = 0
        self._outbox: list[tuple[Hashable | None, bytes]] = []
        self._started: float | None = None
        self._clock = -math.inf
        self._items_passed = 0
        self._silent = False
        self._rebooted = False
        self._acks_to_lose = faults.ack_lost
        self._forger = Encoder(autopilot.system_id, autopilot.component_id, autopilot.signing)
        self._station = (
            SecondStation("upload" if faults.second_gcs == "upload" else "read", autopilot.system_id)
            if faults.second_gcs
            else None
        )

    @property
    def killed_by(self) -> str | None:
        """What ended the simulator, None while it lives."""
        return self.autopilot.killed_by

    def receive(self, data: bytes, sender: Hashable, now: float) -> None:
        """Take bytes that a ground station sends."""
        self.tick(now)
        for frame in self._splitters.setdefault(sender, Splitter()).feed(data):
            for at, copy in self._up.carry(frame, now):
                self._push(at, "up", sender, copy)
        self.tick(now)

    def tick(self, now: float) -> None:
        """Deliver and do whatever is due by now, in the order of its time."""
        if self._started is None:
            self._started = self._clock = now
            self._step(now)
        idle = 0
        while (due := self._next_due()) <= now and idle < MAX_IDLE_STEPS:
            at = max(due, self._clock)
            idle = 0 if at > self._clock or self._arrived(at) else idle + 1
            self._clock = at
            self._step(at)

    def _arrived(self, now: float) -> bool:
        return bool(self._way) and self._way[0][0] <= now

    def to_send(self) -> list[tuple[Hashable | None, bytes]]:
        """Return the frames that arrive at ground stations by now, and at whose; None means every one."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def next_timer(self) -> float | None:
        """Return when `tick` must be called at the latest."""
        due = self._next_due()
        return None if due == math.inf else due

    def stored(self, mission_type: int = 0) -> tuple[StoredItem, ...]:
        """Return what the vehicle really holds."""
        return self.autopilot.stored(mission_type)

    def forget(self, link: Hashable) -> None:
        """Drop a link that is gone."""
        self._splitters.pop(link, None)
        self.autopilot.forget(link)

    def _next_due(self) -> float:
        times = [self._way[0][0]] if self._way else []
        timer = self.autopilot.next_timer()
        if timer is not None and not self._silent:
            times.append(timer)
        if self._station is not None:
            times.append(self._station.next_timer())
        for moment in (self.faults.silent_after, self.faults.reboot_at):
            at = self._moment_s(moment)
            if at is not None:
                times.append(at)
        return min(times, default=math.inf)

    def _moment_s(self, moment: Moment | None) -> float | None:
        """Return when a moment given by time is still to come."""
        if moment is None or moment.time_s is None or self._started is None:
            return None
        done = self._silent if moment is self.faults.silent_after else self._rebooted
        return None if done else self._started + moment.time_s

    def _step(self, now: float) -> None:
        self._strike(now)
        while self._way and self._way[0][0] <= now:
            at, _, direction, link, frame = heapq.heappop(self._way)
            if direction == "down":
                self._outbox.append((link, frame))
            else:
                self._deliver(frame, link, max(at, now))
        if self._station is not None:
            self._station.tick(now)
            for frame in self._station.to_send():
                for at, copy in self._up.carry(frame, now):
                    self._push(at, "up", self._station, copy)
        if not self._silent:
            self.autopilot.tick(now)
            self._collect(now)

    def _strike(self, now: float) -> None:
        silent_at, reboot_at = self._moment_s(self.faults.silent_after), self._moment_s(self.faults.reboot_at)
        if silent_at is not None and now >= silent_at:
            self._silent = True
        if reboot_at is not None and now >= reboot_at:
            self._reboot(now)

    def _reboot(self, now: float) -> None:
        self._rebooted = True
        self.autopilot.reboot(now)

    def _push(self, at: float, direction: Literal["up", "down"], link: Hashable, frame: bytes) -> None:
        self._order += 1
        heapq.heappush(self._way, (at, self._order, direction, link, frame))

    def _deliver(self, frame: bytes, link: Hashable, now: float) -> None:
        """Hand a frame to the vehicle, unless the vehicle's own failure is next."""
        if self._silent:
            return
        kind = message_id(frame)
        foreign = link is self._station
        if kind == COUNT and not foreign and self.faults.nack is not None:
            self._answer_count(frame, link, self.faults.nack, now)
            return
        if kind in ITEMS and self._count_item(now):
            return
        if kind in ITEMS and self.faults.alter is not None:
            frame = self._altered(frame)
        self.autopilot.receive(frame, link, now)
        if kind == COUNT and not foreign and self.faults.early_ack:
            self._answer_count(frame, link, 0, now)
        self._collect(now)

    def _count_item(self, now: float) -> bool:
        """Count a mission item that passes, and say whether it is lost to a failure that it sets off."""
        self._items_passed += 1
        silent_after, reboot_at = self.faults.silent_after, self.faults.reboot_at
        if silent_after is not None and silent_after.item is not None:
            self._silent = self._silent or self._items_passed > silent_after.item
        if (
            reboot_at is None
            or reboot_at.item is None
            or self._rebooted
            or self._items_passed < reboot_at.item
        ):
            return self._silent
        self._reboot(now)
        return True

    def _answer_count(self, frame: bytes, link: Hashable, result: int, now: float) -> None:
        for message in Parser().feed(frame):
            ack = mavlink.MAVLink_mission_ack_message(
                message.get_srcSystem(), message.get_srcComponent(), result, message.mission_type
            )
            self._leave(link, self._forger.encode(ack), now)

    def _altered(self, frame: bytes) -> bytes:
        for message in Parser().feed(frame):
            if message.get_type() == "MISSION_ITEM_INT" and message.seq == self.faults.alter:
                changed = mavlink.MAVLink_mission_item_int_message(
                    *(
                        getattr(message, field) + (MOVED_E7 if field == "x" else 0)
                        for field in message.get_fieldnames()
                    )
                )
                station = (message.get_srcSystem(), message.get_srcComponent())
                return Encoder(*station, self.autopilot.signing).encode(changed)
        return frame

    def _collect(self, now: float) -> None:
        for link, frame in self.autopilot.to_send():
            self._leave(link, frame, now)

    def _leave(self, link: Hashable | None, frame: bytes, now: float) -> None:
        kind = message_id(frame)
        if self._silent or (kind == HEARTBEAT and self.faults.no_heartbeat):
            return
        if kind in ITEMS and self._count_item(now):
            return
        if self._station is not None:
            self._station.receive(frame, now)
            link = None if link is self._station else link
        if kind == ACK and self._acks_to_lose and _is_success(frame):
            self._acks_to_lose -= 1
            return
        for at, copy in self._down.carry(frame, now):
            self._push(at, "down", link, copy)


def _is_success(frame: bytes) -> bool:
    messages: list[Any] = Parser().feed(frame)
    return any(message.type == 0 for message in messages)
