"""What a vehicle tells of itself: settled values, texts in parts, its own clock."""

import pytest
from pymavlink.dialects.v20 import common

from mavplan.flight.telemetry import Settled, Telemetry, VehicleClock
from tests.flight.script import PX4_HOLD, PX4_MISSION, beat, landed, position
from tests.link.harness import HOME
from tests.link.script import OTHER_STATION, VEHICLE, said, text


def test_a_changed_value_counts_when_it_is_told_twice_half_a_second_apart():
    mode = Settled()
    assert mode.tell(1, 0.0)
    assert not mode.tell(2, 1.0)
    assert not mode.tell(2, 1.01)
    assert mode.value == 1
    assert mode.tell(2, 1.6)
    assert (mode.value, mode.since) == (2, 1.6)


def test_one_late_word_changes_nothing():
    mode = Settled()
    mode.tell(1, 0.0)
    for second in range(1, 5):
        mode.tell(2, float(second))
        mode.tell(1, second + 0.5)
    assert mode.value == 1


def test_another_systems_words_are_not_the_vehicles():
    telemetry = Telemetry(VEHICLE)
    telemetry.receive(
        said(common.MAVLink_heartbeat_message(2, 12, 0xD1, PX4_MISSION, 4, 3), OTHER_STATION), 1.0
    )
    assert (telemetry.heard_at, telemetry.mode_now) == (None, None)
    telemetry.receive(beat("px4", PX4_HOLD), 2.0)
    assert (telemetry.heartbeat_at, telemetry.mode_now, telemetry.armed_now) == (2.0, PX4_HOLD, False)


def part(words, number, chunk):
    return said(common.MAVLink_statustext_message(4, words.encode(), number, chunk))


def test_a_text_in_parts_is_told_whole_and_once():
    telemetry = Telemetry(VEHICLE)
    telemetry.receive(part("Preflight Fail: ", 7, 0), 1.0)
    telemetry.receive(part("no GPS\t", 7, 1), 1.1)
    assert telemetry.new_texts(1.2) == []
    (told,) = telemetry.new_texts(1.4)
    assert told.words == "Preflight Fail: no GPS"
    assert telemetry.new_texts(2.0) == []


def test_a_text_that_is_repeated_at_once_is_one_text():
    telemetry = Telemetry(VEHICLE)
    for at in (1.0, 1.1, 2.0):
        telemetry.receive(text("Battery 1 is low"), at)
    assert len(telemetry.new_texts(5.0)) == 1
    telemetry.receive(text("Battery 1 is low"), 9.0)
    assert len(telemetry.new_texts(10.0)) == 1


@pytest.mark.parametrize("pace", [1.0, 20.0])
def test_between_two_words_the_vehicles_clock_goes_on_at_its_own_pace(pace):
    clock = VehicleClock()
    assert clock.at(3.0) == 3.0
    for second in range(10):
        clock.tell(100.0 + pace * second, 50.0 + second)
    assert clock.at(59.0 + 4.0) == pytest.approx(100.0 + pace * 13.0)


def test_a_clock_that_begins_anew_is_followed_and_a_late_word_is_not():
    clock = VehicleClock()
    clock.tell(100.0, 0.0)
    clock.tell(99.5, 0.1)
    assert clock.at(0.1) == pytest.approx(100.1)
    clock.tell(2.0, 1.0)
    assert clock.at(1.0) == 2.0


def test_it_is_in_the_air_when_it_says_so_twice_or_is_seen_there_twice():
    telemetry = Telemetry(VEHICLE)
    telemetry.receive(landed(1), 0.0)
    telemetry.receive(landed(3), 1.0)
    assert telemetry.airborne_at is None
    telemetry.receive(landed(3), 2.0)
    assert telemetry.airborne_at == 2.0
    seen = Telemetry(VEHICLE)
    for at in (1.0, 1.2, 1.4):
        seen.receive(position(HOME, up_m=3.0), at)
    assert seen.airborne_at is None  # not armed: a vehicle that is carried
    seen.receive(beat("px4", PX4_MISSION, armed=True), 2.0)
    seen.receive(position(HOME, up_m=3.0), 2.1)
    assert seen.airborne_at is None
    seen.receive(position(HOME, up_m=3.0), 2.3)
    assert seen.airborne_at == 2.3
