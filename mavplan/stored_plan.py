"""A plan read back: ``X.mavplan.json`` as typed objects, for a flight, a proof or a new plan for the rest.

The counterpart of `mavplan.plan_file`, which writes it. Keys that are not known here are left alone.
"""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked_dataclass

from mavplan.errors import InputError, Problem
from mavplan.formats.beside import SUFFIX, plan_path
from mavplan.hover import Slot
from mavplan.mission.build import StopItems
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.mission.model import Autopilot
from mavplan.plan_file import VERSION
from mavplan.scenario.files import read_text
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints, Scenario, Users
from mavplan.scenario.reference import SECTIONS
from mavplan.scenario.report import Report, shown
from mavplan.scenario.sections import (
    D2D,
    DemandMbit,
    FenceOptions,
    Home,
    LatDeg,
    LonDeg,
    PlannerOptions,
    Radio,
    Service,
    Vehicle,
)

MAX_BYTES = 256 * 1024 * 1024
"""A plan larger than this is not read: a million users' is smaller."""

_BIT_PER_MBIT = 1e6


@dataclass(frozen=True, slots=True)
class PlannedStop:
    """One stop of a plan.

    Attributes
    ----------
    lat_deg, lon_deg, alt_rel_m
        As the mission has it: degrees, metres above home.
    hold_s
        As stored on the autopilot.
    items
        Where it stands among the mission's items, from 0 without home.
    """

    lat_deg: float
    lon_deg: float
    alt_rel_m: float
    hold_s: float
    items: StopItems


@dataclass(frozen=True, eq=False)
class StoredPlan:
    """A plan as its file holds it. N users, M stops in flying order.

    Attributes
    ----------
    label
        What to call the file in messages.
    autopilot, planner
        What it was made for, and with.
    scenario
        What it was made from; its pairs are those within the D2D range.
    stops
        M stops.
    stop_of
        (N,) the stop that serves each user best; for a D2D user its mate's.
    d2d
        (N,) whether the user is served through its mate.
    schedule
        TDMA: who is served when; empty for broadcast.
    in_flight
        Whether its holds count on what users receive in flight.
    flight_s, hover_s, mission_s
        Forecast.
    vehicle
        Which vehicle was last seen to hold it (`mavplan.formats.beside.remember_vehicle`); empty if none.
    """

    label: str
    autopilot: Autopilot
    planner: str
    scenario: Scenario
    stops: tuple[PlannedStop, ...]
    stop_of: Ints
    d2d: Bools
    schedule: tuple[Slot, ...]
    in_flight: bool
    flight_s: float
    hover_s: float
    mission_s: float
    vehicle: Mapping[str, Any] = field(default_factory=dict)

    @property
    def hold_s(self) -> Floats:
        """(M,) stored holds."""
        return np.array([stop.hold_s for stop in self.stops], dtype=np.float64)


def read_plan(path: Path) -> StoredPlan:
    """Read a plan; a mission file's name stands for the plan beside it.

    Raises
    ------
    InputError
        With everything that is wrong with it.
    """
    path = path if path.name.endswith(".json") else plan_path(path)
    report = Report()
    text = read_text(path, str(path), MAX_BYTES, report)
    report.raise_errors()
    return parse_plan(text or "", str(path))


def parse_plan(text: str, label: str) -> StoredPlan:
    """Return the plan in the text of an ``X.mavplan.json``.

    Raises
    ------
    InputError
        With everything that is wrong with it.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        message = f"is not JSON that can be read: {error}"
        raise InputError([Problem(label, message, "syntax")]) from error
    if not isinstance(data, dict) or data.get("format") != "mavplan":
        message = f"is no plan of mavplan; it is written beside each mission file, its name ends in {SUFFIX}"
        raise InputError([Problem(label, message, "not-a-plan")])
    if data.get("version") != VERSION:
        message = f"has version {shown(data.get('version'))} of the format; {VERSION} can be read: plan again"
        raise InputError([Problem(label, message, "version")])
    try:
        file = _FILE.validate_json(json.dumps(_known_keys(data)), strict=True)
    except ValidationError as error:
        raise InputError(_problems(error, label)) from error
    problems = tuple(_contradictions(file, label))
    if problems:
        raise InputError(problems)
    found = data.get("vehicle")
    return _plan(file, label, found if isinstance(found, dict) else {})


_CHECKED = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)
_Seconds = Annotated[float, Field(ge=0, le=1e9)]
_Index = Annotated[int, Field(ge=0, le=1_000_000)]


@checked_dataclass(frozen=True, config=_CHECKED)
class _Stop:
    lat_deg: LatDeg
    lon_deg: LonDeg
    alt_rel_m: Annotated[float, Field(gt=0, le=10_000)]
    hold_s: _Seconds


@checked_dataclass(frozen=True, config=_CHECKED)
class _User:
    name: str
    lat_deg: LatDeg
    lon_deg: LonDeg
    demand_mbit: DemandMbit
    stop: _Index
    via: Literal["air", "d2d"]
    mate: str | None
    in_flight_mbit: Annotated[float, Field(ge=0)] | None = None


@checked_dataclass(frozen=True, config=_CHECKED)
class _Items:
    first: _Index
    hold: _Index


@checked_dataclass(frozen=True, config=_CHECKED)
class _Slot:
    stop: _Index
    user: str
    start_s: _Seconds
    duration_s: _Seconds


@checked_dataclass(frozen=True, config=_CHECKED)
class _Rally:
    points: list[RallyPoint]


@checked_dataclass(frozen=True, config=_CHECKED)
class _Scenario:
    home: Home
    radio: Radio
    d2d: D2D
    vehicle: Vehicle
    service: Service
    planner: PlannerOptions
    fence_options: FenceOptions = field(default_factory=FenceOptions)
    fence: Fence | None = None
    no_fly: Fence | None = None
    rally: _Rally | None = None


@checked_dataclass(frozen=True, config=_CHECKED)
class _File:
    planner: str
    autopilot: Autopilot
    flight_s: _Seconds
    hover_s: _Seconds
    mission_s: _Seconds
    stops: Annotated[list[_Stop], Field(min_length=1)]
    users: Annotated[list[_User], Field(min_length=1)]
    stop_items: list[_Items]
    schedule: list[_Slot]
    scenario: _Scenario


_FILE = TypeAdapter(_File)


def _no_number(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _known_keys(data: dict[str, Any]) -> dict[str, Any]:
    """Return the file without keys of the scenario's sections that are not known: those forbid them."""
    sections = data.get("scenario")
    if not isinstance(sections, dict):
        return data
    kinds = {**SECTIONS, "fence_options": FenceOptions}
    kept = dict(sections)
    for name in (name for name in kinds if name != "fence"):
        if isinstance(table := kept.get(name), dict):
            known = {item.name for item in dataclasses.fields(kinds[name])}
            kept[name] = {key: value for key, value in table.items() if key in known}
    return {**data, "scenario": kept}


def _problems(error: ValidationError, label: str) -> Iterator[Problem]:
    """Yield what pydantic found, in our words."""
    report = Report()
    for found in error.errors(include_url=False):
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in found["loc"])
        where = f"{label}, {place.removeprefix('.')}" if place else label
        if found["type"] in ("missing", "missing_argument"):
            report.error(where, "is missing", "missing-key")
            continue
        wanted = found["msg"].removeprefix("Input should ")
        wanted = f"it should {wanted}" if wanted != found["msg"] else f"{wanted[0].lower()}{wanted[1:]}"
        report.error(where, f"found {shown(found['input'])}; {wanted}", "out-of-range", found["type"])
    yield from report.problems()


def _contradictions(file: _File, label: str) -> Iterator[Problem]:
    """Yield where parts of a file do not fit together."""
    report = Report()
    stops, names = len(file.stops), [user.name for user in file.users]
    index = {name: number for number, name in enumerate(names)}
    if len(index) < len(names):
        report.error(f"{label}, users", "two of them have the same name", "duplicate-name")
    if len(file.stop_items) != stops:
        message = f"there are {len(file.stop_items)} of them for {stops} stops"
        report.error(f"{label}, stop_items", message, "count")
    before = -1
    for number, items in enumerate(file.stop_items):
        if not before < items.first <= items.hold:
            message = f"items {items.first} and {items.hold} do not follow item {before} in flying order"
            report.error(f"{label}, stop_items[{number}]", message, "order")
        before = items.hold
    for number, user in enumerate(file.users):
        where = f"{label}, users[{number}]"
        if user.stop >= stops:
            report.error(f"{where}.stop", f"found {user.stop}; there are {stops} stops", "out-of-range")
        mate = None if user.mate is None else index.get(user.mate)
        paired = mate is not None and mate != number and file.users[mate].mate == user.name
        if user.mate is not None and not paired:
            message = f"{shown(user.mate)} is no user whose mate is {shown(user.name)}"
            report.error(f"{where}.mate", message, "unmatched-pair")
        elif user.via == "d2d" and mate is None:
            report.error(f"{where}.via", 'found "d2d" for a user without a mate', "unmatched-pair")
        elif user.via == "d2d" and mate is not None and file.users[mate].via == "d2d":
            report.error(f"{where}.via", 'found "d2d" for both of a pair', "unmatched-pair")
    for number, slot in enumerate(file.schedule):
        if slot.stop >= stops or slot.user not in index:
            message = f"user {shown(slot.user)} at stop {slot.stop} is not in the plan"
            report.error(f"{label}, schedule[{number}]", message, "out-of-range")
    yield from report.problems()


def _plan(file: _File, label: str, vehicle: Mapping[str, Any]) -> StoredPlan:
    users = _users(file.users, file.scenario.home)
    sections = file.scenario
    scenario = Scenario(
        home=sections.home,
        users=users,
        radio=sections.radio,
        d2d=sections.d2d,
        vehicle=sections.vehicle,
        service=sections.service,
        planner=sections.planner,
        fence_options=sections.fence_options,
        fence=sections.fence,
        no_fly=sections.no_fly,
        rally=tuple(sections.rally.points) if sections.rally else (),
    )
    index = {name: number for number, name in enumerate(users.names)}
    return StoredPlan(
        label=label,
        autopilot=file.autopilot,
        planner=file.planner,
        scenario=scenario,
        stops=tuple(
            PlannedStop(
                stop.lat_deg, stop.lon_deg, stop.alt_rel_m, stop.hold_s, StopItems(items.first, items.hold)
            )
            for stop, items in zip(file.stops, file.stop_items, strict=True)
        ),
        stop_of=np.array([user.stop for user in file.users], dtype=np.int64),
        d2d=np.array([user.via == "d2d" for user in file.users], dtype=bool),
        schedule=tuple(
            Slot(slot.stop, index[slot.user], slot.start_s, slot.duration_s) for slot in file.schedule
        ),
        # Without it in the service, the planner may have counted on it: then each user says what it expects.
        in_flight=bool(sections.service.in_flight)
        or any(user.in_flight_mbit is not None for user in file.users),
        flight_s=file.flight_s,
        hover_s=file.hover_s,
        mission_s=file.mission_s,
        vehicle=vehicle,
    )


def _users(users: list[_User], home: Home) -> Users:
    from mavplan.geo import LocalPlane

    names = tuple(user.name for user in users)
    index = {name: number for number, name in enumerate(names)}
    lat_deg = np.array([user.lat_deg for user in users], dtype=np.float64)
    lon_deg = np.array([user.lon_deg for user in users], dtype=np.float64)
    return Users(
        names=names,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        xy_m=LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(lat_deg, lon_deg),
        demand_bit=np.array([user.demand_mbit for user in users], dtype=np.float64) * _BIT_PER_MBIT,
        mate=np.array(
            [UNPAIRED if user.mate is None else index[user.mate] for user in users], dtype=np.int64
        ),
    )
