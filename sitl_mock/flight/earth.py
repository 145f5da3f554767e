"""Degrees on WGS84 to metres on the plane that touches it at one place, and back.

The plane is tangent to the ellipsoid: at 10 km from the place where it touches, distances on it are 1.3 cm short.
Heights are not bent: "up" is the height above the ellipsoid's surface everywhere.
"""

import math

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING)
EDGE_M = 3_000_000.0
"""Farther out the plane says nothing useful; places beyond are taken to be there."""


class Tangent:
    """The plane that touches at one place.

    Parameters
    ----------
    lat_e7, lon_e7
        Where it touches, in 1e-7 degrees.
    """

    def __init__(self, lat_e7: int, lon_e7: int) -> None:
        lat, self._lon = math.radians(lat_e7 / 1e7), math.radians(lon_e7 / 1e7)
        self._lat = lat
        self._sin, self._cos = math.sin(lat), math.cos(lat)
        self._x, self._z = _meridian(lat)

    def _project(self, lat: float, lon: float) -> tuple[float, float]:
        x, z = _meridian(lat)
        east = x * math.sin(lon - self._lon)
        north = (z - self._z) * self._cos - (x * math.cos(lon - self._lon) - self._x) * self._sin
        return north, east

    def metres(self, lat_e7: float, lon_e7: float) -> tuple[float, float]:
        """Return metres north and east of the place where the plane touches."""
        return self._project(math.radians(lat_e7 / 1e7), math.radians(lon_e7 / 1e7))

    def degrees_e7(self, north_m: float, east_m: float) -> tuple[int, int]:
        """Return latitude and longitude in 1e-7 degrees."""
        far = math.hypot(north_m, east_m)
        if far > EDGE_M:
            north_m, east_m = north_m * EDGE_M / far, east_m * EDGE_M / far
        lat, lon = self._lat, self._lon
        for _ in range(3 if far < 20_000.0 else 12):
            north, east = self._project(lat, lon)
            root = math.sqrt(1 - ECCENTRICITY_2 * math.sin(lat) ** 2)
            lat += (north_m - north) * root**3 / (SEMI_MAJOR_M * (1 - ECCENTRICITY_2))
            lon += (east_m - east) * root / (SEMI_MAJOR_M * max(math.cos(lat), 1e-6))
        lon = (lon + math.pi) % (2 * math.pi) - math.pi
        return round(math.degrees(lat) * 1e7), round(math.degrees(lon) * 1e7)


def _meridian(lat: float) -> tuple[float, float]:
    """Distance from the axis and height above the equator's plane of a place on the ellipsoid, in metres."""
    sin = math.sin(lat)
    radius = SEMI_MAJOR_M / math.sqrt(1 - ECCENTRICITY_2 * sin * sin)
    return radius * math.cos(lat), radius * (1 - ECCENTRICITY_2) * sin
