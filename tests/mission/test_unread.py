"""The headings of PX4's holds, which do not read back."""

import dataclasses
import math

import pytest

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.checksum import px4_id
from mavplan.mission.model import Command
from mavplan.mission.unread import with_headings
from mavplan.mission.wire import to_wire
from tests.link.harness import make_mission

PX4 = AUTOPILOTS["px4"]


def sent(heading, stops=2):
    return [
        dataclasses.replace(item, param4=heading) if item.command == Command.NAV_LOITER_TIME else item
        for item in to_wire(make_mission("px4", stops), PX4)
    ]


def read_back(items):
    """As PX4 gives them: frame 6 for 3, a flag for the heading."""
    flag = 1.0
    return [
        dataclasses.replace(
            item,
            frame=6 if item.frame == 3 else item.frame,
            param4=flag if item.command == Command.NAV_LOITER_TIME else item.param4,
        )
        for item in items
    ]


def headings(items):
    return [item.param4 for item in items if item.command == Command.NAV_LOITER_TIME]


@pytest.mark.parametrize("frame", [3, 6])
def test_the_checksum_of_holds_along_the_track_tells_so_in_either_spelling_of_the_frame(frame):
    items = [
        dataclasses.replace(item, frame=frame if item.frame == 3 else item.frame) for item in sent(math.nan)
    ]
    found, sure = with_headings(read_back(items), px4_id(items))
    assert sure
    assert all(math.isnan(heading) for heading in headings(found))


def test_a_heading_that_happens_to_be_the_flag_is_kept():
    items = sent(1.0)
    found, sure = with_headings(read_back(items), px4_id(items))
    assert (sure, headings(found)) == (True, [1.0, 1.0])


@pytest.mark.parametrize("announced", [None, 12345])
def test_without_a_checksum_that_fits_the_nose_goes_along_the_track_and_that_is_not_sure(announced):
    found, sure = with_headings(read_back(sent(90.0)), announced)
    assert not sure
    assert all(math.isnan(heading) for heading in headings(found))


def test_a_mission_without_holds_is_as_it_was_read():
    items = tuple(to_wire(make_mission("px4", 0), PX4))
    assert with_headings(items, None) == (items, True)
