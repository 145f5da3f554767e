"""What a check found in a file: problems, and the values as far as they could be read, in the file's own numbering."""

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from mavplan.errors import Problem

NO_HOME = (math.nan, math.nan, math.nan)


class SeenItem(NamedTuple):
    """One item as the file says it: degrees, metres, NaN for no value."""

    place: str
    command: int
    frame: int
    param1: float
    param2: float
    param3: float
    param4: float
    lat_deg: float
    lon_deg: float
    alt_m: float


class SeenArea(NamedTuple):
    """One area of a fence as the file says it, in degrees and metres: a circle has one corner, a polygon radius 0."""

    place: str
    inclusion: bool
    corners_deg: tuple[tuple[float, float], ...]
    radius_m: float


class SeenRally(NamedTuple):
    """One rally point as the file says it: degrees, metres above home."""

    place: str
    lat_deg: float
    lon_deg: float
    alt_m: float


@dataclass
class Findings:
    """What one check has found; ``home`` is latitude, longitude in degrees and metres above sea level."""

    name: str
    problems: list[Problem] = field(default_factory=list)
    home: tuple[float, float, float] = NO_HOME
    items: list[SeenItem] = field(default_factory=list)
    areas: list[SeenArea] = field(default_factory=list)
    rally: list[SeenRally] = field(default_factory=list)
    autopilot: str | None = None
    says_autopilot: bool = False

    def add(
        self, place: str, message: str, code: str, severity: Literal["error", "warning"] = "error"
    ) -> None:
        """Note one problem."""
        where = f"{self.name}, {place}" if place else self.name
        self.problems.append(Problem(where, message, code, severity))
