"""Uploads and downloads that MAVSDK carries out, in the form of our own: `mavsdk_transfers`.

What the vehicle says is followed as in our own transfers, so that every outcome means the same; what is sent, and when
it is sent again, is MAVSDK's doing. MAVSDK gives up after 2.5 s of silence, and at the first answer other than
"accepted"; then, unless the vehicle has refused, it is told to begin again, until the deadline.
"""

from functools import partial
from typing import Any

from mavplan.errors import RefusedError
from mavplan.link.download import BUSY_S, UNSUPPORTED_BELIEVED, Download, DownloadEnd, DownloadOutcome
from mavplan.link.mavsdk import Operation, Result, Station
from mavplan.link.outbox import Progress
from mavplan.link.protocol import Address, Message, opaque_id
from mavplan.link.protocol import Result as AckResult
from mavplan.link.transfer import Move, State
from mavplan.link.transfers import Transfers
from mavplan.link.upload import PUT_OFF_S, Upload, UploadEnd, UploadOutcome

POLL_S = 0.02
_AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1: MAVSDK knows no other component as an autopilot."""
_REFUSED_BY_MAVSDK = {
    Result.INT_MESSAGES_NOT_SUPPORTED: "the vehicle says that it takes no missions in MISSION_ITEM_INT",
    Result.INVALID_ARGUMENT: "MAVSDK takes the items for invalid",
    Result.CURRENT_INVALID: "MAVSDK takes the items for invalid",
    Result.MISSION_TYPE_NOT_CONSISTENT: "MAVSDK takes the items for invalid",
    Result.TOO_MANY_MISSION_ITEMS: "MAVSDK takes the items for too many",
}
"""Where nothing of the vehicle's was heard that says so."""


def mavsdk_transfers(station: Station) -> Transfers:
    """Return what makes a session's transfers go through MAVSDK."""
    return Transfers(partial(MavsdkUpload, station), partial(MavsdkDownload, station))


def _check_component(vehicle: Address) -> None:
    if vehicle.component != _AUTOPILOT:
        raise RefusedError(
            f"MAVSDK knows an autopilot only as component {_AUTOPILOT}, this is {vehicle}; nothing was sent: "
            "leave out --via mavsdk"
        )


class MavsdkUpload(Upload):
    """An upload through MAVSDK. Parameters as of `Upload`, behind the station."""

    def __init__(self, station: Station, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        _check_component(self.vehicle)
        self._station = station
        self._operation: Operation | None = None

    def tick(self, now: float) -> None:
        """Let time pass, and see whether MAVSDK is done."""
        if self._operation is not None and self._operation.result is not None:
            result, self._operation = self._operation.result, None
            self._on_result(result, now)
        super().tick(now)

    def _send(self, message: Message) -> None:
        """MAVSDK sends it."""

    def _ask(self, now: float) -> None:
        if self._operation is None and self._station.ready:
            super()._ask(now)
            self._operation = self._station.upload(self.mission_type, self.items)
        else:
            self._ask_at = now + POLL_S

    def _on_request(self, seq: int, now: float) -> None:
        if self._operation is None and self.state is State.PAUSED:
            self.taken = (
                True  # of a transfer that MAVSDK has given up; it begins again when the pause is over
            )
        else:
            super()._on_request(seq, now)

    def _on_moving(self, now: float) -> None:
        if self._due is not None and now >= self._due:
            self._due = None
            self._send_item(self._asked, now)
        if self._operation is None and self.state is State.MOVING:
            self._pause(now, PUT_OFF_S)  # the vehicle asks, but MAVSDK has nothing more to say

    def _moving_timer(self) -> float:
        return self._last_send_at + POLL_S

    def _on_result(self, result: Any, now: float) -> None:
        if self.state in {State.ENDED, State.PAUSED}:
            return
        if result == Result.SUCCESS or self.all_sent:
            # Without an ACK of ours to go by, or with the last one lost: the read-back tells.
            self._end(Move.FINISHED, UploadOutcome(UploadEnd.UNRESOLVED))
        elif not self.taken and result in _REFUSED_BY_MAVSDK and self.put_off_by is None:
            raise RefusedError(f"{_REFUSED_BY_MAVSDK[result]}; nothing of it was sent")
        else:
            self._note(Progress("uploading", 0, len(self.items), f"MAVSDK: {_words(result)}"))
            self._pause(now, PUT_OFF_S)


class MavsdkDownload(Download):
    """A download through MAVSDK. Parameters as of `Download`, behind the station."""

    def __init__(self, station: Station, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        _check_component(self.vehicle)
        self._station = station
        self._operation: Operation | None = None
        self._out_of_date = False
        self._said: int | None = None

    def restart(self, now: float, pause_s: float = 0.0) -> None:
        """Do it all again, after a pause; what MAVSDK is fetching now does not count."""
        self._out_of_date = self._operation is not None
        super().restart(now, pause_s)

    def tick(self, now: float) -> None:
        """Let time pass, and see whether MAVSDK is done."""
        if self._operation is not None and self._operation.result is not None:
            ended, self._operation = self._operation, None
            if self._out_of_date:
                self._out_of_date = False
            elif self.state is State.ASKING:
                self._on_result(ended, now)
        super().tick(now)

    def _send(self, message: Message) -> None:
        """MAVSDK sends it."""

    def _ask(self, now: float) -> None:
        self._ask_at = now + POLL_S
        if self._operation is None and self._station.ready:
            self._said = None
            self._operation = self._station.download(self.mission_type)

    def _on_message(self, message: Message, now: float) -> None:
        match message.get_type():
            case "MISSION_COUNT":
                self._count = int(message.count)
                self.opaque_id = opaque_id(message)
            case "MISSION_ITEM_INT":
                self._note(Progress(self._phase, message.seq + 1, self._count))
            case "MISSION_ACK":
                self._said = int(message.type)

    def _on_result(self, ended: Operation, now: float) -> None:
        if ended.result == Result.SUCCESS or (
            ended.result == Result.NO_MISSION_AVAILABLE and not self._count
        ):
            self._move(Move.FINISHED)
            self.outcome = DownloadOutcome(DownloadEnd.COMPLETE, ended.items)
            return
        if self._said in {AckResult.UNSUPPORTED, AckResult.NO_SPACE}:
            self._refusals += 1
            if self._refusals >= UNSUPPORTED_BELIEVED:
                self._move(Move.REFUSED)
                self.outcome = DownloadOutcome(DownloadEnd.REFUSED, result=self._said)
                return
        self._note(Progress(self._phase, 0, 0, f"MAVSDK: {_words(ended.result)}"))
        self._pause(now, BUSY_S)


def _words(result: Any) -> str:
    """Return the result's name only: MAVSDK's own text holds every item."""
    return str(result.name).lower().replace("_", " ")
