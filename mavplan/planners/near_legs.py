"""Which places lie within reach of which legs of a long path, found among neighbours only."""

from typing import Any

import numpy as np

from mavplan.scenario.model import Floats, Ints


def legs_near(path_m: Floats, places_m: Floats, reach_m: float) -> tuple[Ints, Ints]:
    """Return pairs of a leg of a path (L + 1, 2) and a place (P, 2) within reach of it, by leg, then by place."""
    from scipy.spatial import KDTree

    begin, along = path_m[:-1], np.diff(path_m, axis=0)
    if not len(along) or not len(places_m):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    half_m = np.sqrt((along**2).sum(axis=1)) / 2.0
    found: Any = KDTree(places_m).query_ball_point(
        begin + along / 2.0, (reach_m + half_m) * (1 + 1e-9), return_sorted=True
    )
    counts = np.array([len(near) for near in found], dtype=np.int64)
    place: Ints = np.fromiter((at for near in found for at in near), np.int64, int(counts.sum()))
    leg = np.repeat(np.arange(len(along)), counts)
    offset, step = places_m[place] - begin[leg], along[leg]
    squared = np.maximum((step**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((offset * step).sum(axis=1) / squared, 0.0, 1.0)
    offset -= share[:, None] * step
    near = (offset**2).sum(axis=1) <= reach_m**2
    return leg[near], place[near]
