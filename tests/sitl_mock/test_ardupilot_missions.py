"""ArduPilot's manners of transfer, one test a manner, as measured."""

import pytest

from sitl_mock.items import MissionType

from .rig import LAT_E7, LON_E7, Rig, ack, clear, count, good_mission, item, kinds, request, request_list

OTHER = {"system": 254}


@pytest.fixture
def rig() -> Rig:
    return Rig("ardupilot")


def names(rig: Rig) -> list[int]:
    return [stored.command for stored in rig.vehicle.stored()]


def test_it_asks_with_mission_request_and_says_flight_plan_received(rig: Rig) -> None:
    """Never MISSION_REQUEST_INT; the text comes behind the ACK."""
    assert kinds(rig.send(count(2))) == ["REQUEST 0"]
    assert kinds(rig.send(item(0))) == ["REQUEST 1"]
    assert kinds(rig.send(item(1, 22))) == ["ACK 0", "TEXT Flight plan received"]


def test_count_truncates_at_once_and_what_breaks_off_leaves_a_mixture(rig: Rig) -> None:
    """Not atomic: two new items on top of what the count left of the old mission."""
    rig.upload([item(0), item(1, 22), *(item(n, 19, p1=9) for n in range(2, 6))])
    rig.send(count(4))
    assert names(rig) == [16, 22, 19, 19]
    rig.send(item(0), item(1, 16))
    rig.run(10)
    assert names(rig) == [16, 16, 19, 19]


def test_a_silent_station_is_asked_every_second_and_given_up_after_eight(rig: Rig) -> None:
    """MISSION_ACK 15 and "Mission upload timeout", 8.0 s after the last good item."""
    rig.send(count(3))
    rig.run(2.5)
    rig.send(item(0))
    said = rig.run(20)
    assert [round(at - 2.5, 3) for at, _ in said] == [1, 2, 3, 4, 5, 6, 7, 8, 8]
    assert kinds([message for _, message in said]) == ["REQUEST 1"] * 7 + [
        "ACK 15",
        "TEXT Mission upload timeout",
    ]


@pytest.mark.parametrize(("kind", "text"), [(1, "Fence upload timeout"), (2, "Rally upload timeout")])
def test_fence_and_rally_uploads_time_out_by_their_own_names(rig: Rig, kind: int, text: str) -> None:
    """The same times, the same ACK."""
    rig.send(count(3, kind))
    assert kinds([message for _, message in rig.run(9)])[-2:] == ["ACK 15", f"TEXT {text}"]


def test_a_duplicate_gets_invalid_sequence_and_the_transfer_goes_on(rig: Rig) -> None:
    """ACK 13 is not the end."""
    rig.send(count(3))
    assert kinds(rig.send(item(0), item(0))) == ["REQUEST 1", "ACK 13"]
    assert kinds(rig.send(item(2), item(1), item(2))) == [
        "ACK 13",
        "REQUEST 2",
        "ACK 0",
        "TEXT Flight plan received",
    ]
    assert len(rig.vehicle.stored()) == 3


def test_an_unexpected_item_does_not_put_off_the_time_out(rig: Rig) -> None:
    """Eight seconds count from the last good item."""
    rig.send(count(3))
    rig.run(7)
    assert kinds(rig.send(item(2))) == ["ACK 13"]
    assert kinds([message for _, message in rig.run(1.1)])[-2:] == ["ACK 15", "TEXT Mission upload timeout"]


def test_an_item_after_the_end_is_an_error(rig: Rig) -> None:
    """ACK 1."""
    rig.upload(good_mission("ardupilot"))
    assert kinds(rig.send(item(3))) == ["ACK 1"]


@pytest.mark.parametrize(
    ("bad", "result"), [(item(1, 31000), 3), (item(1, 19, p4=float("nan")), 9), (item(1, x=910_000_000), 10)]
)
def test_a_refused_item_ends_the_transfer_without_a_text(rig: Rig, bad: object, result: int) -> None:
    """And the mixture stays."""
    rig.upload([item(0), item(1, 22), item(2, 20)])
    rig.send(count(3), item(0))
    assert kinds(rig.send(bad)) == [f"ACK {result}"]
    assert rig.run(20) == []
    assert names(rig) == [16, 22, 20]


def test_a_second_count_from_the_same_sender_starts_again(rig: Rig) -> None:
    """At item 0, with the new count."""
    rig.send(count(5), item(0), item(1))
    assert kinds(rig.send(count(2))) == ["REQUEST 0"]
    assert kinds(rig.send(item(0), item(1)))[-2] == "ACK 0"
    assert len(rig.vehicle.stored()) == 2


@pytest.mark.parametrize("other", [{"system": 254}, {"component": 1}, {"link": "radio"}])
def test_another_system_or_link_is_denied_during_an_upload(rig: Rig, other: dict[str, object]) -> None:
    """ACK 14 for COUNT, LIST and ITEM; the upload goes on."""
    rig.send(count(2))
    for message in (count(3), request_list(), item(0), request(0)):
        assert kinds(rig.send(message, **other)) == ["ACK 14"]
    assert kinds(rig.send(item(0), item(1)))[1] == "ACK 0"


def test_the_answer_goes_to_who_asked(rig: Rig) -> None:
    """Target ids and link of each ACK are the sender's."""
    rig.send(count(2))
    (denied,) = rig.send(count(2), link="radio", system=254, component=191)
    assert (denied.target_system, denied.target_component) == (254, 191)
    assert rig.heard[-1][1] == "radio"


def test_a_clients_cancel_does_not_cancel(rig: Rig) -> None:
    """ACK 15 is ignored: the vehicle runs to its eight seconds."""
    rig.send(count(2))
    assert rig.send(ack(15)) == []
    assert kinds([message for _, message in rig.run(9)]) == ["REQUEST 0"] * 7 + [
        "ACK 15",
        "TEXT Mission upload timeout",
    ]


@pytest.mark.parametrize(("system", "component"), [(1, 0), (1, 1), (1, 190), (0, 1), (0, 0)])
def test_targets_that_are_taken(rig: Rig, system: int, component: int) -> None:
    """Component 0, 1 and 190, system 0."""
    assert kinds(rig.send(count(2, 0, system, component))) == ["REQUEST 0"]


def test_another_target_is_met_with_silence(rig: Rig) -> None:
    """System 2."""
    assert rig.send(count(2, 0, 2, 1)) == []
    assert rig.send(count(2, 0, 1, 77)) == []


def test_before_it_is_ready_there_is_room_for_0_items() -> None:
    """ACK 4, "Only 0 items are supported"; two seconds later all is well."""
    rig = Rig("ardupilot", boot_time_s=2.0)
    assert kinds(rig.send(count(2))) == ["ACK 4", "TEXT Only 0 items are supported"]
    assert kinds([message for _, message in rig.run(2.1)]) == ["TEXT ArduPilot Ready"]
    assert kinds(rig.send(count(2))) == ["REQUEST 0"]


def test_a_count_above_the_capacity_keeps_the_old_mission(rig: Rig) -> None:
    """ACK 4, "Only 650 items are supported"; home counts."""
    rig.upload(good_mission("ardupilot"))
    before = rig.vehicle.stored()
    assert kinds(rig.send(count(651))) == ["ACK 4", "TEXT Only 650 items are supported"]
    assert rig.vehicle.stored() == before
    assert kinds(rig.send(count(650))) == ["REQUEST 0"]


def test_capacities_of_fence_and_rally(rig: Rig) -> None:
    """70 and 46."""
    assert kinds(rig.send(count(71, 1)))[0] == "ACK 4"
    assert kinds(rig.send(count(47, 2)))[0] == "ACK 4"
    assert kinds(rig.send(count(70, 1))) == ["REQUEST 0"]
    assert kinds(rig.send(count(46, 2))) == ["REQUEST 0"]


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_clear_all_clears_one_list(rig: Rig, kind: int) -> None:
    """ACK 0 for types 0, 1, 2; the other lists stay."""
    uploads = {
        0: good_mission("ardupilot"),
        1: [item(0, 5003, 0, p1=9.0, kind=1)],
        2: [item(0, 5100, kind=2)],
    }
    for each, items in uploads.items():
        rig.upload(items, each)
    assert kinds(rig.send(clear(kind))) == ["ACK 0"]
    assert [bool(rig.vehicle.stored(each)) for each in uploads] == [each != kind for each in uploads]


def test_clear_all_of_everything_is_unsupported(rig: Rig) -> None:
    """Type 255: ACK 3 and nothing cleared."""
    rig.upload(good_mission("ardupilot"))
    assert kinds(rig.send(clear(MissionType.ALL))) == ["ACK 3"]
    assert len(rig.vehicle.stored()) == 5


def test_clear_all_is_refused_while_the_mission_is_flown_but_count_0_is_not(rig: Rig) -> None:
    """ACK 1; COUNT 0 clears even in AUTO."""
    rig.upload(good_mission("ardupilot"))
    rig.vehicle.vehicle.mission_running = True
    assert kinds(rig.send(clear())) == ["ACK 1"]
    assert len(rig.vehicle.stored()) == 5
    assert kinds(rig.send(count(0)))[0] == "ACK 0"
    assert rig.vehicle.stored() == ()


def test_clear_all_during_an_upload(rig: Rig) -> None:
    """From another station ACK 14, then 1; from the uploading one ACK 1; the upload goes on."""
    rig.send(count(2))
    assert kinds(rig.send(clear(), **OTHER)) == ["ACK 14", "ACK 1"]
    assert kinds(rig.send(clear())) == ["ACK 1"]
    assert kinds(rig.send(item(0), item(1)))[1] == "ACK 0"


def test_a_download_needs_no_list_and_ends_with_invalid_sequence(rig: Rig) -> None:
    """An item is served at any time; beyond the end: ACK 13."""
    rig.upload(good_mission("ardupilot"))
    assert kinds(rig.send(request(3))) == ["ITEM_INT 3"]
    assert kinds(rig.send(request(0))) == ["ITEM_INT 0"]
    assert kinds(rig.send(request(5))) == ["ACK 13"]
    assert kinds(rig.send(request_list())) == ["COUNT 5"]


def test_ones_own_list_and_request_during_ones_own_upload_are_denied(rig: Rig) -> None:
    """ACK 14."""
    rig.upload(good_mission("ardupilot"))
    rig.send(count(5))
    assert kinds(rig.send(request_list())) == ["ACK 14"]
    assert kinds(rig.send(request(0))) == ["ACK 14"]


def test_transfers_of_different_lists_do_not_disturb_each_other(rig: Rig) -> None:
    """A fence goes up while a mission does."""
    rig.send(count(2), count(1, 1))
    assert kinds(rig.send(item(0, 5003, 0, p1=9.0, kind=1)))[0] == "ACK 0"
    assert kinds(rig.send(item(0), item(1)))[1] == "ACK 0"


def test_item_0_is_replaced_by_home(rig: Rig) -> None:
    """WAYPOINT, frame 0, the vehicle's own home above sea level."""
    mission = good_mission("ardupilot")
    mission[0].x, mission[0].z = LAT_E7 + 77777, 500.0
    rig.upload(mission)
    home = rig.vehicle.stored()[0]
    assert (home.command, home.frame, home.x, home.y, home.z) == (16, 0, LAT_E7, LON_E7, 10.0)


def test_a_mission_sent_without_home_loses_its_first_item(rig: Rig) -> None:
    """TAKEOFF is gone, without a word."""
    rig.upload([item(0, 22), item(1, 19, p1=8.0), item(2, 20)])
    assert names(rig) == [16, 19, 20]


def test_item_0_is_checked_all_the_same(rig: Rig) -> None:
    """A NaN hold in it is refused."""
    rig.send(count(2))
    assert kinds(rig.send(item(0, 16, p1=float("nan")))) == ["ACK 6"]


def test_home_is_zeros_before_there_is_one() -> None:
    """0, 0, 0."""
    rig = Rig("ardupilot", home=None)
    rig.upload(good_mission("ardupilot"))
    home = rig.vehicle.stored()[0]
    assert (home.x, home.y, home.z) == (0, 0, 0.0)


def test_home_alone_onto_an_empty_mission_makes_two_items(rig: Rig) -> None:
    """COUNT 0 before, 2 after; onto a mission that was there, 1."""
    assert kinds(rig.send(request_list())) == ["COUNT 0"]
    rig.upload([item(0)])
    assert kinds(rig.send(request_list())) == ["COUNT 2"]
    rig.upload([item(0)])
    assert kinds(rig.send(request_list())) == ["COUNT 1"]


def test_a_float_item_is_taken_with_a_warning_and_loses_digits(rig: Rig) -> None:
    """MISSION_ITEM: the coordinates are those of a 32-bit float."""
    from pymavlink.dialects.v20 import common as mavlink

    rig.send(count(2), item(0))
    place = 37.4013475
    answers = rig.send(
        mavlink.MAVLink_mission_item_message(1, 1, 1, 3, 16, 0, 1, 0, 0, 0, 0, place, -122.1, 30.0, 0)
    )
    assert kinds(answers)[0] == "ACK 0"
    assert any("MISSION_ITEM_INT" in text for text in kinds(answers))
    assert 0 < abs(rig.vehicle.stored()[1].x - place * 1e7) < 30


def test_an_item_with_current_2_is_no_mission_item(rig: Rig) -> None:
    """ACK 1, and the transfer waits for the real one."""
    rig.send(count(2), item(0))
    assert kinds(rig.send(item(1, current=2))) == ["ACK 1"]
    assert kinds(rig.send(item(1)))[0] == "ACK 0"


def test_nothing_of_it_has_an_opaque_id(rig: Rig) -> None:
    """MISSION_ACK and MISSION_COUNT are as long as the old message."""
    rig.upload(good_mission("ardupilot"))
    rig.send(request_list())
    assert max(frame[1] for frame in rig.frames if frame[7] in {44, 47}) <= 5


def test_an_unknown_mission_type_is_unsupported(rig: Rig) -> None:
    """ACK 3 for COUNT, LIST, REQUEST and ITEM."""
    for message in (count(1, 9), request_list(9), request(0, 9), item(0, kind=9)):
        assert kinds(rig.send(message)) == ["ACK 3"]


def test_a_reboot_keeps_the_mixture_and_forgets_the_transfer(rig: Rig) -> None:
    """It says nothing for a second, and has room for no item for two more."""
    rig.upload([item(0), item(1, 22), item(2, 19), item(3, 20)])
    rig.send(count(4), item(0), item(1, 16))
    rig.vehicle.reboot(rig.now)
    assert rig.send(request_list()) == []
    rig.run(1.5)
    assert kinds(rig.send(count(4)))[0] == "ACK 4"
    rig.run(2.0)
    assert names(rig) == [16, 16, 19, 20]
    assert kinds(rig.send(item(2))) == ["ACK 1"]
