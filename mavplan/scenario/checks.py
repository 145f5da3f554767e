"""Checks beyond single values: a planner exists, an altitude leaves a coverage radius, users are within reach."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mavplan.geo import geodesic_distance_m
from mavplan.radio import coverage_radius_m, highest_altitude_m, planning_error_m, planning_radio
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints
from mavplan.scenario.report import Report, figure, listed, nearest, shown
from mavplan.scenario.sections import (
    D2D,
    FleetVehicle,
    Home,
    PinnedStop,
    PlannerOptions,
    Radio,
    Service,
    Vehicle,
    Wind,
)
from mavplan.scenario.users import FileUsers

MANY = 3
"""As many users that are all too far away are said to be so at once."""
LEAST_WAY_M_S = 1.0
"""Against a wind that leaves less than this nobody should fly."""
MAX_DISTANCE_M = 100_000.0
"""Users further from home than this are a slip of the pen, and the local plane is not made for them."""


AT_MOST = f"at most {MAX_DISTANCE_M / 1000:,.0f} km is allowed"


def check_altitude(radio: Radio, vehicle: Vehicle, service: Service, label: str, report: Report) -> None:
    """Note an altitude from which nobody on the ground is reached, and the altitude at which that ends."""
    error_m, kept = planning_error_m(vehicle, service), planning_radio(radio)
    if coverage_radius_m(kept, vehicle.altitude_m, error_m) > 0:
        return
    limit_m = max(highest_altitude_m(kept) - error_m, 0.0)
    below = f"{math.floor(limit_m * 10) / 10:,.1f}" if limit_m >= 1 else f"{limit_m:.2g}"
    message = (
        f"found {figure(vehicle.altitude_m)}; with this [radio] nobody on the ground reaches snr_threshold_db = "
        f"{figure(radio.snr_threshold_db)}, as the coverage radius is positive only below {below} m"
    )
    report.error(f"{label}, [vehicle] altitude_m", message, "no-coverage")


def check_altitudes(vehicle: Vehicle, label: str, report: Report) -> None:
    """Note a least altitude above the greatest."""
    if vehicle.altitude_min_m <= vehicle.altitude_max_m:
        return
    low, high = figure(vehicle.altitude_min_m), figure(vehicle.altitude_max_m)
    message = f"found {high}; altitude_min_m = {low} is more than that"
    report.error(f"{label}, [vehicle] altitude_max_m", message, "altitudes")


def check_battery(vehicle: Vehicle, label: str, report: Report) -> None:
    """Note a battery without a mass: nobody could say what is left in it."""
    if vehicle.battery_wh is None or vehicle.mass_kg is not None:
        return
    message = (
        "is missing; battery_wh needs the take-off mass (kg), without which no energy can be forecast: give it, "
        "or leave battery_wh out"
    )
    report.error(f"{label}, [vehicle] mass_kg", message, "missing-key")


def check_planner(options: PlannerOptions, label: str, report: Report) -> None:
    """Note a planner that does not exist."""
    from mavplan.planners import PLANNERS

    if options.name in PLANNERS:
        return
    like = nearest(options.name, list(PLANNERS))
    hint = f"; nearest is {like}" if like else ""
    message = f"found {shown(options.name)}; allowed is one of {listed(PLANNERS)}{hint}"
    report.error(f"{label}, [planner] name", message, "unknown-planner")


def check_service(service: Service, label: str, report: Report) -> None:
    """Note in-flight service asked for where users are served one at a time."""
    if service.mode == "tdma" and service.in_flight:
        message = 'found true with mode = "tdma"; in flight only a broadcast is counted: false, or mode = "broadcast"'
        report.error(f"{label}, [service] in_flight", message, "no-in-flight")


def check_wind(wind: Wind, vehicle: Vehicle, label: str, report: Report) -> None:
    """Note a wind against which the vehicle makes no way."""
    from mavplan.mission.flight_law import LAWS

    limit_m_s = LAWS[vehicle.autopilot].airspeed_limit_m_s
    if wind.speed_m_s >= limit_m_s - LEAST_WAY_M_S:
        message = (
            f"found {figure(wind.speed_m_s)}; with default parameters {vehicle.autopilot} makes {limit_m_s:g} m/s "
            f"through the air, and {LEAST_WAY_M_S:g} m/s over the ground must be left"
        )
        report.error(f"{label}, [wind] speed_m_s", message, "wind")


def check_distances(
    users: FileUsers,
    home: Home,
    reach: "Reach | None",
    label: str,
    report: Report,
    vehicles: Sequence[FleetVehicle] = (),
    *,
    all_served: bool = True,
) -> None:
    """Note users too far from home: more than `MAX_DISTANCE_M`, or more than the endurance reaches.

    A user with a mate is within reach if either is: the other is then served through D2D.
    The endurance reaches from the nearest of the homes of ``vehicles`` too. Whom it does not reach stops the work only
    where everybody is to be served, or nobody can be.
    """
    far_m = _distance_m(users.lat_deg, users.lon_deg, home)
    if len(far_m) >= MANY and (far_m > MAX_DISTANCE_M).all():
        _all_are_far(far_m, AT_MOST, users, home, label, report)
        return
    for i in np.flatnonzero(far_m > MAX_DISTANCE_M):
        message = too_far(users.names[i], far_m[i], users.lat_deg[i], users.lon_deg[i], home)
        report.error(users.places[i], message, "too-far")
    if reach is None:
        return
    near_m = far_m
    for other in vehicles:
        near_m = np.fmin(near_m, _distance_m(users.lat_deg, users.lon_deg, other))
    beyond = reach.beyond(near_m, users.mate) & (far_m <= MAX_DISTANCE_M)
    if len(far_m) >= MANY and beyond.all():
        _all_are_far(near_m, reach.reason, users, home, label, report)
        return
    for number, i in enumerate(np.flatnonzero(beyond)):
        nearest = "the nearest home" if len(vehicles) else "home"
        why = reach.reason if number == 0 else f"at most {reach.distance_m:,.0f} m can be reached, as said"
        message = f"{users.names[i]} is {near_m[i]:,.0f} m from {nearest}; {why}"
        if all_served or beyond.all():
            report.error(users.places[i], message, "beyond-endurance")
        else:
            report.warning(users.places[i], f"{message}; it is left over", "beyond-endurance")


def _all_are_far(
    far_m: NDArray[np.float64], why: str, users: FileUsers, home: Home, label: str, report: Report
) -> None:
    """Note once that everybody is too far away: then it is home that is wrong."""
    least_km, most_km = far_m.min() / 1000, far_m.max() / 1000
    message = (
        f"all {len(far_m):,} users are {least_km:,.1f} to {most_km:,.1f} km from here; {why}: is home right?"
        f"{swapped_hint(users.lat_deg[0], users.lon_deg[0], home)}"
    )
    report.error(f"{label}, [home]", message, "too-far")


LEAST_APART_M = 0.5
"""Two pinned stops nearer to one another than this are one."""


def check_stops(
    stops: Sequence[PinnedStop], users: FileUsers, home: Home, label: str, report: Report
) -> None:
    """Note pinned stops above nobody, too far from home, or at one place."""
    placed: list[tuple[str, float, float]] = []
    for number, stop in enumerate(stops, start=1):
        where = f"{label}, [[stops]] {number}"
        lat_deg, lon_deg = stop.lat_deg, stop.lon_deg
        if stop.user is not None:
            if stop.user not in users.names:
                like = nearest(stop.user, users.names)
                hint = f"; nearest is {shown(like)}" if like else ""
                report.error(f"{where} user", f"there is no user {shown(stop.user)}{hint}", "unknown-user")
                continue
            row = users.names.index(stop.user)
            lat_deg, lon_deg = float(users.lat_deg[row]), float(users.lon_deg[row])
        if lat_deg is None or lon_deg is None or not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
            continue  # a problem that is noted already
        far_m = float(geodesic_distance_m(home.lat_deg, home.lon_deg, lat_deg, lon_deg))
        if far_m > MAX_DISTANCE_M:
            report.error(where, too_far(stop.name, far_m, lat_deg, lon_deg, home), "too-far")
        for name, other_lat_deg, other_lon_deg in placed:
            if geodesic_distance_m(lat_deg, lon_deg, other_lat_deg, other_lon_deg) < LEAST_APART_M:
                report.error(where, f"is at the same place as the pinned stop {shown(name)}", "duplicate")
        placed.append((stop.name, lat_deg, lon_deg))


@dataclass(frozen=True, slots=True)
class Reach:
    """How far from home a user can be at most, and the sentence that says why."""

    distance_m: float
    reason: str

    def beyond(self, near_m: Floats, mate: Ints) -> Bools:
        """Return (N,) who is too far away by distances to the nearest home, as is the mate if there is one."""
        mate_m = np.where(mate == UNPAIRED, np.inf, near_m[mate])
        too_far: Bools = np.fmin(near_m, mate_m) > self.distance_m
        return too_far


def reach_of(vehicle: Vehicle, radio: Radio, d2d: D2D, service: Service) -> Reach | None:
    """Return how far from home users can be served with the vehicle's endurance; None where none is given.

    Straight out at full speed without a second of hover, back too if the mission ends at home; the last R metres are
    the radio's, and one more D2D range where anybody may become anybody's mate. Nobody beyond can be served,
    whatever the plan.
    """
    if vehicle.endurance_s is None:
        return None
    usable_s = vehicle.endurance_s * (1.0 - vehicle.reserve_fraction)
    returns = vehicle.end == "rtl"
    flown_m = usable_s * vehicle.speed_m_s / (2.0 if returns else 1.0)
    error_m = planning_error_m(vehicle, service)
    radius_m = coverage_radius_m(planning_radio(radio), vehicle.altitude_m, error_m)
    relayed_m = d2d.range_m if d2d.matching == "auto" else 0.0
    total_m = flown_m + radius_m + relayed_m
    reason = (
        f"[vehicle] endurance_s = {figure(vehicle.endurance_s)} less {vehicle.reserve_fraction:.3g} in reserve reaches "
        f"{flown_m:,.0f} m {'out and back' if returns else 'out'} at {figure(vehicle.speed_m_s)} m/s, and the radio "
        f"{radius_m:,.0f} m from there{f', D2D another {relayed_m:,.0f} m' if relayed_m else ''}: "
        f"{total_m:,.0f} m in all"
    )
    return Reach(total_m, reason)


def _distance_m(
    lat_deg: NDArray[np.float64], lon_deg: NDArray[np.float64], home: Home | FleetVehicle
) -> NDArray[np.float64]:
    """Return distances from home, NaN for users whose position has a problem."""
    distance_m = np.full(lat_deg.shape, np.nan)
    known = np.isfinite(lat_deg) & np.isfinite(lon_deg)
    if known.any():
        distance_m[known] = geodesic_distance_m(home.lat_deg, home.lon_deg, lat_deg[known], lon_deg[known])
    return distance_m


def too_far(what: str, far_m: float, lat_deg: float, lon_deg: float, home: Home) -> str:
    """Return what is wrong with a place further from home than `MAX_DISTANCE_M`."""
    return f"{what} is {far_m / 1000:,.1f} km from home; {AT_MOST}{swapped_hint(lat_deg, lon_deg, home)}"


def swapped_hint(lat_deg: float, lon_deg: float, home: Home) -> str:
    """Return a hint where a user would be near home with latitude and longitude the other way round."""
    if abs(lon_deg) > 90:
        return ""
    swapped_m = float(geodesic_distance_m(home.lat_deg, home.lon_deg, lon_deg, lat_deg))
    return "; are latitude and longitude the wrong way round?" if swapped_m <= MAX_DISTANCE_M else ""
