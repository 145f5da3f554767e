"""What counts as "the vehicle holds what was sent": the real autopilots' recorded answers, and the table's limits."""

import dataclasses
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.link.protocol import received_item
from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.mission.readback import KEEPS, differences, float32
from mavplan.mission.wire import WireItem, to_wire
from tests.link.harness import make_mission
from tests.link.recordings import messages_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
needs_captures = pytest.mark.skipif(
    not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here"
)


@needs_captures
@pytest.mark.parametrize(
    ("name", "rules", "count"), [("ardupilot_upload_download", ARDUPILOT, 8), ("px4_upload_download", PX4, 7)]
)
def test_what_a_real_autopilot_gave_back_is_no_difference(name, rules, count):
    sent, stored = {}, {}
    for message in messages_of(CAPTURES / f"{name}.tlog"):
        if message.get_type() == "MISSION_ITEM_INT" and message.mission_type == 0:
            side = sent if message.get_srcSystem() == 255 else stored
            side.setdefault(message.seq, received_item(message))
    ours, theirs = (tuple(side[seq] for seq in range(count)) for side in (sent, stored))
    assert len(theirs) == count
    assert differences(ours, theirs, rules) == []


def sent_by(rules):
    return to_wire(make_mission(rules.name, 2), rules)


def changed(items, number, /, **fields):
    return tuple(dataclasses.replace(item, **fields) if item.seq == number else item for item in items)


@pytest.mark.parametrize(
    ("seq", "fields", "field"),
    [
        (4, {"param1": 7.0}, "param1"),
        (4, {"x": 374_009_002}, "x"),
        (4, {"y": -1_220_999_998}, "y"),
        (4, {"z": 30.02}, "z"),
        (4, {"frame": 0}, "frame"),
        (4, {"command": 16}, "command"),
        (4, {"param3": 2.0}, "param3"),
        (4, {"param4": 5.0}, "param4"),
        (2, {"param2": 7.0}, "param2"),
        (3, {"autocontinue": 0}, "autocontinue"),
        (3, {"seq": 4}, "seq"),
    ],
)
def test_anything_that_is_no_allowed_replacement_is_a_difference_with_its_place(seq, fields, field):
    items = sent_by(ARDUPILOT)
    (found,) = differences(items, changed(items, seq, **fields), ARDUPILOT)
    assert (found.seq, found.field) == (seq, field)
    assert f"item {seq}" in found.words


@pytest.mark.parametrize(
    ("seq", "fields"),
    [
        (0, {"x": 1, "y": 2, "z": 584.0}),
        (4, {"param3": 1.0}),
        (4, {"param4": 1.0}),
        (4, {"x": 374_009_001, "y": -1_221_000_001}),
        (4, {"z": 29.99}),
        (3, {"current": 1}),
    ],
)
def test_what_ardupilot_replaces_by_its_nature_is_none(seq, fields):
    items = sent_by(ARDUPILOT)
    assert differences(items, changed(items, seq, **fields), ARDUPILOT) == []


def test_px4_keeps_altitudes_and_holds_as_float32_and_nothing_less():
    items = sent_by(PX4)
    assert differences(items, changed(items, 4, z=float32(items[4].z)), PX4) == []
    assert [d.field for d in differences(items, changed(items, 4, z=items[4].z + 0.001), PX4)] == ["z"]
    assert [d.field for d in differences(items, changed(items, 3, param1=8.001), PX4)] == ["param1"]
    assert differences(items, changed(items, 3, param4=0.0), PX4) == []  # reads back as a flag
    assert [d.field for d in differences(items, changed(items, 2, param4=0.0), PX4)] == ["param4"]


def test_px4_wraps_a_heading_and_that_is_none():
    items = changed(sent_by(PX4), 2, param4=-90.0)
    assert differences(items, changed(items, 2, param4=270.0), PX4) == []
    assert [d.field for d in differences(items, changed(items, 2, param4=90.0), PX4)] == ["param4"]


def test_a_missing_or_added_item_is_a_difference_of_the_count():
    items = sent_by(ARDUPILOT)
    assert [d.field for d in differences(items, items[:-1], ARDUPILOT)] == ["count"]
    assert [d.field for d in differences(items, (), ARDUPILOT)] == ["count"]
    assert [d.field for d in differences(items, (*items, items[-1]), ARDUPILOT)] == ["count"]


fields = st.sampled_from(["frame", "command", "param1", "param2", "param3", "param4", "x", "y", "z"])


@given(st.sampled_from(["ardupilot", "px4"]), fields, st.integers(0, 6), st.integers(-(2**31), 2**31 - 1))
def test_only_the_tables_replacements_pass(name, field, index, value):
    """Whatever a vehicle puts into one field: it passes only if the table names it."""
    rules = AUTOPILOTS[name]
    items = sent_by(rules)
    stored = changed(items, items[index].seq, **{field: value})
    old = getattr(items[index], field)
    if rules.home_on_wire and index == 0:
        return
    kept = KEEPS[rules.name]
    tolerance = {"x": 1, "y": 1, "z": kept.alt_tolerance_m + 1e-4}.get(field, 0)
    if differences(items, stored, rules):
        assert old != value
    elif field in {"x", "y", "z"}:
        assert abs(old - value) <= tolerance
    elif field == "frame":
        assert {old, value} <= {3, 6} or {old, value} <= {0, 5} or {old, value} <= {0, 2}
    elif field == "command":
        assert old == value
    else:
        assert value in {-1, 0, 1} or old == value


def test_a_number_beyond_float32_is_compared_as_infinity_and_does_not_crash():
    assert float32(1e300) == math.inf
    item = WireItem(1, 3, 16, 0, 1, 1e300, 0, 0, 0, 0, 0, 0.0)
    assert differences([item], [dataclasses.replace(item, param1=5.0)], ARDUPILOT)
