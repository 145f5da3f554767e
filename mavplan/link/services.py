"""What else can be done with the vehicle of a link: `clear_vehicle`, `verify_mission`, `vehicle_info`.

Each runs a session of its own over a connection, as `mavplan.link.vehicle` does for uploads and downloads.
"""

import time
from collections.abc import Sequence

from mavplan.errors import MavplanError
from mavplan.link.clear_session import ClearReport, ClearSession
from mavplan.link.connection import Connection
from mavplan.link.info_session import InfoSession, VehicleInfo
from mavplan.link.vehicle import DOWNLOAD_DEADLINE_S, ProgressCallback, drive
from mavplan.link.verify_session import VerifyReport, VerifySession
from mavplan.mission.model import Mission

CLEAR_DEADLINE_S = 60.0
INFO_DEADLINE_S = 30.0


def clear_vehicle(
    kinds: Sequence[int],
    connection: Connection,
    *,
    deadline_s: float = CLEAR_DEADLINE_S,
    system: int | None = None,
    place: str = "this connection",
    allow_armed: bool = False,
    progress: ProgressCallback | None = None,
) -> ClearReport:
    """Clear lists of a vehicle, and see that nothing is held of them.

    Parameters
    ----------
    kinds
        MAV_MISSION_TYPEs: 0 mission, 1 fence, 2 rally points.
    connection, deadline_s, system, place, allow_armed, progress
        As for `mavplan.link.vehicle.upload_mission`.

    Raises
    ------
    NoLinkError, InputError
        No vehicle was heard; several are on the line.
    RefusedError
        It is armed, or does not clear while it flies; it keeps what it had.
    UncertainError
        Whether the lists are cleared is not known.
    """
    session = ClearSession(
        kinds,
        now=time.monotonic() - connection.opening_s,
        deadline_s=deadline_s,
        system=system,
        place=place,
        allow_armed=allow_armed,
    )
    drive(session, connection, progress)
    if session.report is None:
        raise session.error or MavplanError("the clearing ended without an outcome")
    return session.report


def verify_mission(
    mission: Mission,
    connection: Connection,
    *,
    deadline_s: float = DOWNLOAD_DEADLINE_S,
    system: int | None = None,
    place: str = "this connection",
    source: str = "",
    progress: ProgressCallback | None = None,
) -> VerifyReport:
    """Tell whether a vehicle holds this mission, with its fence and its rally points.

    Parameters
    ----------
    mission
        What it should hold.
    connection, deadline_s, system, place, source, progress
        As for `mavplan.link.vehicle.upload_mission`.

    Raises
    ------
    NoLinkError, InputError
        No vehicle was heard; several are on the line, or the mission is none that could be there.
    CheckError
        It holds something else (then with ``differences``), or runs another firmware.
    UncertainError
        It could not be had from the vehicle.
    """
    session = VerifySession(
        mission,
        now=time.monotonic() - connection.opening_s,
        deadline_s=deadline_s,
        system=system,
        place=place,
        source=source,
    )
    drive(session, connection, progress)
    if session.report is None:
        raise session.error or MavplanError("the verification ended without an outcome")
    return session.report


def vehicle_info(
    connection: Connection,
    *,
    deadline_s: float = INFO_DEADLINE_S,
    system: int | None = None,
    place: str = "this connection",
    progress: ProgressCallback | None = None,
) -> VehicleInfo:
    """Return what a vehicle is and holds; parameters as for `mavplan.link.vehicle.upload_mission`.

    Raises
    ------
    NoLinkError, InputError
        No vehicle was heard; several are on the line.
    RefusedError
        It runs a firmware that is not known here.
    """
    session = InfoSession(
        now=time.monotonic() - connection.opening_s, deadline_s=deadline_s, system=system, place=place
    )
    drive(session, connection, progress)
    if session.info is None or not session.done or session.error is not None:
        raise session.error or MavplanError("asking the vehicle ended without an outcome")
    return session.info
