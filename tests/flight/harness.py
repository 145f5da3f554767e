"""A whole flight against the mock vehicle in one process: a virtual clock, a bad radio between, somebody to say yes."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from mavplan.flight.conductor import FlySession
from mavplan.flight.phases import Phase
from mavplan.flight.picture import Picture
from mavplan.flight.preflight import Limits
from mavplan.flight.report import FlightEvent
from mavplan.flight.route import make_route
from mavplan.flight.session import FlightSession
from mavplan.link.codec import Codec
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Mission
from tests.flight.script import LIMITS, Sent
from tests.link.harness import LINK, Radio
from tests.link.script import OTHER_STATION

Hands = Callable[[FlySession, float], None]


def say_yes(session: FlySession, now: float) -> None:
    """Approve whatever may be approved."""
    if session.awaits_yes:
        session.approve(now, every_question=True)


@dataclass
class Air:
    """What the link does beside the mock's own faults, and who else is on it.

    Attributes
    ----------
    silent
        From when to when (seconds from the beginning) nothing gets through.
    lost_acks
        So many COMMAND_ACKs are lost.
    foreign
        What another station sends to the vehicle, and when.
    """

    silent: Sequence[tuple[float, float]] = ()
    lost_acks: int = 0
    foreign: Sequence[tuple[float, Any]] = ()

    def passes(self, frame: bytes, after_s: float) -> bool:
        """Whether a frame of the vehicle, or to it, gets through."""
        if any(begin <= after_s < end for begin, end in self.silent):
            return False
        if self.lost_acks and frame[7:10] == b"\x4d\0\0":
            self.lost_acks -= 1
            return False
        return True


@dataclass(frozen=True)
class Truth:
    """What the vehicle really does at a time."""

    at: float
    armed: bool
    mode: int
    flying: bool
    running: bool
    finished: bool
    seq: int


@dataclass
class Flown:
    """How it went."""

    session: FlySession
    network: Radio
    sent: list[Sent] = field(default_factory=list)
    frames: list[tuple[float, bytes]] = field(default_factory=list)
    events: list[tuple[float, FlightEvent]] = field(default_factory=list)
    pictures: list[tuple[float, Picture]] = field(default_factory=list)
    truth: list[Truth] = field(default_factory=list)
    approved_at: float | None = None
    ended_s: float = 0.0

    @property
    def doings(self) -> list[str]:
        """What was sent that does something."""
        return [sent.words for sent in self.sent if sent.words]

    def told(self, kind: str) -> list[str]:
        return [event.words for _, event in self.events if event.kind == kind]


def make_fly_session(
    mission: Mission,
    now: float,
    *,
    upload: bool = True,
    users: tuple[tuple[str, ...], ...] = (),
    limits: Limits = LIMITS,
    **options: object,
) -> FlySession:
    """A session that uploads, or verifies, and then flies."""
    route = make_route(mission, AUTOPILOTS[mission.autopilot], users)
    first: UploadSession | VerifySession
    if upload:
        first = UploadSession(mission, now=now, deadline_s=300.0, system=1)
    else:
        first = VerifySession(mission, now=now, deadline_s=120.0, system=1)
    return FlySession(
        first, lambda at, system: FlightSession(mission, route, limits, now=at, system=system, **options)
    )


def fly(
    session: FlySession,
    network: Radio,
    hands: Hands = say_yes,
    air: Air | None = None,
    *,
    limit_s: float = 3_000.0,
) -> Flown:
    """Let a session and a vehicle talk on one virtual clock until the session is done.

    The session must have been made with ``now=network.clock_s``.
    """
    flown, air = Flown(session, network), air or Air()
    others, foreign = Codec(OTHER_STATION), sorted(air.foreign, key=lambda said: said[0])
    codec, listener, decoder = Codec(), Codec(), Codec()
    now = start_s = session.started_at
    standing = 0
    shown_at = now

    def send() -> None:
        for message in session.to_send():
            frame = codec.encode(message)
            flown.frames.append((now, frame))
            flown.sent += [Sent(now, heard) for heard in listener.decode(frame, now)]
            if air.passes(frame, now - start_s):
                network.receive(frame, LINK, now)

    while True:
        session.tick(now)
        send()
        while foreign and now >= start_s + foreign[0][0]:
            network.autopilot.receive(others.encode(foreign.pop(0)[1]), "other", now)
        network.tick(now)
        see_truth(flown, now)
        arrived = [
            frame
            for to, frame in network.to_send()
            if to in {LINK, None} and air.passes(frame, now - start_s)
        ]
        for frame in arrived:
            for message in decoder.decode(frame, now):
                session.receive(message, now)
        waiting = session.awaits_yes
        hands(session, now)
        if waiting and not session.awaits_yes and session.phase is not Phase.ENDED:
            flown.approved_at = now
        flown.events += [(now, event) for event in session.news()]
        session.events()
        if now >= shown_at:
            shown_at = now + 1.0
            if (picture := session.picture(now)) is not None:
                flown.pictures.append((now, picture))
        if session.done:
            send()
            network.clock_s = now
            flown.ended_s = now - start_s
            return flown
        if arrived:
            continue
        timers = [session.next_timer(), network.next_timer(), start_s + foreign[0][0] if foreign else None]
        ahead = min(timer for timer in timers if timer is not None)
        standing = standing + 1 if ahead <= now else 0
        assert standing < 1_000, "somebody asks for time but does not move: a hot loop on a real clock"
        now = max(ahead, now + 1e-6)
        assert now - start_s < limit_s, "the session outlived every deadline"


def see_truth(flown: Flown, now: float) -> None:
    """Keep what the vehicle does where it has changed."""
    state = flown.network.autopilot.vehicle
    truth = Truth(
        now,
        state.armed,
        state.custom_mode,
        state.flying,
        state.mission_running,
        state.mission_finished,
        state.current_seq,
    )
    last = flown.truth[-1] if flown.truth else None
    if last is None or dataclasses.replace(last, at=now) != truth:
        flown.truth.append(truth)
