"""Whether a vehicle enforces a fence, and whether a mission would breach what it enforces: from its parameters. Pure.

A stored fence does nothing by itself on ArduPilot: FENCE_ENABLE is 0 by default. Once enabled, FENCE_TYPE (7 by
default) also enforces a greatest height and a radius about home, whatever areas there are. PX4 enforces areas unless
GF_ACTION forbids it, and a height and a radius where they are above 0; it also holds a mission against all of them
after the upload. Parameters: https://ardupilot.org/copter/docs/parameters.html#fence-parameters and
https://docs.px4.io/main/en/advanced_config/parameter_reference.html#geofence
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from mavplan.errors import Problem
from mavplan.geo import geodesic_distance_m
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.fence_check import DEFAULT_MARGIN_M, Waypoint, flown_legs, mission_breaches
from mavplan.mission.fence_geometry import SPHERE_SHARE
from mavplan.mission.geofence import Fence, rally_label
from mavplan.mission.model import Autopilot, HomePosition, Mission

VERTICAL_MARGIN_M = 2.0
"""Altitudes were measured up to 1.8 m off."""

NEEDED_PARAMETERS: dict[Autopilot, tuple[str, ...]] = {
    "ardupilot": ("FENCE_ENABLE", "FENCE_TYPE", "FENCE_ACTION", "FENCE_ALT_MAX", "FENCE_RADIUS"),
    "px4": ("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"),
}
"""Without one of these nothing can be told."""

OTHER_PARAMETERS: dict[Autopilot, tuple[str, ...]] = {
    "ardupilot": ("FENCE_AUTOENABLE", "FENCE_ALT_MIN", "FENCE_OPTIONS"),
    "px4": ("RTL_RETURN_ALT",),
}
"""Used where the vehicle has them; not every version does."""

TYPE_ALT_MAX, TYPE_CIRCLE, TYPE_AREAS, TYPE_ALT_MIN = 1, 2, 4, 8
OPTION_UNION = 2

ARDUPILOT_ACTIONS = {
    0: "only reports it",
    1: "returns or lands",
    2: "lands",
    3: "returns the way it came, or lands",
    4: "brakes or lands",
    5: "returns the way it came, or lands",
}
PX4_ACTIONS = {
    0: "does nothing",
    1: "only warns",
    2: "holds where it is",
    3: "returns",
    4: "ends the flight, motors off",
    5: "lands",
}
"""What follows a breach."""

Limit = Literal["areas", "height", "floor", "radius"]


@dataclass(frozen=True, slots=True)
class FenceForce:
    """What a vehicle enforces in this mission's flight.

    Attributes
    ----------
    enforced
        The limits that are in force; empty: none; None: the vehicle did not tell.
    breached
        Those of them that the mission would breach, or come too near to.
    words
        What is in force, in a sentence.
    problems
        Warnings for the people who fly it: a fence that does nothing, a mission that would breach one. Codes
        ``fence-unknown``, ``fence-not-in-force``, ``fence-report-only``, ``fence-breach``, ``fence-would-breach``
        (only if it were enabled), ``fence-union``.
    """

    enforced: tuple[Limit, ...] | None
    breached: tuple[Limit, ...]
    words: str
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class _Settings:
    """What the parameters say, in one form for both autopilots; infinite: no such limit."""

    switched_on: bool
    switch_words: str
    action_words: str
    acts: bool
    areas: bool
    areas_words: str
    union: bool
    height_m: float
    height_name: str
    floor_m: float
    radius_m: float
    radius_name: str
    return_m: float


def fence_force(
    mission: Mission,
    rules: AutopilotRules,
    parameters: Mapping[str, float],
    *,
    fence: Fence | None = None,
    home: HomePosition | None = None,
    names: Mapping[int, str] | None = None,
) -> FenceForce:
    """Judge what a vehicle's parameters make of a fence in this mission's flight.

    Parameters
    ----------
    mission
        What will be flown.
    rules
        The vehicle's firmware.
    parameters
        `NEEDED_PARAMETERS` and, as far as there are any, `OTHER_PARAMETERS`, as the vehicle gave them.
    fence
        The areas that the vehicle holds or will hold; None: the mission's own.
    home
        The vehicle's home, from which it measures; None: the mission's.
    names
        What to call the places of items, by index.
    """
    parameters = {name: value for name, value in parameters.items() if math.isfinite(value)}
    missing = [name for name in NEEDED_PARAMETERS[rules.name] if name not in parameters]
    if missing:
        found = f"the vehicle did not tell {', '.join(missing)}: whether a fence is in force is not known"
        problem = Problem("fence", found, "fence-unknown", "warning")
        return FenceForce(None, (), found, (problem,))
    fence = fence if fence is not None else mission.fence
    settings = _SETTINGS[rules.name](parameters)
    judge = _Judge(mission, settings, fence, home or mission.home, names)
    limits = judge.limits()
    problems = list(judge.idle(limits))
    if settings.switched_on and settings.acts:
        breaches = list(judge.breaches(limits, "fence-breach", f"the vehicle then {settings.action_words}"))
        breached = tuple(dict.fromkeys(limit for limit, _ in breaches))
        words = f"in force: {judge.limit_words(limits)}; at a breach the vehicle {settings.action_words}"
        found_words = words if limits else "no fence is in force: there is no limit to enforce"
        return FenceForce(limits, breached, found_words, (*problems, *(problem for _, problem in breaches)))
    if fence:
        breaches = list(
            judge.breaches(limits, "fence-would-breach", "a fence in force would stop the mission there")
        )
        problems += [problem for _, problem in breaches]
    return FenceForce((), (), f"no fence is in force: {settings.switch_words}", tuple(problems))


def _ardupilot(parameters: Mapping[str, float]) -> _Settings:
    enable, auto = parameters["FENCE_ENABLE"], parameters.get("FENCE_AUTOENABLE", 0)
    action, kinds = int(parameters["FENCE_ACTION"]), int(parameters["FENCE_TYPE"])
    on = enable != 0 or auto != 0
    return _Settings(
        switched_on=on,
        switch_words=f"FENCE_ACTION is {action}" if on else "FENCE_ENABLE is 0",
        action_words=ARDUPILOT_ACTIONS.get(action, f"does what FENCE_ACTION {action} says"),
        acts=action != 0,
        areas=bool(kinds & TYPE_AREAS),
        areas_words=f"FENCE_TYPE is {kinds}, without {TYPE_AREAS} (areas) in it",
        union=bool(int(parameters.get("FENCE_OPTIONS", 0)) & OPTION_UNION),
        height_m=parameters["FENCE_ALT_MAX"] if kinds & TYPE_ALT_MAX else math.inf,
        height_name="FENCE_ALT_MAX",
        floor_m=parameters.get("FENCE_ALT_MIN", -math.inf) if kinds & TYPE_ALT_MIN else -math.inf,
        radius_m=parameters["FENCE_RADIUS"] if kinds & TYPE_CIRCLE else math.inf,
        radius_name="FENCE_RADIUS",
        return_m=-math.inf,  # it lowers its return to fit below the fence
    )


def _px4(parameters: Mapping[str, float]) -> _Settings:
    action = int(parameters["GF_ACTION"])
    return _Settings(
        switched_on=action != 0,
        switch_words=f"GF_ACTION is {action}",
        action_words=PX4_ACTIONS.get(action, f"does what GF_ACTION {action} says"),
        acts=action > 1,
        areas=True,
        areas_words="",
        union=False,
        height_m=parameters["GF_MAX_VER_DIST"] or math.inf,
        height_name="GF_MAX_VER_DIST",
        floor_m=-math.inf,
        radius_m=parameters["GF_MAX_HOR_DIST"] or math.inf,
        radius_name="GF_MAX_HOR_DIST",
        return_m=parameters.get("RTL_RETURN_ALT", -math.inf),
    )


_SETTINGS: dict[Autopilot, Callable[[Mapping[str, float]], _Settings]] = {
    "ardupilot": _ardupilot,
    "px4": _px4,
}


class _Judge:
    """One mission before one vehicle's settings."""

    def __init__(
        self,
        mission: Mission,
        settings: _Settings,
        fence: Fence | None,
        home: HomePosition,
        names: Mapping[int, str] | None,
    ) -> None:
        self.mission, self.settings, self.fence, self.home, self.names = mission, settings, fence, home, names
        legs = flown_legs(mission, names)
        self.flown = list(dict.fromkeys(leg.end for leg in legs if not leg.returning))
        self.returns = any(leg.returning for leg in legs)
        self.rally = [
            Waypoint(rally_label(number, point), point.lat_e7, point.lon_e7, point.alt_rel_m)
            for number, point in enumerate(mission.rally, start=1)
        ]

    def limits(self) -> tuple[Limit, ...]:
        """Return what there is to enforce."""
        there: dict[Limit, bool] = {
            "areas": bool(self.fence) and self.settings.areas,
            "height": math.isfinite(self.settings.height_m),
            "floor": math.isfinite(self.settings.floor_m),
            "radius": math.isfinite(self.settings.radius_m),
        }
        return tuple(limit for limit, is_there in there.items() if is_there)

    def limit_words(self, limits: tuple[Limit, ...]) -> str:
        """Return the limits as people say them."""
        settings = self.settings
        words: dict[Limit, str] = {
            "areas": "the fence's areas",
            "height": f"height below {settings.height_m:g} m ({settings.height_name})",
            "floor": f"height above {settings.floor_m:g} m (FENCE_ALT_MIN)",
            "radius": f"within {settings.radius_m:g} m of home ({settings.radius_name})",
        }
        return ", ".join(words[limit] for limit in limits)

    def idle(self, limits: tuple[Limit, ...]) -> Iterator[Problem]:
        """Yield why areas that are there are not enforced."""
        settings = self.settings
        if not self.fence:
            return
        if not settings.switched_on:
            found = f"{settings.switch_words}: the vehicle stores the fence and does nothing with it"
            yield Problem("fence", found, "fence-not-in-force", "warning")
        elif not settings.acts:
            found = f"{settings.switch_words}: at a breach the vehicle {settings.action_words}"
            yield Problem("fence", found, "fence-report-only", "warning")
        if "areas" not in limits:
            found = f"{settings.areas_words}: its areas are stored and not enforced"
            yield Problem("fence", found, "fence-not-in-force", "warning")
        elif settings.union and sum(area.inclusion for _, area in self.fence.labelled()) > 1:
            found = "FENCE_OPTIONS lets it be in any one inclusion area; the mission is checked against all of them"
            yield Problem("fence", found, "fence-union", "warning")

    def breaches(self, limits: tuple[Limit, ...], code: str, then: str) -> Iterator[tuple[Limit, Problem]]:
        """Yield each limit that the mission would breach or come too near to, with a warning."""
        for limit in limits:
            for where, found in _FINDERS[limit](self):
                yield limit, Problem(where, f"{found}; {then}", code, "warning")

    def areas(self) -> Iterator[tuple[str, str]]:
        """Yield where it would leave the fence's areas."""
        for problem in mission_breaches(self.mission, fence=self.fence, names=self.names):
            yield problem.where, problem.message

    def height(self) -> Iterator[tuple[str, str]]:
        """Yield the highest place, if it is too high."""
        limit_m, name = self.settings.height_m, self.settings.height_name
        places = [*self.flown, *self.rally]
        if self.returns and math.isfinite(self.settings.return_m):
            places.append(Waypoint("return (RTL_RETURN_ALT)", 0, 0, self.settings.return_m))
        known = [place for place in places if math.isfinite(place.alt_rel_m)]
        highest = max(known, key=lambda place: place.alt_rel_m, default=None)
        if highest is not None and highest.alt_rel_m > limit_m - VERTICAL_MARGIN_M:
            found = f"flies at {highest.alt_rel_m:g} m, {name} is {limit_m:g} m"
            yield highest.name, _near(found, limit_m - highest.alt_rel_m)

    def floor(self) -> Iterator[tuple[str, str]]:
        """Yield the lowest place that is flown to in the air, if it is too low."""
        known = [place for place in self.flown if place.alt_rel_m > 0]
        lowest = min(known, key=lambda place: place.alt_rel_m, default=None)
        if lowest is not None and lowest.alt_rel_m < self.settings.floor_m + VERTICAL_MARGIN_M:
            found = f"flies at {lowest.alt_rel_m:g} m, FENCE_ALT_MIN is {self.settings.floor_m:g} m"
            yield lowest.name, _near(found, lowest.alt_rel_m - self.settings.floor_m)

    def radius(self) -> Iterator[tuple[str, str]]:
        """Yield the place furthest from home, if it is too far, and how many are."""
        limit_m, name = self.settings.radius_m, self.settings.radius_name
        at = (self.home.lat_e7 / 1e7, self.home.lon_e7 / 1e7)
        away_m = {
            place: float(geodesic_distance_m(*at, place.lat_e7 / 1e7, place.lon_e7 / 1e7))
            for place in (*self.flown, *self.rally)
        }
        kept_m = limit_m * (1 - SPHERE_SHARE) - DEFAULT_MARGIN_M
        beyond = [place for place, far_m in away_m.items() if far_m > kept_m]
        if beyond:
            furthest = max(beyond, key=away_m.__getitem__)
            others = f" (and {len(beyond) - 1} more)" if len(beyond) > 1 else ""
            found = f"lies {away_m[furthest]:,.0f} m from home{others}, {name} is {limit_m:g} m"
            yield furthest.name, _near(found, limit_m - away_m[furthest])


def _near(found: str, left_m: float) -> str:
    return found if left_m <= 0 else f"{found}, which is too near"


_FINDERS: dict[Limit, Callable[[_Judge], Iterator[tuple[str, str]]]] = {
    "areas": _Judge.areas,
    "height": _Judge.height,
    "floor": _Judge.floor,
    "radius": _Judge.radius,
}
