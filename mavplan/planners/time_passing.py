"""What users receive from a leg, fast: looked up in a table, for the thousands of legs that a search tries.

A user p metres aside of a leg receives G(x₂, p) − G(x₁, p) between the places x₁ and x₂ along it, counted from abeam;
G(x, p) = ∫₀ˣ share(√(p² + s²)) ds is odd in x and tabulated once for a channel. `mavplan.inflight` integrates
exactly; a plan's holds come from there.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.radio import Channel
from mavplan.scenario.model import Bools, Floats

CELLS = 500
"""Of the table along each axis, from 0 to R: off by less than a thousandth of a second."""

STEEPEST = 30.0
"""Limit to what counts as the slope of a half chord at the border of a disc, where it is infinite."""


@dataclass(frozen=True, eq=False)
class PassTable:
    """G and its slope aside, over distance along and aside.

    Attributes
    ----------
    radius_m
        R.
    along
        (CELLS + 2, CELLS + 2) G at steps of R/CELLS; rows are distances aside.
    aside
        Its derivative by the distance aside.
    edge
        Share of the best rate at R.
    """

    radius_m: float
    along: Floats
    aside: Floats
    edge: float

    @classmethod
    def of(cls, channel: Channel) -> "PassTable":
        """Return the table of a channel."""
        step = channel.radius_m / CELLS
        best = float(channel.air_rate(np.zeros(1))[0])
        places = np.arange(CELLS + 2) * step
        fine = (np.arange(4 * (CELLS + 1)) + 0.5) * step / 4

        def share(distance_m: Floats) -> Floats:
            return channel.air_rate(distance_m) / best

        pieces = share(np.hypot(places[:, None], fine)) * step / 4
        sums = np.cumsum(pieces.reshape(CELLS + 2, CELLS + 1, 4).sum(axis=2), axis=1)
        along = np.concatenate([np.zeros((CELLS + 2, 1)), sums], axis=1)
        aside = np.gradient(along, step, axis=0)
        return cls(channel.radius_m, along, aside, float(share(np.array([channel.radius_m]))[0]))

    def look_up(self, table: Floats, along_m: Floats, aside_m: Floats) -> Floats:
        """Return the values of a table for distances of one shape; odd along, 0 ≤ aside ≤ R."""
        scale = CELLS / self.radius_m
        x, y = np.abs(along_m) * scale, aside_m * scale
        column, row = x.astype(np.int64), y.astype(np.int64)
        x -= column
        y -= row
        flat, at = table.reshape(-1), row * table.shape[1] + column
        near = flat[at] * (1 - x) + flat[at + 1] * x
        at += table.shape[1]
        far = flat[at] * (1 - x) + flat[at + 1] * x
        value: Floats = np.copysign(1.0, along_m) * (near * (1 - y) + far * y)
        return value

    def metres(self, start_m: Floats, end_m: Floats, users_m: Floats) -> Floats:
        """Return (..., N) metres of the best rate that users (N, 2) get from legs (..., 2)."""
        view = _View.of(start_m, end_m, users_m)
        first, last, near = view.chord(self.radius_m)
        found = np.zeros(near.shape)
        aside = view.aside[near]
        found[near] = self.look_up(self.along, last[near], aside) - self.look_up(
            self.along, first[near], aside
        )
        return found

    def slopes(self, start_m: Floats, end_m: Floats, users_m: Floats, share: Floats) -> tuple[Floats, Floats]:
        """Return how these metres change as the ends of L legs move: (L, 2, N) for the starts, and for the ends.

        Parameters
        ----------
        start_m, end_m
            (L, 2) ends of legs.
        users_m
            (N, 2).
        share
            (L + 1, N) shares of the best rate at the starts of the legs and at the last leg's end; the legs follow
            on one another.
        """
        view = _View.of(start_m, end_m, users_m)
        first, last, near = view.chord(self.radius_m)
        half = np.sqrt(np.maximum(self.radius_m**2 - view.aside**2, 0.0))
        starts_in, ends_in = near & (first > -half), near & (last < half)
        at_start, at_end = np.where(starts_in, share[:-1], 0.0), np.where(ends_in, share[1:], 0.0)
        by_abeam = at_start - at_end
        by_length = at_end
        by_aside = np.zeros(near.shape)
        aside = view.aside[near]
        by_aside[near] = self.look_up(self.aside, last[near], aside) - self.look_up(
            self.aside, first[near], aside
        )
        edges = (near & ~ends_in).astype(float) + (near & ~starts_in)
        narrowing = -np.minimum(view.aside / np.maximum(half, 1e-9), STEEPEST)
        by_aside += self.edge * edges * narrowing
        by_cross = np.sign(view.cross) * by_aside
        length = np.maximum(view.length, 1e-9)[:, None]
        turning = (by_abeam * view.cross - by_cross * view.abeam) / length
        e, n = view.along[:, :, None], view.across[:, :, None]
        by_end = e * by_length[:, None] + n * turning[:, None]
        by_start = -e * (by_length + by_abeam)[:, None] - n * (turning + by_cross)[:, None]
        return by_start, by_end


@dataclass(frozen=True, eq=False)
class _View:
    """Users as seen from legs: how far along, and how far to which side."""

    length: Floats
    along: Floats
    across: Floats
    abeam: Floats
    cross: Floats

    @classmethod
    def of(cls, start_m: Floats, end_m: Floats, users_m: Floats) -> "_View":
        step = end_m - start_m
        length = np.sqrt((step**2).sum(axis=-1))
        along = step / np.maximum(length, 1e-12)[..., None]
        across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        x = users_m[:, 0] - start_m[..., :1]
        y = users_m[:, 1] - start_m[..., 1:]
        abeam = x * along[..., :1] + y * along[..., 1:]
        cross = y * along[..., :1] - x * along[..., 1:]
        return cls(length, along, across, abeam, cross)

    @property
    def aside(self) -> Floats:
        return np.abs(self.cross)

    def chord(self, radius_m: float) -> tuple[Floats, Floats, Bools]:
        """Return where each leg enters and leaves each disc, from abeam, and whether it does."""
        half = np.sqrt(np.maximum(radius_m**2 - self.cross**2, 0.0))
        first = np.maximum(-self.abeam, -half)
        last = np.minimum(self.length[..., None] - self.abeam, half)
        return first, last, np.greater(last, first)
