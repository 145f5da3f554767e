"""What a transfer should know of its surroundings: restarts, other stations, texts."""

import pytest
from pymavlink.dialects.v20 import common

from mavplan.link.protocol import Address
from mavplan.link.watch import Watch
from tests.link.script import OTHER_STATION, US, VEHICLE, ack, count, heartbeat, item, request, said, text


def system_time(boot_ms):
    return said(common.MAVLink_system_time_message(0, boot_ms))


def timesync(seconds, tc1=0):
    return said(common.MAVLink_timesync_message(tc1, int(seconds * 1e9)))


def watching(*messages):
    watch = Watch(VEHICLE, US)
    for at, message in enumerate(messages):
        watch.receive(message, float(at))
    return watch


@pytest.mark.parametrize("make", [lambda s: system_time(s * 1000), timesync])
def test_a_clock_that_begins_anew_is_a_restart_counted_once(make):
    assert watching(make(40), make(41), make(2), make(3), make(4)).reboots == 1
    assert watching(make(40), make(41), make(42)).reboots == 0


def test_a_message_that_was_overtaken_is_no_restart():
    assert (
        watching(system_time(40_000), system_time(42_000), system_time(40_500), system_time(43_000)).reboots
        == 0
    )


def test_an_answer_to_our_own_time_stamp_is_no_clock_of_the_vehicle():
    assert watching(timesync(1000), timesync(5, tc1=1)).reboots == 0


@pytest.mark.parametrize(
    "message",
    [
        count(3, by=OTHER_STATION, to=VEHICLE),
        item(0, by=OTHER_STATION, to=VEHICLE),
        said(common.MAVLink_mission_clear_all_message(1, 1, 0), OTHER_STATION),
        said(common.MAVLink_mission_clear_all_message(1, 1, 255), OTHER_STATION),
        said(common.MAVLink_mission_clear_all_message(0, 0, 0), OTHER_STATION),
        request(0, to=OTHER_STATION),
        ack(0, to=OTHER_STATION),
    ],
)
def test_another_stations_writing_is_noticed(message):
    assert watching(message).foreign_writes == 1


@pytest.mark.parametrize(
    "message",
    [
        count(3, to=OTHER_STATION),
        item(0, to=OTHER_STATION),
        said(common.MAVLink_mission_request_list_message(1, 1, 0), OTHER_STATION),
        count(3, by=OTHER_STATION, to=Address(2, 1)),
        count(3, by=OTHER_STATION, to=VEHICLE, kind=1),
        request(0),
        ack(0),
    ],
)
def test_reading_and_our_own_transfer_are_no_foreign_writing(message):
    assert watching(message).foreign_writes == 0


def test_warnings_are_kept_and_chatter_is_not_and_the_capacity_is_understood():
    watch = watching(text("Flight plan received", 6), text("Only 650 items are supported"))
    assert watch.texts == ["Only 650 items are supported"]
    assert watch.space == 650


def test_a_text_in_pieces_is_put_together():
    words = "Mission rejected: the first waypoint is too far from home"
    first = said(common.MAVLink_statustext_message(2, words[:50].encode(), 7, 0))
    second = said(common.MAVLink_statustext_message(2, words[50:].encode(), 7, 1))
    assert watching(first, second).texts == [words]


def test_arming_is_seen():
    assert watching(heartbeat(base_mode=81 | 128)).armed
    assert not watching(heartbeat(base_mode=81 | 128), heartbeat()).armed


def test_a_refusal_that_another_station_got_is_a_sign_that_it_will_try_again():
    watch = watching(ack(14, to=OTHER_STATION))
    assert (watch.foreign_writes, watch.foreign_signs) == (0, 1)
