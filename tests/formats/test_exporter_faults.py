"""Faults that other exporters have shipped: none is in our files, and the checker finds each one put in."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mavplan.errors import InputError, Problem
from mavplan.formats import FORMATS, read_mission
from mavplan.formats.checks import reader_problems
from mavplan.mission.model import Autopilot, Mission

MakeMission = Callable[[Autopilot], Mission]


def found_in(text: str, mission: Mission | None = None) -> set[str]:
    """Codes of the errors that the checker finds."""
    return {problem.code for problem in reader_problems(text, mission) if problem.severity == "error"}


def plan_with(mission: Mission, change: Callable[[dict[str, Any]], object]) -> str:
    """Our plan of a mission with a fault put in."""
    text = FORMATS[".plan"].dumps(mission)
    assert not found_in(text, mission), "the fault is in our own file"
    document = json.loads(text)
    change(document)
    changed = json.dumps(document)
    assert changed != json.dumps(json.loads(text)), "nothing was put in"
    return changed


def lines_with(mission: Mission, change: Callable[[str], str]) -> str:
    """Our text file of a mission with a fault put in."""
    text = FORMATS[".waypoints"].dumps(mission)
    assert not found_in(text, mission), "the fault is in our own file"
    changed = change(text)
    assert changed != text, "nothing was put in"
    return changed


def items_of(document: dict[str, Any]) -> list[dict[str, Any]]:
    """The items of a plan."""
    items: list[dict[str, Any]] = document["mission"]["items"]
    return items


def first(document: dict[str, Any], command: int) -> dict[str, Any]:
    """The first item with this command."""
    return next(item for item in items_of(document) if item["command"] == command)


class TestLongitudeBeforeLatitude:
    def test_in_one_item_of_a_plan(self, make_mission: MakeMission) -> None:
        """A stop with its coordinates swapped lies far from home."""

        def swap(document: dict[str, Any]) -> None:
            params = first(document, 16)["params"]
            params[4], params[5] = params[5], params[4]

        text = plan_with(make_mission("px4"), swap)
        assert "position" in found_in(text)
        assert any("longitude stands before latitude" in str(problem) for problem in reader_problems(text))

    def test_in_home_of_a_plan(self, make_mission: MakeMission) -> None:
        """All stops lie far from a home that is swapped."""

        def swap(document: dict[str, Any]) -> None:
            home = document["mission"]["plannedHomePosition"]
            home[0], home[1] = home[1], home[0]

        mission = make_mission("ardupilot")
        text = plan_with(mission, swap)
        assert "position" in found_in(text)
        assert "home" in found_in(text, mission)

    def test_in_every_line_of_a_text_file(self, make_mission: MakeMission) -> None:
        """Where all of it is swapped alike, only the comparison with the mission can tell."""
        mission = make_mission("ardupilot")
        text = lines_with(mission, lambda text: re.sub(r"(-?\d+\.\d{7})\t(-?\d+\.\d{7})", r"\2\t\1", text))
        assert {"home", "differs"} <= found_in(text, mission)


class TestHomeAltitudeIsTheFlightHeight:
    @pytest.mark.parametrize("suffix", FORMATS)
    def test_it_is_found(self, make_mission: MakeMission, suffix: str) -> None:
        """A warning by itself, for there are homes at 100 m above sea level; beside the mission an error."""
        mission = make_mission("ardupilot")
        if suffix == ".plan":
            text = plan_with(mission, lambda d: d["mission"]["plannedHomePosition"].__setitem__(2, 100))
        else:
            text = lines_with(mission, lambda text: text.replace("\t12.5\t", "\t100\t"))
        alone = [problem for problem in reader_problems(text) if problem.code == "home-altitude"]
        assert [problem.severity for problem in alone] == ["warning"]
        assert "home-altitude" in found_in(text, mission)


class TestSwappedFirmwareTypes:
    @pytest.mark.parametrize(
        ("autopilot", "wrong", "code", "severity"),
        [("ardupilot", 12, "before-takeoff", "warning"), ("px4", 3, "nan", "error")],
    )
    def test_it_is_found(
        self, make_mission: MakeMission, autopilot: Autopilot, wrong: int, code: str, severity: str
    ) -> None:
        """By what the other firmware would mind in it, and beside the mission by the number itself."""
        mission = make_mission(autopilot)
        text = plan_with(mission, lambda d: d["mission"].__setitem__("firmwareType", wrong))
        assert (code, severity) in {(problem.code, problem.severity) for problem in reader_problems(text)}
        assert "firmware" in found_in(text, mission)


class TestAltitudeModes:
    @pytest.mark.parametrize("mode", [0, 2, 3, 4, 5, None, "1"])
    def test_a_mode_that_does_not_fit_relative_altitude_is_found(
        self, make_mission: MakeMission, mode: object
    ) -> None:
        """Only 1 is relative; 0 is a mixture and says nothing of one item, 3 would be imported as above sea level."""
        text = plan_with(make_mission("px4"), lambda d: first(d, 16).__setitem__("AltitudeMode", mode))
        assert "altitude-mode" in found_in(text)

    @pytest.mark.parametrize("key", ["AltitudeMode", "Altitude", "AMSLAltAboveTerrain"])
    def test_two_of_three_altitude_keys_are_found(self, make_mission: MakeMission, key: str) -> None:
        """QGroundControl refuses the file; so does our reader."""
        text = plan_with(make_mission("px4"), lambda d: first(d, 16).pop(key))
        assert "altitude-keys" in found_in(text)
        with pytest.raises(InputError, match=f"{key} missing"):
            FORMATS[".plan"].loads(text, "m.plan")


class TestJumpIds:
    def test_every_id_1_is_found(self, make_mission: MakeMission) -> None:
        """Ids are unique; our reader refuses the file too."""

        def all_one(document: dict[str, Any]) -> None:
            for item in items_of(document):
                item["doJumpId"] = 1

        text = plan_with(make_mission("ardupilot"), all_one)
        assert found_in(text) == {"jump-id"}
        with pytest.raises(InputError, match="doJumpId: 1 is used before"):
            FORMATS[".plan"].loads(text, "m.plan")


class TestTextLines:
    def test_spaces_for_tabs_in_the_home_line_are_found(self, make_mission: MakeMission) -> None:
        """QGroundControl calls such a file corrupted; our reader, like pymavlink, understands it."""

        def spaces(text: str) -> str:
            lines = text.split("\n")
            return "\n".join((lines[0], lines[1].replace("\t", " "), *lines[2:]))

        text = lines_with(make_mission("ardupilot"), spaces)
        assert "fields" in found_in(text)
        assert FORMATS[".waypoints"].loads(text, "m").home == make_mission("ardupilot").home

    def test_a_sequence_gap_is_found(self, make_mission: MakeMission) -> None:
        """And refused by our reader."""
        text = lines_with(make_mission("ardupilot"), lambda text: re.sub(r"\n3\t.*", "", text))
        assert "sequence" in found_in(text)
        with pytest.raises(InputError, match="line 5, sequence: found 4, 3 is expected"):
            FORMATS[".waypoints"].loads(text, "m")

    def test_version_120_is_found(self, make_mission: MakeMission) -> None:
        """It has no home line, so its first item would be taken for home."""
        text = lines_with(make_mission("ardupilot"), lambda text: text.replace("WPL 110", "WPL 120"))
        assert "version" in found_in(text)
        with pytest.raises(InputError, match="version 110"):
            FORMATS[".waypoints"].loads(text, "m")

    def test_six_decimals_are_found(self, make_mission: MakeMission) -> None:
        """They are up to 6 cm off, and a read-back would differ."""
        text = lines_with(make_mission("ardupilot"), lambda text: re.sub(r"(\.\d{6})\d\t", r"\1\t", text))
        assert found_in(text) == {"decimals"}

    @pytest.mark.parametrize(
        ("old", "new", "code"),
        [
            ("\n", "\r\n", "line-ends"),
            ("\n1\t", "\n# a comment\n1\t", "fields"),
            ("\n1\t", "\n\n1\t", "fields"),
            ("\n2\t0\t3\t22\t", "\n2\t0\t3\t0\t", "command-0"),
            ("\n2\t0\t3\t22\t", "\n2\t0\t10\t22\t", "terrain"),
            ("\n2\t0\t3\t22\t", "\n2\t1\t3\t22\t", "current"),
            ("\n2\t0\t3\t22\t0", "\n2\t0\t3\t22\tnan", "number"),
            ("\t1\n2\t", "\t0\n2\t", "autocontinue"),
            ("\n0\t1\t0\t16", "\n0\t1\t0\t22", "home"),
            ("QGC WPL 110\n", "QGC  WPL 110\n", "version"),
        ],
    )
    def test_what_else_a_reader_stumbles_over_is_found(
        self, make_mission: MakeMission, old: str, new: str, code: str
    ) -> None:
        """One rule of one reader each."""
        mission = make_mission("ardupilot")
        text = lines_with(mission, lambda text: text.replace(old, new))
        assert code in found_in(text)

    def test_a_missing_last_line_feed_is_found(self, make_mission: MakeMission) -> None:
        """Some readers drop the last line then."""
        assert found_in(lines_with(make_mission("ardupilot"), str.rstrip)) == {"line-ends"}


class TestHoldTimes:
    @pytest.mark.parametrize("suffix", FORMATS)
    @pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
    def test_a_huge_param1_is_found(
        self, make_mission: MakeMission, suffix: str, autopilot: Autopilot
    ) -> None:
        """1e10 has crashed a simulator; writer, reader and checker refuse it."""
        mission = make_mission(autopilot)
        if suffix == ".plan":
            text = plan_with(mission, lambda d: first(d, 19)["params"].__setitem__(0, 1e10))
        else:
            hold = "8\t" if autopilot == "ardupilot" else "8.2\t"
            text = lines_with(mission, lambda text: text.replace(f"\t19\t{hold}", "\t19\t10000000000\t"))
        assert {"param", "hold"} <= found_in(text)
        with pytest.raises(InputError, match="out of range"):
            FORMATS[suffix].loads(text, "m")

    def test_a_fraction_is_found_in_a_plan_for_ardupilot(self, make_mission: MakeMission) -> None:
        """7.6 s would be held 7 s, with ACK 0."""
        text = plan_with(make_mission("ardupilot"), lambda d: first(d, 19)["params"].__setitem__(0, 7.6))
        assert found_in(text) == {"fraction"}

    def test_a_fraction_is_told_in_a_text_file(self, make_mission: MakeMission) -> None:
        """The file does not say for whom it is: a warning; beside a mission for ArduPilot an error."""
        mission = make_mission("ardupilot")
        text = lines_with(mission, lambda text: text.replace("\t19\t8\t", "\t19\t7.6\t"))
        assert [problem.code for problem in reader_problems(text)] == ["fraction"]
        assert found_in(text, mission) == {"fraction", "differs"}

    def test_px4_keeps_fractions(self, make_mission: MakeMission) -> None:
        """So they are no fault in its plan."""
        assert not reader_problems(FORMATS[".plan"].dumps(make_mission("px4")))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda d: d.pop("groundStation"), "type"),
        (lambda d: d.__setitem__("fileType", "Mission"), "file-type"),
        (lambda d: d.__setitem__("version", 1.0), "version"),
        (lambda d: d.pop("geoFence"), "section"),
        (lambda d: d.pop("rallyPoints"), "section"),
        (lambda d: d["geoFence"].__setitem__("version", 1), "version"),
        (lambda d: d["geoFence"].pop("circles"), "type"),
        (
            lambda d: d["geoFence"]["polygons"].append(
                {"polygon": [[1, 2]], "inclusion": True, "version": 1}
            ),
            "fence",
        ),
        (lambda d: d["rallyPoints"]["points"].append([91, 0, 0]), "rally"),
        (lambda d: d["mission"].__setitem__("cruiseSpeed", 7.5), "type"),
        (lambda d: d["mission"].__setitem__("hoverSpeed", 7.0), "type"),
        (lambda d: d["mission"].pop("vehicleType"), "type"),
        (lambda d: d["mission"].__setitem__("globalPlanAltitudeMode", "relative"), "type"),
        (lambda d: d["mission"].__setitem__("plannedHomePosition", [1, 2]), "home"),
        (lambda d: d["mission"].__setitem__("items", []), "empty"),
        (lambda d: first(d, 16)["params"].pop(), "params"),
        (lambda d: first(d, 16)["params"].__setitem__(4, None), "params"),
        (lambda d: first(d, 16)["params"].__setitem__(4, 91), "position"),
        (lambda d: first(d, 16).__setitem__("frame", 6), "frame"),
        (lambda d: first(d, 16).pop("autoContinue"), "type"),
        (lambda d: first(d, 16).__setitem__("type", "ComplexItem"), "type"),
        (lambda d: first(d, 20).__setitem__("frame", 3), "frame"),
        (lambda d: first(d, 20).__setitem__("Altitude", 3), "altitude-keys"),
        (lambda d: items_of(d).pop(0), "no-takeoff"),
        (lambda d: items_of(d).insert(0, first(d, 16) | {"doJumpId": 99}), "no-takeoff"),
        (lambda d: first(d, 22)["params"].__setitem__(6, 0), "no-takeoff"),
    ],
)
def test_what_else_a_ground_station_refuses_in_a_plan_is_found(
    make_mission: MakeMission, change: Callable[[dict[str, Any]], object], code: str
) -> None:
    """One rule of one reader each, in a plan for PX4."""
    assert code in found_in(plan_with(make_mission("px4"), change))


def test_what_qgroundcontrol_saves_has_no_fault_but_a_speed_that_mission_planner_cannot_parse() -> None:
    """Ids with gaps, an altitude above sea level, a fence: all as its loader wants them; the jump is warned about."""
    path = Path(__file__).with_name("data") / "qgroundcontrol.plan"
    found = [(problem.code, problem.severity) for problem in reader_problems(path, read_mission(path))]
    assert found == [("type", "error"), ("jump-id", "warning")]


def test_a_jump_to_nowhere_is_found(make_mission: MakeMission) -> None:
    """A target is the doJumpId of an item."""
    jump = {"type": "SimpleItem", "command": 177, "frame": 2, "autoContinue": True, "doJumpId": 99}
    for target, code in ((2, set()), (99, set()), (50, {"jump"})):
        extra = jump | {"params": [target, 1, 0, 0, 0, 0, 0]}
        assert found_in(plan_with(make_mission("px4"), lambda d, e=extra: items_of(d).append(e))) == code


def test_a_file_is_checked_by_its_suffix(tmp_path: Path, make_mission: MakeMission) -> None:
    """A path is read, and messages name it."""
    path = tmp_path / "m.plan"
    path.write_text(FORMATS[".waypoints"].dumps(make_mission("px4")))
    problems: list[Problem] = reader_problems(path)
    assert problems[0].code == "not-json"
    assert str(path) in str(problems[0])


def test_a_file_that_cannot_be_read_is_an_input_error(tmp_path: Path) -> None:
    """Not a traceback."""
    with pytest.raises(InputError, match="No such file"):
        reader_problems(tmp_path / "m.plan")
