"""Missions as the planner makes them, for both autopilots."""

from collections.abc import Callable

import pytest

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.build import build_mission
from mavplan.mission.model import Autopilot, HomePosition, Mission

HOME = HomePosition(423_736_000, -711_097_123, 12.5)
STOPS_E7 = ((423_750_001, -711_080_009), (423_760_003, -711_100_007), (423_720_000, -711_120_001))


@pytest.fixture
def make_mission() -> Callable[[Autopilot], Mission]:
    """Three stops near Cambridge, held 8, 12 and 30 s at 100 m, 8 m/s."""

    def make(autopilot: Autopilot) -> Mission:
        return build_mission(
            home=HOME,
            stops_e7=STOPS_E7,
            holds_s=(8.0, 12.0, 30.0) if autopilot == "ardupilot" else (8.25 - 0.05, 12.5, 30.0),
            rules=AUTOPILOTS[autopilot],
            altitude_m=100.0,
            speed_m_s=8.0,
            end="rtl",
        ).mission

    return make
