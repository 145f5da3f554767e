"""Made-up ground: random rasters, smooth or rough, on a grid in the plane of the scenario."""

import numpy as np
from hypothesis import strategies as st

from mavplan.terrain.grid import Terrain

PITCH_M = 30.0


def terrain_of(heights_m, pitch_m=PITCH_M, label="hills.tif"):
    """A terrain whose middle is home, north up, with cells of one size."""
    heights_m = np.asarray(heights_m, dtype=np.float32)
    rows, columns = heights_m.shape

    def cells_of(places_m):
        return np.column_stack(
            [places_m[:, 0] / pitch_m + (columns - 1) / 2, (rows - 1) / 2 - places_m[:, 1] / pitch_m]
        )

    return Terrain(heights_m, cells_of, pitch_m, label, "EGM96")


def flat(height_m=600.0, size=201, pitch_m=PITCH_M):
    return terrain_of(np.full((size, size), height_m), pitch_m)


def ridge(top_m=800.0, base_m=600.0, at_m=500.0, width_m=300.0, size=201, pitch_m=PITCH_M):
    """A ridge from south to north, so far east of home."""
    east_m = (np.arange(size) - (size - 1) / 2) * pitch_m
    profile = base_m + (top_m - base_m) * np.exp(-(((east_m - at_m) / width_m) ** 2))
    return terrain_of(np.tile(profile, (size, 1)), pitch_m)


def bilinear(terrain, places_m):
    """Heights by the formula, one place after another: the authority for `Terrain`."""
    found = []
    for column, row in terrain.cells_of(np.asarray(places_m, dtype=float).reshape(-1, 2)):
        left = min(int(column), terrain.heights_m.shape[1] - 2)
        top = min(int(row), terrain.heights_m.shape[0] - 2)
        (a, b), (c, d) = terrain.heights_m[top : top + 2, left : left + 2].astype(float)
        u, v = column - left, row - top
        found.append((a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v)
    return np.array(found)


@st.composite
def rough(draw, size=41, pitch_m=PITCH_M, most_m=400.0):
    """Noise of several wavelengths, up to cliffs between neighbouring cells; home at 600 m."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    heights = np.zeros((size, size))
    for waves in (2, 5, 20):
        coarse = rng.normal(size=(waves + 1, waves + 1))
        at = np.linspace(0, waves, size)
        rows = np.array([np.interp(at, np.arange(waves + 1), row) for row in coarse])
        fine = np.array([np.interp(at, np.arange(waves + 1), column) for column in rows.T]).T
        heights += fine * draw(st.floats(0, most_m / 4)) / waves**0.5
    middle = heights[size // 2, size // 2]
    return terrain_of(heights - middle + 600.0, pitch_m)
