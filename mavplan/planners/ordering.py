"""The order of stop points: the paper's minimum path selection strategy (MPSS), and lengths of paths."""

import numpy as np

from mavplan.scenario.model import Floats, Ints

ORIGIN_M = np.zeros(2)
"""Home, where every trajectory begins."""


def minimum_path_order(stops_m: Floats) -> Ints:
    """Return MPSS, section 4: from the origin always to the nearest stop not yet visited.

    Parameters
    ----------
    stops_m
        (M, 2) metres from the origin.

    Returns
    -------
    (M,) indices in flying order; of stops equally near, the one of lower index first.
    """
    remaining = np.arange(len(stops_m))
    order = np.empty(len(stops_m), dtype=np.int64)
    here = ORIGIN_M
    for position in range(len(stops_m)):
        offsets = stops_m[remaining] - here
        nearest = int(np.argmin(np.einsum("ij,ij->i", offsets, offsets)))
        order[position] = remaining[nearest]
        here = stops_m[order[position]]
        remaining = np.delete(remaining, nearest)
    return order


def from_origin(stops_m: Floats) -> Floats:
    """Return the polyline (M + 1, 2) from the origin through the stops."""
    return np.vstack([ORIGIN_M, stops_m])


def path_length_m(path_m: Floats) -> float:
    """Return the length of a polyline (S + 1, 2)."""
    return float(np.linalg.norm(np.diff(path_m, axis=0), axis=1).sum())
