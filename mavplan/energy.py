"""What flying costs: the power of a multirotor at hover, in forward flight and in a climb. Pure functions on arrays.

The model is that of Y. Zeng, J. Xu and R. Zhang, "Energy Minimization for Wireless Communication with Rotary-Wing
UAV", IEEE Transactions on Wireless Communications 18(4), 2019, doi:10.1109/TWC.2019.2902559, equation (12), with its
rotor of 20 N. Three things are ours: a vehicle of another mass has the same rotor scaled to the same load on its disc,
so that power is proportional to mass; 0.7 of the battery's power reaches the rotor; a climb is counted by momentum
theory, a descent as hover, which is more than it takes. No wind.

How long a mission takes and what each of its items costs is `mavplan.mission.forecast`'s business.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665
"""Standard acceleration of gravity (CGPM 1901)."""

PROPULSIVE_EFFICIENCY = 0.7
"""Power at the rotor over power from the battery: motor, controller and wiring. An assumption."""

FASTEST_M_S = 60.0
"""Speeds are looked for up to this one; for the published rotor both lie far below."""


@dataclass(frozen=True, slots=True)
class RotaryWing:
    """A rotor and what it carries; the defaults are the paper's table.

    Attributes
    ----------
    weight_n
        W, newton.
    air_density_kg_m3
        ρ.
    disc_area_m2
        A, of all rotors together.
    solidity
        s, blade area over disc area.
    profile_drag
        δ, of the blades.
    tip_speed_m_s
        U_tip = Ω·R: 300 rad/s and 0.4 m.
    fuselage_drag_ratio
        d0.
    induced_correction
        k, what the induced power is greater by than momentum theory's.
    efficiency
        Power at the rotor over power from the battery; 1 gives the paper's own figures.
    """

    weight_n: float = 20.0
    air_density_kg_m3: float = 1.225
    disc_area_m2: float = 0.503
    solidity: float = 0.05
    profile_drag: float = 0.012
    tip_speed_m_s: float = 120.0
    fuselage_drag_ratio: float = 0.6
    induced_correction: float = 0.1
    efficiency: float = PROPULSIVE_EFFICIENCY

    @property
    def profile_w(self) -> float:
        """P0 = δ/8·ρ·s·A·U_tip³, what turns the blades at hover, at the rotor."""
        blades = self.profile_drag / 8 * self.air_density_kg_m3 * self.solidity * self.disc_area_m2
        return blades * self.tip_speed_m_s**3

    @property
    def induced_w(self) -> float:
        """P_i = (1 + k)·W·v0, what carries the weight at hover, at the rotor."""
        return (1 + self.induced_correction) * self.weight_n * self.induced_m_s

    @property
    def induced_m_s(self) -> float:
        """v0 = √(W/(2·ρ·A)), speed of the air through the disc at hover."""
        return sqrt(self.weight_n / (2 * self.air_density_kg_m3 * self.disc_area_m2))

    @property
    def hover_w(self) -> float:
        """Power from the battery at hover."""
        return (self.profile_w + self.induced_w) / self.efficiency

    def power_w(self, speed_m_s: ArrayLike) -> Floats:
        """Return the power from the battery in level flight.

        Parameters
        ----------
        speed_m_s
            V through the air, any shape; its sign does not matter.

        Returns
        -------
        ndarray
            Watt, same shape: equation (12) over the efficiency.
        """
        speed = np.abs(np.asarray(speed_m_s, dtype=np.float64))
        blades = self.profile_w * (1 + 3 * speed**2 / self.tip_speed_m_s**2)
        # √(√(1 + x²) − x) without the difference of two numbers that grow alike, x = V²/(2·v0²).
        x = speed**2 / (2 * self.induced_m_s**2)
        induced = self.induced_w / np.sqrt(np.sqrt(1 + x**2) + x)
        drag = self.fuselage_drag_ratio * self.air_density_kg_m3 * self.solidity * self.disc_area_m2 / 2
        return np.asarray((blades + induced + drag * speed**3) / self.efficiency)

    def climb_power_w(self, climb_m_s: ArrayLike) -> Floats:
        """Return the power from the battery in a climb straight up; a descent counts as hover.

        The thrust W moves air at V_c + v_i, with v_i = −V_c/2 + √((V_c/2)² + v0²) (momentum theory). Going down, that
        holds neither for a slow descent, in which the rotor flies in its own wake, nor is it needed: hover is more.

        Parameters
        ----------
        climb_m_s
            V_c, any shape; negative is a descent.
        """
        climb = np.maximum(np.asarray(climb_m_s, dtype=np.float64), 0.0)
        through = -climb / 2 + np.sqrt((climb / 2) ** 2 + self.induced_m_s**2)
        thrust = self.weight_n * (climb + (1 + self.induced_correction) * through)
        return np.asarray((self.profile_w + thrust) / self.efficiency)

    def endurance_speed_m_s(self) -> float:
        """Return the speed at which a battery lasts longest; flying at it takes less than hovering."""
        return _lowest(lambda speed: float(self.power_w(speed)))

    def range_speed_m_s(self) -> float:
        """Return the speed at which a battery reaches furthest, in still air."""
        return _lowest(lambda speed: float(self.power_w(speed)) / max(speed, 1e-9))


def rotor_of(mass_kg: float, efficiency: float = PROPULSIVE_EFFICIENCY) -> RotaryWing:
    """Return the published rotor scaled to a take-off mass at the same load on its disc.

    Parameters
    ----------
    mass_kg
        Positive.
    efficiency
        Power at the rotor over power from the battery.
    """
    published = RotaryWing()
    weight_n = mass_kg * GRAVITY_M_S2
    disc_area_m2 = published.disc_area_m2 * weight_n / published.weight_n
    return RotaryWing(weight_n=weight_n, disc_area_m2=disc_area_m2, efficiency=efficiency)


def _lowest(cost: Callable[[float], float]) -> float:
    """Return where a function with one valley between 0 and `FASTEST_M_S` is lowest, by golden sections."""
    low, high, ratio = 0.0, FASTEST_M_S, (sqrt(5) - 1) / 2
    while high - low > 1e-6:
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if cost(left) <= cost(right):
            high = right
        else:
            low = left
    return (low + high) / 2
