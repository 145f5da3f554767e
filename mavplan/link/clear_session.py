"""Clear a vehicle's lists, one by one, and read back that nothing is held. No I/O; see `mavplan.link.session`.

ArduPilot does not take "all types" in one message, so each list is cleared by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from mavplan.errors import RefusedError, UncertainError
from mavplan.link.clear import Clear, ClearEnd
from mavplan.link.count import LIST_AGAIN_S, Count
from mavplan.link.discovery import Vehicle
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Address, Message, result_words
from mavplan.link.report import THINGS, told_besides
from mavplan.link.session import Session
from mavplan.link.upload_session import armed_refusal
from mavplan.mission.model import Autopilot

ATTEMPTS = 3
"""So often a list is cleared that still holds something afterwards."""


@dataclass(frozen=True, slots=True)
class ClearReport:
    """Lists that a vehicle held nothing of when it was asked after clearing them.

    Attributes
    ----------
    autopilot, vehicle
        Firmware and address.
    cleared
        Names of the lists, in the order of clearing.
    """

    autopilot: Autopilot
    vehicle: Address
    cleared: tuple[str, ...]


class ClearSession(Session):
    """Clear lists of the one vehicle of a link.

    Parameters
    ----------
    kinds
        MAV_MISSION_TYPEs, in order.
    allow_armed
        Clear also on a vehicle whose motors may turn.
    now, deadline_s, system, place
        As for `Session`.
    """

    def __init__(
        self,
        kinds: Sequence[int],
        *,
        now: float,
        deadline_s: float,
        system: int | None = None,
        place: str = "this connection",
        allow_armed: bool = False,
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=None)
        self.report: ClearReport | None = None
        self._todo = [int(kind) for kind in kinds]
        self._cleared: list[int] = []
        self._writes: dict[int, int] = {}
        self._allow_armed = allow_armed
        self._clear: Clear | None = None
        self._count: Count | None = None
        self._attempts = 0
        self._refused: int | None = None
        self._stopped = False

    @property
    def done(self) -> bool:
        """Whether there is a report or an error."""
        return self.report is not None or self.error is not None

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        if vehicle.rules is None:
            return super()._refusal(vehicle)
        return armed_refusal(vehicle, vehicle.armed and not self._allow_armed)

    def _found(self, vehicle: Vehicle, now: float) -> None:
        self._next(vehicle, now)
        self._on_tick(now)

    def _next(self, vehicle: Vehicle, now: float) -> None:
        self._count = None
        watch = self._watch
        if watch is not None and (written := [k for k in self._cleared if watch.writes[k] > self._writes[k]]):
            names = " and ".join(THINGS[kind] for kind in written)
            said = f"another ground station has written to the {names} since they were cleared"
            self.error = UncertainError(f"{said}: what the vehicle holds is not known")
            return
        if not self._todo:
            self.report = ClearReport(
                self.rules.name, vehicle.address, tuple(THINGS[kind] for kind in self._cleared)
            )
            return
        if watch is not None and watch.armed and not self._allow_armed:
            self.error = RefusedError(f"{vehicle.address} has been armed meanwhile: nothing more was sent")
            self._say_cleared()
            return
        self._attempts += 1
        self._refused = None
        self._notes.append(Progress(f"clearing {THINGS[self._todo[0]]}"))
        self._clear = Clear(vehicle.address, self.us, self._todo[0], now=now, deadline=self.deadline)

    def _on_message(self, message: Message, now: float) -> None:
        for part in (self._clear, self._count):
            if part is not None:
                part.receive(message, now)

    def _on_tick(self, now: float) -> None:
        self._let_parts(now)
        if self.vehicle is not None and not self.done:
            self._advance(self.vehicle, now)
        self._let_parts(now)

    def _let_parts(self, now: float) -> None:
        for part in (None if self._stopped else self._clear, self._count):
            if part is not None:
                part.tick(now)
                self._outbox += part.to_send()

    def _advance(self, vehicle: Vehicle, now: float) -> None:
        if self._count is not None:
            if self._count.done:
                self._counted(vehicle, self._count.count, now)
        elif self._clear is not None and (outcome := self._clear.outcome) is not None:
            if outcome.end is ClearEnd.EXPIRED:
                self._expire(now, f"no end within {self.deadline_s:g} s")
                return
            self._refused = outcome.result if outcome.end is ClearEnd.REFUSED else None
            self._ask_count(vehicle, now)
        elif self._watch is not None and self._watch.armed and not self._allow_armed:
            self._stopped = True  # no clear any more; but one that was sent may have done its work
            self._ask_count(vehicle, now)

    def _ask_count(self, vehicle: Vehicle, now: float) -> None:
        self._count = Count(
            vehicle.address,
            self.us,
            self._todo[0],
            now=now,
            deadline=self.deadline,
            ask_again_s=LIST_AGAIN_S,
            pace=self._pace,
        )

    def _counted(self, vehicle: Vehicle, count: int | None, now: float) -> None:
        kind = self._todo[0]
        if count is None:
            self._expire(now, f"no end within {self.deadline_s:g} s")
            return
        # ArduPilot counts its home, which is always there, only where there is a mission behind it.
        if count <= int(kind == 0 and self.rules.home_on_wire):
            self._cleared.append(self._todo.pop(0))
            self._writes[kind] = self._watch.writes[kind] if self._watch is not None else 0
            self._attempts = 0
            self._next(vehicle, now)
        elif self._refused is not None:
            why = result_words(self._refused)
            flying = "; while a mission is flown it cannot be cleared" if kind == 0 else ""
            self.error = RefusedError(
                f"{self.rules.title} refused to clear its {THINGS[kind]}: {why}{flying}; it keeps what it had"
            )
            self._say_cleared()
        elif self._stopped:
            self.error = UncertainError(
                f"{vehicle.address} has been armed meanwhile, so nothing more was sent; its {THINGS[kind]} of {count} "
                "items may still be cleared by what is on its way"
            )
            self._say_cleared()
        elif self._attempts < ATTEMPTS:
            self._next(vehicle, now)
        else:
            held = f"{self.rules.title} says its {THINGS[kind]} is cleared, but holds {count} items of it"
            self.error = UncertainError(f"{held}: perhaps another ground station writes; clear again")
            self._say_cleared()

    def _say_cleared(self) -> None:
        if self._cleared and self.error is not None:
            names = " and ".join(THINGS[kind] for kind in self._cleared)
            self.error = told_besides(self.error, f"cleared before: {names}")

    def _timers(self) -> list[float | None]:
        parts = (None if self._stopped else self._clear, self._count)
        return [part.next_timer() for part in parts if part is not None]

    def _expire(self, now: float, cause: str) -> None:
        del now
        thing = THINGS[self._todo[0]] if self._todo else THINGS[0]
        if self._clear is None or not self._clear.sent:
            self.error = RefusedError(f"{cause}: nothing was sent")
        else:
            self.error = UncertainError(f"{cause}: whether the {thing} is still on the vehicle is not known")
        self._say_cleared()
