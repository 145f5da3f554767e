"""The power a multirotor needs in the air.

Y. Zeng, J. Xu, R. Zhang, "Energy Minimization for Wireless Communication With Rotary-Wing UAV", IEEE Transactions on
Wireless Communications 18(4), 2019, doi:10.1109/TWC.2019.2902559: equation (12) and the values of its table I.
"""

import math

REFERENCE_WEIGHT_N = 20.0
REFERENCE_MASS_KG = REFERENCE_WEIGHT_N / 9.80665
BLADE_W = 79.86
"""P0, blade profile power in hover."""
INDUCED_W = 88.63
"""Pi, induced power in hover."""
TIP_M_S = 120.0
HOVER_INDUCED_M_S = 4.03
"""v0, mean induced velocity in hover."""
DRAG_RATIO, AIR_KG_M3, SOLIDITY, DISC_M2 = 0.6, 1.225, 0.05, 0.503
EFFICIENCY = 0.7
"""From battery to rotor: motors, speed controllers, wiring. An assumption, not of the paper."""


def rotor_w(airspeed_m_s: float, climb_m_s: float = 0.0) -> float:
    """Return the mechanical power of the paper's vehicle.

    Parameters
    ----------
    airspeed_m_s
        Level, through the air.
    climb_m_s
        Upwards. By momentum theory the air goes through the rotor at Vc/2 + √((Vc/2)² + v0²): the climb adds weight
        times Vc, and the rest of it is the induced velocity, smaller than in hover. A descent counts as level flight.
    """
    v, v0 = airspeed_m_s, HOVER_INDUCED_M_S
    ratio = v * v / (2 * v0 * v0)
    blade = BLADE_W * (1 + 3 * v * v / TIP_M_S**2)
    induced = INDUCED_W * math.sqrt(math.sqrt(1 + ratio * ratio) - ratio)
    parasite = 0.5 * DRAG_RATIO * AIR_KG_M3 * SOLIDITY * DISC_M2 * v**3
    climb = 0.0
    if climb_m_s > 0:
        half = climb_m_s / 2
        induced *= (math.sqrt(half * half + v0 * v0) - half) / v0
        climb = REFERENCE_WEIGHT_N * climb_m_s
    return blade + induced + parasite + climb


def electric_w(mass_kg: float, airspeed_m_s: float, climb_m_s: float = 0.0) -> float:
    """Return what the battery gives; power goes with mass, as it does for rotors of the same disc loading."""
    return rotor_w(airspeed_m_s, climb_m_s) * mass_kg / REFERENCE_MASS_KG / EFFICIENCY
