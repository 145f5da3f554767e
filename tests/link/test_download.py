"""The download against a vehicle that loses, overtakes, forgets and changes its mind."""

import pytest

from mavplan.link.download import Download, DownloadEnd
from mavplan.link.manners import MANNERS
from mavplan.link.protocol import Address
from mavplan.link.transfer import State
from tests.link.script import OTHER_STATION, US, VEHICLE, ack, count, item, outgoing, request, until


def opened(autopilot="px4", deadline=60.0):
    download = Download(MANNERS[autopilot], VEHICLE, US, now=0.0, deadline=deadline)
    download.tick(0.0)
    assert outgoing(download) == ["LIST"]
    return download


def hear(download, message, now):
    download.receive(message, now)
    return outgoing(download)


def test_every_item_is_asked_for_in_order_and_the_end_is_acknowledged():
    download = opened()
    assert hear(download, count(2), 0.0) == ["REQUEST 0"]
    assert hear(download, item(0), 0.1) == ["REQUEST 1"]
    assert hear(download, item(1), 0.2) == ["ACK 0"]
    assert download.outcome.end is DownloadEnd.COMPLETE
    assert [found.seq for found in download.outcome.items] == [0, 1]


def test_an_empty_vehicle_gives_nothing_and_gets_its_ack():
    download = opened()
    assert hear(download, count(0), 0.1) == ["ACK 0"]
    assert download.outcome.items == ()


def test_list_or_count_lost_the_list_is_asked_for_again():
    assert [words for _, words in until(opened(), 2.0)] == ["LIST"] * 4


def test_request_or_item_lost_the_request_is_sent_again():
    download = opened()
    hear(download, count(2), 0.0)
    assert {words for _, words in until(download, 2.0)} == {"REQUEST 0"}
    assert hear(download, item(0), 2.0) == ["REQUEST 1"]


def test_items_that_come_twice_or_unasked_are_not_taken_twice():
    download = opened()
    hear(download, count(3), 0.0)
    hear(download, item(0), 0.1)
    assert hear(download, item(0, lat_e7=99), 0.2) == []
    assert hear(download, item(2), 0.3) == []
    hear(download, item(1), 0.4)
    hear(download, item(2), 0.5)
    assert [found.x for found in download.outcome.items] == [1, 1, 1]


def test_px4_kills_a_download_when_a_request_is_overtaken_and_it_begins_again_more_slowly():
    download = opened()
    hear(download, count(2), 0.0)
    hear(download, ack(1), 0.1)
    assert download.state is State.PAUSED
    assert until(download, 1.0)[0][1] == "LIST"
    assert hear(download, count(2), 1.0) == []
    assert until(download, 1.2) == [(1.1, "REQUEST 0")]


def test_px4_forgets_a_download_after_its_silence_and_the_list_is_asked_for_anew():
    download = opened()
    hear(download, count(2), 0.0)
    lists = [time for time, words in until(download, 6.0) if words == "LIST"]
    assert lists[0] == 5.5


def test_ardupilot_forgets_nothing_and_is_asked_on():
    download = opened("ardupilot")
    hear(download, count(2), 0.0)
    assert {words for _, words in until(download, 50.0)} == {"REQUEST 0"}


def test_a_list_of_another_length_in_the_middle_begins_it_again():
    download = opened()
    hear(download, count(3), 0.0)
    hear(download, item(0), 0.1)
    hear(download, count(2), 0.2)
    assert until(download, 2.0)[0][1] == "LIST"


def test_a_count_that_answers_no_list_of_this_attempt_is_not_taken():
    download = opened()
    hear(download, count(1), 0.0)
    hear(download, item(0), 0.1)
    download.restart(0.2, pause_s=1.0)
    assert hear(download, count(1), 0.3) == []
    assert download.state is State.ASKING
    assert until(download, 1.3) == [(1.2, "LIST")]


@pytest.mark.parametrize("result", [1, 14])
def test_busy_vehicle_is_asked_again_later(result):
    download = opened()
    hear(download, ack(result), 0.1)
    assert until(download, 1.2) == [(1.1, "LIST")]


def test_a_vehicle_that_has_no_such_list_says_so_three_times_and_is_believed():
    download = opened()
    for _ in range(3):
        assert download.outcome is None
        hear(download, ack(3), 0.1)
    assert download.outcome.end is DownloadEnd.REFUSED


@pytest.mark.parametrize(
    "message",
    [
        count(2, by=Address(2, 1)),
        count(2, to=OTHER_STATION),
        count(2, kind=1),
        item(0),
        request(0),
        ack(3, by=Address(1, 100)),
    ],
)
def test_traffic_of_others_changes_nothing(message):
    download = opened()
    assert hear(download, message, 0.1) == []
    assert download.state is State.ASKING


def test_it_ends_at_its_deadline():
    download = opened(deadline=5.0)
    hear(download, count(2), 0.0)
    until(download, 10.0)
    assert download.outcome.end is DownloadEnd.EXPIRED
    assert hear(download, item(0), 11.0) == []
