"""PX4's judgement of a stored mission: can it be flown? It comes after the ACK of the upload, and costs nothing.

Reasons as measured; the vehicle gives them in an EVENT only, except for the fence.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from sitl_mock.items import StoredItem
from sitl_mock.px4_items import FENCE_CIRCLES, FENCE_POLYGONS, GLOBAL_INT, RELATIVE_INT
from sitl_mock.vehicle import Home

TAKEOFF, LAND = 22, 21
NOT_FLYABLE = frozenset({112, 114, 212, 400, 534})
"""Commands that are stored and then judged unsupported."""
LOOKED_AT = frozenset({195})
"""Commands whose place is not flown to."""
EARTH_RADIUS_M = 6_371_000.0


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a mission cannot be flown.

    Attributes
    ----------
    words
        As PX4's console says it.
    event, levels, arguments
        The EVENT that tells it: name, log levels (internal and external), packed arguments.
    in_text
        A STATUSTEXT says it, too.
    """

    words: str
    event: str
    levels: int = 0x63
    arguments: bytes = b""
    in_text: bool = False


def infeasible_because(
    mission: Sequence[StoredItem], fence: Sequence[StoredItem], home: Home | None
) -> str | None:
    """Return the first reason why a mission cannot be flown, in words, or None; as `reasons`."""
    return next((reason.words for reason in reasons(mission, fence, home)), None)


def reasons(mission: Sequence[StoredItem], fence: Sequence[StoredItem], home: Home | None) -> list[Reason]:
    """Return why a mission cannot be flown; nothing where it can.

    A command that is not flown and a landing first end the look at the items; of all take-offs the first bad one
    counts. The fence is looked at in any case.

    Parameters
    ----------
    mission, fence
        As stored.
    home
        Altitudes above sea level are compared with it; None where there is none yet.
    """
    found: list[Reason] = []
    place_seen = takeoff_failed = False
    for number, item in enumerate(mission, start=1):
        if (reason := _unfit(number, item)) is not None:
            found.append(reason)
            break
        if item.command == TAKEOFF and not takeoff_failed:
            home_alt_m = 0.0 if item.frame == RELATIVE_INT or home is None else home.alt_cm / 100
            reason = _bad_takeoff(item, home_alt_m, place_seen)
            if reason is not None:
                takeoff_failed = True
                found.append(reason)
        place_seen = place_seen or _is_flown_to(item)
    for number, item in enumerate(mission, start=1):
        if _is_flown_to(item) and breaks_fence(item.x, item.y, fence):
            words, arguments = f"Geofence violation for waypoint {number}", struct.pack("<h", number)
            found.append(Reason(words, "navigator_mis_geofence_violation", arguments=arguments, in_text=True))
            break
    return found


def _unfit(number: int, item: StoredItem) -> Reason | None:
    if item.command in NOT_FLYABLE:
        words = f"Mission rejected: item {number}: unsupported cmd: {item.command}"
        return Reason(words, "navigator_mis_unsup_cmd", 0x43, struct.pack("<HH", number, item.command))
    if item.command == LAND and number == 1:
        return Reason("Mission rejected: starts with landing", "navigator_mis_starts_w_landing")
    return None


def _bad_takeoff(item: StoredItem, home_alt_m: float, place_seen: bool) -> Reason | None:
    if item.z <= home_alt_m:  # NaN passes, as it does on the vehicle
        words = "Mission rejected: Takeoff altitude below home altitude!"
        return Reason(words, "navigator_mis_takeoff_too_low", arguments=struct.pack("<f", home_alt_m))
    if place_seen:
        words = "Mission rejected: takeoff not first waypoint item"
        return Reason(words, "navigator_mis_takeoff_not_first")
    return None


def _is_flown_to(item: StoredItem) -> bool:
    return item.frame in {GLOBAL_INT, RELATIVE_INT} and item.command not in LOOKED_AT


def breaks_fence(lat_e7: int, lon_e7: int, fence: Sequence[StoredItem]) -> bool:
    """Return whether a place is outside every inclusion, if there is one, or inside an exclusion."""
    inclusion_seen = inside_inclusion = False
    index = 0
    while index < len(fence):
        item = fence[index]
        if item.command in FENCE_POLYGONS:
            size = int(item.param1)
            inside = _in_polygon(lat_e7, lon_e7, fence[index : index + size])
            inclusion = item.command == 5001
            index += size
        elif item.command in FENCE_CIRCLES:
            inside = _distance_m(lat_e7, lon_e7, item.x, item.y) < item.param1
            inclusion = item.command == 5003
            index += 1
        else:
            index += 1
            continue
        if inclusion:
            inclusion_seen, inside_inclusion = True, inside_inclusion or inside
        elif inside:
            return True
    return inclusion_seen and not inside_inclusion


def _in_polygon(lat_e7: int, lon_e7: int, corners: Sequence[StoredItem]) -> bool:
    inside = False
    for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        if (a.y > lon_e7) != (b.y > lon_e7) and lat_e7 < (b.x - a.x) * (lon_e7 - a.y) / (b.y - a.y) + a.x:
            inside = not inside
    return inside


def _distance_m(lat1_e7: int, lon1_e7: int, lat2_e7: int, lon2_e7: int) -> float:
    lat1, lat2 = math.radians(lat1_e7 / 1e7), math.radians(lat2_e7 / 1e7)
    half_lat, half_lon = (lat2 - lat1) / 2, math.radians((lon2_e7 - lon1_e7) / 1e7) / 2
    h = math.sin(half_lat) ** 2 + math.cos(lat1) * math.cos(lat2) * math.sin(half_lon) ** 2
    return 2 * EARTH_RADIUS_M * math.asin(math.sqrt(min(h, 1.0)))
