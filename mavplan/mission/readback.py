"""What a vehicle gives back compared with what it was sent: `differences`, under a table of what each autopilot keeps.

Anything that is not an allowed replacement of the table is a difference. Measured on ArduCopter 4.7.0-dev and PX4
of August 2025. Each of a vehicle's three lists (mission, fence, rally points) has a table of its own. Not compared:
home (item 0 of a mission on ArduPilot, which keeps its own) and the ``current`` flag, which shows where the vehicle is
in its mission.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import POSITION_COMMANDS, Autopilot, Command, Frame, ListCommand
from mavplan.mission.sendable import command_name
from mavplan.mission.wire import KNOWN_COMMANDS, WireItem, plain_frame

LAT_LON_TOLERANCE_E7 = 1
"""Other clients cut off where we round; 1 unit is 1.1 cm."""


class Kept(Enum):
    """What an autopilot makes of one parameter."""

    EXACT = "the number sent, as float32"
    ZERO = "0 whatever was sent"
    SIGN = "+1 or -1 by the sign of what was sent"
    FLAG = "0 or 1"
    HEADING = "the angle sent, turned into 0 to 360; NaN stays"


@dataclass(frozen=True, slots=True)
class Keeps:
    """What one autopilot keeps of its items.

    Attributes
    ----------
    params
        For each command what becomes of param1 to param4. A command that is not here keeps all exactly.
    alt_tolerance_m
        How far an altitude may be off.
    bare_frames
        Frames in which an item without a position may come back.
    autocontinue
        How the flag reads; None: as it was sent.
    frame
        The frame in which every position reads; None: the one that was sent, in either spelling.
    altitude
        Whether altitudes are kept (else they read 0).
    """

    params: dict[int, tuple[Kept, Kept, Kept, Kept]]
    alt_tolerance_m: float
    bare_frames: frozenset[int]
    autocontinue: int | None
    frame: int | None = None
    altitude: bool = True


_EXACT, _ZERO = Kept.EXACT, Kept.ZERO

KEEPS: dict[Autopilot, Keeps] = {
    "ardupilot": Keeps(
        params={
            Command.NAV_WAYPOINT: (_EXACT, _ZERO, _ZERO, _ZERO),
            Command.NAV_LOITER_UNLIM: (_ZERO, _ZERO, _EXACT, _ZERO),
            Command.NAV_LOITER_TIME: (_EXACT, _ZERO, Kept.SIGN, Kept.FLAG),
            Command.NAV_LAND: (_EXACT, _ZERO, _ZERO, Kept.SIGN),  # the way it turns
            Command.NAV_TAKEOFF: (_EXACT, _ZERO, _ZERO, _ZERO),
            Command.NAV_RETURN_TO_LAUNCH: (_ZERO, _ZERO, _ZERO, _ZERO),
            Command.NAV_DELAY: (_EXACT, _EXACT, _EXACT, _EXACT),
            Command.DO_JUMP: (_EXACT, _EXACT, _ZERO, _ZERO),
            Command.DO_CHANGE_SPEED: (_EXACT, _EXACT, _EXACT, _ZERO),
        },
        alt_tolerance_m=0.01,
        bare_frames=frozenset({Frame.GLOBAL, Frame.MISSION}),
        autocontinue=1,
    ),
    "px4": Keeps(
        params={
            Command.NAV_WAYPOINT: (_EXACT, _EXACT, _ZERO, Kept.HEADING),
            Command.NAV_LOITER_UNLIM: (_ZERO, _ZERO, _EXACT, Kept.HEADING),
            # param4 reads back as a flag although in flight it is the heading.
            Command.NAV_LOITER_TIME: (_EXACT, Kept.FLAG, _EXACT, Kept.FLAG),
            Command.NAV_LAND: (_ZERO, _EXACT, _ZERO, Kept.HEADING),
            Command.NAV_TAKEOFF: (_ZERO, _ZERO, _ZERO, Kept.HEADING),
        },
        alt_tolerance_m=0.0,
        bare_frames=frozenset({Frame.MISSION}),
        autocontinue=None,
    ),
}
"""Of a mission's items (mission type 0)."""

_FIRST_ONLY = (_EXACT, _ZERO, _ZERO, _ZERO)
_FENCE_PARAMS: dict[int, tuple[Kept, Kept, Kept, Kept]] = {
    ListCommand.NAV_FENCE_RETURN_POINT: (_ZERO, _ZERO, _ZERO, _ZERO),
    ListCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION: _FIRST_ONLY,
    ListCommand.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: _FIRST_ONLY,
    ListCommand.NAV_FENCE_CIRCLE_INCLUSION: _FIRST_ONLY,
    ListCommand.NAV_FENCE_CIRCLE_EXCLUSION: _FIRST_ONLY,
}
_RALLY_PARAMS: dict[int, tuple[Kept, Kept, Kept, Kept]] = {
    ListCommand.NAV_RALLY_POINT: (_ZERO, _ZERO, _ZERO, _ZERO)
}

KEEPS_FENCE: dict[Autopilot, Keeps] = {
    "ardupilot": Keeps(_FENCE_PARAMS, 0.0, frozenset(), autocontinue=0, frame=Frame.GLOBAL, altitude=False),
    "px4": Keeps(_FENCE_PARAMS, 0.0, frozenset(), autocontinue=0, frame=Frame.GLOBAL_INT, altitude=False),
}
"""Of a fence's items (mission type 1)."""

KEEPS_RALLY: dict[Autopilot, Keeps] = {
    # ArduPilot cuts altitudes to whole metres; no others are sent, so they come back as they were.
    "ardupilot": Keeps(_RALLY_PARAMS, 0.0, frozenset(), autocontinue=0),
    "px4": Keeps(_RALLY_PARAMS, 0.0, frozenset(), autocontinue=None),
}
"""Of rally points (mission type 2)."""

KEEPS_OF_TYPE = {0: KEEPS, 1: KEEPS_FENCE, 2: KEEPS_RALLY}
"""By MAV_MISSION_TYPE."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One field of one item that came back as something else than it may.

    Attributes
    ----------
    seq
        Item number on the wire, or None for the number of items.
    field
        Field of MISSION_ITEM_INT, or ``count``.
    sent, stored
        What was sent, and what the vehicle gave back.
    words
        The same in a sentence.
    """

    seq: int | None
    field: str
    sent: float
    stored: float
    words: str

    def __str__(self) -> str:
        """Return the sentence."""
        return self.words


def differences(
    sent: Sequence[WireItem], received: Sequence[WireItem], rules: AutopilotRules, mission_type: int = 0
) -> list[Difference]:
    """Compare a read-back with what was sent.

    Parameters
    ----------
    sent
        The items of the upload, as `mavplan.mission.wire.to_wire` or one of `mavplan.mission.fence_wire` made them.
    received
        The items that the vehicle gave back, in order.
    rules
        The vehicle's firmware.
    mission_type
        MAV_MISSION_TYPE of the list: 0 mission, 1 fence, 2 rally points.

    Returns
    -------
    list of Difference
        Empty exactly when the vehicle holds what was sent, as far as it lets one see.
    """
    found: list[Difference] = []
    if len(sent) != len(received):
        words = f"{len(sent)} items were sent, {len(received)} are stored"
        found.append(Difference(None, "count", len(sent), len(received), words))
    for ours, theirs in zip(sent, received, strict=False):
        if mission_type == 0 and rules.home_on_wire and ours.seq == 0:
            continue
        found += _item_differences(ours, theirs, KEEPS_OF_TYPE[mission_type][rules.name])
    return found


def _item_differences(ours: WireItem, theirs: WireItem, keeps: Keeps) -> list[Difference]:
    if ours.seq != theirs.seq:
        return [_difference(ours, "seq", ours.seq, theirs.seq)]
    if ours.command != theirs.command:
        words = f"item {ours.seq}: {command_name(ours.command)} was sent, {command_name(theirs.command)} is stored"
        return [Difference(ours.seq, "command", ours.command, theirs.command, words)]
    found: list[Difference] = []
    if not _frame_is_kept(ours, theirs, keeps):
        found.append(_difference(ours, "frame", ours.frame, theirs.frame))
    if theirs.autocontinue != (ours.autocontinue if keeps.autocontinue is None else keeps.autocontinue):
        found.append(_difference(ours, "autocontinue", ours.autocontinue, theirs.autocontinue))
    exact = (_EXACT, _EXACT, _EXACT, _EXACT)
    kinds = keeps.params.get(ours.command, exact)
    for number, (kind, mine, yours) in enumerate(
        zip(kinds, ours.params, theirs.params, strict=True), start=1
    ):
        if not _is_kept(kind, mine, yours):
            found.append(_difference(ours, f"param{number}", mine, yours))
    for field, here, there in (("x", ours.x, theirs.x), ("y", ours.y, theirs.y)):
        if abs(here - there) > LAT_LON_TOLERANCE_E7:
            found.append(_difference(ours, field, here, there))
    if not _altitude_is_kept(ours.z if keeps.altitude else 0.0, theirs.z, keeps.alt_tolerance_m):
        found.append(_difference(ours, "z", ours.z, theirs.z))
    return found


def _frame_is_kept(ours: WireItem, theirs: WireItem, keeps: Keeps) -> bool:
    if ours.command in KNOWN_COMMANDS - POSITION_COMMANDS:
        return theirs.frame in keeps.bare_frames
    if keeps.frame is not None:
        return theirs.frame == keeps.frame
    return plain_frame(ours.frame) == plain_frame(theirs.frame)


def float32(value: float) -> float:
    """Return the number as MAVLink carries it; beyond float32's range infinity."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _same(sent: float, stored: float) -> bool:
    return (math.isnan(sent) and math.isnan(stored)) or float32(sent) == float32(stored)


def _is_kept(kind: Kept, sent: float, stored: float) -> bool:
    if _same(sent, stored):
        return True
    match kind:
        case Kept.EXACT:
            return False
        case Kept.ZERO:
            return stored == 0
        case Kept.SIGN:
            return stored == (-1 if sent < 0 else 1)
        case Kept.FLAG:
            return stored in {0, 1}
        case Kept.HEADING:
            turn = (stored - sent) % 360
            return min(turn, 360 - turn) < 1e-3  # false for NaN


def _altitude_is_kept(sent: float, stored: float, tolerance_m: float) -> bool:
    if not tolerance_m:
        return _same(sent, stored)
    # float32 cannot tell neighbouring centimetres apart above about 80 km; its own step is allowed on top
    return abs(float32(sent) - stored) <= tolerance_m + 2.4e-7 * abs(sent) + 1e-9


FIELD_WORDS = {
    "x": "latitude (1e-7 degrees)",
    "y": "longitude (1e-7 degrees)",
    "z": "altitude (m)",
}
LIST_PARAM1: dict[int, str] = {
    ListCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION: "number of vertices",
    ListCommand.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "number of vertices",
    ListCommand.NAV_FENCE_CIRCLE_INCLUSION: "radius (m)",
    ListCommand.NAV_FENCE_CIRCLE_EXCLUSION: "radius (m)",
}


def _difference(item: WireItem, field: str, sent: float, stored: float) -> Difference:
    name = FIELD_WORDS.get(field, field)
    if field == "param1" and item.command in {Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME}:
        name = "hold (s)"
    elif field == "param1":
        name = LIST_PARAM1.get(item.command, field)
    words = (
        f"item {item.seq} ({command_name(item.command)}): {name} {sent:.9g} was sent, {stored:.9g} is stored"
    )
    return Difference(item.seq, field, sent, stored, words)
