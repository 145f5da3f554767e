"""A plan's stops become the items that each autopilot wants, by what was measured of them."""

import math
from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4, AutopilotRules
from mavplan.mission.build import ENDS, HOVERS, BuiltMission, End, Hover, StopItems, build_mission
from mavplan.mission.model import Command, Frame, HomePosition, MissionItem

HOME = HomePosition(374_000_018, -1_220_999_971, 8.822)
STOPS = ((374_013_475, -1_220_999_971), (374_013_475, -1_220_983_038))


def built(rules: AutopilotRules = ARDUPILOT, **changes: Any) -> BuiltMission:
    """Two stops of 8 and 9 s at 30 m, 7 m/s."""
    arguments: dict[str, Any] = {
        "home": HOME,
        "stops_e7": STOPS,
        "holds_s": (8.0, 9.0),
        "rules": rules,
        "altitude_m": 30.0,
        "speed_m_s": 7.0,
    }
    return build_mission(**(arguments | changes))


def commands(result: BuiltMission) -> list[str]:
    """Names of the commands, in order."""
    return [Command(item.command).name for item in result.mission.items]


def codes(result: BuiltMission) -> list[str]:
    """Codes of the warnings."""
    assert all(problem.severity == "warning" for problem in result.warnings)
    return [problem.code for problem in result.warnings]


STOP = ["NAV_WAYPOINT", "NAV_LOITER_TIME"]


class TestOrder:
    def test_ardupilot(self) -> None:
        """Speed before take-off, where it acts and takes no MISSION_ITEM_REACHED from a flown item."""
        result = built(ARDUPILOT)
        assert commands(result) == ["DO_CHANGE_SPEED", "NAV_TAKEOFF", *STOP, *STOP, "NAV_RETURN_TO_LAUNCH"]
        assert result.stop_items == (StopItems(2, 3), StopItems(4, 5))

    def test_px4(self) -> None:
        """PX4 rejects a mission in which take-off is not first."""
        result = built(PX4)
        assert commands(result) == ["NAV_TAKEOFF", "DO_CHANGE_SPEED", *STOP, *STOP, "NAV_RETURN_TO_LAUNCH"]
        assert result.stop_items == (StopItems(2, 3), StopItems(4, 5))

    @pytest.mark.parametrize(
        ("hover", "stop", "holding"),
        [("waypoint+loiter", STOP, 1), ("loiter", STOP[1:], 0), ("hold", STOP[:1], 0)],
    )
    def test_what_a_stop_is_made_of(self, hover: Hover, stop: list[str], holding: int) -> None:
        """The hold stands in param1 of the item that holds, and nowhere else."""
        for rules in AUTOPILOTS.values():
            result = built(rules, hover=hover)
            for number, (place, hold_s) in enumerate(zip(STOPS, (8.0, 9.0), strict=True)):
                where = result.stop_items[number]
                items = result.mission.items[where.first : where.hold + 1]
                assert [Command(item.command).name for item in items] == stop
                assert [item.params[0] for item in items] == [0.0] * holding + [hold_s]
                assert {(item.lat_e7, item.lon_e7, item.alt_m, item.frame) for item in items} == {
                    (*place, 30.0, 3)
                }

    @pytest.mark.parametrize(
        ("end", "last"),
        [
            ("rtl", MissionItem(20, Frame.MISSION)),
            ("land", MissionItem(21, 3, (0.0, 0.0, 0.0, 0.0), *STOPS[1], 0.0)),
            ("stay", MissionItem(17, 3, (0.0, 0.0, 0.0, 0.0), *STOPS[1], 30.0)),
        ],
    )
    def test_the_end(self, end: End, last: MissionItem) -> None:
        """Back home, down at the last stop, or hovering there."""
        assert built(ARDUPILOT, end=end).mission.items[-1] == last

    def test_no_held_item_is_followed_by_a_speed_item(self) -> None:
        """Such an item gets no MISSION_ITEM_REACHED of its own on either autopilot."""
        for rules, end, hover in product(AUTOPILOTS.values(), ENDS, HOVERS):
            result = built(rules, end=end, hover=hover)
            for stop in result.stop_items:
                assert result.mission.items[stop.hold + 1].command != Command.DO_CHANGE_SPEED

    def test_points_that_are_only_turned_at(self) -> None:
        """A waypoint without a hold: flown through, no stop, whatever stops are made of."""
        for rules, hover in product(AUTOPILOTS.values(), HOVERS):
            result = built(rules, stops_e7=(STOPS[1], *STOPS), holds_s=(None, 8.0, 9.0), hover=hover)
            turn = result.mission.items[2]
            assert (turn.command, turn.params[0], turn.lat_e7) == (16, 0.0, STOPS[1][0])
            assert [stop.first for stop in result.stop_items] == [3, 3 + (2 if "+" in hover else 1)]


class TestFields:
    def test_take_off_is_at_home(self) -> None:
        """PX4 flies to its latitude and longitude."""
        for rules in AUTOPILOTS.values():
            takeoff = next(item for item in built(rules).mission.items if item.command == Command.NAV_TAKEOFF)
            assert (takeoff.lat_e7, takeoff.lon_e7, takeoff.alt_m) == (HOME.lat_e7, HOME.lon_e7, 30.0)

    def test_the_speed_is_over_ground(self) -> None:
        """param1 1 is ground speed, param2 m/s, param3 -1 leaves the throttle alone."""
        for rules in AUTOPILOTS.values():
            (speed,) = (
                item for item in built(rules).mission.items if item.command == Command.DO_CHANGE_SPEED
            )
            assert speed.params == (1.0, 7.0, -1.0, 0.0)

    def test_ardupilot_gets_no_nan(self) -> None:
        """It refuses NaN in LOITER_TIME and reads everything else back as 0."""
        for end, hover in product(ENDS, HOVERS):
            for item in built(ARDUPILOT, end=end, hover=hover).mission.items:
                assert not any(math.isnan(value) for value in item.params)

    def test_px4_keeps_its_nose_along_the_track(self) -> None:
        """param4 is the heading there and 0 is north: NaN in all items with a place, in no other."""
        for end, hover in product(ENDS, HOVERS):
            for item in built(PX4, end=end, hover=hover).mission.items:
                assert math.isnan(item.params[3]) == item.has_position

    def test_items_without_a_place_are_in_the_mission_frame(self) -> None:
        """PX4 takes them in no other."""
        for rules in AUTOPILOTS.values():
            bare = [item for item in built(rules).mission.items if not item.has_position]
            assert {(item.frame, item.lat_e7, item.lon_e7, item.alt_m) for item in bare} == {(2, 0, 0, 0.0)}

    def test_a_stop_at_home_and_one_twice_are_fine(self) -> None:
        """Legs of length zero are missions too."""
        place = (HOME.lat_e7, HOME.lon_e7)
        result = built(PX4, stops_e7=(place, place))
        assert commands(result).count("NAV_LOITER_TIME") == 2

    def test_the_mission_knows_its_autopilot_and_home(self) -> None:
        """Both go into files and onto the link."""
        mission = built(PX4).mission
        assert (mission.autopilot, mission.home, mission.mav_type) == ("px4", HOME, 2)
        assert (mission.cruise_speed_m_s, mission.hover_speed_m_s) == (7.0, 7.0)

    @given(st.integers(1, 655_350))
    def test_px4_holds_are_tenths_without_dust(self, tenths: int) -> None:
        """0.1 added up three times is stored as 0.3."""
        hold_s = sum([0.1] * 3) if tenths == 3 else tenths * 0.1
        result = built(PX4, holds_s=(hold_s, 1.0))
        stored = result.mission.items[result.stop_items[0].hold].params[0]
        assert stored == tenths / 10


class TestWarnings:
    def test_an_ordinary_mission_has_none(self) -> None:
        """30 m, 7 m/s, return."""
        for rules in AUTOPILOTS.values():
            assert not codes(built(rules))

    @pytest.mark.parametrize(("altitude_m", "expected"), [(120.0, []), (120.1, ["height-limit"])])
    def test_height(self, altitude_m: float, expected: list[str]) -> None:
        """Over 120 m above home."""
        assert codes(built(altitude_m=altitude_m)) == expected

    @pytest.mark.parametrize(("speed_m_s", "expected"), [(10.0, []), (10.5, ["speed-limit"])])
    def test_speed(self, speed_m_s: float, expected: list[str]) -> None:
        """Over what default parameters fly; the item still asks for it."""
        for rules in AUTOPILOTS.values():
            result = built(rules, speed_m_s=speed_m_s)
            assert codes(result) == expected
            assert any(item.params[1] == speed_m_s for item in result.mission.items)

    @pytest.mark.parametrize("end", ["land", "stay"])
    def test_ends_away_from_home(self, end: End) -> None:
        """Both leave the vehicle where nobody may be."""
        assert codes(built(end=end)) == [f"end-{end}"]

    @pytest.mark.parametrize(
        ("lat_e7", "expected"), [(374_000_018 + 899_000, []), (374_000_018 + 902_000, ["first-stop-far"])]
    )
    def test_first_stop_over_10_km_away_on_px4(self, lat_e7: int, expected: list[str]) -> None:
        """10 km are 0.0901 degrees north here; a far second stop is no matter, and ArduPilot does not mind."""
        far = ((lat_e7, HOME.lon_e7), (HOME.lat_e7 + 2_000_000, HOME.lon_e7))
        assert codes(built(PX4, stops_e7=far)) == expected
        assert not codes(built(ARDUPILOT, stops_e7=far))


@pytest.mark.parametrize(
    ("rules", "changes", "said"),
    [
        (
            ARDUPILOT,
            {"holds_s": (0.0, 9.0)},
            "stop 1: a hold of 0 s is out of range: ArduPilot stores 1 to 65535 s",
        ),
        (ARDUPILOT, {"holds_s": (8.0, 65_536.0)}, "stop 2: a hold of 65536 s"),
        (ARDUPILOT, {"holds_s": (7.6, 9.0)}, "stop 1: a hold of 7.6 s would be cut off"),
        (ARDUPILOT, {"holds_s": (math.nan, 9.0)}, "stop 1: a hold of nan s"),
        (PX4, {"holds_s": (0.05, 9.0)}, "PX4 stores 0.1 to 65535 s"),
        (PX4, {"holds_s": (8.25, 9.0)}, "PX4 stores steps of 0.1 s"),
        (PX4, {"holds_s": (8.0,)}, "2 stops and 1 holds"),
        (PX4, {"stops_e7": (), "holds_s": ()}, "there are no stops"),
        (PX4, {"stops_e7": (STOPS[0], (900_000_001, 0))}, "point 2: 90.0000001, 0.0 is no place"),
        (PX4, {"home": HomePosition(0, 1_800_000_001, 0.0)}, "home: .* is no place"),
        (PX4, {"home": HomePosition(0, 0, math.nan)}, "home: altitude nan"),
        (PX4, {"altitude_m": 0.0}, "altitude_m: 0 m is out of range"),
        (PX4, {"altitude_m": math.nan}, "altitude_m: nan m"),
        (PX4, {"speed_m_s": 0.0}, "speed_m_s: 0 m/s"),
        (PX4, {"speed_m_s": math.inf}, "speed_m_s: inf m/s"),
        (PX4, {"end": "crash"}, 'end: "crash" is not one of rtl, land, stay'),
        (PX4, {"hover": "circle"}, 'hover: "circle" is not one of'),
    ],
)
def test_what_cannot_be_flown_is_refused(rules: AutopilotRules, changes: dict[str, Any], said: str) -> None:
    """Each names what, the value and what is allowed."""
    with pytest.raises(InputError, match=said):
        built(rules, **changes)


def test_all_problems_are_told_at_once() -> None:
    """Two bad holds and a bad speed are three problems."""
    with pytest.raises(InputError) as caught:
        built(holds_s=(0.5, 1e9), speed_m_s=-1.0)
    assert [problem.code for problem in caught.value.problems] == ["hold", "hold", "speed"]


@pytest.mark.parametrize(("rules", "most"), [(ARDUPILOT, 650), (PX4, 10_000)])
def test_more_items_than_the_autopilot_took_in_simulation_are_warned_of(
    rules: AutopilotRules, most: int
) -> None:
    """Items beside the stops: speed, take-off, return, and home where it is an item."""
    fit = most - 3 - int(rules.home_on_wire)

    def of(stops: int) -> BuiltMission:
        return built(rules, stops_e7=STOPS[:1] * stops, holds_s=(8.0,) * stops, hover="hold")

    assert "many-items" not in codes(of(fit))
    assert "many-items" in codes(of(fit + 1))
