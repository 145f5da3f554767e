"""A session against the mock vehicle in one process: a virtual clock, a bad radio between, no sockets, no waiting."""

from dataclasses import dataclass

from mavplan.errors import MavplanError
from mavplan.link.codec import Codec
from mavplan.link.session import Session
from mavplan.link.upload_session import UploadSession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot as AutopilotName
from mavplan.mission.model import Command, Frame, HomePosition, Mission, MissionItem
from mavplan.mission.readback import differences
from mavplan.mission.wire import WireItem, to_wire
from sitl_mock.autopilot import Autopilot
from sitl_mock.faults import parse_faults
from sitl_mock.firmware import FIRMWARES
from sitl_mock.network import FaultyNetwork

HOME = HomePosition(374_000_000, -1_221_000_000, 10.0)
LINK = "ground"


def make_mission(autopilot: AutopilotName, stops: int = 10, hold_s: float = 8.0) -> Mission:
    """Take-off, a speed, then a waypoint and a hold for each stop, and home: 2·stops + 3 items."""
    heading = AUTOPILOTS[autopilot].loiter_param4
    relative = Frame.GLOBAL_RELATIVE_ALT
    items = [
        MissionItem(Command.NAV_TAKEOFF, relative, (0, 0, 0, heading), HOME.lat_e7, HOME.lon_e7, 30.0),
        MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (1, 8, -1, 0)),
    ]
    for stop in range(stops):
        place = (HOME.lat_e7 + 9_000 * (stop + 1), HOME.lon_e7 + 700 * stop, 30.0 + 0.1 * stop)
        items.append(MissionItem(Command.NAV_WAYPOINT, relative, (0, 0, 0, heading), *place))
        items.append(MissionItem(Command.NAV_LOITER_TIME, relative, (hold_s + stop, 0, 0, heading), *place))
    items.append(MissionItem(Command.NAV_RETURN_TO_LAUNCH, Frame.MISSION))
    return Mission(tuple(items), HOME, autopilot)


@dataclass
class Run:
    """How a session went."""

    session: Session
    network: "Radio"
    ended_s: float
    sent: list[tuple[float, bytes]]

    @property
    def verified(self) -> bool:
        return isinstance(self.session, UploadSession) and self.session.report is not None

    @property
    def error(self) -> MavplanError | None:
        return self.session.error

    def holds(self, mission: Mission) -> bool:
        """Whether the vehicle really holds this mission, by the table of what it keeps."""
        rules = AUTOPILOTS[mission.autopilot or "ardupilot"]
        return not differences(to_wire(mission, rules), stored_items(self.network), rules)


def stored_items(network: FaultyNetwork) -> tuple[WireItem, ...]:
    """What the vehicle would give back, straight from its memory."""
    return tuple(
        WireItem(
            item.seq,
            item.frame,
            item.command,
            item.current,
            item.autocontinue,
            *item.params,
            item.x,
            item.y,
            item.z,
        )
        for item in network.stored(0)
    )


class Radio(FaultyNetwork):
    """A vehicle behind a bad radio, with the time of the world they are in."""

    clock_s = 100.0


def make_network(firmware: str, faults: str = "", seed: int = 0, **options: object) -> Radio:
    """A vehicle with home, behind a radio with these faults."""
    home = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, HOME.alt_amsl_m)
    vehicle = Autopilot(FIRMWARES[firmware], **{"home": home, **options})
    return Radio(vehicle, parse_faults(faults), seed)


def run(session: Session, network: Radio, *, limit_s: float = 2_000.0) -> Run:
    """Let a session and a vehicle talk on one virtual clock until the session is done.

    The session must have been made with ``now=network.clock_s``.
    """
    codec = Codec()
    now = start_s = session.started_at
    sent: list[tuple[float, bytes]] = []
    standing = 0
    while True:
        session.tick(now)
        for message in session.to_send():
            frame = codec.encode(message)
            sent.append((now, frame))
            network.receive(frame, LINK, now)
        network.tick(now)
        arrived = [frame for to, frame in network.to_send() if to in {LINK, None}]
        for frame in arrived:
            for message in codec.decode(frame, now):
                session.receive(message, now)
        if session.done:
            for message in session.to_send():
                frame = codec.encode(message)
                sent.append((now, frame))
                network.receive(frame, LINK, now)
            network.clock_s = now
            return Run(session, network, now - start_s, sent)
        if arrived:
            continue
        ahead = min(timer for timer in (session.next_timer(), network.next_timer()) if timer is not None)
        standing = standing + 1 if ahead <= now else 0
        assert standing < 1_000, "somebody asks for time but does not move: a hot loop on a real clock"
        now = max(ahead, now + 1e-6)  # 1 µs keeps rounding from standing still
        assert now - start_s < limit_s, "the session outlived every deadline"


def settle(network: Radio, seconds: float = 20.0) -> None:
    """Let everything that is still on its way arrive at the vehicle."""
    until = network.clock_s + seconds
    while network.clock_s < until:
        network.tick(network.clock_s)
        network.to_send()
        timer = network.next_timer()
        network.clock_s = until if timer is None else max(timer, network.clock_s + 1e-6)


def upload(mission: Mission, network: Radio, *, deadline_s: float = 300.0, system: int | None = None) -> Run:
    """Upload a mission."""
    return run(UploadSession(mission, now=network.clock_s, deadline_s=deadline_s, system=system), network)
