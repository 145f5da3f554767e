"""Altitudes along a path: legs are straight in space, and where one comes too near to the ground it is bent over it.

Pure. Altitudes are above mean sea level here; what is above home is `mavplan.terrain.flight`'s business.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.terrain.grid import Floats, Ground, Terrain

OVER_M = 2.0
"""A bend stands so much higher than it must: autopilots cut a corner by up to that, and fewer bends do."""

TOUCHING_M = 1e-6
"""So little is arithmetic."""


@dataclass(frozen=True, eq=False)
class Bends:
    """Where a leg is bent over the ground.

    Attributes
    ----------
    at
        (B,) increasing parts of the leg.
    alt_m
        (B,) altitudes there.
    """

    at: Floats
    alt_m: Floats


def bent_leg(ground: Ground, start_alt_m: float, end_alt_m: float, clearance_m: float) -> Bends:
    """Return the bends that keep a leg clear of the ground.

    The place at which most is missing becomes a bend; so on to both its sides, until nothing is missing.

    Parameters
    ----------
    ground
        Under the leg, known all along.
    start_alt_m, end_alt_m
        Altitudes of its ends, both clear.
    clearance_m
        Least height above the ground.
    """
    needed_m = ground.top_m + clearance_m
    last = len(ground.at) - 1
    bends: dict[int, float] = {}
    todo = [(0, float(start_alt_m), last, float(end_alt_m))]
    while todo:
        first, first_m, until, until_m = todo.pop()
        if until - first < 2:
            continue
        inner = slice(first + 1, until)
        share = (ground.at[inner] - ground.at[first]) / (ground.at[until] - ground.at[first])
        missing_m = needed_m[inner] - (first_m + share * (until_m - first_m))
        worst = int(missing_m.argmax())
        if missing_m[worst] <= TOUCHING_M:
            continue
        bend = first + 1 + worst
        bends[bend] = float(needed_m[bend]) + OVER_M
        todo += [(first, first_m, bend, bends[bend]), (bend, bends[bend], until, until_m)]
    rows = sorted(bends)
    return Bends(ground.at[rows], np.array([bends[row] for row in rows], dtype=np.float64))


def least_clearance_m(ground: Ground, start_alt_m: float, end_alt_m: float) -> tuple[float, float]:
    """Return a height that a leg is nowhere less above the ground, and the part of the leg at which it comes so near.

    NaN where the ground is not known all along.
    """
    above_m = start_alt_m + ground.at * (end_alt_m - start_alt_m) - ground.top_m
    if np.isnan(above_m).any():
        return float("nan"), float(ground.at[int(np.isnan(above_m).argmax())])
    nearest = int(above_m.argmin())
    return float(above_m[nearest]), float(ground.at[nearest])


@dataclass(frozen=True, eq=False)
class Climbing:
    """A path with its altitudes, bends among its points.

    Attributes
    ----------
    path_m
        (Q, 2) places, the first as it was given.
    alt_m
        (Q,) altitudes.
    given
        (P,) rows of the points that were given.
    """

    path_m: Floats
    alt_m: Floats
    given: np.ndarray[tuple[int], np.dtype[np.int64]]


def over_ground(terrain: Terrain, path_m: Floats, alt_m: Floats, clearance_m: float) -> Climbing:
    """Return a path with bends wherever one of its legs came too near to the ground.

    Parameters
    ----------
    terrain
        Known under the whole path.
    path_m, alt_m
        (P, 2) places and (P,) their altitudes, each clear of the ground.
    clearance_m
        Least height above the ground along every leg.
    """
    places: list[Floats] = [path_m[:1]]
    altitudes: list[Floats] = [alt_m[:1]]
    given = [0]
    for leg in range(len(path_m) - 1):
        start, end = path_m[leg], path_m[leg + 1]
        bends = bent_leg(terrain.under(start, end), alt_m[leg], alt_m[leg + 1], clearance_m)
        places += [start + bends.at[:, None] * (end - start), end[None]]
        altitudes += [bends.alt_m, alt_m[leg + 1 : leg + 2]]
        given.append(given[-1] + len(bends.at) + 1)
    return Climbing(np.vstack(places), np.concatenate(altitudes), np.array(given, dtype=np.int64))


def unknown_legs(terrain: Terrain, path_m: Floats) -> list[tuple[int, Floats]]:
    """Return the legs of a path under which the ground is not known, by the row they begin at, and a place of each."""
    found = []
    for leg in range(len(path_m) - 1):
        ground = terrain.under(path_m[leg], path_m[leg + 1])
        unknown = np.isnan(ground.top_m)
        if unknown.any():
            at = float(ground.at[int(unknown.argmax())])
            found.append((leg, path_m[leg] + at * (path_m[leg + 1] - path_m[leg])))
    return found


def kept_altitudes_m(alt_m: Sequence[float] | Floats) -> list[float]:
    """Return altitudes, rounded up to centimetres that ArduPilot keeps: it cuts float32(z)·100 to a whole number."""
    kept = []
    for altitude_m in np.asarray(alt_m, dtype=np.float64).tolist():
        steps = int(np.ceil(round(altitude_m * 100, 6)))
        while int(np.float32(steps / 100) * np.float32(100)) != steps:
            steps += 1
        kept.append(steps / 100)
    return kept
