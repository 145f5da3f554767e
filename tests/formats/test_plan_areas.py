"""Fence and rally points in a ``.plan``: what comes back, what other people read, what is refused and where."""

import contextlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.formats import FORMATS, read_mission, write_mission
from mavplan.formats.checks import mavsdk_problems, reader_problems
from mavplan.mission.geofence import Fence, FencePolygon, RallyPoint
from mavplan.mission.model import Mission
from tests.fences import box, circle, fenced_mission, fences, place_e7, rally_points

FENCE = Fence(
    (box(-500, -500, 900, 900), box(-400, -400, -300, -300, False)),
    (circle(0, 0, 2000.5), circle(-200, 300, 25.0, False)),
)
RALLY = (RallyPoint(*place_e7(-50, 60), 30.0, "barn"), RallyPoint(*place_e7(70, -80), 45.0))


def dumped(**changed: Any) -> str:
    """The text of a plan with a fence of every kind."""
    return FORMATS[".plan"].dumps(fenced_mission(fence=FENCE, rally=RALLY, **changed))


def loads(text: str) -> Mission:
    return FORMATS[".plan"].loads(text, "m.plan")


@given(fences, st.lists(rally_points, max_size=4))
@settings(deadline=None)
def test_every_fence_and_rally_point_comes_back_as_it_was(fence: Fence, rally: list[RallyPoint]) -> None:
    """To 1e-7 degrees, radius and altitude to the last bit; and the checks find nothing wrong in the file."""
    mission = fenced_mission(fence=fence or None, rally=rally)
    text = FORMATS[".plan"].dumps(mission)
    read = loads(text)
    assert (read.fence, read.rally) == (mission.fence, mission.rally)
    assert read.warnings == ()
    assert reader_problems(text, mission) == []


def test_the_sections_stand_as_qgroundcontrol_writes_them() -> None:
    """Latitude first, versions 2 and 1, whole numbers without a point; names stay out of the file."""
    document = json.loads(dumped())
    polygon, circle_ = document["geoFence"]["polygons"][1], document["geoFence"]["circles"][0]
    assert document["geoFence"]["version"] == 2
    assert set(polygon) == {"inclusion", "polygon", "version"}
    assert (polygon["inclusion"], polygon["version"], len(polygon["polygon"])) == (False, 1, 4)
    lat_deg, lon_deg = polygon["polygon"][0]
    assert (46 < lat_deg < 47, 7 < lon_deg < 8) == (True, True)
    centre = {"center": [46.5, 7.5], "radius": 2000.5}
    assert circle_ == {"circle": centre, "inclusion": True, "version": 1}
    points = document["rallyPoints"]
    assert points["version"] == 2
    assert [point[2] for point in points["points"]] == [30, 45]
    assert "barn" not in dumped()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_mavsdk_imports_the_fence_and_the_rally_points_that_were_meant(
    tmp_path: Path, autopilot: Any
) -> None:
    """Command, vertex count or radius, place, altitude and frame of each item it would send."""
    mission = fenced_mission(fence=FENCE, rally=RALLY, autopilot=autopilot)
    write_mission(mission, tmp_path / "m.plan")
    assert mavsdk_problems(tmp_path / "m.plan", mission) == []


SHIFTED = tuple((lat, lon + 1) for lat, lon in FENCE.polygons[0].vertices_e7)


@pytest.mark.parametrize(
    "changed",
    [
        {"fence": None},
        {"rally": ()},
        {"fence": replace(FENCE, circles=FENCE.circles[:1])},
        {"fence": replace(FENCE, polygons=(FencePolygon(True, SHIFTED), FENCE.polygons[1]))},
        {"fence": replace(FENCE, polygons=(replace(FENCE.polygons[0], inclusion=False), FENCE.polygons[1]))},
        {"fence": replace(FENCE, circles=(replace(FENCE.circles[0], radius_m=2000.0), FENCE.circles[1]))},
        {"fence": replace(FENCE, circles=(replace(FENCE.circles[0], inclusion=False), FENCE.circles[1]))},
        {"rally": (replace(RALLY[0], alt_rel_m=31.0), RALLY[1])},
        {"rally": (replace(RALLY[0], lat_e7=RALLY[0].lat_e7 + 1), RALLY[1])},
        {"rally": RALLY[::-1]},
    ],
)
def test_another_fence_than_the_one_that_was_meant_is_found_by_both_checks(
    tmp_path: Path, changed: dict[str, Any]
) -> None:
    """The comparison can fail: by as little as 1e-7 degrees."""
    meant = fenced_mission(fence=FENCE, rally=RALLY)
    write_mission(replace(meant, **changed), tmp_path / "m.plan")
    assert {problem.code for problem in reader_problems(tmp_path / "m.plan", meant)} <= {"differs", "count"}
    assert reader_problems(tmp_path / "m.plan", meant)
    assert mavsdk_problems(tmp_path / "m.plan", meant)


def test_a_text_file_cannot_hold_them_and_says_so(tmp_path: Path) -> None:
    """A warning each; what is in the file is the mission."""
    found = write_mission(fenced_mission(fence=FENCE, rally=RALLY), tmp_path / "m.waypoints")
    assert [(problem.message.split(" cannot")[0], problem.code) for problem in found] == [
        ("fence areas", "left-out"),
        ("rally points", "left-out"),
    ]
    assert read_mission(tmp_path / "m.waypoints").fence is None
    assert write_mission(fenced_mission(), tmp_path / "m.waypoints") == ()
    meant = fenced_mission(fence=FENCE, rally=RALLY)
    assert reader_problems(tmp_path / "m.waypoints", meant) == []


def areas(document: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = document["geoFence"][kind]
    return found


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["geoFence"].__setitem__("version", 1), "geoFence.version: found 1, only version 2"),
        (lambda d: d["geoFence"].__setitem__("polygons", 3), "geoFence.polygons: found 3, a list"),
        (lambda d: areas(d, "polygons").__setitem__(0, 3), "geoFence.polygons[0]: found 3, an object"),
        (lambda d: areas(d, "polygons")[1].pop("version"), "geoFence.polygons[1].version: found nothing"),
        (lambda d: areas(d, "polygons")[1].pop("inclusion"), "polygons[1].inclusion: found nothing, true or"),
        (
            lambda d: areas(d, "polygons")[1].__setitem__("inclusion", 1),
            "polygons[1].inclusion: found 1, true",
        ),
        (lambda d: areas(d, "polygons")[0].pop("polygon"), "polygons[0].polygon: found nothing, a list"),
        (
            lambda d: areas(d, "polygons")[0]["polygon"].__setitem__(2, [1]),
            "polygon[2]: found [1], two numbers",
        ),
        (
            lambda d: areas(d, "polygons")[0]["polygon"].__setitem__(2, [None, 2]),
            "polygon[2]: found [null, 2]",
        ),
        (lambda d: areas(d, "polygons")[0]["polygon"].__setitem__(2, [91, 2]), "polygon[2]: latitude 91"),
        (lambda d: areas(d, "polygons")[0]["polygon"].__setitem__(2, [1, 181]), "polygon[2]: longitude 181"),
        (
            lambda d: areas(d, "polygons")[0].__setitem__("polygon", [[1, 2]]),
            "polygons[0]: 1 vertex; at least 3",
        ),
        (lambda d: areas(d, "polygons")[0]["polygon"].reverse() or swap(d), "polygons[0]: its sides meet"),
        (lambda d: areas(d, "circles").__setitem__(0, None), "geoFence.circles[0]: found nothing, an object"),
        (lambda d: areas(d, "circles")[0].pop("circle"), "circles[0].circle: found nothing, an object"),
        (
            lambda d: areas(d, "circles")[0]["circle"].pop("center"),
            "circle.center: found nothing, two numbers",
        ),
        (lambda d: areas(d, "circles")[0]["circle"].pop("radius"), "circle.radius: found nothing, a number"),
        (lambda d: areas(d, "circles")[0]["circle"].__setitem__("radius", 0), "circles[0]: a radius of 0 m"),
        (lambda d: areas(d, "circles")[0]["circle"].__setitem__("radius", True), "circle.radius: found true"),
        (lambda d: d["rallyPoints"].__setitem__("points", {}), "rallyPoints.points: found {}, a list"),
        (
            lambda d: d["rallyPoints"]["points"].__setitem__(1, [1, 2]),
            "points[1]: found [1, 2], three numbers",
        ),
        (lambda d: d["rallyPoints"]["points"].__setitem__(1, [91, 2, 3]), "points[1]: latitude 91"),
        (
            lambda d: d["rallyPoints"]["points"].__setitem__(1, [0, 0, 3]),
            "points[1]: latitude and longitude are",
        ),
        (lambda d: d["rallyPoints"]["points"].__setitem__(1, [1, 2, 1e5]), "points[1]: altitude 100000.0"),
        (
            lambda d: d["rallyPoints"].__setitem__("points", [[1, 2, 3]] * 1001),
            "points: 1,001 entries; at most",
        ),
    ],
)
def test_what_is_no_fence_and_no_rally_point_is_refused_with_its_place(
    change: Callable[[dict[str, Any]], object], said: str
) -> None:
    """One problem each; nothing is dropped in silence."""
    document = json.loads(dumped())
    change(document)
    with pytest.raises(InputError) as caught:
        loads(json.dumps(document))
    (problem,) = caught.value.problems
    assert str(problem).startswith("m.plan, ")
    assert said in str(problem)


def swap(document: dict[str, Any]) -> None:
    corners = areas(document, "polygons")[0]["polygon"]
    corners[1], corners[2] = corners[2], corners[1]


def test_a_point_to_return_to_is_left_out_with_a_warning() -> None:
    """QGroundControl's breachReturn is for aeroplanes."""
    document = json.loads(dumped())
    document["geoFence"]["breachReturn"] = [46.5, 7.5, 30]
    mission = loads(json.dumps(document))
    assert mission.fence == FENCE
    assert [(problem.code, problem.severity) for problem in mission.warnings] == [("left-out", "warning")]


@pytest.mark.parametrize(
    ("fence", "rally", "said"),
    [
        (Fence((FencePolygon(True, ((0, 0), (0, 10), (10, 0), (10, 10))),)), (), "its sides meet"),
        (Fence((), (circle(0, 0, float("nan")),)), (), "a radius of nan"),
        (None, (RallyPoint(1, 1, float("inf")),), "altitude inf"),
        (None, (RallyPoint(1, 1, 83_000.0),), "altitude 83000"),
    ],
)
def test_what_no_vehicle_should_get_is_not_written(
    fence: Fence | None, rally: tuple[RallyPoint, ...], said: str
) -> None:
    """The writer refuses what the reader would."""
    with pytest.raises(InputError, match=said):
        FORMATS[".plan"].dumps(fenced_mission(fence=fence, rally=rally))


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)


@given(st.data())
@settings(deadline=None, max_examples=300)
def test_no_value_anywhere_in_the_sections_does_worse_than_an_input_error(data: st.DataObject) -> None:
    """One value replaced by anything JSON can say: taken or refused, and the checks end too."""
    document = json.loads(dumped())
    node = document[data.draw(st.sampled_from(["geoFence", "rallyPoints"]))]
    while True:
        key = data.draw(st.sampled_from(range(len(node)) if isinstance(node, list) else sorted(node)))
        if not isinstance(node[key], dict | list) or not node[key] or data.draw(st.integers(0, 2)) == 0:
            break
        node = node[key]
    node[key] = data.draw(JSON)
    text = json.dumps(document)
    reader_problems(text)
    mission = None
    with contextlib.suppress(InputError):
        mission = loads(text)
    if mission is not None:
        assert loads(FORMATS[".plan"].dumps(mission)) == mission
