"""Thin sockets: `open_connection`. Bytes in, bytes out; whoever is at the other end may come and go.

A connection belongs to one thread. Losing the peer is no error here and costs no processor time: reading waits out
its time, a caller calls again once a second, a listener takes the next one who comes.
"""

import contextlib
import errno
import select
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

from mavplan.errors import NoLinkError
from mavplan.link.endpoint import Endpoint
from mavplan.link.signing import Signing

CHUNK = 65_536
CONNECT_S = 5.0
RECONNECT_S = 1.0
PEER_GONE_S = 5.0
"""Silence after which a vehicle may be somewhere else: it sends a heartbeat a second."""
WRITE_S = 0.25
"""A peer that takes no bytes for so long has lost them: better than waiting beyond a deadline."""

_FATAL_WRITE = frozenset({errno.EMSGSIZE, errno.EBADF, errno.EINVAL, errno.ENOTSOCK})


class Connection(ABC):
    """One open link; with a key in ``signing``, frames that are not signed with it are not believed."""

    signing: Signing | None = None
    opening_s: float = 0.0
    """How long it took to open: that time is gone from a deadline."""
    rival: str | None = None
    """Another address that sends as the vehicle, too, and is not listened to."""

    @abstractmethod
    def read(self, timeout_s: float) -> bytes:
        """Return what has come, as soon as something has; empty after ``timeout_s`` of nothing."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send a frame. What cannot be sent is lost, as on a radio."""

    @abstractmethod
    def close(self) -> None:
        """Give the port back."""

    def hold_peer(self) -> None:  # noqa: B027 - nothing to do where there is one peer
        """Answer only to where the last bytes came from, from now on.

        Of use where several may send to one UDP port; elsewhere there is one peer anyway.
        """

    def from_rival(self) -> bool:
        """Whether the last bytes came from elsewhere than from the peer that is held, which is still there."""
        return False


@contextlib.contextmanager
def open_connection(
    endpoint: Endpoint, connect_s: float = CONNECT_S, signing: Signing | None = None
) -> Iterator[Connection]:
    """Open a link and close it in the end.

    Parameters
    ----------
    endpoint
        Where.
    connect_s
        How long a TCP connection may take to come about.
    signing
        The key of this link, see `mavplan.link.signing_key.open_signing`; None: no signing.

    Raises
    ------
    NoLinkError
        Nobody listens there, the address is in use or not ours, there is no such serial port.
    InputError
        A serial endpoint without the package pyserial.
    """
    begin = time.monotonic()
    connection = _opened(endpoint, connect_s)
    connection.opening_s = time.monotonic() - begin
    connection.signing = signing
    try:
        yield connection
    finally:
        connection.close()


def _opened(endpoint: Endpoint, connect_s: float) -> Connection:
    try:
        match endpoint.kind:
            case "udpin":
                return UdpIn(endpoint)
            case "udpout":
                return UdpOut(endpoint)
            case "tcpin":
                return TcpIn(endpoint)
            case "tcpout":
                return TcpOut(endpoint, connect_s)
            case "serial":
                from mavplan.link.serial_port import Serial

                return Serial(endpoint)
    except OSError as error:
        doing = "listen at" if endpoint.listens else "open"
        raise NoLinkError(f"cannot {doing} {endpoint}: {error.strerror or error}") from error


def _address(endpoint: Endpoint, kind: socket.SocketKind) -> tuple[int, Any]:
    family, _, _, _, address = socket.getaddrinfo(endpoint.host, endpoint.port, type=kind)[0]
    return family, address


def _readable(sock: socket.socket, timeout_s: float) -> bool:
    return bool(select.select([sock], [], [], max(0.0, timeout_s))[0])


class _Udp(Connection):
    """What both UDP kinds share: reading that does not stumble over the other side's closed port."""

    def __init__(self, endpoint: Endpoint) -> None:
        family, self._where = _address(endpoint, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; see `Connection`."""
        until = time.monotonic() + timeout_s
        while True:
            # Each round takes one datagram or one "port closed" off the queue, of which there is at most one for
            # each datagram sent: no hot loop.
            if not _readable(self._socket, until - time.monotonic()):
                return b""
            with contextlib.suppress(OSError):
                data, sender = self._socket.recvfrom(CHUNK)
                self._heard(sender)
                return data

    def _heard(self, sender: Any) -> None:
        """Take note of where a datagram came from."""

    def _send_to(self, data: bytes, to: Any) -> None:
        try:
            self._socket.sendto(data, to)
        except OSError as error:
            if error.errno in _FATAL_WRITE:
                raise

    def close(self) -> None:
        """Close it."""
        self._socket.close()


class UdpIn(_Udp):
    """Listens; answers to whoever was heard last, or to the peer that is held."""

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__(endpoint)
        try:
            self._socket.bind(self._where)
        except OSError:
            self._socket.close()
            raise
        self._last: Any = None
        self._peer: Any = None
        self._held = False
        self._peer_at = 0.0

    @property
    def port(self) -> int:
        """The port it listens at."""
        return int(self._socket.getsockname()[1])

    def hold_peer(self) -> None:
        """Answer only to where the last datagram came from."""
        self._peer, self._held, self._peer_at = self._last, True, time.monotonic()

    def from_rival(self) -> bool:
        """Whether the last datagram came from elsewhere than from the peer that is held, which is still there.

        A vehicle's address may change on its way; but two vehicles of the same system id would be taken for one.
        """
        held = self._held and time.monotonic() < self._peer_at + PEER_GONE_S
        if not held or self._last == self._peer:
            return False
        self.rival = f"{self._last[0]}:{self._last[1]}"
        return True

    def _heard(self, sender: Any) -> None:
        self._last = sender
        if not self._held:
            self._peer = sender

    def write(self, data: bytes) -> None:
        """Send a datagram, once somebody was heard."""
        if self._peer is not None:
            self._send_to(data, self._peer)


class UdpOut(_Udp):
    """Calls an address; hears whoever answers to our port."""

    def write(self, data: bytes) -> None:
        """Send a datagram."""
        self._send_to(data, self._where)


class _Stream(Connection):
    """What both TCP kinds share: one peer, or none for the time being."""

    def __init__(self) -> None:
        self._peer: socket.socket | None = None

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; see `Connection`."""
        until = time.monotonic() + timeout_s
        while True:
            left_s = max(0.0, until - time.monotonic())
            if self._peer is None and not self._find_peer(left_s):
                return b""
            if self._peer is None or not _readable(self._peer, until - time.monotonic()):
                return b""
            try:
                data = self._peer.recv(CHUNK)
            except OSError:
                data = b""
            if data:
                return data
            self._drop()

    def write(self, data: bytes) -> None:
        """Send a frame; see `Connection`."""
        if self._peer is None:
            return
        try:
            self._peer.settimeout(WRITE_S)
            self._peer.sendall(data)
        except OSError:
            self._drop()  # half a frame may be out: the rest would be read as another's beginning

    @abstractmethod
    def _find_peer(self, timeout_s: float) -> bool:
        """Wait for a peer; whether there is one."""

    def _take(self, peer: socket.socket) -> None:
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._peer = peer

    def _drop(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None

    def close(self) -> None:
        """Close it."""
        self._drop()


class TcpOut(_Stream):
    """Connects; when the connection breaks, connects again once a second."""

    def __init__(self, endpoint: Endpoint, connect_s: float) -> None:
        super().__init__()
        self._where = (endpoint.host, endpoint.port)
        self._take(socket.create_connection(self._where, connect_s))
        self._again_at = 0.0

    def _drop(self) -> None:
        super()._drop()
        self._again_at = time.monotonic() + RECONNECT_S

    def _find_peer(self, timeout_s: float) -> bool:
        wait_s = self._again_at - time.monotonic()
        if wait_s > 0:
            time.sleep(min(wait_s, timeout_s))
            if wait_s > timeout_s:
                return False
        self._again_at = time.monotonic() + RECONNECT_S
        with contextlib.suppress(OSError):
            self._take(socket.create_connection(self._where, max(0.05, min(RECONNECT_S, timeout_s))))
        return self._peer is not None


class TcpIn(_Stream):
    """Waits for a connection; when it breaks, for the next one."""

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__()
        family, where = _address(endpoint, socket.SOCK_STREAM)
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(where)
            self._listener.listen(1)
            self._listener.setblocking(False)
        except OSError:
            self._listener.close()
            raise

    @property
    def port(self) -> int:
        """The port it listens at."""
        return int(self._listener.getsockname()[1])

    def _find_peer(self, timeout_s: float) -> bool:
        if _readable(self._listener, timeout_s):
            with contextlib.suppress(OSError):
                self._take(self._listener.accept()[0])
        return self._peer is not None

    def close(self) -> None:
        """Close the connection and stop listening."""
        super().close()
        self._listener.close()
