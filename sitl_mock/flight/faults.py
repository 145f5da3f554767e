"""What may go wrong in flight; `sitl_mock.faults` reads it from a command line.

A fault strikes when the vehicle arrives at a mission item: when its hold begins, or when it is flown through.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class AtItem:
    """At which mission item, and how much: metres, seconds or nothing."""

    item: int
    amount: float = 0.0


@dataclass(frozen=True, slots=True)
class FlightFaults:
    """What goes wrong in flight; the default is nothing.

    Attributes
    ----------
    hold_cut
        The hold of this mission item is cut by half.
    gust
        A gust pushes the vehicle so many metres away and lets it come back.
    battery_drop
        Half of the energy that is left is lost.
    position_lost
        No position is sent for so many seconds.
    crash
        The motors stop and the vehicle falls.
    """

    hold_cut: int | None = None
    gust: AtItem | None = None
    battery_drop: int | None = None
    position_lost: AtItem | None = None
    crash: int | None = None
