"""PX4's judgement after its ACK, as MISSION_CURRENT tells it."""

import struct

import pytest
from pymavlink.dialects.v20 import common

from mavplan.link.codec import Codec
from mavplan.link.protocol import Address
from mavplan.link.verdict import GIVE_UP_S, Judgement, Verdict
from tests.link.script import VEHICLE


def current(state, total=5, mission_id=None, by=VEHICLE):
    """MISSION_CURRENT with PX4's extension fields, which the dialect does not know."""
    payload = struct.pack("<HHBB", 0, total, state, 1) + struct.pack("<I", mission_id or 0)
    header = bytes([len(payload), 0, 0, 0, by.system, by.component, 42, 0, 0])
    crc = common.x25crc(header + payload)
    crc.accumulate(bytes([common.MAVLink_mission_current_message.crc_extra]))
    (message,) = Codec().decode(b"\xfd" + header + payload + struct.pack("<H", crc.crc), 0.0)
    return message


def judge(*heard, mission_id=None):
    verdict = Verdict(VEHICLE, 5, mission_id, not_before=2.0)
    for at, message in heard:
        verdict.receive(message, at)
    return verdict


@pytest.mark.parametrize(
    ("state", "judgement"),
    [
        (1, Judgement.INFEASIBLE),
        (2, Judgement.FLYABLE),
        (3, Judgement.FLYABLE),
        (5, Judgement.FLYABLE),
        (0, Judgement.UNKNOWN),
    ],
)
def test_the_state_is_the_judgement(state, judgement):
    assert judge((2.1, current(state))).outcome is judgement


@pytest.mark.parametrize("state", [1, 2])
def test_what_is_said_too_soon_may_be_about_the_mission_before(state):
    assert judge((1.9, current(state))).outcome is None


def test_another_total_or_another_id_is_another_mission():
    assert judge((2.1, current(2, total=4))).other_mission
    assert judge((2.1, current(2, mission_id=7)), mission_id=8).other_mission
    assert not judge((2.1, current(2, mission_id=8)), mission_id=8).other_mission


def test_another_vehicle_is_not_asked():
    assert judge((2.1, current(1, by=Address(2, 1)))).outcome is None


def test_it_asks_twice_a_second_and_gives_up_at_last():
    verdict = judge()
    times = []
    while (timer := verdict.next_timer()) is not None:
        verdict.tick(timer)
        times += [timer for message in verdict.to_send() if message.param1 == 42]
    assert times[:3] == [2.0, 2.5, 3.0]
    assert verdict.outcome is Judgement.UNKNOWN
    assert timer is None
    assert times[-1] < 2.0 + GIVE_UP_S
