"""Whatever mission can be written comes back the same, through both formats and through the checker."""

import contextlib
import json
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.formats import FORMATS
from mavplan.formats.checks import reader_problems
from mavplan.mission.model import NAN, Command, Frame, HomePosition, Mission, MissionItem

LAT = st.integers(-900_000_000, 900_000_000)
LON = st.integers(-1_800_000_000, 1_800_000_000)
ALT = st.floats(-400, 9000).map(lambda value: round(value, 4) + 0.0)
PARAM = st.one_of(
    st.sampled_from([0.0, -1.0, 0.1, 12.5, NAN]),
    st.floats(-1e5, 1e5, width=32).map(lambda value: value + 0.0),
)
HOLD = st.floats(0, 65_535, width=32).map(lambda value: value + 0.0)


@st.composite
def items(draw: st.DrawFn, count: int) -> MissionItem:
    """Any item that may stand in a mission of this many items."""
    command = draw(st.sampled_from(list(Command)))
    params = [draw(PARAM) for _ in range(4)]
    if command in (Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME):
        params[0] = draw(HOLD)
    if command == Command.DO_JUMP:
        params[0] = float(draw(st.integers(0, count - 1)))
    item = MissionItem(command, Frame.MISSION, (params[0], params[1], params[2], params[3]))
    if not item.has_position:
        return item
    frame = draw(st.sampled_from([Frame.GLOBAL, Frame.GLOBAL_RELATIVE_ALT]))
    return replace(item, frame=frame, lat_e7=draw(LAT), lon_e7=draw(LON), alt_m=draw(ALT))


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Any mission without an autopilot, for which every value of `items` is allowed."""
    count = draw(st.integers(1, 8))
    return Mission(
        items=tuple(draw(items(count)) for _ in range(count)),
        home=HomePosition(draw(LAT), draw(LON), draw(ALT)),
        cruise_speed_m_s=float(draw(st.integers(1, 20))),
        hover_speed_m_s=float(draw(st.integers(1, 20))),
    )


def without_nan(mission: Mission) -> Mission:
    """NaN as 0, as a text file has it."""
    return replace(
        mission,
        items=tuple(
            replace(item, params=tuple(0.0 if math.isnan(value) else value for value in item.params))
            for item in mission.items
        ),
    )


@given(missions())
@settings(deadline=None)
def test_a_plan_gives_back_every_value(mission: Mission) -> None:
    """Positions to 1e-7 degrees, parameters and altitudes to the last bit, NaN as NaN."""
    text = FORMATS[".plan"].dumps(mission)
    read = FORMATS[".plan"].loads(text, "m.plan")
    assert repr(replace(read, items=())) == repr(replace(mission, items=()))
    for one, other in zip(read.items, mission.items, strict=True):
        assert repr(replace(one, command=Command(one.command))) == repr(other)


@given(missions())
@settings(deadline=None)
def test_a_waypoints_file_gives_back_every_value_but_nan(mission: Mission) -> None:
    """Positions to 1e-7 degrees, parameters and altitudes to the last bit."""
    text = FORMATS[".waypoints"].dumps(mission)
    read = FORMATS[".waypoints"].loads(text, "m.waypoints")
    assert read.items == without_nan(mission).items
    assert read.home == mission.home


@given(missions())
@settings(deadline=None)
def test_the_checker_agrees_that_the_file_says_what_was_meant(mission: Mission) -> None:
    """No file of ours differs from its mission or breaks a reader's rule, whatever is in it."""
    about_the_flight = {"no-takeoff", "position", "home-altitude", "fraction", "param", "hold"}
    for mission_format in FORMATS.values():
        found = reader_problems(mission_format.dumps(mission), mission)
        assert not [problem for problem in found if problem.code not in about_the_flight]


@given(st.text())
@settings(deadline=None)
@pytest.mark.parametrize("suffix", FORMATS)
def test_no_text_does_worse_than_an_input_error(suffix: str, text: str) -> None:
    """Whatever stands in a file, reading ends with a mission or with problems, and the checker ends too."""
    for content in (text, "QGC WPL 110\n" + text, '{"mission": ' + text):
        reader_problems(content)
        with contextlib.suppress(InputError):
            FORMATS[suffix].loads(content, "file")


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)


@given(st.data())
@settings(deadline=None)
def test_no_value_anywhere_in_a_plan_does_worse_than_an_input_error(data: st.DataObject) -> None:
    """One value of a good plan, replaced by anything JSON can say, is taken or refused, never a crash."""
    item = MissionItem(Command.NAV_TAKEOFF, Frame.GLOBAL_RELATIVE_ALT, lat_e7=1, lon_e7=1, alt_m=9.0)
    document = json.loads(FORMATS[".plan"].dumps(Mission((item, item), HomePosition(0, 0, 5.0))))
    node = document
    while True:
        key = data.draw(st.sampled_from(range(len(node)) if isinstance(node, list) else sorted(node)))
        if not isinstance(node[key], dict | list) or not node[key] or data.draw(st.booleans()):
            break
        node = node[key]
    node[key] = data.draw(JSON)
    text = json.dumps(document)
    reader_problems(text)
    with contextlib.suppress(InputError):
        FORMATS[".plan"].loads(text, "m.plan")
