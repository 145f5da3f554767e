"""What each phase of a flight takes in seconds and watt-hours: climb, cruise, hover, descent. Pure.

The autopilots' constants are in `mavplan.mission.flight_law`, the power in `mavplan.energy`; which item of a mission
has which phases is `mavplan.mission.forecast`'s business. Without a rotor every energy is NaN.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mavplan.energy import RotaryWing
from mavplan.mission.arrival import end_lag_s, start_lag_s
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.flight_law import LAWS, FlightLaw
from mavplan.mission.motion import Legs, rest_to_rest
from mavplan.mission.turning import Bools, spared
from mavplan.mission.wind import Wind

Floats = NDArray[np.float64]

JOULE_PER_WH = 3600.0


@dataclass(frozen=True, slots=True)
class Phases:
    """Seconds, or watt-hours, of each phase."""

    climb: float = 0.0
    cruise: float = 0.0
    hover: float = 0.0
    descent: float = 0.0

    @property
    def total(self) -> float:
        """Sum of the four."""
        return math.fsum((self.climb, self.cruise, self.hover, self.descent))

    def __add__(self, other: "Phases") -> "Phases":
        """Return the sums, phase by phase."""
        return Phases(
            self.climb + other.climb,
            self.cruise + other.cruise,
            self.hover + other.hover,
            self.descent + other.descent,
        )


@dataclass(frozen=True, slots=True)
class Flown:
    """Seconds and watt-hours of a piece of a flight, phase by phase."""

    seconds: Phases
    energy_wh: Phases

    def __add__(self, other: "Flown") -> "Flown":
        """Return both one after the other."""
        return Flown(self.seconds + other.seconds, self.energy_wh + other.energy_wh)


NOT_FLOWN = Flown(Phases(), Phases())


@dataclass(frozen=True)
class Vehicle:
    """How one vehicle flies, and what it costs.

    Attributes
    ----------
    rules
        Its autopilot.
    acceleration_m_s2
        Of legs; 0 reaches speed at once, None is the autopilot's measured law.
    rotor
        None where the mass is not known.
    wind
        None for still air.
    """

    rules: AutopilotRules
    acceleration_m_s2: float | None = None
    rotor: RotaryWing | None = None
    wind: Wind | None = None

    @property
    def law(self) -> FlightLaw:
        """The autopilot's constants."""
        return LAWS[self.rules.name]

    def hover(self, seconds: float) -> Flown:
        """Return a time at one place."""
        return Flown(Phases(hover=seconds), Phases(hover=self._hover_wh(seconds)))

    def take_off(self, height_m: float) -> Flown:
        """Return what it takes from the start of the mission until the climb is over, the wait on the ground included.

        Motors that turn on the ground take a tenth of what hover takes or less: it is not counted.
        """
        law = self.law
        slow_m = min(height_m, law.climb_slow_below_m)
        fastest_m_s = law.climb_m_s if height_m > slow_m else law.climb_slow_m_s
        slowed_s = law.climb_end_s_per_m_s * fastest_m_s
        seconds = Phases(climb=law.takeoff_ground_s + slowed_s)
        waited = Flown(seconds, Phases(climb=self._hover_wh(slowed_s)))
        return waited + self._at_once(slow_m, law.climb_slow_m_s) + self.climb(height_m - slow_m)

    def climb(self, height_m: float) -> Flown:
        """Return a climb from rest to rest, in flight."""
        law = self.law
        up = rest_to_rest(height_m, law.climb_m_s, law.climb_acceleration_m_s2, law.climb_jerk_m_s3)
        if self.rotor is None:
            return Flown(Phases(climb=float(up.time_s)), Phases(climb=math.nan))
        power = self.rotor.climb_power_w
        joule = 2 * up.ramp_s * up.ramp_mean(power) + up.plateau_s * power(up.peak_m_s)
        return Flown(Phases(climb=float(up.time_s)), Phases(climb=float(joule) / JOULE_PER_WH))

    def land(self, height_m: float) -> Flown:
        """Return what it takes from a height until the motors stop; what they take on the ground is not counted."""
        seconds, below_m = self.law.landing_slow_s, height_m
        steps = self.law.descent
        for (_, speed_m_s), (until_m, _) in zip(steps, (*steps[1:], (0.0, 0.0)), strict=True):
            part_m = max(below_m - until_m, 0.0)
            seconds += part_m / speed_m_s
            below_m -= part_m
        descent = Phases(descent=seconds + self.law.landing_ground_s)
        return Flown(descent, Phases(descent=self._hover_wh(seconds)))

    def come_home(self, step_m: ArrayLike, height_m: float) -> Flown:
        """Return a return to launch over (2,) metres from a height until the motors stop; its pauses are hover."""
        law = self.law
        return_height_m = max(height_m, law.return_height_m)
        (seconds,), (energy_wh,) = self.legs(step_m, law.return_m_s)
        return (
            self.climb(return_height_m - height_m)
            + Flown(Phases(cruise=float(seconds)), Phases(cruise=float(energy_wh)))
            + self.hover(law.return_wait_s)
            + self.land(return_height_m)
        )

    def change_height(self, by_m: float, level: Flown) -> Flown:
        """Return a level leg flown together with a change of height: what takes longer says how long."""
        if by_m == 0:
            return level
        if by_m > 0:
            upright = self.climb(by_m)
        else:
            seconds = -by_m / self.law.descent[0][1]
            upright = Flown(Phases(descent=seconds), Phases(descent=self._hover_wh(seconds)))
        cruise_s = level.seconds.cruise
        left = max(cruise_s - upright.seconds.total, 0.0) / cruise_s if cruise_s else 0.0
        rest = Flown(Phases(cruise=left * cruise_s), Phases(cruise=left * level.energy_wh.cruise))
        return upright + rest

    def legs(
        self, steps_m: ArrayLike, speed_m_s: ArrayLike, through: Bools | None = None
    ) -> tuple[Floats, Floats]:
        """Return seconds and watt-hours of L legs in flying order, until the hold at their end begins.

        Parameters
        ----------
        steps_m
            (L, 2) where each leads, metres from its beginning.
        speed_m_s
            Asked, for all or (L,); what lies beyond the autopilot's default limit is not flown.
        through
            (L,) whether the point at its end is flown through; None: all of them are stops.

        Returns
        -------
        ndarray, ndarray
            (L,) each; a leg of no length takes no time.
        """
        steps = np.asarray(steps_m, dtype=np.float64).reshape(-1, 2)
        speed = np.minimum(
            np.broadcast_to(np.asarray(speed_m_s, dtype=np.float64), len(steps)),
            self.rules.default_speed_limit_m_s,
        )
        if self.wind is not None:
            speed = self.wind.ground_m_s(steps, speed, self.law.airspeed_limit_m_s)
        distance = np.hypot(steps[:, 0], steps[:, 1])
        legs = self.motion(distance, speed)
        passed = np.zeros(len(steps), dtype=bool) if through is None else through
        share = spared(legs, steps, speed, passed, self.law)
        # Of a ramp that is not flown its way remains, at the peak speed: half its time.
        flown, kept = 2 - share.first - share.last, (share.first + share.last) / 2
        lag = share.wait_s
        if self.acceleration_m_s2 is None:
            # Where PX4 does not slow down, a leg ends at its point, not at the radius about it.
            lag = lag + start_lag_s(legs, self.law) * (1 - share.first)
            lag = lag + end_lag_s(legs, distance, speed, self.law) * (1 - share.settle)
        seconds = (flown + kept) * legs.ramp_s + legs.plateau_s + lag
        # The shortest legs of PX4: none is faster than its speed.
        seconds = np.maximum(seconds, (distance - self.law.arrival_radius_m) / speed)
        if self.rotor is None:
            return seconds, np.full(len(steps), math.nan)
        power = self._power_w(steps)
        joule = (
            flown * legs.ramp_s * legs.ramp_mean(power)
            + (kept * legs.ramp_s + legs.plateau_s) * power(legs.peak_m_s)
            + lag * self._staying_w
        )
        return seconds, joule / JOULE_PER_WH

    def motion(self, distance_m: ArrayLike, speed_m_s: ArrayLike) -> Legs:
        """Return how legs are flown from rest to rest."""
        if self.acceleration_m_s2 is not None:
            return rest_to_rest(distance_m, speed_m_s, self.acceleration_m_s2)
        return rest_to_rest(distance_m, speed_m_s, self.law.acceleration_m_s2, self.law.jerk_m_s3)

    def held_early_s(self, legs: Legs, distance_m: Floats, speed_m_s: float) -> Floats:
        """Return (...) how long before its rest each leg's hold begins: PX4's, within its acceptance radius."""
        if self.acceleration_m_s2 is not None:
            return np.zeros(np.shape(distance_m))
        late_s = end_lag_s(legs, distance_m, np.full(np.shape(distance_m), speed_m_s), self.law)
        return np.maximum(-late_s, 0.0)

    def _at_once(self, height_m: float, climb_m_s: float) -> Flown:
        seconds = height_m / climb_m_s
        watt = math.nan if self.rotor is None else float(self.rotor.climb_power_w(climb_m_s))
        return Flown(Phases(climb=seconds), Phases(climb=seconds * watt / JOULE_PER_WH))

    def _power_w(self, steps_m: Floats) -> Callable[[ArrayLike], Floats]:
        """Return the power of L legs by their speed over ground, (L,) or (L, S)."""
        rotor, wind = self.rotor, self.wind
        if rotor is None:
            raise AssertionError("no rotor, no power")
        if wind is None:
            return rotor.power_w
        head, cross = wind.parts_m_s(steps_m)

        def power_w(ground_m_s: ArrayLike) -> Floats:
            ground = np.asarray(ground_m_s, dtype=np.float64)
            shape = (-1, *(1,) * (ground.ndim - 1))
            return rotor.power_w(np.hypot(ground + head.reshape(shape), cross.reshape(shape)))

        return power_w

    @property
    def _staying_w(self) -> float:
        """Power of staying over one place: that of hover, or of flying against the wind if that is more."""
        if self.rotor is None:
            return math.nan
        against = 0.0 if self.wind is None else float(self.rotor.power_w(self.wind.speed_m_s))
        return max(self.rotor.hover_w, against)

    def _hover_wh(self, seconds: float) -> float:
        return seconds * self._staying_w / JOULE_PER_WH
