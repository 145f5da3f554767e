"""What ArduCopter keeps of an item, as measured in simulation."""

import numpy as np
import pytest

from sitl_mock.items import StoredItem

from .rig import LAT_E7, LON_E7, NAN, Rig, count, item


@pytest.fixture
def rig() -> Rig:
    return Rig("ardupilot")


def kept(rig: Rig, message: object) -> StoredItem:
    stored = rig.keeps(message)
    assert isinstance(stored, StoredItem), f"refused with {stored}"
    return stored


@pytest.mark.parametrize("command", [16, 19])
@pytest.mark.parametrize(
    ("sent", "reads"), [(7.6, 7), (0.9, 0), (8.0, 8), (65535.0, 65535), (70000.0, 4464), (-1.0, 65535)]
)
def test_hold_is_cut_off_to_whole_seconds_modulo_65536(
    rig: Rig, command: int, sent: float, reads: int
) -> None:
    """param1 of WAYPOINT and LOITER_TIME, all with ACK 0."""
    assert kept(rig, item(1, command, p1=sent)).param1 == reads


@pytest.mark.parametrize("command", [16, 19])
def test_a_hold_of_nan_is_invalid_param1(rig: Rig, command: int) -> None:
    """ACK 6."""
    assert rig.keeps(item(1, command, p1=NAN)) == 6


def test_a_hold_of_5e9_kills_the_simulator(rig: Rig) -> None:
    """It says nothing from then on, and the mock knows why."""
    rig.send(count(2))
    rig.send(item(0))
    assert rig.send(item(1, 16, p1=5e9)) == []
    assert rig.run(20, telemetry=True) == []
    assert rig.vehicle.killed_by is not None
    assert rig.vehicle.next_timer() is None


@pytest.mark.parametrize(("field", "result"), [("p2", 7), ("p3", 8), ("p4", 9)])
def test_nan_in_loiter_time_is_refused_by_parameter(rig: Rig, field: str, result: int) -> None:
    """ACK 7, 8, 9 for param2, 3, 4."""
    assert rig.keeps(item(1, 19, p1=8.0, **{field: NAN})) == result


@pytest.mark.parametrize("command", [16, 17, 21, 22])
def test_nan_in_param4_is_taken_where_it_means_any_heading(rig: Rig, command: int) -> None:
    """WAYPOINT, LOITER_UNLIM, LAND, TAKEOFF only."""
    assert isinstance(rig.keeps(item(1, command, p4=NAN)), StoredItem)


@pytest.mark.parametrize("command", [18, 19, 93, 115, 178])
def test_nan_in_param4_of_any_other_command_is_refused(rig: Rig, command: int) -> None:
    """ACK 9."""
    assert rig.keeps(item(1, command, p4=NAN)) == 9


@pytest.mark.parametrize(
    ("sent", "reads"),
    [((5, 0, 0), (0, 1, 0)), ((0, -3, 0), (0, -1, 0)), ((0, 2, 1), (0, 1, 1)), ((0, 0, -1), (0, 1, 0))],
)
def test_loiter_time_reads_back_signs_only(rig: Rig, sent: tuple[int, ...], reads: tuple[int, ...]) -> None:
    """param2 0, param3 ±1 (0 becomes +1), param4 1 or 0."""
    p2, p3, p4 = sent
    assert kept(rig, item(1, 19, p1=8.0, p2=p2, p3=p3, p4=p4)).params[1:] == reads


def test_waypoint_keeps_nothing_but_its_hold(rig: Rig) -> None:
    """param2 to param4 read back 0."""
    assert kept(rig, item(1, 16, p1=3.0, p2=2.0, p3=1.0, p4=90.0)).params == (3, 0, 0, 0)


@pytest.mark.parametrize(("sent", "reads"), [(0, 0), (3, 3), (10, 10), (6, 3), (5, 0), (11, 10), (2, 0)])
def test_frames_are_kept_or_mapped(rig: Rig, sent: int, reads: int) -> None:
    """0, 3, 10 kept; 6 to 3, 5 to 0, 11 to 10, 2 to 0."""
    assert kept(rig, item(1, 16, sent)).frame == reads


@pytest.mark.parametrize("frame", [1, 4, 7, 8, 9, 12, 20, 255])
def test_other_frames_are_refused(rig: Rig, frame: int) -> None:
    """ACK 2."""
    assert rig.keeps(item(1, 16, frame)) == 2


@pytest.mark.parametrize("command", [20, 93, 178])
def test_items_without_a_position_read_back_frame_0_and_zeros(rig: Rig, command: int) -> None:
    """Whatever frame and place they came with."""
    stored = kept(rig, item(1, command, 2, p1=1.0, x=5, y=6, z=7.0))
    assert (stored.frame, stored.x, stored.y, stored.z) == (0, 0, 0, 0.0)


def test_autocontinue_reads_1_and_current_0(rig: Rig) -> None:
    """Whatever was sent."""
    stored = kept(rig, item(1, 16, current=1, autocontinue=0))
    assert (stored.autocontinue, stored.current) == (1, 0)


@pytest.mark.parametrize("sent", [2.1, 30.0, 0.29, 12.5, -3.3, 100.01, 82_999.0])
def test_altitude_is_cut_off_to_centimetres_of_a_32_bit_float(rig: Rig, sent: float) -> None:
    """As numpy's 32-bit floats have it; 2.1 m reads back 2.09."""
    centimetres = np.float32(int(np.float32(sent) * np.float32(100)))
    assert kept(rig, item(1, 16, z=sent)).z == float(centimetres * np.float32(0.01))
    assert kept(rig, item(1, 16, z=2.1)).z == pytest.approx(2.09, abs=1e-6)


@pytest.mark.parametrize("z", [83_000.0, -83_000.0, 1e9, NAN, float("inf")])
def test_an_altitude_of_83_km_is_invalid_param7(rig: Rig, z: float) -> None:
    """ACK 12."""
    assert rig.keeps(item(1, 16, z=z)) == 12


def test_latitude_and_longitude_are_exact_and_checked(rig: Rig) -> None:
    """Latitude 91: ACK 10; longitude 181: ACK 11."""
    stored = kept(rig, item(1, x=-123456789, y=1799999999))
    assert (stored.x, stored.y) == (-123456789, 1799999999)
    assert rig.keeps(item(1, x=910_000_000)) == 10
    assert rig.keeps(item(1, y=1_810_000_000)) == 11


def test_delay_and_speed_keep_fractions(rig: Rig) -> None:
    """NAV_DELAY 2.5 s, DO_CHANGE_SPEED 3.25 m/s, throttle −1 and −2; its param4 reads 0."""
    assert kept(rig, item(1, 93, p1=2.5, p2=-1, p3=-1, p4=-1)).params == (2.5, -1, -1, -1)
    assert kept(rig, item(1, 178, p1=1, p2=3.25, p3=-1, p4=7)).params == (1, 3.25, -1, 0)
    assert kept(rig, item(1, 178, p1=1, p2=-2, p3=-2)).params == (1, -2, -2, 0)


def test_unknown_commands_are_unsupported_and_0_and_1_invalid(rig: Rig) -> None:
    """ACK 3 and ACK 5."""
    assert rig.keeps(item(1, 31000)) == 3
    assert rig.keeps(item(1, 0)) == 5
    assert rig.keeps(item(1, 1)) == 5


def test_a_jump_needs_an_item_to_jump_to(rig: Rig) -> None:
    """DO_JUMP to an item that does not exist: ACK 1."""
    assert rig.keeps(item(1, 177, p1=7, p2=1)) == 1
    assert rig.keeps(item(1, 177, p1=0, p2=1)) == 1
    assert kept(rig, item(1, 177, p1=1, p2=-1)).params == (1, -1, 0, 0)


def square(n: int = 4, command: int = 5001, **fields: float) -> list[object]:
    corners = [(-9000, -9000), (9000, -9000), (9000, 9000), (-9000, 9000)]
    places = [(LAT_E7 + corners[n % 4][0] + n, LON_E7 + corners[n % 4][1]) for n in range(n)]
    return [item(seq, command, 0, p1=n, x=x, y=y, kind=1, **fields) for seq, (x, y) in enumerate(places)]


def test_fence_items_read_back_frame_0_autocontinue_0_altitude_0(rig: Rig) -> None:
    """And their place exactly."""
    assert rig.upload(square(z=33.0), 1).type == 0
    first = rig.vehicle.stored(1)[0]
    assert (first.frame, first.autocontinue, first.z, first.param1, first.x) == (0, 0, 0.0, 4, 373_991_000)


@pytest.mark.parametrize("commands", [[5000], [5003], [5004], [5003, 5004, 5000]])
def test_circles_and_a_return_point_are_fences_too(rig: Rig, commands: list[int]) -> None:
    """5000 to 5004 are taken."""
    items = [item(seq, command, 0, p1=50.5, kind=1) for seq, command in enumerate(commands)]
    assert rig.upload(items, 1).type == 0
    assert [stored.command for stored in rig.vehicle.stored(1)] == commands


@pytest.mark.parametrize(
    "bad",
    [
        square(2),
        square(4)[:3],
        [item(0, 5003, 0, p1=0.0, kind=1)],
        [item(0, 5003, 0, p1=-5.0, kind=1)],
        [item(0, 5000, 0, kind=1), item(1, 5000, 0, kind=1)],
        [*square(4)[:2], item(2, 5003, 0, p1=5.0, kind=1)],
        [item(0, 5003, 0, p1=5.0, x=910_000_000, kind=1)],
    ],
)
def test_a_bad_fence_is_refused_as_a_whole_and_the_old_one_kept(rig: Rig, bad: list[object]) -> None:
    """ACK 1 with texts, at the end."""
    assert rig.upload(square(), 1).type == 0
    before = rig.vehicle.stored(1)
    assert rig.upload(bad, 1).type == 1
    assert rig.vehicle.stored(1) == before
    assert any(message.get_type() == "STATUSTEXT" for _, _, message in rig.heard)


def test_a_polygon_of_70_vertices_exceeds_the_storage_though_its_count_was_taken(rig: Rig) -> None:
    """ACK 1, "Fence exceeds storage size"; one of 69 fits."""
    assert rig.upload(square(70), 1).type == 1
    assert any(getattr(message, "text", "") == "Fence exceeds storage size" for _, _, message in rig.heard)
    assert rig.upload(square(69), 1).type == 0


def test_a_nan_radius_kills_the_simulator(rig: Rig) -> None:
    """As measured."""
    rig.send(count(1, 1))
    assert rig.send(item(0, 5003, 0, p1=NAN, kind=1)) == []
    assert rig.vehicle.killed_by == "fence radius NaN"


def test_rally_points_are_kept_in_whole_metres(rig: Rig) -> None:
    """5100; other commands are unsupported."""
    stored = kept(rig, item(0, 5100, 3, z=30.7, kind=2))
    assert (stored.frame, stored.z, stored.autocontinue) == (3, 30.0, 0)
    assert rig.keeps(item(0, 16, 3, kind=2)) == 3
