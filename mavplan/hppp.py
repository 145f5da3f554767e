"""Random users: a homogeneous Poisson point process (HPPP) of single users or of pairs, in a square.

S. Zhang et al., EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3, section 2. The paper's λ,
15 to 20, is read as the mean number of users in the square, two to a pair; that reading is a reconstruction.
"""

import numpy as np
from numpy.typing import NDArray

from mavplan.scenario.model import UNPAIRED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SIDE_M = 2000.0
"""Side of the paper's square."""

PAIR_RADIUS_M = 200.0
"""A mate is at most so far from its user."""

MIN_PAIRS = 3
"""Fewer pairs than this are not planned for: a draw below counts as this many."""


def draw_users(
    mean_users: float,
    side_m: float = SIDE_M,
    *,
    seed: int | np.random.Generator = 0,
    min_users: int = 1,
) -> tuple[Floats, Ints]:
    """Draw single users.

    Parameters
    ----------
    mean_users
        Mean of the Poisson number of users in the whole square, λ·A.
    side_m
        The square is [0, side_m]².
    seed
        Seed, or a generator to draw from; the same seed gives the same users.
    min_users
        A smaller draw counts as this many.

    Returns
    -------
    xy_m : (N, 2) array
        Positions, uniform in the square.
    mate : (N,) array
        `UNPAIRED` throughout.
    """
    rng = np.random.default_rng(seed)
    count = max(int(rng.poisson(mean_users)), min_users)
    return rng.uniform(0.0, side_m, (count, 2)), np.full(count, UNPAIRED, dtype=np.int64)


def draw_pairs(
    mean_users: float,
    side_m: float = SIDE_M,
    pair_radius_m: float = PAIR_RADIUS_M,
    *,
    seed: int | np.random.Generator = 0,
    min_pairs: int = MIN_PAIRS,
) -> tuple[Floats, Ints]:
    """Draw users in pairs: one uniform in the square, its mate uniform in the disc round it, clipped to the square.

    Parameters
    ----------
    mean_users
        Mean number of users in the whole square; the number of pairs is Poisson with half of it.
    side_m
        The square is [0, side_m]².
    pair_radius_m
        Radius of the disc.
    seed
        Seed, or a generator to draw from; the same seed gives the same users.
    min_pairs
        A smaller draw counts as this many.

    Returns
    -------
    xy_m : (N, 2) array
        Positions; rows 2k and 2k + 1 are a pair, at most ``pair_radius_m`` apart.
    mate : (N,) array
        Index of each user's mate.
    """
    rng = np.random.default_rng(seed)
    pairs = max(int(rng.poisson(mean_users / 2.0)), min_pairs)
    user = rng.uniform(0.0, side_m, (pairs, 2))
    distance_m = pair_radius_m * np.sqrt(rng.uniform(0.0, 1.0, pairs))  # uniform over the disc's area
    bearing = rng.uniform(0.0, 2.0 * np.pi, pairs)
    offset = distance_m[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    other = np.clip(user + offset, 0.0, side_m)
    xy_m = np.stack((user, other), axis=1).reshape(-1, 2)
    return xy_m, np.arange(2 * pairs, dtype=np.int64) ^ 1
