"""What stands in an ``X.mavplan.json``: every key that is read, its type and range, and what must fit together.

`mavplan.stored_plan` makes a plan of it. Keys that are not known here are left alone.
"""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as checked_dataclass

from mavplan.errors import InputError, Problem
from mavplan.formats.beside import SUFFIX
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.mission.model import Autopilot
from mavplan.plan_file import VERSION
from mavplan.scenario.files import json_fault
from mavplan.scenario.reference import SECTIONS
from mavplan.scenario.report import Report, shown
from mavplan.scenario.sections import (
    D2D,
    DemandMbit,
    FenceOptions,
    Home,
    LatDeg,
    LonDeg,
    PinnedStop,
    PlannerOptions,
    Priority,
    Radio,
    Service,
    TerrainOptions,
    Vehicle,
    Wind,
)

_CHECKED = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)
_Seconds = Annotated[float, Field(ge=0, le=1e9)]
_Height = Annotated[float, Field(ge=-10_000, le=10_000)]
_Index = Annotated[int, Field(ge=0, le=1_000_000)]


@checked_dataclass(frozen=True, config=_CHECKED)
class FileStop:
    """A stop, as the mission has it."""

    lat_deg: LatDeg
    lon_deg: LonDeg
    alt_rel_m: Annotated[float, Field(ge=-10_000, le=20_000)]
    hold_s: _Seconds
    name: str = ""


@checked_dataclass(frozen=True, config=_CHECKED)
class FileUser:
    """A user; its stop counts from 0."""

    name: str
    lat_deg: LatDeg
    lon_deg: LonDeg
    demand_mbit: DemandMbit
    stop: _Index
    via: Literal["air", "d2d"]
    mate: str | None
    in_flight_mbit: Annotated[float, Field(ge=0)] | None = None
    ground_rel_m: _Height | None = None
    hidden_from: list[_Index] = field(default_factory=list)
    priority: Priority | None = None


@checked_dataclass(frozen=True, config=_CHECKED)
class FileItems:
    """A stop's items, from 0 without home."""

    first: _Index
    hold: _Index


@checked_dataclass(frozen=True, config=_CHECKED)
class FileTurn:
    """A place that is only turned at, by its item."""

    item: _Index
    lat_deg: LatDeg
    lon_deg: LonDeg


@checked_dataclass(frozen=True, config=_CHECKED)
class FileSlot:
    """A turn of a TDMA schedule."""

    stop: _Index
    user: str
    start_s: _Seconds
    duration_s: _Seconds


@checked_dataclass(frozen=True, config=_CHECKED)
class FileRally:
    """The rally points."""

    points: list[RallyPoint]


@checked_dataclass(frozen=True, config=_CHECKED)
class FilePinned:
    """The pinned stops."""

    pinned: list[PinnedStop]


@checked_dataclass(frozen=True, config=_CHECKED)
class FileScenario:
    """The sections of the scenario."""

    home: Home
    radio: Radio
    d2d: D2D
    vehicle: Vehicle
    service: Service
    planner: PlannerOptions
    wind: Wind = field(default_factory=Wind)
    fence_options: FenceOptions = field(default_factory=FenceOptions)
    fence: Fence | None = None
    no_fly: Fence | None = None
    rally: FileRally | None = None
    stops: FilePinned | None = None
    terrain: TerrainOptions = field(default_factory=TerrainOptions)


@checked_dataclass(frozen=True, config=_CHECKED)
class FileForecast:
    """What was forecast item by item, as far as it is read: when each stop is reached, and how many items there are."""

    arrivals_s: list[_Seconds] = field(default_factory=list)
    items: list[dict[str, Any]] = field(default_factory=list)


@checked_dataclass(frozen=True, config=_CHECKED)
class FileGround:
    """The ground under the way to an item, from its beginning to its end at even distances; metres above home."""

    item: _Index
    ground_rel_m: Annotated[list[_Height], Field(min_length=2, max_length=1000)]


@checked_dataclass(frozen=True, config=_CHECKED)
class FileBound:
    """What no plan is below, as the planner found it."""

    objective: Literal["path_m", "tour_m", "mission_s"]
    plan: Annotated[float, Field(ge=0)]
    bound: Annotated[float, Field(ge=0)]


@checked_dataclass(frozen=True, config=_CHECKED)
class FilePart:
    """Which of several flights it is."""

    kind: Literal["sortie", "vehicle"]
    number: Annotated[int, Field(ge=1)]
    of: Annotated[int, Field(ge=1)]
    name: str = ""
    system: Annotated[int, Field(ge=1, le=255)] | None = None
    start_s: _Seconds = 0.0
    not_served: list[str] = field(default_factory=list)
    round: Annotated[int, Field(ge=1)] = 1
    rounds: Annotated[int, Field(ge=1)] = 1


@checked_dataclass(frozen=True, config=_CHECKED)
class PlanFile:
    """What is read of a plan."""

    planner: str
    autopilot: Autopilot
    flight_s: _Seconds
    hover_s: _Seconds
    mission_s: _Seconds
    stops: Annotated[list[FileStop], Field(min_length=1)]
    users: Annotated[list[FileUser], Field(min_length=1)]
    stop_items: list[FileItems]
    schedule: list[FileSlot]
    scenario: FileScenario
    forecast: FileForecast = field(default_factory=FileForecast)
    bound: FileBound | None = None
    certificate: Any = None
    ground: list[FileGround] = field(default_factory=list)
    turns: list[FileTurn] = field(default_factory=list)
    part: FilePart | None = None
    scenario_sha256: str = ""
    length_m: Annotated[float, Field(ge=0)] | None = None
    sum_rate_bit_s_hz: Annotated[float, Field(ge=0)] | None = None
    joint_index: float | None = None
    warnings: list[str] = field(default_factory=list)


_ADAPTER = TypeAdapter(PlanFile)


def parse_file(text: str, label: str) -> tuple[PlanFile, Mapping[str, Any]]:
    """Return what the text of an ``X.mavplan.json`` holds, checked, and its key ``vehicle``.

    Raises
    ------
    InputError
        With everything that is wrong with it.
    """
    try:
        data = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        message = f"is not JSON that can be read: {json_fault(error)}"
        raise InputError([Problem(label, message, "syntax")]) from error
    if not isinstance(data, dict) or data.get("format") != "mavplan":
        message = f"is no plan of mavplan; it is written beside each mission file, its name ends in {SUFFIX}"
        raise InputError([Problem(label, message, "not-a-plan")])
    if data.get("version") != VERSION:
        message = f"has version {shown(data.get('version'))} of the format; {VERSION} can be read: plan again"
        raise InputError([Problem(label, message, "version")])
    try:
        file = _ADAPTER.validate_json(json.dumps(_known_keys(data)), strict=True)
    except ValidationError as error:
        raise InputError(_problems(error, label)) from error
    problems = tuple(_contradictions(file, label))
    if problems:
        raise InputError(problems)
    found = data.get("vehicle")
    return file, found if isinstance(found, dict) else {}


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


def _contradictions(file: PlanFile, label: str) -> Iterator[Problem]:
    """Yield where parts of a file do not fit together."""
    report = Report()
    stops, names = len(file.stops), [user.name for user in file.users]
    index = {name: number for number, name in enumerate(names)}
    if len(index) < len(names):
        report.error(f"{label}, users", "two of them have the same name", "duplicate-name")
    if len(file.stop_items) != stops:
        message = f"there are {len(file.stop_items)} of them for {stops} stops"
        report.error(f"{label}, stop_items", message, "count")
    arrivals = len(file.forecast.arrivals_s)
    if arrivals not in (0, stops):
        message = f"there are {arrivals} of them for {stops} stops"
        report.error(f"{label}, forecast.arrivals_s", message, "count")
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
    _note_ground(file, label, report)
    for number, slot in enumerate(file.schedule):
        if slot.stop >= stops or slot.user not in index:
            message = f"user {shown(slot.user)} at stop {slot.stop} is not in the plan"
            report.error(f"{label}, schedule[{number}]", message, "out-of-range")
    yield from report.problems()


def _note_ground(file: PlanFile, label: str, report: Report) -> None:
    """Note where what is said of the ground does not fit to the users and stops."""
    stops, over_ground = len(file.stops), file.users[0].ground_rel_m is not None
    for number, user in enumerate(file.users):
        where = f"{label}, users[{number}]"
        if any(stop >= stops for stop in user.hidden_from):
            report.error(f"{where}.hidden_from", f"there are {stops} stops", "out-of-range")
        if (user.ground_rel_m is not None) != over_ground:
            report.error(f"{where}.ground_rel_m", "is there for some users and not for others", "missing-key")
