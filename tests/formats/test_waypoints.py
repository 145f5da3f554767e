"""``.waypoints``: what is written, what is read, what is refused and on which line."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from mavplan.errors import InputError
from mavplan.formats import waypoints
from mavplan.mission.model import NAN, Autopilot, Command, Frame, HomePosition, Mission, MissionItem

MakeMission = Callable[[Autopilot], Mission]
HOME = HomePosition(374_000_018, -1_220_999_971, 8.822)

GOOD = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t37.4000018\t-122.0999971\t8.822\t1
1\t0\t3\t22\t0\t0\t0\t0\t37.4000018\t-122.0999971\t30\t1
2\t0\t3\t19\t8\t0\t0\t0\t37.4013475\t-122.0000001\t30.5\t1
3\t0\t2\t20\t0\t0\t0\t0\t0.0000000\t0.0000000\t0\t1
"""


def good_mission() -> Mission:
    """What GOOD says."""
    takeoff = MissionItem(22, 3, lat_e7=HOME.lat_e7, lon_e7=HOME.lon_e7, alt_m=30.0)
    loiter = MissionItem(19, 3, (8.0, 0.0, 0.0, 0.0), lat_e7=374_013_475, lon_e7=-1_220_000_001, alt_m=30.5)
    return Mission((takeoff, loiter, MissionItem(20, Frame.MISSION)), HOME)


class TestWriting:
    def test_the_text_is_this(self) -> None:
        """Tabs, twelve fields, home on line 0, seven decimals, a line feed at the end: byte for byte."""
        assert waypoints.dumps(good_mission()) == GOOD

    @pytest.mark.parametrize(
        ("e7", "text"),
        [
            (1, "0.0000001"),
            (-1, "-0.0000001"),
            (-1_799_999_999, "-179.9999999"),
            (0, "0.0000000"),
            (10**7, "1.0000000"),
        ],
    )
    def test_coordinates_are_exact(self, e7: int, text: str) -> None:
        """No binary fraction comes between the integer on the wire and the digits in the file."""
        item = MissionItem(16, 3, lat_e7=5, lon_e7=e7, alt_m=1.0)
        assert waypoints.dumps(Mission((item,), HOME)).splitlines()[2].split("\t")[9] == text

    def test_numbers_have_no_exponent(self) -> None:
        """Mission Planner and others parse plain decimals."""
        item = MissionItem(16, 3, (1e-7, 123_456.0, 0.1, -0.0), lat_e7=5, lon_e7=5, alt_m=1e-5)
        fields = waypoints.dumps(Mission((item,), HOME)).splitlines()[2].split("\t")
        assert fields[4:8] == ["0.0000001", "123456", "0.1", "0"]
        assert fields[10] == "0.00001"

    def test_px4s_nan_becomes_0_and_is_told(self, make_mission: MakeMission) -> None:
        """Not every reader takes nan; PX4 then turns the nose north, which the user must know."""
        mission = make_mission("px4")
        assert "nan" not in waypoints.dumps(mission).lower()
        (warning,) = waypoints.warnings(mission)
        assert warning.severity == "warning"
        assert "north" in warning.message

    def test_ardupilot_ignores_the_heading_so_nothing_is_told(self, make_mission: MakeMission) -> None:
        """A NaN there changes nothing in flight."""
        mission = make_mission("ardupilot")
        items = [replace(item, params=(0.0, 0.0, 0.0, NAN)) for item in mission.items if item.command == 16]
        assert not waypoints.warnings(replace(mission, items=tuple(items)))

    def test_autocontinue_off_is_told(self) -> None:
        """The file always says 1."""
        items = (replace(good_mission().items[1], autocontinue=False),)
        mission = Mission(items, HOME)
        assert waypoints.dumps(mission).endswith("\t1\n")
        assert [problem.code for problem in waypoints.warnings(mission)] == ["autocontinue"]

    @pytest.mark.parametrize("frame", [10, 11])
    def test_altitudes_above_terrain_are_refused(self, frame: int) -> None:
        """QGroundControl would read them from this format as above sea level."""
        item = MissionItem(16, frame, lat_e7=5, lon_e7=5, alt_m=50.0)
        with pytest.raises(InputError, match=r"item 0: altitudes above terrain .*\.plan"):
            waypoints.dumps(Mission((item,), HOME))

    def test_jumps_are_counted_with_home(self) -> None:
        """The model counts from 0 over its items, the file has home as 0."""
        jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (0.0, 2.0, 0.0, 0.0))
        text = waypoints.dumps(Mission((good_mission().items[0], jump), HOME))
        assert text.splitlines()[3].split("\t")[:6] == ["2", "0", "2", "177", "1", "2"]
        assert waypoints.loads(text, "m").items[1] == jump


class TestReading:
    @pytest.mark.parametrize(
        "text",
        [
            GOOD,
            GOOD.replace("\n", "\r\n"),
            GOOD.replace("\t", "  "),
            GOOD.replace("\n2\t", "\n# the first stop\n\n2\t"),
            GOOD.rstrip("\n"),
            "\ufeff" + GOOD,
            GOOD.replace("1\t0\t3\t22\t0\t", "1\t0\t6\t22\t0.000000\t"),
            GOOD.replace("0\t1\t0\t16", "0\t0\t0\t16"),
            GOOD.replace("0\t1\t0\t16", "0\t1\t0\t0"),
            GOOD.replace("3\t0\t2\t20", "3\t0\t3\t20"),
        ],
        ids=[
            "ours",
            "crlf",
            "spaces",
            "comments",
            "no end",
            "bom",
            "frame 6",
            "current 0",
            "command 0",
            "frame 3",
        ],
    )
    def test_what_other_programs_write_is_understood(self, text: str) -> None:
        """All of these say the same."""
        assert waypoints.loads(text, "m.waypoints") == good_mission()

    def test_no_autopilot_is_said(self) -> None:
        """The format does not tell which firmware it is for."""
        assert waypoints.loads(GOOD, "m").autopilot is None

    def test_nan_is_taken_as_a_parameter(self) -> None:
        """Some programs write it for PX4."""
        text = GOOD.replace("\t8\t0\t0\t0\t", "\t8\t0\t0\tNaN\t")
        assert math.isnan(waypoints.loads(text, "m").items[1].params[3])

    def test_every_problem_is_found_in_one_pass(self) -> None:
        """Four faults on four lines are four problems; a gap in the numbers is told once."""
        text = GOOD.replace("-122.0999971\t30\t", "181\t30\t").replace("\n3\t0", "\n4\t0")
        text += "5\t0\t3\t16\t0\t0\t0\t91\n6\t0\t3\t82\t0\t0\t0\t0\t1\t1\t1\t1\n7\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
        with pytest.raises(InputError) as caught:
            waypoints.loads(text, "m.waypoints")
        assert [problem.where for problem in sorted(caught.value.problems, key=str)] == [
            "m.waypoints, line 3, longitude",
            "m.waypoints, line 5, sequence",
            "m.waypoints, line 6",
            "m.waypoints, line 7, command",
        ]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("QGC WPL 110", "QGC WPL 120", "line 1: .*only version 110 has a home line"),
        ("QGC WPL 110", "QGC WPL 100", "line 1: .*only version 110"),
        ("QGC WPL 110", '{"fileType": "Plan"}', 'line 1: .*begins with "QGC WPL 110"'),
        ("\n2\t0", "\n3\t0", "line 4, sequence: found 3, 2 is expected"),
        ("\n0\t1", "\n1\t1", "line 2, sequence: found 1, 0 is expected"),
        ("\n2\t0\t3\t19", "\n2\t0\t3\t0", "line 4, command: command 0 "),
        ("\n2\t0\t3\t19", "\n2\t0\t3\t18", "line 4, command: command 18 "),
        ("\n2\t0\t3\t19", "\n2\t0\t4\t19", "line 4, frame: frame 4"),
        ("\n2\t0\t3\t19", "\n2\t0\t2\t19", "line 4, frame: frame 2"),
        ("\n2\t0\t3\t19", "\n2\t2\t3\t19", "line 4, current: found 2"),
        ("\n2\t0\t3\t19", "\n2.0\t0\t3\t19", "line 4, sequence: found 2.0, a whole number"),
        ("\t30.5\t1\n", "\t30.5\n", "line 4: 11 fields; exactly 12"),
        ("\t30.5\t1\n", "\t30.5\t1\t1\n", "line 4: 13 fields; exactly 12"),
        ("\t30.5\t1\n", "\t30.5\tyes\n", "line 4, autocontinue: found yes"),
        ("\t30.5\t", "\tnan\t", "line 4, altitude: found nan, a finite number"),
        ("\t30.5\t", "\t1e999\t", "line 4, altitude: found 1e999"),
        ("\t30.5\t", "\t1_0\t", "line 4, altitude: found 1_0"),
        ("\t30.5\t", "\t90000\t", "line 4, altitude: altitude 90000"),
        ("37.4013475", "91.5", "line 4, latitude: latitude 91.5 is out of range"),
        ("-122.0000001", "-180.5", "line 4, longitude: longitude -180.5"),
        ("37.4013475", "37,4013475", "line 4, latitude: found 37,4013475"),
        ("\t8\t0\t0\t0\t", "\t1e10\t0\t0\t0\t", r"line 4, param1: 1e\+10 is out of range"),
        ("\t8\t0\t0\t0\t", "\t-1\t0\t0\t0\t", "line 4, param1: a hold of -1 s"),
        ("\t8\t0\t0\t0\t", "\t8\tinf\t0\t0\t", "line 4, param2: found inf"),
        ("\n0\t1\t0\t16", "\n0\t1\t3\t22", "line 2: command 22 in frame 3, home is expected"),
        ("8.822", "20000", "line 2, altitude: home altitude"),
        (
            "\n3\t0\t2\t20\t0",
            "\n3\t0\t2\t177\t0",
            "line 5, param1: DO_JUMP goes to an item that does not exist",
        ),
        (
            "\n3\t0\t2\t20\t0",
            "\n3\t0\t2\t177\t4",
            "line 5, param1: DO_JUMP goes to an item that does not exist",
        ),
    ],
)
def test_what_is_refused_is_named_with_its_line(old: str, new: str, said: str) -> None:
    """One fault each; the message names line, field, value and what is allowed."""
    assert GOOD.count(old) == 1 or old.startswith("\t")
    with pytest.raises(InputError, match=said) as caught:
        waypoints.loads(GOOD.replace(old, new, 1), "m.waypoints")
    assert len({problem.code for problem in caught.value.problems}) == 1


@pytest.mark.parametrize("text", ["", "\n", "QGC WPL 110", "\n".join(GOOD.splitlines()[:2])])
def test_a_file_without_items_is_refused(text: str) -> None:
    """It would clear a vehicle."""
    with pytest.raises(InputError):
        waypoints.loads(text, "m.waypoints")
