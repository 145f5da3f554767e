"""What goes on the wire, what comes from it, and what must never be sent."""

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.readback import differences
from mavplan.mission.wire import WireItem, from_wire, to_wire, wire_problems
from tests.link.harness import HOME, make_mission

RELATIVE = Frame.GLOBAL_RELATIVE_ALT
LAT, LON = HOME.lat_e7, HOME.lon_e7
TAKEOFF = MissionItem(Command.NAV_TAKEOFF, RELATIVE, (0, 0, 0, 0), LAT, LON, 30.0)


def mission_of(*items: MissionItem, autopilot="ardupilot", home=HOME):
    return Mission((TAKEOFF, *items), home, autopilot)


def waypoint(**changes):
    return dataclasses.replace(
        MissionItem(Command.NAV_WAYPOINT, RELATIVE, (0, 0, 0, 0), LAT + 9000, LON, 30.0), **changes
    )


def loiter(hold_s, **changes):
    return dataclasses.replace(
        MissionItem(Command.NAV_LOITER_TIME, RELATIVE, (hold_s, 0, 0, 0), LAT + 9000, LON, 30.0), **changes
    )


def codes(mission, rules=ARDUPILOT):
    return [problem.code for problem in wire_problems(mission, rules)]


def test_home_is_item_0_for_ardupilot_so_that_the_takeoff_is_not_lost():
    items = to_wire(make_mission("ardupilot", 1), ARDUPILOT)
    assert [item.seq for item in items] == [0, 1, 2, 3, 4, 5]
    assert (items[0].command, items[0].frame, items[0].x, items[0].y, items[0].z) == (16, 0, LAT, LON, 10.0)
    assert items[1].command == Command.NAV_TAKEOFF
    assert [item.current for item in items] == [0] * 6


def test_px4_gets_no_home_and_a_current_flag_on_the_first_item():
    items = to_wire(make_mission("px4", 1), PX4)
    assert items[0].command == Command.NAV_TAKEOFF
    assert [item.current for item in items] == [1, 0, 0, 0, 0]


def test_items_without_a_position_go_in_the_frame_the_autopilot_wants():
    assert {item.frame for item in to_wire(make_mission("px4", 1), PX4) if item.command in {20, 178}} == {2}
    assert {
        item.frame for item in to_wire(make_mission("ardupilot", 1), ARDUPILOT) if item.command in {20, 178}
    } == {0}


@pytest.mark.parametrize(("rules", "target"), [(ARDUPILOT, 2.0), (PX4, 1.0)])
def test_a_jump_is_renumbered_where_home_takes_number_0_and_back(rules, target):
    jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (1, 3, 0, 0))
    items = to_wire(mission_of(waypoint(), jump, autopilot=rules.name), rules)
    assert items[-1].param1 == target
    mission, _ = from_wire(items, rules)
    assert mission.items[-1].params[0] == 1


def test_nan_heading_becomes_0_for_ardupilot_which_ignores_it_and_stays_for_px4():
    nan = (0.0, 0.0, 0.0, math.nan)
    assert to_wire(mission_of(waypoint(params=nan)), ARDUPILOT)[-1].param4 == 0
    assert math.isnan(to_wire(mission_of(waypoint(params=nan)), PX4)[-1].param4)


@pytest.mark.parametrize("name", ["ardupilot", "px4"])
def test_what_was_sent_and_comes_back_is_the_mission_that_was_meant(name):
    mission, rules = make_mission(name, 3), AUTOPILOTS[name]
    back, warnings = from_wire(to_wire(mission, rules), rules, mission.home)
    assert differences(to_wire(mission, rules), to_wire(back, rules), rules) == []
    assert back.home == mission.home
    assert warnings == ()


def test_int_frames_come_back_as_the_plain_ones_of_files():
    item = WireItem(0, 6, 22, 1, 1, 0, 0, 0, 0, LAT, LON, 30.0)
    mission, _ = from_wire([item, dataclasses.replace(item, seq=1, frame=5)], PX4)
    assert [item.frame for item in mission.items] == [3, 0]


def test_without_any_home_the_first_position_stands_in_and_a_warning_says_so():
    items = to_wire(make_mission("px4", 1), PX4)
    mission, warnings = from_wire(items, PX4)
    assert (mission.home.lat_e7, mission.home.lon_e7) == (LAT, LON)
    assert [problem.code for problem in warnings] == ["no-home"]
    no_home_yet = dataclasses.replace(to_wire(make_mission("ardupilot", 1), ARDUPILOT)[0], x=0, y=0, z=0)
    _, warnings = from_wire([no_home_yet, *to_wire(make_mission("ardupilot", 1), ARDUPILOT)[1:]], ARDUPILOT)
    assert [problem.code for problem in warnings] == ["no-home"]


def test_the_given_home_stands_where_the_wire_has_none():
    given_home = HomePosition(1, 2, 3.0)
    mission, warnings = from_wire(to_wire(make_mission("px4", 1), PX4), PX4, given_home)
    assert mission.home == given_home
    assert not warnings


def test_a_good_mission_has_no_problems():
    assert codes(make_mission("ardupilot")) == []
    assert codes(make_mission("px4"), PX4) == []


@pytest.mark.parametrize(
    ("item", "code"),
    [
        (loiter(7.6), "hold-fraction"),
        (loiter(0.9), "hold-range"),
        (loiter(0), "hold-range"),
        (loiter(-1), "hold-range"),
        (loiter(70_000), "hold-range"),
        (loiter(5e9), "hold-range"),
        (loiter(math.inf), "hold-range"),
        (loiter(math.nan), "hold-nan"),
        (waypoint(params=(7.6, 0, 0, 0)), "hold-fraction"),
        (loiter(8, params=(8, 0, 0, math.nan)), "nan"),
        (loiter(8, params=(8, math.nan, 0, 0)), "nan"),
        (waypoint(params=(0, math.nan, 0, 0)), "nan"),
        (waypoint(lat_e7=910_000_000), "latitude"),
        (waypoint(lon_e7=-1_810_000_000), "longitude"),
        (waypoint(lat_e7=2**31), "latitude"),
        (waypoint(lat_e7=0, lon_e7=0), "at-zero"),
        (waypoint(alt_m=math.nan), "altitude"),
        (waypoint(alt_m=83_000.0), "altitude"),
        (waypoint(frame=Frame.GLOBAL_TERRAIN_ALT), "terrain-frame"),
        (waypoint(frame=Frame.MISSION), "frame"),
        (waypoint(frame=7), "frame"),
        (waypoint(params=(0, 1e300, 0, 0)), "param-range"),
        (waypoint(params=(0, 0, 0, 400.0)), "heading"),
        (waypoint(command=Command.NAV_LAND, params=(2.5, 0, 0, 0)), "param-whole"),
        (waypoint(command=Command.NAV_LOITER_UNLIM, params=(0, 0, 2.5, 0)), "param-whole"),
        (MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (0.5, 5, -1, 0)), "param-whole"),
        (MissionItem(Command.NAV_DELAY, Frame.MISSION, (1.5, 200, 0, 0)), "param-whole"),
        (MissionItem(112, Frame.MISSION), "command"),
        (MissionItem(0, Frame.MISSION), "command"),
        (MissionItem(70_000, Frame.MISSION), "command"),
        (MissionItem(Command.DO_JUMP, Frame.MISSION, (9, 1, 0, 0)), "jump-target"),
        (MissionItem(Command.DO_JUMP, Frame.MISSION, (0.5, 1, 0, 0)), "jump-target"),
        (MissionItem(Command.DO_JUMP, Frame.MISSION, (math.inf, 1, 0, 0)), "jump-target"),
        (MissionItem(Command.DO_JUMP, Frame.MISSION, (0, 1.5, 0, 0)), "jump-repeats"),
        (
            MissionItem(Command.NAV_RETURN_TO_LAUNCH, RELATIVE, (0, 0, 0, 0), LAT, LON, 5.0),
            "position-dropped",
        ),
        (dataclasses.replace(TAKEOFF, alt_m=0.0), "takeoff-altitude"),
        (dataclasses.replace(TAKEOFF, frame=Frame.GLOBAL, alt_m=9.0), "takeoff-altitude"),
    ],
)
def test_what_ardupilot_would_change_refuse_or_choke_on_is_found_before_sending(item, code):
    assert code in codes(mission_of(item))


@pytest.mark.parametrize(
    "item", [loiter(8), loiter(65_535), waypoint(params=(0, 0, 0, math.nan)), waypoint(params=(3, 0, 0, 0))]
)
def test_what_ardupilot_keeps_is_no_problem(item):
    assert codes(mission_of(item)) == []


def test_px4_keeps_fractions_and_nan_headings_but_flies_a_takeoff_at_0_0():
    assert codes(mission_of(loiter(8.25, params=(8.25, 0, 0, math.nan)), autopilot="px4"), PX4) == []
    takeoff = dataclasses.replace(TAKEOFF, lat_e7=0, lon_e7=0)
    assert codes(Mission((takeoff,), HOME, "px4"), PX4) == ["at-zero"]
    assert codes(Mission((takeoff,), HOME, "ardupilot")) == []


@pytest.mark.parametrize("rules", [ARDUPILOT, PX4])
def test_a_mission_that_does_not_begin_with_a_takeoff_is_found(rules):
    assert codes(Mission((waypoint(), TAKEOFF), HOME, rules.name), rules) == ["takeoff-first"]
    speed = MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (1, 5, -1, 0))
    assert codes(Mission((speed, TAKEOFF), HOME, rules.name), rules) == []
    assert "takeoff-first" in codes(Mission((speed,), HOME, rules.name), rules)


def test_an_empty_mission_and_one_beyond_the_count_are_found():
    assert codes(Mission((), HOME, "ardupilot")) == ["empty"]
    many = Mission((TAKEOFF, *[waypoint()] * 65_534), HOME, "ardupilot")
    assert codes(many) == ["too-many"]
    assert codes(many, PX4) == []


def test_a_bad_home_is_found_for_ardupilot_checks_it():
    assert codes(mission_of(waypoint(), home=HomePosition(900_000_001, 0, 0.0))) == ["latitude"]
    assert codes(mission_of(waypoint(), home=HomePosition(0, 0, math.nan))) == ["altitude"]


def test_problems_name_the_item_by_its_number_on_the_wire():
    assert str(wire_problems(mission_of(loiter(7.6)), ARDUPILOT)[0]).startswith("item 2 (NAV_LOITER_TIME): ")
    assert "item 1 (NAV_LOITER_TIME)" in str(wire_problems(mission_of(loiter(0)), PX4)[0])


numbers = st.floats(width=32) | st.floats() | st.integers(-(2**40), 2**40).map(float)
any_items = st.lists(
    st.builds(
        MissionItem,
        st.sampled_from([*Command, 0, 1, 112, 70_000]),
        st.sampled_from([0, 2, 3, 5, 6, 10, 11, 99]),
        st.tuples(numbers, numbers, numbers, numbers),
        st.integers(-(2**40), 2**40),
        st.integers(-(2**40), 2**40),
        numbers,
    ),
    max_size=4,
)


@given(any_items, st.sampled_from([ARDUPILOT, PX4]))
def test_whatever_passes_the_check_can_be_packed_and_whatever_fails_never_crashes_it(items, rules):
    from mavplan.link.codec import Codec
    from mavplan.link.protocol import Address, mission_item

    mission = Mission((TAKEOFF, *items), HOME, rules.name)
    if not wire_problems(mission, rules):
        for item in to_wire(mission, rules):
            Codec().encode(mission_item(Address(1, 1), item, 0))
