"""P2.1 by successive convex approximation: move a stop so that the users round it get more, section 5, (13) to (17).

log2(1 + γ0·s^(−α/2)) is convex in s = H² + ‖w − w_g‖², so its tangent at the present stop bounds it from below. The
sum of the tangents is a concave quadratic, P2.2: maximised over the discs of radius R round the users it gives the
next stop, and the sum rate never falls.
"""

import warnings
from collections.abc import Callable

import numpy as np

from mavplan.planners.discs import project_on_discs
from mavplan.planners.geometry import nearest_of
from mavplan.radio import Channel
from mavplan.scenario.model import Floats

GAIN_TOLERANCE = 1e-9
"""In bit/s/Hz; an iteration that gains less is the last."""

MOST_ITERATIONS = 500

MAGNIFICATIONS = (1, 1000, 1000)
"""CVXPY solves a step this often, in units of R over these numbers: together good to 1e-7 m."""

Step = Callable[[Floats, Floats, Channel], Floats]
"""(stop (2,), users (G, 2), channel) → the maximiser of P2.2, (2,)."""


def tangent_slopes(stop_m: Floats, users_m: Floats, channel: Channel) -> Floats:
    """Return (G,) B_g = (α/2)·γ0·log2(e) / (s_l·(s_l^(α/2) + γ0)), the falling slope of each rate in s at the stop."""
    half_exponent = channel.radio.path_loss_exponent / 2
    offset = users_m - stop_m
    s = channel.altitude_m**2 + np.einsum("ij,ij->i", offset, offset)
    slopes: Floats = (
        half_exponent * channel.gamma0 * np.log2(np.e) / (s * (s**half_exponent + channel.gamma0))
    )
    return slopes


def closed_form_step(stop_m: Floats, users_m: Floats, channel: Channel) -> Floats:
    """Return the maximiser of P2.2 without a solver.

    Σ B_g·‖w − w_g‖² = (Σ B_g)·‖w − c‖² + const with c = Σ B_g·w_g / Σ B_g, so the maximiser is the projection of the
    weighted centroid c onto the intersection of the discs of radius R round the users.
    """
    slopes = tangent_slopes(stop_m, users_m, channel)
    return project_on_discs(slopes @ users_m / slopes.sum(), users_m, disc_radius_m(stop_m, users_m, channel))


def disc_radius_m(stop_m: Floats, users_m: Floats, channel: Channel) -> float:
    """Return R, or the distance of a user that counts as within R and is a rounding beyond: the stop stays feasible."""
    return max(channel.radius_m, float(np.linalg.norm(users_m - stop_m, axis=1).max()))


def cvxpy_step(stop_m: Floats, users_m: Floats, channel: Channel) -> Floats:
    """Return the maximiser of P2.2 as the paper solves it, by a convex solver: the reference of the closed form."""
    slopes = tangent_slopes(stop_m, users_m, channel)
    weights = slopes / slopes.mean()
    radius_m = disc_radius_m(stop_m, users_m, channel)
    # An interior point ends within the square root of its tolerance where a disc is only just touched. So again
    # through a magnifying glass, round the answer before.
    found = stop_m
    for magnification in MAGNIFICATIONS:
        found = _solve_p22(found, radius_m / magnification, users_m, weights, radius_m)
    return found


def _solve_p22(origin_m: Floats, unit_m: float, users_m: Floats, weights: Floats, radius_m: float) -> Floats:
    """Solve P2.2 by CVXPY and Clarabel in coordinates round ``origin_m`` in units of ``unit_m``."""
    import cvxpy as cp

    places = (users_m - origin_m) / unit_m
    reach = radius_m / unit_m
    move, square = cp.Variable(2), cp.Variable()
    # ‖move − p‖² multiplied out everywhere: constants, which would drown the rest, drop out of the objective and are
    # taken together in the discs, where numbers near one remain. The square is tight, as all want it small.
    pull = weights @ places / weights.sum()
    slack = (reach**2 - np.einsum("ij,ij->i", places, places)) / (2 * reach)
    discs = square / (2 * reach) - (places / reach) @ move <= slack
    problem = cp.Problem(cp.Minimize(square - 2 * (pull @ move)), [cp.sum_squares(move) <= square, discs])
    with warnings.catch_warnings():
        # More digits are asked for than the solver vouches for.
        warnings.filterwarnings("ignore", message="Solution may be inaccurate")
        problem.solve(solver=cp.CLARABEL, tol_gap_abs=1e-14, tol_gap_rel=1e-14, tol_feas=1e-12)
    if move.value is None:
        raise ArithmeticError(f"P2.2: {problem.status}")
    found: Floats = origin_m + unit_m * move.value
    return found


STEPS: dict[str, Step] = {"closed-form": closed_form_step, "cvxpy": cvxpy_step}


def sum_rate(stop_m: Floats, users_m: Floats, channel: Channel) -> float:
    """Return Σ log2(1 + γ) of the users at this stop in bit/s/Hz, the objective of P2.1."""
    return float(channel.air_rate(np.linalg.norm(users_m - stop_m, axis=1)).sum())


def improve_stop(stop_m: Floats, users_m: Floats, channel: Channel, step: Step) -> Floats:
    """Return the stop (2,) where SCA ends; all users (G, 2) stay within R of it, and their sum rate never falls."""
    rate = sum_rate(stop_m, users_m, channel)
    for _ in range(MOST_ITERATIONS):
        moved = step(stop_m, users_m, channel)
        moved_rate = sum_rate(moved, users_m, channel)
        gain = moved_rate - rate
        if gain <= 0.0:
            break
        stop_m, rate = moved, moved_rate
        if gain < GAIN_TOLERANCE:
            break
    return stop_m


def improve_stops(stops_m: Floats, xy_m: Floats, channel: Channel, step: Step) -> Floats:
    """Return (K, 2) stops, each moved by SCA for the users G_i that are nearest to it and within R.

    A stop without such users stays where it is.

    Parameters
    ----------
    stops_m
        (K, 2) stops of the clustering phase.
    xy_m
        (N, 2) users.
    """
    distance_m, nearest = nearest_of(xy_m, stops_m)
    reached = channel.reaches(distance_m)
    improved = stops_m.copy()
    for index, stop in enumerate(stops_m):
        own = xy_m[reached & (nearest == index)]
        if len(own):
            improved[index] = improve_stop(stop, own, channel, step)
    return improved
