"""The one place where a session meets a clock and a connection: `upload_mission` and `download_mission`."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from mavplan.errors import InputError, MavplanError, NoLinkError, Problem, SilentLinkError, UncertainError
from mavplan.link.codec import Codec
from mavplan.link.connection import Connection
from mavplan.link.download_session import DownloadSession
from mavplan.link.home import MAX_HOME_DISTANCE_M, MAX_HOME_HEIGHT_M
from mavplan.link.outbox import Progress
from mavplan.link.protocol import MissionType, sender
from mavplan.link.report import DiffersError, UploadReport
from mavplan.link.session import Session
from mavplan.link.transfers import OWN, Transfers
from mavplan.link.upload_session import UploadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot, Mission
from mavplan.mission.uploadable import check_uploadable, item_count

if TYPE_CHECKING:
    from mavplan.link.mavsdk import Station

MAX_SLEEP_S = 0.5
STATION_SLEEP_S = 0.002
"""MAVSDK has threads of its own, and what they want to be sent wakes nobody."""
DOWNLOAD_DEADLINE_S = 120.0

ProgressCallback = Callable[[Progress], None]
Via = Literal["own", "mavsdk"]


def default_deadline_s(items: int) -> float:
    """Return the time an upload may take: enough for a radio that loses a third of its packets."""
    return 120.0 + 1.0 * items


def upload_mission(
    mission: Mission,
    connection: Connection,
    *,
    deadline_s: float | None = None,
    system: int | None = None,
    place: str = "this connection",
    allow_armed: bool = False,
    max_home_distance_m: float = MAX_HOME_DISTANCE_M,
    max_home_height_m: float = MAX_HOME_HEIGHT_M,
    source: str = "",
    progress: ProgressCallback | None = None,
    via: Via = "own",
) -> UploadReport:
    """Store a mission with its fence and rally points on the vehicle of a link, read them back and compare.

    Parameters
    ----------
    mission
        What to store.
    connection
        An open link, see `mavplan.link.connection.open_connection`.
    deadline_s
        Seconds after which it is over, whatever happens; None: two minutes and a second an item.
    system
        MAVLink system of the vehicle; None takes the only one on the line.
    place
        What to call the connection in messages.
    allow_armed
        Write also to a vehicle whose motors may turn.
    max_home_distance_m, max_home_height_m
        How far the vehicle's home may be from the mission's.
    source
        Where the mission comes from, for messages about it.
    progress
        Called with every step.
    via
        Who carries out the transfers: our own state machines or MAVSDK.

    Returns
    -------
    UploadReport
        Only when the vehicle gave back what it was sent.

    Raises
    ------
    InputError
        The mission cannot be sent as it is, or several vehicles are on the line.
    NoLinkError
        No vehicle was heard.
    RefusedError
        Refused, and the old mission is kept; or PX4 judges the stored mission not flyable; or the vehicle's home is
        elsewhere.
    UncertainError
        What the vehicle holds is not known, or is not what was sent (then with ``differences``).
    """
    if mission.autopilot is not None:
        check_uploadable(mission, AUTOPILOTS[mission.autopilot], source)
    with _carrier(via, connection) as (transfers, station):
        session = UploadSession(
            mission,
            now=time.monotonic() - connection.opening_s,
            deadline_s=default_deadline_s(item_count(mission)) if deadline_s is None else deadline_s,
            system=system,
            place=place,
            allow_armed=allow_armed,
            max_home_distance_m=max_home_distance_m,
            max_home_height_m=max_home_height_m,
            source=source,
            transfers=transfers,
        )
        drive(session, connection, progress, station)
    if session.report is None:
        raise session.error or MavplanError("the upload ended without an outcome")
    return dataclasses.replace(
        session.report, warnings=(*session.report.warnings, *dropped_warnings(connection))
    )


@dataclass(frozen=True, slots=True)
class Downloaded:
    """What a vehicle holds.

    Attributes
    ----------
    mission
        With its fence and its rally points.
    warnings
        What had to be assumed about it, and what was left out.
    fence_items, rally_items
        Items of the fence and of the rally points on the wire; None: not asked for, or not told.
    """

    mission: Mission
    warnings: tuple[Problem, ...]
    fence_items: int | None = None
    rally_items: int | None = None


def download_mission(
    connection: Connection,
    *,
    deadline_s: float = DOWNLOAD_DEADLINE_S,
    system: int | None = None,
    autopilot: Autopilot | None = None,
    mission_only: bool = False,
    place: str = "this connection",
    progress: ProgressCallback | None = None,
    via: Via = "own",
) -> Downloaded:
    """Fetch the mission that the vehicle of a link holds, its fence and its rally points.

    Parameters
    ----------
    connection, deadline_s, system, place, progress, via
        As for `upload_mission`.
    autopilot
        The firmware it must run; None takes either.
    mission_only
        Leave out its fence and its rally points.

    Raises
    ------
    NoLinkError
        No vehicle was heard.
    InputError
        Several vehicles are on the line.
    RefusedError
        It runs another firmware, is no multirotor, or does not give its mission.
    UncertainError
        It did not give all of it in time.
    CheckError
        It holds no mission.
    """
    with _carrier(via, connection) as (transfers, station):
        session = DownloadSession(
            now=time.monotonic() - connection.opening_s,
            deadline_s=deadline_s,
            system=system,
            place=place,
            wanted=autopilot,
            mission_only=mission_only,
            transfers=transfers,
        )
        drive(session, connection, progress, station)
    if session.mission is None:
        raise session.error or MavplanError("the download ended without an outcome")
    return Downloaded(
        session.mission,
        (*session.warnings, *dropped_warnings(connection)),
        session.count(MissionType.FENCE),
        session.count(MissionType.RALLY),
    )


@contextlib.contextmanager
def _carrier(via: Via, connection: Connection) -> "Iterator[tuple[Transfers, Station | None]]":
    """Give what makes the transfers, and MAVSDK where that is it."""
    if via == "own":
        yield OWN, None
        return
    if connection.signing is not None:
        raise InputError("MAVSDK has no signing: it cannot be used on a link with a key")
    try:
        from mavplan.link.mavsdk import Station
        from mavplan.link.mavsdk_transfers import mavsdk_transfers
    except ImportError as error:
        raise InputError(f"MAVSDK cannot be used here: {error}; pip install 'mavsdk>=4.1,<5'") from error
    with contextlib.closing(Station()) as station:
        yield mavsdk_transfers(station), station


def drive(
    session: Session,
    connection: Connection,
    progress: ProgressCallback | None = None,
    station: "Station | None" = None,
) -> None:
    """Run a session over a connection until it is done.

    An interrupt from the keyboard ends it with what is known; before a vehicle was found it is passed on.

    Parameters
    ----------
    session, connection, progress
        What to do, over what, and whom to tell.
    station
        MAVSDK, where it carries out the session's transfers.
    """
    codec = Codec(session.us, connection.signing)
    try:
        while not session.done:
            _step(session, connection, codec, progress, station)
    except KeyboardInterrupt:
        session.interrupt(time.monotonic())
        if not session.done:
            raise
    _send(session, connection, codec, station)
    _tell(session, progress)
    if session.error is not None:
        session.error = _explained(session.error, codec)


def dropped_warnings(connection: Connection) -> list[Problem]:
    """Return what is to be said of frames that were not signed as they should be, or were another vehicle's."""
    words = connection.signing.dropped_words() if connection.signing is not None else ""
    found = [Problem("signing", words, "not-signed", "warning")] if words else []
    if connection.rival is not None:
        said = (
            f"{connection.rival} sends as the same system, too, and was not listened to: if that is another vehicle, "
            "give each its own system id"
        )
        found.append(Problem("system id", said, "same-system", "warning"))
    return found


def _explained(error: MavplanError, codec: Codec) -> MavplanError:
    """Return an error with what signing may have to do with it."""
    words = codec.signing.dropped_words() if codec.signing is not None else ""
    unanswered = isinstance(error, UncertainError) and not isinstance(error, DiffersError)
    if codec.signing is None and codec.signed and unanswered:
        words = "the vehicle signs its messages: it may listen only to the holder of its key (--signing-key)"
    if not words:
        return error
    if isinstance(error, SilentLinkError):
        return NoLinkError(f"{error}; {words}")
    error.args = (f"{error}; {words}",)
    return error


def _send(session: Session, connection: Connection, codec: Codec, station: "Station | None") -> None:
    for message in session.to_send():
        connection.write(codec.encode(message))
    for message in station.to_send(time.monotonic()) if station is not None else ():
        connection.write(codec.encode(message))


def _step(
    session: Session,
    connection: Connection,
    codec: Codec,
    progress: ProgressCallback | None,
    station: "Station | None",
) -> None:
    now = time.monotonic()
    session.tick(now)
    _send(session, connection, codec, station)
    _tell(session, progress)
    if session.done:
        return
    timer = session.next_timer()
    longest_s = MAX_SLEEP_S if station is None else STATION_SLEEP_S
    wait_s = longest_s if timer is None else min(longest_s, max(0.0, timer - time.monotonic()))
    data = connection.read(wait_s)
    now = time.monotonic()
    for message in codec.decode(data, now):
        if session.vehicle is not None and sender(message) == session.vehicle.address:
            if connection.from_rival():
                continue  # another vehicle with the same ids
            connection.hold_peer()
            if station is not None:
                station.feed(message)
        session.receive(message, now)
    _send(session, connection, codec, station)  # an answer waits for nothing else that is due


def _tell(session: Session, progress: ProgressCallback | None) -> None:
    for event in session.events():
        if progress is not None:
            progress(event)
