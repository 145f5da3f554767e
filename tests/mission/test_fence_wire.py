"""Fence and rally items against a real autopilot's recorded answers and against both mock vehicles."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mavlink

from mavplan.link.protocol import received_item
from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.mission.fence_wire import (
    fence_from_wire,
    fence_problems,
    fence_to_wire,
    rally_from_wire,
    rally_to_wire,
)
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.mission.model import HomePosition
from mavplan.mission.readback import KEEPS_OF_TYPE, differences, float32
from mavplan.mission.wire import WireItem
from tests.fences import box, circle, fenced_mission, fences, place_e7, rally_points
from tests.link.recordings import messages_of
from tests.sitl_mock.rig import Rig

CAPTURE = Path(__file__).resolve().parents[2] / "../shared/captures/ardupilot_upload_download.tlog"
needs_capture = pytest.mark.skipif(
    not CAPTURE.is_file(), reason="the recordings of real autopilots are not here"
)
RECORDED_FENCE = Fence(
    (
        FencePolygon(
            True,
            (
                (373_980_000, -1_221_020_000),
                (374_030_000, -1_221_020_000),
                (374_030_000, -1_220_960_000),
                (373_980_000, -1_220_960_000),
            ),
        ),
    )
)
RECORDED_RALLY = (RallyPoint(374_005_000, -1_221_000_000, 30.0),)


def recorded(mission_type):
    sides = ({}, {})
    for message in messages_of(CAPTURE):
        if message.get_type() == "MISSION_ITEM_INT" and message.mission_type == mission_type:
            sides[message.get_srcSystem() != 255][message.seq] = received_item(message)
    return tuple(tuple(side[seq] for seq in sorted(side)) for side in sides)


@needs_capture
def test_what_was_sent_to_a_real_ardupilot_is_what_we_would_send_and_its_answer_is_no_difference():
    """A fence of four vertices and one rally point, up and down."""
    mission = replace(fenced_mission(), fence=RECORDED_FENCE, rally=RECORDED_RALLY)
    for kind, ours in ((1, fence_to_wire(mission, ARDUPILOT)), (2, rally_to_wire(mission, ARDUPILOT))):
        sent, stored = recorded(kind)
        assert sent == ours
        assert len(stored) == len(sent)
        assert differences(sent, stored, ARDUPILOT, kind) == []
    assert fence_from_wire(recorded(1)[1]) == (RECORDED_FENCE, ())
    assert rally_from_wire(recorded(2)[1]) == (RECORDED_RALLY, ())


@needs_capture
@pytest.mark.parametrize(
    ("kind", "fields", "field", "words"),
    [
        (1, {"x": 374_030_002}, "x", "latitude"),
        (1, {"y": -1_221_020_002}, "y", "longitude"),
        (1, {"param1": 5.0}, "param1", "number of vertices 4 was sent, 5 is stored"),
        (1, {"command": 5002}, "command", "NAV_FENCE_POLYGON_VERTEX_EXCLUSION is stored"),
        (1, {"frame": 3}, "frame", "frame 0 was sent, 3 is stored"),
        (1, {"autocontinue": 1}, "autocontinue", "autocontinue"),
        (1, {"z": 1.0}, "z", "altitude (m)"),
        (1, {"param2": 1.0}, "param2", "param2"),
        (2, {"z": 29.0}, "z", "altitude (m) 30 was sent, 29 is stored"),
        (2, {"z": 30.01}, "z", "altitude"),
        (2, {"frame": 0}, "frame", "frame 3 was sent, 0 is stored"),
        (2, {"x": 0}, "x", "NAV_RALLY_POINT"),
    ],
)
def test_whatever_else_a_vehicle_gives_back_is_a_difference(kind, fields, field, words):
    """One field of the real answer changed."""
    sent, stored = recorded(kind)
    changed = (replace(stored[0], **fields), *stored[1:])
    (found,) = differences(sent, changed, ARDUPILOT, kind)
    assert (found.seq, found.field) == (0, field)
    assert words in found.words


def test_the_first_item_of_a_fence_is_compared_like_any_other():
    """Only a mission's item 0 is home on ArduPilot."""
    items = fence_to_wire(fenced_mission(fence=Fence((box(0, 0, 9, 9),))), ARDUPILOT)
    stored = tuple(replace(item, autocontinue=0) for item in items)
    assert differences(items, stored, ARDUPILOT, 1) == []
    assert differences(items, (replace(stored[0], x=1), *stored[1:]), ARDUPILOT, 1)
    assert next(d.field for d in differences(items, stored[1:], ARDUPILOT, 1)) == "count"
    assert set(KEEPS_OF_TYPE) == {0, 1, 2}


def message_of(item, kind):
    fields = (item.frame, item.command, item.current, item.autocontinue, *item.params, item.x, item.y, item.z)
    return mavlink.MAVLink_mission_item_int_message(1, 1, item.seq, *fields, kind)


def stored_by_mock(firmware, items, kind):
    """Upload to the mock over its wire format and read back."""
    rig = Rig(firmware)
    rig.run(3.0)
    answer = rig.upload([message_of(item, kind) for item in items], kind)
    assert answer.type == 0
    return tuple(received_item(message) for message in rig.download(kind))


def as_float32(fence):
    circles = (replace(area, radius_m=float32(area.radius_m)) for area in fence.circles)
    return replace(fence, circles=tuple(circles))


@given(st.sampled_from(["ardupilot", "px4"]), fences, st.lists(rally_points, max_size=4))
@settings(deadline=None, max_examples=60)
def test_every_fence_goes_to_the_vehicle_and_comes_back_the_same(firmware, fence, rally):
    """Through both mock vehicles: nothing differs by the table, and what is read back is what was meant."""
    rules = AUTOPILOTS[firmware]
    mission = fenced_mission(fence=fence or None, rally=rally, autopilot=firmware)
    if any(problem.severity == "error" for problem in fence_problems(mission, rules)):
        return
    for kind, items in ((1, fence_to_wire(mission, rules)), (2, rally_to_wire(mission, rules))):
        if items:
            stored = stored_by_mock(firmware, items, kind)
            assert differences(items, stored, rules, kind) == []
            if kind == 1:
                assert fence_from_wire(stored) == (as_float32(fence), ())
            else:
                assert rally_from_wire(stored) == (tuple(rally), ())


def test_nothing_is_sent_for_nothing():
    """No fence, no rally points: no items, and an empty list reads as none."""
    assert fence_to_wire(fenced_mission(), PX4) == rally_to_wire(fenced_mission(), PX4) == ()
    assert fence_from_wire(()) == (None, ())
    assert rally_from_wire(()) == ((), ())


def ring(count):
    """A polygon of so many vertices."""
    turns = [2 * math.pi * k / count for k in range(count)]
    return FencePolygon(True, tuple(place_e7(900 * math.cos(t), 900 * math.sin(t)) for t in turns))


@pytest.mark.parametrize(
    ("fence", "firmware", "code"),
    [
        (Fence((ring(69),)), "ardupilot", None),
        (Fence((ring(70),)), "ardupilot", "fence-size"),
        (Fence((ring(35), ring(36))), "ardupilot", "fence-size"),
        (Fence((), (circle(0, 0, 9.0),) * 42), "ardupilot", None),
        (Fence((), (circle(0, 0, 9.0),) * 43), "ardupilot", "fence-size"),
        (Fence((ring(64),)), "px4", None),
        (Fence((ring(65),)), "px4", "fence-size"),
    ],
)
def test_what_the_simulated_vehicle_has_no_room_for_is_warned_about(fence, firmware, code):
    """And the mock vehicle, which has that room, takes exactly the rest."""
    rules, mission = AUTOPILOTS[firmware], fenced_mission(fence=fence, autopilot=firmware)
    found = fence_problems(mission, rules)
    assert [(problem.code, problem.severity) for problem in found] == ([(code, "warning")] if code else [])
    rig = Rig(firmware)
    rig.run(3.0)
    items = [message_of(item, 1) for item in fence_to_wire(mission, rules)]
    assert (rig.upload(items, 1).type == 0) == (code is None)


@pytest.mark.parametrize(("firmware", "most"), [("ardupilot", 46), ("px4", 32)])
def test_more_rally_points_than_the_simulated_vehicle_held_are_warned_about(firmware, most):
    """The number is the mock's too."""
    rally = [RallyPoint(*place_e7(k, k), 30.0) for k in range(most + 1)]
    rules = AUTOPILOTS[firmware]
    assert fence_problems(fenced_mission(rally=rally[:-1]), rules) == []
    assert [problem.code for problem in fence_problems(fenced_mission(rally=rally), rules)] == ["rally-size"]


@pytest.mark.parametrize(
    ("point", "rules", "code"),
    [
        (RallyPoint(1, 1, 30.5), ARDUPILOT, "rally-fraction"),
        (RallyPoint(1, 1, 30.5), PX4, None),
        (RallyPoint(1, 1, 32_768.0), ARDUPILOT, "altitude"),
        (RallyPoint(1, 1, 32_767.0), ARDUPILOT, None),
        (RallyPoint(1, 1, math.nan), PX4, "altitude"),
        (RallyPoint(0, 0, 30.0), PX4, "position"),
    ],
)
def test_a_rally_point_that_would_not_be_stored_as_meant_is_an_error(point, rules, code):
    """ArduPilot cuts altitudes to whole metres."""
    found = fence_problems(fenced_mission(rally=[point]), rules)
    assert [problem.code for problem in found] == ([code] if code else [])
    assert all(problem.severity == "error" for problem in found)


def test_a_bad_area_is_an_error_with_its_name():
    """A NaN radius has killed a simulated vehicle."""
    fence = Fence((), (FenceCircle(True, 1, 1, math.nan, "[[fence.inclusion]] 1"),))
    (problem,) = fence_problems(fenced_mission(fence=fence), ARDUPILOT)
    assert (problem.where, problem.code, problem.severity) == ("[[fence.inclusion]] 1", "radius", "error")


def vertex(seq, count, command=5001, x=0):
    return WireItem(seq, 5, command, 0, 0, count, 0, 0, 0, x or 10 * seq * seq, 10 * seq, 0.0)


@pytest.mark.parametrize(
    ("items", "told"),
    [
        ([vertex(0, 3.0), vertex(1, 3.0)], ["fence items 0 to 1: make no polygon: left out"]),
        ([vertex(0, 3.0), vertex(1, 4.0), vertex(2, 3.0)], ["fence item 0", "fence item 1", "fence item 2"]),
        ([vertex(0, 0.0)], ["fence item 0: make no polygon: left out"]),
        ([vertex(0, math.nan)], ["fence item 0: make no polygon: left out"]),
        ([vertex(0, math.inf)], ["fence item 0: make no polygon: left out"]),
        ([vertex(0, 2.5), vertex(1, 2.5), vertex(2, 2.5)], ["fence items 0 to 1", "fence item 2"]),
        (
            [vertex(0, 3.0), vertex(1, 3.0), vertex(1, 3.0)],
            ["fence items 0 to 2: vertices 2 and 3 are the same"],
        ),
        ([vertex(0, 0.0, 5000)], ["fence item 0: is NAV_FENCE_RETURN_POINT: left out"]),
        ([vertex(0, 0.0, 16)], ["fence item 0: is NAV_WAYPOINT: left out"]),
        ([vertex(0, 0.0, 5003)], ["fence item 0: a radius of 0 m is out of range"]),
    ],
)
def test_items_that_make_no_area_are_told_and_the_rest_is_kept(items, told):
    """A vehicle may hold anything; a good circle behind it is read all the same."""
    good = vertex(9, 25.0, 5004)
    fence, warnings = fence_from_wire([*items, good])
    assert fence == Fence((), (FenceCircle(False, good.x, good.y, 25.0),))
    assert len(warnings) == len(told)
    assert all(str(found).startswith(words) for found, words in zip(warnings, told, strict=True))
    assert all(found.severity == "warning" for found in warnings)


def test_a_rally_altitude_above_sea_level_is_told_from_home():
    """Other ground stations store such points on PX4."""
    item = WireItem(0, 5, 5100, 0, 1, 0, 0, 0, 0, 465_000_000, 75_000_000, 650.0)
    home = HomePosition(465_000_000, 75_000_000, 600.0)
    assert rally_from_wire([item], home) == ((RallyPoint(465_000_000, 75_000_000, 50.0),), ())
    points, (warning,) = rally_from_wire([item, replace(item, seq=1, frame=6, z=40.0)])
    assert points == (RallyPoint(465_000_000, 75_000_000, 40.0),)
    assert str(warning) == "rally item 0: NAV_RALLY_POINT in frame 5 cannot be told: left out"
    assert len(rally_from_wire([replace(item, command=16, frame=3)])[1]) == 1
    assert len(rally_from_wire([replace(item, z=math.nan, frame=3)])[1]) == 1


anything = st.builds(
    WireItem,
    st.integers(0, 9),
    st.integers(0, 12),
    st.sampled_from([5000, 5001, 5002, 5003, 5004, 5100, 16]),
    st.just(0),
    st.integers(0, 1),
    st.sampled_from([0.0, 1.0, 3.0, 4.0, -1.0, 2.5, math.nan, math.inf]),
    *(st.just(0.0),) * 3,
    st.integers(-(2**31), 2**31 - 1) | st.integers(-9, 9),
    st.integers(-(2**31), 2**31 - 1) | st.integers(-9, 9),
    st.floats(width=32),
)


@given(st.lists(anything, max_size=12))
@settings(deadline=None)
def test_whatever_a_vehicle_sends_becomes_areas_and_warnings(items):
    """Nothing raises, and what is read can be sent."""
    fence, told = fence_from_wire(items)
    rally, also_told = rally_from_wire(items, HomePosition(0, 0, 1.0))
    mission = fenced_mission(fence=fence, rally=rally)
    found = fence_problems(mission, PX4)
    assert not [p for p in found if p.severity == "error" and p.code != "altitude"]
    count = sum(len(a.vertices_e7) for a in fence.polygons) + len(fence.circles) if fence else 0
    assert count + len(told) <= len(items)
    assert len(rally) + len(also_told) == len(items)
