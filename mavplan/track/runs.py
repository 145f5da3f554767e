"""From what a reader found to a `Track`: runs of the vehicle's clock, spans, and which run holds the flight. Pure."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.mission.model import Autopilot
from mavplan.track.model import Floats, ItemEvent, Span, Track

CLOCK_SLIP_S = 3.0
"""A clock that jumps back by more has started anew; less can be a link's reordering."""

OFF_GROUND_M = 2.0
"""Above home by more is in the air: heights on the ground wander by a metre or two."""

MAX_HEIGHT_M = 20_000.0
"""Further above or below home is no height of a multirotor."""

Change = tuple[float, bool]


@dataclass
class Run:
    """What was logged between two restarts of the vehicle, in the order of the log; times are the vehicle's, in s.

    Attributes
    ----------
    positions
        Time, latitude and longitude in degrees, metres above home.
    armed, mission
        Time and whether it is: at every word about it.
    reached, current
        Time and item.
    """

    positions: list[tuple[float, float, float, float]] = field(default_factory=list)
    armed: list[Change] = field(default_factory=list)
    mission: list[Change] = field(default_factory=list)
    reached: list[tuple[float, int]] = field(default_factory=list)
    current: list[tuple[float, int]] = field(default_factory=list)


def flight_track(
    runs: Sequence[Run],
    label: str,
    notes: Iterable[Problem] = (),
    *,
    autopilot: Autopilot | None = None,
    system: int | None = None,
) -> Track:
    """Return the track of the run with most time in the air.

    Raises
    ------
    InputError
        There is no position in it; says what else was noted.
    """
    noted = list(notes)
    tracks = [
        track
        for run in runs
        if len(track := _track(run, label, autopilot=autopilot, system=system, noted=noted))
    ]
    if not tracks:
        message = "holds no position of the vehicle (with latitude, longitude and height above home)"
        raise InputError([Problem(label, message, "no-positions"), *_as_errors(noted)])
    best = max(tracks, key=lambda track: (track.air_s, len(track)))
    if len(tracks) > 1:
        others = sum(track.air_s for track in tracks) - best.air_s
        times = f"{len(tracks) - 1} time{'s' if len(tracks) > 2 else ''}"
        message = (
            f"the vehicle's clock began anew {times}: only the run with most time in the air is used "
            f"({best.air_s:,.0f} s); {others:,.0f} s in the air are left out"
        )
        noted.append(Problem(label, message, "restarts", "warning"))
    return _with_notes(best, noted)


def _as_errors(noted: Iterable[Problem]) -> Iterator[Problem]:
    """Yield what was noted as it is told with an error: all of it belongs to why nothing can be used."""
    for problem in noted:
        yield Problem(problem.where, problem.message, problem.code)


def _with_notes(track: Track, noted: Sequence[Problem]) -> Track:
    return replace(track, notes=tuple(noted))


def _track(
    run: Run, label: str, *, autopilot: Autopilot | None, system: int | None, noted: list[Problem]
) -> Track:
    rows = np.array(run.positions, dtype=np.float64).reshape(-1, 4)
    good = _is_place(rows)
    if not good.all():
        message = f"{int((~good).sum()):,} positions are no place on Earth (or 0, 0) and are left out"
        noted.append(Problem(label, message, "bad-positions", "warning"))
    rows = rows[good]
    # Two positions of one moment: the first that came. Late ones are put where they belong.
    rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
    time_s, lat_deg, lon_deg, alt_rel_m = rows.T.copy()
    end_s = float(time_s[-1]) if len(rows) else 0.0
    begin_s = float(time_s[0]) if len(rows) else 0.0
    armed = _spans(run.armed, begin_s, end_s) if run.armed else None
    return Track(
        label=label,
        time_s=time_s,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        alt_rel_m=alt_rel_m,
        armed=armed,
        in_air=_in_air(time_s, alt_rel_m, armed),
        in_mission=_spans(run.mission, begin_s, end_s) if run.mission else None,
        reached=_changes(run.reached),
        current=_changes(run.current),
        autopilot=autopilot,
        system=system,
    )


def _is_place(rows: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    time_s, lat_deg, lon_deg, alt_m = rows.T
    with np.errstate(invalid="ignore"):
        placed = (np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180) & ((lat_deg != 0) | (lon_deg != 0))
        found: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            placed & np.isfinite(time_s) & (np.abs(alt_m) <= MAX_HEIGHT_M)
        )
    return found


def _spans(changes: Iterable[Change], begin_s: float, end_s: float) -> tuple[Span, ...]:
    """Return when something held: from the first word that it does to the next that it does not, or the end."""
    spans: list[Span] = []
    since: float | None = None
    last_s = end_s
    for time_s, holds in sorted(changes):
        last_s = max(last_s, time_s)
        if holds and since is None:
            since = max(time_s, begin_s) if math.isinf(time_s) else time_s
        elif not holds and since is not None:
            spans.append(Span(since, time_s))
            since = None
    if since is not None:
        spans.append(Span(since, last_s))
    return tuple(spans)


def _in_air(time_s: Floats, alt_rel_m: Floats, armed: Sequence[Span] | None) -> tuple[Span, ...]:
    """Return when the vehicle was off the ground: above it, and armed where that is known."""
    above = np.concatenate(([False], alt_rel_m > OFF_GROUND_M, [False]))
    edges = np.flatnonzero(above[1:] != above[:-1])
    high = [
        Span(float(time_s[first]), float(time_s[last - 1]))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    ]
    if armed is None:
        return tuple(span for span in high if span.length_s > 0)
    both = (Span(max(one.from_s, two.from_s), min(one.until_s, two.until_s)) for one in high for two in armed)
    return tuple(span for span in both if span.length_s > 0)


def _changes(events: Iterable[tuple[float, int]]) -> tuple[ItemEvent, ...]:
    """Return the events in the order of their times without repetitions of the same item."""
    kept: list[ItemEvent] = []
    for time_s, seq in sorted(events, key=lambda event: event[0]):
        if math.isfinite(time_s) and (not kept or kept[-1].seq != seq):
            kept.append(ItemEvent(time_s, seq))
    return tuple(kept)
