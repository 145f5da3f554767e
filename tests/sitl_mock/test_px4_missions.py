"""PX4's manners of transfer, one test a manner, as measured."""

import struct

import pytest
from pymavlink.dialects.v20 import common as mavlink

from .rig import Rig, ack, clear, count, good_mission, heartbeat, item, kinds, request, request_list

PLACE = {"frame": 6}


@pytest.fixture
def rig() -> Rig:
    rig = Rig("px4")
    rig.send(heartbeat())
    return rig


def mission() -> list[object]:
    return good_mission("px4")


def test_it_asks_with_mission_request_int(rig: Rig) -> None:
    """One item at a time, ACK 0 at the end."""
    assert kinds(rig.send(count(2))) == ["REQUEST_INT 0"]
    assert kinds(rig.send(item(0, 22))) == ["REQUEST_INT 1"]
    assert kinds(rig.send(item(1))) == ["ACK 0"]


def test_after_a_float_item_it_asks_with_mission_request(rig: Rig) -> None:
    """On that link; an int item in answer is fine and brings the other form back."""
    rig.send(count(3))
    float_item = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 22, 1, 1, 0, 0, 0, 0, 37.4, -122.1, 30.0, 0)
    assert kinds(rig.send(float_item)) == ["REQUEST 1"]
    assert kinds(rig.send(item(1))) == ["REQUEST_INT 2"]


def test_ack_count_and_current_carry_the_missions_checksum(rig: Rig) -> None:
    """A uint32 behind the known fields: offset 4 in MISSION_ACK, 5 in MISSION_COUNT, 6 in MISSION_CURRENT."""
    rig.upload(mission())
    rig.send(request_list())
    rig.run(2)
    found = {}
    for frame in rig.frames:
        offset = {47: 4, 44: 5, 42: 6}.get(frame[7])
        if offset is not None and frame[1] > offset:
            found[frame[7]] = struct.unpack("<I", frame[10 + offset : 14 + offset].ljust(4, b"\0"))[0]
    assert set(found) == {47, 44, 42}
    assert len(set(found.values())) == 1


def test_a_silent_station_is_asked_four_times_a_second_and_given_up_after_five_without_an_ack(
    rig: Rig,
) -> None:
    """STATUSTEXT "Operation timeout", the old mission kept."""
    rig.upload(mission())
    before = rig.vehicle.stored()
    rig.send(count(3), item(0, 22))
    rig.run(2.4)
    rig.send(heartbeat())
    rig.run(2.4)
    rig.send(heartbeat())
    rig.run(3)
    said = [(round(at, 3), message) for at, _, message in rig.heard if at > 0]
    repeats = [at for at, message in said if message.get_type() == "MISSION_REQUEST_INT"]
    assert repeats == [pytest.approx(0.25 * n) for n in range(1, 20)]
    assert [at for at, message in said if getattr(message, "text", "") == "Operation timeout\t"] == [5.0]
    assert not [message for _, message in said if message.get_type() == "MISSION_ACK"]
    assert rig.vehicle.stored() == before


def test_a_late_item_is_an_error(rig: Rig) -> None:
    """ACK 1 once the upload was given up."""
    rig.send(count(3), item(0, 22))
    rig.run(6)
    assert kinds(rig.send(item(1)))[0] == "ACK 1"


def test_an_upload_is_atomic(rig: Rig) -> None:
    """The old mission reads back until the last item came."""
    rig.upload(mission())
    before = rig.vehicle.stored()
    new = [item(0, 22, current=1), item(1), item(2, 20, 2, x=0, y=0, z=0.0)]
    rig.send(count(3), new[0], new[1])
    assert rig.vehicle.stored() == before
    rig.send(new[2])
    assert len(rig.vehicle.stored()) == 3


def test_it_stays_busy_until_the_client_acknowledges_a_download(rig: Rig) -> None:
    """A COUNT in that time: ACK 1 "Busy"; after the ACK it is taken."""
    rig.upload(mission())
    rig.send(request_list())
    for seq in range(4):
        rig.send(request(seq))
    assert kinds(rig.send(count(2))) == ["ACK 1", "TEXT WPM: IGN MISSION_COUNT: Busy"]
    rig.send(ack())
    assert kinds(rig.send(count(2))) == ["REQUEST_INT 0"]


def test_without_the_ack_it_is_busy_for_five_seconds(rig: Rig) -> None:
    """It never repeats anything meanwhile."""
    rig.upload(mission())
    rig.send(request_list(), request(0))
    assert rig.run(4.9) == []
    assert kinds(rig.send(count(2)))[0] == "ACK 1"
    rig.run(0.2)
    assert kinds(rig.send(count(2))) == ["REQUEST_INT 0"]


@pytest.mark.parametrize("asked", [[2], [0, 1, 0], [0, 1, 2, 3, 4]])
def test_asking_out_of_order_ends_the_download(rig: Rig, asked: list[int]) -> None:
    """2 first, back to 0, beyond the end: ACK 1 "Req. WP was unexpected"; then silence."""
    rig.upload(mission())
    rig.send(request_list())
    *good, last = asked
    for seq in good:
        assert kinds(rig.send(request(seq))) == [f"ITEM_INT {seq}"]
    assert kinds(rig.send(request(last))) == ["ACK 1", "TEXT WPM: REJ. CMD: Req. WP was unexpected"]
    assert rig.send(request(0)) == []
    assert kinds(rig.send(request_list())) == ["COUNT 4"]


def test_the_same_item_twice_is_served_twice(rig: Rig) -> None:
    """A repeated request is no fault."""
    rig.upload(mission())
    rig.send(request_list())
    assert (
        kinds(rig.send(request(0), request(0), request(1), request(1)))
        == ["ITEM_INT 0"] * 2 + ["ITEM_INT 1"] * 2
    )


def test_a_request_without_a_list_is_met_with_silence(rig: Rig) -> None:
    """Also after a finished download."""
    rig.upload(mission())
    assert rig.send(request(0)) == []
    rig.download()
    assert rig.send(request(0)) == []


def test_an_unexpected_item_is_ignored_and_the_request_repeated(rig: Rig) -> None:
    """In silence."""
    rig.send(count(3), item(0, 22))
    assert rig.send(item(2)) == []
    assert rig.send(item(0, 22)) == []
    assert kinds([message for _, message in rig.run(0.3)]) == ["REQUEST_INT 1"]


def test_the_last_item_again_after_the_end_is_accepted_again(rig: Rig) -> None:
    """ACK 0 with the same id."""
    first = rig.upload(mission())
    assert kinds(rig.send(mission()[-1])) == ["ACK 0"]
    assert rig.frames[-1][10:18] == next(f for f in rig.frames if f[7] == 47)[10:18]
    assert first.type == 0


def test_a_second_count_before_item_0_repeats_the_request_and_its_number_is_ignored(rig: Rig) -> None:
    """The upload ends after the first count's items."""
    rig.send(count(2))
    assert kinds(rig.send(count(5))) == ["REQUEST_INT 0"]
    assert kinds(rig.send(item(0, 22), item(1))) == ["REQUEST_INT 1", "ACK 0"]


def test_a_second_count_later_is_an_error_and_the_transfer_goes_on(rig: Rig) -> None:
    """ACK 1 "Busy"."""
    rig.send(count(2), item(0, 22))
    assert kinds(rig.send(count(2))) == ["ACK 1", "TEXT WPM: REJ. CMD: Busy"]
    assert kinds(rig.send(item(1))) == ["ACK 0"]


@pytest.mark.parametrize("empty", [clear(), count(0), clear(255)])
def test_clear_all_and_count_0_are_accepted(rig: Rig, empty: object) -> None:
    """ACK 0 and nothing left."""
    rig.upload(mission())
    assert kinds(rig.send(empty)) == ["ACK 0"]
    assert rig.vehicle.stored() == ()
    assert rig.download() == []


def test_clear_all_in_the_middle_of_an_upload_is_ignored(rig: Rig) -> None:
    """No ACK; the transfer goes on."""
    rig.send(count(2), item(0, 22))
    assert "ACK" not in " ".join(kinds(rig.send(clear())))
    assert kinds(rig.send(item(1))) == ["ACK 0"]


def test_a_clients_cancel_aborts(rig: Rig) -> None:
    """ACK 15: nothing is asked any more, the old mission is kept."""
    rig.upload(mission())
    before = rig.vehicle.stored()
    rig.send(count(2), item(0, 22))
    rig.send(ack(15))
    assert rig.run(6) == []
    assert rig.vehicle.stored() == before
    assert kinds(rig.send(count(2))) == ["REQUEST_INT 0"]


@pytest.mark.parametrize("other", [{"system": 254}, {"component": 1}, {"link": "radio"}])
def test_another_systems_count_during_an_upload_is_an_error(rig: Rig, other: dict[str, object]) -> None:
    """ACK 1; the upload goes on."""
    rig.send(count(2))
    assert kinds(rig.send(count(3), **other))[0] == "ACK 1"
    assert kinds(rig.send(item(0, 22), item(1))) == ["REQUEST_INT 1", "ACK 0"]


@pytest.mark.parametrize("component", [0, 1, 190])
def test_targets_that_are_taken(rig: Rig, component: int) -> None:
    """Component 1, 0 and 190."""
    assert kinds(rig.send(count(2, 0, 1, component))) == ["REQUEST_INT 0"]


@pytest.mark.parametrize(("system", "component"), [(2, 1), (0, 1), (1, 77)])
def test_other_targets_are_met_with_silence(rig: Rig, system: int, component: int) -> None:
    """Nothing comes back."""
    assert rig.send(count(2, 0, system, component)) == []


@pytest.mark.parametrize(("kind", "capacity"), [(0, 10_000), (1, 64), (2, 32)])
def test_a_count_above_the_capacity_is_refused_at_once(rig: Rig, kind: int, capacity: int) -> None:
    """ACK 4, without a text and its numbers."""
    assert kinds(rig.send(count(capacity + 1, kind))) == ["ACK 4"]
    assert kinds(rig.send(count(capacity, kind))) == ["REQUEST_INT 0"]


def test_a_refused_item_ends_the_upload_and_keeps_the_old_mission(rig: Rig) -> None:
    """ACK 3 "Invalid item"."""
    rig.upload(mission())
    before = rig.vehicle.stored()
    rig.send(count(3), item(0, 22))
    assert kinds(rig.send(item(1, 18))) == ["ACK 3", "TEXT IGN MISSION_ITEM: Invalid item"]
    assert rig.run(6) == []
    assert rig.vehicle.stored() == before


def test_item_0_reads_back_as_current(rig: Rig) -> None:
    """The item the vehicle would fly next."""
    rig.upload(mission())
    rig.run(1)
    assert [stored.current for stored in rig.vehicle.stored()] == [1, 0, 0, 0]


def test_without_a_current_flag_the_old_index_is_kept(rig: Rig) -> None:
    """A second mission starts at item 2; with current=1 on item 0 it starts at 0."""
    rig.upload(mission())
    rig.run(1)
    rig.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    other = [item(0, 22), item(1), item(2, 19, p1=3.0), item(3, 20, 2, x=0, y=0, z=0.0)]
    rig.upload(other)
    rig.run(1)
    assert [stored.current for stored in rig.vehicle.stored()] == [0, 0, 1, 0]
    rig.upload(mission())
    rig.run(1)
    assert [stored.current for stored in rig.vehicle.stored()] == [1, 0, 0, 0]


def test_texts_come_only_while_a_ground_stations_heartbeat_arrives(rig: Rig) -> None:
    """Three seconds later there is none."""
    rig.run(3)
    rig.send(count(2), item(0, 22))
    assert kinds(rig.send(count(2))) == ["ACK 1"]


def current(rig: Rig, seconds: float) -> list[tuple[int, int, int]]:
    """Seq, total and state of each MISSION_CURRENT to the station in the next seconds."""
    said = rig.run(seconds, telemetry=True)
    return [(m.seq, m.total, m.mission_state) for _, m in said if m.get_type() == "MISSION_CURRENT"]


def test_mission_current_comes_at_1_hz_and_says_none_before_there_is_one(rig: Rig) -> None:
    """Total 65535, state 1."""
    assert current(rig, 5.2) == [(0, 65535, 1)] * 5


def test_the_verdict_comes_after_the_ack_within_1_3_seconds(rig: Rig) -> None:
    """Accepted is state 2."""
    assert rig.upload(mission()).type == 0
    assert current(rig, 1.4)[-1] == (0, 4, 2)


def test_just_after_the_ack_it_may_show_seq_65535_and_the_old_state(rig: Rig) -> None:
    """Where no item was flagged as current."""
    rig.run(0.9)
    rig.upload([item(0, 22), item(1)])
    assert current(rig, 0.2) == [(65535, 2, 1)]
    assert current(rig, 1.1) == [(0, 2, 2)]


@pytest.mark.parametrize(
    "bad",
    [
        [item(0, 16), item(1, 22)],
        [item(0, 22, z=0.0), item(1)],
        [item(0, 22, 0, z=9.0), item(1)],
        [item(0, 21), item(1)],
        [item(0, 22), item(1, 112, 2, p1=1.0)],
    ],
)
def test_an_infeasible_mission_is_stored_and_judged_without_a_text(rig: Rig, bad: list[object]) -> None:
    """ACK 0, then state 1 with the new total: take-off not first or not above home, landing first, command 112."""
    assert rig.upload(bad).type == 0
    assert len(rig.vehicle.stored()) == 2
    assert current(rig, 1.4)[-1][1:] == (2, 1)
    assert not [m for _, _, m in rig.heard if m.get_type() == "STATUSTEXT"]


def test_a_speed_item_may_stand_before_takeoff(rig: Rig) -> None:
    """It has no position."""
    rig.upload([item(0, 178, 2, p1=1, p2=5, p3=-1, current=1), item(1, 22), item(2)])
    assert current(rig, 1.4)[-1] == (0, 3, 2)


def test_a_fence_violation_is_told_in_a_text(rig: Rig) -> None:
    """ "Geofence violation for waypoint 2"; a fence sent later judges the mission again."""
    rig.upload(mission())
    assert current(rig, 1.4)[-1] == (0, 4, 2)
    rig.send(heartbeat())
    assert rig.upload([item(0, 5003, 5, p1=50.0, kind=1)], 1).type == 0
    rig.run(0.5)
    rig.send(clear(1))
    assert current(rig, 1.4)[-1] == (0, 4, 2)
    rig.send(heartbeat())
    rig.upload([item(0, 5003, 5, p1=50.0, x=374_018_000, kind=1)], 1)
    assert current(rig, 1.4)[-1] == (0, 4, 1)
    texts = [m.text.strip() for _, _, m in rig.heard if m.get_type() == "STATUSTEXT"]
    assert texts == ["Geofence violation for waypoint 3", "Geofence violation for waypoint 1"]


def test_a_reboot_in_the_middle_of_an_upload_keeps_the_old_mission(rig: Rig) -> None:
    """And the transfer is forgotten."""
    rig.upload(mission())
    before = rig.vehicle.stored()
    rig.send(count(3), item(0, 22))
    rig.vehicle.reboot(rig.now)
    rig.run(4)
    assert rig.vehicle.stored() == before
    assert rig.run(1) == []
    assert kinds(rig.send(count(3))) == ["REQUEST_INT 0"]
