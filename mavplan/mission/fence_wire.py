"""A fence and rally points as they travel: mission types 1 and 2, to the wire and back, and what must not be sent.

Polygons go before circles, a vertex an item, each with the number of vertices of its polygon; inclusion group
(param2) 0 for all: a vehicle is to be inside every one of them. What a vehicle keeps of an item is in
`mavplan.mission.readback`.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mavplan.errors import Problem
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.geofence import (
    Fence,
    FenceArea,
    FenceCircle,
    FencePolygon,
    RallyPoint,
    area_faults,
    rally_faults,
    rally_label,
)
from mavplan.mission.model import Autopilot, Frame, HomePosition, ListCommand, Mission
from mavplan.mission.sendable import RELATIVE_FRAMES, command_name
from mavplan.mission.wire import WireItem, plain_frame

POLYGON_COMMAND = {
    True: ListCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    False: ListCommand.NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
}
CIRCLE_COMMAND = {
    True: ListCommand.NAV_FENCE_CIRCLE_INCLUSION,
    False: ListCommand.NAV_FENCE_CIRCLE_EXCLUSION,
}


@dataclass(frozen=True, slots=True)
class ListLimits:
    """What one autopilot holds, as measured in simulation; boards differ, and the vehicle has the last word.

    Attributes
    ----------
    fence_items, fence_bytes
        Greatest number of fence items, and the storage they must fit into; infinite where it is no limit of its own.
    rally_points
        Greatest number of rally points.
    rally_step_m
        Resolution of a rally point's altitude; 0 where it is a float32.
    max_rally_alt_m
        Greatest altitude of a rally point that is stored as meant.
    """

    fence_items: int
    fence_bytes: float
    rally_points: int
    rally_step_m: float
    max_rally_alt_m: float


LIMITS: dict[Autopilot, ListLimits] = {
    "ardupilot": ListLimits(
        fence_items=70, fence_bytes=560, rally_points=46, rally_step_m=1.0, max_rally_alt_m=32_767.0
    ),
    "px4": ListLimits(
        fence_items=64, fence_bytes=math.inf, rally_points=32, rally_step_m=0.0, max_rally_alt_m=83_000.0
    ),
}


def fence_to_wire(mission: Mission, rules: AutopilotRules) -> tuple[WireItem, ...]:
    """Return the items of mission type 1 that an upload sends; none where there is no fence.

    Raises
    ------
    Nothing: call `fence_problems` first; a fence with problems gives items that must not be sent.
    """
    del rules  # frame 0 and altitude 0 suit both, for neither keeps the one or the other
    fence = mission.fence or Fence()
    items: list[WireItem] = []
    for polygon in fence.polygons:
        command, count = POLYGON_COMMAND[polygon.inclusion], len(polygon.vertices_e7)
        for lat_e7, lon_e7 in polygon.vertices_e7:
            items.append(_item(len(items), Frame.GLOBAL, command, float(count), lat_e7, lon_e7, 0.0))
    for circle in fence.circles:
        command = CIRCLE_COMMAND[circle.inclusion]
        place = (circle.lat_e7, circle.lon_e7)
        items.append(_item(len(items), Frame.GLOBAL, command, circle.radius_m, *place, 0.0))
    return tuple(items)


def rally_to_wire(mission: Mission, rules: AutopilotRules) -> tuple[WireItem, ...]:
    """Return the items of mission type 2 that an upload sends; none where there are no rally points."""
    del rules  # both take frame 3
    command, frame = ListCommand.NAV_RALLY_POINT, Frame.GLOBAL_RELATIVE_ALT
    return tuple(
        _item(seq, frame, command, 0.0, point.lat_e7, point.lon_e7, point.alt_rel_m)
        for seq, point in enumerate(mission.rally)
    )


def _item(
    seq: int, frame: int, command: int, param1: float, lat_e7: int, lon_e7: int, alt_m: float
) -> WireItem:
    return WireItem(seq, int(frame), int(command), 0, 1, param1, 0.0, 0.0, 0.0, lat_e7, lon_e7, alt_m)


def fence_problems(mission: Mission, rules: AutopilotRules) -> list[Problem]:
    """Find everything in a mission's fence and rally points that this firmware would refuse, change or choke on.

    Returns
    -------
    list of Problem
        Errors must not be sent. What may be too much for the vehicle's storage is a warning: boards differ, and a
        vehicle that refuses the number keeps its old list.
    """
    return [*_fence_problems(mission.fence or Fence(), rules), *_rally_problems(mission.rally, rules)]


def _fence_problems(fence: Fence, rules: AutopilotRules) -> Iterator[Problem]:
    limits = LIMITS[rules.name]
    for label, area in fence.labelled():
        yield from (Problem(label, message, code) for message, code in area_faults(area))
    count = sum(_item_count(area) for _, area in fence.labelled())
    if count > limits.fence_items:
        found = f"takes {count:,} items; {rules.title} took {limits.fence_items} in simulation, your board may differ"
        yield Problem("fence", found, "fence-size", "warning")
    elif _storage_bytes(fence) > limits.fence_bytes:
        found = (
            f"takes {_storage_bytes(fence):,} bytes; {rules.title} had {limits.fence_bytes:g} in simulation, "
            "your board may differ"
        )
        yield Problem("fence", found, "fence-size", "warning")


def _item_count(area: FenceArea) -> int:
    return len(area.vertices_e7) if isinstance(area, FencePolygon) else 1


def _storage_bytes(fence: Fence) -> int:
    """Return what ArduPilot's storage needs: a header and an end mark, 2 + 8 a vertex, 13 a circle."""
    return 5 + sum(2 + 8 * len(area.vertices_e7) for area in fence.polygons) + 13 * len(fence.circles)


def _rally_problems(rally: Sequence[RallyPoint], rules: AutopilotRules) -> Iterator[Problem]:
    limits = LIMITS[rules.name]
    for number, point in enumerate(rally, start=1):
        label = rally_label(number, point)
        yield from (Problem(label, message, code) for message, code in rally_faults(point))
        yield from (Problem(label, message, code) for message, code in rally_altitude_faults(point, rules))
    if len(rally) > limits.rally_points:
        took = f"{rules.title} took {limits.rally_points} in simulation, your board may differ"
        yield Problem("rally points", f"there are {len(rally):,}; {took}", "rally-size", "warning")


def rally_altitude_faults(point: RallyPoint, rules: AutopilotRules) -> Iterator[tuple[str, str]]:
    """Yield message and code where this firmware would not store a rally point's altitude as it is meant."""
    limits = LIMITS[rules.name]
    alt_m = point.alt_rel_m
    if not math.isfinite(alt_m):
        return
    if abs(alt_m) > limits.max_rally_alt_m:
        yield f"an altitude of {alt_m:g} m is out of range: up to {limits.max_rally_alt_m:g} m", "altitude"
    elif limits.rally_step_m and alt_m % limits.rally_step_m:
        cut = f"{rules.title} would cut it to {math.trunc(alt_m)} m: give whole metres"
        yield f"an altitude of {alt_m:.10g} m has a fraction; {cut}", "rally-fraction"


def fence_from_wire(items: Sequence[WireItem]) -> tuple[Fence | None, tuple[Problem, ...]]:
    """Return the fence that a vehicle holds, and what had to be left out of it.

    Parameters
    ----------
    items
        All items of mission type 1, in order.

    Returns
    -------
    fence, warnings
        None where there is no area. A vehicle may hold items that make no area; they are told and left out, and so is
        a return point, which multirotors do not use.
    """
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    warnings: list[Problem] = []
    at = 0
    while at < len(items):
        item = items[at]
        area, length = _area(items[at:])
        where = f"fence item {at}" if length == 1 else f"fence items {at} to {at + length - 1}"
        faults = [message for message, _ in area_faults(area)] if area is not None else []
        if area is None:
            what = command_name(item.command)
            message = "make no polygon" if item.command in POLYGON_COMMAND.values() else f"is {what}"
            warnings.append(Problem(where, f"{message}: left out", "left-out", "warning"))
        elif faults:
            warnings.append(Problem(where, f"{'; '.join(faults)}: left out", "left-out", "warning"))
        elif isinstance(area, FencePolygon):
            polygons.append(area)
        else:
            circles.append(area)
        at += length
    fence = Fence(tuple(polygons), tuple(circles))
    return fence or None, tuple(warnings)


def _area(items: Sequence[WireItem]) -> tuple[FenceArea | None, int]:
    """Return the area that begins here, if one does, and how many items belong together."""
    first = items[0]
    if first.command in CIRCLE_COMMAND.values():
        inclusion = first.command == CIRCLE_COMMAND[True]
        return FenceCircle(inclusion, first.x, first.y, first.param1), 1
    if first.command not in POLYGON_COMMAND.values():
        return None, 1
    alike = itertools.takewhile(
        lambda item: (item.command, item.param1) == (first.command, first.param1), items
    )
    together = list(itertools.islice(alike, max(1, int(first.param1)) if first.param1 < 1e6 else 1))
    if len(together) != first.param1:
        return None, len(together)
    inclusion = first.command == POLYGON_COMMAND[True]
    return FencePolygon(inclusion, tuple((item.x, item.y) for item in together)), len(together)


def rally_from_wire(
    items: Sequence[WireItem], home: HomePosition | None = None
) -> tuple[tuple[RallyPoint, ...], tuple[Problem, ...]]:
    """Return the rally points that a vehicle holds, and what had to be left out.

    Parameters
    ----------
    items
        All items of mission type 2, in order.
    home
        The vehicle's home: an altitude above sea level is told from it. Without it such a point is left out.
    """
    points: list[RallyPoint] = []
    warnings: list[Problem] = []
    for number, item in enumerate(items):
        point = _rally_point(item, home)
        faults = [message for message, _ in rally_faults(point)] if point is not None else []
        if point is None or faults:
            reason = "; ".join(faults) or f"{command_name(item.command)} in frame {item.frame} cannot be told"
            warnings.append(Problem(f"rally item {number}", f"{reason}: left out", "left-out", "warning"))
        else:
            points.append(point)
    return tuple(points), tuple(warnings)


def _rally_point(item: WireItem, home: HomePosition | None) -> RallyPoint | None:
    if item.command != ListCommand.NAV_RALLY_POINT:
        return None
    if item.frame in RELATIVE_FRAMES:
        return RallyPoint(item.x, item.y, item.z)
    if plain_frame(item.frame) == Frame.GLOBAL and home is not None:
        return RallyPoint(item.x, item.y, item.z - home.alt_amsl_m)
    return None
