"""What is known before planning: `Scenario`, its sections, and `load_scenario`, which reads them from files."""

from mavplan.scenario.model import UNPAIRED, Scenario, Users
from mavplan.scenario.sections import D2D, Columns, Home, PlannerOptions, Radio, Service, Vehicle

__all__ = [
    "D2D",
    "UNPAIRED",
    "Columns",
    "Home",
    "PlannerOptions",
    "Radio",
    "Scenario",
    "Service",
    "Users",
    "Vehicle",
]
