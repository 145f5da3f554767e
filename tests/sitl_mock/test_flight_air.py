"""Wind, battery and what may go wrong in the air; both firmwares."""

import itertools
import math

import pytest

from sitl_mock.flight.air import Wind
from sitl_mock.flight.faults import AtItem, FlightFaults

from .pilot_rig import RETURN, UNLIM, PilotRig, results, stop, takeoff, waypoint
from .rig import command

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
FIRST = {"ardupilot": 1, "px4": 0}
"""Number of the TAKEOFF item."""


def in_flight(firmware: str, *rows: object, **options: object) -> PilotRig:
    rig = PilotRig(firmware, **options)
    rig.load(*rows)  # type: ignore[arg-type]
    rig.start()
    return rig


def set_parameter(rig: PilotRig, name: str, value: float) -> None:
    rig.pilot.parameters.put(name, value)


def test_a_head_wind_of_6_cuts_10_to_5_point_8() -> None:
    """As measured; a tail wind does not make it faster than its limit."""
    head, tail = (
        in_flight("ardupilot", takeoff(), stop(300, 0, 1), RETURN, wind=Wind(6.0, from_deg))
        for from_deg in (0.0, 180.0)
    )
    for rig, fastest in ((head, 5.8), (tail, 10.0)):
        rig.run(45)
        assert rig.pilot.body.at(32.0)[1][0] == pytest.approx(fastest, abs=0.2)


@BOTH
def test_a_wind_beyond_its_strength_carries_it_away(firmware: str) -> None:
    rig = in_flight(firmware, takeoff(), stop(50, 0, 100), RETURN, wind=Wind(14.0, 270.0))
    rig.run(120)
    assert rig.place()[1] > 150


@BOTH
def test_a_battery_runs_down_and_the_failsafe_brings_it_home(firmware: str) -> None:
    """Remaining energy is told; at the threshold it returns, says so, and lands."""
    rig = in_flight(firmware, takeoff(), (UNLIM, 40.0, 0.0, 30.0, 0.0), RETURN, battery_wh=80.0)
    rig.send(command(511, 1, 1e6), command(511, 147, 1e6))
    rig.fly(2400)
    assert not rig.state.armed
    assert rig.off(0, 0) < 2.5
    told = [message.battery_remaining for _, message in rig.of("SYS_STATUS")]
    assert told[0] == 100
    assert told == sorted(told, reverse=True)
    assert 0 < told[-1] < 10
    said = {"ardupilot": "Battery Failsafe", "px4": "Failsafe activated"}[firmware]
    assert said in rig.texts()


@BOTH
def test_an_empty_battery_brings_it_down_where_it_is_and_it_never_arms_again(firmware: str) -> None:
    rig = PilotRig(firmware, battery_wh=12.0)
    set_parameter(rig, {"ardupilot": "BATT_FS_LOW_ACT", "px4": "COM_LOW_BAT_ACT"}[firmware], 0)
    rig.load(takeoff(), (UNLIM, 80.0, 0.0, 30.0, 0.0), RETURN)
    rig.start()
    rig.fly(2400)
    assert not rig.state.armed
    assert rig.off(80, 0) < 2.5
    assert rig.place()[2] == 0
    if firmware == "ardupilot":
        rig.send(command(176, 1, 4))
    assert results(rig.send(command(400, 1)))[0] != 0


@BOTH
def test_without_a_battery_it_does_not_run_down(firmware: str) -> None:
    rig = in_flight(firmware, takeoff(), (UNLIM, 40.0, 0.0, 30.0, 0.0), RETURN)
    rig.send(command(511, 1, 1e6))
    rig.run(900)
    assert {message.battery_remaining for _, message in rig.of("SYS_STATUS")} == {100}


@BOTH
def test_energy_used_is_that_of_the_model(firmware: str) -> None:
    """Five minutes of hover cost 168.5 W / 0.7 for a vehicle of 20 N, twice that for one of 40 N."""
    used = []
    for mass_kg in (20 / 9.80665, 40 / 9.80665):
        rig = in_flight(
            firmware, takeoff(), (UNLIM, 1.0, 0.0, 30.0, 0.0), RETURN, battery_wh=500.0, mass_kg=mass_kg
        )
        rig.run(120)
        before = rig.pilot.battery.used_wh
        rig.run(300)
        used.append(rig.pilot.battery.used_wh - before)
    assert used[0] == pytest.approx((79.86 + 88.63) / 0.7 * 300 / 3600, rel=0.01)
    assert used[1] == pytest.approx(2 * used[0], rel=0.01)


@BOTH
def test_a_hold_can_be_cut_by_half(firmware: str) -> None:
    first = FIRST[firmware]
    whole = in_flight(firmware, takeoff(), stop(50, 0, 20), stop(50, 50, 1), RETURN)
    cut = in_flight(
        firmware, takeoff(), stop(50, 0, 20), stop(50, 50, 1), RETURN, faults=FlightFaults(hold_cut=first + 1)
    )
    for rig in (whole, cut):
        rig.fly()
    assert whole.reached()[first + 1] - cut.reached()[first + 1] == pytest.approx(10, abs=0.1)


@BOTH
def test_a_gust_pushes_it_200_m_off_and_the_hold_goes_on_meanwhile(firmware: str) -> None:
    """It comes back, and the legs after it begin where it is."""
    first = FIRST[firmware]
    fault = FlightFaults(gust=AtItem(first + 1, 200.0))
    rows = (takeoff(), stop(50, 0, 10), stop(50, 50, 60), stop(0, 50, 1), RETURN)
    rig, calm = in_flight(firmware, *rows, faults=fault), in_flight(firmware, *rows)
    farthest = 0.0
    while first + 2 not in rig.reached() and rig.now < 600:
        rig.run(0.5)
        farthest = max(farthest, rig.off(50, 0))
    assert 180 < farthest < 260
    assert rig.off(50, 50) < 4
    calm.fly()
    assert rig.reached()[first + 1] == pytest.approx(calm.reached()[first + 1], abs=0.3)
    assert rig.reached()[first + 2] > calm.reached()[first + 2] + 10


@BOTH
def test_positions_can_stop_for_a_while(firmware: str) -> None:
    fault = FlightFaults(position_lost=AtItem(FIRST[firmware] + 1, 15.0))
    rig = in_flight(firmware, takeoff(), stop(50, 0, 30), RETURN, faults=fault)
    rig.fly()
    times = [at for at, _ in rig.of("GLOBAL_POSITION_INT")]
    gaps = [later - earlier for earlier, later in itertools.pairwise(times)]
    assert max(gaps) == pytest.approx(15, abs=0.6)
    assert sorted(gaps)[-2] < 0.6


@BOTH
def test_half_of_the_energy_can_be_lost(firmware: str) -> None:
    fault = FlightFaults(battery_drop=FIRST[firmware] + 1)
    rig = in_flight(firmware, takeoff(), stop(50, 0, 30), RETURN, faults=fault, battery_wh=100.0)
    rig.until(lambda: rig.off(50, 0) <= 6, 0.5)
    before = rig.pilot.battery.left
    rig.run(5)
    assert before / 2 - 0.02 < rig.pilot.battery.left < before / 2


@BOTH
def test_a_crash_ends_the_flight_on_the_ground(firmware: str) -> None:
    first = FIRST[firmware]
    fault = FlightFaults(crash=first + 1)
    rig = in_flight(firmware, takeoff(), waypoint(50, 0, 5), stop(50, 50), RETURN, faults=fault)
    rig.fly()
    assert not rig.state.armed
    rig.run(10)
    assert rig.place()[2] == 0
    assert rig.off(50, 0) < 20
    assert not rig.state.flying
    assert list(rig.reached()) == [first]


@BOTH
def test_the_same_seed_gives_the_same_flight(firmware: str) -> None:
    flights = []
    for seed in (1, 1, 2):
        rig = in_flight(firmware, takeoff(), stop(50, 0), RETURN, seed=seed)
        rig.fly()
        flights.append([(m.lat, m.lon, m.alt) for _, m in rig.of("GLOBAL_POSITION_INT")])
    assert flights[0] == flights[1] != flights[2]


def test_a_fence_that_is_enabled_turns_ardupilot_home() -> None:
    """Its radius of 150 m; FENCE_ENABLE is 0 by default, and then nothing happens."""
    for enabled in (0, 1):
        rig = PilotRig("ardupilot")
        set_parameter(rig, "FENCE_ENABLE", enabled)
        rig.load(takeoff(), stop(250, 0, 5), RETURN)
        rig.start()
        rig.fly()
        assert (2 in rig.reached()) == (not enabled)
        assert rig.off(0, 0) < 1
        assert rig.state.custom_mode == (6 if enabled else 3)


@pytest.mark.parametrize(("action", "mode"), [(2, 3), (3, 5), (5, 6)])
def test_px4_does_what_gf_action_says(action: int, mode: int) -> None:
    """Hold, return or land beyond GF_MAX_HOR_DIST."""
    rig = PilotRig("px4")
    set_parameter(rig, "GF_ACTION", action)
    set_parameter(rig, "GF_MAX_HOR_DIST", 100)
    rig.load(takeoff(), stop(250, 0, 5), RETURN)
    rig.start()
    rig.run(120)
    assert rig.state.custom_mode == (4 << 16) | (mode << 24)
    assert 1 not in rig.reached()
    assert math.hypot(*rig.place()[:2]) < 115
