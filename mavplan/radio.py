"""The channel between vehicle and ground, and between users: equations (1) to (4) of the paper.

Pure functions on arrays. Decibels end here: everything else computes with linear ratios.

S. Zhang et al., "Trajectory planning in UAV emergency networks with potential underlaying D2D communication based
on K-means", EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3, section 2.
"""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.scenario.sections import D2D, Radio, Service, Vehicle

if TYPE_CHECKING:
    from mavplan.scenario.model import Scenario

Floats = NDArray[np.float64]

REACH_TOLERANCE_M = 1e-6
"""A user this far beyond R counts as reached: stops are placed at exactly R, and arithmetic rounds."""

D2D_MIN_DISTANCE_M = 1.0
"""The gain is defined at 1 m; closer phones do not hear each other any better."""


def db_to_ratio(value_db: float) -> float:
    """Return the linear ratio of a figure in decibels."""
    return math.exp(value_db * math.log(10.0) / 10.0)


def reference_snr(radio: Radio | D2D, noise_dbm: float) -> float:
    """Return γ0 = P·β0/σ², the signal-to-noise ratio at 1 m, linear (equation (3))."""
    return db_to_ratio(radio.tx_power_dbm + radio.ref_gain_db - noise_dbm)


def coverage_radius_m(radio: Radio, altitude_m: float, position_error_m: float = 0.0) -> float:
    """Return R, the ground distance at which the SNR falls to the threshold; 0 where nobody is reached.

    Equation (4): R = sqrt((γ0/γ_th)^(2/α) − H²), the slant distance less what the vehicle may be off its place.
    """
    slant_m = highest_altitude_m(radio) - position_error_m
    return math.sqrt(max(slant_m**2 - altitude_m**2, 0.0)) if slant_m > 0 else 0.0


def highest_altitude_m(radio: Radio) -> float:
    """Return the altitude below which the coverage radius is positive, in metres: (γ0/γ_th)^(1/α)."""
    snr = reference_snr(radio, radio.noise_dbm) / db_to_ratio(radio.snr_threshold_db)
    return math.exp(math.log(snr) / radio.path_loss_exponent)


def spectral_rate(distance_squared_m2: Floats, gamma0: float, exponent: float) -> Floats:
    """Return log2(1 + γ0/d^α) in bit/s/Hz for squared slant distances of any shape (equations (1) to (3))."""
    return np.log2(1.0 + gamma0 * distance_squared_m2 ** (-exponent / 2.0))


class Channel:
    """The channel of one scenario: a radio at an altitude, and the links between users.

    Parameters
    ----------
    radio
        The vehicle's radio.
    altitude_m
        Height H of the vehicle above the plane of the users.
    d2d
        The links between users; their noise and bandwidth are the radio's.
    position_error_m
        How far off its place, in any direction, the vehicle may be: reach and rates are those from the worst place in
        that ball, so that what is planned is kept wherever in it the vehicle hovers. The paper has none.
    d2d_error_m
        How much further apart than they should be two mates may be.

    Attributes
    ----------
    gamma0
        γ0 of the air link, linear.
    radius_m
        Coverage radius R.
    """

    def __init__(
        self,
        radio: Radio,
        altitude_m: float,
        d2d: D2D,
        position_error_m: float = 0.0,
        d2d_error_m: float = 0.0,
    ) -> None:
        self.radio = radio
        self.d2d = d2d
        self.altitude_m = altitude_m
        self.gamma0 = reference_snr(radio, radio.noise_dbm)
        self.position_error_m = position_error_m
        self.d2d_error_m = d2d_error_m
        self.radius_m = coverage_radius_m(radio, altitude_m, position_error_m)
        self._d2d_gamma0 = reference_snr(d2d, radio.noise_dbm)

    def reaches(self, ground_distance_m: Floats) -> NDArray[np.bool_]:
        """Return which ground distances lie within R."""
        return ground_distance_m <= self.radius_m + REACH_TOLERANCE_M

    def air_rate(self, ground_distance_m: Floats) -> Floats:
        """Return log2(1+γ) in bit/s/Hz at these ground distances, also beyond R."""
        slant_m = np.hypot(self.altitude_m, ground_distance_m) + self.position_error_m
        return spectral_rate(slant_m**2, self.gamma0, self.radio.path_loss_exponent)

    def d2d_rate(self, distance_m: Floats) -> Floats:
        """Return log2(1+γ) in bit/s/Hz between users this far apart; infinite for an ideal link."""
        if self.d2d.link == "ideal":
            return np.full(np.shape(distance_m), np.inf)
        squared = np.maximum(distance_m + self.d2d_error_m, D2D_MIN_DISTANCE_M) ** 2
        return spectral_rate(squared, self._d2d_gamma0, self.d2d.path_loss_exponent)


def planning_radio(radio: Radio) -> Radio:
    """Return the radio that is planned with: what the fade margin keeps is taken from its power."""
    return replace(radio, tx_power_dbm=radio.tx_power_dbm - radio.fade_margin_db, fade_margin_db=0.0)


def planning_error_m(vehicle: Vehicle, service: Service) -> float:
    """Return how much further from a user the vehicle may be than planned.

    The vehicle's drift, by the scenario or as its autopilot was measured, and how far users may be from their places.
    """
    drift_m = vehicle.position_error_m
    if drift_m is None:
        drift_m = AUTOPILOTS[vehicle.autopilot].hover_error_m
    return drift_m + service.user_error_m


def planning_channel(scenario: "Scenario") -> Channel:
    """Return the channel that a scenario is planned with: what is reached in it is reached with all margins used up."""
    return Channel(
        planning_radio(scenario.radio),
        scenario.vehicle.altitude_m,
        scenario.d2d,
        planning_error_m(scenario.vehicle, scenario.service),
        2 * scenario.service.user_error_m,
    )
