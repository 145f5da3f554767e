"""Small scenarios that several tests share: a handful of users on a plane, and hypothesis strategies for them."""

import numpy as np
from hypothesis import strategies as st

from mavplan.hover import hold_times
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.forecast import forecast
from mavplan.scenario import D2D, UNPAIRED, Home, PlannerOptions, Scenario, Service, Users, Vehicle

HOME = Home(lat_deg=46.5, lon_deg=7.5, alt_amsl_m=600.0)


def make_users(xy_m, *, pairs=(), demand_mbit=10.0):
    """Users at these places; ``pairs`` of indices."""
    xy_m = np.asarray(xy_m, dtype=float).reshape(-1, 2)
    mate = np.full(len(xy_m), UNPAIRED, dtype=np.int64)
    for one, other in pairs:
        mate[one], mate[other] = other, one
    return Users(
        names=tuple(f"u{index}" for index in range(len(xy_m))),
        lat_deg=np.full(len(xy_m), HOME.lat_deg),
        lon_deg=np.full(len(xy_m), HOME.lon_deg),
        xy_m=xy_m,
        demand_bit=np.broadcast_to(np.asarray(demand_mbit, dtype=float) * 1e6, len(xy_m)).copy(),
        mate=mate,
    )


def make_scenario(
    xy_m, *, pairs=(), demand_mbit=10.0, clusters=1, seed=0, mode="broadcast", planner="tloaik", **vehicle
):
    """A scenario with the default radio (R 400 m) round these users; the vehicle hovers where it should."""
    return Scenario(
        home=HOME,
        users=make_users(xy_m, pairs=pairs, demand_mbit=demand_mbit),
        d2d=D2D(matching="given", link="ideal"),
        vehicle=Vehicle(**{"position_error_m": 0.0, **vehicle}),
        service=Service(mode=mode),
        planner=PlannerOptions(name=planner, clusters=clusters, seed=seed),
    )


@st.composite
def user_fields(draw, most=14):
    """Draw users with pairs: scattered, on one line, on one point or in two heaps; none, some or all paired."""
    count = draw(st.integers(1, most))
    metres = st.floats(-3000, 3000, allow_nan=False).map(lambda value: round(value, 3))
    shape = draw(st.sampled_from(["scattered", "line", "point", "heaps"]))
    if shape == "scattered":
        xy_m = draw(st.lists(st.tuples(metres, metres), min_size=count, max_size=count))
    elif shape == "line":
        angle = draw(st.floats(0, 3.14))
        along = draw(st.lists(metres, min_size=count, max_size=count))
        xy_m = [(a * np.cos(angle), a * np.sin(angle)) for a in along]
    elif shape == "point":
        xy_m = [draw(st.tuples(metres, metres))] * count
    else:
        heaps = draw(st.lists(st.tuples(metres, metres), min_size=2, max_size=2))
        xy_m = [heaps[draw(st.integers(0, 1))] for _ in range(count)]
    order = draw(st.permutations(range(count)))
    paired = draw(st.integers(0, count // 2))
    return make_users(xy_m, pairs=[(order[2 * i], order[2 * i + 1]) for i in range(paired)])


def mission_s_of(scenario, trajectory):
    """Time of the mission along a trajectory before rounding, by forecast and hover programme."""
    vehicle, rules = scenario.vehicle, AUTOPILOTS[scenario.vehicle.autopilot]
    asked_s = hold_times(scenario, trajectory, rules).asked_s
    holds: list[float | None] = [None] * (len(trajectory.path_m) - 1)
    for at, hold_s in zip(trajectory.stop_at, asked_s.tolist(), strict=True):
        holds[at - 1] = hold_s
    return forecast(
        trajectory.path_m[1:],
        holds,
        rules=rules,
        altitude_m=vehicle.altitude_m,
        speed_m_s=vehicle.speed_m_s,
        acceleration_m_s2=vehicle.acceleration_m_s2,
        end=vehicle.end,
    ).mission_s
