"""What a wind does to legs: how fast they are flown over the ground, and how fast through the air. Pure."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from mavplan.scenario import sections

Floats = NDArray[np.float64]

STEP_M_S = 0.05
"""Speeds over ground are cut down to whole steps: what a wind is worth is not known better."""


@dataclass(frozen=True, slots=True)
class Wind:
    """A steady wind.

    Attributes
    ----------
    speed_m_s
        Of the air over the ground.
    from_deg
        Where it comes from, clockwise from north; None: it may come from anywhere, and each leg is counted against it.
    """

    speed_m_s: float
    from_deg: float | None = None

    @classmethod
    def of(cls, section: "sections.Wind") -> "Wind | None":
        """Return the wind of a scenario; None for still air."""
        return cls(section.speed_m_s, section.from_deg) if section.speed_m_s > 0 else None

    def parts_m_s(self, steps_m: Floats) -> tuple[Floats, Floats]:
        """Return the head wind and the cross wind of (L, 2) legs, each (L,); a tail wind is below 0."""
        length_m = np.hypot(steps_m[:, 0], steps_m[:, 1])
        if self.from_deg is None:
            return np.full(len(steps_m), self.speed_m_s), np.zeros(len(steps_m))
        along = steps_m / np.where(length_m > 0, length_m, 1.0)[:, None]
        bearing = math.radians(self.from_deg)
        upwind = self.speed_m_s * np.array([math.sin(bearing), math.cos(bearing)])
        head = along @ upwind
        return head, np.sqrt(np.maximum(self.speed_m_s**2 - head**2, 0.0)) * (length_m > 0)

    def ground_m_s(self, steps_m: Floats, asked_m_s: Floats, airspeed_limit_m_s: float) -> Floats:
        """Return how fast (L, 2) legs are flown over the ground.

        Parameters
        ----------
        steps_m
            (L, 2) metres east and north.
        asked_m_s
            (L,) what is asked; a tail wind makes nobody faster than that.
        airspeed_limit_m_s
            The most the vehicle makes through the air, more than the wind's speed.
        """
        head, cross = self.parts_m_s(steps_m)
        most = np.sqrt(np.maximum(airspeed_limit_m_s**2 - cross**2, 0.0)) - head
        cut = np.maximum(np.floor(most / STEP_M_S) * STEP_M_S, STEP_M_S)
        return np.minimum(asked_m_s, cut)
