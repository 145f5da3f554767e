"""A flown track in metres, in short pieces: where the vehicle was at each moment, and which moments count. Pure."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mavplan.geo import LocalPlane
from mavplan.track.model import Floats, Span, Track

GAP_S = 2.0
"""Between two positions further apart in time nothing is known, and nothing counts."""

MOST_SPEED_M_S = 60.0
"""A vehicle that was faster between two positions was not there: an estimate jumped."""

STEP_M = 1.0
"""Pieces are no longer than this: the rate hardly changes along them."""

LOWER_SHARE, LOWER_M = 0.1, 3.0
"""Nothing counts where the vehicle is lower than planned by more than a tenth and by more than 3 m (half the height
below 6 m): it climbs or descends, and what stands between it and the users is not known there."""

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Path:
    """S moments of a flight, and the S − 1 pieces between them.

    Attributes
    ----------
    time_s
        (S,) increasing, the vehicle's clock.
    xy_m
        (S, 2) metres east and north of the plan's home.
    height_m
        (S,) above home.
    known
        (S − 1,) whether the vehicle's place is known along the piece.
    counts
        (S − 1,) whether what is received along it counts: its place is known, and it is not below the planned height.
    """

    time_s: Floats
    xy_m: Floats
    height_m: Floats
    known: Bools
    counts: Bools

    def at(self, time_s: float) -> Floats:
        """Return (3,) where it was; between positions on a straight line."""
        return np.array(
            [np.interp(time_s, self.time_s, axis) for axis in (*self.xy_m.T, self.height_m)], dtype=np.float64
        )

    def rows(self, span: Span) -> slice:
        """Return the moments from the first to the last of a span, both of which must be moments."""
        first, last = np.searchsorted(self.time_s, [span.from_s, span.until_s])
        return slice(int(first), int(min(last, len(self.time_s) - 1)) + 1)

    def uncounted_s(self, span: Span) -> float:
        """Return the seconds of a span that do not count."""
        rows = self.rows(span)
        pieces = slice(rows.start, max(rows.stop - 1, rows.start))
        return span.length_s - float(np.diff(self.time_s[rows])[self.counts[pieces]].sum())


def flown_path(
    track: Track,
    span: Span,
    plane: LocalPlane,
    altitude_m: float,
    planned_m: Callable[[Floats], Floats] | None = None,
) -> Path:
    """Return the path of a flight.

    Parameters
    ----------
    track
        The vehicle's positions.
    span
        The flight.
    plane
        The plan's.
    altitude_m
        Planned height of the stops above home, or with ``planned_m`` above the ground.
    planned_m
        Over real ground: takes places (K, 2), gives the planned height there above home.
    """
    xy_m = plane.to_xy_m(track.lat_deg, track.lon_deg)
    good = np.isfinite(xy_m).all(axis=1)
    good &= (track.time_s >= span.from_s) & (track.time_s <= span.until_s)
    time_s, xy_m, height_m = track.time_s[good], xy_m[good], track.alt_rel_m[good]
    lasted_s, length_m = np.diff(time_s), np.hypot(*np.diff(xy_m, axis=0).T)
    known = (lasted_s <= GAP_S) & (length_m <= MOST_SPEED_M_S * lasted_s)
    least_m = least_height_m(altitude_m)
    high = height_m >= (least_m if planned_m is None else planned_m(xy_m) - (altitude_m - least_m))
    path = Path(time_s, xy_m, height_m, known, known & high[:-1] & high[1:])
    return cut(path, _steps(path))


def least_height_m(altitude_m: float) -> float:
    """Return the height above home below which nothing counts, by the planned one."""
    return altitude_m - max(LOWER_SHARE * altitude_m, min(LOWER_M, altitude_m / 2))


def _steps(path: Path) -> Iterable[float]:
    """Return the moments that cut long pieces into short ones."""
    length_m = np.hypot(*np.diff(path.xy_m, axis=0).T)
    parts = np.where(path.counts, np.ceil(length_m / STEP_M), 1.0).astype(np.int64)
    long = np.flatnonzero(parts > 1)
    times = [
        np.linspace(path.time_s[piece], path.time_s[piece + 1], parts[piece] + 1)[1:-1] for piece in long
    ]
    return np.concatenate(times).tolist() if times else ()


def cut(path: Path, times_s: Iterable[float]) -> Path:
    """Return the path with further moments among its own, on straight lines; those outside it are left out."""
    wanted = np.unique(np.asarray(list(times_s), dtype=np.float64))
    inside = (
        wanted[(wanted > path.time_s[0]) & (wanted < path.time_s[-1])] if len(path.time_s) else wanted[:0]
    )
    new = np.setdiff1d(inside, path.time_s)
    if not len(new):
        return path
    time_s = np.sort(np.concatenate((path.time_s, new)))
    xy_m = np.column_stack([np.interp(time_s, path.time_s, axis) for axis in path.xy_m.T])
    piece = np.searchsorted(path.time_s, time_s[:-1], side="right") - 1
    return Path(
        time_s,
        xy_m,
        np.interp(time_s, path.time_s, path.height_m),
        path.known[piece],
        path.counts[piece],
    )
