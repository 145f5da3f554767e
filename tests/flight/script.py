"""A flight session in the hands of a test: messages of the vehicle at their times, what is sent at its time."""

from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import common

from mavplan.flight.preflight import Limits
from mavplan.flight.route import make_route
from mavplan.flight.session import FlightSession
from mavplan.flight.survey import Held
from mavplan.link.codec import Codec
from mavplan.link.protocol import Message
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import HomePosition, Mission
from tests.link.script import said

LIMITS = Limits(500.0, 30.0)
GUIDED, AUTO, BRAKE, RTL, LOITER = 4, 3, 17, 6, 5
PX4_HOLD, PX4_MISSION, PX4_RETURN = (4 << 16 | sub << 24 for sub in (3, 4, 5))


def beat(firmware: str, mode: int, *, armed: bool = False) -> Message:
    """A heartbeat."""
    autopilot = AUTOPILOTS[firmware].mav_autopilot
    return said(common.MAVLink_heartbeat_message(2, autopilot, 0x51 | (0x80 if armed else 0), mode, 4, 3))


def current(seq: int, state: int, total: int = 65_535) -> Message:
    return said(common.MAVLink_mission_current_message(seq, total, state, 1))


def reached(seq: int) -> Message:
    return said(common.MAVLink_mission_item_reached_message(seq))


def battery(percent: int = 95, health: int = 0x1000_0000) -> Message:
    return said(
        common.MAVLink_sys_status_message(health, health, health, 100, 16_200, -1, percent, 0, 0, 0, 0, 0, 0)
    )


def position(
    home: HomePosition,
    *,
    north_m: float = 0.0,
    up_m: float = 0.0,
    speed_m_s: float = 0.0,
    boot_s: float = 1.0,
) -> Message:
    return said(
        common.MAVLink_global_position_int_message(
            round(boot_s * 1000),
            home.lat_e7 + round(north_m * 89.8315),
            home.lon_e7,
            round((home.alt_amsl_m + up_m) * 1000),
            round(up_m * 1000),
            round(speed_m_s * 100),
            0,
            0,
            0,
        )
    )


def landed(state: int) -> Message:
    return said(common.MAVLink_extended_sys_state_message(0, state))


def home_told(home: HomePosition) -> Message:
    level = [1.0, 0.0, 0.0, 0.0]
    return said(
        common.MAVLink_home_position_message(
            home.lat_e7, home.lon_e7, round(home.alt_amsl_m * 1000), 0, 0, 0, level, 0, 0, 0
        )
    )


def parameter(name: str, value: float) -> Message:
    return said(common.MAVLink_param_value_message(name.encode(), value, 9, 1, 0))


def acked(command: int, result: int = 0) -> Message:
    return said(common.MAVLink_command_ack_message(command, result, 0, 0, 255, 190))


@dataclass
class Sent:
    """What went out, and when."""

    at: float
    message: Any

    @property
    def words(self) -> str:
        """For instance ``ARM``, ``MODE 4``, ``START``, ``REWIND 1``; empty for what is always allowed."""
        message = self.message
        match message.get_type():
            case "MISSION_SET_CURRENT":
                return f"REWIND {message.seq}"
            case "COMMAND_LONG" if message.command == 176:
                sub = f"/{message.param3:.0f}" if message.param3 else ""
                return f"MODE {message.param2:.0f}{sub}"
            case "COMMAND_LONG" if message.command == 400:
                return f"ARM {message.param1:.0f} {message.param2:.0f}"
            case "COMMAND_LONG" if message.command == 300:
                return f"START {message.confirmation}"
            case "COMMAND_LONG" if message.command not in {511, 512}:
                return f"COMMAND {message.command}"
            case "MISSION_COUNT" | "MISSION_ITEM_INT" | "MISSION_CLEAR_ALL" | "PARAM_SET" | "SET_MODE":
                return str(message.get_type())
        return ""


@dataclass
class Script:
    """A session, its virtual time, and everything it sent."""

    session: FlightSession
    now: float
    sent: list[Sent] = field(default_factory=list)
    codec: Codec = field(default_factory=Codec)
    listener: Codec = field(default_factory=Codec)
    events: list[tuple[str, str]] = field(default_factory=list)

    def hear(self, *messages: Message) -> None:
        """The vehicle says this now."""
        for message in messages:
            self.session.receive(message, self.now)
        self._collect()

    def wait(self, until: float) -> None:
        """Let time pass."""
        while not self.session.done and (timer := self.session.next_timer()) is not None and timer < until:
            self.now = max(timer, self.now + 1e-6)
            self.session.tick(self.now)
            self._collect()
        self.now = until
        self.session.tick(until)
        self._collect()

    def hear_at(self, at: float, message: Message) -> None:
        """The vehicle says this at a time."""
        self.wait(at)
        self.hear(message)

    def _collect(self) -> None:
        for message in self.session.to_send():
            for made in self.listener.decode(self.codec.encode(message), self.now):
                self.sent.append(Sent(self.now, made))
        self.events += [(event.kind, event.words) for event in self.session.news()]

    @property
    def doings(self) -> list[str]:
        """What was sent that does something, in order."""
        return [sent.words for sent in self.sent if sent.words]

    def told(self, kind: str) -> list[str]:
        return [words for what, words in self.events if what == kind]


def begin(mission: Mission, *, now: float = 0.0, users=(), **options: Any) -> Script:
    """A session for a mission that the vehicle is known to hold."""
    rules = AUTOPILOTS[mission.autopilot]
    session = FlightSession(mission, make_route(mission, rules, users), LIMITS, now=now, system=1, **options)
    session.held = Held("the vehicle holds it")
    return Script(session, now)


def on_the_ground(
    script: Script, firmware: str, mode: int, *, until: float, seq: int = 0, **changes: Any
) -> None:
    """Everything that a vehicle on the ground tells, once a second until a time."""
    home = script.session.mission.home
    names = ("FENCE_ENABLE", "FENCE_TYPE", "FENCE_ACTION", "FENCE_ALT_MAX", "FENCE_RADIUS", "FS_GCS_ENABLE")
    if firmware == "px4":
        names = ("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST", "NAV_DLL_ACT")
    told = {
        "heartbeat": beat(firmware, mode),
        "current": current(seq, 2),
        "battery": battery(),
        "position": position(home),
        "landed": landed(1),
        "home": home_told(home),
        **{name: parameter(name, 0.0) for name in names},
        **changes,
    }
    while script.now < until and not script.session.done:
        script.hear(*(message for message in told.values() if message is not None))
        script.wait(min(until, script.now + 1.0))
