"""The upload against a vehicle that loses, doubles, delays, refuses and restarts; each test named after the failure."""

import itertools

import pytest

from mavplan.link.manners import MANNERS
from mavplan.link.protocol import Address
from mavplan.link.transfer import IllegalMoveError, Move, State
from mavplan.link.upload import Upload, UploadEnd
from mavplan.mission.autopilots import ARDUPILOT
from mavplan.mission.wire import to_wire
from tests.link.harness import make_mission
from tests.link.script import OTHER_STATION, US, VEHICLE, ack, count, item, outgoing, request, until

ITEMS = to_wire(make_mission("ardupilot", 0), ARDUPILOT)
LAST = len(ITEMS) - 1


def make(autopilot="ardupilot", items=ITEMS, deadline=60.0):
    upload = Upload(items, MANNERS[autopilot], VEHICLE, US, now=0.0, deadline=deadline)
    upload.tick(0.0)
    return upload


def opened(**options):
    upload = make(**options)
    assert outgoing(upload) == [f"COUNT {len(ITEMS)}"]
    return upload


def ask(upload, seq, now, **options):
    upload.receive(request(seq, **options), now)
    return outgoing(upload)


def all_sent(**options):
    upload = opened(**options)
    for seq in range(len(ITEMS)):
        assert ask(upload, seq, 0.01 * (seq + 1)) == [f"ITEM {seq}"]
    return upload


@pytest.mark.parametrize("as_int", [True, False])
def test_either_kind_of_request_is_answered_with_an_int_item(as_int):
    upload = opened()
    for seq in range(len(ITEMS)):
        assert ask(upload, seq, 0.1 * seq, as_int=as_int) == [f"ITEM {seq}"]
    upload.receive(ack(0), 1.0)
    assert upload.outcome.end is UploadEnd.ACCEPTED


def test_count_lost_it_is_sent_again_every_second_until_the_deadline():
    upload = opened(deadline=5.0)
    assert until(upload, 9.0) == [(t, f"COUNT {len(ITEMS)}") for t in (1.0, 2.0, 3.0, 4.0)]
    assert upload.outcome.end is UploadEnd.EXPIRED
    assert not upload.taken


def test_item_or_next_request_lost_the_item_and_the_one_after_are_sent_in_turn():
    upload = opened()
    ask(upload, 0, 0.0)
    assert [words for _, words in until(upload, 2.0)] == ["ITEM 0", "ITEM 1", "ITEM 0", "ITEM 1"]


def test_no_item_is_sent_twice_within_a_quarter_second_however_many_requests_come():
    upload = opened()
    times = []
    for step in range(300):
        now = step / 100
        upload.receive(request(1), now)
        upload.tick(now)
        times += [now for words in outgoing(upload) if words == "ITEM 1"]
    assert len(times) >= 10
    assert min(b - a for a, b in itertools.pairwise(times)) >= 0.25 - 1e-9


def test_a_request_that_comes_again_because_the_item_was_lost_is_answered_again():
    upload = opened()
    assert ask(upload, 0, 0.0) == ["ITEM 0"]
    assert ask(upload, 0, 1.0) == ["ITEM 0"]


def test_late_invalid_sequence_is_not_the_end():
    upload = opened()
    ask(upload, 0, 0.0)
    upload.receive(ack(13), 0.1)
    assert upload.state is State.MOVING
    assert ask(upload, 1, 0.2) == ["ITEM 1"]


def test_ack_arrives_too_early_it_is_not_for_this_upload():
    upload = opened()
    upload.receive(ack(0), 0.1)
    assert upload.outcome is None
    ask(upload, 0, 0.2)
    upload.receive(ack(0), 0.3)
    assert upload.outcome is None


def test_last_ack_lost_is_left_to_the_read_back_after_repeating_the_last_item():
    upload = all_sent()
    sent = until(upload, 30.0)
    assert {words for _, words in sent} == {f"ITEM {LAST}"}
    assert upload.outcome.end is UploadEnd.UNRESOLVED
    assert sent[-1][0] < 2.0


def test_error_after_the_last_item_may_answer_a_repeat_and_is_left_to_the_read_back():
    upload = all_sent()
    upload.receive(ack(1), 0.5)
    assert upload.outcome.end is UploadEnd.UNRESOLVED


@pytest.mark.parametrize("result", [1, 14, 15])
def test_busy_error_and_cancelled_are_waited_out_and_the_upload_begins_again(result):
    upload = opened()
    ask(upload, 0, 0.0)
    upload.receive(ack(result), 0.1)
    assert upload.state is State.PAUSED
    assert until(upload, 2.0) == [(1.6, f"COUNT {len(ITEMS)}")]
    assert upload.attempts == 2


def test_a_live_transfer_shows_itself_after_a_stray_error_and_goes_on():
    upload = opened()
    ask(upload, 0, 0.0)
    upload.receive(ack(1), 0.1)
    assert ask(upload, 1, 1.0) == ["ITEM 1"]
    assert upload.attempts == 1


@pytest.mark.parametrize(("autopilot", "forgotten_s"), [("ardupilot", 8.5), ("px4", 5.5)])
def test_silence_longer_than_the_vehicle_remembers_begins_the_upload_again(autopilot, forgotten_s):
    upload = opened(autopilot=autopilot)
    ask(upload, 0, 0.0)
    counts = [(time, words) for time, words in until(upload, forgotten_s + 0.1) if words.startswith("COUNT")]
    assert counts == [(forgotten_s, f"COUNT {len(ITEMS)}")]


@pytest.mark.parametrize("result", [2, 3, 5, 6, 7, 8, 9, 10, 11, 12])
def test_refused_item_ends_it_with_the_item_and_the_reason(result):
    upload = opened()
    ask(upload, 0, 0.0)
    ask(upload, 1, 0.1)
    upload.receive(ack(result), 0.2)
    assert (upload.outcome.end, upload.outcome.result, upload.outcome.seq) == (UploadEnd.REFUSED, result, 1)


def test_refusal_before_any_item_could_be_late_and_must_be_said_three_times():
    upload = opened()
    for attempt in range(3):
        assert upload.outcome is None
        upload.receive(ack(3), float(attempt))
        until(upload, attempt + 1.0)
    assert upload.outcome.end is UploadEnd.REFUSED
    assert upload.outcome.seq is None
    assert not upload.taken


def test_no_space_ends_it_as_soon_as_the_vehicle_names_its_capacity():
    upload = opened()
    upload.receive(ack(4), 0.1)
    assert upload.outcome is None
    upload.tell_space(2)
    assert upload.outcome.end is UploadEnd.REFUSED


def test_no_space_while_ardupilot_boots_is_waited_out():
    upload = opened()
    for attempt in range(10):
        upload.receive(ack(4), float(attempt))
        upload.tell_space(0)
        until(upload, attempt + 1.0)
    assert upload.outcome is None
    assert ask(upload, 0, 12.0) == ["ITEM 0"]


def test_no_space_without_a_number_is_believed_at_once_from_px4_and_the_eighth_time_from_ardupilot():
    px4, ardupilot = opened(autopilot="px4"), opened()
    px4.receive(ack(4), 0.1)
    assert px4.outcome.end is UploadEnd.REFUSED
    for attempt in range(8):
        assert ardupilot.outcome is None
        ardupilot.receive(ack(4), float(attempt))
        until(ardupilot, attempt + 1.0)
    assert ardupilot.outcome.end is UploadEnd.REFUSED


def test_no_space_that_comes_late_into_a_running_transfer_is_no_refusal():
    upload = opened()
    ask(upload, 0, 0.0)
    upload.receive(ack(4), 0.1)
    assert upload.outcome is None
    assert ask(upload, 1, 0.5) == ["ITEM 1"]


def test_a_count_of_ours_that_came_late_opens_the_upload_anew_and_is_served():
    upload = all_sent()
    upload.receive(ack(0), 0.5)
    assert upload.state is State.ENDED
    assert ask(upload, 0, 2.0) == ["ITEM 0"]
    assert upload.outcome is None


def test_a_refused_upload_is_not_reopened_by_a_late_copy_of_a_request():
    upload = opened()
    ask(upload, 0, 0.0)
    upload.receive(ack(9), 0.1)
    assert ask(upload, 0, 0.2) == []
    assert upload.outcome.end is UploadEnd.REFUSED


def test_vehicle_restarts_in_the_middle_and_the_upload_begins_again():
    upload = opened()
    ask(upload, 0, 0.0)
    upload.vehicle_rebooted(1.0)
    assert (2.5, f"COUNT {len(ITEMS)}") in until(upload, 3.0)


@pytest.mark.parametrize(
    "message",
    [
        request(0, by=Address(2, 1)),
        request(0, by=Address(1, 100)),
        request(0, to=OTHER_STATION),
        request(0, to=Address(255, 1)),
        request(0, kind=1),
        request(len(ITEMS)),
        ack(9, to=OTHER_STATION),
        ack(9, kind=2),
        ack(9, by=Address(1, 100)),
        count(3),
        item(0),
    ],
)
def test_traffic_of_others_changes_nothing(message):
    upload = opened()
    upload.receive(message, 0.1)
    assert outgoing(upload) == []
    assert upload.state is State.ASKING
    assert upload.outcome is None


def test_a_broadcast_target_is_ours_too():
    assert ask(opened(), 0, 0.1, to=Address(0, 0)) == ["ITEM 0"]


def test_nothing_is_sent_after_the_deadline_and_every_path_ends():
    upload = opened(deadline=3.0)
    ask(upload, 0, 0.0)
    sent = until(upload, 100.0)
    assert max(time for time, _ in sent) < 3.0
    assert upload.next_timer() is None
    upload.tick(200.0)
    assert outgoing(upload) == []


def test_a_move_that_is_not_in_the_table_raises_and_changes_nothing():
    upload = opened()
    with pytest.raises(IllegalMoveError):
        upload._move(Move.RESUMED)
    assert upload.state is State.ASKING
