"""One vehicle from the list before the start to the flight's end: `FlightSession`. No I/O; see `mavplan.link.session`.

That it holds the mission is found out beside it, by `mavplan.flight.conductor`. Where a flight stands and every legal
move is in `phases`; what may be sent when, in `launch` (the start) and `orders` (what the user wants in flight). While
it flies nothing else is sent but heartbeats and requests for messages.
"""

import math

from mavplan.errors import MavplanError, NoLinkError, RefusedError, UncertainError
from mavplan.flight.ending import judge
from mavplan.flight.in_flight import InFlight
from mavplan.flight.launch import ARM_S, Launch
from mavplan.flight.manners import FLIGHT_MANNERS, FlightManners
from mavplan.flight.orders import Order
from mavplan.flight.phases import Move, Phase, moved
from mavplan.flight.picture import Picture, take_picture
from mavplan.flight.places import ends_of
from mavplan.flight.preflight import Check, Limits, refusal_words, refused
from mavplan.flight.progress import MissionProgress
from mavplan.flight.report import FlightEvent, FlightLog, FlightReport, make_report
from mavplan.flight.route import Route
from mavplan.flight.streams import Streams
from mavplan.flight.survey import LISTEN_S, Held, Survey
from mavplan.flight.telemetry import Battery, Position, Telemetry
from mavplan.flight.watching import Watching
from mavplan.link.discovery import Vehicle
from mavplan.link.modes import mode_name
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Message, sender
from mavplan.link.session import Session
from mavplan.mission.model import Mission

FLIGHT_SHARE, FLIGHT_S = 1.5, 120.0
"""A flight is watched for so much of its forecast, and so much more: wind, and a radio that is out of reach."""
TICK_S = 0.25
STARTING = frozenset({Phase.REWINDING, Phase.SWITCHING, Phase.ARMING, Phase.STARTING})


class FlightSession(Session):
    """Fly a mission that the one vehicle of a link holds.

    Parameters
    ----------
    mission, route
        What is flown, and what there is to watch of it.
    limits
        What the user allows.
    watch_only
        Start nothing; watch what is flown, or is going to be.
    flight_s
        How long it is watched; None: as its forecast has it, and more.
    arm_s
        How long it is tried to arm a vehicle that refuses.
    now, system, place
        As for `Session`.
    """

    def __init__(
        self,
        mission: Mission,
        route: Route,
        limits: Limits,
        *,
        now: float,
        system: int | None = None,
        place: str = "this connection",
        watch_only: bool = False,
        flight_s: float | None = None,
        arm_s: float = ARM_S,
    ) -> None:
        super().__init__(now=now, deadline_s=math.inf, system=system, place=place, wanted=mission.autopilot)
        self.mission = mission
        self.route = route
        self.limits = limits
        self.phase = Phase.CHECKING
        self.report: FlightReport | None = None
        self.held: Held | None = None
        """What is known of the mission on the vehicle; None: nothing yet, and it is waited for."""
        self.checks: tuple[Check, ...] = ()
        """The list as it was last looked at."""
        self._watch_only = watch_only
        patience_s = math.ceil(FLIGHT_SHARE * route.mission_s + FLIGHT_S)
        self._flight_s = flight_s if flight_s is not None else patience_s
        self._arm_s = arm_s
        self._survey: Survey | None = None
        self._telemetry: Telemetry | None = None
        self._streams: Streams | None = None
        self._progress = MissionProgress(route)
        self._launch: Launch | None = None
        self._in_flight: InFlight | None = None
        self._start_s: float | None = None
        self._ticked_at = now
        self._reboots_seen = 0
        self._battery_before: Battery | None = None
        self._stood_at: Position | None = None
        self._log = FlightLog(self._flight_s_at)

    # -- the outside ------------------------------------------------------------------------------------------

    @property
    def done(self) -> bool:
        """Whether there is an outcome."""
        return self.phase is Phase.ENDED or self.error is not None

    def news(self) -> list[FlightEvent]:
        """Return what has happened since the last call."""
        return self._log.news()

    @property
    def may_have_armed(self) -> bool:
        """Whether anything was sent that arms."""
        return self._launch is not None and self._launch.arming_sent

    @property
    def follows_an_order(self) -> bool:
        """Whether the vehicle does what the user ordered, and not its mission."""
        return self._in_flight is not None and self._in_flight.follows_an_order

    @property
    def meddled(self) -> bool:
        """Whether another station was heard to write to the vehicle's mission."""
        return self._watch is not None and self._watch.writes[0] > 0

    def questions(self) -> tuple[Check, ...]:
        """Return the lines of the list that want a yes of their own."""
        return tuple(check for check in self.checks if check.verdict == "ask")

    def look(self, now: float) -> tuple[Check, ...]:
        """Look at everything again and return the list."""
        if self._survey is not None:
            self.checks = self._survey.look(self._seen, self.held, self.route, self.limits, now)
        return self.checks

    def approve(self, now: float, *, every_question: bool = False) -> None:
        """Take the user's yes: look once more, then start.

        Parameters
        ----------
        now
            The time.
        every_question
            The user also said yes to each of `questions`.
        """
        if self.phase is not Phase.READY:
            return
        checks = self.look(now)
        if refused(checks):
            self._refuse(f"not armed: {refusal_words(checks)}")
        elif self.questions() and not every_question:
            asked = "; ".join(f"{check.name}: {check.words}" for check in self.questions())
            self._refuse(f"not armed: no yes to this was given: {asked}")
        elif self.vehicle is not None:
            telemetry = self._seen
            if telemetry.mission is not None:
                self._progress.before_start(telemetry.mission)
            self._battery_before = telemetry.battery
            self._stood_at = telemetry.position
            self._move(Move.APPROVED)
            self._launch = Launch(
                self.rules,
                self._flight_manners,
                vehicle=self.vehicle.address,
                us=self.us,
                telemetry=telemetry,
                pace=self._pace,
                arm_s=self._arm_s,
                now=now,
            )
            self._on_tick(now)

    def refuse(self, error: MavplanError) -> None:
        """End before anything was armed."""
        if self.phase in {Phase.CHECKING, Phase.READY}:
            self.error = error
            self._move(Move.REFUSED)

    def order(self, order: Order, now: float) -> None:
        """Take the user's order to a vehicle in flight."""
        if self.phase is Phase.FLYING and self._in_flight is not None:
            self._in_flight.order(order)
            self._log.add("order", f"you ordered it to {order.value}", now)
            self._on_tick(now)

    def leave(self, now: float, why: str) -> None:
        """End watching, or a start that has not armed anything; what flies is left alone."""
        if self.done:
            return
        if self.phase in STARTING and self._launch is not None and self._launch.arming_sent:
            self._fly(Move.BROKEN_OFF, why, now)
        self._expire(now, why)

    def interrupt(self, now: float) -> None:
        """End at once."""
        self.leave(now, "interrupted")

    def break_off(self, why: str) -> None:
        """Ask for nothing more in a start; if it may be armed already, go on watching it."""
        if self.phase in STARTING and self._launch is not None:
            self._launch.break_off(why)

    def picture(self, now: float) -> Picture | None:
        """Return what there is to be seen now; None before a vehicle is found."""
        if self._telemetry is None:
            return None
        return take_picture(
            self.phase,
            self.rules.name,
            self._telemetry,
            self._progress,
            start_s=self._start_s if self._start_s is not None else self._telemetry.clock.at(now),
            order=self._in_flight.ordered if self._in_flight is not None else "",
            follows=self._in_flight.followed if self._in_flight is not None else "",
            ended_at=self._in_flight.watching.off_since if self._in_flight is not None else None,
            now=now,
        )

    # -- messages and time ------------------------------------------------------------------------------------

    @property
    def _seen(self) -> Telemetry:
        if self._telemetry is None:
            raise AssertionError("no vehicle yet")
        return self._telemetry

    @property
    def _flight_manners(self) -> FlightManners:
        return FLIGHT_MANNERS[self.rules.name]

    def _found(self, vehicle: Vehicle, now: float) -> None:
        self._telemetry = Telemetry(vehicle.address)
        self._streams = Streams(vehicle.address, self.us, self._pace)
        self._notes.append(Progress("asking what a start needs"))
        self._survey = Survey(
            self.mission,
            vehicle=vehicle.address,
            us=self.us,
            rules=self.rules,
            manners=self.manners,
            pace=self._pace,
            now=now,
        )

    def _on_message(self, message: Message, now: float) -> None:
        reboots = self._watch.reboots if self._watch is not None else 0
        for part in (self._telemetry, self._streams, self._survey, self._launch, self._in_flight):
            if part is not None:
                part.receive(message, now)
        if self._streams is not None and reboots != self._reboots_seen:
            self._reboots_seen = reboots
            self._streams.forget()
            self.break_off("the autopilot has restarted")
        if self.phase in {Phase.STARTING, Phase.FLYING}:
            self._on_flight_message(message, now)

    def _on_flight_message(self, message: Message, now: float) -> None:
        telemetry = self._seen
        if sender(message) != telemetry.vehicle:
            return
        clock_s = telemetry.clock.at(now)
        if self._in_flight is not None and not self._in_flight.watching.begun:
            if telemetry.mission is not None:
                self._progress.before_start(telemetry.mission)
            return
        match message.get_type():
            case "MISSION_CURRENT" if telemetry.mission is not None:
                self._progress.on_current(telemetry.mission, clock_s)
            case "MISSION_ITEM_REACHED":
                self._progress.on_reached(int(message.seq), clock_s)
            case "GLOBAL_POSITION_INT" if telemetry.position is not None:
                self._progress.on_position(telemetry.position, clock_s)

    def _on_tick(self, now: float) -> None:
        if self._streams is not None:
            self._streams.tick(now)
            self._outbox += self._streams.to_send()
        if self.phase is Phase.CHECKING:
            self._check(now)
        while self.phase in STARTING and self._launch is not None and self._step_of_start(self._launch, now):
            pass
        if self.phase is Phase.FLYING and self._in_flight is not None:
            self._watch_flight(self._in_flight, now)

    def _timers(self) -> list[float | None]:
        parts = (self._streams, self._launch if self.phase in STARTING else None, self._in_flight)
        timers = [part.next_timer() for part in parts if part is not None]
        if self.phase is Phase.CHECKING and self._survey is not None:
            timers += [timer for timer in self._survey.timers() if timer is not None]
        return [*timers, self._ticked_at + TICK_S]

    def tick(self, now: float) -> None:
        """Let time pass."""
        self._ticked_at = now
        super().tick(now)

    def _too_long(self) -> str:
        # The times told of a flight are the vehicle's, which in a simulation runs faster.
        return f"{super()._too_long()} by this machine's clock"

    def _lost_at(self) -> float:
        # A flight is not given up because it is out of reach, and a start is by its own rules.
        return math.inf if self.phase is Phase.FLYING or self.phase in STARTING else super()._lost_at()

    # -- the phases -------------------------------------------------------------------------------------------

    def _move(self, move: Move) -> None:
        self.phase = moved(self.phase, move)

    def _check(self, now: float) -> None:
        survey = self._survey
        if survey is None:
            return
        survey.tick(now)
        self._outbox += survey.to_send()
        if self.held is None:
            return
        if self._watch_only:
            self._only_watch(survey, now)
        elif survey.complete(self._seen, now):
            checks = self.look(now)
            if refused(checks):
                self._refuse(f"not armed: {refusal_words(checks)}")
            else:
                self._move(Move.CHECKED)

    def _only_watch(self, survey: Survey, now: float) -> None:
        if self.held is not None and isinstance(self.held.found, MavplanError):
            self.refuse(self.held.found)
        elif self._seen.heartbeat_at is not None and now >= survey.begun_at + LISTEN_S:
            self.look(now)
            self._fly(Move.WATCHED, "", now)

    def _refuse(self, words: str) -> None:
        self.error = RefusedError(words)
        self._move(Move.REFUSED)

    def _step_of_start(self, launch: Launch, now: float) -> bool:
        """Go on with the start; whether a phase was left."""
        move = launch.tick(self.phase, now)
        self._outbox += launch.to_send()
        for words in launch.words:
            self._log.add("start", words, now)
        launch.words.clear()
        if move is None:
            return False
        if launch.armed_at is not None and move in {Move.ARMED, Move.STARTED}:
            self._start_s = self._seen.clock.at(launch.armed_at)
        if move in {Move.STARTED, Move.BROKEN_OFF}:
            self._fly(move, launch.reason, now)
            return False
        self._move(move)
        if self.phase is Phase.ENDED:
            self.error = launch.error
        elif move is Move.SWITCHED:
            self._log.add("start", f"{self._mode_name()}: asks for the motors", now)
        elif move is Move.ARMED:
            self._log.add("start", "armed: starts the mission", now)
        return True

    def _fly(self, move: Move, reason: str, now: float) -> None:
        """Begin to watch."""
        watch = self._watch
        if watch is None:
            return
        self._move(move)
        self._start_s = self._seen.clock.at(now) if self._start_s is None else self._start_s
        self.deadline_s = self._flight_s
        self.deadline = now + self._flight_s
        since = self.started_at if self._launch is None else self._launch.begun_at
        watching = Watching(
            self.rules,
            self._flight_manners,
            self._seen,
            self._progress,
            watch,
            mission_id=self.held.mission_id if self.held is not None else None,
            started=move is not Move.WATCHED,
            reason=reason,
            ends=ends_of(
                self.mission, self.route, self._survey.home if self._survey else None, self._stood_at
            ),
            since=since,
            now=now,
        )
        self._in_flight = InFlight(
            watching,
            self.rules,
            self._flight_manners,
            self.route.end,
            us=self.us,
            telemetry=self._seen,
            pace=self._pace,
            since=since,
        )
        if move is Move.STARTED:
            self._log.add("start", f"{self._mode_name()}: the mission is flown", now)
        elif move is Move.BROKEN_OFF:
            self._log.add("start", f"{reason}: what becomes of it is watched", now)

    def _watch_flight(self, in_flight: InFlight, now: float) -> None:
        for kind, words, at in in_flight.tick(now):
            self._log.add(kind, words, now if at is None else at)
        self._outbox += in_flight.to_send()
        if in_flight.watching.over(now):
            self._end(in_flight.watching, now)

    def _end(self, watching: Watching, now: float, left: str = "") -> None:
        facts = watching.facts(now)
        words, error = judge(facts, left)
        ended_at = now if watching.off_since is None else watching.off_since
        self._log.add("end", words, ended_at)
        self._move(Move.EXPIRED if left else Move.FINISHED)
        if error is None and not facts.stays:
            self._progress.came_down()
        self.error = error
        self.report = make_report(
            words,
            error,
            stays=facts.stays,
            progress=self._progress,
            autopilot=self.rules.name,
            vehicle=self._seen.vehicle,
            flight_s=self._flight_s_at(ended_at),
            before=self._battery_before,
            after=self._seen.battery,
            unheard_s=watching.longest_silence_s,
            checks=self.checks,
            events=self._log.all(),
        )

    def _expire(self, now: float, cause: str) -> None:
        if self.phase is Phase.FLYING and self._in_flight is not None:
            self._in_flight.watching.tick(now)
            self._end(self._in_flight.watching, now, left=cause)
            return
        arming_sent = self._launch is not None and self._launch.arming_sent
        if arming_sent:
            self.error = UncertainError(f"{cause}: whether it has been armed is not known; keep away from it")
        elif now >= self._lost_at() or self._telemetry is None:
            self.error = NoLinkError(f"{cause}: it was not armed")
        else:
            self.error = RefusedError(f"{cause}: it was not armed")
        self._move(Move.EXPIRED)

    def _flight_s_at(self, now: float) -> float:
        """Return the seconds since the start, on the vehicle's clock."""
        return max(0.0, self._seen.clock.at(now) - self._start_s) if self._start_s is not None else 0.0

    def _mode_name(self) -> str:
        mode = self._seen.mode_now
        return mode_name(self.rules.name, self._seen.base_mode, mode if mode is not None else 0)
