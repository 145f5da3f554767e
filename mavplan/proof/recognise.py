"""Whether a flight is one of this plan at all: by the items it told of, and by where it hovered. Pure."""

from collections.abc import Iterator, Sequence

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.proof.holds import NEAR_M, Hover
from mavplan.proof.model import FlownStop
from mavplan.stored_plan import StoredPlan
from mavplan.track.model import Floats, ItemEvent, Track

LONG_S = 3.0
"""A hover at least so long, away from home and from every stop, is a stop of another mission."""

ODD_M = 30.0
"""A stop at whose hold the vehicle was further from its place is odd: wind, or another plan."""

FOREIGN_M = 100.0
"""Two stops or more, and most, held further from their places than this are another mission's: gusts hit few."""

FOREIGN = 3
"""As many long hovers at other places, and twice as many as at the plan's, are those of another mission."""

MOST_NAMED = 8
"""Stops that one sentence names."""


def recognise(
    plan: StoredPlan,
    track: Track,
    stops: Sequence[FlownStop],
    hovers: Sequence[Hover],
    places_m: Floats,
    words: Sequence[ItemEvent],
    radius_m: float,
    path_m: Floats,
) -> tuple[Problem, ...]:
    """Return what is odd about a flight as one of this plan.

    Parameters
    ----------
    stops
        The M stops as flown.
    hovers
        Where the vehicle hovered.
    places_m
        (M, 2) the planned places.
    words
        What it said about items, counted from 0 without home.
    radius_m
        Coverage radius.
    path_m
        (P, 2) where it flew, home being the origin.

    Raises
    ------
    InputError
        It is one of another plan.
    """
    other = next(_other_plan(plan, stops, hovers, places_m, words, radius_m, path_m), None)
    if other is not None:
        message = f"is not a flight of {plan.label}: {other}"
        raise InputError([Problem(track.label, message, "other-plan"), *track.notes])
    return tuple(_odd(plan, track, stops))


def _other_plan(
    plan: StoredPlan,
    stops: Sequence[FlownStop],
    hovers: Sequence[Hover],
    places_m: Floats,
    words: Sequence[ItemEvent],
    radius_m: float,
    path_m: Floats,
) -> Iterator[str]:
    """Yield why this is another plan's flight."""
    furthest = max((word.seq for word in words), default=0)
    if plan.items and furthest >= plan.items:
        yield f"it reached item {furthest}, the plan's last is item {plan.items - 1} (from 0 without home)"
    held = [stop for stop in stops if stop.span is not None]
    if held and all(stop.away_m > radius_m for stop in held):
        nearest_m = min(stop.away_m for stop in held)
        yield (
            f"of {len(held)} stops that it held none is within {radius_m:,.0f} m of the planned place "
            f"(the nearest is {nearest_m:,.0f} m away)"
        )
    else:
        # One place may be both plans' (the first stop beside home): most of them are not.
        far = sum(stop.away_m > FOREIGN_M for stop in held)
        if far > 1 and 2 * far > len(held):
            yield f"{far} of {len(held)} stops that it held were more than {FOREIGN_M:g} m from the planned places"
    at_m = np.array([(hover.x_m, hover.y_m) for hover in hovers]).reshape(-1, 2)
    to_stops_m = np.hypot(*(places_m[:, None, :] - at_m[None, :, :]).transpose(2, 0, 1))
    away = [
        hover
        for number, hover in enumerate(hovers)
        if hover.span.length_s >= LONG_S
        and to_stops_m[:, number].min() > NEAR_M
        and np.hypot(hover.x_m, hover.y_m) > NEAR_M
    ]
    if not held:
        if away:
            yield f"it hovered {len(away)} times, never within {NEAR_M:g} m of a planned stop"
        elif _flew_elsewhere(path_m, places_m, radius_m):
            yield f"it flew beyond the first stop and never within {NEAR_M:g} m of any"
    elif not words:
        if len(away) >= max(FOREIGN, 2 * len(held) + 1):
            yield f"it hovered {len(away)} times elsewhere and at {len(held)} of the planned stops"
        # Stops that were hovered at, but not in the plan's order.
        passed = int((to_stops_m.min(axis=1, initial=np.inf) <= NEAR_M).sum())
        if 2 * len(held) <= passed and passed > 2:
            yield f"it hovered at {passed} of the planned stops, in another order"


def _flew_elsewhere(path_m: Floats, places_m: Floats, radius_m: float) -> bool:
    """Whether it flew farther than to the plan's first stop without coming near any: one broken off did not."""
    if not len(places_m) or not len(path_m):
        return False
    nearest_m = min(float(np.hypot(*(path_m - place_m).T).min()) for place_m in places_m)
    return nearest_m > NEAR_M and float(np.hypot(*path_m.T).max()) > np.hypot(*places_m[0]) + radius_m


def _odd(plan: StoredPlan, track: Track, stops: Sequence[FlownStop]) -> Iterator[Problem]:
    if track.autopilot not in (None, plan.autopilot):
        message = (
            f"{AUTOPILOTS[track.autopilot].title} flew it, the plan is for {AUTOPILOTS[plan.autopilot].title}: "
            "what the vehicle said about its items is not used"
        )
        yield Problem(track.label, message, "other-autopilot", "warning")
    if track.autopilot is None and track.reached:
        message = "does not say which autopilot flew it: items are counted as the plan's would"
        yield Problem(track.label, message, "unknown-autopilot", "warning")
    odd = [number for number, stop in enumerate(stops, start=1) if stop.span and stop.most_away_m > ODD_M]
    if odd:
        most_m = max(stops[number - 1].most_away_m for number in odd)
        message = f"{_stops(odd)} held up to {most_m:,.0f} m from the planned place: wind, or another plan's flight?"
        yield Problem(track.label, message, "far-from-place", "warning")


def _stops(numbers: Sequence[int]) -> str:
    """Return ``stop 3 was``, ``stops 3, 5 were``, long lists cut."""
    named = ", ".join(map(str, numbers[:MOST_NAMED]))
    more = f" and {len(numbers) - MOST_NAMED} more" if len(numbers) > MOST_NAMED else ""
    return f"stops {named}{more} were" if len(numbers) > 1 else f"stop {named} was"
