"""What is shown of a flight at one moment: `Picture`. Data only; `mavplan.cli` draws it."""

from dataclasses import dataclass

from mavplan.flight.phases import Phase
from mavplan.flight.progress import MissionProgress
from mavplan.flight.route import Stop
from mavplan.flight.telemetry import Telemetry
from mavplan.link.modes import mode_name
from mavplan.mission.model import Autopilot


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
    follows
        The order that it follows in place of its mission, or empty: then nothing is known of the seconds to the end.
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
    left_s: float | None
    mode: str
    armed: bool
    alt_rel_m: float | None
    battery_percent: int | None
    voltage_v: float | None
    silent_s: float
    order: str = ""
    follows: str = ""


def take_picture(
    phase: Phase,
    autopilot: Autopilot,
    telemetry: Telemetry,
    progress: MissionProgress,
    *,
    start_s: float,
    order: str,
    follows: str,
    ended_at: float | None,
    now: float,
) -> Picture:
    """Return the picture of this moment.

    Parameters
    ----------
    phase, autopilot, telemetry, progress
        Where it stands, the firmware, and what is known.
    start_s
        When the flight began, on the vehicle's clock.
    order
        What the user ordered and is not yet done, or empty.
    follows
        The order that it follows in place of its mission, or empty.
    ended_at
        When the motors stopped; None: they turn.
    now
        The time.
    """
    clock_s = telemetry.clock.at(now if ended_at is None else min(now, ended_at))
    route, done = progress.route, progress.stops_done
    position, battery, mode = telemetry.position, telemetry.battery, telemetry.mode_now
    return Picture(
        phase=phase,
        items_done=progress.items_done,
        items=route.count,
        current=progress.current,
        stop=progress.stop,
        stops=len(route.stops),
        hold_left_s=progress.hold_left_s(clock_s) if phase is Phase.FLYING else None,
        stops_done=len(done),
        users_served=sum(len(stop.users) for stop in done),
        users=sum(len(stop.users) for stop in route.stops),
        flight_s=max(0.0, clock_s - start_s),
        left_s=None if follows else progress.left_s(clock_s),
        mode="" if mode is None else mode_name(autopilot, telemetry.base_mode, mode),
        armed=telemetry.armed_now,
        alt_rel_m=position.alt_rel_m if position is not None else None,
        battery_percent=battery.percent if battery is not None else None,
        voltage_v=battery.voltage_v if battery is not None else None,
        silent_s=max(0.0, now - telemetry.heard_at) if telemetry.heard_at is not None else 0.0,
        order=order,
        follows=follows,
    )
