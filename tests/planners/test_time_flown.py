"""Plans of the least mission time, flown by the mock at both firmwares' manners: in the time that they promise."""

import dataclasses

import numpy as np
import pytest

from mavplan.plan import make_plan
from tests.flown import fly
from tests.support import make_scenario

MASS_KG = 2.5


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("in_flight", [False, True])
@pytest.mark.parametrize(("end", "demand_mbit"), [("rtl", 20.0), ("land", 2.0), ("stay", 60.0)])
def test_a_mission_of_least_time_is_flown_in_the_time_that_is_promised(
    autopilot, in_flight, end, demand_mbit
):
    xy_m = np.random.default_rng(int(demand_mbit)).uniform(-900, 900, (9, 2))
    scenario = make_scenario(
        xy_m, planner="time", clusters=3, demand_mbit=demand_mbit, end=end, autopilot=autopilot
    )
    plan = make_plan(
        dataclasses.replace(
            scenario,
            service=dataclasses.replace(scenario.service, in_flight=in_flight),
            planner=dataclasses.replace(scenario.planner, time_limit_s=0.5),
        )
    )
    flown = fly(plan.built.mission, plan.rules, MASS_KG)
    assert plan.forecast.mission_s == pytest.approx(flown.seconds, rel=0.05)
    # What is proved holds for the flight too, and the plan is that time but for holds rounded up.
    assert plan.trajectory.bound.bound <= flown.seconds
    rounded_s = plan.holds.hover_s - plan.holds.asked_s.sum()
    assert plan.trajectory.bound.plan + rounded_s == pytest.approx(flown.seconds, rel=0.05)
