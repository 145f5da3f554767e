"""The regime in which plans are measured against the paper's planners: users, channel, and their numbers of clusters.

Users HPPP over 2 km × 2 km, home at a corner; R 300 m from 100 m, threshold 0 dB, 1 MHz, no D2D.
"""

import numpy as np

from mavplan.hppp import SIDE_M, draw_users
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio, Users

DENSITIES = {16: (3, 5, 7), 60: (8, 12, 16)}
"""Mean number of users, and the paper's planners' numbers of clusters."""

RADIUS_M, ALTITUDE_M = 300.0, 100.0


def regime_channel(radius_m: float = RADIUS_M) -> Channel:
    """Return a channel of threshold 0 dB that covers this radius from 100 m."""
    link_db = 10.0 * np.log10(radius_m**2 + ALTITUDE_M**2)
    radio = Radio(
        tx_power_dbm=20.0,
        ref_gain_db=-50.0,
        noise_dbm=-30.0 - link_db,
        path_loss_exponent=2.0,
        snr_threshold_db=0.0,
        bandwidth_hz=1e6,
    )
    return Channel(radio, ALTITUDE_M, D2D(matching="none"))


def regime_users(mean: int, seed: int, demand_mbit: float = 0.0) -> Users:
    """Return a draw of users, positions in metres alone, each with this demand."""
    xy_m, mate = draw_users(mean, SIDE_M, seed=seed)
    nowhere = np.zeros(len(xy_m))
    demand_bit = np.full(len(xy_m), demand_mbit * 1e6)
    return Users(tuple(map(str, range(len(xy_m)))), nowhere, nowhere, xy_m, demand_bit, mate)
