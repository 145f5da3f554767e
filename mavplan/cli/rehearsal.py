"""An upload to a mock vehicle in this process: the real session and the real mock, bytes between them, no clock.

Time jumps to whatever is due next, so that minutes of time-outs pass in no time.
"""

from dataclasses import dataclass

from mavplan.errors import MavplanError
from mavplan.link.codec import Codec
from mavplan.link.report import UploadReport
from mavplan.link.upload_session import UploadSession
from mavplan.mission.model import Autopilot, Mission
from mavplan.mission.readback import Difference, differences
from mavplan.mission.wire import WireItem

DEADLINE_S = 600.0


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """What came of it.

    Attributes
    ----------
    report, error
        The session's outcome: one of the two.
    sent, stored
        The items sent, and those the mock holds at the end.
    """

    report: UploadReport | None
    error: MavplanError | None
    sent: tuple[WireItem, ...]
    stored: tuple[WireItem, ...]
    differences: tuple[Difference, ...]


def rehearse(mission: Mission, autopilot: Autopilot) -> Rehearsal:
    """Upload a mission to a fresh mock of this firmware, standing at the mission's home, and read it back."""
    from sitl_mock.autopilot import Autopilot as Mock
    from sitl_mock.firmware import FIRMWARES

    home = mission.home
    mock = Mock(
        FIRMWARES[autopilot],
        home=(home.lat_e7 / 1e7, home.lon_e7 / 1e7, home.alt_amsl_m),
        telemetry=False,
    )
    now = 0.0
    session = UploadSession(mission, now=now, deadline_s=DEADLINE_S, place="the mock vehicle")
    codec = Codec(session.us)
    while not session.done:
        mock.tick(now)
        from_mock = mock.to_send()
        for _, frame in from_mock:
            for message in codec.decode(frame, now):
                session.receive(message, now)
        session.tick(now)
        to_mock = session.to_send()
        for message in to_mock:
            mock.receive(codec.encode(message), "check", now)
        if not from_mock and not to_mock:
            timers = (session.next_timer(), mock.next_timer())
            now = max(now + 1e-3, min(timer for timer in timers if timer is not None))
    kept = tuple(
        WireItem(
            item.seq, item.frame, item.command, item.current, item.autocontinue,
            item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z,
        )
        for item in mock.stored()
    )  # fmt: skip
    found = tuple(differences(session.items, kept, session.rules)) if session.items else ()
    return Rehearsal(session.report, session.error, session.items, kept, found)
