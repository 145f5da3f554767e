"""When the vehicle held at each stop: from its own words about items, from the track where there are none. Pure.

Both autopilots say MISSION_ITEM_REACHED when an item is over. The word about the item that flies to a stop is the
beginning of the hold, that about the item that holds is its end. An item that DO_CHANGE_SPEED follows (ArduPilot, PX4)
or the return (PX4) gets no word: the next number stands for it. Measured in simulation: ArduCopter 4.7.0-dev of July
2025, PX4 main of 2025-08-18.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mavplan.mission.build import StopItems
from mavplan.mission.model import Autopilot
from mavplan.proof.path import Path
from mavplan.track.model import Floats, ItemEvent, Span

NEAR_M = 30.0
"""A hold that is known from the track alone is a stop's if it was no further from its place."""

AT_HOME_M = 3.0
"""The vehicle is above a stop so near to where the flight began before its climb is over."""

STAYED_M = 15.0
"""The word about another item stands for the end of a hold if the vehicle was still so near to where it held."""

SLOW_M_S = 0.5
"""Below this speed over the ground the vehicle hovers."""

SPEED_WINDOW_S = 1.0
"""Speed is the way made in this time: shorter, and the noise of positions would pass for speed."""

SHORT_BREAK_S = 1.0
"""A gust shorter than this does not end a hover."""


@dataclass(frozen=True, slots=True)
class _Manner:
    """What lies between hovering as seen from outside and the autopilot's clock of a hold.

    Attributes
    ----------
    begins_after_s
        From the vehicle becoming slow to the beginning of the hold.
    ends_before_s
        From the end of the hold until it is no longer slow.
    radius_m
        The hold begins at the first moment within this distance of the place, moving or not; 0: it is slow first.
    unsure_s
        So far off a beginning found in this way may be: within it, the planned hold is believed.
    """

    begins_after_s: float
    ends_before_s: float
    radius_m: float
    unsure_s: float


_MANNERS: dict[Autopilot | None, _Manner] = {
    # three recorded holds: 0.9 to 1.1 s, 1.1 to 1.2 s (2 s before a return)
    "ardupilot": _Manner(1.0, 1.1, 0.0, 0.6),
    # NAV_ACC_RAD; three recorded holds: 0 to 0.6 s
    "px4": _Manner(0.0, 0.3, 2.0, 0.3),
    None: _Manner(0.0, 0.0, 0.0, 0.0),
}


@dataclass(frozen=True, slots=True)
class Hold:
    """When the vehicle held at a stop.

    Attributes
    ----------
    span
        From the beginning to the end of the hold.
    by
        ``vehicle``: it said both; ``track``: one or both were found in where it was.
    there
        All the time around it in which the vehicle stood still or nearly so: what is received then is received at
        the stop, though the autopilot's clock of the hold did not run yet, or no more.
    """

    span: Span
    by: Literal["vehicle", "track"]
    there: Span


@dataclass(frozen=True, slots=True)
class Hover:
    """A time in which the vehicle was slow, at planned height, and where."""

    span: Span
    x_m: float
    y_m: float


def find_holds(
    path: Path,
    places_m: Floats,
    items: Sequence[StopItems],
    planned_s: Floats,
    reached: Sequence[ItemEvent],
    autopilot: Autopilot | None,
    in_mission: Sequence[Span] | None = None,
) -> list[Hold | None]:
    """Return when the vehicle held at each of M stops, None where it did not or nothing shows it.

    Parameters
    ----------
    path
        The flight.
    places_m
        (M, 2) the stops, metres.
    items
        Where the stops stand in the mission, from 0 without home.
    planned_s
        (M,) holds as the autopilot stored them.
    reached
        The vehicle's words of this flight, their items counted as ``items`` does.
    autopilot
        Whose manner.
    in_mission
        When it flew its mission by itself: a hold that was broken off begins anew.
    """
    if len(path.time_s) < 2:
        return [None] * len(items)
    hovers = find_hovers(path)
    said = _said(path, items, reached)
    nearest = match_hovers(hovers, places_m, said)
    spans: list[tuple[Span, bool] | None] = []
    after_s = float(path.time_s[0])
    manner = _MANNERS[autopilot]
    for stop, place_m in enumerate(places_m):
        if float(np.hypot(*(path.xy_m[0] - place_m))) <= AT_HOME_M:
            after_s = max(after_s, _busy_until_s(path, reached, items[stop].first, said[stop], nearest[stop]))
        found = _hold(path, place_m, said[stop], nearest[stop], manner, after_s, float(planned_s[stop]))
        if found is not None:
            found = _unbroken(found[0], in_mission), found[1]
            after_s = found[0].until_s
        spans.append(found)
    known = [found[0] for found in spans if found is not None]
    return [
        None
        if found is None
        else Hold(found[0], "vehicle" if found[1] else "track", _there(found[0], known, hovers))
        for found in spans
    ]


def _there(span: Span, holds: Iterable[Span], hovers: Iterable[Hover]) -> Span:
    """Return a hold with the hovers that touch it, as far as they reach into no other hold."""
    others = [other for other in holds if other is not span]
    before_s = max((other.until_s for other in others if other.until_s <= span.from_s), default=-math.inf)
    after_s = min((other.from_s for other in others if other.from_s >= span.until_s), default=math.inf)
    touching = [
        hover.span
        for hover in hovers
        if hover.span.from_s <= span.until_s and hover.span.until_s >= span.from_s
    ]
    return Span(
        min([span.from_s, *(max(one.from_s, before_s) for one in touching)]),
        max([span.until_s, *(min(one.until_s, after_s) for one in touching)]),
    )


@dataclass(frozen=True, slots=True)
class _Said:
    """What the vehicle said about a stop; None where it did not."""

    begin_s: float | None
    end_s: float | None


def _said(path: Path, items: Sequence[StopItems], reached: Sequence[ItemEvent]) -> list[_Said]:
    """Return the vehicle's words about each stop, each after those about the one before."""
    first_s, last_s = float(path.time_s[0]), float(path.time_s[-1])
    words = [event for event in reached if first_s <= event.time_s]
    said: list[_Said] = []
    after_s = -math.inf
    for stop, item in enumerate(items):
        next_first = items[stop + 1].first if stop + 1 < len(items) else item.hold + 2
        begin_s = _first(words, range(item.first, item.hold), after_s) if item.first < item.hold else None
        if begin_s is not None:
            after_s = begin_s
        end_s = _first(words, [item.hold], after_s)
        if end_s is None:
            end_s = _first(words, range(item.hold + 1, next_first), after_s)
            if end_s is not None and not _stayed(path, begin_s, min(end_s, last_s)):
                end_s = None
        if end_s is not None:
            after_s = end_s
        said.append(
            _Said(
                None if begin_s is None else min(begin_s, last_s),
                None if end_s is None else min(end_s, last_s),
            )
        )
    return said


def _first(words: Iterable[ItemEvent], items: Iterable[int], after_s: float) -> float | None:
    """Return when the first of these items was reached after a time."""
    wanted = set(items)
    return min((word.time_s for word in words if word.seq in wanted and word.time_s >= after_s), default=None)


def _busy_until_s(
    path: Path, reached: Sequence[ItemEvent], first: int, said: _Said, hover: Hover | None
) -> float:
    """Return when the last item before a stop's was over, or, where nothing was said, the vehicle had climbed."""
    end_s = said.end_s if said.end_s is not None else None if hover is None else hover.span.until_s
    if end_s is None:
        return -math.inf
    climbed_s = float(path.time_s[int(path.counts.argmax())]) if path.counts.any() else -math.inf
    return max(
        (word.time_s for word in reached if word.seq < first and word.time_s <= end_s), default=climbed_s
    )


def _stayed(path: Path, begin_s: float | None, end_s: float) -> bool:
    """Return whether the vehicle was at the end of a supposed hold where it was at the beginning, or just before."""
    before = path.at(end_s - 1.0 if begin_s is None else begin_s)
    return float(np.hypot(*(path.at(end_s) - before)[:2])) <= STAYED_M


def _hold(
    path: Path,
    place_m: Floats,
    said: _Said,
    hover: Hover | None,
    manner: _Manner,
    after_s: float,
    planned_s: float,
) -> tuple[Span, bool] | None:
    """Return the hold at one stop from what was said and where the vehicle hovered, and whether all was said."""
    if said.begin_s is not None and said.end_s is not None:
        return Span(said.begin_s, said.end_s), True
    end_s = said.end_s
    if end_s is None and hover is not None:
        end_s = hover.span.until_s - manner.ends_before_s
    if end_s is None:
        # It said that it was there, and flew on without ever being slow; or it was never there.
        return None if said.begin_s is None else (Span(said.begin_s, said.begin_s), False)
    if said.begin_s is not None:
        return Span(min(said.begin_s, end_s), end_s), False
    begin_s = end_s if hover is None else max(hover.span.from_s + manner.begins_after_s, after_s)
    if manner.radius_m:
        begin_s = _enters_s(path, place_m, manner.radius_m, Span(after_s, end_s), begin_s)
    if said.end_s is not None and abs(end_s - begin_s - planned_s) <= manner.unsure_s:
        begin_s = end_s - planned_s
    return Span(min(begin_s, end_s), end_s), False


def _enters_s(path: Path, place_m: Floats, radius_m: float, span: Span, otherwise_s: float) -> float:
    """Return the first moment within a distance of a place, or another where there is none."""
    away_m = np.hypot(*(path.xy_m - place_m).T)
    inside = np.flatnonzero(
        (away_m <= radius_m) & (path.time_s >= span.from_s) & (path.time_s <= span.until_s)
    )
    if not len(inside):
        return otherwise_s
    row = int(inside[0])
    if row == 0 or away_m[row - 1] <= radius_m:
        return float(path.time_s[row])
    share = (away_m[row - 1] - radius_m) / (away_m[row - 1] - away_m[row])
    return float(path.time_s[row - 1] + share * (path.time_s[row] - path.time_s[row - 1]))


def _unbroken(span: Span, in_mission: Sequence[Span] | None) -> Span:
    """Return the part of a hold after the vehicle last took up its mission again."""
    taken_up = [one.from_s for one in in_mission or () if span.from_s < one.from_s < span.until_s]
    was_on = any(one.from_s <= span.from_s <= one.until_s for one in in_mission or ())
    return Span(max(taken_up), span.until_s) if taken_up and was_on else span


def find_hovers(path: Path) -> list[Hover]:
    """Return the times in which the vehicle was slow at the height at which things count, in their order."""
    half_s = SPEED_WINDOW_S / 2
    before_s = np.maximum(path.time_s - half_s, path.time_s[0])
    after_s = np.minimum(path.time_s + half_s, path.time_s[-1])
    moved = [
        np.interp(after_s, path.time_s, axis) - np.interp(before_s, path.time_s, axis) for axis in path.xy_m.T
    ]
    slow = np.hypot(*moved) <= SLOW_M_S * (after_s - before_s)
    counts = np.concatenate((path.counts, path.counts[-1:])) | np.concatenate((path.counts[:1], path.counts))
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (slow & counts).astype(np.int8), [0]))))
    spans: list[Span] = []
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        span = Span(float(path.time_s[first]), float(path.time_s[last]))
        if spans and span.from_s - spans[-1].until_s <= SHORT_BREAK_S:
            spans[-1] = Span(spans[-1].from_s, span.until_s)
        else:
            spans.append(span)
    return [Hover(span, *path.at((span.from_s + span.until_s) / 2)[:2]) for span in spans]


def match_hovers(hovers: Sequence[Hover], places_m: Floats, said: Sequence[_Said]) -> list[Hover | None]:
    """Return the hover that belongs to each stop: in the stops' order, as near to them in all as can be.

    A stop of which the vehicle said something has the hover of that moment, wherever it was.
    """
    stops = len(places_m)
    if not hovers:
        return [None] * stops
    at_m = np.array([(hover.x_m, hover.y_m) for hover in hovers])
    away_m = np.hypot(*(places_m[:, None, :] - at_m[None, :, :]).transpose(2, 0, 1))
    gain = np.clip(1.0 - away_m / NEAR_M, 0.0, None) + 0.01 * (away_m <= NEAR_M)
    for stop, words in enumerate(said):
        moment_s = words.begin_s if words.begin_s is not None else words.end_s
        if moment_s is None:
            continue
        gain[stop] = 0.0
        late_s = 3.0 if words.begin_s is not None else 0.0
        for number, hover in enumerate(hovers):
            if hover.span.from_s - late_s <= moment_s <= hover.span.until_s + 1.0:
                gain[stop, number] = float(stops)
    return [None if number is None else hovers[number] for number in _best_order(gain)]


def _best_order(gain: Floats) -> list[int | None]:
    """Return for each row a column, columns increasing from row to row, such that the gains' sum is greatest."""
    rows, columns = gain.shape
    best = np.zeros((rows + 1, columns + 1))
    for row in range(rows):
        taken = best[row, :-1] + gain[row]
        best[row + 1, 1:] = np.maximum.accumulate(np.maximum(taken, best[row, 1:]))
    chosen: list[int | None] = [None] * rows
    column = columns
    for row in range(rows - 1, -1, -1):
        while column > 0 and best[row + 1, column] == best[row + 1, column - 1]:
            column -= 1
        if column > 0 and best[row + 1, column] > best[row, column]:
            chosen[row] = column - 1
            column -= 1
    return chosen
