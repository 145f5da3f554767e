"""A vehicle's telemetry to a `Track`: whose frames count, and what their messages say about the flight. Pure.

Nothing in MISSION_ITEM_REACHED, MISSION_CURRENT and HEARTBEAT says when they were sent. Their time on the vehicle's
clock is found between the stamped messages before and after them.
"""

import struct
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from mavplan.errors import InputError, Problem
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.model import Autopilot
from mavplan.track.model import Track
from mavplan.track.runs import CLOCK_SLIP_S, Run, flight_track
from mavplan.track.tlog import Frame, TlogFrames

_HEARTBEAT, _SYSTEM_TIME, _ATTITUDE, _LOCAL_POSITION, _POSITION = 0, 2, 30, 32, 33
_MISSION_CURRENT, _REACHED = 42, 46
_STAMP_AT = {_SYSTEM_TIME: 8, _ATTITUDE: 0, _LOCAL_POSITION: 0, _POSITION: 0}
"""Byte of the payload at which milliseconds since the vehicle's start stand (common.xml)."""

_GCS = 6
"""MAV_TYPE_GCS."""
_NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID: a part of a vehicle, or a ground station."""
_ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_AUTOPILOT_COMPONENT = 1

_COPTER_AUTO = (3, 27)
"""ArduCopter's modes AUTO and AUTO_RTL."""
_PX4_MISSION = (4, 4)
"""PX4's main mode AUTO, sub mode MISSION."""


def read_tlog(data: bytes, label: str, system: int | None = None) -> Track:
    """Return the flight in a ``.tlog``.

    Parameters
    ----------
    data
        The file.
    label
        What to call it in messages.
    system
        Which vehicle, where there are several.

    Raises
    ------
    InputError
        Nothing in it can be used, or there are several vehicles and none is named.
    """
    reader = TlogFrames(data)
    frames = list(reader)
    notes = list(_damages(reader, label))
    if not frames:
        message = "holds no whole MAVLink frame: it is empty, cut at once or no tlog"
        raise InputError([Problem(label, message, "no-frames"), *notes])
    systems = _systems(frames)
    chosen, why = _choose(systems, label, system)
    vehicle = systems[chosen]
    component = vehicle.component
    own = [frame for frame in frames if frame.system == chosen and frame.component == component]
    return flight_track(
        list(_runs(own, vehicle.autopilot)),
        label,
        [*notes, *why],
        autopilot=vehicle.autopilot,
        system=chosen,
    )


def _damages(reader: TlogFrames, label: str) -> Iterator[Problem]:
    losses = reader.losses
    if losses.stretches:
        message = f"{losses.skipped_bytes:,} bytes in {losses.stretches:,} places are no good MAVLink and are left out"
        yield Problem(label, message, "damaged", "warning")
    if losses.cut_bytes:
        message = f"the last {losses.cut_bytes:,} bytes are an unfinished record: the log was cut there"
        yield Problem(label, message, "cut", "warning")


@dataclass
class _System:
    """What is known of one MAVLink system in a log."""

    positions: Counter[int] = field(default_factory=Counter)
    """Positions by component."""
    autopilots: set[int] = field(default_factory=set)
    is_station: bool = False
    was_armed: bool = False

    @property
    def component(self) -> int:
        """Whose positions count: the autopilot's, else those of whoever sends most."""
        if _AUTOPILOT_COMPONENT in self.positions:
            return _AUTOPILOT_COMPONENT
        return max(self.positions, key=lambda component: self.positions[component])

    @property
    def is_vehicle(self) -> bool:
        """Whether it tells where it is and is no ground station."""
        return bool(self.positions) and not (self.is_station and not self.autopilots)

    @property
    def autopilot(self) -> Autopilot | None:
        """Which of the two it is, None if neither."""
        known = {rules.mav_autopilot: name for name, rules in AUTOPILOTS.items()}
        return next((known[number] for number in sorted(self.autopilots) if number in known), None)


def _systems(frames: Iterable[Frame]) -> dict[int, _System]:
    """Return the MAVLink systems of a log by their number."""
    systems: dict[int, _System] = {}
    for frame in frames:
        found = systems.setdefault(frame.system, _System())
        if frame.message_id == _POSITION:
            found.positions[frame.component] += 1
        elif frame.message_id == _HEARTBEAT:
            _, kind, autopilot, mode = _heartbeat(frame)
            found.is_station |= kind == _GCS
            if kind != _GCS and autopilot != _NO_AUTOPILOT:
                found.autopilots.add(autopilot)
                found.was_armed |= bool(mode & _ARMED)
    return systems


def _choose(systems: dict[int, _System], label: str, wanted: int | None) -> tuple[int, Sequence[Problem]]:
    """Return the vehicle to use, and what to tell about the others."""
    vehicles = sorted(number for number, found in systems.items() if found.is_vehicle)
    listed = ", ".join(map(str, vehicles))
    if wanted is not None:
        if wanted in vehicles:
            return wanted, ()
        there = f"those with positions: {listed}" if vehicles else "no system in it tells positions"
        message = f"holds no positions of system {wanted}; {there}"
        raise InputError([Problem(label, message, "no-system")])
    if not vehicles:
        message = "no vehicle in it tells its position (GLOBAL_POSITION_INT)"
        raise InputError([Problem(label, message, "no-positions")])
    if len(vehicles) == 1:
        return vehicles[0], ()
    armed = [number for number in vehicles if systems[number].was_armed]
    if len(armed) == 1:
        message = f"holds systems {listed}; only system {armed[0]} was armed, and it is the one that is used"
        return armed[0], [Problem(label, message, "several-vehicles", "warning")]
    message = f"holds several vehicles, systems {listed}: say with --system which one to use"
    raise InputError([Problem(label, message, "several-vehicles")])


def _heartbeat(frame: Frame) -> tuple[int, int, int, int]:
    """Return custom mode, type, autopilot and base mode."""
    custom, kind, autopilot, mode = struct.unpack_from("<IBBB", frame.payload.ljust(7, b"\0"))
    return custom, kind, autopilot, mode


def _stamp_s(frame: Frame) -> float | None:
    """Return when a frame was sent by the vehicle's clock, None where it does not say."""
    at = _STAMP_AT.get(frame.message_id)
    if at is None:
        return None
    (milliseconds,) = struct.unpack_from("<I", frame.payload.ljust(at + 4, b"\0"), at)
    return float(milliseconds) / 1e3


@dataclass
class _Stamps:
    """The stamped frames of one run: their place in the log, when they came, when they were sent."""

    places: list[int] = field(default_factory=list)
    came_s: list[float] = field(default_factory=list)
    sent_s: list[float] = field(default_factory=list)


def _runs(frames: Sequence[Frame], autopilot: Autopilot | None) -> Iterator[Run]:
    """Yield one vehicle's runs between its restarts."""
    start, newest = 0, None
    for place, frame in enumerate(frames):
        sent_s = _stamp_s(frame)
        if sent_s is None:
            continue
        if newest is not None and sent_s < newest - CLOCK_SLIP_S:
            yield _run(frames[start:place], autopilot)
            start, newest = place, sent_s
        newest = sent_s if newest is None else max(newest, sent_s)
    yield _run(frames[start:], autopilot)


def _run(frames: Sequence[Frame], autopilot: Autopilot | None) -> Run:
    run, stamps = Run(), _Stamps()
    for place, frame in enumerate(frames):
        sent_s = _stamp_s(frame)
        if sent_s is not None:
            stamps.places.append(place)
            stamps.came_s.append(frame.time_us / 1e6)
            stamps.sent_s.append(sent_s)
        if frame.message_id == _POSITION and sent_s is not None:
            lat_e7, lon_e7, _, above_mm = struct.unpack_from("<iiii", frame.payload.ljust(20, b"\0"), 4)
            run.positions.append((sent_s, lat_e7 / 1e7, lon_e7 / 1e7, above_mm / 1e3))
    if not stamps.places:
        return run
    after = 0
    for place, frame in enumerate(frames):
        while after < len(stamps.places) and stamps.places[after] <= place:
            after += 1
        if frame.message_id in (_HEARTBEAT, _MISSION_CURRENT, _REACHED):
            _note(run, frame, _sent_s(frame.time_us / 1e6, stamps, after), autopilot)
    return run


def _sent_s(came_s: float, stamps: _Stamps, after: int) -> float:
    """Return the vehicle's time of a frame that came before the stamped one number ``after``.

    Between the stamped ones round it, in proportion to when it came where the log's clock makes sense, so that a
    simulation at any speed comes out right; behind the last one by the log's clock.
    """
    if after == 0:
        return stamps.sent_s[0]
    before_came, before_sent = stamps.came_s[after - 1], stamps.sent_s[after - 1]
    if after == len(stamps.places):
        return before_sent + min(max(came_s - before_came, 0.0), 60.0)
    gap_came, gap_sent = stamps.came_s[after] - before_came, stamps.sent_s[after] - before_sent
    if gap_came <= 0 or not 0 <= came_s - before_came <= gap_came:
        return before_sent
    return before_sent + gap_sent * (came_s - before_came) / gap_came


def _note(run: Run, frame: Frame, time_s: float, autopilot: Autopilot | None) -> None:
    """Note what an unstamped message says."""
    if frame.message_id == _HEARTBEAT:
        custom, kind, _, mode = _heartbeat(frame)
        if kind != _GCS:
            run.armed.append((time_s, bool(mode & _ARMED)))
            if autopilot is not None:
                run.mission.append((time_s, _is_mission(custom, autopilot)))
        return
    (seq,) = struct.unpack_from("<H", frame.payload.ljust(2, b"\0"))
    (run.reached if frame.message_id == _REACHED else run.current).append((time_s, seq))


def _is_mission(custom_mode: int, autopilot: Autopilot) -> bool:
    """Return whether a HEARTBEAT's custom mode is the one that flies the mission."""
    if autopilot == "ardupilot":
        return custom_mode in _COPTER_AUTO
    return (custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF) == _PX4_MISSION
