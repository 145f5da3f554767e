"""Cleared means that the vehicle was asked afterwards and holds nothing."""

import pytest

from mavplan.errors import NoLinkError, RefusedError, UncertainError
from mavplan.link.clear_session import ClearSession
from mavplan.link.codec import Codec
from sitl_mock.faults import parse_faults
from tests.link.fenced import arm, fenced, stored
from tests.link.harness import Radio, make_network, run, upload
from tests.link.script import OTHER_STATION, VEHICLE, count

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def full(firmware, faults="", seed=0):
    """A vehicle that holds all three lists, behind a radio with these faults."""
    network = make_network(firmware)
    assert upload(fenced(firmware), network).verified
    radio = Radio(network.autopilot, parse_faults(faults), seed)
    radio.clock_s = network.clock_s
    return radio


def clear(network, kinds=(0, 1, 2), **options):
    return run(ClearSession(kinds, now=network.clock_s, **{"deadline_s": 60.0, **options}), network)


def held(network):
    """Items of each list, ArduPilot's home not counted."""
    home = int(network.autopilot.firmware.name == "ardupilot" and len(stored(network, 0)) > 0)
    return [len(stored(network, 0)) - home, len(stored(network, 1)), len(stored(network, 2))]


@BOTH
def test_all_lists_one_by_one(firmware):
    network = full(firmware)
    result = clear(network)
    assert result.session.report.cleared == ("mission", "fence", "rally points")
    assert held(network) == [0, 0, 0]
    types = [
        m.mission_type
        for _, frame in result.sent
        for m in Codec().decode(frame, 0.0)
        if m.get_type() == "MISSION_CLEAR_ALL"
    ]
    assert types == [0, 1, 2]
    assert result.ended_s < 5.0


@BOTH
@pytest.mark.parametrize(("kind", "left"), [(0, [0, 5, 2]), (1, [11, 0, 2]), (2, [11, 5, 0])])
def test_only_the_list_that_was_named(firmware, kind, left):
    network = full(firmware)
    assert clear(network, (kind,)).session.report is not None
    assert held(network) == left


@BOTH
@pytest.mark.parametrize("faults", ["drop=0.4", "dup=0.5,reorder=0.3", "corrupt=0.1", "first-lost"])
@pytest.mark.parametrize("seed", range(3))
def test_over_a_bad_radio_cleared_is_true(firmware, faults, seed):
    network = full(firmware, faults, seed)
    result = clear(network, deadline_s=120.0)
    assert result.session.report is not None, result.error
    assert held(network) == [0, 0, 0]


def test_ardupilot_in_the_middle_of_its_mission_refuses_and_keeps_it():
    network = full("ardupilot")
    network.autopilot.vehicle.mission_running = True
    result = clear(network, allow_armed=True)
    assert isinstance(result.error, RefusedError)
    assert "while a mission is flown" in str(result.error)
    assert held(network) == [11, 5, 2]


@BOTH
def test_an_armed_vehicle_is_not_cleared_unless_allowed(firmware):
    network = full(firmware)
    arm(network)
    result = clear(network)
    assert isinstance(result.error, RefusedError)
    assert "armed" in str(result.error)
    assert held(network) == [11, 5, 2]
    assert clear(network, allow_armed=True).session.report is not None


@BOTH
def test_a_vehicle_that_says_cleared_and_is_not_is_uncertain(firmware, monkeypatch):
    network = full(firmware)
    if firmware == "ardupilot":
        for found in network.autopilot._missions._lists.values():
            monkeypatch.setattr(type(found), "clear", lambda self: True)
    else:
        monkeypatch.setattr(network.autopilot._missions, "_store", lambda *arguments: None)
    result = clear(network, (1,))
    assert isinstance(result.error, UncertainError)
    assert "holds 5 items" in str(result.error)


@BOTH
def test_a_vehicle_that_goes_silent_is_uncertain_in_time(firmware):
    network = full(firmware, "silent-after=1600ms")
    result = clear(network, deadline_s=12.0)
    assert isinstance(result.error, UncertainError)
    assert result.ended_s <= 12.0


@BOTH
def test_nobody_there_is_no_link(firmware):
    assert isinstance(clear(full(firmware, "no-heartbeat")).error, NoLinkError)


@BOTH
def test_clearing_nothing_is_fine(firmware):
    assert clear(make_network(firmware)).session.report is not None


@BOTH
def test_another_station_that_writes_after_a_list_was_cleared_is_told(firmware):
    network = full(firmware)
    session = ClearSession((0, 1, 2), now=network.clock_s, deadline_s=60.0)
    plain, told = session.tick, []

    def tick(now):
        plain(now)
        if session._cleared == [0] and not told:
            told.append(count(3, to=VEHICLE, by=OTHER_STATION))
            session.receive(told[0], now)

    session.tick = tick
    result = run(session, network)
    assert isinstance(result.error, UncertainError)
    assert "another ground station has written to the mission" in str(result.error)
