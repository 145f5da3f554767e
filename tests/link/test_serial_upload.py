"""An upload through a serial port: a pseudo terminal whose other end is joined to the mock vehicle's socket."""

import contextlib
import os
import pty
import select
import socket
import threading
import tty

import pytest

from mavplan.link.connection import open_connection
from mavplan.link.endpoint import parse_endpoint
from mavplan.link.vehicle import download_mission, upload_mission
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from tests.link.harness import make_mission
from tests.sitl_mock.process import mock, port_of

pytest.importorskip("serial")


@contextlib.contextmanager
def serial_port(tcp_port):
    """Give the name of a serial port that leads to a TCP port of this machine."""
    radio, port = pty.openpty()
    tty.setraw(radio)
    tty.setraw(port)
    over = threading.Event()
    with socket.create_connection(("127.0.0.1", tcp_port), 5) as vehicle:
        thread = threading.Thread(target=carry, args=(radio, vehicle, over))
        thread.start()
        try:
            yield os.ttyname(port)
        finally:
            over.set()
            thread.join()
            os.close(port)
            os.close(radio)


def carry(radio, vehicle, over):
    while not over.is_set():
        for ready in select.select([radio, vehicle], [], [], 0.05)[0]:
            if ready is vehicle:
                os.write(radio, vehicle.recv(65536))
            else:
                vehicle.sendall(os.read(radio, 65536))


@pytest.mark.parametrize(("firmware", "via"), [("ardupilot", "own"), ("px4", "own"), ("px4", "mavsdk")])
def test_a_mission_goes_through_a_serial_port_and_comes_back_the_same(firmware, via):
    mission, rules = make_mission(firmware, 8), AUTOPILOTS[firmware]
    ends = ["--conn", "tcpin:127.0.0.1:0", "--home", "37.4,-122.1,10"]
    with mock("--firmware", firmware, *ends) as (_, (line,)), serial_port(port_of(line)) as device:
        endpoint = parse_endpoint(f"{device},57600")
        assert endpoint.kind == "serial"
        with open_connection(endpoint) as link:
            report = upload_mission(mission, link, deadline_s=60.0, system=1, place=str(endpoint), via=via)
        with open_connection(endpoint) as link:
            held = download_mission(link, deadline_s=60.0, system=1, via=via)
    assert report.items == len(to_wire(mission, rules))
    assert differences(to_wire(mission, rules), to_wire(held.mission, rules), rules) == []
