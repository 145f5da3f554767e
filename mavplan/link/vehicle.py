"""The one place where a session meets a clock and a connection: `upload_mission` and `download_mission`."""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass

from mavplan.errors import MavplanError, Problem, UncertainError
from mavplan.link.codec import Codec
from mavplan.link.connection import Connection
from mavplan.link.download_session import DownloadSession
from mavplan.link.protocol import sender
from mavplan.link.report import UploadReport
from mavplan.link.session import Session
from mavplan.link.transfer import Progress
from mavplan.link.upload_session import UploadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot, Mission
from mavplan.mission.sendable import check_sendable

MAX_SLEEP_S = 0.5
DOWNLOAD_DEADLINE_S = 120.0

ProgressCallback = Callable[[Progress], None]


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
    source: str = "",
    progress: ProgressCallback | None = None,
) -> UploadReport:
    """Store a mission on the vehicle of a link, read it back and compare.

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
    source
        Where the mission comes from, for messages about it.
    progress
        Called with every step.

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
        Refused, and the old mission is kept; or PX4 judges the stored mission not flyable.
    UncertainError
        What the vehicle holds is not known, or is not what was sent (then with ``differences``).
    """
    if mission.autopilot is not None:
        check_sendable(mission, AUTOPILOTS[mission.autopilot], source)
    session = UploadSession(
        mission,
        now=time.monotonic(),
        deadline_s=default_deadline_s(len(mission.items)) if deadline_s is None else deadline_s,
        system=system,
        place=place,
        allow_armed=allow_armed,
        source=source,
    )
    drive(session, connection, progress)
    if session.report is None:
        raise session.error or MavplanError("the upload ended without an outcome")
    return dataclasses.replace(
        session.report, warnings=(*session.report.warnings, *dropped_warnings(connection))
    )


@dataclass(frozen=True, slots=True)
class Downloaded:
    """A mission as a vehicle holds it, and what had to be assumed about it."""

    mission: Mission
    warnings: tuple[Problem, ...]


def download_mission(
    connection: Connection,
    *,
    deadline_s: float = DOWNLOAD_DEADLINE_S,
    system: int | None = None,
    autopilot: Autopilot | None = None,
    place: str = "this connection",
    progress: ProgressCallback | None = None,
) -> Downloaded:
    """Fetch the mission that the vehicle of a link holds.

    Parameters
    ----------
    connection, deadline_s, system, place, progress
        As for `upload_mission`.
    autopilot
        The firmware it must run; None takes either.

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
        It holds none.
    """
    session = DownloadSession(
        now=time.monotonic(), deadline_s=deadline_s, system=system, place=place, wanted=autopilot
    )
    drive(session, connection, progress)
    if session.mission is None:
        raise session.error or MavplanError("the download ended without an outcome")
    return Downloaded(session.mission, (*session.warnings, *dropped_warnings(connection)))


def drive(session: Session, connection: Connection, progress: ProgressCallback | None = None) -> None:
    """Run a session over a connection until it is done.

    An interrupt from the keyboard ends it with what is known; before a vehicle was found it is passed on.
    """
    codec = Codec(session.us, connection.signing)
    try:
        while not session.done:
            _step(session, connection, codec, progress)
    except KeyboardInterrupt:
        session.interrupt(time.monotonic())
        if not session.done:
            raise
    for message in session.to_send():
        connection.write(codec.encode(message))
    _tell(session, progress)
    if session.error is not None:
        _explain(session.error, codec)


def dropped_warnings(connection: Connection) -> list[Problem]:
    """Return what is to be said of frames that were not signed as they should be."""
    words = connection.signing.dropped_words() if connection.signing is not None else ""
    return [Problem("signing", words, "not-signed", "warning")] if words else []


def _explain(error: MavplanError, codec: Codec) -> None:
    """Add to an error what signing may have to do with it."""
    words = codec.signing.dropped_words() if codec.signing is not None else ""
    if codec.signing is None and codec.signed and isinstance(error, UncertainError):
        words = "the vehicle signs its messages: it may listen only to the holder of its key (--signing-key)"
    if words:
        error.args = (f"{error}; {words}",)


def _step(session: Session, connection: Connection, codec: Codec, progress: ProgressCallback | None) -> None:
    now = time.monotonic()
    session.tick(now)
    for message in session.to_send():
        connection.write(codec.encode(message))
    _tell(session, progress)
    if session.done:
        return
    timer = session.next_timer()
    wait_s = MAX_SLEEP_S if timer is None else min(MAX_SLEEP_S, max(0.0, timer - time.monotonic()))
    data = connection.read(wait_s)
    now = time.monotonic()
    for message in codec.decode(data, now):
        if session.vehicle is not None and sender(message) == session.vehicle.address:
            connection.hold_peer()
        session.receive(message, now)


def _tell(session: Session, progress: ProgressCallback | None) -> None:
    for event in session.events():
        if progress is not None:
            progress(event)
