"""From a vehicle on the ground to the question: the mission is sent or verified first, and verified again when old."""

import dataclasses

import pytest

from mavplan.errors import NoLinkError, RefusedError
from mavplan.flight.phases import Phase
from tests.flight.harness import fly, make_fly_session
from tests.link.harness import HOME, make_mission, make_network, upload

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
WRITES = {"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_CLEAR_ALL"}


def no_hands(session, now):
    """Nobody is there: the flight is left when the list is complete."""
    if session.awaits_yes:
        session.decline()


def holding(mission):
    network = make_network(mission.autopilot)
    assert upload(mission, network).verified
    return network


def verdicts(flown):
    return {check.name: check.verdict for check in flown.session.checks}


@BOTH
def test_what_is_to_be_uploaded_is_verified_before_the_question(firmware):
    mission, network = make_mission(firmware, 3), make_network(firmware)
    flown = fly(make_fly_session(mission, network.clock_s), network, no_hands)
    assert verdicts(flown)["mission"] == "good"
    assert str(flown.session.error) == "you did not say yes: it was not armed"
    assert isinstance(flown.session.error, RefusedError)
    assert set(flown.doings) == WRITES - {"MISSION_CLEAR_ALL"}


@BOTH
def test_a_vehicle_that_holds_the_mission_is_sent_nothing_that_does_anything(firmware):
    mission = make_mission(firmware, 3)
    network = holding(mission)
    flown = fly(make_fly_session(mission, network.clock_s, upload=False), network, no_hands)
    assert verdicts(flown)["mission"] == "good"
    assert flown.doings == []


@BOTH
def test_a_vehicle_that_holds_another_mission_gets_the_whole_list_and_no_question(firmware):
    network = holding(make_mission(firmware, 4))
    session = make_fly_session(make_mission(firmware, 3), network.clock_s, upload=False)
    asked = []
    flown = fly(session, network, lambda session, now: asked.append(now) if session.awaits_yes else None)
    assert asked == []
    assert verdicts(flown)["mission"] == "refused"
    assert len(verdicts(flown)) == 9
    assert "holds something else" in str(flown.session.error)
    assert isinstance(flown.session.error, RefusedError)


@BOTH
def test_an_upload_that_is_refused_ends_it_as_an_upload_does(firmware):
    network = make_network(firmware, capacity=5)
    flown = fly(make_fly_session(make_mission(firmware, 3), network.clock_s), network)
    assert "room for" in str(flown.session.error)
    assert flown.session.phase is Phase.CHECKING


@BOTH
def test_a_home_elsewhere_refuses(firmware):
    mission = make_mission(firmware, 3)
    network = holding(mission)
    far = dataclasses.replace(mission, home=dataclasses.replace(HOME, lat_e7=HOME.lat_e7 + 60_000))
    flown = fly(make_fly_session(far, network.clock_s, upload=False), network)
    assert verdicts(flown)["home"] == "refused"
    assert flown.doings == []


def test_a_vehicle_without_a_home_is_refused():
    network = make_network("ardupilot", home=None)
    flown = fly(make_fly_session(make_mission("ardupilot", 3), network.clock_s), network)
    assert verdicts(flown)["home"] == verdicts(flown)["position"] == "refused"
    assert "ARM 1 0" not in flown.doings


@BOTH
def test_nobody_there_is_no_link(firmware):
    network = make_network(firmware, "silent-after=0s")
    flown = fly(make_fly_session(make_mission(firmware, 3), network.clock_s), network)
    assert isinstance(flown.session.error, NoLinkError)


@BOTH
def test_a_yes_after_a_while_lets_the_mission_be_verified_once_more(firmware):
    mission = make_mission(firmware, 3)
    network = holding(mission)
    asked_at = []

    def late(session, now):
        if session.awaits_yes:
            asked_at.append(now)
            if now > asked_at[0] + 40.0:
                other = make_network(firmware)
                upload(make_mission(firmware, 2), other)
                network.autopilot._missions = other.autopilot._missions
                session.approve(now, every_question=True)

    flown = fly(make_fly_session(mission, network.clock_s, upload=False), network, late)
    assert "not armed: mission: " in str(flown.session.error)
    assert "holds something else" in str(flown.session.error)
    assert flown.doings == []


@BOTH
def test_leaving_before_anything_is_armed_says_so(firmware):
    mission = make_mission(firmware, 3)
    for when in (0.5, 1.7, 4.0):
        network = holding(mission)
        begin_s = network.clock_s

        def leave(session, now, begin_s=begin_s, when=when):
            if now >= begin_s + when:
                session.leave(now, "interrupted")

        flown = fly(make_fly_session(mission, begin_s, upload=False), network, leave)
        assert flown.session.error is not None
        assert flown.doings == []
