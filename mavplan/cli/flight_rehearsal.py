"""A flight of the mock vehicle in this process: the session that flies real ones, bytes between them, no clock.

Time jumps to whatever is due next, so that half an hour passes in seconds; every frame goes into a ``.tlog`` in
memory, as a recording of a real flight would.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavplan.errors import InputError, MavplanError, Problem
from mavplan.flight.conductor import FlySession
from mavplan.flight.preflight import Limits
from mavplan.flight.report import FlightReport
from mavplan.flight.route import make_route
from mavplan.flight.session import FlightSession
from mavplan.link.codec import Codec
from mavplan.link.upload_session import UploadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Mission
from mavplan.progress import Progress
from mavplan.track.tlog import record

if TYPE_CHECKING:
    from sitl_mock.faults import Faults
    from sitl_mock.flight.air import Wind
    from sitl_mock.network import FaultyNetwork

UPLOAD_DEADLINE_S = 600.0
SHOWN_S = 1.0
"""The session gets a position so often; the recording has all of them."""
_POSITION = b"\x21\x00\x00"
"""GLOBAL_POSITION_INT's number in the header of a MAVLink 2 frame."""
_LINK = "check"


@dataclass(frozen=True, slots=True)
class World:
    """What the mock flies in, and what goes wrong; the default is a calm day on which nothing does."""

    wind: "Wind"
    faults: "Faults"
    seed: int = 0


@dataclass(frozen=True, slots=True)
class RehearsedFlight:
    """What came of it.

    Attributes
    ----------
    report, error
        The session's outcome; no report where it never started.
    tlog
        Every frame of both directions, at the mock's time.
    """

    report: FlightReport | None
    error: MavplanError | None
    tlog: bytes


def make_world(wind: str | None, faults: str, seed: int) -> World:
    """Return the world that the command line asks for.

    Raises
    ------
    InputError
        The wind is none, or a fault is unknown.
    """
    from sitl_mock.faults import parse_faults
    from sitl_mock.flight.air import Wind

    speed, at, direction = (wind or "0").partition("@")
    try:
        blowing = Wind(float(speed), float(direction) if at else 0.0)
    except ValueError as error:
        why = error if str(error).startswith("wind") else "wind is SPEED@FROM in m/s and degrees, as in 6@270"
        raise InputError(f"--wind {wind}: {why}") from error
    try:
        return World(blowing, parse_faults(faults), seed)
    except ValueError as error:
        raise InputError(f"--fault {faults}: {error}") from error


def idle_faults(mission: Mission, world: World) -> Iterator[Problem]:
    """Yield a warning where a hold is to be cut that the mission does not have: items are the vehicle's numbers."""
    cut = world.faults.flight.hold_cut
    rules = AUTOPILOTS[mission.autopilot or "ardupilot"]
    if cut is not None and not make_route(mission, rules).hold_s.get(cut):
        message = f"item {cut} of the mission on {rules.title} holds nothing: nothing is cut"
        yield Problem("--fault hold-cut", message, "no-hold", "warning")


def rehearse_flight(
    mission: Mission,
    world: World,
    *,
    mass_kg: float | None = None,
    battery_wh: float | None = None,
    progress: Progress | None = None,
) -> RehearsedFlight:
    """Upload a mission to a fresh mock at its home, arm it, and let it fly to the end.

    Parameters
    ----------
    mission
        With its autopilot.
    world
        Wind and faults.
    mass_kg, battery_wh
        Of the vehicle; without a battery it does not run down.
    progress
        Gets the seconds flown and forecast.
    """
    from sitl_mock.autopilot import Autopilot as Mock
    from sitl_mock.firmware import FIRMWARES
    from sitl_mock.flight.pilot import Setting
    from sitl_mock.flight.power import REFERENCE_MASS_KG
    from sitl_mock.network import FaultyNetwork

    if mission.autopilot is None:
        raise ValueError("a mission without its autopilot cannot be flown")
    home = mission.home
    setting = Setting(
        seed=world.seed,
        wind=world.wind,
        battery_wh=battery_wh or 0.0,
        mass_kg=mass_kg or REFERENCE_MASS_KG,
        faults=world.faults.flight,
    )
    vehicle = Mock(
        FIRMWARES[mission.autopilot],
        home=(home.lat_e7 / 1e7, home.lon_e7 / 1e7, home.alt_amsl_m),
        setting=setting,
    )
    mock = FaultyNetwork(vehicle, world.faults, world.seed)
    session = _session(mission)
    tlog = _drive(session, mock, make_route(mission, AUTOPILOTS[mission.autopilot]).mission_s, progress)
    return RehearsedFlight(session.report, session.error, tlog)


def _session(mission: Mission) -> FlySession:
    """Return the session of an upload and a flight that begins at 0 s."""
    route = make_route(mission, AUTOPILOTS[mission.autopilot or "ardupilot"])
    limits = Limits(max_home_distance_m=500.0, max_home_height_m=30.0)
    first = UploadSession(mission, now=0.0, deadline_s=UPLOAD_DEADLINE_S, place="the mock vehicle")

    def make_flight(now: float, system: int) -> FlightSession:
        return FlightSession(mission, route, limits, now=now, system=system, place="the mock vehicle")

    return FlySession(first, make_flight)


def _drive(
    session: FlySession,
    mock: "FaultyNetwork",
    forecast_s: float,
    progress: Progress | None,
) -> bytes:
    """Let a session and a mock talk until the session is done; return what they said."""
    codec, tlog = Codec(session.us), bytearray()
    now, next_position, next_second = 0.0, 0.0, 0.0
    while not session.done:
        mock.tick(now)
        from_mock = [frame for to, frame in mock.to_send() if to in (_LINK, None)]
        for frame in from_mock:
            tlog += record(round(now * 1e6), frame)
            if frame[7:10] == _POSITION:
                if now < next_position:
                    continue
                next_position = now + SHOWN_S
            for message in codec.decode(frame, now):
                session.receive(message, now)
        timer = session.next_timer()
        if from_mock or timer is None or now >= timer:
            session.tick(now)
        if session.awaits_yes:
            session.approve(now, every_question=True)
        to_mock = session.to_send()
        for message in to_mock:
            frame = codec.encode(message)
            tlog += record(round(now * 1e6), frame)
            mock.receive(frame, _LINK, now)
        session.news()
        session.events()
        if now >= next_second:
            next_second = now + 1.0
            if progress is not None:
                progress(round(min(now, forecast_s)), round(forecast_s))
        if not from_mock and not to_mock:
            timers = (session.next_timer(), mock.next_timer())
            now = max(now + 1e-3, min((at for at in timers if at is not None), default=now))
    return bytes(tlog)
