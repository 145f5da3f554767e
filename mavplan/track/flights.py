"""Which part of a track is the flight: from arming to disarming, the longest where there are several. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.track.model import Span, Track

SAME_FLIGHT_S = 60.0
"""Where arming is not known, two times in the air with no more than this on the ground between them are one flight."""

AT_END_S = 5.0
"""In the air within so many seconds of the last position: the log ends in the air."""


@dataclass(frozen=True, slots=True)
class Flight:
    """One flight of a track.

    Attributes
    ----------
    span
        From arming to disarming; from leaving the ground to touching it where arming is not known.
    mission_from_s
        When its mission began: at arming, or later where the log says so.
    has_landed
        Whether the track goes on until it was down.
    notes
        What of the track was left out, and whether it ends in the air.
    """

    span: Span
    mission_from_s: float
    has_landed: bool
    notes: tuple[Problem, ...]

    @property
    def flown_s(self) -> float:
        """Seconds from the beginning of the mission to the end of the flight."""
        return self.span.until_s - self.mission_from_s


def find_flight(track: Track) -> Flight:
    """Return the flight of a track; of several the one with most time in the air, and that is said.

    Raises
    ------
    InputError
        The vehicle never left the ground.
    """
    spans = _flights(track)
    if not spans:
        why = "" if track.armed is None or track.armed else " (and was never armed)"
        message = f"the vehicle never left the ground in it{why}: there is no flight to look at"
        raise InputError([Problem(track.label, message, "no-flight"), *track.notes])
    span = max(spans, key=lambda one: _air_s(one, track.in_air))
    notes = []
    if len(spans) > 1:
        others_s = sum(_air_s(one, track.in_air) for one in spans) - _air_s(span, track.in_air)
        message = (
            f"holds {len(spans)} flights: only the longest one is used, {span.length_s:,.0f} s from "
            f"{span.from_s:,.0f} s on; {others_s:,.0f} s in the air are left out"
        )
        notes.append(Problem(track.label, message, "several-flights", "warning"))
    last_s = float(track.time_s[-1])
    has_landed = not any(
        last_s - air.until_s < AT_END_S and air.until_s >= span.from_s for air in track.in_air
    )
    if not has_landed:
        message = f"ends in the air, {last_s - span.from_s:,.0f} s after the flight began: what came then is not known"
        notes.append(Problem(track.label, message, "ends-in-air", "warning"))
    mission_from_s = span.from_s
    if track.in_mission is not None:
        begun = [one.from_s for one in track.in_mission if span.from_s <= one.from_s < span.until_s]
        under_way = any(one.from_s < span.from_s < one.until_s for one in track.in_mission)
        mission_from_s = min(begun, default=span.from_s) if not under_way else span.from_s
    return Flight(span, mission_from_s, has_landed, tuple(notes))


def _flights(track: Track) -> list[Span]:
    if track.armed is not None:
        return [span for span in track.armed if _air_s(span, track.in_air) > 0]
    flights: list[Span] = []
    for air in track.in_air:
        if flights and air.from_s - flights[-1].until_s <= SAME_FLIGHT_S:
            flights[-1] = Span(flights[-1].from_s, air.until_s)
        else:
            flights.append(air)
    return flights


def _air_s(span: Span, in_air: Sequence[Span]) -> float:
    """Return the seconds in the air within a span."""
    return float(
        np.sum([max(min(span.until_s, air.until_s) - max(span.from_s, air.from_s), 0.0) for air in in_air])
    )
