"""`FlySession`: first that the vehicle holds the mission (upload, or verification), then the flight. No I/O.

::

    connecting ──> uploading ──┐
             └───> verifying ──┴──> the list ── yes ──> verified just now? ──> start ──> flight ──> outcome
                                        │                   │ no: verify again ─┘ │
                                        └─ refused          └─ holds another      └─ refused

Upload and verification are the sessions of `mavplan.link`, with all of their rules; the flight is
`mavplan.flight.session`. A vehicle that holds something else still gets the whole list, so that everything that stands
against the flight is said at once.
"""

from collections.abc import Callable

from mavplan.errors import CheckError, MavplanError, RefusedError, UncertainError
from mavplan.flight.orders import Order
from mavplan.flight.phases import Phase
from mavplan.flight.picture import Picture
from mavplan.flight.preflight import Check
from mavplan.flight.report import FlightEvent, FlightReport
from mavplan.flight.session import FlightSession
from mavplan.flight.survey import Held
from mavplan.link.discovery import Vehicle
from mavplan.link.outbox import Progress
from mavplan.link.protocol import GROUND, Message
from mavplan.link.report import UploadReport
from mavplan.link.session import Session
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession

IN_THE_LIST = (CheckError, UncertainError)
"""Errors of a verification that are one line of the list among others, and not the end."""
FRESH_S = 30.0
"""A verification that is older when the yes comes is made again."""


class FlySession:
    """Put or find a mission on a vehicle and fly it. It is driven as a `mavplan.link.session.Session` is.

    Parameters
    ----------
    first
        The upload or the verification that comes first.
    make_flight
        Makes the flight of the same mission, at a time, with the vehicle of a MAVLink system.
    verify_s
        Deadline of a further verification.
    """

    def __init__(
        self,
        first: UploadSession | VerifySession,
        make_flight: Callable[[float, int], FlightSession],
        *,
        verify_s: float = 120.0,
    ) -> None:
        self.us = GROUND
        self.started_at = first.started_at
        self.flight: FlightSession | None = None
        self._stopped: MavplanError | None = None
        self._first = first
        self._make_flight = make_flight
        self._storing: UploadSession | VerifySession | None = first
        self._verify_s = verify_s
        self._verified_at: float | None = None
        self._approved: bool | None = None

    # -- what the user does -----------------------------------------------------------------------------------

    @property
    def phase(self) -> Phase:
        """Where the flight stands."""
        return self.flight.phase if self.flight is not None else Phase.CHECKING

    @property
    def report(self) -> FlightReport | None:
        """What came of the flight, once it is over and if there was one."""
        return self.flight.report if self.flight is not None else None

    @property
    def uploaded(self) -> UploadReport | None:
        """What came of the upload, where there was one and it succeeded."""
        report = self._first.report
        return report if isinstance(report, UploadReport) else None

    @property
    def may_have_armed(self) -> bool:
        """Whether anything was sent that arms."""
        return self.flight is not None and self.flight.may_have_armed

    @property
    def follows_an_order(self) -> bool:
        """Whether the vehicle does what the user ordered, and not its mission."""
        return self.flight is not None and self.flight.follows_an_order

    @property
    def awaits_yes(self) -> bool:
        """Whether the list is complete and the user is to say yes or no."""
        return self.phase is Phase.READY and self._approved is None and not self.done

    @property
    def checks(self) -> tuple[Check, ...]:
        """The list as it was last looked at."""
        return self.flight.checks if self.flight is not None else ()

    @property
    def questions(self) -> tuple[Check, ...]:
        """The lines of the list that want a yes of their own."""
        return self.flight.questions() if self.flight is not None else ()

    def approve(self, now: float, *, every_question: bool = False) -> None:
        """Take the yes; see `FlightSession.approve`. What was verified some time ago is verified once more."""
        if not self.awaits_yes or self.flight is None:
            return
        self._approved = every_question
        old = self._verified_at is None or now > self._verified_at + FRESH_S
        if self._storing is not None:
            return  # it is being verified: the start follows
        if (old or self.flight.meddled) and self.vehicle is not None:
            self._verify_again(now)
        else:
            self.flight.approve(now, every_question=every_question)

    def renew(self, now: float, fresh_s: float) -> None:
        """Verify again while the yes is waited for, if that was longer ago than this: then the start need not wait."""
        idle = self.awaits_yes and self._storing is None and self.vehicle is not None
        if not idle or (self._verified_at is not None and now <= self._verified_at + fresh_s):
            return
        self._verify_again(now)

    def decline(self, why: str = "you did not say yes") -> None:
        """Take the no."""
        if self.flight is not None:
            self.flight.refuse(RefusedError(f"{why}: it was not armed"))

    def order(self, order: Order, now: float) -> None:
        """Take an order to a vehicle in flight."""
        if self.flight is not None:
            self.flight.order(order, now)

    def break_off(self, why: str) -> None:
        """Ask for nothing more in a start."""
        if self.flight is not None:
            self.flight.break_off(why)

    def leave(self, now: float, why: str) -> None:
        """End; what flies is left alone."""
        if self.done:
            return
        if self.flight is not None:
            self.flight.leave(now, why)
        else:
            self._first.interrupt(now)
            self._stopped = self._first.error or RefusedError(f"{why}: it was not armed")

    def picture(self, now: float) -> Picture | None:
        """Return what there is to be seen now; None before a vehicle is found."""
        return self.flight.picture(now) if self.flight is not None else None

    def news(self) -> list[FlightEvent]:
        """Return what has happened in the flight since the last call."""
        return self.flight.news() if self.flight is not None else []

    # -- what a driver calls ----------------------------------------------------------------------------------

    @property
    def vehicle(self) -> Vehicle | None:
        """The vehicle, once it is found."""
        return (self.flight.vehicle if self.flight is not None else None) or self._first.vehicle

    @property
    def done(self) -> bool:
        """Whether there is an outcome."""
        return self._stopped is not None or (self.flight is not None and self.flight.done)

    @property
    def error(self) -> MavplanError | None:
        """Why there was no flight to the mission's end; None: there was, or it is not over."""
        return self._stopped or (self.flight.error if self.flight is not None else None)

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the link."""
        for part in self._parts():
            part.receive(message, now)
        self._advance(now)

    def tick(self, now: float) -> None:
        """Let time pass."""
        for part in self._parts():
            part.tick(now)
        self._advance(now)

    def interrupt(self, now: float) -> None:
        """End at once; what flies is left alone."""
        self.leave(now, "interrupted")

    def to_send(self) -> list[Message]:
        """Return what is to be sent now."""
        return [message for part in self._all_parts() for message in part.to_send()]

    def events(self) -> list[Progress]:
        """Return the steps of the transfers since the last call."""
        return [event for part in self._all_parts() for event in part.events()]

    def next_timer(self) -> float | None:
        """Time of the next `tick` that matters; None when all is over."""
        timers = [timer for part in self._parts() if (timer := part.next_timer()) is not None]
        return min(timers) if timers and not self.done else None

    def _verify_again(self, now: float) -> None:
        if self.flight is not None and self.vehicle is not None:
            self._storing = VerifySession(
                self.flight.mission, now=now, deadline_s=self._verify_s, system=self.vehicle.address.system
            )
            self._storing.tick(now)

    # -- the way ----------------------------------------------------------------------------------------------

    def _all_parts(self) -> list[Session]:
        parts = (self._first, self._storing if self._storing is not self._first else None, self.flight)
        return [part for part in parts if part is not None]

    def _parts(self) -> list[Session]:
        return [part for part in self._all_parts() if not part.done]

    def _advance(self, now: float) -> None:
        storing = self._storing
        if storing is None or not storing.done or self.done:
            return
        self._storing = None
        self._verified_at = now
        if self.flight is None:
            in_the_list = isinstance(storing, VerifySession) and isinstance(storing.error, IN_THE_LIST)
            if storing.vehicle is None or (storing.error is not None and not in_the_list):
                self._stopped = storing.error or UncertainError("no vehicle was found")
                return
            self.flight = self._make_flight(now, storing.vehicle.address.system)
        self.flight.held = _held(storing)
        if self._approved is not None:
            self.flight.approve(now, every_question=self._approved)
        else:
            self.flight.tick(now)


def _held(storing: UploadSession | VerifySession) -> Held:
    """Return what is known of the mission on the vehicle now."""
    report = storing.report
    if storing.error is not None or report is None:
        return Held(storing.error or UncertainError("what the vehicle holds is not known"))
    if isinstance(report, UploadReport):
        words = f"sent, read back and verified just now: {report.items} items"
    else:
        how = "by its checksum" if report.by == "id" else "item by item"
        words = f"the vehicle holds it: {report.items} items, verified {how}"
    return Held(words, report.warnings, report.opaque_id)
