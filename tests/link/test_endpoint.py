"""Connection strings: both spellings, each way, and what is none."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.link.endpoint import Endpoint, parse_endpoint


@pytest.mark.parametrize(
    ("text", "endpoint", "pymavlink", "mavsdk"),
    [
        (
            "udp:127.0.0.1:14550",
            Endpoint("udpin", "127.0.0.1", 14550),
            "udpin:127.0.0.1:14550",
            "udpin://127.0.0.1:14550",
        ),
        (
            "udpin:0.0.0.0:14550",
            Endpoint("udpin", "0.0.0.0", 14550),
            "udpin:0.0.0.0:14550",
            "udpin://0.0.0.0:14550",
        ),
        ("udpin::14550", Endpoint("udpin", "0.0.0.0", 14550), "udpin:0.0.0.0:14550", "udpin://0.0.0.0:14550"),
        (
            "udpout:host.lan:14551",
            Endpoint("udpout", "host.lan", 14551),
            "udpout:host.lan:14551",
            "udpout://host.lan:14551",
        ),
        (
            "tcp:127.0.0.1:5760",
            Endpoint("tcpout", "127.0.0.1", 5760),
            "tcp:127.0.0.1:5760",
            "tcpout://127.0.0.1:5760",
        ),
        (
            "tcpin:0.0.0.0:5760",
            Endpoint("tcpin", "0.0.0.0", 5760),
            "tcpin:0.0.0.0:5760",
            "tcpin://0.0.0.0:5760",
        ),
        ("udp://:14540", Endpoint("udpin", "0.0.0.0", 14540), "udpin:0.0.0.0:14540", "udpin://0.0.0.0:14540"),
        (
            "udpin://0.0.0.0:14540",
            Endpoint("udpin", "0.0.0.0", 14540),
            "udpin:0.0.0.0:14540",
            "udpin://0.0.0.0:14540",
        ),
        (
            "udpout://10.0.0.2:14540",
            Endpoint("udpout", "10.0.0.2", 14540),
            "udpout:10.0.0.2:14540",
            "udpout://10.0.0.2:14540",
        ),
        ("tcpin://:5760", Endpoint("tcpin", "0.0.0.0", 5760), "tcpin:0.0.0.0:5760", "tcpin://0.0.0.0:5760"),
        ("tcpout://sim:5760", Endpoint("tcpout", "sim", 5760), "tcp:sim:5760", "tcpout://sim:5760"),
        ("udpin:[::1]:14550", Endpoint("udpin", "::1", 14550), "udpin:::1:14550", "udpin://[::1]:14550"),
        (
            "/dev/ttyUSB0,57600",
            Endpoint("serial", device="/dev/ttyUSB0", baud=57600),
            "/dev/ttyUSB0",
            "serial:///dev/ttyUSB0:57600",
        ),
        (
            "/dev/ttyACM0",
            Endpoint("serial", device="/dev/ttyACM0", baud=57600),
            "/dev/ttyACM0",
            "serial:///dev/ttyACM0:57600",
        ),
        ("COM3,115200", Endpoint("serial", device="COM3", baud=115200), "COM3", "serial://COM3:115200"),
        (
            "serial:///dev/ttyUSB0:921600",
            Endpoint("serial", device="/dev/ttyUSB0", baud=921600),
            "/dev/ttyUSB0",
            "serial:///dev/ttyUSB0:921600",
        ),
    ],
)
def test_both_spellings_mean_the_same_and_are_written_out_again(text, endpoint, pymavlink, mavsdk):
    assert parse_endpoint(text) == endpoint
    assert (endpoint.pymavlink, endpoint.mavsdk) == (pymavlink, mavsdk)
    assert parse_endpoint(endpoint.mavsdk) == endpoint


@pytest.mark.parametrize(
    "text",
    [
        "",
        "14550",
        "127.0.0.1:14550",
        "udp:127.0.0.1",
        "udp:127.0.0.1:0",
        "udp:127.0.0.1:65536",
        "udp:127.0.0.1:-1",
        "udpout::14550",
        "tcp://:5760",
        "udpbcast:10.0.0.255:14550",
        "raw://",
        "http://127.0.0.1:80",
        "/dev/ttyUSB0,0",
        "/dev/ttyUSB0,fast",
        "udpin:a:b:1",
        "udp:127.0.0.1:１４５５０",
    ],
)
def test_what_is_no_connection_string_is_refused_with_what_is_allowed(text):
    with pytest.raises(InputError, match="udpout:HOST:PORT"):
        parse_endpoint(text)


@given(st.text(max_size=40))
def test_no_text_does_anything_but_parse_or_be_refused(text):
    with contextlib.suppress(InputError):
        parse_endpoint(text)


@pytest.mark.parametrize("listens", [True, False])
def test_only_listeners_must_hear_before_they_speak(listens):
    texts = (
        ["udp:1.2.3.4:5", "tcpin:1.2.3.4:5"]
        if listens
        else ["udpout:1.2.3.4:5", "tcp:1.2.3.4:5", "COM3,57600"]
    )
    assert {parse_endpoint(text).listens for text in texts} == {listens}
