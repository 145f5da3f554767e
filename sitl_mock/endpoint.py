"""The driver: sockets and a clock around a vehicle that has neither. One thread, any number of peers.

A UDP peer is an address that has sent something, a TCP peer a connection; each is a link of its own to the
vehicle. A peer that goes takes nothing with it.
"""

import contextlib
import selectors
import socket
import time
from collections.abc import Hashable, Sequence
from typing import Protocol

from sitl_mock.conn import Connection

CHUNK = 65536
UDP_MEMORY_S = 60.0
"""A UDP peer that has said nothing for so long is forgotten."""
TCP_BACKLOG_BYTES = 1_000_000
"""A TCP peer that reads no more is cut off when so much waits for it."""
REDIAL_S = 1.0
MAX_TCP_PEERS = 100
LONGEST_WAIT_S = 1.0


class EndpointError(Exception):
    """An address cannot be had; the message says which and why."""


class Vehicle(Protocol):
    """What an `Autopilot` and a `FaultyNetwork` have in common."""

    @property
    def killed_by(self) -> str | None:
        """What ended it."""

    def receive(self, data: bytes, sender: Hashable, now: float) -> None:
        """Take bytes."""

    def tick(self, now: float) -> None:
        """Do what is due."""

    def to_send(self) -> list[tuple[Hashable | None, bytes]]:
        """Give frames."""

    def next_timer(self) -> float | None:
        """Say when to be called again."""

    def forget(self, link: Hashable) -> None:
        """Drop a link."""


class _Udp:
    """One UDP socket with the addresses that have spoken, or the one it calls."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.target: tuple[str, int] | None = None
        try:
            self.socket.setblocking(False)
            if connection.listens:
                self.socket.bind((connection.host, connection.port))
            else:
                self.target = (socket.gethostbyname(connection.host), connection.port)
        except OSError:
            self.socket.close()
            raise
        self.heard: dict[tuple[str, int], float] = {}

    def addresses(self) -> list[tuple[str, int]]:
        known = list(self.heard)
        return known if self.target is None or self.target in self.heard else [self.target, *known]

    def send(self, data: bytes, address: tuple[str, int]) -> None:
        with contextlib.suppress(OSError):  # a datagram may be lost, here as anywhere
            self.socket.sendto(data, address)


class _TcpPeer:
    """One TCP connection with what it has not read yet."""

    def __init__(self, sock: socket.socket) -> None:
        self.socket = sock
        self.waiting = bytearray()
        sock.setblocking(False)
        with contextlib.suppress(OSError):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


class _Dialer:
    """A TCP connection that is made again whenever it is gone."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.peer: _TcpPeer | None = None
        self.connecting: socket.socket | None = None
        self.next_try = 0.0


class Endpoint:
    """All ends of one vehicle.

    Parameters
    ----------
    vehicle
        An `Autopilot`, or a `FaultyNetwork` with one inside.
    connections
        Where to listen and whom to call.
    speed
        The vehicle's time goes so much faster than the clock.

    Raises
    ------
    EndpointError
        If an address cannot be had.
    """

    def __init__(self, vehicle: Vehicle, connections: Sequence[Connection], speed: float = 1.0) -> None:
        self._vehicle = vehicle
        self._speed, self._started = speed, time.monotonic()
        self._selector = selectors.SelectSelector()  # the one whose time-outs are finer than a millisecond
        self._udp: list[_Udp] = []
        self._listeners: list[socket.socket] = []
        self._dialers: list[_Dialer] = []
        self._tcp: dict[int, _TcpPeer] = {}
        self._next_peer = 0
        self.bound: list[Connection] = []
        try:
            for connection in connections:
                self.bound.append(self._open(connection))
        except OSError as wrong:
            self.close()
            doing = "listen on" if connection.listens else "call"
            raise EndpointError(f"cannot {doing} {connection}: {wrong.strerror or wrong}") from wrong

    def _open(self, connection: Connection) -> Connection:
        if connection.kind in {"udpin", "udpout"}:
            udp = _Udp(connection)
            self._udp.append(udp)
            self._selector.register(udp.socket, selectors.EVENT_READ, udp)
            sock = udp.socket
        elif connection.kind == "tcpin":
            sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._listeners.append(sock)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.setblocking(False)
            sock.bind((connection.host, connection.port))
            sock.listen()
            self._selector.register(sock, selectors.EVENT_READ, sock)
        else:
            self._dialers.append(_Dialer(connection))
            return connection
        return (
            Connection(connection.kind, connection.host, sock.getsockname()[1])
            if connection.listens
            else connection
        )

    def _vehicle_time(self) -> float:
        return self._started + (time.monotonic() - self._started) * self._speed

    def run(self) -> None:
        """Serve until the vehicle dies; KeyboardInterrupt ends it too."""
        while self._vehicle.killed_by is None:
            now = time.monotonic()
            self._dial(now)
            self._vehicle.tick(self._vehicle_time())
            self._flush()
            timer = self._vehicle.next_timer()
            wait = LONGEST_WAIT_S
            if timer is not None:
                wait = min(max((timer - self._vehicle_time()) / self._speed, 0.0), LONGEST_WAIT_S)
            for key, events in self._selector.select(wait):
                self._serve(key, events, time.monotonic())
            self._forget_silent(time.monotonic())

    def close(self) -> None:
        """Close every socket."""
        self._selector.close()
        sockets = (
            [udp.socket for udp in self._udp] + self._listeners + [peer.socket for peer in self._tcp.values()]
        )
        for sock in [*sockets, *(dialer.connecting for dialer in self._dialers if dialer.connecting)]:
            sock.close()

    def _serve(self, key: selectors.SelectorKey, events: int, now: float) -> None:
        if isinstance(key.data, _Udp):
            self._read_udp(key.data, now)
        elif isinstance(key.data, _Dialer):
            self._connected(key.data, now)
        elif isinstance(key.data, int):
            if events & selectors.EVENT_WRITE and key.data in self._tcp:
                self._write(key.data)
            if events & selectors.EVENT_READ and key.data in self._tcp:
                self._read_tcp(key.data)
        else:
            with contextlib.suppress(OSError):
                sock, _ = key.data.accept()
                self._add_peer(sock)
        self._flush()

    def _read_udp(self, udp: _Udp, now: float) -> None:
        try:
            data, address = udp.socket.recvfrom(CHUNK)
        except OSError:  # the answer of a closed port to what was sent before
            return
        udp.heard[address] = now
        self._vehicle.receive(data, (udp.connection, address), self._vehicle_time())

    def _add_peer(self, sock: socket.socket) -> _TcpPeer | None:
        if len(self._tcp) >= MAX_TCP_PEERS:
            sock.close()
            return None
        peer = _TcpPeer(sock)
        self._next_peer += 1
        self._tcp[self._next_peer] = peer
        self._selector.register(sock, selectors.EVENT_READ, self._next_peer)
        return peer

    def _read_tcp(self, number: int) -> None:
        try:
            data = self._tcp[number].socket.recv(CHUNK)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if data:
            self._vehicle.receive(data, number, self._vehicle_time())
        else:
            self._drop(number)

    def _drop(self, number: int) -> None:
        peer = self._tcp.pop(number)
        self._selector.unregister(peer.socket)
        peer.socket.close()
        self._vehicle.forget(number)
        for dialer in self._dialers:
            if dialer.peer is peer:
                dialer.peer = None

    def _flush(self) -> None:
        for link, frame in self._vehicle.to_send():
            if link is None:
                for udp in self._udp:
                    for address in udp.addresses():
                        udp.send(frame, address)
                for number in list(self._tcp):
                    self._queue(number, frame)
            elif isinstance(link, int):
                self._queue(link, frame)
            elif isinstance(link, tuple):
                for udp in self._udp:
                    if udp.connection is link[0]:
                        udp.send(frame, link[1])

    def _queue(self, number: int, frame: bytes) -> None:
        peer = self._tcp.get(number)
        if peer is None:
            return
        peer.waiting += frame
        if len(peer.waiting) > TCP_BACKLOG_BYTES:
            self._drop(number)
        else:
            self._write(number)

    def _write(self, number: int) -> None:
        peer = self._tcp[number]
        try:
            sent = peer.socket.send(peer.waiting)
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError:
            self._drop(number)
            return
        del peer.waiting[:sent]
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if peer.waiting else 0)
        self._selector.modify(peer.socket, events, number)

    def _dial(self, now: float) -> None:
        for dialer in self._dialers:
            if dialer.peer is None and dialer.connecting is None and now >= dialer.next_try:
                dialer.next_try = now + REDIAL_S
                sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
                sock.setblocking(False)
                try:
                    sock.connect_ex((dialer.connection.host, dialer.connection.port))
                except OSError:  # the name is not known at the moment
                    sock.close()
                    continue
                dialer.connecting = sock
                self._selector.register(sock, selectors.EVENT_WRITE, dialer)

    def _connected(self, dialer: _Dialer, now: float) -> None:
        sock, dialer.connecting = dialer.connecting, None
        if sock is None:
            return
        self._selector.unregister(sock)
        if sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            sock.close()
            dialer.next_try = now + REDIAL_S
        else:
            dialer.peer = self._add_peer(sock)

    def _forget_silent(self, now: float) -> None:
        for udp in self._udp:
            for address in [address for address, heard in udp.heard.items() if now > heard + UDP_MEMORY_S]:
                del udp.heard[address]
                self._vehicle.forget((udp.connection, address))
