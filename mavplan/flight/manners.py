"""How each autopilot is started, held and sent home: modes and numbers. Measured; see docs/fly.md.

Modes are the ``custom_mode`` of HEARTBEAT. ArduPilot numbers them; PX4 packs a main and a sub mode.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from mavplan.flight.command import CommandLong
from mavplan.mission.build import End
from mavplan.mission.model import Autopilot

DO_SET_MODE = 176
COMPONENT_ARM_DISARM = 400
MISSION_START = 300
CUSTOM_MODE_ENABLED = 1.0
"""param1 of DO_SET_MODE."""


@dataclass(frozen=True, slots=True)
class FlightManners:
    """The manners of one firmware in flight.

    Attributes
    ----------
    first_seq
        Number on the wire of the first item that is flown.
    start_seqs
        MISSION_CURRENT's ``seq`` from which a start begins with the first item.
    arms_itself
        MISSION_START alone arms, switches and takes off; else it is armed in `arming_mode` first.
    arming_mode
        Where it is armed; None where it arms itself.
    mission_mode
        Flying its mission.
    end_modes
        Where the mission itself leads at its end, by what that is.
    hold_modes
        What keeps it where it is, the best first. None that follows the sticks.
    return_mode
        The way home.
    """

    first_seq: int
    start_seqs: frozenset[int]
    arms_itself: bool
    arming_mode: int | None
    mission_mode: int
    end_modes: Mapping[End, frozenset[int]]
    hold_modes: tuple[int, ...]
    return_mode: int


def px4_mode(main: int, sub: int) -> int:
    """Return PX4's ``custom_mode``."""
    return main << 16 | sub << 24


_AUTO, _GUIDED, _RTL, _BRAKE = 3, 4, 6, 17
_PX4_HOLD, _PX4_MISSION, _PX4_RETURN, _PX4_LAND = (px4_mode(4, sub) for sub in (3, 4, 5, 6))

FLIGHT_MANNERS: dict[Autopilot, FlightManners] = {
    "ardupilot": FlightManners(
        first_seq=1,
        start_seqs=frozenset({0, 1}),
        arms_itself=False,
        arming_mode=_GUIDED,  # arming in AUTO is refused by default
        mission_mode=_AUTO,
        end_modes={},  # a return at the mission's end is flown in AUTO
        hold_modes=(_BRAKE, _GUIDED),  # LOITER takes its climb from the throttle stick
        return_mode=_RTL,
    ),
    "px4": FlightManners(
        first_seq=0,
        start_seqs=frozenset({0}),
        arms_itself=True,
        arming_mode=None,
        mission_mode=_PX4_MISSION,
        end_modes={
            "rtl": frozenset({_PX4_RETURN, _PX4_LAND}),
            "land": frozenset({_PX4_LAND, _PX4_HOLD}),
            "stay": frozenset({_PX4_HOLD}),
        },
        hold_modes=(_PX4_HOLD,),
        return_mode=_PX4_RETURN,
    ),
}


def set_mode(autopilot: Autopilot, mode: int) -> CommandLong:
    """Return the command that switches to a mode."""
    if autopilot == "ardupilot":
        return CommandLong(DO_SET_MODE, (CUSTOM_MODE_ENABLED, float(mode)))
    return CommandLong(DO_SET_MODE, (CUSTOM_MODE_ENABLED, float(mode >> 16 & 0xFF), float(mode >> 24 & 0xFF)))


ARM = CommandLong(COMPONENT_ARM_DISARM, (1.0,))
"""With the vehicle's own checks: nothing is forced."""
START = CommandLong(MISSION_START, ())
"""From the first item to the last: 0, 0."""
