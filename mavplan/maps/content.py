"""What a map of a plan shows, whatever the format: home, stops, path, users, fence, rally points. WGS84 degrees."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.mission.model import Command, Frame, Mission, MissionItem

if TYPE_CHECKING:
    from mavplan.stored_plan import StoredPlan


@dataclass(frozen=True, slots=True)
class Place:
    """A place in the air: degrees, metres above mean sea level and above home."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_rel_m: float


@dataclass(frozen=True, slots=True)
class MappedStop:
    """A place where the vehicle holds; stops count from 1, pinned ones have a name."""

    number: int
    place: Place
    hold_s: float
    users: tuple[str, ...]
    name: str = ""

    @property
    def title(self) -> str:
        """``Stop 3``, with its name behind it where it has one."""
        return f"Stop {self.number}" + (f" ({self.name})" if self.name else "")


@dataclass(frozen=True, slots=True)
class MappedUser:
    """A user, the stop that serves it and whether through its mate."""

    name: str
    lat_deg: float
    lon_deg: float
    demand_mbit: float
    stop: int
    d2d: bool
    mate: str
    priority: float | None = None


@dataclass(frozen=True, slots=True)
class PlanMap:
    """All there is to draw.

    Attributes
    ----------
    title
        Name of the whole.
    home
        Where it takes off.
    path
        Places in flying order, from above home.
    stops, users
        Users are empty where there is no plan beside the mission.
    radius_m
        Coverage radius; None without a plan.
    fence, rally
        Of the mission.
    """

    title: str
    home: Place
    path: tuple[Place, ...]
    stops: tuple[MappedStop, ...]
    users: tuple[MappedUser, ...]
    radius_m: float | None
    fence: Fence | None
    rally: tuple[RallyPoint, ...]


def plan_map(mission: Mission, plan: "StoredPlan | None", title: str) -> PlanMap:
    """Return what a map shows of a mission and of the plan that it was made from.

    Parameters
    ----------
    mission
        Its places are those that are flown.
    plan
        Users and stops; without it a stop is wherever the mission holds.
    title
        Name of the whole.
    """
    home = Place(mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7, mission.home.alt_amsl_m, 0.0)
    return PlanMap(
        title=title,
        home=home,
        path=tuple(_path(mission)),
        stops=tuple(_stops(mission) if plan is None else _planned_stops(mission, plan)),
        users=() if plan is None else tuple(_users(plan)),
        radius_m=None if plan is None else _radius_m(plan),
        fence=mission.fence,
        rally=mission.rally,
    )


def _place(item: MissionItem, mission: Mission) -> Place:
    home_m = mission.home.alt_amsl_m
    above_sea = item.frame in {Frame.GLOBAL, Frame.GLOBAL_INT}
    alt_rel_m = item.alt_m - home_m if above_sea else item.alt_m
    return Place(item.lat_deg, item.lon_deg, home_m + alt_rel_m, alt_rel_m)


def _path(mission: Mission) -> Iterator[Place]:
    last = None
    for item in mission.items:
        if item.has_position:
            place = _place(item, mission)
            if place != last:
                yield place
            last = place
        elif item.command == Command.NAV_RETURN_TO_LAUNCH and last is not None:
            home = mission.home
            yield Place(
                home.lat_e7 / 1e7, home.lon_e7 / 1e7, home.alt_amsl_m + last.alt_rel_m, last.alt_rel_m
            )


def _stops(mission: Mission) -> Iterator[MappedStop]:
    held = [
        item
        for item in mission.items
        if item.command == Command.NAV_LOITER_TIME
        or (item.command == Command.NAV_WAYPOINT and item.params[0] > 0)
    ]
    for number, item in enumerate(held, start=1):
        yield MappedStop(number, _place(item, mission), item.params[0], ())


def _planned_stops(mission: Mission, plan: "StoredPlan") -> Iterator[MappedStop]:
    served: list[list[str]] = [[] for _ in plan.stops]
    for name, stop in zip(plan.scenario.users.names, plan.stop_of.tolist(), strict=True):
        served[stop].append(name)
    for number, (stop, names) in enumerate(zip(plan.stops, served, strict=True), start=1):
        alt_amsl_m = mission.home.alt_amsl_m + stop.alt_rel_m
        place = Place(stop.lat_deg, stop.lon_deg, alt_amsl_m, stop.alt_rel_m)
        yield MappedStop(number, place, stop.hold_s, tuple(names), stop.name)


def _users(plan: "StoredPlan") -> Iterator[MappedUser]:
    users = plan.scenario.users
    for n, name in enumerate(users.names):
        mate = int(users.mate[n])
        yield MappedUser(
            name,
            float(users.lat_deg[n]),
            float(users.lon_deg[n]),
            float(users.demand_bit[n]) / 1e6,
            int(plan.stop_of[n]) + 1,
            bool(plan.d2d[n]),
            users.names[mate] if mate >= 0 else "",
            None if users.priority is None else float(users.priority[n]),
        )


def _radius_m(plan: "StoredPlan") -> float:
    from mavplan.radio import planning_channel

    return planning_channel(plan.scenario).radius_m
