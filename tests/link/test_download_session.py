"""Fetching what a vehicle holds, against the mock on a virtual clock."""

import pytest

from mavplan.errors import CheckError, NoLinkError, RefusedError, UncertainError
from mavplan.link.download_session import DownloadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from tests.link.harness import HOME, make_mission, make_network, run, upload

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def fetch(network, deadline_s=120.0, **options):
    return run(DownloadSession(now=network.clock_s, deadline_s=deadline_s, **options), network)


def holding(firmware, faults="", stops=3, **options):
    """A vehicle that has a mission, behind a radio that turns bad once it has it."""
    network = make_network(firmware, **options)
    assert upload(make_mission(firmware, stops), network).verified
    bad = make_network(firmware, faults)
    bad.autopilot, bad.clock_s = network.autopilot, network.clock_s
    return bad


@BOTH
@pytest.mark.parametrize("faults", ["", "drop=0.3", "dup=0.5", "reorder=0.3", "reboot-at=3"])
def test_what_was_uploaded_is_fetched_and_nothing_is_changed(firmware, faults):
    network = holding(firmware, faults)
    before = network.stored(0)
    result = fetch(network)
    mission, rules = make_mission(firmware, 3), AUTOPILOTS[firmware]
    assert result.session.error is None
    assert differences(to_wire(mission, rules), to_wire(result.session.mission, rules), rules) == []
    assert network.stored(0) == before


@BOTH
def test_home_is_the_vehicles_own(firmware):
    home = fetch(holding(firmware)).session.mission.home
    assert home.lat_e7 == pytest.approx(HOME.lat_e7, abs=1)
    assert home.alt_amsl_m == pytest.approx(10.0, abs=0.1)


@BOTH
def test_a_vehicle_without_home_is_waited_for_and_then_warned_about(firmware):
    result = fetch(holding(firmware, home=None))
    assert [problem.code for problem in result.session.warnings] == ["no-home"]
    assert result.session.mission.home.lat_e7 == HOME.lat_e7
    assert result.ended_s < 10.0


@BOTH
def test_an_empty_vehicle_holds_no_mission_and_that_is_said(firmware):
    assert isinstance(fetch(make_network(firmware)).session.error, CheckError)


def test_the_firmware_asked_for_must_be_there():
    error = fetch(make_network("px4"), wanted="ardupilot").session.error
    assert isinstance(error, RefusedError)
    assert "nothing was fetched" in str(error)


def test_silence_is_no_link_and_a_break_in_the_middle_is_uncertain():
    assert isinstance(fetch(make_network("px4", "no-heartbeat")).session.error, NoLinkError)
    broken = fetch(holding("px4", "silent-after=3"), deadline_s=20.0)
    assert isinstance(broken.session.error, UncertainError)
    assert broken.ended_s <= 20.0
    assert "was not changed" in str(broken.session.error)
