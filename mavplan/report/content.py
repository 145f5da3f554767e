"""What a report shows, gathered from a mission and its plan; what that is stands in `rows`."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mavplan.bounds import Bound
from mavplan.expected import expected_flight
from mavplan.geo import LocalPlane
from mavplan.hover import broadcast_rates
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.forecast import Forecast
from mavplan.mission.geofence import FenceCircle, FencePolygon
from mavplan.mission.model import Command, Mission
from mavplan.mission.sendable import command_name
from mavplan.proof.receive import rates_bit_s
from mavplan.radio import Channel, planning_channel
from mavplan.report.rows import Area, CompareRow, ItemRow, ReportContent, StopRow, UserRow
from mavplan.scenario.model import UNPAIRED, Floats

if TYPE_CHECKING:
    from mavplan.comparison import Comparison
    from mavplan.stored_plan import StoredPlan


LEAST_BACK_M = 0.5
"""A shorter way back is none: the mission's places are rounded."""


def report_content(
    mission: Mission,
    plan: "StoredPlan",
    title: str,
    comparison: "Comparison | None" = None,
    plane: LocalPlane | None = None,
) -> ReportContent:
    """Gather what a report shows of a flight.

    Parameters
    ----------
    mission
        What is flown.
    plan
        What it was made from.
    title
        Heading of the page.
    comparison
        The planners on the same users, where it was asked for.
    plane
        About the home of the first of several flights; None: about its own.
    """
    vehicle = plan.scenario.vehicle
    rules = AUTOPILOTS[plan.autopilot]
    expected = expected_flight(mission, plan.scenario, rules)
    home_deg = mission.home.lat_e7 / 1e7, mission.home.lon_e7 / 1e7
    own = LocalPlane(*home_deg)
    plane = plane or own
    stops_deg = [stop.lat_deg for stop in plan.stops], [stop.lon_deg for stop in plan.stops]
    path_m = _path_m(mission, plane)
    flown_m = _length_m(_path_m(mission, own))
    length_m = min(flown_m, _way_m(mission, plan, own) if plan.length_m is None else plan.length_m)
    channel = Channel(plan.scenario.radio, vehicle.altitude_m, plan.scenario.d2d)
    mates = plan.scenario.users.mate
    home_items = int(rules.home_on_wire)
    content = ReportContent(
        title=title,
        planner=plan.planner,
        autopilot=rules.title,
        radius_m=planning_channel(plan.scenario).radius_m,
        altitude_m=vehicle.altitude_m,
        service=plan.scenario.service.mode,
        path_m=_points(path_m),
        length_m=length_m,
        back_m=0.0 if flown_m - length_m < LEAST_BACK_M else flown_m - length_m,
        stops=tuple(_stops(plan, plane.to_xy_m(*stops_deg), expected, home_items)),
        users=tuple(_users(plan, own.to_xy_m(*stops_deg), channel, plane)),
        pairs=tuple((n, int(m)) for n, m in enumerate(mates) if m != UNPAIRED and n < m),
        items=tuple(_items(mission, plan, expected, home_items)),
        areas=tuple(_areas(mission, plane, _names(plan))),
        profile=tuple(_profile(mission, expected)),
        ground=tuple(_ground(plan, expected)),
        flight_s=expected.flight_s,
        hover_s=expected.hover_s,
        mission_s=expected.mission_s,
        used_wh=expected.used_wh,
        battery_wh=vehicle.battery_wh,
        comparison=(),
        least_stops="" if comparison is None else str(comparison.least_stops_with_d2d),
        home_m=_points(plane.to_xy_m([home_deg[0]], [home_deg[1]]))[0],
        flight=_flight(plan),
        sorties=plan.part is not None and plan.part.kind == "sortie",
        start_s=0.0 if plan.part is None else plan.part.start_s,
        round=1 if plan.part is None else plan.part.round,
        proved=proved(plan.bound),
        in_flight=plan.in_flight_bit is not None,
        warnings=tuple(dict.fromkeys([*plan.warnings, *(str(problem) for problem in mission.warnings)])),
        not_served=() if plan.part is None else tuple(plan.part.not_served),
    )
    if comparison is None:
        return content
    return replace(content, comparison=tuple(_compared(comparison, content, plan)))


def proved(bound: Bound | None) -> str:
    """Return what is proved of a plan, as a sentence; empty where nothing is."""
    if bound is None:
        return ""
    if bound.objective == "mission_s":
        best = "no plan takes less time"
        rest = (
            f"no plan takes less than {bound.bound:,.1f} s, this one {bound.plan:,.1f} s before its holds are "
            "rounded up"
        )
    else:
        way = "path with its way home" if bound.objective == "tour_m" else "path"
        best = f"no {way} is shorter"
        rest = f"no {way} is shorter than {bound.bound:,.0f} m, this one has {bound.plan:,.0f} m"
    return f"Proved: {best}." if bound.proved else f"Proved: {rest} (gap {bound.gap:.1%})."


def _flight(plan: "StoredPlan") -> str:
    part = plan.part
    if part is None:
        return ""
    again = f", round {part.round} of {part.rounds}" if part.rounds > 1 else ""
    return (part.name or f"{part.kind} {part.number}") + again


def _path_m(mission: Mission, plane: LocalPlane) -> Floats:
    """Return (P, 2) places in flying order, from home; back to it where the mission returns."""
    home = plane.to_xy_m([mission.home.lat_e7 / 1e7], [mission.home.lon_e7 / 1e7])
    placed = [item for item in mission.items if item.has_position]
    path = np.vstack([home, plane.to_xy_m([i.lat_deg for i in placed], [i.lon_deg for i in placed])])
    if any(item.command == Command.NAV_RETURN_TO_LAUNCH for item in mission.items):
        path = np.vstack([path, home])
    moved = np.append(True, np.linalg.norm(np.diff(path, axis=0), axis=1) > 0.01)
    return np.asarray(path[moved])


def _way_m(mission: Mission, plan: "StoredPlan", plane: LocalPlane) -> float:
    """Return the length from home to the last stop."""
    out = replace(mission, items=mission.items[: plan.stops[-1].items.hold + 1])
    return _length_m(_path_m(out, plane))


def _length_m(path_m: Floats) -> float:
    return float(np.linalg.norm(np.diff(path_m, axis=0), axis=1).sum())


def _stops(plan: "StoredPlan", stops_m: Floats, expected: Forecast, home_items: int) -> Iterator[StopRow]:
    for number, (stop, place) in enumerate(zip(plan.stops, stops_m.tolist(), strict=True)):
        first, hold = stop.items.first + home_items, stop.items.hold + home_items
        yield StopRow(
            number=number + 1,
            x_m=place[0],
            y_m=place[1],
            lat_deg=stop.lat_deg,
            lon_deg=stop.lon_deg,
            alt_rel_m=stop.alt_rel_m,
            hold_s=stop.hold_s,
            arrival_s=expected.hold_begins_s(stop.items.hold),
            items=str(first) if first == hold else f"{first}–{hold}",
            users=tuple(np.flatnonzero(plan.stop_of == number).tolist()),
            name=stop.name,
        )


def _users(plan: "StoredPlan", stops_m: Floats, channel: Channel, plane: LocalPlane) -> Iterator[UserRow]:
    """Yield the users; ``stops_m`` in the plan's own plane, their places on the page in ``plane``."""
    users, bandwidth_hz = plan.scenario.users, plan.scenario.radio.bandwidth_hz
    places_m = plane.to_xy_m(users.lat_deg, users.lon_deg)
    passing_bit = np.zeros(len(users)) if plan.in_flight_bit is None else plan.in_flight_bit
    if plan.hidden is None:
        rates = broadcast_rates(users, stops_m, channel)
    else:
        heights_m = np.array([stop.alt_rel_m for stop in plan.stops])
        rates = np.where(plan.hidden, 0.0, rates_bit_s(stops_m, heights_m, plan.listeners_m, channel).T)
    if plan.schedule:
        seconds = np.zeros_like(rates)
        for slot in plan.schedule:
            seconds[slot.user, slot.stop] += slot.duration_s
        got_bit = (rates * seconds).sum(axis=1)
    else:
        got_bit = rates @ plan.hold_s
    for n, name in enumerate(users.names):
        mate, d2d = int(users.mate[n]), bool(plan.d2d[n])
        rate, got = float(rates[n].max()), float(got_bit[n] + passing_bit[n])
        if d2d:
            apart_m = np.linalg.norm(users.xy_m[n] - users.xy_m[mate])
            link = float(channel.d2d_rate(np.array([apart_m]))[0]) * bandwidth_hz
            rate, got = min(float(rates[mate].max()), link), float(users.demand_bit[n])
        yield UserRow(
            name=name,
            x_m=float(places_m[n, 0]),
            y_m=float(places_m[n, 1]),
            lat_deg=float(users.lat_deg[n]),
            lon_deg=float(users.lon_deg[n]),
            demand_mbit=float(users.demand_bit[n]) / 1e6,
            stop=int(plan.stop_of[n]) + 1,
            d2d=d2d,
            mate=users.names[mate] if mate != UNPAIRED else "",
            rate_mbit_s=rate / 1e6,
            in_flight_mbit=0.0 if d2d else float(passing_bit[n]) / 1e6,
            gets_mbit=got / 1e6,
        )


def _items(mission: Mission, plan: "StoredPlan", expected: Forecast, home_items: int) -> Iterator[ItemRow]:
    stop_of = {
        index: number
        for number, stop in enumerate(plan.stops, start=1)
        for index in range(stop.items.first, stop.items.hold + 1)
    }
    for found, item in zip(expected.items, mission.items, strict=True):
        placed = item.has_position
        yield ItemRow(
            seq=found.item + home_items,
            command=command_name(item.command),
            stop=stop_of.get(found.item),
            lat_deg=item.lat_deg if placed else None,
            lon_deg=item.lon_deg if placed else None,
            alt_m=item.alt_m if placed else None,
            hold_s=item.params[0] if item.command in {Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME} else 0.0,
            climb_s=found.seconds.climb,
            cruise_s=found.seconds.cruise,
            hover_s=found.seconds.hover,
            descent_s=found.seconds.descent,
            done_s=found.done_s,
            used_wh=found.used_wh,
        )


def _key(area: FencePolygon | FenceCircle) -> tuple[object, ...]:
    """Return what is the same of an area before and behind a file, which keeps no names."""
    if isinstance(area, FenceCircle):
        return area.lat_e7, area.lon_e7, round(area.radius_m, 2)
    return area.vertices_e7


def _names(plan: "StoredPlan") -> dict[tuple[object, ...], str]:
    """Return what the scenario calls the areas of its fence and its no-fly zones."""
    fences = [fence for fence in (plan.scenario.fence, plan.scenario.no_fly) if fence is not None]
    return {_key(area): area.name for fence in fences for _, area in fence.labelled() if area.name}


def _areas(mission: Mission, plane: LocalPlane, names: Mapping[tuple[object, ...], str]) -> Iterator[Area]:
    for numbered, area in mission.fence.labelled() if mission.fence else ():
        label = names.get(_key(area), numbered)
        if isinstance(area, FenceCircle):
            centre = plane.to_xy_m([area.lat_e7 / 1e7], [area.lon_e7 / 1e7])
            yield Area(label, area.inclusion, _points(centre), area.radius_m)
        else:
            lat, lon = zip(*area.vertices_e7, strict=True)
            ring = plane.to_xy_m(np.array(lat) / 1e7, np.array(lon) / 1e7)
            yield Area(label, area.inclusion, _points(ring))


def _points(places_m: Floats) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in places_m)


def _profile(mission: Mission, expected: Forecast) -> Iterator[tuple[float, float]]:
    """Yield time and height above home of each bend of the flight; between two of them both change evenly."""
    height_m = 0.0
    yield 0.0, 0.0
    for found, item in zip(expected.items, mission.items, strict=True):
        begin_s, phases = found.done_s - found.seconds.total, found.seconds
        to_m = item.alt_m if item.has_position else height_m
        if item.command in {Command.NAV_RETURN_TO_LAUNCH, Command.NAV_LAND}:
            yield begin_s + phases.total - phases.descent, height_m
            to_m = item.alt_m if item.has_position else 0.0
        elif to_m != height_m:
            yield begin_s, height_m
            if phases.hover > 0:
                yield found.done_s - phases.hover, to_m
        height_m = to_m
        if phases.total > 0:
            yield found.done_s, height_m


def _ground(plan: "StoredPlan", expected: Forecast) -> Iterator[tuple[float, float]]:
    """Yield time and height above home of the ground below the vehicle, taken to fly each leg evenly."""
    below_m = 0.0
    if plan.ground:
        yield 0.0, below_m
    for found in expected.items if plan.ground else ():
        heights_m = plan.ground.get(found.item)
        if heights_m is not None:
            begin_s, until_s = found.done_s - found.seconds.total, found.done_s - found.seconds.hover
            yield from zip(
                np.linspace(begin_s, until_s, len(heights_m)).tolist(), heights_m.tolist(), strict=True
            )
            below_m = float(heights_m[-1])
        yield found.done_s, below_m


def _compared(comparison: "Comparison", content: ReportContent, plan: "StoredPlan") -> Iterator[CompareRow]:
    """Yield a row for each planner, that of this plan first, with its own figures."""
    yield CompareRow(
        planner=content.planner,
        stops=len(content.stops),
        d2d_users=sum(user.d2d for user in content.users),
        length_m=content.length_m,
        flown_m=content.length_m + content.back_m,
        sum_rate_bit_s_hz=plan.sum_rate_bit_s_hz,
        joint_index=plan.joint_index,
        hover_s=content.hover_s,
        mission_s=content.mission_s,
        chosen=True,
    )
    for row, other in zip(comparison.rows, comparison.plans, strict=True):
        home = other.scenario.home
        plane = LocalPlane(home.lat_deg, home.lon_deg)
        if row.planner != content.planner:
            yield CompareRow(
                planner=row.planner,
                stops=row.stops,
                d2d_users=row.d2d_users,
                length_m=row.length_m,
                flown_m=max(row.length_m, _length_m(_path_m(other.built.mission, plane))),
                sum_rate_bit_s_hz=row.sum_rate_bit_s_hz,
                joint_index=row.joint_index,
                hover_s=row.hover_s,
                mission_s=row.mission_s,
                chosen=False,
            )
