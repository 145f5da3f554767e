"""MAVSDK as a foreign ground station: the mock must satisfy it, over UDP and TCP, with both firmwares."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import pytest

from tests.sitl_mock.process import mock, port_of

mavsdk = pytest.importorskip("mavsdk")

LAT_E7, LON_E7 = 374_000_000, -1_221_000_000
HOME = "37.4,-122.1,10"
DISCOVERY_S = 10.0


def raw_items(rows: list[tuple[float, ...]], kind: int = 0) -> list[Any]:
    """Rows of frame, command, four parameters, x, y, z."""
    from mavsdk.plugins.mission_raw import MissionItem

    items = []
    for seq, (frame, command, *params, x, y, z) in enumerate(rows):
        head = (seq, int(frame), int(command), int(seq == 0), 1)
        items.append(MissionItem(*head, *(float(param) for param in params), int(x), int(y), float(z), kind))
    return items


def mission_rows(firmware: str) -> list[tuple[float, ...]]:
    ardupilot = firmware == "ardupilot"
    here = (LAT_E7, LON_E7)
    heading = 0.0 if ardupilot else math.nan
    rows: list[tuple[float, ...]] = [(0, 16, 0, 0, 0, 0, *here, 10.0)] if ardupilot else []
    rows += [(3, 22, 0, 0, 0, heading, *here, 30.0), (2, 178, 1, 5, -1, 0, 0, 0, 0)]
    for north in range(0, 90_000, 9_000):
        stop = (heading, LAT_E7 + north, LON_E7, 30.0)
        rows += [(3, 16, 0, 0, 0, *stop), (3, 19, 8, 0, 0, *stop)]
    return [*rows, (2, 20, 0, 0, 0, 0, 0, 0, 0)]


@pytest.fixture(params=itertools.product(["ardupilot", "px4"], ["udp", "tcp"]), ids="-".join)
def vehicle(request: pytest.FixtureRequest) -> Iterator[tuple[str, Any]]:
    """Firmware and MAVSDK's MissionRaw of a mock process."""
    from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
    from mavsdk.plugins.mission_raw import MissionRaw

    firmware, transport = request.param
    log_subscribe(lambda *_: True)
    ends = ["--conn", f"{transport}in:127.0.0.1:0", "--home", HOME]
    ground = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with mock("--firmware", firmware, *ends) as (_, (line,)), Mavsdk(ground) as sdk:
        sdk.add_any_connection(f"{transport}out://127.0.0.1:{port_of(line)}")
        drone = sdk.first_autopilot(DISCOVERY_S)
        assert drone is not None, f"MAVSDK did not find the mock: {line}"
        raw = MissionRaw(drone)
        yield firmware, raw
        raw.destroy()


def test_mavsdk_uploads_downloads_and_clears(vehicle: tuple[str, Any]) -> None:
    """What it reads back is what it sent, but for what the firmware does not keep."""
    firmware, raw = vehicle
    sent = raw_items(mission_rows(firmware))
    raw.upload_mission(sent)
    read = raw.download_mission()
    assert [(i.seq, i.command, i.x, i.y, i.z) for i in read] == [
        (i.seq, i.command, i.x, i.y, i.z) for i in sent
    ]
    holds = [i.param1 for i in read if i.command == 19]
    assert holds == [8.0] * 10
    assert [i.current for i in read] == [int(firmware == "px4" and i.seq == 0) for i in read]
    raw.clear_mission()
    # MAVSDK clears ArduPilot by uploading home alone, PX4 by MISSION_CLEAR_ALL.
    assert len(raw.download_mission()) == (1 if firmware == "ardupilot" else 0)


def test_mavsdk_uploads_and_downloads_a_fence_and_rally_points(vehicle: tuple[str, Any]) -> None:
    """Four vertices and two points."""
    firmware, raw = vehicle
    corners = [(-9000, -9000), (19000, -9000), (19000, 9000), (-9000, 9000)]
    frame = 0 if firmware == "ardupilot" else 5
    fence = raw_items([(frame, 5001, 4, 0, 0, 0, LAT_E7 + x, LON_E7 + y, 0) for x, y in corners], 1)
    raw.upload_geofence(fence)
    assert [(i.command, i.param1, i.x, i.y) for i in raw.download_geofence()] == [
        (i.command, i.param1, i.x, i.y) for i in fence
    ]
    rally = raw_items([(3, 5100, 0, 0, 0, 0, LAT_E7 + n, LON_E7, 30) for n in (0, 900)], 2)
    raw.upload_rally_points(rally)
    assert [(i.command, i.x, i.z) for i in raw.download_rallypoints()] == [
        (i.command, i.x, i.z) for i in rally
    ]


def test_mavsdk_hears_a_refusal(vehicle: tuple[str, Any]) -> None:
    """A command the firmware does not know is an error there too."""
    from mavsdk.plugins.mission_raw import MissionRawError, MissionRawResult

    firmware, raw = vehicle
    rows = mission_rows(firmware)
    rows[3] = (3, 31000, 0, 0, 0, 0, LAT_E7, LON_E7, 30.0)
    with pytest.raises(MissionRawError) as refused:
        raw.upload_mission(raw_items(rows))
    assert refused.value.result == MissionRawResult.UNSUPPORTED


def test_mavsdk_follows_mission_progress(vehicle: tuple[str, Any]) -> None:
    """The total is that of its upload; the mission is not finished."""
    firmware, raw = vehicle
    rows = mission_rows(firmware)
    raw.upload_mission(raw_items(rows))
    assert raw.mission_progress().total == len(rows)
    assert not raw.is_mission_finished()
