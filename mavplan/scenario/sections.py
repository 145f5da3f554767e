"""The sections of ``scenario.toml``: every key, its unit, its range and its default, named here and nowhere else.

Each section is a frozen dataclass that checks itself, so that a scenario made in Python is held to the same
rules as one read from a file. Reading the file is `mavplan.scenario.toml`'s business.

The default radio stands in for the paper's table of parameters, which is lost in the copy we work from: altitude
100 m, exponent 2 and threshold 3 dB give a coverage radius of 400 m. How the link budget splits into power, gain
and noise is our assumption (noise: that of 1 MHz at a noise figure near 9 dB).
"""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

_CHECKED = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

Solver = Literal["closed-form", "cvxpy"]
"""How the convex steps are solved: in closed form, or by CVXPY, slower, as the reference."""


class OrAuto:
    """In an annotation: a file may also say ``auto``, which is settled before there is a plan."""


Positive = Annotated[float, Field(gt=0)]
LatDeg = Annotated[float, Field(ge=-90, le=90)]
LonDeg = Annotated[float, Field(ge=-180, le=180)]
PowerDbm = Annotated[float, Field(ge=-200, le=100)]
GainDb = Annotated[float, Field(ge=-200, le=100)]
Exponent = Annotated[float, Field(ge=1, le=8)]
DemandMbit = Annotated[float, Field(ge=0, le=1e9)]
Priority = Annotated[float, Field(ge=0, le=1e6)]


@dataclass(frozen=True, config=_CHECKED)
class Home:
    """Where the vehicle takes off, the origin of the plan: WGS84 degrees, metres above mean sea level."""

    lat_deg: LatDeg
    lon_deg: LonDeg
    alt_amsl_m: Annotated[float, Field(ge=-500, le=9000)]


@dataclass(frozen=True, config=_CHECKED)
class Columns:
    """The users file's own column or property for each thing that is read from it; None: the key's own name."""

    name: str | None = None
    lat_deg: str | None = None
    lon_deg: str | None = None
    demand_mbit: str | None = None
    priority: str | None = None
    pair: str | None = None
    utm: str | None = None
    mgrs: str | None = None


@dataclass(frozen=True, config=_CHECKED)
class UserValues:
    """What the users file may say of one user beside its place: where not everybody can be served, who comes first."""

    priority: Priority = 1.0


@dataclass(frozen=True, config=_CHECKED)
class Radio:
    """The vehicle's radio, equations (1) to (4) of the paper.

    Gain is that at 1 m, noise that in the whole bandwidth; ``fade_margin_db`` is kept by plans, and not by the paper.
    """

    tx_power_dbm: PowerDbm = 20.0
    ref_gain_db: GainDb = -70.0
    noise_dbm: PowerDbm = -105.3045
    path_loss_exponent: Exponent = 2.0
    snr_threshold_db: Annotated[float, Field(ge=-50, le=100)] = 3.0
    bandwidth_hz: Positive = 1e6
    fade_margin_db: Annotated[float, Field(ge=0, le=60)] = 0.0


@dataclass(frozen=True, config=_CHECKED)
class D2D:
    """Device-to-device links between paired users.

    ``matching`` None means: ``given`` where the users file has a pair column, else ``none``; that a stranger's
    phone relays is never assumed. Noise and bandwidth are those of the radio.
    """

    matching: Literal["auto", "given", "none"] | None = None
    link: Literal["channel", "ideal"] = "channel"
    range_m: Positive = 200.0
    tx_power_dbm: PowerDbm = 20.0
    ref_gain_db: GainDb = -50.0
    path_loss_exponent: Exponent = 3.0


@dataclass(frozen=True, config=_CHECKED)
class Vehicle:
    """The multirotor; altitude above home, in a file also ``auto``: sought between the least and the greatest.

    ``acceleration_m_s2`` None is the autopilot's measured law, 0 reaches speed at once. ``position_error_m`` None is
    what the autopilot was measured to be off its place. ``endurance_s`` None
    assumes nothing. Without a mass no energy is forecast; a battery needs one.
    """

    autopilot: Literal["ardupilot", "px4"] = "ardupilot"
    altitude_m: Annotated[float, Field(gt=0, le=10000), OrAuto()] = 100.0
    altitude_min_m: Annotated[float, Field(gt=0, le=10000)] = 30.0
    altitude_max_m: Annotated[float, Field(gt=0, le=10000)] = 120.0
    speed_m_s: Annotated[float, Field(gt=0, le=50)] = 10.0
    acceleration_m_s2: Annotated[float, Field(ge=0, le=50)] | None = None
    position_error_m: Annotated[float, Field(ge=0, le=100)] | None = None
    end: Literal["rtl", "land", "stay"] = "rtl"
    endurance_s: Positive | None = None
    reserve_fraction: Annotated[float, Field(ge=0, lt=1)] = 0.2
    battery_wh: Positive | None = None
    mass_kg: Positive | None = None


@dataclass(frozen=True, config=_CHECKED)
class Service:
    """How users are served: all in reach at once (broadcast) or one at a time (tdma).

    ``in_flight`` None leaves it to the planner whether holds count what users receive in flight; ``user_error_m`` is
    how far users may be from their places.
    """

    mode: Literal["broadcast", "tdma"] = "broadcast"
    in_flight: bool | None = None
    user_error_m: Annotated[float, Field(ge=0, le=1000)] = 0.0
    demand_mbit: DemandMbit = 10.0
    """Demand of each user whose file brings none."""


@dataclass(frozen=True, config=_CHECKED)
class Wind:
    """A steady wind to be planned for; ``from_deg`` None counts every leg against it."""

    speed_m_s: Annotated[float, Field(ge=0, le=50)] = 0.0
    from_deg: Annotated[float, Field(ge=0, le=360)] | None = None


@dataclass(frozen=True, config=_CHECKED)
class FenceOptions:
    """What goes with the areas of the fence: a height above home not to exceed, a distance to keep from borders."""

    max_alt_rel_m: Positive | None = None
    margin_m: Annotated[float, Field(ge=0, le=1000)] = 3.0


@dataclass(frozen=True, config=_CHECKED)
class TerrainOptions:
    """The ground: files of it, what to keep above it along every leg, what its heights are above."""

    file: str | list[str] | None = None
    clearance_m: Annotated[float, Field(ge=1, le=1000)] = 30.0
    datum: str | None = None


@dataclass(frozen=True, config=_CHECKED)
class Vertex:
    """A corner of a fence polygon, WGS84 degrees."""

    lat_deg: LatDeg
    lon_deg: LonDeg


@dataclass(frozen=True, config=_CHECKED)
class Circle:
    """A round area of the fence: WGS84 degrees."""

    lat_deg: LatDeg
    lon_deg: LonDeg
    radius_m: Annotated[float, Field(gt=0, le=100_000)]


@dataclass(frozen=True, config=_CHECKED)
class Rally:
    """A place to return to other than home: WGS84 degrees, altitude above home."""

    lat_deg: LatDeg
    lon_deg: LonDeg
    alt_rel_m: Annotated[float, Field(gt=0, le=10000)]
    name: str = ""


@dataclass(frozen=True, config=_CHECKED)
class FleetVehicle:
    """One vehicle of a fleet with a home of its own: WGS84 degrees, metres above mean sea level, MAVLink system id."""

    lat_deg: LatDeg
    lon_deg: LonDeg
    alt_amsl_m: Annotated[float, Field(ge=-500, le=9000)]
    name: str = ""
    system: Annotated[int, Field(ge=1, le=255)] | None = None


@dataclass(frozen=True, config=_CHECKED)
class PinnedStop:
    """A place where the vehicle must stop: WGS84 degrees, or straight above a user, who then gets all it needs there.

    ``hold_s`` is the least hold; ``order`` None leaves it to the planner when it is flown to.
    """

    lat_deg: LatDeg | None = None
    lon_deg: LonDeg | None = None
    user: str | None = None
    name: str = ""
    hold_s: Annotated[float, Field(ge=0, le=65_535)] = 0.0
    order: Annotated[int, Field(ge=1)] | Literal["first", "last"] | None = None


@dataclass(frozen=True, config=_CHECKED)
class PlannerOptions:
    """Which planner, how many clusters (``auto`` tries several), the seed of all that is random, the solver.

    ``time_limit_s`` is for planners that search for a proof: `length`, `time`.
    """

    name: str = "tloaik"
    clusters: Annotated[int, Field(ge=1)] | Literal["auto"] = "auto"
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    solver: Solver = "closed-form"
    time_limit_s: Annotated[float, Field(ge=0, le=86400)] = 30.0
