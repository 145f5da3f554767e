"""Real sockets and a real (pseudo) serial port, on this machine only."""

import contextlib
import os
import pty
import socket
import sys
import threading
import time

import pytest

from mavplan.errors import InputError, NoLinkError
from mavplan.link.connection import Connection, TcpIn, UdpIn, open_connection
from mavplan.link.endpoint import Endpoint, parse_endpoint
from mavplan.link.services import clear_vehicle, vehicle_info, verify_mission
from mavplan.link.vehicle import download_mission, upload_mission
from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES
from tests.link.harness import make_mission


def udp():
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", 0))
    sock.settimeout(5)
    return sock


def listen_tcp():
    sock = socket.socket()
    sock.bind(("127.0.0.1", 0))
    sock.listen()
    sock.settimeout(5)
    return sock


def ANY(kind):  # noqa: N802 - a constant with a hole
    return Endpoint(kind, "127.0.0.1", 0)


def test_udpin_says_nothing_before_it_is_spoken_to_and_answers_the_last_who_did():
    with open_connection(ANY("udpin")) as link, udp() as first, udp() as second:
        assert isinstance(link, UdpIn)
        link.write(b"lost")
        first.sendto(b"one", ("127.0.0.1", link.port))
        assert link.read(5) == b"one"
        link.write(b"to first")
        assert first.recv(99) == b"to first"
        second.sendto(b"two", ("127.0.0.1", link.port))
        assert link.read(5) == b"two"
        link.write(b"to second")
        assert second.recv(99) == b"to second"


def test_udpin_that_holds_its_vehicle_is_not_turned_away_by_others_but_follows_it_to_a_new_port():
    with open_connection(ANY("udpin")) as link, udp() as vehicle, udp() as other, udp() as moved:
        vehicle.sendto(b"v", ("127.0.0.1", link.port))
        link.read(5)
        link.hold_peer()
        other.sendto(b"o", ("127.0.0.1", link.port))
        assert link.read(5) == b"o"
        link.write(b"for the vehicle")
        assert vehicle.recv(99) == b"for the vehicle"
        moved.sendto(b"v", ("127.0.0.1", link.port))
        link.read(5)
        link.hold_peer()
        link.write(b"again")
        assert moved.recv(99) == b"again"


def test_udpout_speaks_first_and_hears_the_answer():
    with udp() as vehicle:
        port = vehicle.getsockname()[1]
        with open_connection(Endpoint("udpout", "127.0.0.1", port)) as link:
            link.write(b"hello")
            data, sender = vehicle.recvfrom(99)
            vehicle.sendto(b"back", sender)
            assert (data, link.read(5)) == (b"hello", b"back")


def test_udpout_to_a_closed_port_waits_out_its_time_and_does_not_fail():
    with udp() as gone:
        port = gone.getsockname()[1]
    with open_connection(Endpoint("udpout", "127.0.0.1", port)) as link:
        start = time.process_time()
        for _ in range(5):
            link.write(b"hello")
            assert link.read(0.05) == b""
        assert time.process_time() - start < 0.2


def test_tcp_connects_and_when_the_peer_goes_waits_without_work_and_connects_again():
    with (
        listen_tcp() as server,
        open_connection(Endpoint("tcpout", "127.0.0.1", server.getsockname()[1])) as link,
    ):
        peer, _ = server.accept()
        peer.sendall(b"hello")
        assert link.read(5) == b"hello"
        peer.close()
        start, cpu = time.monotonic(), time.process_time()
        assert link.read(0.3) == b""
        link.write(b"lost")
        assert time.monotonic() - start >= 0.29
        assert time.process_time() - cpu < 0.2
        link.read(1.5)
        peer, _ = server.accept()
        link.write(b"again")
        assert peer.recv(99) == b"again"
        peer.close()


def test_tcpin_takes_the_next_when_one_has_gone():
    with open_connection(ANY("tcpin")) as link:
        assert isinstance(link, TcpIn)
        assert link.read(0.01) == b""
        for words in (b"first", b"second"):
            with socket.create_connection(("127.0.0.1", link.port), 5) as vehicle:
                vehicle.sendall(words)
                assert link.read(5) == words
                link.write(b"answer")
                assert vehicle.recv(99) == b"answer"
            assert link.read(0.05) == b""


def test_a_tcp_peer_that_takes_nothing_does_not_hold_us_up():
    with (
        listen_tcp() as server,
        open_connection(Endpoint("tcpout", "127.0.0.1", server.getsockname()[1])) as link,
    ):
        peer, _ = server.accept()
        start = time.monotonic()
        for _ in range(400):
            link.write(bytes(100_000))
        assert (
            time.monotonic() - start < 30
        )  # each write gives up after a quarter second, then all are dropped
        peer.close()


def test_reading_returns_as_soon_as_something_comes():
    with open_connection(ANY("udpin")) as link, udp() as vehicle:
        timer = threading.Timer(0.1, vehicle.sendto, (b"x", ("127.0.0.1", link.port)))
        timer.start()
        assert link.read(20) == b"x"
        timer.join()


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_an_address_in_use_is_no_link_and_says_so(kind):
    with open_connection(ANY(kind)) as link:
        taken = open_connection(Endpoint(kind, "127.0.0.1", link.port))
        with pytest.raises(NoLinkError, match="cannot listen at"), taken:
            pass


@pytest.mark.parametrize(
    "text",
    [
        "udpin:203.0.113.9:14550",
        "tcp:127.0.0.1:1",
        "/dev/no-such-port,57600",
        "udpout:no.such.host.invalid:1",
    ],
)
def test_what_cannot_be_opened_is_no_link_and_names_it(text):
    with pytest.raises(NoLinkError, match="cannot") as raised, open_connection(parse_endpoint(text)):
        pass
    assert text in str(raised.value)


def test_a_serial_port_carries_both_ways():
    ours, theirs = pty.openpty()
    try:
        with open_connection(Endpoint("serial", device=os.ttyname(theirs), baud=57600)) as link:
            os.write(ours, b"\xfd\x00\x01hello")
            assert link.read(5) == b"\xfd\x00\x01hello"
            link.write(b"\xfe\x03back\n")
            assert os.read(ours, 99) == b"\xfe\x03back\n"
            start = time.monotonic()
            assert link.read(0.1) == b""
            assert time.monotonic() - start >= 0.09
    finally:
        os.close(ours)
        os.close(theirs)


def test_an_unplugged_serial_port_costs_no_work_and_no_error():
    ours, theirs = pty.openpty()
    with open_connection(Endpoint("serial", device=os.ttyname(theirs), baud=57600)) as link:
        os.close(theirs)
        os.close(ours)
        cpu = time.process_time()
        for _ in range(3):
            assert link.read(0.1) == b""
            link.write(b"lost")
        assert time.process_time() - cpu < 0.2


def test_a_serial_port_without_pyserial_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with (
        pytest.raises(InputError, match=r"mavplan\[serial\]"),
        open_connection(parse_endpoint("/dev/ttyUSB0,57600")),
    ):
        pass


def test_a_second_address_is_a_rival_while_the_held_one_is_there_and_the_vehicle_moved_when_it_is_gone(
    monkeypatch,
):
    with open_connection(ANY("udpin")) as link, udp() as vehicle, udp() as other:
        here = ("127.0.0.1", link.port)
        vehicle.sendto(b"first", here)
        link.read(5)
        assert not link.from_rival()
        link.hold_peer()
        other.sendto(b"other", here)
        link.read(5)
        assert link.from_rival()
        assert link.rival == "{}:{}".format(*other.getsockname())
        monkeypatch.setattr("mavplan.link.connection.PEER_GONE_S", 0.0)
        assert not link.from_rival()


def test_two_vehicles_of_the_same_system_id_are_not_taken_for_one_and_that_is_said():
    """Only one of them gets the mission, whole."""
    mission = make_mission("px4", 4)
    with open_connection(ANY("udpin")) as link, udp() as one, udp() as two:
        here, over = ("127.0.0.1", link.port), threading.Event()
        home = (37.4, -122.1, 10.0)
        vehicles = [(sock, Autopilot(FIRMWARES["px4"], home=home)) for sock in (one, two)]

        def fly(sock, vehicle):
            sock.settimeout(0.005)
            while not over.is_set():
                with contextlib.suppress(TimeoutError):
                    vehicle.receive(sock.recv(999), "link", time.monotonic())
                vehicle.tick(time.monotonic())
                for _, frame in vehicle.to_send():
                    sock.sendto(frame, here)

        threads = [threading.Thread(target=fly, args=each) for each in vehicles]
        for thread in threads:
            thread.start()
        try:
            report = upload_mission(mission, link, deadline_s=20.0)
        finally:
            over.set()
            for thread in threads:
                thread.join()
    assert [problem.code for problem in report.warnings if problem.code == "same-system"]
    assert sorted(len(vehicle.stored(0)) for _, vehicle in vehicles) == [0, len(mission.items)]


class Quiet(Connection):
    """Nobody is there, and it took three seconds to find that place."""

    opening_s = 3.0

    def read(self, timeout_s):
        time.sleep(timeout_s)
        return b""

    def write(self, data):
        pass

    def close(self):
        pass


@pytest.mark.parametrize(
    "work",
    [
        lambda link: upload_mission(make_mission("px4", 1), link, deadline_s=3.2),
        lambda link: download_mission(link, deadline_s=3.2),
        lambda link: verify_mission(make_mission("px4", 1), link, deadline_s=3.2),
        lambda link: vehicle_info(link, deadline_s=3.2),
        lambda link: clear_vehicle((0,), link, deadline_s=3.2),
    ],
)
def test_the_time_that_opening_takes_is_gone_from_the_deadline(work):
    begin = time.monotonic()
    with pytest.raises(NoLinkError):
        work(Quiet())
    assert time.monotonic() - begin < 1.5


def test_opening_is_timed(monkeypatch):
    def slow(endpoint, connect_s):
        time.sleep(0.05)
        return Quiet()

    monkeypatch.setattr("mavplan.link.connection._opened", slow)
    with open_connection(ANY("udpin")) as link:
        assert 0.05 <= link.opening_s < 1.0
