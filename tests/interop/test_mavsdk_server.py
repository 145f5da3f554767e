"""MAVSDK's vehicle-side mission server as a foreign vehicle: our upload and download must satisfy it.

It calls itself a generic autopilot of no kind and cannot be told otherwise, so the test puts the heartbeat of a
multirotor in the place of its own; everything else goes through as it is.
"""

import socket
import threading

import pytest
from pymavlink.dialects.v20 import common

from mavplan.link.codec import Codec
from mavplan.link.connection import Connection, open_connection
from mavplan.link.endpoint import Endpoint
from mavplan.link.protocol import Address
from mavplan.link.vehicle import download_mission, upload_mission
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from tests.link.harness import make_mission

mavsdk = pytest.importorskip("mavsdk")


class Dressed(Connection):
    """A link on which every heartbeat is that of a quadrotor with a known autopilot."""

    def __init__(self, link: Connection, mav_autopilot: int) -> None:
        self.link = link
        self.heartbeat = common.MAVLink_heartbeat_message(2, mav_autopilot, 81, 0, 3, 3)
        self.listener, self.speaker = Codec(), Codec(Address(1, 1))

    def read(self, timeout_s: float) -> bytes:
        frames = []
        for message in self.listener.decode(self.link.read(timeout_s), 0.0):
            is_heartbeat = message.get_type() == "HEARTBEAT"
            frames.append(
                self.speaker.encode(self.heartbeat) if is_heartbeat else bytes(message.get_msgbuf())
            )
        return b"".join(frames)

    def write(self, data: bytes) -> None:
        self.link.write(data)

    def hold_peer(self) -> None:
        self.link.hold_peer()

    def close(self) -> None:
        self.link.close()


@pytest.fixture
def server():
    """A running mission server, the port it calls, and the missions it was given."""
    from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
    from mavsdk.plugins.mission_raw_server import MissionRawServer

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    log_subscribe(lambda *_: True)
    given, arrived = [], threading.Event()

    def take(_result, plan, _data):
        given.append(plan.mission_items)
        arrived.set()

    with Mavsdk(Configuration.create_with_component_type(ComponentType.AUTOPILOT)) as sdk:
        raw = MissionRawServer(sdk.server_component_by_type(ComponentType.AUTOPILOT, 0))
        raw.subscribe_incoming_mission(take)
        sdk.add_any_connection(f"udpout://127.0.0.1:{port}")
        yield port, given, arrived
        raw.destroy()


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_mavsdks_mission_server_takes_our_upload_and_gives_it_back(server, firmware):
    """Verified by our own read-back, and the same in what MAVSDK's server hands to its user."""
    port, given, arrived = server
    mission, rules = make_mission(firmware, 8), AUTOPILOTS[firmware]
    with open_connection(Endpoint("udpin", "127.0.0.1", port)) as plain:
        link = Dressed(plain, rules.mav_autopilot)
        report = upload_mission(mission, link, deadline_s=30.0, system=1)
        held = download_mission(link, deadline_s=30.0, system=1)
    sent = to_wire(mission, rules)
    assert report.items == len(sent)
    assert differences(sent, to_wire(held.mission, rules), rules) == []
    assert arrived.wait(10)
    assert [(item.seq, item.command, item.x, item.y) for item in given[-1]] == [
        (item.seq, item.command, item.x, item.y) for item in sent
    ]
