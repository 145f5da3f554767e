"""What a vehicle should hold after an upload, by the measurements alone: shares no code with mavplan's own comparison.

A mission made here is written down twice: as the `Mission` that is uploaded, and as the fields that the firmware
was measured to give back for it (docs/sitl_mock.md). Fields are compared one by one with what the mock holds.
"""

import dataclasses
import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.mission.model import NAN, Autopilot, Command, Frame, HomePosition, Mission, MissionItem
from sitl_mock.items import StoredItem

HOME = HomePosition(374_000_000, -1_221_000_000, 10.0)

Field = float | tuple[float, ...]
"""The value that a field must have, or those of which it must have one; NaN stands for NaN."""


@dataclass(frozen=True, slots=True)
class Expected:
    """The fields of one stored item."""

    frame: int
    command: int
    params: tuple[Field, Field, Field, Field]
    x: int = 0
    y: int = 0
    z: Field = 0.0
    autocontinue: Field = 1.0

    def is_held(self, stored: StoredItem, seq: int) -> bool:
        """Whether a stored item is this one."""
        place = (stored.seq, stored.frame, stored.command, stored.x, stored.y)
        pairs: list[tuple[Field, float]] = [
            *zip(self.params, stored.params, strict=True),
            (self.z, stored.z),
            (self.autocontinue, stored.autocontinue),
        ]
        return place == (seq, self.frame, self.command, self.x, self.y) and all(
            _agrees(wanted, found) for wanted, found in pairs
        )


def _agrees(wanted: Field, found: float) -> bool:
    if isinstance(wanted, tuple):
        return found in wanted
    return bool(np.isnan(found)) if np.isnan(wanted) else float(np.float32(wanted)) == found


def _centimetres(alt_m: float) -> float:
    """Return what ArduPilot gives back: whole centimetres in 32 bits, cut off."""
    cm = np.trunc(np.float32(alt_m) * np.float32(100.0))
    return float(cm * np.float32(0.01))


@dataclass(frozen=True, slots=True)
class Sample:
    """A mission and what must be stored of it, home left out; and of its fence and rally points, if it has them."""

    mission: Mission
    expected: tuple[Expected, ...]
    fence: tuple[Expected, ...] = ()
    rally: tuple[Expected, ...] = ()

    def areas_are_held(self, fence: Sequence[StoredItem], rally: Sequence[StoredItem]) -> bool:
        """Whether the vehicle holds the fence and the rally points, where the mission has them."""
        lists = ((self.fence, fence), (self.rally, rally))
        return all(
            not wanted
            or (
                len(wanted) == len(held)
                and all(w.is_held(h, n) for n, (w, h) in enumerate(zip(wanted, held, strict=True)))
            )
            for wanted, held in lists
        )

    def is_held(self, stored: Sequence[StoredItem]) -> bool:
        """Whether the vehicle holds this very mission."""
        first = 1 if self.mission.autopilot == "ardupilot" else 0
        if first:  # home: the vehicle's own
            home = (HOME.lat_e7, HOME.lon_e7, 0, 16)
            if not stored or (stored[0].x, stored[0].y, stored[0].frame, stored[0].command) != home:
                return False
        return len(stored) == len(self.expected) + first and all(
            expected.is_held(item, seq)
            for seq, (expected, item) in enumerate(zip(self.expected, stored[first:], strict=True), first)
        )


def make_sample(autopilot: Autopilot, count: int, chance: random.Random, *, too_low: bool = False) -> Sample:
    """Make a random mission of ``count`` items on the wire, home included.

    Parameters
    ----------
    autopilot
        Whose rules it keeps.
    count
        At least 2.
    chance
        Where all that is random comes from.
    too_low
        Its take-off is given above sea level, 5 m above the planned home: infeasible on PX4 where the vehicle stands
        higher than that.
    """
    is_ardupilot = autopilot == "ardupilot"
    pairs = [_take_off(is_ardupilot, too_low)]
    middle = count - 2 - int(is_ardupilot)
    while len(pairs) <= middle:
        pairs += _stop(is_ardupilot, chance)
    del pairs[max(1, middle + 1) :]
    if middle >= 0:
        back = MissionItem(Command.NAV_RETURN_TO_LAUNCH, Frame.MISSION)
        pairs.append((back, Expected(0 if is_ardupilot else 2, 20, (0, 0, 0, 0))))
    mission = Mission(tuple(item for item, _ in pairs), HOME, autopilot)
    return Sample(mission, tuple(expected for _, expected in pairs))


def with_areas(sample: Sample, chance: random.Random) -> Sample:
    """Give a sample a fence about all its stops, a circle to keep out of, and a few rally points."""
    is_ardupilot = sample.mission.autopilot == "ardupilot"
    half = 200_000 + chance.randrange(10_000)
    corners = tuple(
        (HOME.lat_e7 + north * half, HOME.lon_e7 + east * half)
        for north, east in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    )
    away, radius_m = HOME.lat_e7 + 500_000, float(chance.randint(20, 90))
    points = tuple(
        RallyPoint(HOME.lat_e7 + chance.randrange(9_000), HOME.lon_e7 + 50, float(chance.randint(20, 60)))
        for _ in range(chance.randint(1, 4))
    )
    frame = 0 if is_ardupilot else 5
    polygon = [Expected(frame, 5001, (4, 0, 0, 0), x, y, autocontinue=0) for x, y in corners]
    circle = Expected(frame, 5004, (radius_m, 0, 0, 0), away, HOME.lon_e7, autocontinue=0)
    rally = tuple(
        Expected(3 if is_ardupilot else 6, 5100, (0, 0, 0, 0), p.lat_e7, p.lon_e7, p.alt_rel_m, (0.0, 1.0))
        for p in points
    )
    fence = Fence((FencePolygon(True, corners),), (FenceCircle(False, away, HOME.lon_e7, radius_m),))
    mission = dataclasses.replace(sample.mission, fence=fence, rally=points)
    return Sample(mission, sample.expected, (*polygon, circle), rally)


def _take_off(is_ardupilot: bool, too_low: bool) -> tuple[MissionItem, Expected]:
    heading = 0.0 if is_ardupilot else NAN
    frame, alt_m = (Frame.GLOBAL, HOME.alt_amsl_m + 5.0) if too_low else (Frame.GLOBAL_RELATIVE_ALT, 30.0)
    item = MissionItem(Command.NAV_TAKEOFF, frame, (0.0, 0.0, 0.0, heading), HOME.lat_e7, HOME.lon_e7, alt_m)
    frames = {0: 0, 3: 3} if is_ardupilot else {0: 5, 3: 6}
    return item, Expected(frames[int(frame)], 22, (0, 0, 0, heading), HOME.lat_e7, HOME.lon_e7, alt_m)


def _stop(is_ardupilot: bool, chance: random.Random) -> list[tuple[MissionItem, Expected]]:
    """Make a change of speed now and then, a waypoint and a hold there."""
    heading = 0.0 if is_ardupilot else NAN
    hold_s = float(chance.randint(1, 900)) if is_ardupilot else chance.randint(1, 9000) / 10
    speed_m_s = chance.randint(10, 99) / 10
    alt_m = chance.randint(1000, 12_000) / 100
    lat_e7 = HOME.lat_e7 + chance.randint(-90_000, 90_000)
    lon_e7 = HOME.lon_e7 + chance.randint(-90_000, 90_000)
    place = (lat_e7, lon_e7, alt_m)
    relative, kept_frame = Frame.GLOBAL_RELATIVE_ALT, 3 if is_ardupilot else 6
    kept_place = (lat_e7, lon_e7, _centimetres(alt_m) if is_ardupilot else alt_m)
    loiter = (hold_s, 0, 1.0, 0) if is_ardupilot else (hold_s, 0, 0, (0.0, 1.0))
    waypoint = MissionItem(Command.NAV_WAYPOINT, relative, (0.0, 0.0, 0.0, heading), *place)
    hold = MissionItem(Command.NAV_LOITER_TIME, relative, (hold_s, 0.0, 0.0, heading), *place)
    stop = [
        (waypoint, Expected(kept_frame, 16, (0, 0, 0, heading), *kept_place)),
        (hold, Expected(kept_frame, 19, loiter, *kept_place)),
    ]
    if chance.random() < 0.2:
        speed = MissionItem(Command.DO_CHANGE_SPEED, Frame.MISSION, (1.0, speed_m_s, -1.0, 0.0))
        bare = 0 if is_ardupilot else 2
        stop.insert(0, (speed, Expected(bare, 178, (1, speed_m_s, -1, 0))))
    return stop
