"""What a vehicle tells of itself; what it does not tell is None, and never waited for beyond the deadline."""

import pytest
from pymavlink.dialects.v20 import common

from mavplan.errors import NoLinkError, RefusedError
from mavplan.link.info_session import InfoSession
from mavplan.link.modes import capability_names, mode_name, version_words
from mavplan.link.protocol import Address
from tests.link.fenced import arm, fenced
from tests.link.harness import HOME, make_network, run, upload
from tests.link.script import heartbeat

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def info(network, deadline_s=30.0, heard=()):
    session = InfoSession(now=network.clock_s, deadline_s=deadline_s)
    for message in heard:
        session.receive(message, network.clock_s)
    return run(session, network)


@BOTH
def test_everything_it_holds_is_told_without_fetching_the_mission(firmware):
    network = make_network(firmware)
    assert upload(fenced(firmware), network).verified
    arm(network)
    found = info(network).session.info
    assert found.counts == {"mission": 11, "fence": 5, "rally points": 2}
    assert (found.autopilot, found.vehicle, found.armed) == (firmware, Address(1, 1), True)
    assert found.mode == ("HOLD" if firmware == "px4" else "STABILIZE")
    assert found.version == ("1.17.0 alpha" if firmware == "px4" else "4.7.0 development")
    assert {"mission_int", "mission_fence", "mission_rally"} <= set(found.capabilities)
    assert found.home == HOME
    assert found.mission_state == "not started"
    assert (found.mission_id is None) == (firmware == "ardupilot")
    assert found.fence.startswith("in force" if firmware == "px4" else "no fence is in force")


@BOTH
def test_an_empty_vehicle_without_home_holds_nothing(firmware):
    found = info(make_network(firmware, home=None)).session.info
    assert found.counts == {"mission": 0, "fence": 0, "rally points": 0}
    assert found.home is None
    assert found.current_item in {None, 0}


@BOTH
@pytest.mark.parametrize("seed", range(3))
def test_over_a_bad_radio_too(firmware, seed):
    result = info(make_network(firmware, "drop=0.3,dup=0.3", seed=seed))
    assert result.session.info.counts == {"mission": 0, "fence": 0, "rally points": 0}
    assert result.ended_s < 30.0


@BOTH
def test_a_vehicle_that_goes_silent_tells_what_it_told_and_that_it_is_not_all(firmware):
    result = info(make_network(firmware, "silent-after=1s"), deadline_s=8.0)
    found = result.session.info
    assert "incomplete" in [problem.code for problem in found.warnings]
    assert found.counts == {"mission": None, "fence": None, "rally points": None}
    assert (found.version, found.mission_state, found.fence) == (None, None, None)
    assert result.ended_s <= 8.0


def test_other_stations_are_named():
    others = [
        heartbeat(Address(254, 190), autopilot=8, kind=6),
        heartbeat(Address(1, 100), autopilot=8, kind=30),
    ]
    found = info(make_network("px4"), heard=others).session.info
    assert found.others == (
        "system 1, component 100 (MAV_TYPE 30)",
        "system 254, component 190 (a ground station)",
    )


def test_nobody_there_and_a_strange_autopilot():
    assert isinstance(info(make_network("px4", "no-heartbeat")).error, NoLinkError)
    session = InfoSession(now=0.0, deadline_s=5.0, system=1)
    session.receive(heartbeat(autopilot=0), 0.0)
    assert isinstance(session.error, RefusedError)


@pytest.mark.parametrize(
    ("autopilot", "base", "custom", "name"),
    [
        ("ardupilot", 81, 3, "AUTO"),
        ("ardupilot", 81, 99, "mode 99"),
        ("px4", 29, 4 << 16 | 4 << 24, "MISSION"),
        ("px4", 29, 3 << 16, "POSITION"),
        ("px4", 29, 4 << 16 | 77 << 24, "AUTO 77"),
        ("px4", 64, 0, "base mode 64"),
    ],
)
def test_modes_have_the_names_people_know(autopilot, base, custom, name):
    assert mode_name(autopilot, base, custom) == name


def test_versions_and_capabilities_in_words():
    assert version_words(4 << 24 | 6 << 16 | 2 << 8 | 255) == "4.6.2"
    assert version_words(1 << 24 | 15 << 16 | 4 << 8 | 192) == "1.15.4 release candidate"
    assert capability_names(common.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY | 1 << 62) == ("mission_rally",)
