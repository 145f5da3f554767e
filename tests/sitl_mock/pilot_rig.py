"""A mock that flies on a virtual clock, and missions in metres around its home."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from sitl_mock.flight.earth import Tangent
from sitl_mock.flight.pilot import Setting

from .rig import LAT_E7, LON_E7, NAN, Rig, command, count, heartbeat, item

WAYPOINT, UNLIM, LOITER, RTL, LAND, TAKEOFF, DELAY, JUMP, SPEED = 16, 17, 19, 20, 21, 22, 93, 177, 178
PLANE = Tangent(LAT_E7, LON_E7)
Row = tuple[int, float, float, float, float]
"""Command, north, east and height in metres, param1; the speed of DO_CHANGE_SPEED in the height's place."""


def takeoff(height: float = 30.0) -> Row:
    return (TAKEOFF, 0.0, 0.0, height, 0.0)


def stop(north: float, east: float, hold: float = 8.0, height: float = 30.0) -> Row:
    return (LOITER, north, east, height, hold)


def waypoint(north: float, east: float, hold: float = 0.0, height: float = 30.0) -> Row:
    return (WAYPOINT, north, east, height, hold)


def speed(metres_per_second: float) -> Row:
    return (SPEED, 0.0, 0.0, metres_per_second, 1.0)


RETURN: Row = (RTL, 0.0, 0.0, 0.0, 0.0)


class PilotRig(Rig):
    """A vehicle with a mission, and what happens to it."""

    def __init__(self, firmware: str, **options: Any) -> None:
        setting = Setting(
            **{key: options.pop(key) for key in list(options) if key in Setting.__dataclass_fields__}
        )
        super().__init__(firmware, setting=setting, **options)
        self.send(heartbeat())
        self.send(*(command(511, number, 200_000) for number in (33, 42)))
        self.pilot: Any = self.vehicle.pilot  # type: ignore[union-attr]

    @property
    def state(self) -> Any:
        return self.vehicle.vehicle  # type: ignore[union-attr]

    def load(self, *rows: Row, current: bool = True) -> None:
        """Upload a mission, with home before it where the firmware wants it."""
        ardupilot = self.firmware == "ardupilot"
        messages = [item(0, WAYPOINT, 0, z=10.0)] if ardupilot else []
        for number, north, east, height, p1 in rows:
            seq = len(messages)
            if number in {RTL, SPEED, DELAY, JUMP}:
                second = height if number in {SPEED, JUMP} else 0.0
                messages.append(item(seq, number, 2, p1=p1, p2=second, x=0, y=0, z=0.0))
            else:
                x, y = PLANE.degrees_e7(north, east)
                heading = 0.0 if ardupilot else NAN
                messages.append(item(seq, number, 3, p1=p1, p4=heading, x=x, y=y, z=height))
        for message in messages:
            message.current = int(message.seq == 0 and current)
        assert self.upload(messages).type == 0
        if not ardupilot:
            self.run(0.5)

    def clear_by_count(self) -> None:
        self.send(count(0))

    def start(self) -> None:
        """Arm and start, as each firmware wants it."""
        if self.firmware == "ardupilot":
            for order in (command(176, 1, 4), command(400, 1), command(300)):
                assert [a.result for a in self.send(order) if a.get_type() == "COMMAND_ACK"] == [0]
        else:
            assert [a.result for a in self.send(command(300)) if a.get_type() == "COMMAND_ACK"] == [0]

    def fly(self, seconds: float = 1200.0) -> None:
        """Let it fly until it is disarmed, at most so long."""
        until = self.now + seconds
        while self.state.armed and self.now < until:
            self.run(min(0.5, until - self.now))
            self.send(heartbeat())  # PX4's texts depend on it

    def until(self, happens: Callable[[], bool], step: float = 0.1, seconds: float = 600.0) -> None:
        """Let it fly until something happens, which it must within a time."""
        latest = self.now + seconds
        while not happens():
            assert self.now < latest, f"nothing happened within {seconds:g} s; reached {self.reached()}"
            self.run(step)
            self.send(heartbeat())

    def of(self, name: str) -> list[tuple[float, Any]]:
        """All messages of a kind with their times."""
        return [(at, message) for at, _, message in self.heard if message.get_type() == name]

    def reached(self) -> dict[int, float]:
        """When each item was first reported, in order."""
        first: dict[int, float] = {}
        for at, message in self.of("MISSION_ITEM_REACHED"):
            first.setdefault(message.seq, at)
        return first

    def texts(self) -> list[str]:
        return [message.text.strip() for _, message in self.of("STATUSTEXT")]

    def place(self) -> tuple[float, float, float]:
        """Metres north, east and above the ground, without drift."""
        north, east, up = self.pilot.body.at(self.now)[0]
        return north, east, up

    def off(self, north: float, east: float) -> float:
        here = self.place()
        return math.hypot(here[0] - north, here[1] - east)


def results(answers: Sequence[Any]) -> list[int]:
    return [answer.result for answer in answers if answer.get_type() == "COMMAND_ACK"]
