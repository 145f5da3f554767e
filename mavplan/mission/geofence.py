"""Fences and rally points as types, and what is wrong with an area in itself. No plane, no mission, no firmware.

A fence is areas to stay in and areas to stay out of. Both autopilots want a vehicle inside **every** inclusion area
and outside every exclusion area, as MAVLink defines areas of one group
(https://mavlink.io/en/messages/common.html#MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION). Heights are no part of it:
neither a ``.plan`` nor a transfer carries one.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

MAX_LAT_E7 = 900_000_000
MAX_LON_E7 = 1_800_000_000
MAX_VERTICES = 255
"""ArduPilot counts the vertices of a polygon in 8 bits."""
MAX_RADIUS_M = 100_000.0
"""Nothing larger is meant as a fence for a multirotor."""

Place = tuple[int, int]
"""Latitude and longitude in 1e-7 degrees."""


@dataclass(frozen=True, slots=True)
class FencePolygon:
    """An area with straight sides in latitude and longitude; the last vertex is joined to the first.

    ``name`` is for messages only and takes no part in comparisons, for neither files nor vehicles keep it.
    """

    inclusion: bool
    vertices_e7: tuple[Place, ...]
    name: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class FenceCircle:
    """A round area; ``name`` as for `FencePolygon`."""

    inclusion: bool
    lat_e7: int
    lon_e7: int
    radius_m: float
    name: str = field(default="", compare=False)


FenceArea = FencePolygon | FenceCircle


@dataclass(frozen=True, slots=True)
class Fence:
    """All areas: polygons before circles, as files and transfers have them."""

    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()

    def __bool__(self) -> bool:
        """Whether there is any area."""
        return bool(self.polygons or self.circles)

    def labelled(self) -> Iterator[tuple[str, FenceArea]]:
        """Yield each area with what to call it: its name, or for instance ``fence polygon 2 (exclusion)``."""
        lists: tuple[tuple[str, Sequence[FenceArea]], ...] = (
            ("polygon", self.polygons),
            ("circle", self.circles),
        )
        for kind, areas in lists:
            for number, area in enumerate(areas, start=1):
                side = "inclusion" if area.inclusion else "exclusion"
                yield area.name or f"fence {kind} {number} ({side})", area


@dataclass(frozen=True, slots=True)
class RallyPoint:
    """A place to return to other than home; altitude above home. ``name`` as for `FencePolygon`."""

    lat_e7: int
    lon_e7: int
    alt_rel_m: float
    name: str = field(default="", compare=False)


def rally_label(number: int, point: RallyPoint) -> str:
    """Return ``rally point 2``, with its name if it has one."""
    return f"rally point {number} ({point.name})" if point.name else f"rally point {number}"


def place_faults(lat_e7: int, lon_e7: int) -> Iterator[tuple[str, str]]:
    """Yield message and code of each coordinate that is out of range."""
    if abs(lat_e7) > MAX_LAT_E7:
        yield f"latitude {lat_e7 / 1e7:.10g} is out of range: -90 to 90 degrees", "latitude"
    if abs(lon_e7) > MAX_LON_E7:
        yield f"longitude {lon_e7 / 1e7:.10g} is out of range: -180 to 180 degrees", "longitude"


def area_faults(area: FenceArea) -> Iterator[tuple[str, str]]:
    """Yield message and code of everything that keeps an area from being a fence."""
    if isinstance(area, FenceCircle):
        yield from place_faults(area.lat_e7, area.lon_e7)
        if not 0 < area.radius_m <= MAX_RADIUS_M:  # false for NaN
            allowed = f"above 0 and at most {MAX_RADIUS_M:,.0f} m"
            yield f"a radius of {area.radius_m:g} m is out of range: {allowed}", "radius"
        return
    faults = list(_vertex_faults(area.vertices_e7))
    yield from faults
    if not faults and (sides := crossing_sides(area.vertices_e7)) is not None:
        one, other = (_side_words(side, len(area.vertices_e7)) for side in sides)
        yield f"its sides meet: {one} and {other}; vertices go once round the area, in order", "self-crossing"


def _vertex_faults(vertices_e7: Sequence[Place]) -> Iterator[tuple[str, str]]:
    count = len(vertices_e7)
    if count > MAX_VERTICES:
        yield f"{count:,} vertices; at most {MAX_VERTICES} can be counted on a vehicle", "vertices"
        return
    for number, place in enumerate(vertices_e7, start=1):
        yield from ((f"vertex {number}: {message}", code) for message, code in place_faults(*place))
    if count > 1 and vertices_e7[0] == vertices_e7[-1]:
        yield "the last vertex repeats the first: leave it out, the area closes by itself", "vertices"
        return
    if count < 3:
        yield f"{count} {'vertex' if count == 1 else 'vertices'}; at least 3 make an area", "vertices"
        return
    for number, (one, other) in enumerate(itertools.pairwise(vertices_e7), start=1):
        if one == other:
            yield f"vertices {number} and {number + 1} are the same place", "vertices"
    if any(abs(a[1] - b[1]) > MAX_LON_E7 for a, b in _sides(vertices_e7)):
        yield "a side crosses the 180° meridian, where the autopilots' fences do not work", "antimeridian"


def _sides(vertices_e7: Sequence[Place]) -> list[tuple[Place, Place]]:
    return list(zip(vertices_e7, [*vertices_e7[1:], vertices_e7[0]], strict=True))


def _side_words(side: int, count: int) -> str:
    return f"vertex {side + 1} to {(side + 1) % count + 1}"


def crossing_sides(vertices_e7: Sequence[Place]) -> tuple[int, int] | None:
    """Return the first two sides of a polygon that meet elsewhere than at the vertex they share, from 0; or None.

    Exact, for the coordinates are integers. A polygon without area has two such sides.

    Parameters
    ----------
    vertices_e7
        At least 3, neighbours distinct.
    """
    sides = _sides(vertices_e7)
    count = len(sides)
    for one, (a, b) in enumerate(sides):
        for other in range(one + 1, count):
            c, d = sides[other]
            if other == one + 1:
                meet = _folds_back(a, b, d)
            elif (other + 1) % count == one:
                meet = _folds_back(c, d, b)
            else:
                meet = _meet(a, b, c, d)
            if meet:
                return one, other
    return None


def _turn(a: Place, b: Place, c: Place) -> int:
    """Return twice the signed area of a triangle: positive for a left turn in (latitude, longitude)."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _folds_back(a: Place, b: Place, c: Place) -> bool:
    """Whether the way a, b, c turns round by 180 degrees at b."""
    along = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1])
    return _turn(a, b, c) == 0 and along < 0


def _meet(a: Place, b: Place, c: Place, d: Place) -> bool:
    """Whether the closed segments ab and cd have a point in common."""
    turns = (_turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b))
    if _sign(turns[0]) * _sign(turns[1]) < 0 and _sign(turns[2]) * _sign(turns[3]) < 0:
        return True
    ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(turn == 0 and _in_box(*end) for turn, end in zip(turns, ends, strict=True))


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)


def _in_box(a: Place, b: Place, point: Place) -> bool:
    return all(min(a[k], b[k]) <= point[k] <= max(a[k], b[k]) for k in (0, 1))


def rally_faults(point: RallyPoint) -> Iterator[tuple[str, str]]:
    """Yield message and code of everything that keeps a rally point from being one."""
    yield from place_faults(point.lat_e7, point.lon_e7)
    if point.lat_e7 == 0 and point.lon_e7 == 0:
        yield "latitude and longitude are both 0, which vehicles take for no place", "position"
    if not math.isfinite(point.alt_rel_m):
        yield f"the altitude {point.alt_rel_m} m is none", "altitude"
