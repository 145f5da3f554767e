"""From files and options to a flight session: the mission, what its plan knows of users and energy, the recording."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from mavplan.errors import InputError, Problem

if TYPE_CHECKING:
    from mavplan.flight.conductor import FlySession
    from mavplan.flight.recording import Recording
    from mavplan.flight.route import Route
    from mavplan.mission.autopilots import AutopilotRules
    from mavplan.mission.model import Autopilot, Mission
    from mavplan.part import Part
    from mavplan.stored_plan import StoredPlan

SAME_HOLD_S = 1e-3


@dataclass(frozen=True, eq=False)
class Flight:
    """A mission to be flown, with what is known about it.

    Attributes
    ----------
    mission, rules, route
        What is flown.
    battery_wh, needed_wh
        The plan's whole battery, and what it takes with the reserve; None where that is not known.
    warnings
        What the people who fly it should know.
    part
        Which of several flights it is; None where it is the only one, or nobody knows.
    """

    mission: "Mission"
    rules: "AutopilotRules"
    route: "Route"
    battery_wh: float | None
    needed_wh: float | None
    warnings: tuple[Problem, ...]
    part: "Part | None" = None


@dataclass(frozen=True, slots=True)
class Setup:
    """The options of the command line, by their names there."""

    upload: bool
    watch: bool
    system: int | None
    place: str
    source: str
    timeout_s: float | None
    arm_s: float
    max_home_distance_m: float
    max_home_height_m: float
    min_battery_percent: float


def read_flight(file: Path, autopilot: "Autopilot | None", timeout_s: float | None) -> Flight:
    """Read a mission and the plan beside it.

    Raises
    ------
    InputError
        The mission cannot be read or flown as it is, or nobody says for which firmware it is.
    """
    from mavplan.flight.route import make_route
    from mavplan.formats.beside import read_known_mission
    from mavplan.mission.autopilots import AUTOPILOTS
    from mavplan.mission.uploadable import check_uploadable

    mission = read_known_mission(file, autopilot)
    if mission.autopilot is None:
        message = "does not say which firmware it is for: --autopilot says it"
        raise InputError([Problem(str(file), message, "unknown-autopilot")])
    rules = AUTOPILOTS[mission.autopilot]
    warnings = [*mission.warnings, *check_uploadable(mission, rules, str(file))]
    bare = make_route(mission, rules)
    if bare.jumps and timeout_s is None:
        message = "jumps between its items, so that its time cannot be forecast: say with --timeout how long to watch"
        raise InputError([Problem(str(file), message, "jumps")])
    plan, found = plan_of(file, bare)
    warnings += found
    if plan is None:
        return Flight(mission, rules, bare, None, None, tuple(warnings))
    route = make_route(mission, rules, _users(plan))
    return Flight(mission, rules, route, *_energy(mission, rules, plan), tuple(warnings), plan.part)


def plan_of(file: Path, route: "Route") -> "tuple[StoredPlan | None, list[Problem]]":
    """Return the plan beside a mission, where it is this mission's."""
    from mavplan.formats.beside import plan_path

    path = plan_path(file)
    if not path.is_file():
        return None, []
    from mavplan.stored_plan import read_plan

    try:
        plan = read_plan(path)
    except InputError as error:
        return None, [Problem(p.where, p.message, p.code, "warning") for p in error.problems]
    planned = [
        (stop.items.first, stop.items.hold, stop.lat_deg, stop.lon_deg, stop.hold_s) for stop in plan.stops
    ]
    flown = [
        (
            stop.first_seq - route.first_seq,
            stop.hold_seq - route.first_seq,
            stop.lat_e7 / 1e7,
            stop.lon_e7 / 1e7,
            stop.hold_s,
        )
        for stop in route.stops
    ]
    alike = len(planned) == len(flown) and all(
        one[:2] == other[:2]
        and all(abs(a - b) <= SAME_HOLD_S for a, b in zip(one[2:], other[2:], strict=True))
        for one, other in zip(planned, flown, strict=True)
    )
    if alike:
        return plan, []
    message = "is of another mission than the file: who is served where, and the energy, are not shown"
    return None, [Problem(str(path), message, "other-plan", "warning")]


def _users(plan: "StoredPlan") -> list[tuple[str, ...]]:
    """Return the names of those who are served at each stop."""
    names: list[list[str]] = [[] for _ in plan.stops]
    for name, stop in zip(plan.scenario.users.names, plan.stop_of.tolist(), strict=True):
        names[stop].append(name)
    return [tuple(found) for found in names]


def _energy(
    mission: "Mission", rules: "AutopilotRules", plan: "StoredPlan"
) -> tuple[float | None, float | None]:
    """Return the battery and what a flight takes of it with its reserve, in watt-hours."""
    from mavplan.expected import expected_flight

    vehicle = plan.scenario.vehicle
    if vehicle.mass_kg is None or vehicle.battery_wh is None:
        return vehicle.battery_wh, None
    found = expected_flight(mission, plan.scenario, rules)
    if found.used_wh is None:
        return vehicle.battery_wh, None
    return vehicle.battery_wh, found.used_wh + vehicle.reserve_fraction * vehicle.battery_wh


def make_session(flight: Flight, setup: Setup) -> "FlySession":
    """Return the session, begun now."""
    import time

    from mavplan.flight.conductor import FlySession
    from mavplan.flight.preflight import Limits
    from mavplan.flight.session import FlightSession
    from mavplan.link.upload_session import UploadSession
    from mavplan.link.vehicle import DOWNLOAD_DEADLINE_S, default_deadline_s
    from mavplan.link.verify_session import VerifySession
    from mavplan.mission.uploadable import item_count

    limits = Limits(
        setup.max_home_distance_m,
        setup.max_home_height_m,
        setup.min_battery_percent,
        flight.battery_wh,
        flight.needed_wh,
    )
    now = time.monotonic()
    if setup.upload:
        first: UploadSession | VerifySession = UploadSession(
            flight.mission,
            now=now,
            deadline_s=default_deadline_s(item_count(flight.mission)),
            system=setup.system,
            place=setup.place,
            max_home_distance_m=setup.max_home_distance_m,
            max_home_height_m=setup.max_home_height_m,
            source=setup.source,
        )
    else:
        first = VerifySession(
            flight.mission,
            now=now,
            deadline_s=DOWNLOAD_DEADLINE_S,
            system=setup.system,
            place=setup.place,
            source=setup.source,
        )

    def make_flight(now: float, system: int) -> FlightSession:
        return FlightSession(
            flight.mission,
            flight.route,
            limits,
            now=now,
            system=system,
            place=setup.place,
            watch_only=setup.watch,
            flight_s=setup.timeout_s,
            arm_s=setup.arm_s,
        )

    return FlySession(first, make_flight, verify_s=DOWNLOAD_DEADLINE_S)


@contextlib.contextmanager
def open_recording(file: Path, record_file: Path | None, *, wanted: bool) -> "Iterator[Recording | None]":
    """Open the recording of a flight, beside the mission where no other place is named.

    Raises
    ------
    InputError
        It is there already, or cannot be made.
    """
    from mavplan.flight.recording import Recording, recording_path

    if not wanted:
        yield None
        return
    with Recording(record_file or recording_path(file, datetime.now(UTC))) as recording:
        try:
            yield recording
        finally:
            if recording.frames == 0:
                recording.discard()
