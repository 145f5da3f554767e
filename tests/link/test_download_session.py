"""Fetching what a vehicle holds, against the mock on a virtual clock."""

import dataclasses
import math

import pytest

from mavplan.errors import CheckError, NoLinkError, RefusedError, UncertainError
from mavplan.link.download_session import LIST_PATIENCE_S, DownloadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.checksum import px4_id
from mavplan.mission.model import Command
from mavplan.mission.readback import differences
from mavplan.mission.wire import to_wire
from sitl_mock.items import Result
from sitl_mock.missions import Ack
from sitl_mock.wire import message_id
from tests.link.fenced import FENCE, RALLY, fenced, stored
from tests.link.harness import HOME, Radio, make_mission, make_network, run, upload
from tests.link.script import OTHER_STATION, VEHICLE, count

BOTH = pytest.mark.parametrize("firmware", ["ardupilot", "px4"])


def fetch(network, deadline_s=120.0, **options):
    return run(DownloadSession(now=network.clock_s, deadline_s=deadline_s, **options), network)


def holding(firmware, faults="", stops=3, mission=None, **options):
    """A vehicle that has a mission, behind a radio that turns bad once it has it."""
    network = make_network(firmware, **options)
    assert upload(mission or make_mission(firmware, stops), network).verified
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


# -- fence and rally points -----------------------------------------------------------------------------------


def same(mission, other):
    """Whether two missions are the same on every list of a vehicle."""
    rules = AUTOPILOTS[mission.autopilot]
    items = not differences(to_wire(other, rules), to_wire(mission, rules), rules)
    return items and (mission.fence, mission.rally) == (other.fence, other.rally)


@BOTH
@pytest.mark.parametrize(
    "faults", ["", "drop=0.3", "dup=0.5,reorder=0.3", "reboot-at=4", "reboot-at=9", "second-gcs=read"]
)
def test_a_fence_and_rally_points_are_fetched_too_and_nothing_is_changed(firmware, faults):
    network = holding(firmware, faults, mission=fenced(firmware))
    before = [network.stored(kind) for kind in range(3)]
    session = fetch(network).session
    assert session.error is None
    assert same(session.mission, fenced(firmware))
    assert (session.count(1), session.count(2)) == (5, 2)
    assert session.warnings == ()
    assert [network.stored(kind) for kind in range(3)] == before


@BOTH
def test_a_vehicle_without_them_gives_the_mission_without_a_word(firmware):
    session = fetch(holding(firmware)).session
    assert (session.mission.fence, session.mission.rally) == (None, ())
    assert (session.count(1), session.count(2), session.warnings) == (0, 0, ())


@BOTH
def test_with_mission_only_they_are_not_asked_for(firmware):
    network = holding(firmware, mission=fenced(firmware))
    session = fetch(network, mission_only=True).session
    assert (session.mission.fence, session.mission.rally) == (None, ())
    assert (session.count(1), session.count(2)) == (None, None)


@BOTH
def test_a_vehicle_with_a_fence_and_no_mission_holds_none_and_what_it_has_is_said(firmware):
    network = holding(firmware, mission=fenced(firmware))
    network.autopilot._missions._lists[0].clear() if firmware == "px4" else clear_mission(network)
    error = fetch(network).session.error
    assert isinstance(error, CheckError)
    said = "holds no mission, only a fence of 5 items and 2 rally points: a file needs a mission"
    assert str(error).endswith(said)


def clear_mission(network):
    network.autopilot._missions.on_clear_all(None, 0, network.clock_s)


def refusing(network, kinds, result=Result.UNSUPPORTED):
    """The vehicle answers a request for these lists with a refusal."""
    missions = network.autopilot._missions
    plain = missions.on_request_list

    def on_request_list(sender, kind, now):
        return [Ack(sender, result, kind)] if kind in kinds else plain(sender, kind, now)

    missions.on_request_list = on_request_list
    return network


def ignoring(network, kinds):
    """The vehicle does not answer a request for these lists."""
    missions = network.autopilot._missions
    plain = missions.on_request_list
    missions.on_request_list = lambda sender, kind, now: [] if kind in kinds else plain(sender, kind, now)
    return network


@BOTH
@pytest.mark.parametrize("make", [refusing, ignoring])
@pytest.mark.parametrize("kinds", [{1}, {2}, {1, 2}])
def test_a_list_that_a_vehicle_does_not_have_is_left_out_with_a_warning(firmware, make, kinds):
    network = make(holding(firmware, "drop=0.2", mission=fenced(firmware)), kinds)
    ended = fetch(network)
    session = ended.session
    assert session.error is None
    assert session.mission.fence == (None if 1 in kinds else FENCE)
    assert session.mission.rally == (() if 2 in kinds else RALLY)
    names = {1: "fence", 2: "rally points"}
    assert [(p.where, p.code) for p in session.warnings] == [(names[k], "not-given") for k in sorted(kinds)]
    assert ("does not answer" in str(session.warnings[0])) == (make is ignoring)
    assert ended.ended_s < 10.0 + 15.0 * len(kinds)


@BOTH
def test_a_vehicle_that_sends_no_time_stamps_back_is_waited_for_longer(firmware, monkeypatch):
    network = ignoring(holding(firmware, mission=fenced(firmware)), {1, 2})
    plain = network.autopilot._other
    monkeypatch.setattr(
        network.autopilot, "_other", lambda *a: None if a[1] == "TIMESYNC" else plain(*a), raising=True
    )
    ended = fetch(network)
    assert [problem.code for problem in ended.session.warnings] == ["not-given"] * 2
    assert 2 * LIST_PATIENCE_S < ended.ended_s < 2 * LIST_PATIENCE_S + 8.0


@BOTH
@pytest.mark.parametrize("seed", range(8))
def test_a_bad_radio_and_a_short_time_make_no_vehicle_without_a_fence(firmware, seed):
    network = holding(firmware, mission=fenced(firmware))
    bad = make_network(firmware, "drop=0.5", seed)
    bad.autopilot, bad.clock_s = network.autopilot, network.clock_s
    session = fetch(bad, deadline_s=12.0).session
    assert [problem.code for problem in session.warnings if problem.code == "not-given"] == []
    assert isinstance(session.error, UncertainError) or same(session.mission, fenced(firmware))


@BOTH
def test_a_mission_that_is_refused_is_a_refusal(firmware):
    error = fetch(refusing(holding(firmware), {0})).session.error
    assert isinstance(error, RefusedError)


class Muted(Radio):
    """The vehicle goes out of reach at its first count of the fence."""

    muted = False

    def _leave(self, link, frame, now):
        self.muted = self.muted or (message_id(frame) == 44 and frame[14:15] == b"\1")
        if not self.muted:
            super()._leave(link, frame, now)


@BOTH
@pytest.mark.parametrize("deadline_s", [20.0, 120.0])
def test_a_vehicle_that_is_out_of_reach_is_not_one_without_a_fence(firmware, deadline_s):
    network = holding(firmware, mission=fenced(firmware))
    network.__class__ = Muted
    ended = fetch(network, deadline_s)
    assert isinstance(ended.error, UncertainError)
    assert "the vehicle's fence and rally points could not be read" in str(ended.error)
    assert "--mission-only" in str(ended.error)
    assert ended.ended_s <= deadline_s + 1e-3


@BOTH
@pytest.mark.parametrize("kind", [0, 1, 2])
@pytest.mark.parametrize("when", [0, 1, 2])
def test_another_stations_writing_to_any_list_makes_that_list_be_fetched_again(firmware, kind, when):
    """Also to one that was fetched before, while another is being fetched."""
    network = holding(firmware, mission=fenced(firmware))
    session = DownloadSession(now=network.clock_s, deadline_s=60.0)
    plain, told, asked = session.tick, [], []

    def tick(now):
        plain(now)
        if session._download is not None and session._download not in asked:
            asked.append(session._download)
        if session._download is not None and session._kind == when and not told:
            told.append(now)
            session.receive(count(3, to=VEHICLE, by=OTHER_STATION, kind=kind), now)

    session.tick = tick
    ended = run(session, network)
    assert same(session.mission, fenced(firmware))
    fetched = [(download.mission_type, download.attempts) for download in asked]
    again = {0: [], 1: [], 2: []}
    for found, attempts in fetched:
        again[found].append(attempts)
    # A list not yet begun needs nothing; one under way starts again; one that is done is fetched anew, after a pause.
    wanted = {k: [1] for k in range(3)}
    if kind == when:
        wanted[kind] = [2]
    elif kind < when:
        wanted[kind] = [1, 2]
    assert again == wanted
    assert (ended.ended_s > 2.5) == (kind <= when)


def test_nothing_is_given_that_was_written_to_in_the_last_moment():
    network = holding("px4", mission=fenced("px4"))
    session = DownloadSession(now=network.clock_s, deadline_s=60.0)
    plain = session.tick

    def tick(now):
        plain(now)
        if session._download is not None and session._kind == 2:
            session.deadline = now
            session.receive(count(3, to=VEHICLE, by=OTHER_STATION, kind=1), now)

    session.tick = tick
    run(session, network)
    assert isinstance(session.error, UncertainError)
    assert "fence and rally points" in str(session.error)


def test_areas_that_make_no_fence_are_left_out_and_said():
    network = holding("px4", mission=fenced("px4"))
    lists = network.autopilot._missions._lists
    lists[1] = [*lists[1][:-1], lists[1][0]]
    session = fetch(network).session
    assert [problem.code for problem in session.warnings] == ["left-out"]
    assert session.mission.fence.circles == ()
    assert len(stored(network, 1)) == session.count(1) == 5


# -- what is not read back ------------------------------------------------------------------------------------


def headings(mission):
    return [item.params[3] for item in mission.items if item.command == Command.NAV_LOITER_TIME]


def with_heading(mission, heading):
    items = (
        dataclasses.replace(item, params=(*item.params[:3], heading))
        if item.command == Command.NAV_LOITER_TIME
        else item
        for item in mission.items
    )
    return dataclasses.replace(mission, items=tuple(items))


def test_the_heading_of_a_hold_is_told_by_px4s_checksum_and_what_is_fetched_is_the_same_mission():
    """It reads back as a flag; sent again as that flag it would turn the nose north."""
    network = holding("px4")
    session = fetch(network).session
    assert all(math.isnan(heading) for heading in headings(session.mission))
    assert session.warnings == ()
    assert px4_id(to_wire(session.mission, AUTOPILOTS["px4"])) == network.autopilot._missions._ids[0]


def test_holds_with_the_nose_north_are_kept_and_others_are_said_to_be_unknown():
    north = with_heading(make_mission("px4", 2), 0.0)
    session = fetch(holding("px4", mission=north)).session
    assert (headings(session.mission), session.warnings) == ([0.0, 0.0], ())
    east = with_heading(make_mission("px4", 2), 90.0)
    session = fetch(holding("px4", mission=east)).session
    assert all(math.isnan(heading) for heading in headings(session.mission))
    assert [problem.code for problem in session.warnings] == ["heading-unread"]


def test_ardupilot_ignores_the_heading_and_nothing_is_said_of_it():
    session = fetch(holding("ardupilot")).session
    assert (headings(session.mission), session.warnings) == ([0.0, 0.0, 0.0], ())
