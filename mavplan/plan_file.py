"""``X.mavplan.json``, the plan itself beside each mission file: who is served where, and what it was planned from.

The first keys are those of ``mavplan plan --json``; the rest lets a report, a flight or a proof find the users and
demands again without the scenario.
"""

import dataclasses
import hashlib
import json
import math
from typing import Any

import numpy as np

from mavplan.bounds import Bound
from mavplan.json_layout import laid_out
from mavplan.mission.model import Command
from mavplan.plan import Plan
from mavplan.plan_forecast import forecast_object
from mavplan.progress import Progress
from mavplan.scenario.model import UNPAIRED, Scenario, Users
from mavplan.scenario.sections import FenceOptions, TerrainOptions, Wind
from mavplan.terrain.check import ground_under
from mavplan.terrain.grid import Terrain

VERSION = 1


def summary(plan: Plan) -> dict[str, Any]:
    """Return the object of ``mavplan plan --json``: SI units, WGS84 degrees, stops in flying order."""
    trajectory = plan.trajectory
    return {
        "planner": trajectory.planner,
        "radius_m": round(trajectory.radius_m, 3),
        "length_m": round(trajectory.length_m, 3),
        "sum_rate_bit_s_hz": round(trajectory.sum_rate_bit_s_hz, 6),
        "bound": _bound(trajectory.bound),
        "joint_index": None if plan.joint_index is None else round(plan.joint_index, 6),
        "flight_s": round(plan.forecast.flight_s, 1),
        "hover_s": plan.holds.hover_s,
        "mission_s": round(round(plan.forecast.flight_s, 1) + plan.holds.hover_s, 3),
        **({} if plan.altitude is None else {"altitude": dataclasses.asdict(plan.altitude)}),
        "stops": _stops(plan),
        "users": _users(plan),
        "forecast": forecast_object(plan),
    }


def _bound(bound: Bound | None) -> dict[str, Any] | None:
    """Return what no plan can be below, in metres or seconds, rounded down; None where the planner proves nothing."""
    if bound is None:
        return None
    return {
        "objective": bound.objective,
        "plan": round(bound.plan, 3),
        "bound": math.floor(bound.bound * 1e3) / 1e3,
        "gap": round(bound.gap, 7),
        "proved": bound.proved,
    }


def _stops(plan: Plan) -> list[dict[str, Any]]:
    """Return the stops as the mission holds them."""
    served: list[list[str]] = [[] for _ in plan.built.stop_items]
    for name, stop in zip(plan.scenario.users.names, plan.trajectory.assignment.stop, strict=True):
        served[stop].append(name)
    items = plan.built.mission.items
    return [
        {
            "lat_deg": items[item.first].lat_deg,
            "lon_deg": items[item.first].lon_deg,
            "alt_rel_m": items[item.first].alt_m,
            "hold_s": hold_s,
            "users": names,
            **({"name": name} if name else {}),
        }
        for item, hold_s, names, name in zip(
            plan.built.stop_items, plan.holds.stored_s.tolist(), served, plan.pinned_names, strict=True
        )
    ]


def _users(plan: Plan) -> list[dict[str, Any]]:
    """Return the users in the order of their file."""
    users, assignment = plan.scenario.users, plan.trajectory.assignment
    bandwidth_hz, in_flight_bit = plan.scenario.radio.bandwidth_hz, plan.holds.in_flight_bit
    found: list[dict[str, Any]] = [
        {
            "name": name,
            "lat_deg": float(users.lat_deg[n]),
            "lon_deg": float(users.lon_deg[n]),
            "demand_mbit": float(users.demand_bit[n] / 1e6),
            "stop": int(assignment.stop[n]),
            "via": "d2d" if assignment.d2d[n] else "air",
            "mate": None if users.mate[n] == UNPAIRED else users.names[users.mate[n]],
            "rate_bit_s": round(float(assignment.rate_bit_s_hz[n] * bandwidth_hz), 1),
            **({} if users.priority is None else {"priority": float(users.priority[n])}),
        }
        for n, name in enumerate(users.names)
    ]
    if in_flight_bit is not None:
        for user, bits in zip(found, in_flight_bit.tolist(), strict=True):
            user["in_flight_mbit"] = round(bits / 1e6, 6)
    if plan.links is not None and plan.scenario.terrain is not None:
        heights_m = plan.scenario.terrain.height_above_home_m(users.xy_m).tolist()
        for user, height_m, hidden in zip(found, heights_m, plan.links.hidden, strict=True):
            user["ground_rel_m"] = round(height_m, 3)
            user["hidden_from"] = np.flatnonzero(hidden).tolist()
    return found


def document(plan: Plan, progress: Progress | None = None) -> dict[str, Any]:
    """Return what ``X.mavplan.json`` holds; item indices count from 0 over the items without home.

    A proof of its bound may take seconds, of which ``progress`` tells what is done and what there is to do.
    """
    names, bound = plan.scenario.users.names, plan.trajectory.bound
    certificate = None if bound is None or bound.certificate is None else bound.certificate(progress)
    return {
        "format": "mavplan",
        "version": VERSION,
        **summary(plan),
        "autopilot": plan.rules.name,
        "clusters": plan.trajectory.clusters,
        "asked_hold_s": [round(seconds, 6) for seconds in plan.holds.asked_s.tolist()],
        "stop_items": [{"first": item.first, "hold": item.hold} for item in plan.built.stop_items],
        **_turns(plan),
        "schedule": [
            {
                "stop": slot.stop,
                "user": names[slot.user],
                "start_s": round(slot.start_s, 9),
                "duration_s": round(slot.duration_s, 9),
            }
            for slot in plan.holds.schedule
        ],
        **({} if plan.part is None else {"part": dataclasses.asdict(plan.part)}),
        "scenario": sections(plan.scenario),
        "scenario_sha256": fingerprint(plan.scenario),
        **({} if plan.scenario.terrain is None else {"ground": _ground(plan, plan.scenario.terrain)}),
        "warnings": [str(problem) for problem in plan.warnings],
        **({} if certificate is None else {"certificate": certificate}),
    }


def _turns(plan: Plan) -> dict[str, Any]:
    """Return the places that are only turned at, behind the last stop those of the way home; nothing where none are."""
    of_stops = {index for stop in plan.built.stop_items for index in range(stop.first, stop.hold + 1)}
    turns = [
        {"item": index, "lat_deg": item.lat_deg, "lon_deg": item.lon_deg}
        for index, item in enumerate(plan.built.mission.items)
        if item.command == Command.NAV_WAYPOINT and index not in of_stops
    ]
    return {"turns": turns} if turns else {}


def _ground(plan: Plan, terrain: Terrain) -> list[dict[str, Any]]:
    """Return the ground under the way to each item, for pictures."""
    return [
        {"item": item, "ground_rel_m": [round(height_m, 1) for height_m in heights_m.tolist()]}
        for item, heights_m in ground_under(plan.built.mission, terrain)
    ]


def dumps(plan: Plan, progress: Progress | None = None) -> str:
    """Return the text of ``X.mavplan.json``; ``progress`` as in `document`."""
    return laid_out(document(plan, progress))


def sections(scenario: Scenario) -> dict[str, dict[str, Any]]:
    """Return every section with its values, defaults included; fence and rally points where there are any."""
    named: dict[str, Any] = {
        "home": scenario.home,
        "radio": scenario.radio,
        "d2d": scenario.d2d,
        "vehicle": scenario.vehicle,
        "service": scenario.service,
        "planner": scenario.planner,
    }
    if scenario.wind != Wind():
        named["wind"] = scenario.wind
    if scenario.fence_options != FenceOptions():
        named["fence_options"] = scenario.fence_options
    if scenario.fence is not None:
        named["fence"] = scenario.fence
    if scenario.terrain_options != TerrainOptions():
        named["terrain"] = scenario.terrain_options
    found = {name: dataclasses.asdict(section) for name, section in named.items()}
    if scenario.no_fly is not None:
        found["no_fly"] = dataclasses.asdict(scenario.no_fly)
    if scenario.stops:
        found["stops"] = {"pinned": [dataclasses.asdict(stop) for stop in scenario.stops]}
    if scenario.rally:
        found["rally"] = {"points": [dataclasses.asdict(point) for point in scenario.rally]}
    return found


def fingerprint(scenario: Scenario) -> str:
    """Return SHA-256 over every value that a plan depends on, the same however the files are laid out."""
    content = {**sections(scenario), "users": _user_values(scenario.users)}
    if scenario.terrain is not None:
        content["ground"] = hashlib.sha256(scenario.terrain.heights_m.tobytes()).hexdigest()
    return hashlib.sha256(json.dumps(content, sort_keys=True, ensure_ascii=False).encode()).hexdigest()


def _user_values(users: Users) -> list[list[Any]]:
    """Return the users' values as plain lists."""
    columns = [users.lat_deg, users.lon_deg, users.demand_bit, users.mate]
    columns += [] if users.priority is None else [users.priority]
    return [list(row) for row in zip(users.names, *(column.tolist() for column in columns), strict=True)]
