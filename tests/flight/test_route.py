"""What there is to watch of a mission: stops of every style, its end, its seconds."""

import math

import pytest

from mavplan.flight.preflight import end_check
from mavplan.flight.route import make_route
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.build import build_mission
from mavplan.mission.forecast import forecast_mission
from tests.link.harness import HOME, make_mission

STOPS = [(HOME.lat_e7 + 9_000, HOME.lon_e7), (HOME.lat_e7 + 9_000, HOME.lon_e7 + 9_000)]


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("hover", ["waypoint+loiter", "loiter", "hold"])
@pytest.mark.parametrize("end", ["rtl", "land", "stay"])
def test_the_stops_and_the_end_are_those_that_were_built(firmware, hover, end):
    rules = AUTOPILOTS[firmware]
    built = build_mission(
        home=HOME,
        stops_e7=[STOPS[0], (HOME.lat_e7, HOME.lon_e7 + 4_000), STOPS[1]],
        holds_s=[8.0, None, 9.0],
        rules=rules,
        altitude_m=30.0,
        speed_m_s=8.0,
        end=end,
        hover=hover,
    )
    route = make_route(built.mission, rules, [("Ann",), ("Bob",)])
    first = int(rules.home_on_wire)
    assert [(stop.first_seq - first, stop.hold_seq - first) for stop in route.stops] == [
        (stop.first, stop.hold) for stop in built.stop_items
    ]
    assert [(stop.hold_s, stop.users) for stop in route.stops] == [(8.0, ("Ann",)), (9.0, ("Bob",))]
    assert [(stop.lat_e7, stop.lon_e7) for stop in route.stops] == STOPS
    assert (route.end, route.end_seq, route.last_seq) == (
        end,
        route.last_seq,
        first + len(built.mission.items) - 1,
    )
    place = HOME if end == "rtl" else STOPS[1]
    assert (route.end_place.lat_e7, route.end_place.lon_e7) == (
        (place.lat_e7, place.lon_e7) if end == "rtl" else place
    )


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_its_seconds_are_the_forecasts(firmware):
    mission, rules = make_mission(firmware, 3), AUTOPILOTS[firmware]
    assert make_route(mission, rules).mission_s == pytest.approx(
        forecast_mission(mission, rules=rules).mission_s, abs=1e-9
    )


def test_names_that_do_not_fit_the_stops_are_not_used():
    route = make_route(make_mission("px4", 3), AUTOPILOTS["px4"], [("Ann",)])
    assert [stop.users for stop in route.stops] == [(), (), ()]
    assert not route.jumps
    assert math.isfinite(route.mission_s)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("end", "back", "home"), [("rtl", None, True), ("rtl", STOPS[:1], True), ("land", None, False)]
)
def test_a_landing_at_home_comes_home_and_one_at_the_last_stop_does_not(firmware, end, back, home):
    """Round no-fly zones the way back is waypoints and a landing."""
    built = build_mission(
        home=HOME,
        stops_e7=STOPS,
        holds_s=[8.0, 9.0],
        rules=AUTOPILOTS[firmware],
        altitude_m=30.0,
        speed_m_s=8.0,
        end=end,
        back_e7=back,
    )
    route = make_route(built.mission, AUTOPILOTS[firmware])
    assert route.comes_home == home
    assert end_check(route).verdict == ("good" if home else "ask")
