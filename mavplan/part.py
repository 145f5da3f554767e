"""Which of several flights a plan is: `Part`."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Part:
    """Which of several flights a plan is.

    Attributes
    ----------
    kind
        A sortie of one vehicle, flown after the one before it, or a vehicle of a fleet.
    number, of
        Counted from 1, and how many there are.
    name
        The vehicle's, where it has one.
    system
        Its MAVLink system id, where that is known.
    start_s
        When it starts, counted from the start of the first vehicle (in the same round of sorties); 0 for a sortie of
        one vehicle.
    not_served
        Users that none of the flights serves.
    round, rounds
        Of a vehicle of a fleet: in which round of sorties, counted from 1, and how many rounds there are.
    """

    kind: Literal["sortie", "vehicle"]
    number: int
    of: int
    name: str = ""
    system: int | None = None
    start_s: float = 0.0
    not_served: tuple[str, ...] = ()
    round: int = 1
    rounds: int = 1
