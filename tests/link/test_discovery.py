"""Which vehicle, if any: heartbeats of all sorts on one line."""

import pytest

from mavplan.errors import InputError, NoLinkError
from mavplan.link.discovery import Discovery, Vehicle, refusal
from mavplan.link.protocol import Address
from tests.link.script import US, VEHICLE, heartbeat, request


def listen(*heard, system=None, until=10.0):
    discovery = Discovery(US, system, "udp:x:1", now=0.0, deadline=10.0)
    for at, message in heard:
        discovery.receive(message, at)
        discovery.tick(at)
    discovery.tick(until)
    return discovery.outcome


def test_an_autopilots_heartbeat_is_found_and_others_get_time_to_be_heard():
    discovery = Discovery(US, None, now=0.0, deadline=10.0)
    discovery.receive(heartbeat(), 1.0)
    discovery.tick(2.4)
    assert discovery.outcome is None
    discovery.tick(discovery.next_timer())
    assert discovery.outcome == Vehicle(VEHICLE, 3, 2, armed=False)


def test_a_chosen_system_is_taken_at_once():
    discovery = Discovery(US, 1, now=0.0, deadline=10.0)
    discovery.receive(heartbeat(), 1.0)
    discovery.tick(1.0)
    assert discovery.outcome.address == VEHICLE


@pytest.mark.parametrize(
    "message",
    [
        heartbeat(US, autopilot=8, kind=6),
        heartbeat(Address(254, 190), autopilot=8, kind=6),
        heartbeat(Address(254, 1), autopilot=3, kind=6),
        heartbeat(Address(1, 100), autopilot=8, kind=30),
        heartbeat(Address(2, 1), autopilot=3, kind=5),
        heartbeat(Address(1, 191), autopilot=8, kind=18),
        heartbeat(Address(0, 1)),
        request(0),
    ],
)
def test_ground_stations_cameras_and_trackers_are_no_vehicle(message):
    outcome = listen((1.0, message))
    assert isinstance(outcome, NoLinkError)
    assert "udp:x:1" in str(outcome)


def test_two_vehicles_without_a_choice_are_an_error_that_names_both():
    outcome = listen((1.0, heartbeat()), (1.8, heartbeat(Address(7, 1))))
    assert isinstance(outcome, InputError)
    assert "systems 1, 7" in str(outcome)
    assert listen((1.0, heartbeat()), (1.8, heartbeat(Address(7, 1))), system=7).address.system == 7


def test_a_second_autopilot_of_the_same_system_is_not_another_vehicle():
    assert listen((1.0, heartbeat(Address(1, 2))), (1.1, heartbeat())).address == VEHICLE


def test_silence_and_a_missing_system_are_no_link_and_say_what_was_heard():
    assert isinstance(listen(), NoLinkError)
    outcome = listen((1.0, heartbeat()), system=9)
    assert "system 9" in str(outcome)
    assert "system 1" in str(outcome)


def vehicle(kind=2, autopilot=3):
    return Vehicle(VEHICLE, autopilot, kind, armed=False)


@pytest.mark.parametrize("kind", [2, 3, 13, 14, 15, 29, 35])
def test_every_multirotor_may_have_a_mission(kind):
    assert refusal(vehicle(kind), "ardupilot") is None


@pytest.mark.parametrize(
    ("kind", "word"), [(1, "fixed wing"), (10, "rover"), (4, "helicopter"), (20, "VTOL"), (77, "77")]
)
def test_what_is_no_multirotor_is_refused(kind, word):
    assert word in str(refusal(vehicle(kind), "ardupilot"))


def test_the_other_firmware_and_unknown_ones_are_refused():
    assert "PX4" in str(refusal(vehicle(), "px4"))
    assert refusal(vehicle(autopilot=12), "px4") is None
    assert refusal(vehicle(autopilot=12), None) is None
    assert "autopilot 18" in str(refusal(vehicle(autopilot=18), None))
