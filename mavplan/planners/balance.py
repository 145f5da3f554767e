"""P3 of section 6: the stop for one user where rate over detour is greatest.

ρ_a = (γ_g/υ_b)/(L_pq/μ_b), (19) to (21): the benchmark's figures υ_b and μ_b scale it and do not move its maximum,
so they do not appear here.
"""

import math
from typing import Any

import numpy as np

from mavplan.planners.selection import PlaceStop
from mavplan.radio import Channel, spectral_rate
from mavplan.scenario.model import Floats

STARTS_ROUND = 16
STARTS_OUT = 8
"""Starting points: this many directions times this many distances from the user, and those of SPSS."""


def balance_at(
    stops_m: Floats, user_m: Floats, left_m: Floats, right_m: Floats | None, channel: Channel
) -> Floats:
    """Return log2(1 + γ_g)/L_pq in bit/s/Hz/m for stops (..., 2) that serve one user between two neighbours.

    At the free end, ``right_m`` None, L_pq is the way to the one neighbour.
    """
    offset = stops_m - user_m
    squared = channel.altitude_m**2 + (offset**2).sum(axis=-1)
    detour_m = np.linalg.norm(stops_m - left_m, axis=-1)
    if right_m is not None:
        detour_m = detour_m + np.linalg.norm(stops_m - right_m, axis=-1)
    rate = spectral_rate(squared, channel.gamma0, channel.radio.path_loss_exponent)
    # A stop on its only neighbour would cost no way at all.
    balance: Floats = np.divide(rate, detour_m, out=np.full_like(rate, np.inf), where=detour_m > 0)
    return balance


def best_balance(channel: Channel) -> PlaceStop:
    """Return a function that solves P3 for one user: several starts, the best of them improved, never made worse."""
    radius_m = channel.radius_m
    angles = np.linspace(0.0, 2 * math.pi, STARTS_ROUND, endpoint=False)
    distances = np.linspace(0.0, radius_m, STARTS_OUT)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    starts_around = (distances[:, None, None] * ring).reshape(-1, 2)

    def place(user_m: Floats, left_m: Floats, right_m: Floats | None) -> Floats:
        starts = user_m + starts_around
        values = balance_at(starts, user_m, left_m, right_m, channel)
        best = starts[int(values.argmax())]
        return _climb(best, user_m, left_m, right_m, channel)

    return place


def _climb(
    start_m: Floats, user_m: Floats, left_m: Floats, right_m: Floats | None, channel: Channel
) -> Floats:
    """Return a local maximum of P3 in the disc, at least as good as ``start_m``: SLSQP in units of R."""
    from scipy import optimize

    radius_m = channel.radius_m
    first = float(balance_at(start_m, user_m, left_m, right_m, channel))
    if not math.isfinite(first):
        return start_m

    def loss(move: Floats) -> float:
        stop = user_m + radius_m * move
        return -float(balance_at(stop, user_m, left_m, right_m, channel)) / first

    minimize: Any = optimize.minimize  # its stubs want arguments that SLSQP leaves out
    found = minimize(
        loss,
        (start_m - user_m) / radius_m,
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda move: 1.0 - move @ move, "jac": lambda move: -2.0 * move},
        options={"ftol": 1e-12, "maxiter": 100},
    )
    move = found.x / max(1.0, float(np.linalg.norm(found.x)))
    stop: Floats = user_m + radius_m * move
    return stop if loss(move) < -1.0 else start_m
