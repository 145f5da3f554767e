"""Holds what a transfer claims against the vehicle's memory, and its manners against the bytes it sent.

The judge uses none of mavplan's own comparisons.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

from benchmarks.transfer_case import Case, Lists, Observed, Transfer, transfer
from mavplan.errors import CheckError, InputError, MavplanError, NoLinkError, RefusedError, UncertainError
from mavplan.link.clear_session import ClearSession
from mavplan.link.download_session import DownloadSession
from mavplan.mission.model import Mission
from sitl_mock.feasibility import infeasible_because
from sitl_mock.items import StoredItem
from sitl_mock.wire import message_id
from tests.link.harness import settle

COUNT, ITEM = common.MAVLINK_MSG_ID_MISSION_COUNT, common.MAVLINK_MSG_ID_MISSION_ITEM_INT
UNASKED_S = 0.25
"""An item may go out again, or unasked, only so often."""
ROUNDING_S = 1e-6
LANDING_S = 20.0
"""After this long nothing of the transfer is in the air any more."""
TOO_LOW = "the take-off is too low"
"""The reason of every infeasible mission of the campaign."""
OUTCOMES: tuple[tuple[type[MavplanError], str], ...] = (
    (RefusedError, "refused"),
    (UncertainError, "uncertain"),
    (NoLinkError, "no link"),
    (CheckError, "other"),
)


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a transfer.

    Attributes
    ----------
    case
        What it was about.
    outcome
        ``verified`` (or read, or cleared), ``refused``, ``uncertain``, ``no link``, ``other`` (the vehicle holds
        something else, or nothing), ``fault``.
    took_s
        Virtual seconds.
    words
        What the user is told.
    wrong
        What is wrong with all that, a sentence each; empty is good.
    """

    case: Case
    outcome: str
    took_s: float
    words: str
    wrong: tuple[str, ...]


def run_case(case: Case) -> Result:
    """Run a transfer and judge it."""
    return judge(transfer(case))


def judge(ended: Transfer) -> Result:
    """Judge a transfer that has ended."""
    error, took_s = ended.run.error, ended.run.ended_s
    outcome = "verified"
    if error is not None:
        outcome = next((name for kind, name in OUTCOMES if isinstance(error, kind)), "fault")
    wrong = [f"ended with {error!r}"] if outcome == "fault" else []
    if isinstance(error, InputError):
        wrong.append("the campaign made a mission that cannot be sent")
    if took_s > ended.case.deadline_s + 1e-3:
        wrong.append(f"outlived its deadline: {took_s:.3f} s")
    if "not flyable: " in str(error) and TOO_LOW not in str(error):
        wrong.append("a reason is told that is none of this mission's")
    wrong += _untrue(outcome, ended)
    wrong += flooding(ended.run.sent, ended.requests)
    return Result(ended.case, outcome, took_s, str(error or ""), tuple(wrong))


def _untrue(outcome: str, ended: Transfer) -> list[str]:
    """Compare what is claimed with the vehicle's memory, at the end and when all has landed."""
    network = ended.run.network
    assert isinstance(network, Observed)
    foreign = network.faults.second_gcs == "upload"
    wrong: list[str] = []
    for when in ("at the end", "when all had landed"):
        held = network.held()
        if outcome == "verified" and not _is_true(ended, held):
            # Another station may have written since: then what counts is what was held at the last item sent.
            if not (foreign and _is_true(ended, held | network.held_when_told)):
                wrong.append(f"verified, but {when} that is not so")
        elif outcome == "refused" and not foreign and not _is_kept(ended, held):
            wrong.append(f"refused, but {when} the vehicle does not hold its old mission")
        elif outcome == "other" and _is_true(ended, held):
            wrong.append(f"said to hold something else, but {when} it holds just this")
        elif outcome == "other" and _has_mission(ended, held) and not foreign:
            wrong.append(f"said to hold no mission, but {when} it holds one")
        settle(network, LANDING_S)
    return wrong


def _is_true(ended: Transfer, held: Lists) -> bool:
    """Whether the vehicle holds what was uploaded, verified or read; or nothing, where it was cleared."""
    session, sample = ended.run.session, ended.sample
    if isinstance(session, ClearSession):
        home = int(ended.case.firmware == "ardupilot")
        return len(held[0]) <= home and not held[1] and not held[2]
    if isinstance(session, DownloadSession):
        return session.mission is not None and _was_read(session, session.mission, held, ended.case.firmware)
    return sample.is_held(held[0]) and sample.areas_are_held(held[1], held[2])


def _has_mission(ended: Transfer, held: Lists) -> bool:
    """Whether a vehicle whose mission was to be read has one."""
    home = int(ended.case.firmware == "ardupilot")
    return isinstance(ended.run.session, DownloadSession) and len(held[0]) > home


def _was_read(session: DownloadSession, mission: Mission, held: Lists, firmware: str) -> bool:
    """Whether what was read is what the vehicle holds; the mock gives every list, so none may be said to be missing."""
    flown = held[0][1:] if firmware == "ardupilot" else [_with_heading(item) for item in held[0]]
    items = len(flown) == len(mission.items) and all(
        (read.command, read.lat_e7, read.lon_e7, read.alt_m, repr(read.params))
        == (item.command, item.x, item.y, item.z, repr(item.params))
        for read, item in zip(mission.items, flown, strict=True)
    )
    given = not any(problem.code == "not-given" for problem in session.warnings)
    fence = _areas(mission) == [(item.command, item.params[0], item.x, item.y) for item in held[1]]
    points = [(point.lat_e7, point.lon_e7, point.alt_rel_m) for point in mission.rally]
    rally = points == [(item.x, item.y, item.z) for item in held[2]]
    return items and fence and rally and given


def _with_heading(item: StoredItem) -> StoredItem:
    """Return a hold of PX4 with the heading that all missions here are sent with: along the track."""
    return dataclasses.replace(item, param4=math.nan) if item.command == 19 else item


def _areas(mission: Mission) -> list[tuple[int, float, int, int]]:
    """Write a fence down as a vehicle holds it: command, vertices or radius, and place of each item."""
    if mission.fence is None:
        return []
    corners = [
        (5001 if polygon.inclusion else 5002, float(len(polygon.vertices_e7)), *vertex)
        for polygon in mission.fence.polygons
        for vertex in polygon.vertices_e7
    ]
    return corners + [
        (5003 if circle.inclusion else 5004, circle.radius_m, circle.lat_e7, circle.lon_e7)
        for circle in mission.fence.circles
    ]


def _is_kept(ended: Transfer, held: Lists) -> bool:
    """Whether the old mission is there; or this one, where PX4 judges it infeasible."""
    if _but_current(held[0]) == _but_current(ended.before[0]):
        return True
    vehicle = ended.run.network.autopilot
    is_px4 = vehicle.firmware.name == "px4"
    judged = is_px4 and infeasible_because(held[0], held[1], vehicle.vehicle.home) is not None
    return judged and ended.sample.is_held(held[0])


def _but_current(items: Sequence[StoredItem]) -> str:
    return repr([item.numbered(item.seq, current=0) for item in items])  # in words NaN is like NaN


def flooding(sent: Sequence[tuple[float, bytes]], requests: Sequence[tuple[float, int, int]]) -> list[str]:
    """Find items that were sent again, or unasked, sooner than they may be.

    Parameters
    ----------
    sent
        Time and frame of all that was sent.
    requests
        Time, mission type and item of every request that arrived.
    """
    last: dict[tuple[int, int], float] = {}
    last_unasked = -UNASKED_S
    coming = iter(sorted(requests))
    following = next(coming, None)
    asked: set[tuple[int, int]] = set()
    for at, frame in sent:
        kind = message_id(frame)
        if kind == COUNT:
            last.clear()  # the whole upload started again
        if kind != ITEM:
            continue
        while following is not None and following[0] <= at:
            asked.add(following[1:])
            following = next(coming, None)
        payload = frame[10:-2].ljust(38, b"\0")
        item = (payload[37], int.from_bytes(payload[28:30], "little"))
        if item in last and at - last[item] < UNASKED_S - ROUNDING_S:
            return [f"item {item[1]} of list {item[0]} was sent again after {at - last[item]:.3f} s"]
        if item not in asked:
            if at - last_unasked < UNASKED_S - ROUNDING_S:
                return [
                    f"item {item[1]} of list {item[0]} was sent unasked {at - last_unasked:.3f} s after another"
                ]
            last_unasked = at
        asked.discard(item)
        last[item] = at
    return []
