"""A mission as it travels: `to_wire` before an upload, `from_wire` after a download. What must not be sent: `sendable`.

Item numbers here are those on the wire: on ArduPilot home is item 0 and the mission begins at 1, on PX4 the
mission begins at 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.errors import Problem
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.sendable import UNUSED_PARAMS, wire_problems

__all__ = ["WireItem", "from_wire", "has_home_item", "to_wire", "wire_problems"]

PLAIN_FRAMES = {
    int(Frame.GLOBAL_INT): int(Frame.GLOBAL),
    int(Frame.GLOBAL_RELATIVE_ALT_INT): int(Frame.GLOBAL_RELATIVE_ALT),
    int(Frame.GLOBAL_TERRAIN_ALT_INT): int(Frame.GLOBAL_TERRAIN_ALT),
}
"""Frames whose ``_INT`` spelling means the same in MISSION_ITEM_INT."""

KNOWN_COMMANDS = frozenset(int(command) for command in Command)


@dataclass(frozen=True, slots=True)
class WireItem:
    """The fields of MISSION_ITEM_INT (https://mavlink.io/en/messages/common.html#MISSION_ITEM_INT).

    ``x`` and ``y`` are 1e-7 degrees, ``z`` metres in ``frame``.
    """

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float

    @property
    def params(self) -> tuple[float, float, float, float]:
        """param1 to param4."""
        return (self.param1, self.param2, self.param3, self.param4)


def plain_frame(frame: int) -> int:
    """Return the frame without its ``_INT`` spelling: 6 is 3, 5 is 0, 11 is 10."""
    return PLAIN_FRAMES.get(frame, frame)


def to_wire(mission: Mission, rules: AutopilotRules) -> tuple[WireItem, ...]:
    """Return the items that an upload sends, in order.

    ArduPilot takes item 0 for home and does not fly it; PX4 flies every item. Items without a position get the
    frame the autopilot wants; DO_JUMP targets follow the numbering. A NaN ("as you like") in a parameter that the
    command does not use, or that ArduPilot ignores, becomes 0.

    Raises
    ------
    Nothing: call `wire_problems` first; a mission with problems gives items that must not be sent.
    """
    items: list[WireItem] = []
    offset = int(rules.home_on_wire)
    if rules.home_on_wire:
        home = mission.home
        items.append(
            WireItem(
                0,
                Frame.GLOBAL,
                Command.NAV_WAYPOINT,
                0,
                1,
                0,
                0,
                0,
                0,
                home.lat_e7,
                home.lon_e7,
                home.alt_amsl_m,
            )
        )
    for index, item in enumerate(mission.items):
        seq = index + offset
        param1, param2, param3, param4 = _params(item, rules)
        if item.command == Command.DO_JUMP:
            param1 += offset
        place = (item.lat_e7, item.lon_e7, item.alt_m) if item.has_position else (0, 0, 0.0)
        items.append(
            WireItem(
                seq=seq,
                frame=item.frame if item.has_position else int(rules.bare_frame),
                command=int(item.command),
                current=int(rules.current_on_first and seq == 0),
                autocontinue=int(item.autocontinue),
                param1=param1,
                param2=param2,
                param3=param3,
                param4=param4,
                x=place[0],
                y=place[1],
                z=place[2],
            )
        )
    return tuple(items)


def _params(item: MissionItem, rules: AutopilotRules) -> tuple[float, float, float, float]:
    unused = UNUSED_PARAMS.get(item.command, frozenset())
    if rules.name == "ardupilot" and item.has_position:
        unused = unused | {4}  # the nose follows the leg whatever is sent
    one, two, three, four = (
        0.0 if number in unused and math.isnan(value) else value
        for number, value in enumerate(item.params, start=1)
    )
    return one, two, three, four


def has_home_item(items: Sequence[WireItem], rules: AutopilotRules) -> bool:
    """Whether item 0 is the vehicle's home and holds one (ArduPilot sends 0, 0 before it has any)."""
    return bool(rules.home_on_wire and items and (items[0].x or items[0].y))


def from_wire(
    items: Sequence[WireItem], rules: AutopilotRules, home: HomePosition | None = None, mav_type: int = 2
) -> tuple[Mission, tuple[Problem, ...]]:
    """Return the mission that a vehicle holds, and what had to be assumed about it.

    Parameters
    ----------
    items
        All items as the vehicle sent them, item 0 first.
    rules
        The vehicle's firmware.
    home
        HOME_POSITION where the vehicle gave one; used where item 0 does not say.
    mav_type
        MAV_TYPE of the vehicle.

    Returns
    -------
    mission, warnings
        Without any home the first position of the mission stands in, at altitude 0, with a warning.
    """
    warnings: list[Problem] = []
    flown = items[1:] if rules.home_on_wire else items
    offset = int(rules.home_on_wire)
    if has_home_item(items, rules):
        home = HomePosition(items[0].x, items[0].y, items[0].z)
    mission_items = tuple(_from_wire_item(item, offset) for item in flown)
    if home is None:
        first = next(
            (item for item in mission_items if item.has_position and (item.lat_e7 or item.lon_e7)), None
        )
        home = HomePosition(first.lat_e7, first.lon_e7, 0.0) if first else HomePosition(0, 0, 0.0)
        stand_in = "the first position of the mission" if first else "latitude 0, longitude 0"
        warnings.append(
            Problem(
                "home", f"the vehicle gave none, so {stand_in} stands in, at altitude 0", "no-home", "warning"
            )
        )
    return Mission(mission_items, home, rules.name, mav_type), tuple(warnings)


def _from_wire_item(item: WireItem, offset: int) -> MissionItem:
    params = item.params
    if item.command == Command.DO_JUMP:
        params = (params[0] - offset, *params[1:])
    known_bare = item.command in KNOWN_COMMANDS and not MissionItem(item.command, item.frame).has_position
    if known_bare:
        return MissionItem(item.command, int(Frame.MISSION), params, autocontinue=bool(item.autocontinue))
    frame = plain_frame(item.frame)
    return MissionItem(item.command, frame, params, item.x, item.y, item.z, bool(item.autocontinue))
