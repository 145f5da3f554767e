"""The check before sending and the table of the read-back agree with each other, and with the mock's own table."""

import dataclasses
import math

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Command, Frame, Mission, MissionItem
from mavplan.mission.wire import wire_problems
from tests.link.harness import HOME, make_mission, make_network, upload

small = st.sampled_from([0.0, 1.0, -1.0, 2.0, 0.5, 7.6, 8.25, 90.0, -90.0, 361.0, 65_535.0, math.nan])
params = st.tuples(small | st.floats(width=32), small, small, small)
altitudes = st.sampled_from([2.1, 30.0, 99.99, 0.015, -3.3, 120.55]) | st.floats(-500, 9_000)
places = st.builds(
    MissionItem,
    st.sampled_from(
        [
            Command.NAV_WAYPOINT,
            Command.NAV_LOITER_TIME,
            Command.NAV_LOITER_UNLIM,
            Command.NAV_LAND,
            Command.NAV_TAKEOFF,
        ]
    ),
    st.sampled_from(
        [Frame.GLOBAL, Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_INT, Frame.GLOBAL_RELATIVE_ALT_INT]
    ),
    params,
    st.integers(HOME.lat_e7 - 50_000, HOME.lat_e7 + 50_000),
    st.integers(HOME.lon_e7 - 50_000, HOME.lon_e7 + 50_000),
    altitudes,
    st.booleans(),
)
bare = st.builds(
    MissionItem,
    st.sampled_from(
        [Command.DO_CHANGE_SPEED, Command.NAV_DELAY, Command.DO_JUMP, Command.NAV_RETURN_TO_LAUNCH]
    ),
    st.just(Frame.MISSION),
    params,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.sampled_from(["ardupilot", "px4"]), st.lists(places | bare, min_size=1, max_size=3))
def test_a_mission_without_problems_is_stored_as_sent_by_the_mock(firmware, items):
    """What passes the check never comes back as a difference, nor is it refused as an item."""
    base = make_mission(firmware, 0)
    mission = Mission((base.items[0], *items), HOME, firmware)
    good = [
        item
        for item in items
        if not wire_problems(dataclasses.replace(mission, items=(base.items[0], item)), AUTOPILOTS[firmware])
    ]
    assume(good)
    mission = dataclasses.replace(mission, items=(base.items[0], *good))
    assume(not wire_problems(mission, AUTOPILOTS[firmware]))
    result = upload(mission, make_network(firmware), system=1)
    judged = result.error is not None and "judges the mission not flyable" in str(result.error)
    assert result.verified or judged, (result.error, mission.items)
