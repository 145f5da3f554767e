"""The forecast against measured flights, the law that planner.md writes down, and energy added up second by second.

Measured figures: ArduCopter 4.7.0-dev of July 2025 and PX4 main of 2025-08-18 in simulation, stop to stop.
"""

import math
import struct
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mavplan.energy import rotor_of
from mavplan.geo import LocalPlane
from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4, AutopilotRules
from mavplan.mission.build import build_mission
from mavplan.mission.flight_law import LAWS
from mavplan.mission.forecast import Forecast, forecast, forecast_mission, leg_energy_wh, leg_time_s
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.motion import s_curve_time_s
from mavplan.mission.phases import Phases

CAPTURES = Path(__file__).resolve().parents[2] / "../shared/captures"
BOTH = list(AUTOPILOTS.values())


def forecast_of(rules: AutopilotRules, **changes: Any) -> Forecast:
    """One stop 150 m north at 30 m, 10 m/s, held 8 s."""
    arguments: dict[str, Any] = {
        "stops_m": [(0.0, 150.0)],
        "holds_s": [8.0],
        "rules": rules,
        "altitude_m": 30.0,
        "speed_m_s": 10.0,
    }
    return forecast(**(arguments | changes))


class TestMeasuredFigures:
    @pytest.mark.parametrize(
        ("distance_m", "speed_m_s", "measured_s"),
        [
            (20, 10, 9.5),
            (50, 10, 12.8),
            (100, 10, 17.3),
            (150, 10, 22.4),
            (300, 10, 37.5),
            (50, 5, 15.2),
            (150, 5, 35.2),
            (150, 3, 54.3),
        ],
    )
    def test_ardupilot_legs_within_2_percent(
        self, distance_m: float, speed_m_s: float, measured_s: float
    ) -> None:
        """Short legs that never reach their speed, and long ones."""
        expected = float(leg_time_s(distance_m, rules=ARDUPILOT, speed_m_s=speed_m_s))
        assert expected == pytest.approx(measured_s, rel=0.02)

    def test_ardupilot_take_off_and_return_within_2_percent(self) -> None:
        """Take-off to 30 m takes 18.3 s; RTL from 150 m away at 30 m takes 65 s until it disarms."""
        found = forecast_of(ARDUPILOT)
        assert found.takeoff_s == pytest.approx(18.3, rel=0.02)
        assert found.end_s == pytest.approx(65.0, rel=0.02)

    def test_px4_take_off_to_30_m_takes_20_to_22_s(self) -> None:
        """As measured over several flights."""
        assert 20 <= forecast_of(PX4).takeoff_s <= 22

    def test_px4_reference_flight_within_5_percent(self) -> None:
        """Start 13.3, take-off done 35.2, first stop 60.2, then 8 s holds until 103.6, 144.1, 176.2, landed 244.5 s."""
        found = forecast(
            [(0, 100), (150, 100), (230, -20)],
            [None, 8, 8],
            rules=PX4,
            altitude_m=30,
            speed_m_s=5,
        )
        assert found.takeoff_s == pytest.approx(35.2 - 13.3, rel=0.05)
        measured = (60.2 - 35.2, 103.6 - 60.2 - 8, 144.1 - 103.6 - 8)
        assert found.legs_s == pytest.approx(measured, rel=0.05)
        fast = leg_time_s(math.hypot(120, 100), rules=PX4, speed_m_s=8)
        assert float(fast) == pytest.approx(176.2 - 144.1 - 8, rel=0.05)
        back = forecast_of(PX4, stops_m=[(110, -120)])
        assert back.end_s == pytest.approx(244.5 - 176.2, rel=0.05)

    @pytest.mark.parametrize("rules", BOTH)
    def test_a_speed_beyond_the_default_limit_changes_nothing(self, rules: AutopilotRules) -> None:
        """About 10 m/s is what both fly then; with a given acceleration too."""
        for acceleration in (None, 0.0, 2.0):
            asked = forecast_of(rules, speed_m_s=15.0, acceleration_m_s2=acceleration)
            assert asked == forecast_of(rules, speed_m_s=10.0, acceleration_m_s2=acceleration)


def ground_clock(name: str) -> Iterator[tuple[float, Any]]:
    """Messages of a recording with the ground station's clock in seconds."""
    for at_s, _, message in frames(name):
        yield at_s, message


def recorded(name: str) -> Iterator[tuple[float, Any]]:
    """Messages of a recording with the vehicle's own clock in seconds."""
    for _, clock_s, message in frames(name):
        yield clock_s, message


def frames(name: str) -> Iterator[tuple[float, float, Any]]:
    """Messages of a recording with both clocks in seconds: the ground station's and the vehicle's last."""
    path = CAPTURES / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not on this machine")
    from pymavlink.dialects.v20 import common

    parser = common.MAVLink(None)
    parser.robust_parsing = True
    data, start, clock_s = path.read_bytes(), 0, math.nan
    while start < len(data):
        size = 20 + data[start + 9] + (13 if data[start + 10] & 1 else 0)
        message = parser.decode(bytearray(data[start + 8 : start + size]))
        at_s = struct.unpack(">Q", data[start : start + 8])[0] / 1e6
        start += size
        if message.get_type() == "GLOBAL_POSITION_INT":
            clock_s = message.time_boot_ms / 1000
        yield at_s, clock_s, message


def first_reached(name: str) -> tuple[Mission, dict[int, float], dict[str, float]]:
    """The mission that was uploaded, when each of its items was first reported reached, when each text came."""
    items: dict[int, Any] = {}
    reached: dict[int, float] = {}
    texts: dict[str, float] = {}
    for clock_s, message in recorded(name):
        match message.get_type():
            case "MISSION_ITEM_INT":
                items[message.seq] = message
            case "MISSION_ITEM_REACHED":
                reached.setdefault(message.seq, clock_s)
            case "STATUSTEXT":
                texts.setdefault(message.text.strip(), clock_s)
    sent = [items[seq] for seq in sorted(items)]
    home = HomePosition(sent[0].x, sent[0].y, 0.0)
    flown = sent[1:] if name.startswith("ardupilot") else sent
    mission = Mission(tuple(as_item(message) for message in flown), home)
    return mission, reached, texts


def as_item(message: Any) -> MissionItem:
    """A recorded MISSION_ITEM_INT; frame 6 is 3 with another name."""
    params = (message.param1, message.param2, message.param3, message.param4)
    frame = Frame.GLOBAL_RELATIVE_ALT if message.frame == 6 else message.frame
    return MissionItem(message.command, frame, params, message.x, message.y, message.z)


class TestRecordings:
    """Item by item on the vehicle's own clock: each is done when it is first reported reached."""

    def test_ardupilot_flight_item_by_item(self) -> None:
        """Take-off, legs (the last at 5 m/s) and their holds, and the return: each within 3 %, all within 1 %."""
        mission, reached, texts = first_reached("ardupilot_flight_loiter.tlog")
        start = texts["Mission: 1 Takeoff"]
        found = forecast_mission(mission, rules=ARDUPILOT)
        # Seq counts home. The hold at item 4 is told by the number of the speed item behind it.
        told = {0: reached[1], 1: reached[2], 2: reached[3], 3: reached[5], 5: reached[6], 6: reached[7]}
        flown = dict(
            zip(told, (after - before for before, after in pairwise([start, *told.values()])), strict=True)
        )
        for item, seconds in flown.items():
            assert found.items[item].seconds.total == pytest.approx(seconds, rel=0.03), item
        assert found.items[4].seconds == Phases()
        assert found.mission_s == pytest.approx(reached[7] - start, rel=0.01)
        assert found.seconds.hover == pytest.approx(3 * 8 + 5.9)

    def test_ardupilot_from_arming_to_disarming_within_5_percent(self) -> None:
        """187.6 s on the ground station's clock, arming 0.1 s before the start."""
        mission, _, _ = first_reached("ardupilot_flight_loiter.tlog")
        clock = {}
        for at_s, message in ground_clock("ardupilot_flight_loiter.tlog"):
            if message.get_type() == "STATUSTEXT" and "motors" in message.text:
                clock[message.text.strip()] = at_s
        flown_s = clock["Disarming motors"] - clock["Arming motors"]
        assert flown_s == pytest.approx(187.6, abs=0.2)
        assert forecast_mission(mission, rules=ARDUPILOT).mission_s == pytest.approx(flown_s, rel=0.05)

    @pytest.mark.parametrize("name", ["px4_flight.tlog", "px4_flight_full.tlog"])
    def test_px4_flight_item_by_item(self, name: str) -> None:
        """Take-off, a waypoint flown through, three legs (the last at 8 m/s), return: within 5 %, all within 2 %."""
        mission, reached, texts = first_reached(name)
        start = texts["Executing Mission"]
        found = forecast_mission(mission, rules=PX4)
        # The last hold is told by the number of the return.
        told = {0: reached[0], 1: reached[1], 2: reached[2], 3: reached[4], 5: reached[6]}
        times = [start, *told.values(), texts["Disarmed by landing"]]
        flown = dict(zip((*told, 6), (after - before for before, after in pairwise(times)), strict=True))
        for item, seconds in flown.items():
            assert found.items[item].seconds.total == pytest.approx(seconds, rel=0.05), item
        assert found.items[4].seconds == Phases()
        assert found.mission_s == pytest.approx(times[-1] - start, rel=0.02)
        assert found.seconds.hover == pytest.approx(3 * 8)


def mission_of(rules: AutopilotRules, **changes: Any) -> Mission:
    """Two stops and a point between them that is only turned at, as the planner builds them."""
    plane = LocalPlane(46.5, 7.5)
    points_m = changes.pop("points_m", [(0.0, 150.0), (120.0, 150.0), (120.0, -40.0)])
    lat_e7, lon_e7 = plane.to_e7(points_m)
    arguments: dict[str, Any] = {
        "home": HomePosition(465000000, 75000000, 600.0),
        "stops_e7": list(zip(lat_e7.tolist(), lon_e7.tolist(), strict=True)),
        "holds_s": [8.0, None, 12.0],
        "rules": rules,
        "altitude_m": 40.0,
        "speed_m_s": 8.0,
    }
    return build_mission(**(arguments | changes)).mission


class TestItems:
    @pytest.mark.parametrize("rules", BOTH)
    @pytest.mark.parametrize("end", ["rtl", "land", "stay"])
    @pytest.mark.parametrize("hover", ["waypoint+loiter", "loiter", "hold"])
    def test_every_item_of_every_kind_of_mission(self, rules: AutopilotRules, end: Any, hover: Any) -> None:
        """One a mission item, times and energies adding up, the same whatever the stops are made of."""
        mission = mission_of(rules, end=end, hover=hover)
        found = forecast_mission(mission, rules=rules, rotor=rotor_of(3.0))
        assert [item.command for item in found.items] == [item.command for item in mission.items]
        assert [item.item for item in found.items] == list(range(len(mission.items)))
        clock = used = 0.0
        for item in found.items:
            assert item.energy_wh is not None
            clock, used = clock + item.seconds.total, used + item.energy_wh.total
            assert (item.done_s, item.used_wh) == (pytest.approx(clock), pytest.approx(used))
        assert found.mission_s == pytest.approx(clock)
        assert found.energy_wh is not None
        assert found.energy_wh.total == pytest.approx(used)
        assert found.seconds.total == pytest.approx(clock)
        assert found.hover_s == pytest.approx(20.0)
        from_stops = forecast(
            [(0.0, 150.0), (120.0, 150.0), (120.0, -40.0)],
            [8.0, None, 12.0],
            rules=rules,
            altitude_m=40.0,
            speed_m_s=8.0,
            end=end,
            rotor=rotor_of(3.0),
        )
        assert found.mission_s == pytest.approx(from_stops.mission_s, abs=0.01)
        assert found.used_wh == pytest.approx(from_stops.used_wh, rel=1e-4)

    @pytest.mark.parametrize("rules", BOTH)
    def test_each_phase_is_where_it_belongs(self, rules: AutopilotRules) -> None:
        """Take-off climbs, legs cruise, loiters hover, a return cruises and descends; a speed item takes nothing."""
        mission = mission_of(rules)
        found = forecast_mission(mission, rules=rules, rotor=rotor_of(3.0))
        for item in found.items:
            phases = item.seconds
            match item.command:
                case Command.DO_CHANGE_SPEED:
                    assert phases == Phases()
                case Command.NAV_TAKEOFF:
                    assert phases == Phases(climb=found.takeoff_s)
                case Command.NAV_WAYPOINT:
                    assert phases == Phases(cruise=phases.cruise)
                    assert phases.cruise > 0
                case Command.NAV_LOITER_TIME:
                    assert phases == Phases(hover=mission.items[item.item].params[0])
                case Command.NAV_RETURN_TO_LAUNCH:
                    assert phases.hover == LAWS[rules.name].return_wait_s
                    assert min(phases.cruise, phases.descent) > 0
        assert found.hold_begins_s(len(mission.items) - 2) == pytest.approx(found.items[-3].done_s)

    @pytest.mark.parametrize("rules", BOTH)
    def test_a_speed_item_acts_from_the_next_leg_on(self, rules: AutopilotRules) -> None:
        """Not on the way back; without any the autopilot flies its own cruise speed."""
        mission = mission_of(rules, points_m=[(0, 200), (200, 200)], holds_s=[5.0, 5.0], hover="loiter")
        slow = MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (1.0, 3.0, -1.0, 0.0))
        at = next(i for i, item in enumerate(mission.items) if item.command == Command.NAV_LOITER_TIME) + 1
        items = (*mission.items[:at], slow, *mission.items[at:])
        found = forecast_mission(Mission(items, mission.home), rules=rules)
        legs = [float(leg_time_s(200.0, rules=rules, speed_m_s=speed)) for speed in (8.0, 3.0)]
        assert found.legs_s == pytest.approx(legs, abs=0.01)
        assert found.items[-1].seconds == forecast_mission(mission, rules=rules).items[-1].seconds
        bare = tuple(item for item in mission.items if item.command != Command.DO_CHANGE_SPEED)
        own = float(leg_time_s(200.0, rules=rules, speed_m_s={"ardupilot": 10.0, "px4": 5.0}[rules.name]))
        assert forecast_mission(Mission(bare, mission.home), rules=rules).legs_s == pytest.approx(
            (own, own), abs=0.01
        )

    @pytest.mark.parametrize("rules", BOTH)
    def test_a_change_of_height_on_the_way_is_a_climb(self, rules: AutopilotRules) -> None:
        """A long leg takes no longer for it, a steep one as long as the climb."""
        home = HomePosition(465000000, 75000000, 600.0)
        (long_lat, steep_lat), (long_lon, steep_lon) = LocalPlane(46.5, 7.5).to_e7([(0, 500), (0, 505)])
        up = MissionItem(Command.NAV_TAKEOFF, Frame.GLOBAL_RELATIVE_ALT, alt_m=20.0)
        far = MissionItem(
            Command.NAV_LOITER_TIME, Frame.GLOBAL_RELATIVE_ALT, (1, 0, 0, 0), long_lat, long_lon, 30.0
        )
        steep = MissionItem(Command.NAV_LOITER_TIME, Frame.GLOBAL, (1, 0, 0, 0), steep_lat, steep_lon, 690.0)
        down = MissionItem(Command.NAV_LOITER_TIME, Frame.GLOBAL, (1, 0, 0, 0), long_lat, long_lon, 630.0)
        found = forecast_mission(Mission((up, far, steep, down), home), rules=rules, rotor=rotor_of(2.0))
        speed_m_s = LAWS[rules.name].return_m_s
        level = float(leg_time_s(500.0, rules=rules, speed_m_s=speed_m_s))
        assert found.items[1].seconds.total - 1 == pytest.approx(level, abs=0.01)
        assert found.items[1].seconds.climb > 10 / 3
        assert found.items[2].seconds.climb >= 60 / 3
        assert found.items[2].seconds.cruise == 0
        assert found.items[3].seconds.descent == pytest.approx(60 / 1.5)

    def test_a_jump_has_no_forecast(self) -> None:
        """How often it is taken is not known here."""
        jump = MissionItem(Command.DO_JUMP, Frame.MISSION, (0.0, 2.0, 0.0, 0.0))
        with pytest.raises(ValueError, match="jumps"):
            forecast_mission(Mission((jump,), HomePosition(0, 0, 0.0)), rules=PX4)

    def test_an_empty_mission_takes_nothing(self) -> None:
        """And no crash."""
        found = forecast_mission(Mission((), HomePosition(0, 0, 0.0)), rules=PX4, rotor=rotor_of(1.0))
        assert (found.mission_s, found.items, found.legs_s) == (0.0, (), ())


def flown_energy_wh(distance_m: float, speed_m_s: float, a: float, j: float, mass_kg: float) -> float:
    """Energy of a leg from rest to rest, by integrating jerk in milliseconds, its second half the first backwards."""
    rotor, step = rotor_of(mass_kg), 1e-3
    half_m, way, speed, pull, speeds = distance_m / 2, 0.0, 0.0, 0.0, []
    # Let the acceleration fall as soon as what it still adds on its way to 0 reaches the speed or the middle.
    while way < half_m:
        still = pull / j
        to_go = half_m - way - speed * still - pull * still**2 / 3
        if speed + pull * still / 2 >= speed_m_s or to_go <= 0:
            pull = max(pull - j * step, 0.0)
        elif pull < a:
            pull = min(pull + j * step, a)
        speed = min(speed + pull * step, speed_m_s)
        way += speed * step
        speeds.append(speed)
    return float(2 * rotor.power_w(np.array(speeds)).sum() * step / 3600)


class TestEnergy:
    @pytest.mark.parametrize("rules", BOTH)
    @pytest.mark.parametrize("speed_m_s", [4.0, 10.0])
    @pytest.mark.parametrize("distance_m", [30.0, 120.0, 600.0])
    def test_a_leg_costs_what_its_speeds_cost_one_after_the_other(
        self, rules: AutopilotRules, speed_m_s: float, distance_m: float
    ) -> None:
        """And all that it takes longer than its S-curve at hover."""
        law = LAWS[rules.name]
        found = float(leg_energy_wh(distance_m, rules=rules, speed_m_s=speed_m_s, rotor=rotor_of(2.0)))
        moving = flown_energy_wh(distance_m, speed_m_s, law.acceleration_m_s2, law.jerk_m_s3, 2.0)
        curve_s = float(s_curve_time_s(distance_m, speed_m_s, law.acceleration_m_s2, law.jerk_m_s3))
        late_s = float(leg_time_s(distance_m, rules=rules, speed_m_s=speed_m_s)) - curve_s
        assert found == pytest.approx(moving + late_s * rotor_of(2.0).hover_w / 3600, rel=5e-3)

    @pytest.mark.parametrize("rules", BOTH)
    def test_it_lies_between_the_dearest_and_the_cheapest_power(self, rules: AutopilotRules) -> None:
        """A climb takes most, flight at 10 m/s least, the ground nothing; a kilogram more takes a kilogram more."""
        mission, rotor, law = mission_of(rules), rotor_of(2.0), LAWS[rules.name]
        found = forecast_mission(mission, rules=rules, rotor=rotor)
        assert found.energy_wh is not None
        seconds, energy = found.seconds, found.energy_wh
        assert energy.hover == pytest.approx(seconds.hover * rotor.hover_w / 3600)
        assert energy.descent == pytest.approx(
            (seconds.descent - law.landing_ground_s) * rotor.hover_w / 3600
        )
        climbing_w = energy.climb * 3600 / (seconds.climb - law.takeoff_ground_s)
        assert rotor.hover_w < climbing_w < float(rotor.climb_power_w(law.climb_m_s))
        assert float(rotor.power_w(10.0)) < energy.cruise * 3600 / seconds.cruise < rotor.hover_w
        heavier = forecast_mission(mission, rules=rules, rotor=rotor_of(3.0))
        assert heavier.used_wh == pytest.approx(1.5 * (found.used_wh or 0.0))

    @pytest.mark.parametrize("rules", BOTH)
    def test_flying_through_costs_less_than_stopping(self, rules: AutopilotRules) -> None:
        """Straight on it costs what one long leg costs."""
        points, rotor = [(0.0, 100.0), (0.0, 200.0)], rotor_of(2.0)
        straight, stopped = (
            forecast(points, [hold, 1.0], rules=rules, altitude_m=30, speed_m_s=8, rotor=rotor)
            for hold in (None, 0.0)
        )
        assert straight.energy_wh is not None
        assert stopped.energy_wh is not None
        one = forecast([(0.0, 200.0)], [1.0], rules=rules, altitude_m=30, speed_m_s=8, rotor=rotor)
        assert straight.used_wh == pytest.approx(one.used_wh, rel=1e-9 if rules is ARDUPILOT else 0.01)
        assert straight.energy_wh.cruise < stopped.energy_wh.cruise

    @pytest.mark.parametrize("rules", BOTH)
    def test_without_a_rotor_nothing_is_known(self, rules: AutopilotRules) -> None:
        """None, never 0 or NaN."""
        found = forecast_mission(mission_of(rules), rules=rules)
        assert found.used_wh is None
        assert found.energy_wh is None
        assert all(item.energy_wh is None and item.used_wh is None for item in found.items)


class TestGivenAcceleration:
    @pytest.mark.parametrize("rules", BOTH)
    def test_the_law_of_the_paper(self, rules: AutopilotRules) -> None:
        """d/v + v/a if d ≥ v²/a, else 2·√(d/a): 8 m/s and 2 m/s² turn over at 32 m."""
        legs = leg_time_s([0, 2, 8, 32, 80], rules=rules, speed_m_s=8.0, acceleration_m_s2=2.0)
        assert legs.tolist() == pytest.approx([0, 2, 4, 8, 14])

    @pytest.mark.parametrize("rules", BOTH)
    def test_no_acceleration_is_at_once(self, rules: AutopilotRules) -> None:
        """a = 0: d/v."""
        legs = leg_time_s([0, 10, 80], rules=rules, speed_m_s=8.0, acceleration_m_s2=0.0)
        assert legs.tolist() == pytest.approx([0, 1.25, 10])


class TestWholeMissions:
    @pytest.mark.parametrize("rules", BOTH)
    def test_parts_add_up(self, rules: AutopilotRules) -> None:
        """Flight is take-off, legs and end; the mission adds the holds; the first leg starts at home."""
        found = forecast_of(rules, stops_m=[(0, 40), (30, 0)], holds_s=np.array([3.0, 5.5]), home_xy=(0, 10))
        assert found.hover_s == 8.5
        assert found.flight_s == pytest.approx(found.takeoff_s + sum(found.legs_s) + found.end_s)
        assert found.mission_s == pytest.approx(found.flight_s + 8.5)
        expected = leg_time_s([30, 50], rules=rules, speed_m_s=10.0)
        assert found.legs_s == pytest.approx(tuple(expected))

    @pytest.mark.parametrize("rules", BOTH)
    def test_stops_at_the_same_place_cost_no_flight(self, rules: AutopilotRules) -> None:
        """WAYPOINT and LOITER_TIME at one place cost nothing over the loiter alone."""
        assert forecast_of(rules, stops_m=[(0, 0), (0, 0)], holds_s=[1, 1]).legs_s == (0.0, 0.0)

    @pytest.mark.parametrize("rules", BOTH)
    def test_staying_ends_at_once_and_landing_is_a_return_without_the_way(
        self, rules: AutopilotRules
    ) -> None:
        """At the same height the way down is the same; only the way home and its pauses are missing."""
        assert forecast_of(rules, end="stay").end_s == 0
        land, back = forecast_of(rules, end="land"), forecast_of(rules)
        assert 0 < land.end_s < back.end_s

    def test_a_low_mission_climbs_before_it_returns(self) -> None:
        """ArduPilot returns at 15 m, so the way down from 5 m is that from 15 m."""
        low, high = forecast_of(ARDUPILOT, altitude_m=5.0), forecast_of(ARDUPILOT, altitude_m=15.0)
        assert low.end_s > high.end_s

    @pytest.mark.parametrize("rules", BOTH)
    def test_no_stops_is_a_take_off_and_a_landing(self, rules: AutopilotRules) -> None:
        """Nothing between, and no crash."""
        found = forecast_of(rules, stops_m=np.empty((0, 2)), holds_s=[])
        assert found.legs_s == ()
        assert found.mission_s == pytest.approx(found.takeoff_s + found.end_s)

    def test_stops_and_holds_must_fit(self) -> None:
        """A fault of the caller."""
        with pytest.raises(ValueError, match="1 stops and 2 holds"):
            forecast_of(PX4, holds_s=[1, 2])


class TestShapes:
    def test_shapes_are_kept(self) -> None:
        """A matrix of distances gives a matrix of times, as planners want it."""
        distances = np.arange(6.0).reshape(2, 3)
        for acceleration in (None, 0.0, 2.0):
            times = leg_time_s(distances, rules=PX4, speed_m_s=5.0, acceleration_m_s2=acceleration)
            assert times.shape == (2, 3)
