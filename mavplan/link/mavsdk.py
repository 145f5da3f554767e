"""MAVSDK in the place of our own transfers: its native library between our socket and the vehicle.

MAVSDK gets the bytes of the one vehicle that was found and gives the bytes that it wants to send (its ``raw://``
connection); sockets, discovery, deadlines and everything but the transfers stay ours. So a port in use, several
vehicles on a line and a vehicle that goes away, which MAVSDK's own connections do not report, end as they do without
it. Nothing else here imports MAVSDK.
"""

import queue
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mavsdk
from mavsdk.plugins import mission_raw

from mavplan.errors import MavplanError
from mavplan.link.codec import Codec
from mavplan.link.protocol import GROUND, Address, Message, MissionType
from mavplan.mission.wire import WireItem

Result = mission_raw.MissionRawResult

_INT32 = range(-(2**31), 2**31)
_BYTE = range(2**8)
_SHORT = range(2**16)


@dataclass(slots=True)
class Operation:
    """One upload or download of MAVSDK's; ``result`` is None while it goes on. Filled in by MAVSDK's thread."""

    result: Any = None
    items: tuple[WireItem, ...] = field(default=())


class Station:
    """One instance of MAVSDK, for one vehicle.

    Parameters
    ----------
    us
        System and component that MAVSDK takes for itself.
    """

    def __init__(self, us: Address = GROUND) -> None:
        mavsdk.log_subscribe(lambda *_: True)  # else it prints to our standard output
        self._codec = Codec(us)
        self._written: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._greeted = False
        self._raw: Any = None
        self._operation: Operation | None = None
        configuration = mavsdk.Configuration.create_manual(us.system, us.component, False)
        self._sdk = mavsdk.Mavsdk(configuration)
        if self._sdk.add_any_connection("raw://") != mavsdk.ConnectionResult.SUCCESS:
            self._sdk.destroy()
            raise MavplanError("MAVSDK does not start: it refuses its raw connection")
        self._sdk.subscribe_raw_bytes_to_be_sent(self._written.put)

    def close(self) -> None:
        """End MAVSDK's threads."""
        if self._raw is not None:
            self._raw.destroy()
        self._sdk.destroy()

    def feed(self, message: Message) -> None:
        """Hand a message of the vehicle to MAVSDK."""
        self._greeted = self._greeted or message.get_type() == "HEARTBEAT"
        self._sdk.pass_received_raw_bytes(bytes(message.get_msgbuf()))

    def to_send(self, now: float) -> list[Message]:
        """Return what MAVSDK wants to be sent; heartbeats are the session's own."""
        messages: list[Message] = []
        while not self._written.empty():
            messages += self._codec.decode(self._written.get(), now)
        return [message for message in messages if message.get_type() != "HEARTBEAT"]

    @property
    def ready(self) -> bool:
        """Whether MAVSDK knows the vehicle and what firmware it runs, and no operation goes on."""
        if self._raw is None and self._greeted:
            known = {mavsdk.Autopilot.PX4, mavsdk.Autopilot.ARDUPILOT}
            for system in self._sdk.get_systems():
                if system.has_autopilot() and system.autopilot_type() in known:
                    self._raw = mission_raw.MissionRaw(system)
                    break
        busy = self._operation is not None and self._operation.result is None
        return self._raw is not None and not busy

    def upload(self, mission_type: int, items: Sequence[WireItem]) -> Operation:
        """Begin an upload; only when `ready`."""
        start = {
            MissionType.MISSION: self._raw.upload_mission_async,
            MissionType.FENCE: self._raw.upload_geofence_async,
            MissionType.RALLY: self._raw.upload_rally_points_async,
        }[MissionType(mission_type)]
        self._operation = operation = Operation()

        def ended(result: Any, _: Any) -> None:
            operation.result = result

        start([_to_mavsdk(item, mission_type) for item in items], ended)
        return operation

    def download(self, mission_type: int) -> Operation:
        """Begin a download; only when `ready`."""
        start = {
            MissionType.MISSION: self._raw.download_mission_async,
            MissionType.FENCE: self._raw.download_geofence_async,
            MissionType.RALLY: self._raw.download_rallypoints_async,
        }[MissionType(mission_type)]
        self._operation = operation = Operation()

        def ended(result: Any, items: Sequence[Any], _: Any) -> None:
            operation.items = tuple(_from_mavsdk(item) for item in items)
            operation.result = result  # last: whoever sees it finds the items

        start(ended)
        return operation


def _to_mavsdk(item: WireItem, mission_type: int) -> Any:
    """Return MAVSDK's item; it wants exactly one current item in a mission.

    Raises
    ------
    MavplanError
        A number does not fit its field: ctypes would wrap it without a word.
    """
    current = int(item.seq == 0) if mission_type == MissionType.MISSION else item.current
    for value, room in ((item.frame, _BYTE), (item.command, _SHORT), (item.x, _INT32), (item.y, _INT32)):
        if value not in room:
            raise MavplanError(f"item {item.seq} cannot be sent: {value} does not fit its field")
    return mission_raw.MissionItem(
        item.seq,
        int(item.frame),
        int(item.command),
        current,
        int(item.autocontinue),
        *(float(param) for param in item.params),
        int(item.x),
        int(item.y),
        float(item.z),
        int(mission_type),
    )


def _from_mavsdk(item: Any) -> WireItem:
    return WireItem(
        item.seq,
        item.frame,
        item.command,
        item.current,
        item.autocontinue,
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        item.x,
        item.y,
        item.z,
    )
