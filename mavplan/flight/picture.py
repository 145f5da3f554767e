"""What is shown of a flight at one moment: `Picture`. Data only; `mavplan.cli` draws it."""

from dataclasses import dataclass

from mavplan.flight.phases import Phase
from mavplan.flight.route import Stop


@dataclass(frozen=True, slots=True)
class Picture:
    """One moment of a flight; None: not known.

    Attributes
    ----------
    phase
        Where it stands.
    items_done, items, current
        Of the mission; ``current`` is its number on the wire.
    stop, stops, hold_left_s
        The stop that it flies to or holds at, how many there are, and the seconds left of its hold (None: on the way).
    stops_done, users_served, users
        Stops whose holds are over, and how many users were to be served there, of how many.
    flight_s, left_s
        Seconds since the start, and to the end by the forecast, on the vehicle's clock.
    mode, armed, alt_rel_m, battery_percent, voltage_v
        As last heard.
    silent_s
        Seconds since the vehicle was last heard.
    order
        What the user ordered and is not yet done, or empty.
    """

    phase: Phase
    items_done: int
    items: int
    current: int | None
    stop: Stop | None
    stops: int
    hold_left_s: float | None
    stops_done: int
    users_served: int
    users: int
    flight_s: float
    left_s: float
    mode: str
    armed: bool
    alt_rel_m: float | None
    battery_percent: int | None
    voltage_v: float | None
    silent_s: float
    order: str = ""
