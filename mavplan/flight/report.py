"""What is told of a flight: its events as they happen, and `FlightReport` when it is over. No I/O."""

from collections.abc import Callable
from dataclasses import dataclass, field

from mavplan.errors import MavplanError, Problem
from mavplan.flight.preflight import Check
from mavplan.flight.progress import MissionProgress
from mavplan.flight.telemetry import Battery
from mavplan.link.protocol import Address
from mavplan.mission.model import Autopilot

OUTCOMES: dict[int, str] = {0: "flown", 3: "no link", 4: "not started", 5: "uncertain", 6: "ended otherwise"}
"""By exit code; a mission that is to stay ends with ``stays``."""


@dataclass(frozen=True, slots=True)
class FlightEvent:
    """Something that happened.

    Attributes
    ----------
    flight_s
        Seconds since the start, on the vehicle's clock where it tells it.
    kind
        Short and stable: ``start``, ``mode``, ``stop``, ``air``, ``link``, ``text``, ``order``, ``mission``,
        ``vehicle``, ``end``.
    words
        For people.
    """

    flight_s: float
    kind: str
    words: str


@dataclass(frozen=True, slots=True)
class FlightReport:
    """What came of a flight.

    Attributes
    ----------
    outcome
        ``flown``, ``stays``, ``not started``, ``ended otherwise``, ``uncertain``.
    words
        One sentence.
    autopilot, vehicle
        Firmware and address.
    flight_s, forecast_s
        From the start to the end on the vehicle's clock, and what was forecast.
    items_done, items
        Of the mission.
    stops_done, stops
        Numbers of the stops whose holds are over; how many there are.
    users_served
        Names of those whose stop is done, where a plan says who is served where.
    battery_before, battery_after
        Percent; None where it was not told.
    unheard_s
        The longest silence.
    checks, events, warnings
        The list before the start, what happened, what else should be known.
    """

    outcome: str
    words: str
    autopilot: Autopilot
    vehicle: Address
    flight_s: float
    forecast_s: float
    items_done: int
    items: int
    stops_done: tuple[int, ...]
    stops: int
    users_served: tuple[str, ...]
    battery_before: int | None
    battery_after: int | None
    unheard_s: float
    checks: tuple[Check, ...] = ()
    events: tuple[FlightEvent, ...] = ()
    warnings: tuple[Problem, ...] = field(default=())


class FlightLog:
    """The events of one flight.

    Parameters
    ----------
    flight_s
        Gives the seconds since the start at one of our times.
    """

    def __init__(self, flight_s: Callable[[float], float]) -> None:
        self._flight_s = flight_s
        self._all: list[FlightEvent] = []
        self._told = 0

    def add(self, kind: str, words: str, now: float) -> None:
        """Note that something happened; what is only known later is told no earlier than what was told before."""
        told_s = self._all[-1].flight_s if self._all else 0.0
        self._all.append(FlightEvent(max(told_s, round(self._flight_s(now), 1)), kind, words))

    def news(self) -> list[FlightEvent]:
        """Return what was added since the last call."""
        news, self._told = self._all[self._told :], len(self._all)
        return news

    def all(self) -> tuple[FlightEvent, ...]:
        """Return everything."""
        return tuple(self._all)


def make_report(
    words: str,
    error: MavplanError | None,
    *,
    stays: bool,
    progress: MissionProgress,
    autopilot: Autopilot,
    vehicle: Address,
    flight_s: float,
    before: Battery | None,
    after: Battery | None,
    unheard_s: float,
    checks: tuple[Check, ...],
    events: tuple[FlightEvent, ...],
) -> FlightReport:
    """Put together what came of a flight; parameters as the attributes of `FlightReport`."""
    route, done = progress.route, progress.stops_done
    outcome = OUTCOMES[int(error.exit_code) if error is not None else 0]
    return FlightReport(
        outcome="stays" if error is None and stays else outcome,
        words=words,
        autopilot=autopilot,
        vehicle=vehicle,
        flight_s=flight_s,
        forecast_s=route.mission_s,
        items_done=progress.items_done,
        items=route.count,
        stops_done=tuple(stop.number for stop in done),
        stops=len(route.stops),
        users_served=tuple(name for stop in done for name in stop.users),
        battery_before=before.percent if before is not None else None,
        battery_after=after.percent if after is not None else None,
        unheard_s=unheard_s,
        checks=checks,
        events=events,
    )
