"""Which places and legs a mission flies, and that what passes the check is not what a vehicle would object to."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.geo import LocalPlane
from mavplan.mission.autopilots import PX4
from mavplan.mission.fence_check import flown_legs, mission_breaches
from mavplan.mission.fence_wire import fence_to_wire
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.mission.model import NAN, Command, Frame, MissionItem
from mavplan.mission.wire import to_wire
from sitl_mock.feasibility import breaks_fence, infeasible_because
from sitl_mock.items import MissionType, StoredItem
from sitl_mock.px4_items import keep_item
from tests.fences import HOME, box, circle, fenced_mission, fences, place_e7, rally_points

NAMES = {2: "stop 1", 3: "stop 2"}
"""Of the items of `fenced_mission` with two stops."""


def leg_names(mission, names=NAMES):
    return [leg.name for leg in flown_legs(mission, names)]


def said(mission, **options):
    return [str(problem) for problem in mission_breaches(mission, names=NAMES, **options)]


def test_the_legs_of_a_mission_begin_and_end_at_home():
    """Take-off is above home, the return goes back to it."""
    assert leg_names(fenced_mission()) == [
        "leg from home to item 2 (NAV_TAKEOFF)",
        "leg from item 2 (NAV_TAKEOFF) to stop 1",
        "leg from stop 1 to stop 2",
        "return from stop 2 to home",
    ]
    assert not any(leg.returning for leg in flown_legs(fenced_mission(end="land")))


def test_a_return_may_end_at_the_rally_point_that_is_nearer():
    """Both ways are looked at: which of them it is depends on the vehicle's parameters."""
    near, far = (
        RallyPoint(*place_e7(*at), 30.0, name) for at, name in (((290, 150), "barn"), ((-900, 0), ""))
    )
    names = leg_names(fenced_mission(rally=[far, near]))
    assert names[-2:] == ["return from stop 2 to home", "return from stop 2 to rally point 2 (barn)"]
    assert leg_names(fenced_mission(rally=[far]))[-1] == "return from stop 2 to home"


def test_a_jump_is_flown_from_where_it_jumps():
    """Stop 2, back to stop 1: a leg of its own; an endless loop ends here."""
    mission = fenced_mission(((0.0, 200.0), (300.0, 200.0), (300.0, -200.0)))
    jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (2.0, -1.0, 0.0, 0.0))
    items = (*mission.items[:5], jump, *mission.items[5:])
    names = leg_names(replace(mission, items=items), {2: "a", 3: "b", 4: "c"})
    assert "leg from c to a" in names
    assert "return from c to home" in names
    assert len(names) == len(set(names)) == 6


def test_altitudes_that_are_none_do_not_keep_a_loop_going():
    """PX4 takes a NaN altitude, and NaN differs from itself."""
    jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (0.0, -1.0, 0.0, 0.0))
    items = [
        MissionItem(Command.NAV_WAYPOINT, frame, (0.0,) * 4, *place_e7(10, 10), alt)
        for frame, alt in ((0, math.nan), (3, float("nan")), (10, 5.0), (0, 700.0))
    ]
    legs = flown_legs(replace(fenced_mission(), items=(*items, jump)))
    assert [leg.end.alt_rel_m for leg in legs[:3]] == [NAN] * 3 or all(
        math.isnan(leg.end.alt_rel_m) for leg in legs[:3]
    )
    assert legs[3].end.alt_rel_m == 100.0


def test_here_is_no_place_on_ardupilot():
    """Take-off at 0, 0 climbs where it stands; PX4 would fly there."""
    mission = fenced_mission()
    takeoff = replace(mission.items[1], lat_e7=0, lon_e7=0)
    items = (mission.items[0], takeoff, *mission.items[2:])
    assert leg_names(replace(mission, items=items))[0] == "leg from home to stop 1"
    assert (
        leg_names(replace(mission, items=items, autopilot="px4"))[0]
        == "leg from home to item 2 (NAV_TAKEOFF)"
    )


def test_a_mission_well_within_has_no_problem_and_without_a_fence_neither():
    """Areas of both kinds; None where there is nothing to check."""
    fence = Fence((box(-100, -100, 500, 500), box(100, -80, 200, -20, False)), (circle(0, 0, 1000),))
    assert said(fenced_mission(fence=fence)) == []
    assert said(fenced_mission()) == []
    assert said(fenced_mission(), fence=fence) == []


@pytest.mark.parametrize(
    ("fence", "words"),
    [
        (Fence((box(-100, -100, 200, 500),)), ["stop 2: lies 100", "outside fence polygon 1 (inclusion)"]),
        (Fence((box(250, 150, 350, 250, False),)), ["stop 2: lies 50", "inside fence polygon 1 (exclusion)"]),
        (
            Fence((), (circle(300, 200, 30, False),)),
            ["stop 2: lies 30.0 m inside fence circle 1 (exclusion)"],
        ),
        (Fence((box(100, 150, 200, 250, False),)), ["leg from stop 1 to stop 2: crosses fence polygon 1"]),
        (Fence((box(100, 50, 200, 150, False),)), ["return from stop 2 to home: crosses fence polygon 1"]),
        (Fence((), (circle(150, 200, 30, False),)), ["leg from stop 1 to stop 2: crosses fence circle 1"]),
        (Fence((box(-100, -100, 302, 500),)), ["stop 2: lies within 2.", "3.0 m are to be kept"]),
        (Fence((box(100, 202, 200, 300, False),)), ["leg from stop 1 to stop 2: comes within 2."]),
        (Fence((), (circle(0, 0, 365),)), ["stop 2: lies within 3.", "5.6 m are to be kept"]),
    ],
)
def test_what_leaves_the_fence_is_named_once(fence, words):
    """The place, or where both its ends are good the leg, and the area."""
    (found,) = said(fenced_mission(fence=fence))
    assert all(word in found for word in words), found


def test_a_notch_between_two_good_stops_is_seen():
    """Both ends in the fence, the way between them not."""
    notched = box(-100, -100, 500, 500)
    corners = (*notched.vertices_e7[:2], place_e7(140, 500), place_e7(150, 190), place_e7(160, 500))
    fence = Fence((replace(notched, vertices_e7=(*corners, *notched.vertices_e7[2:])),))
    assert said(fenced_mission(fence=fence)) == [
        "leg from stop 1 to stop 2: leaves fence polygon 1 (inclusion)"
    ]


def test_inside_one_of_two_inclusions_is_not_enough():
    """Both autopilots want a vehicle in every one."""
    fence = Fence((box(-100, -100, 400, 400),), (circle(0, 0, 250),))
    found = said(fenced_mission(fence=fence))
    assert len(found) == 1
    assert "stop 2: lies 1" in found[0]
    assert "outside fence circle 1" in found[0]


def test_home_and_rally_points_are_places_too():
    """Home first, rally points last, each with its own name."""
    fence = Fence((box(-50, 20, 500, 500),))
    found = said(fenced_mission(fence=fence, rally=[RallyPoint(*place_e7(-200, 100), 30.0, "barn")]))
    assert [line.partition(":")[0] for line in found] == ["home", "rally point 1 (barn)"]


def px4_stored(mission):
    kept = [
        [
            keep_item(StoredItem(*(getattr(item, name) for name in FIELDS)), kind, as_int=True)
            for item in items
        ]
        for kind, items in (
            (MissionType.MISSION, to_wire(mission, PX4)),
            (MissionType.FENCE, fence_to_wire(mission, PX4)),
        )
    ]
    return kept[0], kept[1]


FIELDS = (
    "seq",
    "frame",
    "command",
    "current",
    "autocontinue",
    "param1",
    "param2",
    "param3",
    "param4",
    "x",
    "y",
    "z",
)
stops = st.lists(st.tuples(st.floats(-2000, 2000), st.floats(-2000, 2000)), min_size=1, max_size=4)


@given(stops, fences, st.lists(rally_points, max_size=2))
@settings(deadline=None, max_examples=150)
def test_what_passes_is_not_judged_a_violation_anywhere_along_the_way(stops_m, fence, rally):
    """The mock vehicle's own test, at its waypoints after the upload and at 50 points of every leg in flight."""
    mission = fenced_mission(stops_m, fence=fence or None, rally=rally, autopilot="px4")
    if mission_breaches(mission):
        return
    items, areas = px4_stored(mission)
    assert infeasible_because(items, areas, None) is None
    plane = LocalPlane(HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7)
    for leg in flown_legs(mission):
        ends_m = plane.to_xy_m(
            *zip(*((p.lat_e7 / 1e7, p.lon_e7 / 1e7) for p in (leg.start, leg.end)), strict=True)
        )
        along_m = ends_m[0] + np.linspace(0, 1, 50)[:, None] * (ends_m[1] - ends_m[0])
        for lat_e7, lon_e7 in zip(*plane.to_e7(along_m), strict=True):
            for start, stop in _groups(areas):
                assert not breaks_fence(int(lat_e7), int(lon_e7), areas[start:stop])


def _groups(areas):
    """Every area by itself: a vehicle that wants it in all of them judges each."""
    at = 0
    while at < len(areas):
        size = int(areas[at].param1) if areas[at].command in (5001, 5002) else 1
        yield at, at + size
        at += size


@given(stops, fences)
@settings(deadline=None, max_examples=150)
def test_what_the_vehicle_would_judge_a_violation_is_found(stops_m, fence):
    """Never the other way round, at any margin: not even 0."""
    mission = fenced_mission(stops_m, fence=fence or None, autopilot="px4")
    items, areas = px4_stored(mission)
    if infeasible_because(items, areas, None) is not None:
        assert mission_breaches(mission, margin_m=0.1)


@pytest.mark.parametrize(
    "fence", [Fence((box(-900, -900, 900, 900),)), Fence((), (circle(0, 0, 900, False),))]
)
def test_a_latitude_beyond_the_pole_is_not_taken_for_inside(fence):
    """PX4 stores such an item; whoever downloads it must not be told that all is well."""
    mission = fenced_mission(autopilot="px4")
    items = (*mission.items[:2], replace(mission.items[2], lat_e7=910_000_000), *mission.items[3:])
    found = said(replace(mission, items=items), fence=fence)
    assert any(line.startswith("stop 1: is no place") for line in found) or "stop 1: lies" in "".join(found)
