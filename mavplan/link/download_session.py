"""Fetch the mission that a vehicle holds, and its home. No I/O; see `mavplan.link.session`."""

from mavplan.errors import CheckError, Problem, RefusedError, UncertainError
from mavplan.link.discovery import Vehicle, refusal
from mavplan.link.download import Download, DownloadEnd
from mavplan.link.protocol import HOME_POSITION_ID, Message, request_message, result_words, sender
from mavplan.link.session import Session
from mavplan.link.transfers import OWN, Transfers
from mavplan.mission.model import Autopilot, HomePosition, Mission
from mavplan.mission.wire import from_wire, has_home_item

HOME_AGAIN_S = 0.5
QUIET_S = 1.0
HOME_PATIENCE_S = 5.0
"""A vehicle that has no home yet stays silent."""


class DownloadSession(Session):
    """Fetch the mission of the one vehicle on a link.

    Parameters
    ----------
    wanted
        The firmware it must run; None takes either.
    transfers
        Who carries out the transfer.
    now, deadline_s, system, place
        As for `Session`.
    """

    def __init__(
        self,
        *,
        now: float,
        deadline_s: float,
        system: int | None = None,
        place: str = "this connection",
        wanted: Autopilot | None = None,
        transfers: Transfers = OWN,
    ) -> None:
        super().__init__(now=now, deadline_s=deadline_s, system=system, place=place, wanted=wanted)
        self.mission: Mission | None = None
        self.warnings: tuple[Problem, ...] = ()
        self._transfers = transfers
        self._download: Download | None = None
        self._home: HomePosition | None = None
        self._home_at = now
        self._home_until = now
        self._signs = (0, 0)

    @property
    def done(self) -> bool:
        """Whether there is a mission or an error."""
        return self.mission is not None or self.error is not None

    def _refusal(self, vehicle: Vehicle) -> RefusedError | None:
        return refusal(vehicle, self.wanted, "download")

    def _found(self, vehicle: Vehicle, now: float) -> None:
        self._download = self._transfers.download(
            self.manners, vehicle.address, self.us, now=now, deadline=self.deadline, pace=self._pace
        )
        self._home_at = now
        self._home_until = now + HOME_PATIENCE_S
        self._on_tick(now)

    def _on_message(self, message: Message, now: float) -> None:
        if self._download is not None:
            self._download.receive(message, now)
        if (
            self.vehicle is not None
            and message.get_type() == "HOME_POSITION"
            and sender(message) == self.vehicle.address
        ):
            self._home = HomePosition(message.latitude, message.longitude, message.altitude / 1000)

    def _on_tick(self, now: float) -> None:
        download, watch, vehicle = self._download, self._watch, self.vehicle
        if download is None or watch is None or vehicle is None:
            return
        if (signs := (watch.foreign_signs, watch.reboots)) != self._signs:
            self._signs = signs
            if download.outcome is None or download.outcome.end is DownloadEnd.COMPLETE:
                download.restart(
                    now, QUIET_S
                )  # another station writes: half of what came may be the old mission
        download.tick(now)
        if self._home is None and self._home_at <= now:
            self._home_at = now + HOME_AGAIN_S
            if now < self._home_until:
                self._outbox.append(request_message(vehicle.address, HOME_POSITION_ID))
        self._advance(download, vehicle, now)
        self._outbox += download.to_send()
        self._notes += download.events()

    def _advance(self, download: Download, vehicle: Vehicle, now: float) -> None:
        outcome = download.outcome
        if outcome is None:
            return
        if outcome.end is DownloadEnd.REFUSED:
            why = result_words(outcome.result or 0)
            self.error = RefusedError(f"{vehicle.address} does not give its mission: {why}")
        elif outcome.end is DownloadEnd.EXPIRED:
            self._expire(now, f"no end within {self.deadline_s:g} s")
        elif len(outcome.items) <= int(self.rules.home_on_wire):
            self.error = CheckError(f"{vehicle.address} holds no mission")
        elif self._home is not None or has_home_item(outcome.items, self.rules) or now >= self._home_until:
            self.mission, self.warnings = from_wire(outcome.items, self.rules, self._home, vehicle.mav_type)

    def _timers(self) -> list[float | None]:
        if self._download is None:
            return []
        timers = [self._download.next_timer()]
        if self._home is None and self._home_at < self._home_until:
            timers.append(self._home_at)
        if self._download.outcome is not None:
            timers.append(self._home_until)
        return timers

    def _expire(self, now: float, cause: str) -> None:
        download = self._download
        if (
            download is not None
            and download.outcome is not None
            and download.outcome.end is DownloadEnd.COMPLETE
        ):
            self._home_until = now
            self._advance(download, self.vehicle, now) if self.vehicle is not None else None
            return
        self.error = UncertainError(
            f"{cause}: the vehicle's mission could not be read; the vehicle was not changed"
        )
