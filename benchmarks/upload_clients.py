"""The three ground stations that upload the same mission: ours, MAVSDK and MAVProxy, each as its users have it."""

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from mavplan.link.connection import open_connection
from mavplan.link.endpoint import parse_endpoint
from mavplan.link.upload_session import UploadSession
from mavplan.link.vehicle import default_deadline_s, drive
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Mission
from mavplan.mission.uploadable import item_count
from mavplan.mission.wire import WireItem, to_wire
from tests.interop.mavproxy import MAVPROXY, MavProxy

DISCOVERY_S = 10.0


class UploadFailedError(Exception):
    """There is no time to tell of an upload; the message says why."""


class Client(Protocol):
    """A ground station on a link."""

    def upload(self) -> None:
        """Begin to upload the mission; it may wait for the end.

        Raises
        ------
        UploadFailedError
            It did not come about, as far as the client knows.
        """

    def close(self) -> None:
        """Leave."""


def wire_items(mission: Mission) -> tuple[WireItem, ...]:
    """Return the items that all three send."""
    if mission.autopilot is None:
        raise AssertionError("a mission for nobody")
    return to_wire(mission, AUTOPILOTS[mission.autopilot])


class UntilReadBack(UploadSession):
    """The real session, over where it begins to read back: from there on nothing is measured."""

    @property
    def done(self) -> bool:
        """Whether the vehicle has acknowledged, or there is an error."""
        acknowledged = self._upload is not None and self._upload.accepted_at is not None
        return acknowledged or super().done


class Ours:
    """The session of `mavplan upload` and what drives it, over a connection of its own each time."""

    def __init__(self, mission: Mission, port: int) -> None:
        self._mission = mission
        self._endpoint = parse_endpoint(f"udpout:127.0.0.1:{port}")

    def upload(self) -> None:
        """Find the vehicle and upload."""
        with open_connection(self._endpoint) as connection:
            deadline_s = default_deadline_s(item_count(self._mission))
            session = UntilReadBack(self._mission, now=time.monotonic(), deadline_s=deadline_s, system=1)
            drive(session, connection)
        if session.error is not None:
            raise UploadFailedError(f"mavplan: {session.error}")

    def close(self) -> None:
        """Nothing is left open."""


class Mavsdk:
    """MAVSDK's MissionRaw in this process; its work is done by threads of its own, in C++."""

    def __init__(self, mission: Mission, port: int) -> None:
        import mavsdk
        from mavsdk.plugins.mission_raw import MissionItem, MissionRaw

        mavsdk.log_subscribe(lambda *_: True)
        ground = mavsdk.ComponentType.GROUND_STATION
        self._sdk = mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(ground))
        self._raw: Any = None
        self._sdk.add_any_connection(f"udpout://127.0.0.1:{port}")
        vehicle = self._sdk.first_autopilot(DISCOVERY_S)
        if vehicle is None:
            self.close()
            raise UploadFailedError("MAVSDK does not find the mock")
        self._raw = MissionRaw(vehicle)
        self._items = [
            MissionItem(
                *(item.seq, int(item.frame), item.command, int(item.seq == 0), item.autocontinue),
                *(float(param) for param in item.params),
                *(item.x, item.y, float(item.z), 0),
            )
            for item in wire_items(mission)
        ]

    def upload(self) -> None:
        """Upload and wait for MAVSDK's word."""
        from mavsdk.plugins.mission_raw import MissionRawError

        try:
            self._raw.upload_mission(self._items)
        except MissionRawError as error:
            raise UploadFailedError(f"MAVSDK: {error.result.name}") from error

    def close(self) -> None:
        """End its threads."""
        if self._raw is not None:
            self._raw.destroy()
        self._sdk.destroy()


class MavProxyClient:
    """MAVProxy as a program, told to ``wp load`` a file."""

    def __init__(self, mission: Mission, port: int) -> None:
        """Start it and wait until it hears the vehicle."""
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        self._file = folder / "mission.waypoints"
        self._file.write_text(waypoints(wire_items(mission)))
        self._program = MavProxy(f"udpout:127.0.0.1:{port}", folder)
        try:
            self._program.wait_for("online system 1")
        except AssertionError as error:
            self.close()
            raise UploadFailedError("MAVProxy does not find the mock") from error

    def upload(self) -> None:
        """Tell it to begin."""
        self._program.type(f"wp load {self._file}")

    def close(self) -> None:
        """End it."""
        self._program.close()
        self._folder.cleanup()


def waypoints(items: Sequence[WireItem]) -> str:
    """Return the lines of a ``.waypoints`` file for MAVProxy, which cuts places off to 1e-7 degrees: half more."""
    rows = [
        (
            *(item.seq, item.current, int(item.frame), item.command, *item.params),
            *(f"{_half_more(place) / 1e7:.8f}" for place in (item.x, item.y)),
            *(item.z, item.autocontinue),
        )
        for item in items
    ]
    return "QGC WPL 110\n" + "".join("\t".join(str(field) for field in row) + "\n" for row in rows)


def _half_more(place_e7: int) -> float:
    return place_e7 + (0.5 if place_e7 > 0 else -0.5) * (place_e7 != 0)


def missing(name: str) -> str:
    """Return why a ground station cannot take part here, or nothing."""
    if name == "MAVProxy" and not MAVPROXY.is_file():
        return "MAVProxy takes no part: there is no .venv-mavproxy, scripts/mavproxy-env.sh makes it"
    if name == "MAVSDK":
        try:
            import mavsdk  # noqa: F401
        except ImportError as error:
            return f"MAVSDK takes no part: {error}"
    return ""


CLIENTS: dict[str, type[Ours] | type[Mavsdk] | type[MavProxyClient]] = {
    "mavplan": Ours,
    "MAVSDK": Mavsdk,
    "MAVProxy": MavProxyClient,
}
