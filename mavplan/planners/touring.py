"""Touring discs in a fixed order: the shortest path that touches each of them, with a lower bound from its dual.

min Σ ‖x_i − x_{i−1}‖ subject to ‖x_i − c_i‖ ≤ R, x_0 the start; the path ends at x_K, or at a given place: a convex
second-order cone programme. Its dual has a vector u_i with ‖u_i‖ ≤ 1 for each leg, and *any* such vectors prove

    length ≥ Σ_i [c_i·(u_i − u_{i+1}) − R·‖u_i − u_{i+1}‖] − u_1·start (+ u_L·end),

u_{K+1} = 0 where the end is free: each disc's term is the least of x·(u_i − u_{i+1}) over it. So the bound holds
whatever iteration it comes from. Bounds are those of discs as wide as `Channel.reaches` takes them.

Many paths with the same number of discs are solved side by side, by a primal-dual interior point with predictor and
corrector (S. Mehrotra, "On the implementation of a primal-dual interior point method", SIAM J. Optimization 2, 1992,
doi 10.1137/0802028) in the scaling of Nesterov and Todd; the Newton systems are block tridiagonal. Both sides stay
feasible throughout.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.planners.block_tridiagonal import factored
from mavplan.planners.cones import Scaling, longest_step, product, quotient
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario.model import Bools, Floats, Ints

MOST_ITERATIONS = 40
"""Seven to ten are usual."""

MARGIN = 0.98
"""Share of the way to the border of the cones that a step goes."""

FIRST_SLACK = 0.3
"""Distance from the borders at the beginning, in radii."""


@dataclass(frozen=True, eq=False)
class Tours:
    """B shortest paths through K discs each, to the precision asked for.

    Attributes
    ----------
    points_m
        (B, K, 2) where each disc is touched, inside it.
    length_m
        (B,) length of the path from its start through the points, to its end if it has one: an upper bound.
    bound_m
        (B,) no path that touches these discs in this order is shorter.
    duals
        (B, L, 2) the unit-ball vectors that prove it, one for each leg.
    """

    points_m: Floats
    length_m: Floats
    bound_m: Floats
    duals: Floats

    def rows(self, which: Ints) -> "Tours":
        """Return these problems alone."""
        return Tours(self.points_m[which], self.length_m[which], self.bound_m[which], self.duals[which])

    def put(self, which: Ints, others: "Tours") -> None:
        """Put others in place of these problems."""
        self.points_m[which], self.length_m[which] = others.points_m, others.length_m
        self.bound_m[which], self.duals[which] = others.bound_m, others.duals


def tour_discs(
    centres_m: Floats,
    radius_m: float,
    start_m: Floats,
    end_m: Floats | None = None,
    *,
    precision: float = 1e-7,
    loose: float | None = None,
    cutoff_m: float = np.inf,
) -> Tours:
    """Solve B problems with K ≥ 1 discs each.

    Parameters
    ----------
    centres_m
        (B, K, 2) centres in the order in which the discs are touched.
    radius_m
        R, greater than 0.
    start_m, end_m
        (2,) or (B, 2) where the paths begin and end; without an end each path ends on its last disc.
    precision
        Wanted of (length − bound)/(length + R).
    loose
        Precision that will do where the length is below ``cutoff_m``.
    cutoff_m
        A problem whose bound reaches this is left there.
    """
    batch, discs = centres_m.shape[:2]
    to_columns = np.ascontiguousarray(np.moveaxis(centres_m, (0, 1, 2), (2, 1, 0)) / radius_m)
    start = np.broadcast_to(start_m / radius_m, (batch, 2)).T
    end = None if end_m is None else np.broadcast_to(end_m / radius_m, (batch, 2)).T
    solver = _InteriorPoint(to_columns, start, end, 1.0 + REACH_TOLERANCE_M / radius_m)
    legs = discs + (end is not None)
    points, duals = np.empty((2, discs, batch)), np.empty((2, legs, batch))
    length, bound = np.empty(batch), np.empty(batch)
    cutoff = cutoff_m / radius_m
    loose = precision if loose is None else max(loose, precision)
    with np.errstate(all="ignore"):
        for iteration in range(MOST_ITERATIONS):
            gap = solver.length - solver.bound
            scale = solver.length + 1.0
            done = (gap <= precision * scale) | (solver.bound >= cutoff) | solver.stuck
            done |= (solver.length < cutoff) & (gap <= loose * scale)
            if iteration == MOST_ITERATIONS - 1:
                done[:] = True
            if done.any():
                at = solver.index[done]
                points[:, :, at], duals[:, :, at] = solver.points[:, :, done], solver.duals[:, :, done]
                length[at], bound[at] = solver.length[done], solver.bound[done]
                if done.all():
                    break
                solver.keep(~done)
            solver.step()
    return Tours(
        points_m=np.ascontiguousarray(np.moveaxis(points, (0, 1, 2), (2, 1, 0))) * radius_m,
        length_m=length * radius_m,
        bound_m=bound * radius_m,
        duals=np.ascontiguousarray(np.moveaxis(duals, (0, 1, 2), (2, 1, 0))),
    )


def turns_of(duals: Floats, discs: int) -> Floats:
    """Return (K, 2) the u_i − u_{i+1} of K discs; their lengths are the multipliers of the discs."""
    turns = duals[:discs].copy()
    turns[: len(duals) - 1] -= duals[1:]
    return turns


def dual_bound_m(
    centres_m: Floats, radius_m: float, start_m: Floats, end_m: Floats | None, duals: Floats
) -> float:
    """Return the lower bound that unit-ball vectors (L, 2) prove for one sequence of discs (K, 2)."""
    turns = turns_of(duals, len(centres_m))
    reach_m = radius_m + REACH_TOLERANCE_M
    bound = float((turns * centres_m).sum() - reach_m * np.linalg.norm(turns, axis=1).sum())
    bound -= float(duals[0] @ start_m)
    return bound if end_m is None else bound + float(duals[-1] @ end_m)


class _InteriorPoint:
    """Iterates of the problems that still run, in radii; columns are problems.

    Cones, in this order: K discs with s = (1, x − c) and z = (λ, w), then L legs with s = (t, x_i − x_{i−1}) and
    z = (1, −u). w = u_i − u_{i+1} holds exactly, and so does x on both sides.
    """

    def __init__(self, centres: Floats, start: Floats, end: Floats | None, reach: float) -> None:
        _, self.discs, batch = centres.shape
        self.legs = self.discs + (end is not None)
        self.index: Ints = np.arange(batch)
        self.centres, self.start, self.end, self._reach = centres, start, end, reach
        self.stuck: Bools = np.zeros(batch, dtype=np.bool_)
        self.length: Floats = np.empty(batch)
        self.bound: Floats = np.empty(batch)
        self.points = centres.copy()
        self._s = np.empty((3, self.discs + self.legs, batch))
        self._z = np.empty_like(self._s)
        differences = self._differences(self.points)
        differences[:, 0] -= start
        if end is not None:
            differences[:, -1] += end
        t = FIRST_SLACK + np.sqrt((differences**2).sum(axis=0) + FIRST_SLACK**2)
        self.duals = differences / t
        self._s[0, : self.discs], self._s[0, self.discs :] = 1.0, t
        self._z[0, self.discs :] = 1.0
        self._settle()
        w = self._z[1:, : self.discs]
        self._z[0, : self.discs] = FIRST_SLACK + np.sqrt((w**2).sum(axis=0) + FIRST_SLACK**2)

    def keep(self, which: Bools) -> None:
        """Go on with these problems only."""
        self.index, self.stuck = self.index[which], self.stuck[which]
        self.length, self.bound = self.length[which], self.bound[which]
        self.centres, self.start = self.centres[:, :, which], self.start[:, which]
        self.points, self.duals = self.points[:, :, which], self.duals[:, :, which]
        self._s, self._z = self._s[:, :, which], self._z[:, :, which]
        if self.end is not None:
            self.end = self.end[:, which]

    def step(self) -> None:
        """Take one step of predictor and corrector; a problem that arithmetic ends for stays as it was."""
        s, z, discs = self._s, self._z, self.discs
        scaling = Scaling.of(s, z)
        system = _Newton(scaling, discs, self.legs)
        _, ds, dz = self._direction(system, -z)
        primal, dual = longest_step(s, ds).min(axis=0), longest_step(z, dz).min(axis=0)
        centring = (1.0 - np.minimum(np.minimum(primal, dual), 1.0)) ** 3
        complementarity = (s * z).sum(axis=(0, 1)) / s.shape[1]
        target = -product(scaling.inverse_times(ds), scaling.times(dz))
        target[0] += centring * complementarity
        corrected = scaling.inverse_times(quotient(scaling.times(z), target)) - z
        dx, ds, dz = self._direction(system, corrected)
        primal = np.minimum(MARGIN * longest_step(s, ds).min(axis=0), 1.0)
        dual = np.minimum(MARGIN * longest_step(z, dz).min(axis=0), 1.0)
        finite = np.isfinite(dx).all(axis=(0, 1)) & np.isfinite(dz).all(axis=(0, 1))
        self.stuck = np.asarray(~finite | (np.maximum(primal, dual) < 1e-6))
        primal, dual = np.where(self.stuck, 0.0, primal), np.where(self.stuck, 0.0, dual)
        dx, ds, dz = (np.where(self.stuck, 0.0, moved) for moved in (dx, ds, dz))
        self.points = self.points + primal * dx
        self._s, self._z = s + primal * ds, z + dual * dz
        self.duals = -self._z[1:, discs:]
        self._settle()

    def _direction(self, system: "_Newton", right: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the dx, ds = G·dx and dz = right − W⁻²·ds for which Gᵀ·dz = 0; ``right`` is of z's kind."""
        discs = self.discs
        # t of a leg is eliminated: its own row of Gᵀ·dz = 0 gives dt.
        first = right[0, discs:] / system.leg_t
        pull = right[1:, discs:] - system.leg_mixed * first
        dx = system.blocks.solve(right[1:, :discs] + self._gather(pull))
        ds = np.empty_like(right)
        ds[0, :discs], ds[1:, :discs] = 0.0, dx
        ds[1:, discs:] = self._differences(dx)
        ds[0, discs:] = first - (system.leg_mixed * ds[1:, discs:]).sum(axis=0) / system.leg_t
        dz = right - system.scaling.inverse_square_times(ds)
        dz[0, discs:] = 0.0
        return dx, ds, dz

    def _settle(self) -> None:
        """Compute anew what depends linearly on points and duals, and both sides' objectives."""
        discs = self.discs
        self._s[1:, :discs] = self.points - self.centres
        differences = self._differences(self.points)
        differences[:, 0] -= self.start
        if self.end is not None:
            differences[:, -1] += self.end
        self._s[1:, discs:], self._z[1:, discs:] = differences, -self.duals
        w = self._gather(self.duals)
        self._z[1:, :discs] = w
        self.length = np.sqrt((differences**2).sum(axis=0)).sum(axis=0)
        supported = (w * self.centres).sum(axis=0) - self._reach * np.sqrt((w**2).sum(axis=0))
        self.bound = supported.sum(axis=0) - (self.duals[:, 0] * self.start).sum(axis=0)
        if self.end is not None:
            self.bound += (self.duals[:, -1] * self.end).sum(axis=0)

    def _differences(self, points: Floats) -> Floats:
        """Return (2, L, B) the legs between points (2, K, B), start and end in the origin."""
        found = np.empty((2, self.legs, points.shape[2]))
        found[:, : self.discs] = points
        found[:, 1 : self.discs] -= points[:, :-1]
        if self.end is not None:
            found[:, -1] = -points[:, -1]
        return found

    def _gather(self, legs: Floats) -> Floats:
        """Return (2, K, B) the transpose of `_differences`: u_i − u_{i+1}."""
        found = legs[:, : self.discs].copy()
        found[:, : self.legs - 1] -= legs[:, 1:]
        return found


class _Newton:
    """The system of one iteration: GᵀW⁻²G with the legs' t eliminated, factored."""

    def __init__(self, scaling: Scaling, discs: int, legs: int) -> None:
        self.scaling = scaling
        w, inverse_square = scaling.w, scaling.inverse_square
        heading = 2.0 * w[0, discs:] ** 2 - 1.0
        self.leg_t = inverse_square[discs:] * heading
        self.leg_mixed = -2.0 * inverse_square[discs:] * w[0, discs:] * w[1:, discs:]
        leg = _symmetric(inverse_square[discs:], -2.0 / heading, w[1:, discs:])
        diagonal = _symmetric(inverse_square[:discs], np.full_like(w[0, :discs], 2.0), w[1:, :discs])
        diagonal += leg[:, :discs]
        diagonal[:, : legs - 1] += leg[:, 1:]
        self.blocks = factored(diagonal, leg[:, 1:discs])


def _symmetric(scale: Floats, factor: Floats, v: Floats) -> Floats:
    """Return the blocks scale·(I + factor·v·vᵀ) as (3, ...)."""
    weight = scale * factor
    return np.stack((scale + weight * v[0] ** 2, weight * v[0] * v[1], scale + weight * v[1] ** 2))
