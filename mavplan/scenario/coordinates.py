"""Positions as people write them: degrees, minutes and seconds; UTM; MGRS. Text in, WGS84 degrees out."""

import math
import re

import numpy as np
from numpy.typing import NDArray

from mavplan.scenario.reference import Key
from mavplan.scenario.report import shown

_NUMBER = r"[0-9]{1,3}(?:\.[0-9]+)?"
_ANGLE = re.compile(
    rf"""(?P<before>[NSEW])?\s*(?P<sign>[+-])?\s*(?P<deg>{_NUMBER})\s*(?:[°ºd:]|\s|$|(?=[NSEW]))\s*
    (?:(?P<min>{_NUMBER})\s*(?:['′’m:]|\s|$|(?=[NSEW]))\s*
    (?:(?P<sec>{_NUMBER})\s*(?:["″”s]|''|′′|’’)?\s*)?)?
    (?P<after>[NSEW])?""",
    re.VERBOSE | re.IGNORECASE,
)
_LETTERS = {"lat_deg": "NS", "lon_deg": "EW"}

_UTM = re.compile(
    r"(?P<zone>[0-9]{1,2})\s*(?P<where>north|south|[C-HJ-NP-X])[\s,;]+"
    r"(?P<east>[0-9]+(?:\.[0-9]+)?)\s*(?:mE|E|m)?[\s,;]+(?P<north>[0-9]+(?:\.[0-9]+)?)\s*(?:mN|N|m)?",
    re.IGNORECASE,
)
UTM_FORM = "zone, north or south, easting and northing in metres, as 32 north 461344 5145745"
MGRS_FORM = "MGRS with at least 4 and 4 digits, as 32TMS 6134 4574"
_BANDS = "CDEFGHJKLMNPQRSTUVWX"
_MGRS = re.compile(
    r"(?P<zone>[0-9]{1,2}[C-HJ-NP-X])\s*(?P<square>[A-HJ-NP-Z][A-HJ-NP-V])\s*"
    r"(?:(?P<e4>[0-9]{4})\s*(?P<n4>[0-9]{4})|(?P<e5>[0-9]{5})\s*(?P<n5>[0-9]{5}))"
)

Floats = NDArray[np.float64]


def parse_angle(text: str, key: Key) -> float | None:
    """Return an angle in degrees, or None where the text is none.

    Degrees may be followed by minutes, those by seconds, each with its sign or only spaces or colons between; the
    letter of the hemisphere stands before or behind. Only the last of the three has a fraction.

    Parameters
    ----------
    text
        What stands in a cell.
    key
        Of ``lat_deg`` or ``lon_deg``.

    Raises
    ------
    ValueError
        It is an angle, but not one of this kind; with the sentence for the reader.
    """
    found = _ANGLE.fullmatch(text.strip())
    if found is None:
        return None
    letter = ((found["before"] or "") + (found["after"] or "")).upper()
    parts = [found[name] for name in ("deg", "min", "sec") if found[name] is not None]
    if len(letter) > 1 or (letter and found["sign"]):
        raise ValueError(f"found {shown(text)}; one sign or one letter says the hemisphere")
    if letter and letter not in _LETTERS[key.name]:
        allowed = " or ".join(_LETTERS[key.name])
        raise ValueError(f"found {shown(text)}; the letter of {key.name} is {allowed}")
    if any("." in part for part in parts[:-1]):
        raise ValueError(f"found {shown(text)}; only the last of degrees, minutes and seconds has a fraction")
    if any(float(part) >= 60 for part in parts[1:]):
        raise ValueError(f"found {shown(text)}; minutes and seconds are below 60")
    degrees = math.fsum(float(part) / 60.0**power for power, part in enumerate(parts))
    return -degrees if found["sign"] == "-" or letter in {"S", "W"} else degrees


def parse_mgrs(text: str) -> tuple[float, float]:
    """Return latitude and longitude of the middle of an MGRS square of 10 m or 1 m.

    Raises
    ------
    ValueError
        With the sentence for the reader.
    """
    from mgrs import MGRS
    from mgrs.core import MGRSError

    found = _MGRS.fullmatch(text.strip().upper())
    if found is None:
        raise ValueError(f"found {shown(text)}; allowed is {MGRS_FORM}")
    east, north = found["e5"], found["n5"]
    if east is None:
        east, north = f"{found['e4']}5", f"{found['n4']}5"
    try:
        lat_deg, lon_deg = MGRS().toLatLon(f"{found['zone']}{found['square']}{east}{north}")
    except MGRSError:
        raise ValueError(
            f"found {shown(text)}, which is no square on Earth; allowed is {MGRS_FORM}"
        ) from None
    return float(lat_deg), float(lon_deg)


def parse_utm(text: str) -> tuple[int, bool, float, float, str]:
    """Return zone, whether it is north, easting, northing, and the latitude band or nothing.

    Raises
    ------
    ValueError
        With the sentence for the reader.
    """
    found = _UTM.fullmatch(text.strip())
    if found is None:
        raise ValueError(f"found {shown(text)}; allowed is {UTM_FORM}")
    zone, where = int(found["zone"]), found["where"].upper()
    if where == "S":
        raise ValueError(
            f"found {shown(text)}; {zone}S is band S, north of the equator, to some and the south to others: "
            f"write {zone} north or {zone} south"
        )
    east_m, north_m = float(found["east"]), float(found["north"])
    if not (1 <= zone <= 60 and 100_000 <= east_m < 1_000_000 and 0 <= north_m < 10_000_000):
        raise ValueError(f"found {shown(text)}, which is no place in a UTM zone; allowed is {UTM_FORM}")
    is_north = where == "NORTH" or (len(where) == 1 and where >= "N")
    return zone, is_north, east_m, north_m, where if len(where) == 1 and where != "N" else ""


def utm_to_degrees(places: list[tuple[int, bool, float, float, str]]) -> tuple[Floats, Floats]:
    """Return latitudes and longitudes of UTM places as `parse_utm` gives them."""
    from pyproj import Transformer

    lat_deg, lon_deg = np.full(len(places), np.nan), np.full(len(places), np.nan)
    for grid in sorted({place[:2] for place in places}):
        at = [index for index, place in enumerate(places) if place[:2] == grid]
        metres = np.array([places[index][2:4] for index in at], dtype=np.float64)
        crs = (32600 if grid[1] else 32700) + grid[0]
        transform = Transformer.from_crs(crs, 4326, always_xy=True).transform
        lon_deg[at], lat_deg[at] = transform(metres[:, 0], metres[:, 1])
    return lat_deg, lon_deg


def band_fault(band: str, lat_deg: float) -> str:
    """Return the clause on a latitude that is not in its UTM band, or nothing."""
    if not band:
        return ""
    south_deg = -80.0 + 8.0 * _BANDS.index(band)
    north_deg = 84.0 if band == "X" else south_deg + 8.0
    slack_deg = 0.05  # people write the band of the map sheet they stand on
    if south_deg - slack_deg <= lat_deg <= north_deg + slack_deg:
        return ""
    return f"lies at latitude {lat_deg:.3f}, not in band {band} ({south_deg:g} to {north_deg:g})"
