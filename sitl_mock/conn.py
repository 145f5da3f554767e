"""Connection strings: pymavlink's and MAVSDK's spellings of a UDP or TCP end.

``udp:HOST:PORT`` and ``udpin:…`` listen, ``udpout:…`` calls; ``tcp:…`` and ``tcpout:…`` call, ``tcpin:…`` listens.
All are taken with ``://`` too. A host that is missing or empty is this machine alone.
"""

from dataclasses import dataclass

LOOPBACK = "127.0.0.1"
KINDS = {
    "udp": "udpin",
    "udpin": "udpin",
    "udpout": "udpout",
    "tcp": "tcpout",
    "tcpin": "tcpin",
    "tcpout": "tcpout",
}
LISTENING = frozenset({"udpin", "tcpin"})


@dataclass(frozen=True, slots=True)
class Connection:
    """One end: `kind` is ``udpin``, ``udpout``, ``tcpin`` or ``tcpout``; port 0 lets the system choose."""

    kind: str
    host: str
    port: int

    @property
    def listens(self) -> bool:
        """Whether others call on this end."""
        return self.kind in LISTENING

    def __str__(self) -> str:
        """``kind:host:port``, which every reader of such strings takes."""
        return f"{self.kind}:{self.host}:{self.port}"


def parse_connection(text: str) -> Connection:
    """Read a connection string.

    Raises
    ------
    ValueError
        With a sentence that says what is wrong with it.
    """
    scheme, colon, rest = text.partition(":")
    kind = KINDS.get(scheme.lower())
    if not colon or kind is None:
        known = ", ".join(f"{name}:" for name in KINDS)
        raise ValueError(f"connection {text!r} must begin with one of {known}")
    host, _, port_text = rest.removeprefix("//").rpartition(":")
    if not port_text.isascii() or not port_text.isdigit() or int(port_text) > 65535:
        raise ValueError(
            f"connection {text!r} must end with a port from 0 to 65535, as in {scheme}:{LOOPBACK}:14550"
        )
    port = int(port_text)
    if port == 0 and kind not in LISTENING:
        raise ValueError(f"connection {text!r} calls on somebody and needs a port from 1 to 65535")
    return Connection(kind, host or LOOPBACK, port)
