"""What PX4 keeps of an item, as measured in simulation."""

import math

import pytest

from sitl_mock.items import StoredItem
from sitl_mock.px4_items import checksum

from .rig import LAT_E7, LON_E7, NAN, Rig, item


@pytest.fixture
def rig() -> Rig:
    return Rig("px4")


def kept(rig: Rig, message: object) -> StoredItem:
    stored = rig.keeps(message)
    assert isinstance(stored, StoredItem), f"refused with {stored}"
    return stored


@pytest.mark.parametrize(("sent", "reads"), [(0, 5), (3, 6), (5, 5), (6, 6)])
def test_frames_of_positions_read_back_as_int_frames(rig: Rig, sent: int, reads: int) -> None:
    """3 comes back as 6, 0 as 5."""
    assert kept(rig, item(0, 16, sent)).frame == reads


@pytest.mark.parametrize("frame", [1, 4, 7, 10, 11, 12, 255])
def test_other_frames_are_refused(rig: Rig, frame: int) -> None:
    """ACK 2, terrain frames among them."""
    assert rig.keeps(item(0, 16, frame)) == 2


@pytest.mark.parametrize("command", [20, 93, 178])
def test_commands_without_a_position_must_be_in_the_mission_frame(rig: Rig, command: int) -> None:
    """RTL, NAV_DELAY, DO_CHANGE_SPEED: frame 2 is kept, any other ACK 3."""
    stored = kept(rig, item(0, command, 2, p1=1.0, p2=5.5, p3=-1.0, x=0, y=0, z=0.0))
    assert (stored.frame, stored.params) == (2, (1.0, 5.5, -1.0, 0.0))
    for frame in (0, 3, 5, 6):
        assert rig.keeps(item(0, command, frame)) == 3


@pytest.mark.parametrize("command", [16, 19, 21, 22])
def test_position_commands_in_the_mission_frame_are_unsupported(rig: Rig, command: int) -> None:
    """ACK 3."""
    assert rig.keeps(item(0, command, 2)) == 3


@pytest.mark.parametrize("hold_s", [8.25, 70000.0, 0.0, -1.0])
@pytest.mark.parametrize("command", [16, 19])
def test_a_hold_comes_back_as_sent(rig: Rig, command: int, hold_s: float) -> None:
    """Exact as a 32-bit float."""
    assert kept(rig, item(0, command, p1=hold_s)).param1 == hold_s


def test_a_hold_of_nan_comes_back_as_nan(rig: Rig) -> None:
    """It is taken."""
    assert math.isnan(kept(rig, item(0, 19, p1=NAN)).param1)


@pytest.mark.parametrize(
    ("sent", "reads"),
    [
        ((0, 0, NAN), (0, 0, 0)),
        ((5, 40, 90), (1, 40, 1)),
        ((-1, -40, -1), (0, -40, 0)),
        ((0, 0, 0), (0, 0, 0)),
    ],
)
def test_loiter_time_reads_back_flags(rig: Rig, sent: tuple[float, ...], reads: tuple[float, ...]) -> None:
    """param2 0 or 1, param3 kept, param4 1 or 0 although it is the heading."""
    p2, p3, p4 = sent
    assert kept(rig, item(0, 19, p1=8.0, p2=p2, p3=p3, p4=p4)).params[1:] == reads


@pytest.mark.parametrize(("sent", "reads"), [(90.0, 90.0), (-90.0, 270.0), (450.0, 90.0), (0.0, 0.0)])
def test_waypoint_keeps_radius_and_wraps_heading(rig: Rig, sent: float, reads: float) -> None:
    """param1 and 2 exact, param3 0, param4 in 0..360."""
    stored = kept(rig, item(0, 16, p1=1.5, p2=2.5, p3=9.0, p4=sent))
    assert stored.params[:3] == (1.5, 2.5, 0.0)
    assert stored.param4 == pytest.approx(reads, abs=1e-4)


@pytest.mark.parametrize("command", [16, 17, 21, 22])
def test_a_heading_of_nan_is_kept(rig: Rig, command: int) -> None:
    """Nose along the track."""
    assert math.isnan(kept(rig, item(0, command, p4=NAN)).param4)


def test_land_keeps_param2_and_heading_only(rig: Rig) -> None:
    """param1 and 3 read 0."""
    assert kept(rig, item(0, 21, p1=4.0, p2=1.0, p3=5.0, p4=0.0)).params == (0, 1, 0, 0)


def test_nothing_checks_coordinates(rig: Rig) -> None:
    """Latitude 91, longitude 181 and NaN altitude are stored."""
    stored = kept(rig, item(0, 16, x=910_000_000, y=1_810_000_000, z=NAN))
    assert (stored.x, stored.y) == (910_000_000, 1_810_000_000)
    assert math.isnan(stored.z)


def test_altitude_is_kept_as_a_32_bit_float(rig: Rig) -> None:
    """No centimetres here."""
    assert kept(rig, item(0, 16, z=2.1)).z == pytest.approx(2.1, abs=1e-6)


def test_autocontinue_is_kept(rig: Rig) -> None:
    """0 stays 0."""
    assert kept(rig, item(0, 16, autocontinue=0)).autocontinue == 0


@pytest.mark.parametrize("command", [18, 31000, 0])
def test_unsupported_commands_are_refused(rig: Rig, command: int) -> None:
    """ACK 3; LOITER_TURNS as in the recording."""
    assert rig.keeps(item(0, command, 6)) == 3


def test_fence_items_read_back_frame_5_autocontinue_0_altitude_0(rig: Rig) -> None:
    """Polygon and circle."""
    stored = kept(rig, item(0, 5003, 0, p1=50.5, z=12.0, kind=1))
    assert (stored.frame, stored.autocontinue, stored.z, stored.param1) == (5, 0, 0.0, 50.5)
    assert (stored.x, stored.y) == (LAT_E7, LON_E7)


def test_a_polygon_of_fewer_than_three_vertices_is_an_error(rig: Rig) -> None:
    """ACK 1."""
    assert rig.keeps(item(0, 5001, 5, p1=2, kind=1)) == 1


def test_rally_points_keep_their_frame_as_positions_do(rig: Rig) -> None:
    """3 to 6."""
    assert kept(rig, item(0, 5100, 3, z=30.5, kind=2)).frame == 6


def test_checksum_depends_on_content_and_not_on_numbers_or_the_current_flag() -> None:
    """Two items swapped differ; seq and current do not matter."""
    a = StoredItem(0, 6, 16, 1, 1, 1.0, 0.0, 0.0, 0.0, 1, 2, 3.0)
    b = StoredItem(1, 6, 16, 0, 1, 2.0, 0.0, 0.0, 0.0, 1, 2, 3.0)
    assert checksum([a, b]) != checksum([b, a])
    assert checksum([a, b]) == checksum([a.numbered(7, current=0), b])
    assert checksum([b], checksum([a])) == checksum([a, b])
