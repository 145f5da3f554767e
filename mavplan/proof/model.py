"""A `Proof`: what came of a plan in the air, user by user and stop by stop. Nothing is worked out here."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavplan.errors import Problem
from mavplan.hover import DEMAND_TOLERANCE_BIT
from mavplan.stored_plan import StoredPlan
from mavplan.track.flights import Flight
from mavplan.track.model import Floats, Span, Track

Bools = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True)
class FlownStop:
    """One stop as it was flown.

    Attributes
    ----------
    planned_s
        The hold as the autopilot stored it.
    span
        When it was held; None where it was not, or nothing shows it.
    by
        Whether the vehicle said when (``vehicle``) or its track shows it (``track``).
    away_m, most_away_m
        Mean and greatest distance from the planned place over the ground during the hold; without one, how near the
        flight ever came (both the same).
    higher_m
        Mean height during the hold above the planned one, negative below; None without a hold.
    uncounted_s
        Seconds of the hold that do not count: no positions, or too low.
    arrived_s, expected_s
        When the hold began, from the start of the mission, and when it was forecast to; None where that is not known.
    """

    planned_s: float
    span: Span | None
    by: Literal["vehicle", "track"] | None
    away_m: float
    most_away_m: float
    higher_m: float | None
    uncounted_s: float
    arrived_s: float | None = None
    expected_s: float | None = None

    @property
    def held_s(self) -> float:
        """The real hold."""
        return self.span.length_s if self.span else 0.0


@dataclass(frozen=True, eq=False)
class Proof:
    """What N users received in one flight of M stops, in bits.

    Attributes
    ----------
    plan, track, flight
        What was planned, and what was flown.
    flight_bit, hover_bit
        (N,) received from the vehicle between stops and at them.
    in_flight
        Whether what is received in flight counts: where the plan counts on it, or it was asked for.
    d2d_bit
        (N,) received from the mate; 0 for users that the plan serves from the air.
    stops
        M stops.
    reasons
        For each user that is short what explains most of it, in one clause; by the user's index.
    path_xyz_m
        (S, 3) where the vehicle was, metres east and north of home and above it.
    known
        (S − 1,) whether its place was known between two of these.
    notes
        What could and could not be used, and what is odd.
    """

    plan: StoredPlan
    track: Track
    flight: Flight
    flight_bit: Floats
    hover_bit: Floats
    d2d_bit: Floats
    in_flight: bool
    stops: tuple[FlownStop, ...]
    reasons: dict[int, str]
    path_xyz_m: Floats
    known: Bools
    notes: tuple[Problem, ...]

    @property
    def demand_bit(self) -> Floats:
        """(N,) what each needs."""
        return self.plan.scenario.users.demand_bit

    @property
    def received_bit(self) -> Floats:
        """(N,) what counts of all that was received."""
        received: Floats = self.hover_bit + self.d2d_bit
        return received + self.flight_bit if self.in_flight else received

    @property
    def met(self) -> Bools:
        """(N,) whether the demand is met; less than one bit short is met."""
        met: Bools = self.received_bit >= self.demand_bit - DEMAND_TOLERANCE_BIT
        return met

    @property
    def short_bit(self) -> Floats:
        """(N,) what is missing, 0 where the demand is met."""
        return np.where(self.met, 0.0, self.demand_bit - self.received_bit)

    @property
    def all_met(self) -> bool:
        """Whether every demand is met."""
        return bool(self.met.all())
