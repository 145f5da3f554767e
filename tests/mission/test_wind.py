"""Wind: what was measured, the triangle of velocities, and a flight of the mock in it."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.energy import rotor_of
from mavplan.expected import expected_flight
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.flight_law import LAWS
from mavplan.mission.forecast import forecast_mission
from mavplan.mission.wind import STEP_M_S, Wind
from mavplan.plan import make_plan
from mavplan.scenario import Wind as WindSection
from tests.flown import fly
from tests.link.harness import make_mission
from tests.support import make_scenario

LIMIT_M_S = LAWS["ardupilot"].airspeed_limit_m_s


def ground(wind, step, asked=10.0):
    return float(wind.ground_m_s(np.array([step], dtype=float), np.array([asked]), LIMIT_M_S)[0])


def test_against_6_m_s_the_measured_speed_is_left():
    assert ground(Wind(6.0, 0.0), (0, 100)) == pytest.approx(5.8, abs=STEP_M_S)
    assert ground(Wind(6.0), (100, 0)) == pytest.approx(5.8, abs=STEP_M_S)


def test_a_tail_wind_makes_nobody_faster_than_asked():
    assert ground(Wind(6.0, 180.0), (0, 100)) == 10.0


@given(st.floats(0, 10), st.floats(0, 360), st.floats(0, 2 * math.pi), st.floats(1, 15))
def test_the_triangle_of_velocities_closes(speed, from_deg, bearing, asked):
    """Over ground plus against the wind is through the air, and that is never more than the limit."""
    step = np.array([[math.sin(bearing), math.cos(bearing)]])
    wind = Wind(speed, from_deg)
    over_m_s = float(wind.ground_m_s(step, np.array([asked]), LIMIT_M_S)[0])
    upwind = speed * np.array([math.sin(math.radians(from_deg)), math.cos(math.radians(from_deg))])
    through_m_s = np.linalg.norm(step[0] * over_m_s + upwind)
    head, cross = wind.parts_m_s(step)
    assert math.hypot(over_m_s + head[0], cross[0]) == pytest.approx(through_m_s)
    assert through_m_s <= max(LIMIT_M_S, speed) + 1e-9
    assert over_m_s <= asked
    assert over_m_s >= min(asked, ground(Wind(speed), step[0], asked)) - 1e-9, "from anywhere is the worst"


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_more_wind_is_never_sooner_nor_cheaper(firmware):
    rules, mission, rotor = AUTOPILOTS[firmware], make_mission(firmware, 3), rotor_of(2.0)
    found = [
        forecast_mission(mission, rules=rules, rotor=rotor, wind=Wind(speed))
        for speed in (0.0, 3.0, 6.0, 9.0)
    ]
    still = forecast_mission(mission, rules=rules, rotor=rotor)
    assert found[0].mission_s == pytest.approx(still.mission_s)
    assert found[0].used_wh == pytest.approx(still.used_wh)
    for one, other in itertools.pairwise(found):
        assert other.mission_s >= one.mission_s
    assert found[-1].used_wh > still.used_wh


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@pytest.mark.parametrize("from_deg", [0.0, 135.0])
def test_the_mock_flies_in_a_wind_as_forecast(firmware, from_deg):
    scenario = make_scenario([[700, 100], [100, 900], [-500, 200]], autopilot=firmware, mass_kg=2.0)
    scenario = dataclasses.replace(scenario, wind=WindSection(6.0, from_deg))
    plan = make_plan(scenario)
    flown = fly(plan.built.mission, plan.rules, 2.0, wind=(6.0, from_deg))
    assert plan.forecast.mission_s == pytest.approx(flown.seconds, rel=0.05)
    # A wind carries a hovering rotor; the forecast does not count on it.
    assert flown.used_wh <= plan.forecast.used_wh <= 1.12 * flown.used_wh
    anywhere = expected_flight(
        plan.built.mission, dataclasses.replace(scenario, wind=WindSection(6.0)), plan.rules
    )
    assert anywhere.mission_s >= plan.forecast.mission_s
