"""MAVProxy as a foreign ground station: ``wp load`` and ``wp list`` against the mock, with both firmwares."""

from pathlib import Path

import pytest

from tests.interop.mavproxy import MAVPROXY, MavProxy
from tests.sitl_mock.process import mock, port_of

pytestmark = pytest.mark.skipif(
    not MAVPROXY.is_file(), reason="no .venv-mavproxy: scripts/mavproxy-env.sh makes it"
)

WAYPOINTS = {
    "ardupilot": [
        "0 1 0 16 0 0 0 0 37.4000000 -122.1000000 10 1",
        "1 0 3 22 0 0 0 0 37.4000000 -122.1000000 30 1",
        "2 0 3 16 0 0 0 0 37.4009000 -122.1000000 30 1",
        "3 0 3 19 8 0 0 0 37.4009000 -122.1000000 30 1",
        "4 0 0 20 0 0 0 0 0 0 0 1",
    ],
    "px4": [
        "0 1 3 22 0 0 0 0 37.4000000 -122.1000000 30 1",
        "1 0 3 16 0 0 0 0 37.4009000 -122.1000000 30 1",
        "2 0 3 19 8 0 0 0 37.4009000 -122.1000000 30 1",
        "3 0 2 20 0 0 0 0 0 0 0 1",
    ],
}


@pytest.mark.parametrize("transport", ["udp", "tcp"])
@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_mavproxy_loads_and_lists_a_mission(firmware: str, transport: str, tmp_path: Path) -> None:
    """Every item it lists, read back from the mock, is the one of the file."""
    rows = WAYPOINTS[firmware]
    file = tmp_path / "m.waypoints"
    file.write_text("QGC WPL 110\n" + "".join("\t".join(row.split()) + "\n" for row in rows))
    ends = ["--conn", f"{transport}in:127.0.0.1:0", "--home", "37.4,-122.1,10"]
    with mock("--firmware", firmware, *ends) as (_, (line,)):
        scheme = {"udp": "udpout", "tcp": "tcp"}[transport]
        proxy = MavProxy(f"{scheme}:127.0.0.1:{port_of(line)}", tmp_path)
        try:
            proxy.wait_for("online system 1")
            proxy.type(f"wp load {file}")
            proxy.wait_for("Got MISSION_ACK: TYPE_MISSION: ACCEPTED")
            proxy.type("wp list")
            proxy.wait_for(f"Requesting {len(rows)} waypoints")
            printed = proxy.wait_for("\n20 ")
        finally:
            proxy.close()
    listed = [entry.split() for entry in printed.splitlines() if " p1=" in entry]
    sent = [row.split() for row in rows]
    assert [(int(e[0]), float(e[2]), float(e[3]), float(e[4]), e[5]) for e in listed] == [
        (int(s[3]), float(s[8]), float(s[9]), float(s[10]), f"p1={float(s[4])}") for s in sent
    ]


START = {
    "ardupilot": ["mode guided", "arm throttle", "mode auto", "long MAV_CMD_MISSION_START 0 0 0 0 0 0 0"],
    "px4": ["long MAV_CMD_MISSION_START 0 0 0 0 0 0 0"],
}
"""MAVProxy's own ``mode`` does not know PX4's modes of two numbers."""
SAYS = {
    "ardupilot": [
        "ARM_DISARM: ACCEPTED",
        "ARMED",
        "Mission: 1 Takeoff",
        "waypoint 2",
        "Mission: 4 RTL",
        "DISARMED",
    ],
    "px4": ["Armed by mission start", "ARMED", "Mode MISSION", "RTL: land at destination", "DISARMED"],
}


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_mavproxy_flies_a_mission(firmware: str, tmp_path: Path) -> None:
    """Loaded, armed, started and watched down to the ground; the mock's time goes ten times as fast."""
    file = tmp_path / "m.waypoints"
    file.write_text("QGC WPL 110\n" + "".join("\t".join(row.split()) + "\n" for row in WAYPOINTS[firmware]))
    ends = ["--conn", "udpin:127.0.0.1:0", "--home", "37.4,-122.1,10", "--speed", "10"]
    with mock("--firmware", firmware, *ends) as (_, (line,)):
        proxy = MavProxy(f"udpout:127.0.0.1:{port_of(line)}", tmp_path, "wp,cmdlong,misc,arm,mode")
        try:
            proxy.wait_for("online system 1")
            proxy.type(f"wp load {file}")
            proxy.wait_for("Got MISSION_ACK: TYPE_MISSION: ACCEPTED")
            for order, answer in zip(
                START[firmware], ("DO_SET_MODE", "ARM_DISARM", None, None), strict=False
            ):
                proxy.type(order)
                if answer is not None and firmware == "ardupilot":
                    proxy.wait_for(
                        f"COMMAND_ACK: {'COMPONENT_' if 'ARM' in answer else ''}{answer}: ACCEPTED"
                    )
            printed = proxy.wait_for("DISARMED")
        finally:
            proxy.close()
    places = [printed.find(text) for text in SAYS[firmware]]
    assert -1 not in places, printed
    assert places == sorted(places), printed
