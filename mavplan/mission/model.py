"""A `Mission`: what every file format and every link speaks. Exact wire units, no firmware's rules.

Positions are integers of 1e-7 degrees, as MISSION_ITEM_INT carries them, so that nothing is lost between a plan,
a file and a vehicle. Home is not an item here: where a file or a vehicle wants it as item 0, its door adds it.
"""

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

from mavplan.errors import Problem
from mavplan.mission.geofence import Fence, RallyPoint

Autopilot = Literal["ardupilot", "px4"]

NAN = math.nan


class Command(IntEnum):
    """The MAV_CMD values a mavplan mission may hold (https://mavlink.io/en/messages/common.html)."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_DELAY = 93
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178


class ListCommand(IntEnum):
    """The MAV_CMD values of the other two lists a vehicle holds: its fence and its rally points."""

    NAV_FENCE_RETURN_POINT = 5000
    NAV_FENCE_POLYGON_VERTEX_INCLUSION = 5001
    NAV_FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    NAV_FENCE_CIRCLE_INCLUSION = 5003
    NAV_FENCE_CIRCLE_EXCLUSION = 5004
    NAV_RALLY_POINT = 5100


class Frame(IntEnum):
    """The MAV_FRAME values of mission items."""

    GLOBAL = 0
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    GLOBAL_TERRAIN_ALT = 10
    GLOBAL_TERRAIN_ALT_INT = 11


POSITION_COMMANDS = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TIME,
        Command.NAV_LAND,
        Command.NAV_TAKEOFF,
    }
)
"""Commands whose x, y and z are a place."""


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One mission item. ``params`` are param1 to param4; NaN means "as the autopilot likes".

    ``alt_m`` is above home in frame GLOBAL_RELATIVE_ALT, above mean sea level in GLOBAL. Items without a position
    have frame MISSION and zeros.
    """

    command: int
    frame: int
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lat_e7: int = 0
    lon_e7: int = 0
    alt_m: float = 0.0
    autocontinue: bool = True

    @property
    def has_position(self) -> bool:
        """Whether x, y and z are a place."""
        return self.command in POSITION_COMMANDS

    @property
    def lat_deg(self) -> float:
        """Latitude in degrees."""
        return self.lat_e7 / 1e7

    @property
    def lon_deg(self) -> float:
        """Longitude in degrees."""
        return self.lon_e7 / 1e7


@dataclass(frozen=True, slots=True)
class HomePosition:
    """Planned home: 1e-7 degrees, metres above mean sea level."""

    lat_e7: int
    lon_e7: int
    alt_amsl_m: float


@dataclass(frozen=True, slots=True)
class Mission:
    """A whole mission without home among its items, with the fence and the rally points that go with it.

    ``autopilot`` is None where the file did not say (a ``.waypoints`` without its plan). DO_JUMP targets count
    from 0 over ``items``. Speeds are what a ground station shows; the vehicle obeys the items. ``fence`` is None where
    there is no area. ``warnings`` is what a reader left out or could not tell; it takes no part in comparisons.
    """

    items: tuple[MissionItem, ...]
    home: HomePosition
    autopilot: Autopilot | None = None
    mav_type: int = 2
    cruise_speed_m_s: float = 10.0
    hover_speed_m_s: float = 10.0
    fence: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    warnings: tuple[Problem, ...] = field(default=(), compare=False)
