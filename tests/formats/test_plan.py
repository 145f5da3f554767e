"""``.plan``: what is written, what is read, what is refused and where."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mavplan.errors import InputError
from mavplan.formats import plan, read_mission
from mavplan.mission.geofence import Fence, FencePolygon
from mavplan.mission.model import Autopilot, Command, Frame, HomePosition, Mission, MissionItem

MakeMission = Callable[[Autopilot], Mission]
QGC_FILE = Path(__file__).with_name("data") / "qgroundcontrol.plan"


def mission_of(*items: MissionItem, autopilot: Autopilot | None = "px4") -> Mission:
    """A mission of these items."""
    return Mission(items, HomePosition(470_000_000, 80_000_000, 400.0), autopilot)


def waypoint(frame: int = 3, **fields: Any) -> MissionItem:
    """A waypoint beside home."""
    return MissionItem(16, frame, lat_e7=470_010_000, lon_e7=80_010_000, alt_m=50.0, **fields)


class TestWriting:
    def test_firmware_types_are_mavlinks(self, make_mission: MakeMission) -> None:
        """ArduPilot is 3 and PX4 12 (MAV_AUTOPILOT); a mission for nobody in particular says 0."""
        for autopilot, number in (("ardupilot", 3), ("px4", 12), (None, 0)):
            text = plan.dumps(replace(make_mission("ardupilot"), autopilot=autopilot))
            assert json.loads(text)["mission"]["firmwareType"] == number

    def test_versions_and_sections_are_those_that_mavsdk_wants(self, make_mission: MakeMission) -> None:
        """Integers 1, 2, 2, 2, and fence and rally points also where there are none."""
        document = json.loads(plan.dumps(make_mission("px4")))
        versions = (document, document["mission"], document["geoFence"], document["rallyPoints"])
        assert [repr(part["version"]) for part in versions] == ["1", "2", "2", "2"]
        assert document["fileType"] == "Plan"
        assert document["groundStation"] == "mavplan"
        assert document["geoFence"] == {"circles": [], "polygons": [], "version": 2}

    def test_speeds_are_whole_numbers_without_a_point(self, make_mission: MakeMission) -> None:
        """Mission Planner parses them as integers; the speed item keeps the fraction."""
        mission = replace(make_mission("px4"), cruise_speed_m_s=7.6, hover_speed_m_s=0.3)
        text = plan.dumps(mission)
        assert '"cruiseSpeed": 8,' in text
        assert '"hoverSpeed": 1,' in text

    def test_nan_is_null(self, make_mission: MakeMission) -> None:
        """PX4's "nose along the track" stands as null; the token NaN is no JSON."""
        text = plan.dumps(make_mission("px4"))
        assert "NaN" not in text
        loiters = [item for item in json.loads(text)["mission"]["items"] if item["command"] == 19]
        assert all(item["params"][3] is None for item in loiters)

    @pytest.mark.parametrize(
        ("frame", "written", "mode"), [(0, 0, 2), (5, 0, 2), (3, 3, 1), (6, 3, 1), (10, 10, 4), (11, 10, 4)]
    )
    def test_frame_and_altitude_mode_agree(self, frame: int, written: int, mode: int) -> None:
        """Mode 1 is above home, 2 above sea level, 4 above terrain; 6 is written as 3, 5 as 0, 11 as 10."""
        entry = json.loads(plan.dumps(mission_of(waypoint(frame))))["mission"]["items"][0]
        assert (entry["frame"], entry["AltitudeMode"], entry["Altitude"]) == (written, mode, 50)
        assert "AMSLAltAboveTerrain" in entry

    def test_items_without_a_position_have_no_altitude_keys(self, make_mission: MakeMission) -> None:
        """All three of them or none, and none where there is no altitude."""
        for entry in json.loads(plan.dumps(make_mission("ardupilot")))["mission"]["items"]:
            given = {"AltitudeMode", "Altitude", "AMSLAltAboveTerrain"} & set(entry)
            assert len(given) == (3 if entry["command"] in (16, 19, 22) else 0)

    def test_jumps_go_to_the_id_of_their_target(self) -> None:
        """The model counts from 0, doJumpId from 1, and MAVSDK sends the number as it is."""
        jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (0.0, 2.0, 0.0, 0.0))
        entries = json.loads(plan.dumps(mission_of(waypoint(), jump)))["mission"]["items"]
        assert [entry["doJumpId"] for entry in entries] == [1, 2]
        assert entries[1]["params"][0] == 1

    def test_home_altitude_is_above_sea_level(self, make_mission: MakeMission) -> None:
        """Latitude first, then longitude, then the ground's height: not the flight height."""
        home = json.loads(plan.dumps(make_mission("px4")))["mission"]["plannedHomePosition"]
        assert home == [42.3736, -71.1097123, 12.5]

    @pytest.mark.parametrize(
        ("item", "said"),
        [
            (MissionItem(82, 3), "command 82"),
            (waypoint(frame=1), "frame 1"),
            (waypoint(frame=2), "frame 2"),
            (MissionItem(16, 3, lat_e7=910_000_000, lon_e7=5), "latitude 91"),
            (MissionItem(16, 3, lat_e7=5, lon_e7=1_810_000_000), "longitude 181"),
            (MissionItem(16, 3, lat_e7=5, alt_m=math.nan), "altitude nan"),
            (MissionItem(22, 3, alt_m=5.0), "PX4 would fly there"),
            (waypoint(params=(1e10, 0.0, 0.0, 0.0)), "1e"),
            (waypoint(params=(70_000.0, 0.0, 0.0, 0.0)), "hold of 70000"),
            (waypoint(params=(0.0, math.inf, 0.0, 0.0)), "inf"),
            (MissionItem(177, 2, (3.0, 0.0, 0.0, 0.0)), "does not exist"),
        ],
    )
    def test_what_no_vehicle_should_get_is_not_written(self, item: MissionItem, said: str) -> None:
        """The writer refuses what the reader would, with the item's number."""
        with pytest.raises(InputError, match=said) as caught:
            plan.dumps(mission_of(waypoint(), item))
        assert all(problem.where.startswith("item 1") for problem in caught.value.problems)

    def test_an_empty_mission_is_not_written(self) -> None:
        """A file without items would clear a vehicle."""
        with pytest.raises(InputError, match="no items"):
            plan.dumps(mission_of())


class TestReading:
    def test_a_file_as_qgroundcontrol_saves_it(self) -> None:
        """autoContinue false, more decimals than needed, ids with gaps, a fence: all understood."""
        mission = read_mission(QGC_FILE)
        assert mission.autopilot == "px4"
        assert mission.home == HomePosition(473_977_419, 85_455_940, 489.977)
        assert (mission.cruise_speed_m_s, mission.hover_speed_m_s) == (15.0, 5.5)
        takeoff, point, jump, home = mission.items
        assert (takeoff.lat_e7, takeoff.lon_e7, takeoff.alt_m) == (473_977_396, 85_455_938, 50.0)
        assert math.isnan(takeoff.params[3])
        assert (point.frame, point.alt_m, point.lon_e7, point.autocontinue) == (0, 545.25, 85_454_911, False)
        assert jump.params == (1.0, 2.0, 0.0, 0.0)
        assert mission.items[int(jump.params[0])] is point
        assert (home.command, home.frame) == (20, Frame.MISSION)
        corners = ((473_990_000, 85_430_000), (473_990_000, 85_480_000), (473_960_000, 85_480_000))
        assert mission.fence == Fence(polygons=(FencePolygon(True, corners),))
        assert mission.rally == ()
        assert mission.warnings == ()

    def test_a_generic_firmware_is_no_autopilot(self) -> None:
        """firmwareType 0 says nothing."""
        assert plan.loads(changed(("mission", "firmwareType"), 0), "m").autopilot is None

    def test_unknown_keys_are_left_alone(self) -> None:
        """Newer ground stations may write more."""
        document = json.loads(QGC_FILE.read_text())
        document["new"] = document["mission"]["new"] = document["mission"]["items"][0]["new"] = [1]
        assert plan.loads(json.dumps(document), "m").items == read_mission(QGC_FILE).items

    def test_every_problem_is_found_in_one_pass(self) -> None:
        """Five faults in one file are five problems, each with its place."""
        document = json.loads(QGC_FILE.read_text())
        document["version"] = 2
        del document["rallyPoints"]
        items = document["mission"]["items"]
        items[0]["params"][4] = 91
        items[1]["command"] = 82
        items[3]["doJumpId"] = 1
        with pytest.raises(InputError) as caught:
            plan.loads(json.dumps(document), "m.plan")
        assert {problem.where for problem in caught.value.problems} == {
            "m.plan, version",
            "m.plan, rallyPoints",
            "m.plan, mission.items[0].params[4]",
            "m.plan, mission.items[1].command",
            "m.plan, mission.items[3].doJumpId",
        }


def changed(path: tuple[str | int, ...], value: Any) -> str:
    """The file of QGroundControl with one value replaced; `...` takes the key away."""
    document = json.loads(QGC_FILE.read_text())
    node = document
    for key in path[:-1]:
        node = node[key]
    if value is ...:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return json.dumps(document)


ITEM = ("mission", "items", 1)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("fileType",), "Mission", 'fileType: found "Mission"'),
        (("version",), 1.5, "version: found 1.5"),
        (("version",), True, "version: found true"),
        (("mission",), ..., "mission: this section is missing"),
        (("mission", "version"), 1, r"mission\.version: found 1"),
        (("geoFence",), ..., "geoFence: this section is missing"),
        (("geoFence", "version"), 1, r"geoFence\.version"),
        (("rallyPoints",), [], "rallyPoints: this section is not an object"),
        (("mission", "firmwareType"), 4, r"firmwareType: found 4, allowed are 3 \(ArduPilot\), 12 \(PX4\)"),
        (("mission", "firmwareType"), False, "firmwareType: found false"),
        (("mission", "vehicleType"), "quad", "vehicleType"),
        (("mission", "cruiseSpeed"), -1, "cruiseSpeed: found -1"),
        (("mission", "items"), {}, "a list of items"),
        (("mission", "items"), [], "0 items"),
        (("mission", "plannedHomePosition"), [1, 2], "three numbers"),
        (("mission", "plannedHomePosition", 0), 91, r"plannedHomePosition\[0\]: latitude 91"),
        (("mission", "plannedHomePosition", 2), None, r"plannedHomePosition\[2\]"),
        (("mission", "plannedHomePosition", 2), 20_000, r"home altitude 20000"),
        (ITEM, 3, r"items\[1\]: an object"),
        ((*ITEM, "type"), "ComplexItem", "ComplexItem.* takes no ComplexItems"),
        ((*ITEM, "command"), 112, r"command 112 .*NAV_LOITER_TIME \(19\)"),
        ((*ITEM, "command"), "16", "command: found"),
        ((*ITEM, "frame"), 1, "frame 1 is not one of a position"),
        ((*ITEM, "frame"), 2, "frame 2 is not one of a position"),
        ((*ITEM, "frame"), 3, "AltitudeMode: 2 contradicts frame 3"),
        ((*ITEM, "Altitude"), 50, r"Altitude: 50 contradicts params\[6\], which is 545.25"),
        ((*ITEM, "AltitudeMode"), ..., "AltitudeMode missing"),
        ((*ITEM, "autoContinue"), 1, "autoContinue: found 1"),
        ((*ITEM, "doJumpId"), 1, r"doJumpId: 1 is used before by mission.items\[0\]"),
        ((*ITEM, "doJumpId"), 0, "doJumpId: found 0"),
        ((*ITEM, "doJumpId"), 9, "DO_JUMP goes to doJumpId 4, which no item has"),
        ((*ITEM, "params"), [0] * 6, "6 values; exactly seven"),
        ((*ITEM, "params", 0), "8", r"params\[0\]: found .8."),
        ((*ITEM, "params", 0), True, r"params\[0\]: found true"),
        ((*ITEM, "params", 0), 1e10, r"params\[0\]: 1e\+10 is out of range"),
        ((*ITEM, "params", 0), -1, r"params\[0\]: a hold of -1 s"),
        ((*ITEM, "params", 4), None, r"params\[4\]: null: this command needs a latitude"),
        ((*ITEM, "params", 4), -90.5, "latitude -90.5"),
        ((*ITEM, "params", 5), 181, "longitude 181"),
        ((*ITEM, "params", 6), 1e5, "altitude 100000"),
    ],
)
def test_what_is_refused_is_named_with_its_place(path: tuple[str | int, ...], value: Any, said: str) -> None:
    """One fault each; the message names place, value and what is allowed."""
    with pytest.raises(InputError, match=said):
        plan.loads(changed(path, value), "m.plan")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not JSON"),
        ("[]", "a JSON object"),
        ('{"a": NaN}', "the token NaN is not a number"),
        ('{"a": -Infinity}', "the token -Infinity"),
        ('{"version": 1, "version": 1}', 'the key "version" stands twice'),
        ("[" * 100_000, "nested too deeply|is not JSON"),
        ("9" * 5000, "is not JSON"),
    ],
)
def test_what_is_no_plan_at_all_is_told(text: str, said: str) -> None:
    """Bad JSON in all its forms is one sentence."""
    with pytest.raises(InputError, match=said) as caught:
        plan.loads(text, "m.plan")
    assert len(caught.value.problems) == 1


def test_a_number_beyond_all_range_is_refused() -> None:
    """1e999 parses as infinity, which must not reach a vehicle."""
    text = changed((*ITEM, "params", 1), 12345).replace("12345", "1e999")
    with pytest.raises(InputError, match=r"params\[1\]"):
        plan.loads(text, "m.plan")


def test_take_off_without_a_place_is_refused_for_px4_only() -> None:
    """PX4 flies to latitude 0, longitude 0; ArduPilot takes off where it stands."""
    document = json.loads(QGC_FILE.read_text())
    document["mission"]["items"][0]["params"][4:6] = [0, 0]
    with pytest.raises(InputError, match=r"items\[0\].params\[4\]: .*PX4 would fly there"):
        plan.loads(json.dumps(document), "m.plan")
    document["mission"]["firmwareType"] = 3
    assert plan.loads(json.dumps(document), "m.plan").items[0].lat_e7 == 0


def test_no_value_in_a_timed_loiter_is_refused_for_ardupilot() -> None:
    """ArduPilot answers NaN in LOITER_TIME with an error, so it is told before the upload."""
    document = json.loads(QGC_FILE.read_text())
    document["mission"]["items"][1]["command"] = 19
    assert math.isnan(plan.loads(json.dumps(document), "m.plan").items[1].params[3])
    document["mission"]["firmwareType"] = 3
    with pytest.raises(InputError, match=r"items\[1\].params\[3\]: no value \(NaN\)"):
        plan.loads(json.dumps(document), "m.plan")
