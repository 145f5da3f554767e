"""The mock as a process of its own, over UDP and TCP on this machine, with pymavlink's messages as client."""

import contextlib
import select
import signal
import socket
import threading
import time
from typing import Any

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sitl_mock.__main__ import main
from sitl_mock.wire import Encoder, Parser

from .process import WAIT_S, mock, port_of
from .rig import NAN, ack, command, count, good_mission, heartbeat, request, request_list

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


class Client:
    """A ground station on a socket."""

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock
        self.parser = Parser()
        self.encoder = Encoder(255, 190)
        self.heard: list[Any] = []

    def send(self, message: Any) -> None:
        self.sock.send(self.encoder.encode(message))

    def wait(self, *names: str) -> Any:
        """The next message of one of these names."""
        until = time.monotonic() + WAIT_S
        while time.monotonic() < until:
            for n, message in enumerate(self.heard):
                if message.get_type() in names:
                    del self.heard[: n + 1]
                    return message
            if select.select([self.sock], [], [], 0.2)[0]:
                self.heard += self.parser.feed(self.sock.recv(65536))
        raise AssertionError(f"none of {names} within {WAIT_S} s")

    def upload(self, mission: list[Any]) -> int:
        self.send(count(len(mission)))
        while True:
            message = self.wait("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
            if message.get_type() == "MISSION_ACK":
                return int(message.type)
            self.send(mission[message.seq])

    def download(self) -> list[int]:
        self.send(request_list())
        commands = []
        for seq in range(self.wait("MISSION_COUNT").count):
            self.send(request(seq))
            commands.append(self.wait("MISSION_ITEM_INT").command)
        self.send(ack())
        return commands


def udp_client(port: int) -> Client:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.connect(("127.0.0.1", port))
    return Client(sock)


def tcp_client(port: int) -> Client:
    return Client(socket.create_connection(("127.0.0.1", port), WAIT_S))


@BOTH
@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_upload_and_download_over_a_socket(firmware: str, kind: str) -> None:
    """The mission sent is the mission read; the line that is printed names the port."""
    with mock("--firmware", firmware, "--conn", f"{kind}:127.0.0.1:0", "--home", "37.4,-122.1,10") as (
        process,
        (line,),
    ):
        title = {"ardupilot": "ArduPilot", "px4": "PX4"}[firmware]
        assert line.startswith(f"sitl_mock: {title}, system 1, listening on {kind}:127.0.0.1:")
        client = (udp_client if kind == "udpin" else tcp_client)(port_of(line))
        with client.sock:
            client.send(heartbeat())
            assert client.wait("HEARTBEAT").get_srcSystem() == 1
            mission = good_mission(firmware, 20)
            assert client.upload(mission) == 0
            assert client.download() == [message.command for message in mission]
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""


def test_it_calls_by_udpout_and_tcp() -> None:
    """The ground station listens; over TCP the mock calls again until somebody is there, and after a hang-up."""
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("127.0.0.1", 0))
    udp.settimeout(WAIT_S)
    tcp = socket.socket()
    tcp.bind(("127.0.0.1", 0))
    ends = [
        "--conn",
        f"udpout:127.0.0.1:{udp.getsockname()[1]}",
        "--conn",
        f"tcp:127.0.0.1:{tcp.getsockname()[1]}",
    ]
    with udp, tcp, mock("--firmware", "px4", "--system-id", "7", *ends, lines=2) as (_, lines):
        assert "calling udpout:127.0.0.1:" in lines[0]
        (message,) = Parser().feed(udp.recvfrom(2000)[0])
        assert (message.get_type(), message.get_srcSystem()) == ("HEARTBEAT", 7)
        time.sleep(0.2)
        tcp.listen()
        tcp.settimeout(WAIT_S)
        for _ in range(2):
            connection, _ = tcp.accept()
            with connection:
                assert Client(connection).wait("HEARTBEAT").get_srcSystem() == 7


def test_many_peers_at_once_and_some_that_vanish() -> None:
    """Ten of each kind; half hang up in the middle of a frame; the others are served, and the mock does not spin."""
    with mock("--firmware", "ardupilot", "--conn", "udpin:127.0.0.1:0", "--conn", "tcpin::0", lines=2) as (
        process,
        lines,
    ):
        clients = [udp_client(port_of(lines[0])) for _ in range(10)] + [
            tcp_client(port_of(lines[1])) for _ in range(10)
        ]
        for client in clients:
            client.send(heartbeat())
        for client in clients[::2]:
            client.sock.send(client.encoder.encode(count(2))[:7])
            client.sock.close()
        for client in clients[1::2]:
            client.wait("HEARTBEAT")
            client.send(request_list())
            assert client.wait("MISSION_COUNT").count == 0
        with contextlib.suppress(FileNotFoundError):
            busy = _cpu_s(process.pid)
            clients[1].wait("HEARTBEAT")
            clients[1].wait("HEARTBEAT")
            assert _cpu_s(process.pid) - busy < 0.5
        for client in clients[1::2]:
            client.sock.close()


def _cpu_s(pid: int) -> float:
    from pathlib import Path

    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def test_a_tcp_peer_that_never_reads_does_not_stop_the_others() -> None:
    """It is cut off once too much waits for it."""
    with mock("--firmware", "px4", "--conn", "tcpin:127.0.0.1:0") as (_, (line,)):
        deaf, client = tcp_client(port_of(line)), tcp_client(port_of(line))
        with deaf.sock, client.sock:
            asking = deaf.encoder.encode(mavlink.MAVLink_param_request_list_message(1, 1)) * 200
            with contextlib.suppress(OSError):
                deaf.sock.settimeout(0.5)
                for _ in range(100):
                    deaf.sock.sendall(asking)
            client.send(request_list())
            assert client.wait("MISSION_COUNT").count == 0


@pytest.mark.parametrize("name", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_it_cleanly(name: signal.Signals) -> None:
    """Exit code 0, no traceback."""
    with mock("--firmware", "px4", "--conn", "udpin:127.0.0.1:0") as (process, _):
        process.send_signal(name)
        assert process.wait(WAIT_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_a_port_in_use_is_one_sentence_and_exit_2(kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    """With the address in it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM if kind == "udpin" else socket.SOCK_STREAM) as taken:
        taken.bind(("127.0.0.1", 0))
        if kind == "tcpin":
            taken.listen()
        port = taken.getsockname()[1]
        assert main(["--firmware", "px4", "--conn", f"{kind}:127.0.0.1:{port}"]) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert f"{kind}:127.0.0.1:{port}" in error


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["--firmware", "betaflight"],
        ["--firmware", "px4", "--conn", "serial:x"],
        ["--firmware", "px4", "--home", "91,0,0"],
        ["--firmware", "px4", "--home", "1,2"],
        ["--firmware", "px4", "--home", "nan,0,0"],
        ["--firmware", "px4", "--fault", "dorp"],
        ["--firmware", "px4", "--system-id", "256"],
        ["--firmware", "px4", "--capacity", "-1"],
        ["--firmware", "px4", "--seed", "x"],
        ["--firmware", "px4", "--speed", "0"],
        ["--firmware", "px4", "--speed", "nan"],
        ["--firmware", "px4", "--wind", "6@west"],
        ["--firmware", "px4", "--wind", "-6@0"],
        ["--firmware", "px4", "--battery-wh", "inf"],
        ["--firmware", "px4", "--mass-kg", "-2"],
        ["--firmware", "px4", "--fault", "gust=3/far"],
    ],
)
def test_bad_usage_is_exit_2_and_no_traceback(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """With an error line of argparse."""
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert "error:" in error
    assert "Traceback" not in error


def test_help_lists_every_fault(capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 0."""
    assert main(["--help"]) == 0
    assert "second-gcs" in capsys.readouterr().out


def test_a_firmware_that_crashes_ends_the_process_with_a_sentence() -> None:
    """A hold of 5e9 seconds, as on the real simulator: exit code 1."""
    with mock("--firmware", "ardupilot", "--conn", "udpin:127.0.0.1:0") as (process, (line,)):
        client = udp_client(port_of(line))
        with client.sock:
            mission = good_mission("ardupilot")
            mission[2].param1 = 5e9
            client.send(count(len(mission)))
            for _ in range(3):
                client.send(mission[client.wait("MISSION_REQUEST").seq])
        assert process.wait(WAIT_S) == 1
        assert process.stderr is not None
        assert process.stderr.read().count("\n") == 1


def test_faults_work_in_the_process_too() -> None:
    """Refused with what was asked for."""
    with mock("--firmware", "px4", "--conn", "udpin:127.0.0.1:0", "--fault", "nack=DENIED,delay=20ms") as (
        _,
        (line,),
    ):
        client = udp_client(port_of(line))
        with client.sock:
            assert client.upload(good_mission("px4")) == 14


def test_main_runs_in_a_thread_where_signals_cannot_be_set(capfd: pytest.CaptureFixture[str]) -> None:
    """A crash ends it there; the caller's signal handlers stay."""
    before = signal.getsignal(signal.SIGTERM)
    codes: list[int] = []
    thread = threading.Thread(
        target=lambda: codes.append(main(["--firmware", "ardupilot", "--conn", "udpin:127.0.0.1:0"]))
    )
    thread.start()
    line = ""
    until = time.monotonic() + WAIT_S
    while not line and time.monotonic() < until:
        time.sleep(0.02)
        line = capfd.readouterr().out
    client = udp_client(port_of(line.strip()))
    with client.sock:
        client.send(count(1, 1))
        client.wait("MISSION_REQUEST")
        client.send(
            mavlink.MAVLink_mission_item_int_message(
                1, 1, 0, 0, 5003, 0, 1, float("nan"), 0, 0, 0, 0, 0, 0, 1
            )
        )
        thread.join(WAIT_S)
    assert codes == [1]
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_its_time_goes_faster_than_the_clock(firmware: str) -> None:
    """Booting, 42 s of its own until it may be armed, a climb and a return: seconds at fifty times the speed."""
    ends = ["--firmware", firmware, "--conn", "udpin:127.0.0.1:0", "--home", "37.4,-122.1,10"]
    climb = command(22)
    climb.param7 = 10.0 if firmware == "ardupilot" else NAN
    orders = [climb, command(400, 1)] if firmware == "px4" else [command(176, 1, 4), command(400, 1), climb]
    with mock(*ends, "--speed", "50", "--boot") as (_, (line,)):
        client = udp_client(port_of(line))
        started = time.monotonic()

        def position_after(messages: list[Any]) -> Any:
            for message in [*messages, command(511, 33, 500_000)]:
                client.send(message)
            return client.wait("GLOBAL_POSITION_INT")

        while position_after(orders).relative_alt < 2000:
            assert time.monotonic() < started + WAIT_S
        while position_after([command(20)]).relative_alt > 50:
            assert time.monotonic() < started + WAIT_S
        assert time.monotonic() - started > 10 / 50
        client.sock.close()
