"""Between WGS84 degrees and metres in a plane about home. The only place where the two meet."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

E7 = 1e7
"""MAVLink's MISSION_ITEM_INT counts in 1e-7 degrees: 1.1 cm of latitude."""


class LocalPlane:
    """Metres east and north of a home, by the azimuthal equidistant projection of the WGS84 ellipsoid.

    Distance and direction from home are those of the geodesic, at any place on Earth, poles and antimeridian
    included. At distance d from home, lengths across the ray come out longer by the part d²/(6·(6371 km)²): 1 mm in
    a kilometre at 15 km from home, 4 cm at 100 km.

    Parameters
    ----------
    home_lat_deg, home_lon_deg
        The origin.

    References
    ----------
    C. F. F. Karney, "Algorithms for geodesics", J. Geodesy 87, 2013, doi 10.1007/s00190-012-0578-z, section 13;
    https://proj.org/operations/projections/aeqd.html
    """

    def __init__(self, home_lat_deg: float, home_lon_deg: float) -> None:
        from pyproj import Proj

        self.home_lat_deg = home_lat_deg
        self.home_lon_deg = home_lon_deg
        self._projection = Proj(proj="aeqd", ellps="WGS84", lat_0=home_lat_deg, lon_0=home_lon_deg)

    def to_xy_m(self, lat_deg: ArrayLike, lon_deg: ArrayLike) -> Floats:
        """Return metres east and north of home, (N, 2), of N places in degrees."""
        lat = np.atleast_1d(np.asarray(lat_deg, dtype=np.float64))
        lon = np.atleast_1d(np.asarray(lon_deg, dtype=np.float64))
        east_m, north_m = self._projection(lon, lat)
        return np.column_stack((east_m, north_m))

    def to_lat_lon_deg(self, xy_m: ArrayLike) -> tuple[Floats, Floats]:
        """Return latitude and longitude in degrees, each (N,), of N points (N, 2); longitude from -180 to 180."""
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        lon_deg, lat_deg = self._projection(xy[:, 0].copy(), xy[:, 1].copy(), inverse=True)
        return np.asarray(lat_deg), np.asarray(lon_deg)

    def to_e7(self, xy_m: ArrayLike) -> tuple[Ints, Ints]:
        """Return latitude and longitude as integers of 1e-7 degrees, each (N,), rounded to the nearest."""
        lat_deg, lon_deg = self.to_lat_lon_deg(xy_m)
        return degrees_to_e7(lat_deg), degrees_to_e7(lon_deg)


@dataclass(frozen=True)
class Elsewhere:
    """From metres round one home to metres round another.

    Attributes
    ----------
    here_deg, there_deg
        Latitude and longitude of the two.
    """

    here_deg: tuple[float, float]
    there_deg: tuple[float, float]

    def __call__(self, xy_m: Floats) -> Floats:
        """Return (N, 2) places (N, 2) round the first as they are round the second."""
        return LocalPlane(*self.there_deg).to_xy_m(*LocalPlane(*self.here_deg).to_lat_lon_deg(xy_m))


def degrees_to_e7(degrees: ArrayLike) -> Ints:
    """Return degrees as integers of 1e-7 degrees, rounded to the nearest; cutting off would lose up to 1.1 cm."""
    return np.rint(np.asarray(degrees, dtype=np.float64) * E7).astype(np.int64)


def geodesic_distance_m(from_lat_deg: Any, from_lon_deg: Any, to_lat_deg: Any, to_lon_deg: Any) -> Floats:
    """Return the length of the shortest way over the WGS84 ellipsoid, in metres; arguments are broadcast."""
    from pyproj import Geod

    sides = np.broadcast_arrays(from_lon_deg, from_lat_deg, to_lon_deg, to_lat_deg)
    lon_1, lat_1, lon_2, lat_2 = (np.array(side, dtype=np.float64) for side in sides)
    _, _, distance_m = Geod(ellps="WGS84").inv(lon_1, lat_1, lon_2, lat_2)
    return np.asarray(distance_m, dtype=np.float64)
