"""A scenario with a fence becomes mission, file and items, and back: nothing is lost, nothing leaves the fence."""

import json
import math
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.cli import run
from mavplan.errors import InputError
from mavplan.formats import FORMATS
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.fence_wire import fence_from_wire, fence_to_wire, rally_from_wire, rally_to_wire
from mavplan.mission.geofence import Fence, FenceCircle, RallyPoint
from mavplan.mission.readback import float32
from mavplan.plan import make_plan
from mavplan.plan_file import document, fingerprint
from mavplan.scenario import FenceOptions, load_scenario
from tests.fences import box, circle, fences, place_e7, rally_points
from tests.support import HOME, make_scenario

PLACES = [(0.0, 300.0), (1200.0, 300.0)]
"""Two users, further apart than R: a stop at each with two clusters."""
WIDE = box(-300, -300, 2000, 2000)


def planned(fence=None, rally=(), *, margin_m=3.0, max_alt_rel_m=None, users=PLACES, **vehicle):
    scenario = make_scenario(users, clusters=len(users), **vehicle)
    options = FenceOptions(margin_m=margin_m, max_alt_rel_m=max_alt_rel_m)
    return make_plan(replace(scenario, fence=fence, rally=tuple(rally), fence_options=options))


def problems(*args, **kwargs):
    with pytest.raises(InputError) as caught:
        planned(*args, **kwargs)
    return [str(problem) for problem in caught.value.problems]


def test_a_plan_within_its_fence_carries_it():
    """In the mission, in the plan beside the file, and in the fingerprint of the scenario."""
    fence, rally = (
        Fence((WIDE,), (circle(600, -200, 50, False),)),
        (RallyPoint(*place_e7(-100, -100), 30.0, "barn"),),
    )
    made = planned(fence, rally)
    assert (made.built.mission.fence, made.built.mission.rally) == (fence, rally)
    assert made.warnings == ()
    bare = planned()
    assert (bare.built.mission.fence, bare.built.mission.rally) == (None, ())
    sections = json.loads(json.dumps(document(made)))["scenario"]
    assert sections["fence"]["circles"][0]["radius_m"] == 50
    assert sections["rally"]["points"][0]["name"] == "barn"
    assert not {"fence", "rally", "fence_options"} & set(document(bare)["scenario"])
    prints = {fingerprint(plan.scenario) for plan in (made, bare, planned(fence), planned(margin_m=4.0))}
    assert len(prints) == 4
    assert replace(made.built.mission, fence=None, rally=()) == bare.built.mission  # no stop is moved


@pytest.mark.parametrize(
    ("area", "said"),
    [
        (box(-300, -300, 900, 900), "stop 2: lies 29"),
        (box(1100, 200, 1300, 400, False), "stop 2: lies 9"),
        (box(500, 280, 600, 320, False), "leg from stop 1 to stop 2: crosses fence polygon 1 (exclusion)"),
        (box(500, 100, 600, 200, False), "return from stop 2 to home: crosses fence polygon 1 (exclusion)"),
        (circle(600, 150, 20, False), "return from stop 2 to home: crosses fence circle 1 (exclusion)"),
        (circle(0, 0, 1242), "stop 2: lies within "),
    ],
)
def test_a_plan_that_would_leave_its_fence_is_refused_by_stop_or_leg_and_area(area, said):
    """One sentence, and nothing written."""
    fence = Fence((), (area,)) if isinstance(area, FenceCircle) else Fence((area,))
    (found,) = problems(fence)
    assert found.startswith(said), found


def test_where_the_mission_ends_with_a_landing_there_is_no_way_back():
    """An exclusion on the way home is nothing to it."""
    fence = Fence((box(500, 100, 600, 200, False),))
    assert planned(fence, end="land").built.mission.fence == fence
    with pytest.raises(InputError):
        planned(fence)


def test_the_margin_is_the_scenarios():
    """A border 20 m from the leg is fine by default and not at 30 m."""
    fence = Fence((box(500, 320, 600, 400, False),))
    assert planned(fence).built.mission.fence == fence
    (found,) = problems(fence, margin_m=30.0)
    assert found.startswith("leg from stop 1 to stop 2: comes within 19.") or "within 20." in found


def test_a_return_that_may_end_at_a_rally_point_is_told_and_checked():
    """The nearer of home and rally points; a wall between stop and rally point is an error."""
    rally = [RallyPoint(*place_e7(1100, 100), 30.0, "barn")]
    (warning,) = planned(None, rally).warnings
    assert (warning.where, warning.code) == ("rally point 1 (barn)", "rally-return")
    wall = Fence((box(1120, 180, 1170, 220, False),))
    assert "return from stop 2 to rally point 1 (barn): crosses fence polygon 1 (exclusion)" in problems(
        wall, rally
    )


def test_rally_points_that_the_other_autopilot_would_cut_are_refused_at_planning():
    """The command line may name another autopilot than the scenario."""
    rally = [RallyPoint(*place_e7(-50, -50), 30.5)]
    assert any("would cut it to 30 m" in line for line in problems(None, rally))
    assert planned(None, rally, autopilot="px4").built.mission.rally == tuple(rally)


@pytest.mark.parametrize(
    ("limit_m", "vehicle", "said"),
    [
        (99.0, {}, "[vehicle] altitude_m: found 100"),
        (20.0, {"altitude_m": 20.0, "autopilot": "px4"}, "PX4 returns at 30 m or higher"),
    ],
)
def test_the_height_limit_holds_for_the_plan(limit_m, vehicle, said):
    """Also where the scenario was made in Python, or another autopilot is chosen."""
    assert any(said in line for line in problems(max_alt_rel_m=limit_m, **vehicle))
    assert planned(max_alt_rel_m=100.0).warnings == ()


def test_a_fence_larger_than_the_simulated_vehicles_storage_is_a_warning():
    """It may be the board's all the same."""
    circles = tuple(circle(-200 - k, -200, 5.0, False) for k in range(43))
    assert [problem.code for problem in planned(Fence((), circles)).warnings] == ["fence-size"]


quick = settings(
    deadline=None, max_examples=40, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


@quick
@given(fences, st.lists(rally_points, max_size=3), st.sampled_from(["ardupilot", "px4"]))
def test_scenario_to_mission_to_plan_and_to_the_wire_and_back(fence, rally, autopilot):
    """Whatever fence a plan keeps to comes back from the file, and from the wire with radii as float32."""
    try:
        mission = planned(
            fence or None, rally, users=[(0.0, 0.0)], autopilot=autopilot, end="land"
        ).built.mission
    except InputError:
        return
    read = FORMATS[".plan"].loads(FORMATS[".plan"].dumps(mission), "m.plan")
    assert (read.fence, read.rally) == (mission.fence, mission.rally) == (fence or None, tuple(rally))
    rules = AUTOPILOTS[autopilot]
    circles = tuple(replace(area, radius_m=float32(area.radius_m)) for area in fence.circles)
    assert fence_from_wire(fence_to_wire(read, rules)) == (replace(fence, circles=circles) or None, ())
    assert rally_from_wire(rally_to_wire(read, rules)) == (tuple(rally), ())


TOML = """
users = "users.csv"
[home]
lat_deg = 46.5
lon_deg = 7.5
alt_amsl_m = 600
[fence]
margin_m = 10
[[fence.inclusion]]
polygon_deg = [[46.49, 7.49], [46.52, 7.49], [46.52, 7.54], [46.49, 7.54]]
[[fence.exclusion]]
circle = { lat_deg = 46.505, lon_deg = %s, radius_m = 80.0 }
[[rally]]
lat_deg = 46.4995
lon_deg = 7.4995
alt_rel_m = 25
name = "barn"
"""


def write(folder, lon_deg):
    (folder / "users.csv").write_text("name,lat_deg,lon_deg\nAnna,46.51,7.5\nBen,46.51,7.53\n")
    (folder / "scenario.toml").write_text(TOML % lon_deg)
    return folder / "scenario.toml"


def test_the_command_line_plans_writes_and_refuses(tmp_path, monkeypatch, capsys):
    """Exit code 2 names leg and area by their place in the scenario, and no file appears."""
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, 7.5025)
    assert run(["plan", str(path), "-o", "m.plan"]) == 2
    told = capsys.readouterr().err
    assert "crosses [[fence.exclusion]] 1" in told
    assert not (tmp_path / "m.plan").exists()
    assert run(["plan", str(write(tmp_path, 7.535)), "-o", "m.plan", "-o", "m.waypoints"]) == 0
    told = capsys.readouterr().err
    assert "fence areas cannot stand in this format" in told
    read = FORMATS[".plan"].loads((tmp_path / "m.plan").read_text(), "m.plan")
    scenario = load_scenario(path)
    assert (read.fence, read.rally) == (scenario.fence, scenario.rally)
    assert math.isclose(read.home.lat_e7 / 1e7, HOME.lat_deg)
