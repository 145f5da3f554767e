"""What a vehicle's parameters make of a fence: with the defaults that were measured, and each setting by itself."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.mission.autopilots import ARDUPILOT, AUTOPILOTS, PX4
from mavplan.mission.fence_force import NEEDED_PARAMETERS, OTHER_PARAMETERS, fence_force
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.mission.model import HomePosition
from sitl_mock.firmware import FIRMWARES
from sitl_mock.parameters import Parameters
from tests.fences import HOME, box, circle, fenced_mission, fences, place_e7, rally_points

WIDE = Fence((box(-900, -900, 900, 900),))
NARROW = Fence((box(-90, -90, 200, 900),))


def parameters(firmware, **changed):
    """The mock vehicle's, which are the measured defaults, with some changed."""
    known = Parameters(FIRMWARES[firmware])
    found = {name: known.value(name) for name in NEEDED_PARAMETERS[firmware]}
    return found | changed


def judged(
    firmware, fence=WIDE, *, altitude_m=50.0, rally=(), end="rtl", stops_m=((0, 100), (100, 100)), **changed
):
    mission = fenced_mission(
        stops_m, fence=fence, autopilot=firmware, altitude_m=altitude_m, rally=rally, end=end
    )
    return fence_force(mission, AUTOPILOTS[firmware], parameters(firmware, **changed))


def codes(found):
    return [problem.code for problem in found.problems]


def test_an_uploaded_fence_does_nothing_by_default_on_ardupilot():
    """FENCE_ENABLE is 0; and a mission within everything has nothing more to be told."""
    found = judged("ardupilot")
    assert (found.enforced, found.breached) == ((), ())
    assert codes(found) == ["fence-not-in-force"]
    assert "FENCE_ENABLE is 0" in found.words
    assert all(problem.severity == "warning" for problem in found.problems)


def test_the_default_type_would_also_enforce_100_m_of_height_and_150_m_of_radius():
    """Told before anybody enables it, for that is how missions ended in a return."""
    found = judged("ardupilot", altitude_m=100.0, stops_m=((0, 100), (200, 200)))
    assert codes(found) == ["fence-not-in-force", "fence-would-breach", "fence-would-breach"]
    words = [str(problem) for problem in found.problems]
    assert "flies at 100 m, FENCE_ALT_MAX is 100 m" in words[1]
    assert "lies 283 m from home, FENCE_RADIUS is 150 m" in words[2]
    enabled = judged("ardupilot", altitude_m=100.0, stops_m=((0, 100), (200, 200)), FENCE_ENABLE=1)
    assert enabled.enforced == ("areas", "height", "radius")
    assert enabled.breached == ("height", "radius")
    assert codes(enabled) == ["fence-breach", "fence-breach"]
    assert "the vehicle then returns or lands" in str(enabled.problems[0])


def test_a_mission_within_an_enabled_fence_has_nothing_to_be_told():
    """What is in force is said in words."""
    found = judged("ardupilot", FENCE_ENABLE=1)
    assert found.problems == ()
    assert found.words == (
        "in force: the fence's areas, height below 100 m (FENCE_ALT_MAX), within 150 m of home (FENCE_RADIUS); "
        "at a breach the vehicle returns or lands"
    )


@pytest.mark.parametrize(
    ("changed", "enforced", "told"),
    [
        ({"FENCE_AUTOENABLE": 3}, ("areas", "height", "radius"), []),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 4}, ("areas",), []),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 3}, ("height", "radius"), ["fence-not-in-force"]),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 0}, (), ["fence-not-in-force"]),
        ({"FENCE_ENABLE": 1, "FENCE_ACTION": 0}, (), ["fence-report-only"]),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 12, "FENCE_ALT_MIN": -10.0}, ("areas", "floor"), []),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 12}, ("areas",), []),
        ({"FENCE_ENABLE": 1, "FENCE_OPTIONS": 3}, ("areas", "height", "radius"), []),
        ({"FENCE_ENABLE": 0, "FENCE_TYPE": 3}, (), ["fence-not-in-force", "fence-not-in-force"]),
    ],
)
def test_each_parameter_of_ardupilot(changed, enforced, told):
    """Which limits act, and why areas do not."""
    found = judged("ardupilot", **changed)
    assert found.enforced == enforced
    assert codes(found) == told


def test_several_inclusions_where_any_of_them_is_enough_are_told():
    """FENCE_OPTIONS 2: the check is stricter than the vehicle."""
    fence = Fence((box(-900, -900, 900, 900),), (circle(0, 0, 2000),))
    assert codes(judged("ardupilot", fence, FENCE_ENABLE=1, FENCE_OPTIONS=2)) == ["fence-union"]
    assert codes(judged("ardupilot", fence, FENCE_ENABLE=1)) == []


@pytest.mark.parametrize(
    ("changed", "enforced", "told"),
    [
        ({}, ("areas",), []),
        ({"GF_ACTION": 0}, (), ["fence-not-in-force"]),
        ({"GF_ACTION": 1}, (), ["fence-report-only"]),
        (
            {"GF_ACTION": 4, "GF_MAX_HOR_DIST": 500.0, "GF_MAX_VER_DIST": 60.0},
            ("areas", "height", "radius"),
            [],
        ),
        ({"GF_MAX_VER_DIST": 51.0}, ("areas", "height"), ["fence-breach"]),
        ({"GF_MAX_HOR_DIST": 140.0}, ("areas", "radius"), ["fence-breach"]),
        ({"GF_MAX_VER_DIST": 60.0, "RTL_RETURN_ALT": 60.0}, ("areas", "height"), ["fence-breach"]),
    ],
)
def test_each_parameter_of_px4(changed, enforced, told):
    """A fence is in force by default; 0 is no limit; the return has a height of its own."""
    found = judged("px4", **changed)
    assert found.enforced == enforced
    assert codes(found) == told


def test_a_return_height_is_no_matter_where_the_mission_ends_elsewhere():
    """It lands at its last stop."""
    assert judged("px4", end="land", GF_MAX_VER_DIST=60.0, RTL_RETURN_ALT=80.0).problems == ()


def test_areas_are_checked_like_a_plan():
    """The stop and the area, and what the vehicle does then."""
    found = judged("px4", NARROW, stops_m=((0, 100), (400, 100)))
    assert found.breached == ("areas",)
    assert [problem.where for problem in found.problems] == ["item 4 (NAV_LOITER_TIME)"]
    assert "outside fence polygon 1 (inclusion); the vehicle then holds where it is" in str(found.problems[0])


def test_the_floor_is_for_what_is_flown_in_the_air():
    """Take-off and landing are below it by nature."""
    enabled = {"FENCE_ENABLE": 1, "FENCE_TYPE": 8}
    found = judged("ardupilot", None, end="land", FENCE_ALT_MIN=55.0, **enabled)
    assert (found.enforced, found.breached, codes(found)) == (("floor",), ("floor",), ["fence-breach"])
    assert judged("ardupilot", None, end="land", FENCE_ALT_MIN=40.0, **enabled).problems == ()


def test_a_fence_without_any_area_can_be_in_force_too():
    """A mission that has none is held against height and radius all the same."""
    found = judged("ardupilot", None, FENCE_ENABLE=1, altitude_m=99.0)
    assert (found.enforced, found.breached) == (("height", "radius"), ("height",))
    assert "which is too near" in str(found.problems[0])
    assert judged("ardupilot", None, altitude_m=500.0).problems == ()  # nobody asked for a fence
    assert judged("px4", None).words == "no fence is in force: there is no limit to enforce"


def test_areas_of_the_vehicle_and_its_home_count_where_they_are_given():
    """An older fence that is still there; a home that is not the planned one."""
    mission = fenced_mission(((0, 100), (400, 100)), autopilot="px4")
    told = fence_force(mission, PX4, parameters("px4"), fence=NARROW, names={3: "stop 2"})
    assert [problem.where for problem in told.problems] == ["stop 2"]
    near = fenced_mission(((0, 100), (100, 100)), fence=WIDE)
    away = HomePosition(*place_e7(-100, 0), HOME.alt_amsl_m)
    found = fence_force(near, ARDUPILOT, parameters("ardupilot", FENCE_ENABLE=1), home=away)
    assert found.breached == ("radius",)


def test_rally_points_count_for_height_and_radius():
    """A failsafe may return to any of them."""
    rally = [RallyPoint(*place_e7(0, 149), 99.0, "barn")]
    found = judged("ardupilot", rally=rally, FENCE_ENABLE=1)
    assert [problem.where for problem in found.problems] == ["rally point 1 (barn)"] * 2
    assert found.breached == ("height", "radius")


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_a_parameter_that_was_not_told_leaves_it_open(firmware):
    """Each of the needed ones; NaN is no answer either. The others are not needed."""
    mission, rules = fenced_mission(fence=WIDE, autopilot=firmware), AUTOPILOTS[firmware]
    for name in NEEDED_PARAMETERS[firmware]:
        for known in (
            {key: value for key, value in parameters(firmware).items() if key != name},
            parameters(firmware, **{name: math.nan}),
        ):
            found = fence_force(mission, rules, known)
            assert found.enforced is None
            assert codes(found) == ["fence-unknown"]
            assert name in found.words
    assert not set(NEEDED_PARAMETERS[firmware]) & set(OTHER_PARAMETERS[firmware])


numbers = st.sampled_from(
    [math.nan, math.inf, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 7.0, 15.0, 30.0, 60.0, 150.0, 1000.0]
)


@given(st.sampled_from(["ardupilot", "px4"]), st.data())
@settings(deadline=None, max_examples=100)
def test_what_is_breached_is_enforced_and_each_has_its_warning(firmware, data):
    """Whatever the parameters, the fence and the mission are."""
    names = (*NEEDED_PARAMETERS[firmware], *OTHER_PARAMETERS[firmware])
    given_ = {name: data.draw(numbers) for name in names}
    fence = data.draw(fences) or None
    mission = fenced_mission(
        fence=fence, rally=data.draw(st.lists(rally_points, max_size=2)), autopilot=firmware
    )
    found = fence_force(mission, AUTOPILOTS[firmware], given_)
    if found.enforced is None:
        assert codes(found) == ["fence-unknown"]
        return
    assert set(found.breached) <= set(found.enforced)
    assert bool(found.breached) == ("fence-breach" in codes(found))
    assert ("areas" in found.enforced) <= (fence is not None)
    assert bool(found.enforced) == found.words.startswith("in force")
    if fence is not None and "areas" not in found.enforced:
        assert {"fence-not-in-force", "fence-report-only"} & set(codes(found))
    assert found == fence_force(mission, AUTOPILOTS[firmware], dict(given_))


def test_a_higher_fence_never_breaches_more():
    """Monotone: what a lower limit allows, a higher one does too."""
    mission = fenced_mission(fence=WIDE)
    counts = []
    for limit_m in (20.0, 50.0, 51.9, 52.1, 200.0):
        given_ = parameters("ardupilot", FENCE_ENABLE=1, FENCE_TYPE=5, FENCE_ALT_MAX=limit_m)
        counts.append(len(fence_force(replace(mission), ARDUPILOT, given_).problems))
    assert counts == [1, 1, 1, 0, 0]
