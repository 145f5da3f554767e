"""What is told about an upload: `UploadReport` when it is stored and verified, else one sentence of what is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavplan.errors import MavplanError, Problem, RefusedError, UncertainError
from mavplan.link.manners import Manners
from mavplan.link.protocol import Address, Result, result_words, seqs_in_words
from mavplan.link.upload import Upload, UploadOutcome
from mavplan.link.verdict import Judgement
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.model import Autopilot
from mavplan.mission.readback import Difference
from mavplan.mission.sendable import command_name
from mavplan.mission.wire import WireItem

if TYPE_CHECKING:
    from mavplan.mission.fence_force import FenceForce

THINGS: dict[int, str] = {0: "mission", 1: "fence", 2: "rally points"}
"""What a list is called, by MAV_MISSION_TYPE."""
_OLD: dict[int, str] = {0: "its old mission", 1: "its old fence", 2: "its old rally points"}


@dataclass(frozen=True, slots=True)
class UploadReport:
    """A mission that is stored and verified.

    Attributes
    ----------
    items
        Items on the wire, with home on ArduPilot.
    autopilot, vehicle
        Firmware and address.
    judgement
        What PX4 thinks of it; None for an autopilot that does not judge.
    opaque_id
        The vehicle's checksum of its mission, where it has one.
    upload_s
        Seconds from the first count to the ACK (or to the last item, if the ACK was lost).
    total_s
        Seconds from the first look for a vehicle to the end.
    uploads, read_backs
        How often it took.
    stored
        The mission's items as the vehicle gave them back.
    warnings
        What else should be known.
    fence_items, rally_items
        Items of the fence and of the rally points that are stored and verified with it; 0: not sent.
    fence_force
        Whether a fence is in force on the vehicle, and whether this mission would breach it; None: not asked.
    """

    items: int
    autopilot: Autopilot
    vehicle: Address
    judgement: Judgement | None
    opaque_id: int | None
    upload_s: float
    total_s: float
    uploads: int
    read_backs: int
    stored: tuple[WireItem, ...]
    warnings: tuple[Problem, ...] = ()
    fence_items: int = 0
    rally_items: int = 0
    fence_force: "FenceForce | None" = None


class DiffersError(UncertainError):
    """The vehicle gave back something else than it was sent; ``differences`` has every field."""

    def __init__(self, message: str, found: Sequence[Difference]) -> None:
        self.differences = tuple(found)
        super().__init__(message)


def refused(
    upload: Upload,
    outcome: UploadOutcome,
    rules: AutopilotRules,
    manners: Manners,
    *,
    texts: Sequence[str],
    space: int | None,
    stored: Sequence[WireItem] | None,
    found: Sequence[Difference],
) -> MavplanError:
    """Put a refusal into words: whether the old mission is kept is the first thing that matters.

    Parameters
    ----------
    upload, outcome
        The transfer and its end.
    rules, manners
        The firmware.
    texts
        What the vehicle said beside its ACK.
    space
        Items it has room for, where it said so.
    stored, found
        What it holds, read back after the refusal (None: not to be had), and how that differs from the mission.
    """
    count = len(upload.items)
    thing = THINGS[upload.mission_type]
    if outcome.result == Result.NO_SPACE:
        with_home = ", home included" if rules.home_on_wire and upload.mission_type == 0 else ""
        this = f"this mission has {count}" if upload.mission_type == 0 else f"the {thing} take {count}"
        what = (
            f"the vehicle has room for {space} items, {this}{with_home}"
            if space
            else f"the vehicle has no room for the {count} items of this {thing}{with_home}"
        )
    elif outcome.seq is None:
        what = f"{rules.title} refused the {thing}: {result_words(outcome.result or 0)}"
    else:
        name = command_name(upload.items[outcome.seq].command)
        what = f"{rules.title} refused item {outcome.seq} ({name}): {result_words(outcome.result or 0)}"
    said = f"; it says {'; '.join(repr(text) for text in texts)}" if texts else ""
    if stored is not None and not found and (upload.all_sent or upload.was_whole):
        return UncertainError(
            f"{what}, but everything had been sent and it now holds just this {thing}: verify{said}"
        )
    # A whole try before this one may have been stored, unless it was the refusal of a whole list each time.
    stored_before = upload.was_whole and outcome.result != Result.ERROR
    if not upload.taken or (manners.atomic and not stored_before):
        return RefusedError(f"{what}{said}; the vehicle keeps {_old(stored, upload.mission_type)}")
    if stored is None and manners.atomic:
        return UncertainError(f"{what}; whether it stored an earlier try is not known: do not fly it{said}")
    if stored is None:
        rest = f"the items before it are new and the rest is old: do not fly it{said}"
        return UncertainError(f"{what}; {rest}")
    wrong = sorted({difference.seq for difference in found if difference.seq is not None})
    are = "are" if len(wrong) > 1 else "is"
    holds = f"it now holds {len(stored)} items, of which {seqs_in_words(wrong)} {are} not this mission's"
    if not wrong:
        holds = f"it now holds {len(stored)} items of {count}"
    return DiffersError(f"{what}; {holds}: do not fly it{said}", found)


def _old(stored: Sequence[WireItem] | None, mission_type: int) -> str:
    if stored is None:
        return _OLD[mission_type]
    if not stored:
        return f"what it had: no {THINGS[mission_type]}"
    return (
        f"{_OLD[mission_type]} of {len(stored)} items"
        if mission_type < 2
        else f"its {len(stored)} old rally points"
    )


def broken_off(upload: Upload, rules: AutopilotRules, manners: Manners, cause: str) -> MavplanError:  # noqa: PLR0911
    """Put into words what is known when a transfer ended before its outcome.

    Parameters
    ----------
    upload, rules, manners
        The transfer and the firmware.
    cause
        For instance ``no end within 60 s``.
    """
    count, thing, old = len(upload.items), THINGS[upload.mission_type], _OLD[upload.mission_type]
    if upload.count_sent_at is None:
        return RefusedError(f"{cause}: nothing of the {thing} was sent")
    if not upload.taken:
        if upload.put_off_by is not None and not upload.unanswered_counts:
            why = result_words(upload.put_off_by)
            return RefusedError(
                f"{cause}: the vehicle put the {thing} off every time, {why}; nothing of it was taken"
            )
        return UncertainError(
            f"{cause}: the vehicle was told of {count} items but never asked for one, "
            f"so whether it still holds {old} is not known"
        )
    far = f"{cause}: the vehicle had asked for {upload.highest_asked + 1} of {count} items"
    if upload.accepted_at is not None:
        return UncertainError(f"{far} and accepted them once, but what it holds now is not known")
    if not manners.atomic:
        return UncertainError(
            f"{far}; {rules.title} overwrites its {thing} item by item, so it holds a mixture of the old and the new: "
            "do not fly it, upload again"
        )
    if upload.highest_asked < count - 1:
        return UncertainError(
            f"{far}; {rules.title} keeps {old} until the last item is in, "
            "but that could not be read back: upload again"
        )
    return UncertainError(
        f"{far}; whether {rules.title} took the last one could not be read back: upload again"
    )


def unread(upload: Upload, rules: AutopilotRules, cause: str) -> UncertainError:
    """Put into words that all was sent, but nothing could be read back."""
    took = "accepted" if upload.accepted_at is not None else "was sent"
    return UncertainError(
        f"{cause}: {rules.title} {took} all {len(upload.items)} {_items(upload.mission_type)}, "
        "but they could not be read back, so what it holds is not known"
    )


def unsettled(upload: Upload, rules: AutopilotRules, cause: str) -> UncertainError:
    """Put into words that all was read back as sent, but something on its way could still have changed it."""
    return UncertainError(
        f"{cause}: {rules.title} gave all {len(upload.items)} {_items(upload.mission_type)} back as sent, but the time "
        "was too short to be sure that it keeps them: verify"
    )


def differing(
    found: Sequence[Difference], rules: AutopilotRules, reason: str = "", mission_type: int = 0
) -> DiffersError:
    """Put into words that the vehicle holds something else, and stays by it."""
    shown = "; ".join(difference.words for difference in found[:3])
    more = f"; and {len(found) - 3} more" if len(found) > 3 else ""
    of = "" if mission_type == 0 else f" of the {THINGS[mission_type]}"
    return DiffersError(
        f"{reason}{rules.title} holds something else{of} than it was sent: {shown}{more}", found
    )


def _items(mission_type: int) -> str:
    return "items" if mission_type == 0 else f"items of the {THINGS[mission_type]}"


def told_besides(error: MavplanError, words: str) -> MavplanError:
    """Return the error with something more said at the end of its sentence."""
    error.args = (f"{error}; {words}", *error.args[1:])
    return error


def infeasible(
    count: int, rules: AutopilotRules, reasons: Sequence[str], texts: Sequence[str]
) -> RefusedError:
    """Put into words that a stored mission will not be flown.

    Parameters
    ----------
    count, rules
        Items that are stored; the firmware.
    reasons
        Why, as the vehicle's events tell.
    texts
        What it said besides since the upload; told where its events tell nothing.
    """
    told = "; ".join(reasons or (repr(text) for text in texts))
    said = f": {told}" if told else ", without a reason that it would tell"
    return RefusedError(f"{rules.title} stored all {count} items but judges the mission not flyable{said}")
