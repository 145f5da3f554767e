"""A `Scenario`: what a planner gets. Users in local metres, everything checked, nothing read from anywhere."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mavplan.errors import Problem
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.scenario.sections import (
    D2D,
    FenceOptions,
    FleetVehicle,
    Home,
    PinnedStop,
    PlannerOptions,
    Radio,
    Service,
    TerrainOptions,
    Vehicle,
    Wind,
)
from mavplan.terrain.grid import Terrain

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

UNPAIRED = -1
"""In `Users.mate`: this user has no mate."""


@dataclass(frozen=True, eq=False)
class Users:
    """The ground users, in the order of their file. N users; all arrays have N rows.

    Attributes
    ----------
    names
        N distinct names.
    lat_deg, lon_deg
        (N,) WGS84 degrees.
    xy_m
        (N, 2) metres east and north of home in the local plane.
    demand_bit
        (N,) bits that each user needs, not negative.
    mate
        (N,) index of the other member of the D2D pair, or `UNPAIRED`; a matching: ``mate[mate[n]] == n``.
        Only pairs within the D2D range.
    priority
        (N,) weights of the users' demands where not everybody can be served, not negative; None: all alike.
    """

    names: tuple[str, ...]
    lat_deg: Floats
    lon_deg: Floats
    xy_m: Floats
    demand_bit: Floats
    mate: Ints
    priority: Floats | None = None

    def __len__(self) -> int:
        """Return the number of users."""
        return len(self.names)

    @property
    def weighted_bit(self) -> Floats:
        """(N,) each user's demand times its priority: what it is worth to serve it."""
        return self.demand_bit if self.priority is None else self.priority * self.demand_bit

    def named(self, names: Collection[str]) -> Bools:
        """Return (N,) whether each user's name is one of these."""
        wanted = frozenset(names)
        return np.array([name in wanted for name in self.names], dtype=np.bool_)

    def names_of(self, which: Bools) -> tuple[str, ...]:
        """Return the names of some users, (N,) whether each is one of them."""
        return tuple(self.names[number] for number in np.flatnonzero(which))

    def some(self, kept: Ints, demand_bit: Floats) -> "Users":
        """Return K of N users by their indices with other demands, (N,); a pair of which one is left out is none."""
        place = np.full(len(self) + 1, UNPAIRED, dtype=np.int64)
        place[kept] = np.arange(len(kept))
        mate = self.mate[kept]
        return Users(
            names=tuple(self.names[number] for number in kept),
            lat_deg=self.lat_deg[kept],
            lon_deg=self.lon_deg[kept],
            xy_m=self.xy_m[kept],
            demand_bit=demand_bit[kept],
            mate=np.where(mate == UNPAIRED, UNPAIRED, place[mate]),
            priority=None if self.priority is None else self.priority[kept],
        )


@dataclass(frozen=True, eq=False)
class Scenario:
    """Everything that is known before planning, in SI units and local metres.

    ``vehicles`` are those of a fleet that have homes of their own; ``stops`` are those that the plan must have, each
    with a name and a place in degrees. ``fence``, ``no_fly`` and ``rally`` stay in
    degrees, as they go into the mission: ``fence`` is what a mission is held to, ``no_fly`` what it is planned round.
    With ``search_altitude`` the vehicle's altitude is the least there may be, and the planned one is still sought.
    Without ``terrain`` the ground is flat. ``warnings`` holds what was noticed while reading: a pair beyond the D2D
    range, keys not used.
    """

    home: Home
    users: Users
    radio: Radio = field(default_factory=Radio)
    d2d: D2D = field(default_factory=D2D)
    vehicle: Vehicle = field(default_factory=Vehicle)
    service: Service = field(default_factory=Service)
    planner: PlannerOptions = field(default_factory=PlannerOptions)
    wind: Wind = field(default_factory=Wind)
    fence_options: FenceOptions = field(default_factory=FenceOptions)
    fence: Fence | None = None
    no_fly: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    vehicles: tuple[FleetVehicle, ...] = ()
    stops: tuple[PinnedStop, ...] = ()
    terrain_options: TerrainOptions = field(default_factory=TerrainOptions)
    terrain: Terrain | None = None
    search_altitude: bool = False
    warnings: tuple[Problem, ...] = ()

    @property
    def over_ground(self) -> bool:
        """Whether it is planned over real ground, read already or not."""
        return self.terrain is not None or self.terrain_options.file is not None

    def with_some(self, users: Users) -> "Scenario":
        """Return the scenario of some of the users, whose pairs stay as they are."""
        matching = self.d2d.matching
        return replace(
            self, users=users, d2d=replace(self.d2d, matching="given" if matching == "auto" else matching)
        )

    def left_over(self, left: Bools, left_bit: Floats) -> "Scenario | None":
        """Return the scenario of the users that are left, with mates that may relay; None where nobody is.

        Pinned stops are left out.

        Parameters
        ----------
        left
            (N,) whether a user is left.
        left_bit
            (N,) what it still needs.
        """
        if not left.any():
            return None
        users, kept = self.users, left.copy()
        kept[users.mate[left & (users.mate != UNPAIRED)]] = True
        rest = users.some(np.flatnonzero(kept), np.where(left, left_bit, 0.0))
        matching: Literal["given", "none"] = "given" if (rest.mate != UNPAIRED).any() else "none"
        return replace(self, users=rest, d2d=replace(self.d2d, matching=matching), stops=(), warnings=())
