"""The forecast of a mission for the vehicle and the wind of its scenario."""

from mavplan.energy import rotor_of
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.forecast import Forecast, forecast_mission
from mavplan.mission.model import Mission
from mavplan.mission.wind import Wind
from mavplan.scenario.model import Scenario


def expected_flight(mission: Mission, scenario: Scenario, rules: AutopilotRules) -> Forecast:
    """Return what a mission of a scenario will take; energies where the vehicle's mass is known."""
    vehicle = scenario.vehicle
    return forecast_mission(
        mission,
        rules=rules,
        acceleration_m_s2=vehicle.acceleration_m_s2,
        rotor=None if vehicle.mass_kg is None else rotor_of(vehicle.mass_kg),
        wind=Wind.of(scenario.wind),
    )
