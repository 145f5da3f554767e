"""Connection strings: one parser for pymavlink's spelling and MAVSDK's, and both written out again.

::

    udp:HOST:PORT  udpin:HOST:PORT   udp://:PORT  udpin://HOST:PORT    listen for UDP (no HOST: on every interface)
    udpout:HOST:PORT                 udpout://HOST:PORT                send UDP to
    tcp:HOST:PORT  tcpout:HOST:PORT  tcp://…      tcpout://HOST:PORT   connect by TCP to
    tcpin:HOST:PORT                  tcpin://HOST:PORT                 wait for a TCP connection
    /dev/ttyUSB0,57600  COM3,57600   serial:///dev/ttyUSB0:57600       serial port, baud

Without a host a listening endpoint is open to the whole network, as both other programs have it; say
``udpin:127.0.0.1:14550`` to hear this machine only.
"""

import re
from dataclasses import dataclass
from typing import Literal

from mavplan.errors import InputError, Problem

Kind = Literal["udpin", "udpout", "tcpin", "tcpout", "serial"]

DEFAULT_BAUD = 57_600
"""What telemetry radios are delivered with."""

ANY_HOST = "0.0.0.0"

ALLOWED = (
    "allowed are udp:HOST:PORT or udpin:HOST:PORT (listen), udpout:HOST:PORT, tcp:HOST:PORT (connect), "
    "tcpin:HOST:PORT (listen), /dev/ttyUSB0,57600 or COM3,57600, and MAVSDK's udpin://, udpout://, tcpin://, "
    "tcpout:// and serial:///dev/ttyUSB0:57600"
)

_KINDS: dict[str, Kind] = {
    "udp": "udpin",
    "udpin": "udpin",
    "udpout": "udpout",
    "tcp": "tcpout",
    "tcpout": "tcpout",
    "tcpin": "tcpin",
}
_NETWORK = re.compile(
    r"(?P<kind>[a-z]+):(?://)?(?P<host>\[[0-9A-Fa-f:.%\w]+\]|[^:/\[\]]*):(?P<port>\d+)/?", re.ASCII
)
_SERIAL_URL = re.compile(r"serial:(?://)?(?P<device>.+?)(?:[:,](?P<baud>\d+))?")
_SERIAL = re.compile(r"(?P<device>/dev/[^,]+|COM\d+)(?:[,:](?P<baud>\d+))?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where a vehicle is to be found.

    Attributes
    ----------
    kind
        ``udpin`` and ``tcpin`` listen, ``udpout`` and ``tcpout`` call, ``serial`` is a port of this machine.
    host, port
        Of a network endpoint.
    device, baud
        Of a serial one.
    """

    kind: Kind
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = DEFAULT_BAUD

    @property
    def pymavlink(self) -> str:
        """As pymavlink and MAVProxy want it; for a serial port the device, without its baud."""
        if self.kind == "serial":
            return self.device
        scheme = "tcp" if self.kind == "tcpout" else self.kind
        return f"{scheme}:{self.host}:{self.port}"

    @property
    def mavsdk(self) -> str:
        """As MAVSDK wants it."""
        if self.kind == "serial":
            return f"serial://{self.device}:{self.baud}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}://{host}:{self.port}"

    @property
    def listens(self) -> bool:
        """Whether nothing can be sent before something was heard."""
        return self.kind in {"udpin", "tcpin"}

    def __str__(self) -> str:
        """Return pymavlink's spelling, with the baud."""
        return f"{self.device},{self.baud}" if self.kind == "serial" else self.pymavlink


def parse_endpoint(text: str) -> Endpoint:
    """Read a connection string.

    Raises
    ------
    InputError
        It is none of the spellings above, or its port or baud is out of range.
    """
    text = text.strip()
    if match := _SERIAL.fullmatch(text) or _SERIAL_URL.fullmatch(text):
        baud = int(match["baud"] or DEFAULT_BAUD)
        if not 1 <= baud <= 10_000_000:
            raise _bad(text, f"{baud} baud is no speed of a serial port")
        return Endpoint("serial", device=match["device"], baud=baud)
    match = _NETWORK.fullmatch(text)
    if match is None or match["kind"] not in _KINDS:
        raise _bad(text, "is no connection string")
    kind, host, port = _KINDS[match["kind"]], match["host"].strip("[]"), int(match["port"])
    if not 1 <= port <= 65_535:
        raise _bad(text, f"port {port} is not in 1 to 65535")
    if not host:
        if kind not in {"udpin", "tcpin"}:
            raise _bad(text, "names no host to call")
        host = ANY_HOST
    return Endpoint(kind, host, port)


def _bad(text: str, why: str) -> InputError:
    return InputError([Problem(f"connection {text!r}", f"{why}; {ALLOWED}", "connection")])
