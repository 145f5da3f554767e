"""Connection strings in both spellings."""

import pytest

from sitl_mock.conn import Connection, parse_connection


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("udp:127.0.0.1:14550", ("udpin", "127.0.0.1", 14550)),
        ("udpin:0.0.0.0:14550", ("udpin", "0.0.0.0", 14550)),
        ("udpout:10.0.0.1:1", ("udpout", "10.0.0.1", 1)),
        ("tcp:localhost:5760", ("tcpout", "localhost", 5760)),
        ("tcpin:127.0.0.1:0", ("tcpin", "127.0.0.1", 0)),
        ("udpin://127.0.0.1:14540", ("udpin", "127.0.0.1", 14540)),
        ("udpout://host:14540", ("udpout", "host", 14540)),
        ("tcpin://:5760", ("tcpin", "127.0.0.1", 5760)),
        ("tcpout://127.0.0.1:5760", ("tcpout", "127.0.0.1", 5760)),
        ("udpin::14550", ("udpin", "127.0.0.1", 14550)),
        ("udpin:14550", ("udpin", "127.0.0.1", 14550)),
        ("UDPIN:14550", ("udpin", "127.0.0.1", 14550)),
    ],
)
def test_both_spellings_are_read(text: str, expected: tuple[str, str, int]) -> None:
    """And a host that is missing is this machine alone."""
    assert parse_connection(text) == Connection(*expected)


@pytest.mark.parametrize(
    "text", ["", "udp", "14550", "serial:/dev/ttyUSB0", "udpin:127.0.0.1", "udpin:1.2.3.4:70000"]
)
@pytest.mark.parametrize("suffix", ["", ":x", ":-1"])
def test_anything_else_is_told_in_a_sentence(text: str, suffix: str) -> None:
    """With the text itself in it."""
    with pytest.raises(ValueError, match="connection"):
        parse_connection(text + suffix)


@pytest.mark.parametrize("text", ["udpout:127.0.0.1:0", "tcp:127.0.0.1:0"])
def test_who_calls_needs_a_port(text: str) -> None:
    """Port 0 is for listeners."""
    with pytest.raises(ValueError, match="needs a port"):
        parse_connection(text)


def test_what_is_printed_can_be_read_again() -> None:
    """``str`` and `parse_connection` are inverse."""
    connection = Connection("tcpin", "127.0.0.1", 5760)
    assert parse_connection(str(connection)) == connection
