"""P3 of section 6: the stop for one user where rate over detour is greatest.

ρ_a = (γ_g/υ_b)/(L_pq/μ_b), (19) to (21): the benchmark's figures υ_b and μ_b scale it and do not move its maximum,
so they do not appear here.
"""

import math
from typing import Any

import numpy as np

from mavplan.planners.selection import Place, PlaceStop, nearest_to_reference
from mavplan.radio import Channel, spectral_rate
from mavplan.scenario.model import Floats

STARTS_ROUND = 16
STARTS_OUT = 8
"""Starting points: the user's own place, this many directions times this many distances from it, and SPSS's stop."""


def balance_at(stops_m: Floats, where: Place, channel: Channel) -> Floats:
    """Return log2(1 + γ_g)/L_pq in bit/s/Hz/m for stops (..., 2) that serve one user between two neighbours.

    At the free end L_pq is the way to the one neighbour.
    """
    squared = channel.altitude_m**2 + ((stops_m - where.user_m) ** 2).sum(axis=-1)
    detour_m = np.linalg.norm(stops_m - where.left_m, axis=-1)
    if where.right_m is not None:
        detour_m = detour_m + np.linalg.norm(stops_m - where.right_m, axis=-1)
    rate = spectral_rate(squared, channel.gamma0, channel.radio.path_loss_exponent)
    # A stop on its only neighbour would cost no way at all.
    balance: Floats = np.divide(rate, detour_m, out=np.full_like(rate, np.inf), where=detour_m > 0)
    return balance


def best_balance(channel: Channel) -> PlaceStop:
    """Return a function that solves P3 for one user: climbs from several starts, never worse than the best of them."""
    angles = np.linspace(0.0, 2 * math.pi, STARTS_ROUND, endpoint=False)
    distances = channel.radius_m * np.arange(1, STARTS_OUT + 1) / STARTS_OUT
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    around = np.vstack([np.zeros(2), (distances[:, None, None] * ring).reshape(-1, 2)])
    as_spss = nearest_to_reference(channel)

    def place(where: Place) -> Floats:
        starts = where.user_m + around
        from_grid = starts[int(balance_at(starts, where, channel).argmax())]
        # Where a neighbour lies just beyond R the peak is narrower than the grid; SPSS's stop is at its foot.
        climbed = np.stack([_climb(start, where, channel) for start in (from_grid, as_spss(where))])
        best: Floats = climbed[int(balance_at(climbed, where, channel).argmax())]
        return best

    return place


def _climb(start_m: Floats, where: Place, channel: Channel) -> Floats:
    """Return a local maximum of P3 in the disc, at least as good as ``start_m``: SLSQP in units of R."""
    from scipy import optimize

    radius_m = channel.radius_m
    first = float(balance_at(start_m, where, channel))
    if not math.isfinite(first):
        return start_m

    def loss(move: Floats) -> float:
        return -float(balance_at(where.user_m + radius_m * move, where, channel)) / first

    minimize: Any = optimize.minimize  # its stubs want arguments that SLSQP leaves out
    found = minimize(
        loss,
        (start_m - where.user_m) / radius_m,
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda move: 1.0 - move @ move, "jac": lambda move: -2.0 * move},
        options={"ftol": 1e-12, "maxiter": 100},
    )
    move = found.x / max(1.0, float(np.linalg.norm(found.x)))
    stop: Floats = where.user_m + radius_m * move
    return stop if loss(move) < -1.0 else start_m
