"""A `Track`: where one vehicle was in one run of its clock, and what it said of its mission. Nothing is read here."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavplan.errors import Problem
from mavplan.mission.model import Autopilot

Floats = NDArray[np.float64]


class Span(NamedTuple):
    """From when until when, seconds of the vehicle's clock."""

    from_s: float
    until_s: float

    @property
    def length_s(self) -> float:
        """How long it lasts."""
        return self.until_s - self.from_s


class ItemEvent(NamedTuple):
    """A word of the vehicle about a mission item: when, and the number it said (ArduPilot's count home as 0)."""

    time_s: float
    seq: int


@dataclass(frozen=True, eq=False)
class Track:
    """One vehicle between two restarts. S positions.

    Attributes
    ----------
    label
        What to call the log in messages.
    time_s
        (S,) seconds of the vehicle's own clock, strictly increasing.
    lat_deg, lon_deg
        (S,) WGS84 degrees.
    alt_rel_m
        (S,) metres above the vehicle's home.
    armed
        When its motors were armed; None where the log does not say.
    in_air
        When it was off the ground.
    in_mission
        When it flew its mission by itself; None where the log does not say.
    reached
        MISSION_ITEM_REACHED, in the manner of its autopilot; repetitions left out.
    current
        Changes of MISSION_CURRENT.
    autopilot
        None where the log does not say, or it is neither.
    system
        MAVLink system; None where the log has none.
    notes
        What of the log could be used and what not.
    """

    label: str
    time_s: Floats
    lat_deg: Floats
    lon_deg: Floats
    alt_rel_m: Floats
    armed: tuple[Span, ...] | None
    in_air: tuple[Span, ...]
    in_mission: tuple[Span, ...] | None = None
    reached: tuple[ItemEvent, ...] = ()
    current: tuple[ItemEvent, ...] = ()
    autopilot: Autopilot | None = None
    system: int | None = None
    notes: tuple[Problem, ...] = ()

    def __len__(self) -> int:
        """Return the number of positions."""
        return len(self.time_s)

    @property
    def air_s(self) -> float:
        """Seconds off the ground."""
        return sum(span.length_s for span in self.in_air)
