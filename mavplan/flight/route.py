"""What a mission looks like to somebody who watches it being flown: its stops, its end, its seconds. Pure.

Item numbers are those on the wire: on ArduPilot the mission begins at 1, for home is item 0 there.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from mavplan.flight.manners import FLIGHT_MANNERS
from mavplan.link.home import distance_m
from mavplan.mission.autopilots import AutopilotRules
from mavplan.mission.build import End
from mavplan.mission.model import Command, HomePosition, Mission, MissionItem
from mavplan.mission.sendable import HOLD_COMMANDS

SAME_PLACE_M = 1.0


@dataclass(frozen=True, slots=True)
class Stop:
    """A place where the vehicle holds.

    Attributes
    ----------
    number
        From 1, in flying order.
    first_seq, hold_seq
        The item that flies there and the one that holds; the same where a stop is a single item.
    hold_s
        Seconds.
    lat_e7, lon_e7
        The place.
    users
        Names of those who are served there, where a plan says so.
    """

    number: int
    first_seq: int
    hold_seq: int
    hold_s: float
    lat_e7: int
    lon_e7: int
    users: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Route:
    """A mission as it is watched.

    Attributes
    ----------
    first_seq, last_seq
        Its items on the wire.
    end, end_seq
        How it ends, and the item that does it; one beyond the last where no item does.
    stops
        In flying order.
    hold_s, expected_s
        Seconds of each item by its number: of its hold, and in all.
    end_place
        Where it comes down, or stays.
    jumps
        It has a DO_JUMP: items may come again.
    comes_home
        It ends on the ground at home: by a return, or by a landing there.
    """

    first_seq: int
    last_seq: int
    end: End
    end_seq: int
    stops: tuple[Stop, ...]
    hold_s: Mapping[int, float]
    expected_s: Mapping[int, float]
    end_place: HomePosition
    jumps: bool
    comes_home: bool

    @property
    def count(self) -> int:
        """Number of items."""
        return self.last_seq - self.first_seq + 1

    @property
    def mission_s(self) -> float:
        """Seconds in all."""
        return math.fsum(self.expected_s.values())

    def stop_at(self, seq: int | None) -> Stop | None:
        """Return the stop that an item belongs to."""
        if seq is None:
            return None
        return next((stop for stop in self.stops if stop.first_seq <= seq <= stop.hold_seq), None)


def make_route(
    mission: Mission,
    rules: AutopilotRules,
    users: Sequence[Sequence[str]] = (),
    expected_s: Mapping[int, float] | None = None,
) -> Route:
    """Return what there is to watch of a mission.

    Parameters
    ----------
    mission, rules
        What is flown, and by which firmware.
    users
        Names of the users at each stop in flying order; unused where their number is not that of the stops.
    expected_s
        Seconds of each item on the wire, where a plan knows more of the vehicle; else they are forecast here.
    """
    first = FLIGHT_MANNERS[rules.name].first_seq
    stops = _stops(mission.items, first)
    if len(users) == len(stops):
        stops = [
            Stop(s.number, s.first_seq, s.hold_seq, s.hold_s, s.lat_e7, s.lon_e7, tuple(names))
            for s, names in zip(stops, users, strict=True)
        ]
    end, end_index, place = _end(mission)
    holds = {first + index: _hold_s(item) for index, item in enumerate(mission.items)}
    return Route(
        first_seq=first,
        last_seq=first + len(mission.items) - 1,
        end=end,
        end_seq=first + end_index,
        stops=tuple(stops),
        hold_s=holds,
        expected_s=expected_s if expected_s is not None else _expected_s(mission, rules, first),
        end_place=place,
        jumps=any(item.command == Command.DO_JUMP for item in mission.items),
        comes_home=end == "rtl" or (end == "land" and distance_m(place, mission.home) < SAME_PLACE_M),
    )


def _hold_s(item: MissionItem) -> float:
    """Return how long the vehicle stays at an item, NaN meaning not at all."""
    seconds = item.params[0] if item.command in HOLD_COMMANDS or item.command == Command.NAV_DELAY else 0.0
    return seconds if seconds > 0 else 0.0


def _stops(items: Sequence[MissionItem], first: int) -> list[Stop]:
    stops: list[Stop] = []
    for index, item in enumerate(items):
        if item.command not in HOLD_COMMANDS or not _hold_s(item):
            continue
        before = items[index - 1] if index else None
        arrives = before is not None and before.command == Command.NAV_WAYPOINT and not _hold_s(before)
        goes_there = index - 1 if before is not None and arrives and _same_place(before, item) else index
        stops.append(
            Stop(
                number=len(stops) + 1,
                first_seq=first + goes_there,
                hold_seq=first + index,
                hold_s=_hold_s(item),
                lat_e7=item.lat_e7,
                lon_e7=item.lon_e7,
            )
        )
    return stops


def _same_place(one: MissionItem, other: MissionItem) -> bool:
    return distance_m(_place(one), _place(other)) < SAME_PLACE_M


def _place(item: MissionItem) -> HomePosition:
    return HomePosition(item.lat_e7, item.lon_e7, 0.0)


def _end(mission: Mission) -> tuple[End, int, HomePosition]:
    """Return how a mission ends, the index of the item that does it, and where."""
    place = mission.home
    for index, item in enumerate(mission.items):
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            return "rtl", index, mission.home
        if item.has_position and item.command != Command.NAV_TAKEOFF:
            place = _place(item)
        if item.command == Command.NAV_LAND:
            return "land", index, place
        if item.command == Command.NAV_LOITER_UNLIM:
            return "stay", index, place
    return "stay", len(mission.items), place


def _expected_s(mission: Mission, rules: AutopilotRules, first: int) -> dict[int, float]:
    """Return a forecast of each item's seconds; of a mission that jumps, as if every item came once."""
    from mavplan.mission.forecast import forecast_mission

    numbers = [index for index, item in enumerate(mission.items) if item.command != Command.DO_JUMP]
    without_jumps = replace(mission, items=tuple(mission.items[index] for index in numbers))
    found = forecast_mission(without_jumps, rules=rules)
    seconds = {first + numbers[item.item]: item.seconds.total for item in found.items}
    return {first + index: seconds.get(first + index, 0.0) for index in range(len(mission.items))}
