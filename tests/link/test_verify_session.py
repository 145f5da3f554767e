"""Whether a vehicle still holds a mission: the same, another, or not to be had. Nothing is changed."""

import dataclasses

import pytest

from mavplan.errors import CheckError, InputError, NoLinkError, UncertainError
from mavplan.link.codec import Codec
from mavplan.link.verify_session import HoldsOtherError, VerifySession
from mavplan.mission.geofence import RallyPoint
from mavplan.mission.model import MissionItem
from tests.link.fenced import FENCE, fenced, stored
from tests.link.harness import HOME, make_mission, make_network, run, upload

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
WRITES = {"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_CLEAR_ALL"}


def verify(mission, network, deadline_s=120.0):
    result = run(VerifySession(mission, now=network.clock_s, deadline_s=deadline_s), network)
    kinds = [m.get_type() for _, frame in result.sent for m in Codec().decode(frame, 0.0)]
    assert not WRITES & set(kinds)
    return result, kinds


def after_upload(mission, faults="", seed=0):
    network = make_network(mission.autopilot)
    assert upload(mission, network).verified
    if not faults:
        return network
    bad = make_network(mission.autopilot, faults, seed)
    bad.autopilot._missions = network.autopilot._missions
    return bad


def test_px4_is_believed_by_its_ids_without_a_download():
    result, kinds = verify(fenced("px4"), after_upload(fenced("px4")))
    assert result.session.report.by == "id"
    assert result.session.report.lists == ("fence", "rally points", "mission")
    assert "MISSION_REQUEST_LIST" not in kinds


def test_ardupilot_is_always_read():
    result, kinds = verify(fenced("ardupilot"), after_upload(fenced("ardupilot")))
    assert result.session.report.by == "download"
    assert kinds.count("MISSION_REQUEST_LIST") == 3


@BOTH
@pytest.mark.parametrize("seed", range(3))
def test_over_a_bad_radio_too(firmware, seed):
    mission = fenced(firmware)
    result, _ = verify(mission, after_upload(mission, "drop=0.3,dup=0.2,reorder=0.2", seed))
    assert result.session.report is not None, result.error


def moved(mission):
    items = list(mission.items)
    last = items[-2]
    items[-2] = dataclasses.replace(last, lat_e7=last.lat_e7 + 10)
    return dataclasses.replace(mission, items=tuple(items))


def longer_hold(mission):
    items = list(mission.items)
    items[3] = dataclasses.replace(items[3], params=(items[3].params[0] + 1, *items[3].params[1:]))
    return dataclasses.replace(mission, items=tuple(items))


CHANGES = {
    "x": moved,
    "param1": longer_hold,
    "count": lambda mission: dataclasses.replace(
        mission, items=(*mission.items[:-1], MissionItem(178, 2, (1, 5, -1, 0)), mission.items[-1])
    ),
    "fence": lambda mission: dataclasses.replace(
        mission,
        fence=dataclasses.replace(FENCE, circles=(dataclasses.replace(FENCE.circles[0], radius_m=51.0),)),
    ),
    "rally": lambda mission: dataclasses.replace(
        mission, rally=(RallyPoint(HOME.lat_e7, HOME.lon_e7, 31.0),)
    ),
}


@BOTH
@pytest.mark.parametrize("change", CHANGES)
def test_one_field_of_any_list_is_another_mission_and_the_difference_is_told(firmware, change):
    mission = fenced(firmware)
    result, _ = verify(CHANGES[change](mission), after_upload(mission))
    assert isinstance(result.error, HoldsOtherError)
    assert isinstance(result.error, CheckError)
    assert result.error.differences
    assert "holds something else" in str(result.error)
    if change in {"x", "param1"}:
        assert [found.field for found in result.error.differences] == [change]


@BOTH
def test_an_empty_vehicle_holds_none(firmware):
    result, _ = verify(fenced(firmware), make_network(firmware))
    title = "PX4" if firmware == "px4" else "ArduPilot"
    assert (
        str(result.error)
        == f"{title} holds no fence; {title} holds no rally points; {title} holds no mission"
    )


@BOTH
def test_what_the_vehicle_holds_beyond_the_mission_does_not_matter(firmware):
    mission = fenced(firmware)
    result, _ = verify(dataclasses.replace(mission, fence=None, rally=()), after_upload(mission))
    assert result.session.report is not None


def test_px4_that_holds_the_same_items_under_another_id_is_read_item_by_item():
    """Another ground station may have sent the same mission in another spelling."""
    network = after_upload(make_mission("px4"))
    network.autopilot._missions._ids[0] += 1
    result, kinds = verify(make_mission("px4"), network)
    assert result.session.report.by == "download"
    assert "MISSION_REQUEST_LIST" in kinds


def test_a_px4_that_does_not_announce_itself_is_read(monkeypatch):
    network = after_upload(make_mission("px4"))
    network.autopilot._schedule.forget("ground")
    monkeypatch.setattr(network.autopilot, "_send_telemetry", lambda link, name, now: None)
    result, _ = verify(make_mission("px4"), network)
    assert result.session.report.by == "download"


def test_a_mission_for_the_other_firmware_is_not_what_it_holds():
    result, _ = verify(make_mission("px4"), make_network("ardupilot"))
    assert isinstance(result.error, HoldsOtherError)
    assert "runs ArduPilot" in str(result.error)


@BOTH
def test_a_vehicle_that_goes_silent_could_not_be_had(firmware):
    network = after_upload(fenced(firmware), "silent-after=1s")
    result, _ = verify(fenced(firmware), network, deadline_s=10.0)
    assert isinstance(result.error, UncertainError)
    assert result.ended_s <= 10.0


@BOTH
def test_nobody_there_is_no_link(firmware):
    result, _ = verify(fenced(firmware), make_network(firmware, "no-heartbeat"))
    assert isinstance(result.error, NoLinkError)


def test_a_mission_that_could_never_be_there_is_bad_input():
    mission = dataclasses.replace(make_mission("px4"), items=make_mission("px4").items[1:])
    result, _ = verify(mission, make_network("px4"))
    assert isinstance(result.error, InputError)


@BOTH
def test_it_leaves_the_vehicle_ready_for_the_next(firmware):
    mission = fenced(firmware)
    network = after_upload(mission)
    verify(moved(mission), network)
    assert upload(mission, network).verified
    assert len(stored(network, 1)) == 5
