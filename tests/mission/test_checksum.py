"""PX4's id of a mission, as real vehicles were recorded to give it."""

from pathlib import Path

import pytest

from mavplan.link.protocol import opaque_id, received_item
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.checksum import px4_id
from mavplan.mission.uploadable import lists_to_send
from tests.link.fenced import fenced
from tests.link.harness import make_network, upload
from tests.link.recordings import messages_of

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"


@pytest.mark.skipif(not CAPTURES.is_dir(), reason="the recordings of real autopilots are not here")
@pytest.mark.parametrize("name", ["px4_upload_download", "px4_flight", "px4_flight_full"])
def test_the_id_of_a_recorded_upload_is_the_one_in_its_acknowledgement(name):
    items, ids = {}, []
    for message in messages_of(CAPTURES / f"{name}.tlog"):
        kind, from_us = message.get_type(), message.get_srcSystem() == 255
        if kind == "MISSION_COUNT" and from_us:
            items = {}
        elif kind == "MISSION_ITEM_INT" and from_us:
            items[message.seq] = received_item(message)
        elif kind == "MISSION_ACK" and not from_us and message.type == 0 and items and opaque_id(message):
            ids.append((px4_id(items[seq] for seq in sorted(items)), opaque_id(message)))
            items = {}
    assert ids
    for ours, theirs in ids:
        assert ours == theirs


def test_every_list_has_the_id_that_the_vehicle_announces():
    """Against the mock's own computation, which shares no code with ours."""
    mission, network = fenced("px4"), make_network("px4")
    result = upload(mission, network)
    assert result.session.report.opaque_id == px4_id(result.session.items)
    lists = lists_to_send(mission, AUTOPILOTS["px4"])
    assert {kind: px4_id(items) for kind, items in lists.items()} == network.autopilot._missions._ids
