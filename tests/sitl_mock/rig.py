"""A mock vehicle on a virtual clock and hand-made messages of ground stations around it."""

from collections.abc import Hashable, Sequence
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES
from sitl_mock.items import StoredItem
from sitl_mock.network import FaultyNetwork
from sitl_mock.wire import Encoder, Parser

HOME = (37.4, -122.1, 10.0)
LAT_E7, LON_E7 = 374_000_000, -1_221_000_000
NAN = float("nan")
TELEMETRY = {
    "HEARTBEAT",
    "SYS_STATUS",
    "EXTENDED_SYS_STATE",
    "GLOBAL_POSITION_INT",
    "HOME_POSITION",
    "BATTERY_STATUS",
    "MISSION_CURRENT",
    "TIMESYNC",
    "CURRENT_EVENT_SEQUENCE",
}


def item(seq: int, command: int = 16, frame: int = 3, **fields: float) -> Any:
    """A MISSION_ITEM_INT to system 1, component 1."""
    given = {"p1": 0.0, "p2": 0.0, "p3": 0.0, "p4": 0.0, "x": LAT_E7, "y": LON_E7, "z": 30.0} | fields
    return mavlink.MAVLink_mission_item_int_message(
        1,
        int(given.get("component", 1)),
        seq,
        frame,
        command,
        int(given.get("current", 0)),
        int(given.get("autocontinue", 1)),
        given["p1"],
        given["p2"],
        given["p3"],
        given["p4"],
        int(given["x"]),
        int(given["y"]),
        given["z"],
        int(given.get("kind", 0)),
    )


def count(n: int, kind: int = 0, system: int = 1, component: int = 1) -> Any:
    return mavlink.MAVLink_mission_count_message(system, component, n, kind)


def request(seq: int, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind)


def request_list(kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_request_list_message(1, 1, kind)


def ack(result: int = 0, kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_ack_message(1, 1, result, kind)


def clear(kind: int = 0) -> Any:
    return mavlink.MAVLink_mission_clear_all_message(1, 1, kind)


def heartbeat() -> Any:
    return mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def command(number: int, p1: float = 0.0, p2: float = 0.0) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, p1, p2, 0, 0, 0, 0, 0)


def good_mission(firmware: str, stops: int = 2) -> list[Any]:
    """Home where the firmware wants it, take-off, stops, return: a mission both firmwares take and PX4 flies."""
    frames = {"ardupilot": 0, "px4": 2}
    bare = {"x": 0, "y": 0, "z": 0.0}
    first = [item(0, 16, 0, z=10.0)] if firmware == "ardupilot" else []
    commands = [*first, item(0, 22), *(item(0, 19, p1=8.0, x=LAT_E7 + 9000 * n) for n in range(stops))]
    commands.append(item(0, 20, frames[firmware], **bare))
    for seq, message in enumerate(commands):
        message.seq = seq
        message.current = int(seq == 0)
    return commands


class Rig:
    """A vehicle, its virtual time, and what it says."""

    def __init__(
        self,
        firmware: str,
        *,
        vehicle: Any = None,
        home: tuple[float, float, float] | None = HOME,
        **options: Any,
    ):
        self.firmware = firmware
        self.vehicle: Autopilot | FaultyNetwork = vehicle or Autopilot(
            FIRMWARES[firmware], home=home, **options
        )
        self.now = 0.0
        self.heard: list[tuple[float, Hashable, Any]] = []
        self.frames: list[bytes] = []
        self._encoders: dict[tuple[int, int], Encoder] = {}
        self._parsers: dict[Hashable, Parser] = {}
        self.vehicle.tick(0.0)
        self._collect()

    def _collect(self) -> list[Any]:
        new = []
        for link, frame in self.vehicle.to_send():
            self.frames.append(frame)
            for message in self._parsers.setdefault(link, Parser()).feed(frame):
                self.heard.append((self.now, link, message))
                new.append(message)
        return new

    def send(
        self, *messages: Any, link: Hashable = "gcs", system: int = 255, component: int = 190
    ) -> list[Any]:
        """Send messages now and return what the vehicle answers at once, without telemetry."""
        encoder = self._encoders.setdefault((system, component), Encoder(system, component))
        answers: list[Any] = []
        for message in messages:
            self.vehicle.receive(encoder.encode(message), link, self.now)
            answers += self._collect()
        return [answer for answer in answers if answer.get_type() not in TELEMETRY]

    def run(self, seconds: float, *, telemetry: bool = False) -> list[tuple[float, Any]]:
        """Let time pass and return what the vehicle says meanwhile, with the times."""
        until = self.now + seconds
        said: list[tuple[float, Any]] = []
        while (timer := self.vehicle.next_timer()) is not None and timer <= until:
            self.now = max(self.now, timer)
            self.vehicle.tick(self.now)
            said += [(self.now, message) for message in self._collect()]
        self.now = until
        self.vehicle.tick(self.now)
        said += [(self.now, message) for message in self._collect()]
        return [(at, message) for at, message in said if telemetry or message.get_type() not in TELEMETRY]

    def upload(self, messages: Sequence[Any], kind: int = 0) -> Any:
        """Upload items as a client that does everything right; return the final ACK."""
        answers = self.send(count(len(messages), kind))
        while answers and answers[0].get_type().startswith("MISSION_REQUEST"):
            answers = self.send(messages[answers[0].seq])
        return next(answer for answer in answers if answer.get_type() == "MISSION_ACK")

    def download(self, kind: int = 0) -> list[Any]:
        """Download a list and acknowledge it."""
        (counted,) = self.send(request_list(kind))
        items = [self.send(request(seq, kind))[0] for seq in range(counted.count)]
        self.send(ack(kind=kind))
        return items

    def keeps(self, message: Any) -> StoredItem | int:
        """What becomes of one item: as it reads back, or the result it is refused with."""
        kind = message.mission_type
        offset = int(self.firmware == "ardupilot" and kind == 0)
        message.seq = offset
        answer = self.upload([*([item(0)] if offset else []), message], kind)
        return self.vehicle.stored(kind)[offset] if answer.type == 0 else int(answer.type)


def kinds(answers: Sequence[Any]) -> list[str]:
    """Short names: ``ACK 13``, ``REQUEST 2``, ``COUNT 8``, ``ITEM_INT 0``, ``TEXT …``."""
    return [_short(answer) for answer in answers]


def _short(answer: Any) -> str:
    name = answer.get_type().removeprefix("MISSION_")
    if name == "ACK":
        return f"ACK {answer.type}"
    if name == "COUNT":
        return f"COUNT {answer.count}"
    if name == "STATUSTEXT":
        return f"TEXT {answer.text.rstrip()}"
    return f"{name} {answer.seq}" if hasattr(answer, "seq") else str(name)
