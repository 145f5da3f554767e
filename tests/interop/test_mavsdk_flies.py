"""MAVSDK flies the mock as it would a vehicle: arm, take off, mission start, progress, pause, return."""

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from tests.interop.test_mavsdk import DISCOVERY_S, HOME, mission_rows, raw_items
from tests.sitl_mock.process import mock, port_of

mavsdk = pytest.importorskip("mavsdk")

SPEED = 20
WAIT_S = 30.0
HOLD, MISSION, RETURN = 3, 4, 5
"""MAVSDK's FlightMode."""


@dataclass
class Drone:
    firmware: str
    raw: Any
    action: Any
    telemetry: Any

    def wait_for(self, happens: Callable[[], bool]) -> None:
        """Wait until something is so; what was being waited for is in the traceback."""
        until = time.monotonic() + WAIT_S
        while not happens():
            assert time.monotonic() < until, f"not within {WAIT_S} s"
            time.sleep(0.05)


@pytest.fixture(params=["ardupilot", "px4"])
def drone(request: pytest.FixtureRequest) -> Iterator[Drone]:
    """MAVSDK with a mock whose time goes twenty times as fast."""
    from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
    from mavsdk.plugins.action import Action
    from mavsdk.plugins.mission_raw import MissionRaw
    from mavsdk.plugins.telemetry import Telemetry

    firmware = request.param
    log_subscribe(lambda *_: True)
    ground = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    ends = ["--conn", "udpin:127.0.0.1:0", "--home", HOME, "--speed", str(SPEED)]
    with mock("--firmware", firmware, *ends) as (_, (line,)), Mavsdk(ground) as sdk:
        sdk.add_any_connection(f"udpout://127.0.0.1:{port_of(line)}")
        system = sdk.first_autopilot(DISCOVERY_S)
        assert system is not None
        flown = Drone(firmware, MissionRaw(system), Action(system), Telemetry(system))
        # ArduPilot sends nothing unasked; MAVSDK's name for its SYS_STATUS is rc_status.
        asked = ("position", "home", "gps_info", "rc_status", "in_air", "landed_state")
        for name in asked if firmware == "ardupilot" else ():
            getattr(flown.telemetry, f"set_rate_{name}")(2.0)
        yield flown
        for plugin in (flown.raw, flown.action, flown.telemetry):
            plugin.destroy()


def test_mavsdk_flies_a_mission_from_arming_to_disarming(drone: Drone) -> None:
    """The vehicle is found armable; progress counts up to the total; it comes home by itself and is disarmed."""
    drone.wait_for(drone.telemetry.health_all_ok)
    rows = mission_rows(drone.firmware)
    rows = [*rows[: 6 if drone.firmware == "px4" else 7], rows[-1]]
    drone.raw.upload_mission(raw_items(rows))
    drone.wait_for(lambda: drone.raw.mission_progress().total == len(rows))
    drone.action.arm()
    drone.wait_for(drone.telemetry.armed)
    if drone.firmware == "ardupilot":
        drone.action.takeoff()  # its mission start is a mode change, which does not take off
        drone.wait_for(lambda: drone.telemetry.position().relative_altitude_m > 1)
    drone.raw.start_mission()
    drone.wait_for(lambda: drone.telemetry.flight_mode() == MISSION)
    seen, highest, paused = [], 0.0, False

    def landed() -> bool:
        nonlocal highest, paused
        seen.append(drone.raw.mission_progress().current)
        highest = max(highest, drone.telemetry.position().relative_altitude_m)
        if seen[-1] == 4 and not paused:
            paused = True
            drone.raw.pause_mission()
            drone.wait_for(lambda: drone.telemetry.flight_mode() == HOLD)
            drone.raw.start_mission()
            drone.wait_for(lambda: drone.telemetry.flight_mode() == MISSION)
        return not drone.telemetry.armed()

    drone.wait_for(landed)
    assert paused
    assert highest == pytest.approx(30, abs=2.5)
    counted = [key for key, _ in itertools.groupby(seen)]
    assert counted == sorted(counted)
    assert counted[-1] == len(rows)
    assert drone.raw.is_mission_finished()
    home = drone.telemetry.position()
    assert home.latitude_deg == pytest.approx(37.4, abs=2e-5)
    assert abs(home.relative_altitude_m) < 0.5


def test_mavsdk_takes_off_goes_somewhere_holds_and_returns(drone: Drone) -> None:
    """Without a mission."""
    drone.wait_for(drone.telemetry.health_all_ok)
    drone.action.set_takeoff_altitude(12.0)
    drone.action.arm()
    drone.action.takeoff()
    drone.wait_for(lambda: drone.telemetry.position().relative_altitude_m > 11)
    drone.action.goto_location(37.4003, -122.1, 30.0, 0.0)
    drone.wait_for(lambda: drone.telemetry.position().latitude_deg > 37.40025)
    if drone.firmware == "px4":  # ArduPilot's hold is LOITER, which sinks with nobody at the stick
        drone.action.hold()
        drone.wait_for(lambda: drone.telemetry.flight_mode() == HOLD)
    drone.action.return_to_launch()
    drone.wait_for(lambda: drone.telemetry.flight_mode() == RETURN)
    drone.wait_for(lambda: not drone.telemetry.armed())
    assert drone.telemetry.position().latitude_deg == pytest.approx(37.4, abs=2e-5)


@pytest.mark.parametrize("drone", ["ardupilot"], indirect=True)
def test_mavsdk_is_refused_to_arm_in_auto(drone: Drone) -> None:
    """PX4 is never asked: MAVSDK switches it to hold first."""
    from mavsdk.plugins.action import ActionError

    drone.wait_for(drone.telemetry.health_all_ok)
    drone.raw.upload_mission(raw_items(mission_rows("ardupilot")))
    drone.raw.start_mission()
    drone.wait_for(lambda: drone.telemetry.flight_mode() == MISSION)
    with pytest.raises(ActionError):
        drone.action.arm()
    assert not drone.telemetry.armed()
