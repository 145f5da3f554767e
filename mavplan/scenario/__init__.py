"""What is known before planning: `Scenario`, its sections, and `load_scenario`, which reads them from files."""

from typing import TYPE_CHECKING, Any

from mavplan.scenario.model import UNPAIRED, Scenario, Users
from mavplan.scenario.sections import (
    D2D,
    Columns,
    FenceOptions,
    Home,
    PinnedStop,
    PlannerOptions,
    Radio,
    Service,
    TerrainOptions,
    Vehicle,
    Wind,
)

if TYPE_CHECKING:
    from mavplan.scenario.toml import load_scenario

__all__ = [
    "D2D",
    "UNPAIRED",
    "Columns",
    "FenceOptions",
    "Home",
    "PinnedStop",
    "PlannerOptions",
    "Radio",
    "Scenario",
    "Service",
    "TerrainOptions",
    "Users",
    "Vehicle",
    "Wind",
    "load_scenario",
]


def __getattr__(name: str) -> Any:
    """Import `load_scenario` where it is first asked for: a scenario made in Python needs no readers."""
    if name == "load_scenario":
        from mavplan.scenario.toml import load_scenario

        return load_scenario
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
