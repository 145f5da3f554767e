"""Where a flight stands, and every legal move, as one table; docs/fly.md draws it.

A move that is not in the table raises `IllegalFlightMoveError` and changes nothing.
"""

from enum import Enum


class Phase(Enum):
    """Where a flight stands."""

    CHECKING = "checking"
    """The vehicle is being asked what the list before the start needs."""
    READY = "ready"
    """The list is complete; a yes is awaited. The checks go on."""
    REWINDING = "rewinding"
    """The mission is set to its first item, where it is not."""
    SWITCHING = "switching"
    """To the mode in which it can be armed (ArduPilot)."""
    ARMING = "arming"
    """The motors are asked for until they turn (ArduPilot)."""
    STARTING = "starting"
    """The mission is started; on PX4 this arms, too."""
    FLYING = "flying"
    """It is watched. Nothing is sent but what the user orders."""
    ENDED = "ended"
    """There is an outcome."""


class Move(Enum):
    """What takes a flight from one phase to another."""

    CHECKED = "checked"
    """Everything is known, and nothing stands against the flight."""
    WATCHED = "only watched"
    """Nothing is to be started."""
    APPROVED = "approved"
    """The user said yes."""
    REWOUND = "rewound"
    """It begins at the first item, and must be armed."""
    REWOUND_TO_START = "rewound to start"
    """It begins at the first item, and arms by itself."""
    SWITCHED = "switched"
    """It is in the mode for arming."""
    ARMED = "armed"
    """The motors may turn."""
    STARTED = "started"
    """It flies the mission."""
    BROKEN_OFF = "broken off"
    """Nothing more is asked for, but it may be armed: what becomes of it is watched."""
    REFUSED = "refused"
    """It stays on the ground, not armed."""
    FINISHED = "finished"
    """The flight is over, or its end is reached."""
    EXPIRED = "expired"
    """Time is over, the link is lost, or the user goes."""


TRANSITIONS: dict[tuple[Phase, Move], Phase] = {
    (Phase.CHECKING, Move.CHECKED): Phase.READY,
    (Phase.CHECKING, Move.WATCHED): Phase.FLYING,
    (Phase.CHECKING, Move.REFUSED): Phase.ENDED,
    (Phase.CHECKING, Move.EXPIRED): Phase.ENDED,
    (Phase.READY, Move.APPROVED): Phase.REWINDING,
    (Phase.READY, Move.REFUSED): Phase.ENDED,
    (Phase.READY, Move.EXPIRED): Phase.ENDED,
    (Phase.REWINDING, Move.REWOUND): Phase.SWITCHING,
    (Phase.REWINDING, Move.REWOUND_TO_START): Phase.STARTING,
    (Phase.REWINDING, Move.REFUSED): Phase.ENDED,
    (Phase.REWINDING, Move.EXPIRED): Phase.ENDED,
    (Phase.SWITCHING, Move.SWITCHED): Phase.ARMING,
    (Phase.SWITCHING, Move.REFUSED): Phase.ENDED,
    (Phase.SWITCHING, Move.EXPIRED): Phase.ENDED,
    (Phase.ARMING, Move.ARMED): Phase.STARTING,
    (Phase.ARMING, Move.BROKEN_OFF): Phase.FLYING,
    (Phase.ARMING, Move.REFUSED): Phase.ENDED,
    (Phase.ARMING, Move.EXPIRED): Phase.ENDED,
    (Phase.STARTING, Move.STARTED): Phase.FLYING,
    (Phase.STARTING, Move.BROKEN_OFF): Phase.FLYING,
    (Phase.STARTING, Move.REFUSED): Phase.ENDED,
    (Phase.STARTING, Move.EXPIRED): Phase.ENDED,
    (Phase.FLYING, Move.FINISHED): Phase.ENDED,
    (Phase.FLYING, Move.EXPIRED): Phase.ENDED,
}


class IllegalFlightMoveError(Exception):
    """A move that `TRANSITIONS` does not hold: a fault of ours."""


def moved(phase: Phase, move: Move) -> Phase:
    """Return the phase that a move leads to."""
    target = TRANSITIONS.get((phase, move))
    if target is None:
        raise IllegalFlightMoveError(f"a flight that is {phase.value} cannot be {move.value}")
    return target
