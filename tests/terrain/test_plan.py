"""Plans over real ground: every leg of every mission keeps its clearance, and everybody is heard as the ground is."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.formats import FORMATS
from mavplan.geo import LocalPlane
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.geofence import Fence, FenceCircle
from mavplan.mission.model import Command, Frame
from mavplan.mission.sendable import wire_problems
from mavplan.plan import make_plan
from mavplan.radio import highest_altitude_m, planning_channel
from mavplan.scenario.sections import FenceOptions, TerrainOptions
from mavplan.terrain.service import USER_M
from tests.support import HOME, make_scenario
from tests.terrain.hills import bilinear, flat, ridge, rough, terrain_of

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)


def over(scenario, terrain, clearance_m=30.0):
    return replace(
        scenario, terrain=terrain, terrain_options=TerrainOptions(file="hills.tif", clearance_m=clearance_m)
    )


def planned(scenario):
    """The plan, or None and the codes of what stands against it."""
    try:
        return make_plan(scenario), set()
    except InputError as error:
        return None, {problem.code for problem in error.problems}


def flown_m(mission):
    """(Q, 3) places of the mission behind the take-off, from above home, metres above home."""
    placed = [item for item in mission.items if item.has_position and item.command != Command.NAV_LAND]
    assert all(item.frame == Frame.GLOBAL_RELATIVE_ALT for item in placed)
    xy_m = PLANE.to_xy_m([item.lat_deg for item in placed], [item.lon_deg for item in placed])
    return np.column_stack([xy_m, [item.alt_m for item in placed]])


def least_above_m(mission, terrain):
    """The least height above the ground along all legs, by brute sampling."""
    home_m = bilinear(terrain, [[0, 0]])[0]
    points, found = flown_m(mission), []
    for start, end in itertools.pairwise(points):
        line = start + np.linspace(0, 1, 200)[:, None] * (end - start)
        found.append((home_m + line[:, 2] - bilinear(terrain, line[:, :2])).min())
    return min(found)


def heard_bit(plan, terrain):
    """(N,) bits that everybody hears in the holds, from places and altitudes of the mission, by brute sampling."""
    scenario, items = plan.scenario, plan.built.mission.items
    channel, home_m = planning_channel(scenario), bilinear(terrain, [[0, 0]])[0]
    bits = np.zeros(len(scenario.users))
    for stop, hold_s in zip(plan.built.stop_items, plan.holds.stored_s, strict=True):
        item = items[stop.hold]
        place = np.append(PLANE.to_xy_m(item.lat_deg, item.lon_deg)[0], home_m + item.alt_m)
        for n, xy_m in enumerate(scenario.users.xy_m):
            user = np.append(xy_m, bilinear(terrain, xy_m)[0] + USER_M)
            line = user + np.linspace(0, 1, 200)[:, None] * (place - user)
            slant_m = np.linalg.norm(place - user) + channel.position_error_m
            if (
                slant_m <= highest_altitude_m(channel.radio) + 0.02
                and (line[:, 2] >= bilinear(terrain, line[:, :2]) - 0.05).all()
            ):
                bits[n] += hold_s * channel.radio.bandwidth_hz * np.log2(1 + channel.gamma0 / slant_m**2)
    return bits


metres = st.floats(-560, 560).map(lambda value: round(value, 1))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    rough(),
    st.lists(st.tuples(metres, metres), min_size=1, max_size=6),
    st.sampled_from(["tloaik", "stoaik", "sbw"]),
    st.sampled_from(["rtl", "stay", "land"]),
    st.sampled_from(["ardupilot", "px4"]),
    st.sampled_from(["broadcast", "tdma"]),
)
def test_every_leg_is_clear_and_everybody_hears_enough(terrain, places, planner, end, autopilot, mode):
    scenario = make_scenario(places, planner=planner, end=end, autopilot=autopilot, mode=mode)
    plan, codes = planned(over(scenario, terrain))
    if plan is None:
        # The benchmark's strips lead beyond the small raster.
        assert (planner, codes) == ("sbw", {"not-covered"})
        return
    mission = plan.built.mission
    assert least_above_m(mission, terrain) >= 30.0 - 0.1
    assert set(plan.trajectory.assignment.stop.tolist()) <= set(range(len(plan.built.stop_items)))
    home_m = bilinear(terrain, [[0, 0]])[0]
    for stop in plan.built.stop_items:
        item = mission.items[stop.first]
        ground_m = bilinear(terrain, PLANE.to_xy_m(item.lat_deg, item.lon_deg))[0]
        assert home_m + item.alt_m - ground_m == pytest.approx(100.0, abs=0.2)
    assert (heard_bit(plan, terrain) >= plan.scenario.users.demand_bit * 0.999).all()
    assert wire_problems(mission, AUTOPILOTS[autopilot]) == []
    if end == "rtl":
        assert mission.items[-1].command == Command.NAV_LAND
        assert np.abs(flown_m(mission)[-1] - [0, 0, 100]).max() < 0.06


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    rough(),
    st.lists(st.tuples(metres, metres), min_size=1, max_size=5),
    st.lists(st.tuples(metres, metres, st.floats(10, 120)), min_size=1, max_size=3),
)
def test_with_zones_no_leg_is_in_one_and_every_leg_is_clear(terrain, places, circles):
    """Also legs to and from stops that the ground made necessary."""
    circles = [(x, y, r) for x, y, r in circles if np.hypot(x, y) > r + 40]
    zones = []
    for x, y, radius_m in circles:
        lat, lon = PLANE.to_e7(np.array([[x, y]]))
        zones.append(FenceCircle(False, int(lat[0]), int(lon[0]), radius_m))
    scenario = replace(make_scenario(places), no_fly=Fence((), tuple(zones)) or None)
    plan, codes = planned(over(scenario, terrain))
    if plan is None:
        assert codes <= {"no-allowed-place", "no-way", "no-sight", "not-covered"}
        return
    assert least_above_m(plan.built.mission, terrain) >= 30.0 - 0.1
    assert (heard_bit(plan, terrain) >= plan.scenario.users.demand_bit * 0.999).all()
    for start, end in itertools.pairwise(flown_m(plan.built.mission)):
        line = start + np.linspace(0, 1, 200)[:, None] * (end - start)
        for x, y, radius_m in circles:
            assert np.hypot(line[:, 0] - x, line[:, 1] - y).min() >= radius_m + 3.0


def test_both_file_formats_keep_every_altitude():
    plan = make_plan(over(make_scenario([[500, 0], [-300, 300]], clusters=2), ridge(width_m=150.0)))
    mission = plan.built.mission
    assert len({item.alt_m for item in mission.items if item.has_position}) > 2
    for suffix, known in FORMATS.items():
        read = known.loads(known.dumps(mission), f"a{suffix}")
        assert [(i.alt_m, i.frame) for i in read.items] == [(i.alt_m, i.frame) for i in mission.items]


def test_over_flat_ground_it_is_the_plan_without_terrain_but_for_the_way_back():
    scenario = make_scenario([[500, 0], [-300, 300], [0, -700]], clusters=2)
    plain, plan = make_plan(scenario), make_plan(over(scenario, flat()))
    count = plain.built.stop_items[-1].hold + 1
    assert plan.built.mission.items[:1] == plain.built.mission.items[:1]
    for ours, theirs in zip(plan.built.mission.items[:count], plain.built.mission.items[:count], strict=True):
        assert (ours.command, ours.lat_e7, ours.lon_e7, ours.alt_m) == (
            theirs.command,
            theirs.lat_e7,
            theirs.lon_e7,
            theirs.alt_m,
        )
    assert plan.warnings == plain.warnings


def test_a_hill_on_the_way_is_flown_over_and_said():
    """120 m of ridge between home and the only user: bends on the way there and back, none elsewhere."""
    terrain = ridge(top_m=760.0, at_m=600.0, width_m=120.0)
    plan = make_plan(over(make_scenario([[1200, 0]]), terrain))
    points = flown_m(plan.built.mission)
    bends = points[(np.abs(points[:, 0] - 600) < 100)]
    assert 2 <= len(bends) <= 16
    assert bends[:, 2].max() == pytest.approx(192.0, abs=2.5)
    codes = [problem.code for problem in plan.warnings]
    assert "failsafe-ground" in codes


def test_a_user_behind_a_ridge_gets_a_stop_above_it():
    """A thin wall between the two users of one stop: the one it hides is served from straight above."""
    heights = np.full((201, 201), 600.0)
    heights[:, 110:112] = 690.0  # 285 to 315 m east
    terrain = terrain_of(heights)
    scenario = make_scenario([[0, 0], [400, 0]], position_error_m=1.0)
    assert len(make_plan(over(scenario, flat())).built.stop_items) == 1
    plan = make_plan(over(scenario, terrain))
    note = next(problem for problem in plan.warnings if problem.code == "terrain-stop")
    assert note.where in ("u0", "u1")
    assert "the ground hides it from stop" in note.message
    stop = plan.trajectory.assignment.stop[int(note.where[1])]
    assert plan.trajectory.stops_m[stop] == pytest.approx(scenario.users.xy_m[int(note.where[1])])


def test_a_stop_that_lost_its_users_is_not_flown_to():
    """Both users of a stop between them lie in a gorge too deep for it: each has its own, and the stop is gone."""
    heights = np.full((201, 201), 600.0)
    heights[:, 113:115] = heights[:, 133:135] = 250.0
    scenario = make_scenario([[405, 0], [1005, 0]])
    assert len(make_plan(over(scenario, flat())).built.stop_items) == 1
    plan = make_plan(over(scenario, terrain_of(heights)))
    assert sorted(plan.trajectory.stops_m[:, 0].tolist()) == pytest.approx([405, 1005])
    assert sorted(plan.trajectory.assignment.stop.tolist()) == [0, 1]


def test_a_user_behind_a_ridge_in_a_zone_is_an_error_with_its_name_and_the_stop():
    heights = np.full((201, 201), 600.0)
    heights[:, 110:112] = 690.0
    lat, lon = PLANE.to_e7(np.array([[405.0, 0.0]]))
    zone = Fence((), (FenceCircle(False, int(lat[0]), int(lon[0]), 60.0, "airfield"),))
    scenario = replace(make_scenario([[0, 0], [400, 0]]), no_fly=zone)
    with pytest.raises(InputError) as found:
        make_plan(over(scenario, terrain_of(heights)))
    (problem,) = found.value.problems
    assert (problem.where, problem.code) == ("u1", "no-sight")
    assert "the ground hides it from stop 1" in problem.message


def test_a_user_deep_below_its_stop_is_not_served_from_where_the_plane_would():
    """In the plane both are within R of one stop; the second is in a gorge 200 m deep."""
    heights = np.full((201, 201), 600.0)
    heights[:, 113:] = 400.0
    scenario = make_scenario([[0, 0], [750, 0]], planner="tloaik")
    assert len(make_plan(over(scenario, flat())).built.stop_items) == 1
    plan = make_plan(over(scenario, terrain_of(heights)))
    assert len(plan.built.stop_items) == 2
    assert (heard_bit(plan, plan.scenario.terrain) >= 0.999e7).all()
    low = plan.built.mission.items[plan.built.stop_items[int(plan.trajectory.assignment.stop[1])].first]
    assert low.alt_m == -100.0
    assert "below-home" in [problem.code for problem in plan.warnings]


def test_a_leg_over_nothing_is_an_error():
    heights = np.full((201, 201), 600.0)
    heights[:, 110] = np.nan
    with pytest.raises(InputError) as found:
        make_plan(over(make_scenario([[1200, 0]]), terrain_of(heights)))
    assert {problem.code for problem in found.value.problems} == {"not-covered"}
    assert "m east and" in found.value.problems[0].message


def test_the_fences_height_holds_for_every_item():
    scenario = replace(make_scenario([[1200, 0]]), fence_options=FenceOptions(max_alt_rel_m=150.0))
    terrain = ridge(top_m=760.0, at_m=600.0, width_m=120.0)
    with pytest.raises(InputError) as found:
        make_plan(over(scenario, terrain))
    assert {problem.code for problem in found.value.problems} == {"fence-height"}
    assert len(make_plan(over(scenario, flat())).built.stop_items) == 1


def test_no_bound_is_claimed_over_real_ground():
    """Who stands higher is reached from farther away than the plane's radius."""
    scenario = make_scenario([[900, 0], [0, 900]], planner="length")
    assert make_plan(scenario).trajectory.bound.proved
    plan = make_plan(over(scenario, flat()))
    assert plan.trajectory.bound is None
    assert "no-bound" in {problem.code for problem in plan.warnings}
