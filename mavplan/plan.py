"""A `Plan`: scenario, trajectory, holds, mission and forecast of one flight, made in that order.

The way of the data in one page; each step is a module of its own. No files here.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from mavplan.bounds import Bound
from mavplan.errors import InputError, Problem
from mavplan.expected import expected_flight
from mavplan.geo import LocalPlane
from mavplan.hover import Holds, hold_times
from mavplan.idle_stops import without_idle_stops
from mavplan.mission.autopilots import AUTOPILOTS, AutopilotRules
from mavplan.mission.build import BuiltMission, build_mission
from mavplan.mission.fence_check import flown_legs, mission_breaches
from mavplan.mission.fence_wire import fence_problems
from mavplan.mission.forecast import Forecast
from mavplan.mission.geofence import Fence
from mavplan.mission.model import HomePosition, Mission
from mavplan.part import Part
from mavplan.planners import plan_trajectory
from mavplan.planners.index import joint_index
from mavplan.planners.ordering import ORIGIN_M, path_length_m
from mavplan.planners.pinned import pins_of
from mavplan.planners.sbw import sbw
from mavplan.planners.trajectory import Trajectory
from mavplan.progress import Progress
from mavplan.radio import planning_channel
from mavplan.scenario.fence_checks import height_faults
from mavplan.scenario.model import Floats, Scenario
from mavplan.terrain.check import held_against_ground
from mavplan.terrain.flight import fly_over
from mavplan.terrain.service import Links

if TYPE_CHECKING:
    from mavplan.altitude import ChosenAltitude

HoverStyle = Literal["loiter", "hold", "waypoint+loiter"]


@dataclass(frozen=True, eq=False)
class Plan:
    """One planned flight, and everything that led to it."""

    scenario: Scenario
    rules: AutopilotRules
    trajectory: Trajectory
    holds: Holds
    built: BuiltMission
    forecast: Forecast
    joint_index: float | None
    """ρ_e against the SBW benchmark on the same users; None where it has no value."""
    links: Links | None = None
    """Who is heard from which stop over real ground; None where there is none."""
    part: Part | None = None
    """Which flight it is, where several share the work."""
    altitude: "ChosenAltitude | None" = None
    """How its altitude was chosen, where it was sought."""

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What the people who fly it should know, in the order of the steps."""
        return (
            *self.scenario.warnings,
            *self.trajectory.notes,
            *self.built.warnings,
            *self._too_long(),
            *self._too_dear(),
        )

    @property
    def arrivals_s(self) -> tuple[float, ...]:
        """When the hold at each stop begins, on the clock of the mission."""
        return tuple(self.forecast.hold_begins_s(item.hold) for item in self.built.stop_items)

    @property
    def pinned_names(self) -> tuple[str, ...]:
        """The name of each stop that is pinned, empty for those that are not."""
        pins = pins_of(self.scenario)
        return tuple(pins.names[pin] if pin >= 0 else "" for pin in pins.at(self.trajectory.stops_m).tolist())

    @property
    def remaining_fraction(self) -> float | None:
        """Part of the battery that is left at the end, below 0 where it does not suffice; None where not known."""
        used_wh, battery_wh = self.forecast.used_wh, self.scenario.vehicle.battery_wh
        return None if used_wh is None or battery_wh is None else 1 - used_wh / battery_wh

    @property
    def within_battery(self) -> bool | None:
        """Whether the battery does it with its reserve; None where neither its energy nor an endurance is given."""
        vehicle = self.scenario.vehicle
        known = vehicle.endurance_s is not None or self.remaining_fraction is not None
        return not (self._too_long() or self._too_dear()) if known else None

    def _too_long(self) -> tuple[Problem, ...]:
        """Return a warning where the mission outlasts a given endurance."""
        vehicle = self.scenario.vehicle
        if vehicle.endurance_s is None:
            return ()
        usable_s = vehicle.endurance_s * (1 - vehicle.reserve_fraction)
        if self.forecast.mission_s <= usable_s:
            return ()
        message = (
            f"the mission takes {self.forecast.mission_s:,.0f} s, the battery lasts {usable_s:,.0f} s "
            f"({vehicle.endurance_s:,.0f} s less a reserve of {vehicle.reserve_fraction:.0%})"
        )
        return (Problem("[vehicle] endurance_s", message, "mission-too-long", "warning"),)

    def _too_dear(self) -> tuple[Problem, ...]:
        """Return a warning where the mission takes more from a given battery than its reserve allows."""
        vehicle, left = self.scenario.vehicle, self.remaining_fraction
        if left is None or vehicle.battery_wh is None or left >= vehicle.reserve_fraction:
            return ()
        usable_wh = vehicle.battery_wh * (1 - vehicle.reserve_fraction)
        message = (
            f"the mission takes {self.forecast.used_wh:,.1f} Wh, the battery gives {usable_wh:,.1f} Wh "
            f"({vehicle.battery_wh:,.1f} Wh less a reserve of {vehicle.reserve_fraction:.0%})"
        )
        return (Problem("[vehicle] battery_wh", message, "mission-energy", "warning"),)


def make_plan(
    scenario: Scenario,
    hover: HoverStyle = "waypoint+loiter",
    progress: Progress | None = None,
) -> Plan:
    """Plan a flight: stop points and their order, holds, mission, forecast; where its altitude is sought, at the best.

    Raises
    ------
    InputError
        Nobody can be reached, a hold cannot be stored, the planner is unknown, the benchmark has too many strips, the
        mission would leave its fence, no-fly zones leave no place for a user or no way to a stop, the ground is not
        known under a leg.
    """
    if scenario.search_altitude:
        from mavplan.altitude import plan_at_best_altitude

        return plan_at_best_altitude(scenario, hover, progress)
    return plan_along(scenario, plan_trajectory(scenario, progress), hover)


def plan_along(
    scenario: Scenario,
    trajectory: Trajectory,
    hover: HoverStyle = "waypoint+loiter",
    stored_holds: Callable[[Trajectory], Holds] | None = None,
) -> Plan:
    """Make the flight of a trajectory: round no-fly zones, with holds, as a mission within its fence, and its forecast.

    Parameters
    ----------
    scenario
        What the trajectory was planned for.
    trajectory
        Stops and their order, without regard to no-fly zones.
    hover
        What a stop is made of.
    stored_holds
        Gives the holds of the trajectory as it is flown; None: the least that the demands take.

    Raises
    ------
    InputError
        As `make_plan`, but for the planner.
    """
    vehicle, home = scenario.vehicle, scenario.home
    if scenario.terrain is None and scenario.terrain_options.file is not None:
        message = "was not read with the rest: plan from the scenario itself"
        raise InputError([Problem("[terrain] file", message, "no-terrain")])
    rules = AUTOPILOTS[vehicle.autopilot]
    plane = LocalPlane(home.lat_deg, home.lon_deg)
    back_m: Floats | None = None
    if stored_holds is None:
        trajectory = without_idle_stops(scenario, trajectory, rules)
    undisturbed = trajectory
    if scenario.no_fly is not None:
        trajectory, back_m = _round_zones(trajectory, scenario, scenario.no_fly, plane)
    over = None
    if scenario.terrain is not None:
        over = fly_over(trajectory, scenario, scenario.terrain, back_m, plane)
    if over is not None:
        trajectory, back_m = _without_bound(over.trajectory), over.back_m
    if stored_holds is None:
        holds = hold_times(scenario, trajectory, rules, None if over is None else over.links.rates_bit_s_hz)
    else:
        holds = stored_holds(trajectory)
    flown_m = trajectory.path_m[1:]
    holds_s: list[float | None] = [None] * len(flown_m)
    for at, hold_s in zip(trajectory.stop_at, holds.stored_s.tolist(), strict=True):
        holds_s[at - 1] = hold_s
    built = build_mission(
        home=HomePosition(round(home.lat_deg * 1e7), round(home.lon_deg * 1e7), home.alt_amsl_m),
        stops_e7=_places_e7(flown_m, plane),
        holds_s=holds_s,
        rules=rules,
        altitude_m=vehicle.altitude_m if over is None else over.takeoff_m,
        speed_m_s=vehicle.speed_m_s,
        end=vehicle.end,
        hover=hover,
        back_e7=None if back_m is None else _places_e7(back_m, plane),
        heights=None if over is None else over.heights,
    )
    built = _fenced(built, scenario, rules)
    if scenario.terrain is not None:
        built = held_against_ground(built, scenario, scenario.terrain, rules)
    expected = expected_flight(built.mission, scenario, rules)
    unrounded_s = expected.flight_s + float(holds.asked_s.sum())
    trajectory = replace(trajectory, bound=_of_mission(trajectory.bound, unrounded_s))
    benchmark = sbw(scenario.users, planning_channel(scenario))
    index = joint_index(undisturbed, benchmark)
    links = None if over is None else over.links
    return Plan(scenario, rules, trajectory, holds, built, expected, index, links)


def _round_zones(
    trajectory: Trajectory, scenario: Scenario, zones: Fence, plane: LocalPlane
) -> tuple[Trajectory, Floats]:
    """Return the trajectory round the no-fly zones, and where the way back turns."""
    from mavplan.airspace.around import keep_clear, straight_returns
    from mavplan.airspace.zones import keep_out

    out = keep_out(zones, plane, scenario.fence_options.margin_m)
    returns = scenario.vehicle.end == "rtl"
    pins = pins_of(scenario)
    closed = np.flatnonzero(out.holds(pins.places_m)).tolist() if pins.names else []
    if closed:
        message = "is pinned to a place in a no-fly zone or its margin: it is not moved, nobody may fly there"
        raise InputError([Problem(pins.names[pin], message, "stop-in-zone") for pin in closed])
    found = keep_clear(trajectory, scenario.users, planning_channel(scenario), out, returns=returns)
    notes = (*trajectory.notes, *straight_returns(found.trajectory, out))
    bound = _of_path(trajectory.bound, found.trajectory.path_m, found.back_m)
    return replace(found.trajectory, notes=notes, bound=bound), found.back_m


def _without_bound(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory over real ground: who stands higher is reached from farther away than bounds allow for."""
    if trajectory.bound is None:
        return trajectory
    message = "bounds hold for flat ground only: none is given"
    note = Problem("[terrain] file", message, "no-bound", "warning")
    return replace(trajectory, bound=None, notes=(*trajectory.notes, note))


def _of_path(bound: Bound | None, path_m: Floats, back_m: Floats | None) -> Bound | None:
    """Return a bound on the length of paths beside that of this one, which turns at ``back_m`` on its way home."""
    if bound is None or bound.objective == "mission_s":
        return bound
    turns_m = np.empty((0, 2)) if back_m is None else back_m
    home = np.vstack([turns_m, ORIGIN_M]) if bound.objective == "tour_m" else np.empty((0, 2))
    return replace(bound, plan=path_length_m(np.vstack([path_m, home])))


def _of_mission(bound: Bound | None, mission_s: float) -> Bound | None:
    """Return a bound on mission time beside the time that the mission takes as it is written, before rounding up."""
    if bound is None or bound.objective != "mission_s":
        return bound
    return replace(bound, plan=mission_s, bound=min(bound.bound, mission_s))


def _places_e7(points_m: Floats, plane: LocalPlane) -> list[tuple[int, int]]:
    lat_e7, lon_e7 = plane.to_e7(points_m)
    return list(zip(lat_e7.tolist(), lon_e7.tolist(), strict=True))


def _with_zones(fence: Fence | None, zones: Fence | None) -> Fence | None:
    """Return the fence with the no-fly zones as areas to stay out of, for files and the vehicle."""
    if fence is None or zones is None:
        return fence or zones
    return Fence((*fence.polygons, *zones.polygons), (*fence.circles, *zones.circles))


def _fenced(built: BuiltMission, scenario: Scenario, rules: AutopilotRules) -> BuiltMission:
    """Return the mission with its fence and rally points.

    Raises
    ------
    InputError
        Every stop and leg that would leave the fence, and what the autopilot would not store.
    """
    fence = _with_zones(scenario.fence, scenario.no_fly)
    mission = replace(built.mission, fence=fence, rally=scenario.rally)
    heights = height_faults(scenario.rally, scenario.fence_options, scenario.vehicle)
    noticed = fence_problems(mission, rules)
    problems = [
        *(Problem(where, message, code) for where, message, code in heights),
        *(problem for problem in noticed if problem.severity == "error"),
        *mission_breaches(mission, margin_m=scenario.fence_options.margin_m, names=built.stop_names),
    ]
    if problems:
        raise InputError(problems)
    return replace(built, mission=mission, warnings=(*built.warnings, *noticed, *_elsewhere(mission)))


def _elsewhere(mission: Mission) -> tuple[Problem, ...]:
    """Return a warning for each rally point at which the mission's own return may end."""
    ends = {leg.end.name: None for leg in flown_legs(mission) if leg.returning and leg.end.name != "home"}
    found = (
        "is nearer than home to where the return begins: it may end there, and the forecast does not know it"
    )
    return tuple(Problem(name, found, "rally-return", "warning") for name in ends)
