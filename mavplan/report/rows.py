"""What a report shows, as plain values: rows of users, stops, mission items and planners, and the flight over time."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class UserRow:
    """A user: its place in metres east and north, what it needs, and what it gets on the way and in all."""

    name: str
    x_m: float
    y_m: float
    lat_deg: float
    lon_deg: float
    demand_mbit: float
    stop: int
    d2d: bool
    mate: str
    rate_mbit_s: float
    in_flight_mbit: float
    gets_mbit: float


@dataclass(frozen=True, slots=True)
class StopRow:
    """A stop; ``items`` are its numbers on the wire, ``arrival_s`` when its hold begins; pinned ones have a name."""

    number: int
    x_m: float
    y_m: float
    lat_deg: float
    lon_deg: float
    alt_rel_m: float
    hold_s: float
    arrival_s: float
    items: str
    users: tuple[int, ...]
    name: str = ""


@dataclass(frozen=True, slots=True)
class ItemRow:
    """A mission item as it goes to the vehicle, and what it takes."""

    seq: int
    command: str
    stop: int | None
    lat_deg: float | None
    lon_deg: float | None
    alt_m: float | None
    hold_s: float
    climb_s: float
    cruise_s: float
    hover_s: float
    descent_s: float
    done_s: float
    used_wh: float | None


@dataclass(frozen=True, slots=True)
class Area:
    """An area of the fence as a ring of points in metres, or a circle."""

    label: str
    inclusion: bool
    ring_m: tuple[tuple[float, float], ...]
    radius_m: float = 0.0


@dataclass(frozen=True, slots=True)
class CompareRow:
    """A planner beside the others, ``flown_m`` with the way home; the plan of the report is ``chosen``."""

    planner: str
    stops: int
    d2d_users: int
    length_m: float
    flown_m: float
    sum_rate_bit_s_hz: float | None
    joint_index: float | None
    hover_s: float
    mission_s: float
    chosen: bool


@dataclass(frozen=True, slots=True)
class ReportContent:
    """All that is shown of a flight: seconds from the start of its mission, metres from the report's home.

    Attributes
    ----------
    home_m
        Where it takes off: the origin, but for vehicles that start elsewhere than the first.
    length_m, back_m
        From home to the last stop, and from there on.
    profile, ground
        Time, and height above home of the flight and of the ground below it; that is empty where it is not known.
    start_s
        When it starts, after the first of several, or of those of its round.
    round
        Of sorties of several vehicles, from 1: it begins when the one before is over.
    flight
        Its name among several; empty where it is the only one.
    proved
        What is proved of it, in words; empty where nothing is.
    in_flight
        Whether what users receive on the way counts.
    warnings
        What the people who fly it should know.
    not_served
        Users that none of several flights serves.
    """

    title: str
    planner: str
    autopilot: str
    radius_m: float
    altitude_m: float
    service: str
    path_m: tuple[tuple[float, float], ...]
    length_m: float
    back_m: float
    stops: tuple[StopRow, ...]
    users: tuple[UserRow, ...]
    pairs: tuple[tuple[int, int], ...]
    items: tuple[ItemRow, ...]
    areas: tuple[Area, ...]
    profile: tuple[tuple[float, float], ...]
    ground: tuple[tuple[float, float], ...]
    flight_s: float
    hover_s: float
    mission_s: float
    used_wh: float | None
    battery_wh: float | None
    comparison: tuple[CompareRow, ...]
    least_stops: str
    home_m: tuple[float, float] = (0.0, 0.0)
    flight: str = ""
    sorties: bool = False
    start_s: float = 0.0
    round: int = 1
    proved: str = ""
    in_flight: bool = False
    warnings: tuple[str, ...] = ()
    not_served: tuple[str, ...] = ()

    @property
    def any_pinned(self) -> bool:
        """Whether any stop is pinned."""
        return any(stop.name for stop in self.stops)

    @property
    def demand_mbit(self) -> float:
        """What all users need together."""
        return math.fsum(user.demand_mbit for user in self.users)
