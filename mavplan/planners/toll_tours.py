"""Paths through given places in a given order that pay by the metre and a toll for how far from each they stay.

min over p_1 … p_K of Σ_i w_i·‖p_i − p_{i−1}‖ + Σ_i a_i·ĝ(‖p_i − c_i‖), p_0 the start, ‖p_i − c_i‖ ≤ R, ĝ a
convex curve that rises with distance. Its dual has a vector u_i with ‖u_i‖ ≤ w_i for each leg, and *any* such vectors
prove

    cost ≥ −u_1·start (+ u_L·end) + Σ_i min_p [(u_i − u_{i+1})·p + a_i·ĝ(‖p − c_i‖)],

u_{K+1} = 0 where the end is free; each term is g·c_i − max_δ [‖g‖·δ − a_i·ĝ(δ)], g = u_i − u_{i+1}. So the bound holds
whatever iteration it comes from. Many tours are solved side by side by the primal-dual method of A. Chambolle and T.
Pock, "A first-order primal-dual algorithm for convex problems", J. Math. Imaging Vision 40, 2011,
doi 10.1007/s10851-010-0251-1.
"""

from dataclasses import dataclass, replace

import numpy as np

from mavplan.planners.toll_curve import Curve
from mavplan.scenario.model import Floats, Ints

STRIDE = 0.66
"""Step in place over step in the dual, in units of R over the weight of a metre."""

NEWTON = 2
"""Steps towards the place that a toll and a pull hold in balance; each iteration goes on from the last."""

_FINE = 1500


@dataclass(frozen=True, eq=False)
class Tours:
    """B tours through K places.

    Attributes
    ----------
    points_m
        (B, K, 2) places near the optimum.
    duals
        (B, L, 2) vectors no longer than the weights of their legs.
    bound
        (B,) what these prove.
    """

    points_m: Floats
    duals: Floats
    bound: Floats


@dataclass(frozen=True, eq=False)
class Tolls:
    """B problems; the start is the origin, and so is the end where there is one.

    Attributes
    ----------
    centres_m
        (B, K, 2).
    weights
        (B, K) a_i; negative: the place is the origin itself and only fills the tour up.
    leg_cost, end_cost
        Of a metre, and of a metre of the last leg; None where the end is free.
    curve
        ĝ.
    """

    centres_m: Floats
    weights: Floats
    leg_cost: float
    end_cost: float | None
    curve: Curve

    def part(self, rows: Ints) -> "Tolls":
        """Return some of the problems."""
        return replace(self, centres_m=self.centres_m[rows], weights=self.weights[rows])

    def bound(self, duals: Floats) -> Floats:
        """Return (B,) what dual vectors (B, L, 2) prove."""
        places = self.centres_m.shape[1]
        turns = duals[:, :places].copy()
        turns[:, : duals.shape[1] - 1] -= duals[:, 1:]
        pull = np.sqrt((turns**2).sum(axis=2))
        filled = self.weights < 0
        spared = np.where(filled, 0.0, self.curve.conjugate(pull, np.maximum(self.weights, 0.0)))
        return np.asarray(((turns * self.centres_m).sum(axis=2) - spared).sum(axis=1))


def solve_tours(tolls: Tolls, points_m: Floats, duals: Floats, iterations: int) -> Tours:
    """Improve tours from points (B, K, 2) and duals (B, L, 2) by a number of iterations."""
    centres, curve = tolls.centres_m, tolls.curve
    places = centres.shape[1]
    filled = tolls.weights < 0
    radius = np.where(filled, 0.0, curve.radius_m)
    weights = np.maximum(tolls.weights, 0.0)
    most = np.full(duals.shape[1], tolls.leg_cost)
    if tolls.end_cost is not None:
        most[-1] = tolls.end_cost
    scale = STRIDE * curve.radius_m / tolls.leg_cost
    # ‖D‖² ≤ 4 for differences along a path.
    step, dual_step = 0.49 * scale, 0.49 / scale
    slope = _Slope.of(curve)
    points, duals = points_m.copy(), duals.copy()
    ahead, away = points.copy(), np.minimum(np.sqrt(((points - centres) ** 2).sum(axis=2)), radius)
    for _ in range(iterations):
        duals[:, :places] += dual_step * ahead
        duals[:, 1 : places + 1] -= dual_step * ahead[:, : duals.shape[1] - 1]
        length = np.sqrt((duals**2).sum(axis=2))
        duals *= np.minimum(1.0, most / np.maximum(length, 1e-300))[:, :, None]
        turns = duals[:, :places].copy()
        turns[:, : duals.shape[1] - 1] -= duals[:, 1:]
        beside = points - step * turns - centres
        pulled = np.sqrt((beside**2).sum(axis=2))
        away = slope.balance(pulled, step * weights, np.minimum(away, pulled), radius)
        moved = centres + beside * (away / np.maximum(pulled, 1e-12))[:, :, None]
        ahead = 2 * moved - points
        points = moved
    return Tours(points, duals, tolls.bound(duals))


@dataclass(frozen=True, eq=False)
class _Slope:
    """The derivative of a smooth curve near ĝ on an even grid, for the primal steps alone: no proof rests on it."""

    cells_by_m: float
    slope: Floats
    rise: Floats

    @classmethod
    def of(cls, curve: Curve) -> "_Slope":
        grid = np.linspace(0.0, curve.radius_m, _FINE + 1)
        # ĝ begins with a level piece, from which Newton's method would leap: it is passed over.
        middles = np.concatenate([[0.0], ((curve.knots_m[1:] + curve.knots_m[:-1]) / 2)[1:]])
        slope = np.interp(grid, middles, np.concatenate([[0.0], curve.slopes[1:]]))
        return cls(_FINE / curve.radius_m, slope, np.diff(slope) * _FINE / curve.radius_m)

    def balance(self, pulled: Floats, weight: Floats, first: Floats, radius: Floats) -> Floats:
        """Return δ in 0 … radius near which δ + weight·ĝ'(δ) = pulled."""
        away = first
        for _ in range(NEWTON):
            cell = np.minimum((away * self.cells_by_m).astype(np.int64), _FINE - 1)
            rise = self.rise[cell]
            slope = self.slope[cell] + rise * (away - cell / self.cells_by_m)
            away = np.clip(away - (away + weight * slope - pulled) / (1 + weight * rise), 0.0, radius)
        return away
