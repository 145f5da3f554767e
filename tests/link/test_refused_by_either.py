"""Nothing is written to an armed vehicle, or one whose home is elsewhere, by either link."""

import socket
import threading

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import RefusedError
from mavplan.link.codec import Codec
from mavplan.link.connection import UdpIn, open_connection
from mavplan.link.endpoint import Endpoint
from mavplan.link.protocol import Address
from mavplan.link.vehicle import upload_mission
from tests.link.harness import make_mission
from tests.sitl_mock.process import mock, port_of

ARMED = 0x80


class Beating:
    """A vehicle of which only the heartbeat is there; keeps what it is sent."""

    def __init__(self, port, base_mode):
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.settimeout(0.2)
        self.port, self.base_mode, self.over = port, base_mode, threading.Event()
        self.heard = []
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        codec, ears = Codec(Address(1, 1)), Codec()
        beat = common.MAVLink_heartbeat_message(2, common.MAV_AUTOPILOT_PX4, self.base_mode, 0, 4, 3)
        while not self.over.is_set():
            self.sock.sendto(codec.encode(beat), ("127.0.0.1", self.port))
            try:
                self.heard += [message.get_type() for message in ears.decode(self.sock.recv(65536), 0.0)]
            except OSError:
                continue

    def close(self):
        self.over.set()
        self.thread.join()
        self.sock.close()


@pytest.mark.parametrize("via", ["own", "mavsdk"])
def test_an_armed_vehicle_gets_nothing(via):
    with open_connection(Endpoint("udpin", "127.0.0.1", 0)) as link:
        assert isinstance(link, UdpIn)
        vehicle = Beating(link.port, 81 | ARMED)
        try:
            with pytest.raises(RefusedError, match="armed"):
                upload_mission(make_mission("px4"), link, deadline_s=20.0, system=1, via=via)
        finally:
            vehicle.close()
    assert not [name for name in vehicle.heard if name.startswith("MISSION")]


@pytest.mark.parametrize("via", ["own", "mavsdk"])
def test_a_vehicle_whose_home_is_elsewhere_gets_nothing(via):
    ends = ["--conn", "udpin:127.0.0.1:0", "--home", "37.5,-122.1,10"]
    with (
        mock("--firmware", "ardupilot", *ends) as (_, (line,)),
        open_connection(Endpoint("udpout", "127.0.0.1", port_of(line))) as link,
        pytest.raises(RefusedError, match="home"),
    ):
        upload_mission(make_mission("ardupilot"), link, deadline_s=20.0, system=1, via=via)
