"""Fence and rally points go before the mission, and the whole is verified only if all three are."""

import math

import pytest

from mavplan.errors import InputError, RefusedError, UncertainError
from mavplan.link.codec import Codec
from mavplan.link.report import DiffersError
from mavplan.link.upload_session import UploadSession
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from sitl_mock import ardupilot_lists
from tests.fences import place_e7
from tests.link.fenced import arm, fenced, holds_all, stored
from tests.link.harness import HOME, make_mission, make_network, run, settle, upload
from tests.link.script import OTHER_STATION, VEHICLE, count

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def counts(result):
    """Mission types and counts of our MISSION_COUNTs, in order, each once."""
    found = [
        (message.mission_type, message.count)
        for _, frame in result.sent
        for message in Codec().decode(frame, 0.0)
        if message.get_type() == "MISSION_COUNT"
    ]
    return list(dict.fromkeys(found))


@BOTH
def test_the_fence_goes_first_then_rally_points_then_the_mission_and_all_are_held(firmware):
    mission, network = fenced(firmware), make_network(firmware)
    result = upload(mission, network)
    assert result.verified, result.error
    assert holds_all(network, mission)
    assert counts(result) == [(1, 5), (2, 2), (0, len(mission.items) + (firmware == "ardupilot"))]
    assert (result.session.report.fence_items, result.session.report.rally_items) == (5, 2)


@BOTH
def test_lists_that_the_mission_does_not_have_are_left_alone(firmware):
    network = make_network(firmware)
    assert upload(fenced(firmware), network).verified
    result = upload(make_mission(firmware, 2), network)
    assert result.verified
    assert [kind for kind, _ in counts(result)] == [0]
    assert len(stored(network, 1)) == 5
    assert len(stored(network, 2)) == 2


@BOTH
@pytest.mark.parametrize(
    "faults",
    [
        "drop=0.3",
        "dup=0.5",
        "reorder=0.3",
        "drop=0.2,dup=0.2,reorder=0.2,corrupt=0.05",
        "first-lost",
        "ack-lost",
        "reboot-at=3",
        "reboot-at=9",
        "delay=300ms",
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_bad_radio_and_still_all_of_it_is_verified_and_held(firmware, faults, seed):
    mission, network = fenced(firmware), make_network(firmware, faults, seed=seed)
    result = upload(mission, network)
    assert result.verified, result.error
    settle(network)
    assert holds_all(network, mission)


@BOTH
def test_a_vehicle_that_dies_in_the_fence_gets_no_mission(firmware):
    dying = make_network(firmware, "silent-after=2")
    result = upload(fenced(firmware), dying, deadline_s=20.0)
    assert isinstance(result.error, UncertainError)
    assert "the mission was not sent" in str(result.error)
    assert {kind for kind, _ in counts(result)} == {1}


def test_a_fence_that_ardupilot_finds_bad_is_refused_its_old_one_kept_and_the_mission_not_sent(monkeypatch):
    network = make_network("ardupilot")
    old = fenced("ardupilot", 2, rally=())
    assert upload(old, network).verified
    monkeypatch.setattr(ardupilot_lists.rules, "fence_fault", lambda items: "Fence: no good")
    other = Fence((), (FenceCircle(True, HOME.lat_e7, HOME.lon_e7, 3_000.0),))
    result = upload(fenced("ardupilot", fence=other), network)
    assert isinstance(result.error, RefusedError)
    assert "refused the fence" in str(result.error)
    assert "Fence: no good" in str(result.error)
    assert "keeps its old fence of 5 items" in str(result.error)
    assert "the mission was not sent" in str(result.error)
    assert holds_all(network, old)
    assert stored(network, 2) == ()


def big_polygon(vertices):
    turn = 2 * math.pi / vertices
    corners = (place_e7(900 * math.cos(k * turn), 900 * math.sin(k * turn), HOME) for k in range(vertices))
    return Fence((FencePolygon(True, tuple(corners)),))


def test_a_fence_too_large_for_the_storage_is_refused_and_the_mission_not_sent():
    """70 vertices are counted in and then do not fit: ArduPilot says so only at the end."""
    network = make_network("ardupilot")
    result = upload(fenced("ardupilot", fence=big_polygon(70), rally=()), network)
    assert isinstance(result.error, RefusedError)
    assert "Fence exceeds storage size" in str(result.error)
    assert stored(network, 0) == stored(network, 1) == ()


@BOTH
def test_a_fence_of_too_many_items_is_refused_with_the_numbers_and_the_mission_not_sent(firmware):
    network = make_network(firmware)
    result = upload(fenced(firmware, fence=big_polygon(90), rally=()), network)
    assert isinstance(result.error, RefusedError)
    assert "90" in str(result.error)
    assert "the mission was not sent" in str(result.error)
    assert [kind for kind, _ in counts(result)] == [1]


@BOTH
def test_the_mission_refused_after_the_fence_tells_that_the_fence_is_new(firmware):
    network = make_network(firmware, capacity=10)
    result = upload(fenced(firmware, 10), network)
    assert isinstance(result.error, RefusedError)
    assert "the fence and the rally points of this mission are on the vehicle" in str(result.error)


def test_what_the_vehicle_would_change_of_a_rally_point_is_bad_input_and_nothing_is_sent():
    half = (RallyPoint(HOME.lat_e7, HOME.lon_e7, 30.5),)
    result = upload(fenced("ardupilot", rally=half), make_network("ardupilot"))
    assert isinstance(result.error, InputError)
    assert counts(result) == []


@BOTH
def test_a_fence_stored_otherwise_is_uncertain_and_the_mission_not_sent(firmware):
    result = upload(fenced(firmware), make_network(firmware, "alter=3"))
    assert isinstance(result.error, DiffersError)
    assert "of the fence" in str(result.error)
    assert "the mission was not sent" in str(result.error)


@BOTH
def test_a_vehicle_that_is_armed_between_two_lists_gets_no_more(firmware):
    network = make_network(firmware)
    session = UploadSession(fenced(firmware), now=network.clock_s, deadline_s=120.0)
    plain = session.tick

    def tick(now):
        plain(now)
        if session._store is not None and session._store.kind == 1:
            arm(network)

    session.tick = tick
    result = run(session, network)
    assert isinstance(result.error, RefusedError)
    assert "armed meanwhile" in str(result.error)
    assert "the fence of this mission is on the vehicle" in str(result.error)
    assert stored(network, 2) == ()


@BOTH
def test_an_armed_vehicle_gets_no_fence_either_unless_allowed(firmware):
    network = make_network(firmware)
    arm(network)
    result = upload(fenced(firmware), network)
    assert isinstance(result.error, RefusedError)
    assert counts(result) == []
    session = UploadSession(fenced(firmware), now=network.clock_s, deadline_s=120.0, allow_armed=True)
    assert run(session, network).verified


@BOTH
def test_another_station_that_changes_the_fence_after_it_was_verified_is_told(firmware):
    network = make_network(firmware)
    session = UploadSession(fenced(firmware), now=network.clock_s, deadline_s=120.0)
    plain, told = session.tick, []

    def tick(now):
        plain(now)
        if session._store is not None and session._store.kind == 0 and not told:
            told.append(count(3, to=VEHICLE, by=OTHER_STATION, kind=1))
            session.receive(told[0], now)

    session.tick = tick
    result = run(session, network)
    assert isinstance(result.error, UncertainError)
    assert "written to the vehicle's fence" in str(result.error)


@BOTH
def test_no_end_between_the_fence_and_the_mission_says_what_is_where(firmware):
    network = make_network(firmware)
    session = UploadSession(fenced(firmware), now=network.clock_s, deadline_s=120.0)
    plain = session.tick

    def tick(now):
        plain(now)
        if session._store is not None and session._store.phase.name == "SETTLING":
            session.interrupt(session._store._settled_at())

    session.tick = tick
    result = run(session, network)
    assert isinstance(result.error, RefusedError)
    assert "interrupted; the mission was not sent; the fence of this mission is on the vehicle" in str(
        result.error
    )
    assert len(stored(network, 1)) == 5
