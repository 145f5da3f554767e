"""A plan read back: ``X.mavplan.json`` as typed objects, for a flight, a proof or a new plan for the rest.

The counterpart of `mavplan.plan_file`, which writes it; what may stand in the file is `mavplan.plan_schema`'s.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mavplan.bounds import Bound
from mavplan.formats.beside import plan_path
from mavplan.hover import Slot
from mavplan.mission.build import StopItems
from mavplan.mission.model import Autopilot
from mavplan.part import Part
from mavplan.plan_schema import FileUser, PlanFile, parse_file
from mavplan.scenario.files import read_text
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints, Scenario, Users
from mavplan.scenario.report import Report
from mavplan.scenario.sections import Home
from mavplan.terrain.grid import USER_M

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
    name
        Of a pinned stop; empty for the others.
    """

    lat_deg: float
    lon_deg: float
    alt_rel_m: float
    hold_s: float
    items: StopItems
    name: str = ""


@dataclass(frozen=True, slots=True)
class Turn:
    """A place that is only turned at: degrees, and its item as in `PlannedStop`."""

    item: int
    lat_deg: float
    lon_deg: float


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
    in_flight, in_flight_bit
        Whether its holds count on what users receive in flight, and (N,) how much the planner expects that to be.
    flight_s, hover_s, mission_s
        Forecast.
    arrivals_s
        M seconds from the start of the mission until each hold begins; empty where the file does not say.
    items
        Number of items of the mission, without home; 0 where the file does not say.
    bound
        What no plan is below; None where the planner proves nothing.
    certificate
        Its proof as the file has it, unchecked (`mavplan.bounds.stored`); None where there is none.
    user_rel_m
        (N,) height above home of the ground on which each user stands; None where the plan is over a plane.
    hidden
        (N, M) whether the ground hides each user from each stop; None over a plane.
    ground
        The ground above home under the way to items, by their index, at even distances; empty over a plane.
    turns
        Where it turns between stops, and behind the last one on its way home; empty where the file does not say.
    part
        Which of several flights it is; None where it is the only one.
    length_m, sum_rate_bit_s_hz, joint_index
        The planner's figures; None where the file does not say.
    warnings
        What was said when it was planned.
    fingerprint
        Of everything that the plan depends on (`mavplan.plan_file.fingerprint`); empty where the file does not say.
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
    arrivals_s: tuple[float, ...] = ()
    items: int = 0
    bound: Bound | None = None
    certificate: Any = None
    vehicle: Mapping[str, Any] = field(default_factory=dict)
    user_rel_m: Floats | None = None
    hidden: Bools | None = None
    ground: Mapping[int, Floats] = field(default_factory=dict)
    turns: tuple[Turn, ...] = ()
    part: Part | None = None
    in_flight_bit: Floats | None = None
    length_m: float | None = None
    sum_rate_bit_s_hz: float | None = None
    joint_index: float | None = None
    warnings: tuple[str, ...] = ()
    fingerprint: str = ""

    @property
    def listeners_m(self) -> Floats:
        """(N, 2) the users' places, metres from home; over real ground (N, 3) with the heights of their radios."""
        if self.user_rel_m is None:
            return self.scenario.users.xy_m
        return np.column_stack([self.scenario.users.xy_m, self.user_rel_m + USER_M])

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
    file, vehicle = parse_file(text, label)
    return _plan(file, label, vehicle)


def _plan(file: PlanFile, label: str, vehicle: Mapping[str, Any]) -> StoredPlan:
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
        wind=sections.wind,
        fence_options=sections.fence_options,
        fence=sections.fence,
        no_fly=sections.no_fly,
        rally=tuple(sections.rally.points) if sections.rally else (),
        stops=tuple(sections.stops.pinned) if sections.stops else (),
        terrain_options=sections.terrain,
    )
    index = {name: number for number, name in enumerate(users.names)}
    return StoredPlan(
        label=label,
        autopilot=file.autopilot,
        planner=file.planner,
        scenario=scenario,
        stops=tuple(
            PlannedStop(
                stop.lat_deg,
                stop.lon_deg,
                stop.alt_rel_m,
                stop.hold_s,
                StopItems(items.first, items.hold),
                stop.name,
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
        arrivals_s=tuple(file.forecast.arrivals_s),
        items=len(file.forecast.items),
        bound=None if file.bound is None else Bound(file.bound.objective, file.bound.plan, file.bound.bound),
        certificate=file.certificate,
        vehicle=vehicle,
        user_rel_m=_heights(file),
        hidden=_hidden(file),
        turns=tuple(Turn(turn.item, turn.lat_deg, turn.lon_deg) for turn in file.turns),
        part=_part(file),
        in_flight_bit=_in_flight_bit(file),
        length_m=file.length_m,
        sum_rate_bit_s_hz=file.sum_rate_bit_s_hz,
        joint_index=file.joint_index,
        warnings=tuple(file.warnings),
        fingerprint=file.scenario_sha256,
        ground={leg.item: np.array(leg.ground_rel_m, dtype=np.float64) for leg in file.ground},
    )


def _part(file: PlanFile) -> Part | None:
    part = file.part
    if part is None:
        return None
    return Part(
        kind=part.kind,
        number=part.number,
        of=part.of,
        name=part.name,
        system=part.system,
        start_s=part.start_s,
        not_served=tuple(part.not_served),
        round=part.round,
        rounds=part.rounds,
    )


def _in_flight_bit(file: PlanFile) -> Floats | None:
    if all(user.in_flight_mbit is None for user in file.users):
        return None
    return np.array([user.in_flight_mbit or 0.0 for user in file.users], dtype=np.float64) * _BIT_PER_MBIT


def _heights(file: PlanFile) -> Floats | None:
    heights = [user.ground_rel_m for user in file.users if user.ground_rel_m is not None]
    return np.array(heights, dtype=np.float64) if heights else None


def _hidden(file: PlanFile) -> Bools | None:
    if _heights(file) is None:
        return None
    hidden = np.zeros((len(file.users), len(file.stops)), dtype=bool)
    for n, user in enumerate(file.users):
        hidden[n, user.hidden_from] = True
    return hidden


def _users(users: list[FileUser], home: Home) -> Users:
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
        priority=_priorities(users),
    )


def _priorities(users: list[FileUser]) -> Floats | None:
    """Return (N,) priorities; None where no user has one."""
    if all(user.priority is None for user in users):
        return None
    return np.array([1.0 if user.priority is None else user.priority for user in users])
