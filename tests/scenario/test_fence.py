"""``[fence]`` and ``[[rally]]`` of a scenario: what they become, and every fault with its place."""

import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.mission.geofence import Fence, FenceCircle, FencePolygon, RallyPoint
from mavplan.scenario import FenceOptions, load_scenario

AREA = "[[fence.inclusion]]\npolygon_deg = [[46.49, 7.48], [46.52, 7.48], [46.52, 7.53], [46.49, 7.53]]\n"
CORNERS = (
    (464_900_000, 74_800_000),
    (465_200_000, 74_800_000),
    (465_200_000, 75_300_000),
    (464_900_000, 75_300_000),
)
CIRCLE = "[[fence.exclusion]]\ncircle = { lat_deg = 46.51, lon_deg = 7.52, radius_m = 100 }\n"
RALLY = '[[rally]]\nlat_deg = 46.502\nlon_deg = 7.499\nalt_rel_m = 30\nname = "barn"\n'


def test_both_kinds_of_both_areas_and_rally_points_are_read(desk):
    """Degrees become 1e-7 degrees; places in the file become names."""
    scenario = desk.load(toml=f"[fence]\nmargin_m = 5\n{AREA}{CIRCLE}{RALLY}{RALLY}")
    polygon, circle = FencePolygon(True, CORNERS), FenceCircle(False, 465_100_000, 75_200_000, 100.0)
    assert scenario.fence == Fence((polygon,), (circle,))
    assert [label for label, _ in scenario.fence.labelled()] == [
        "[[fence.inclusion]] 1",
        "[[fence.exclusion]] 1",
    ]
    assert scenario.rally == (RallyPoint(465_020_000, 74_990_000, 30.0),) * 2
    assert scenario.rally[0].name == "barn"
    assert scenario.fence_options == FenceOptions(margin_m=5.0)
    assert scenario.warnings == ()


def test_without_them_there_is_no_fence(desk):
    """Nor with an empty section."""
    for toml in ("", "[fence]\n", "[fence]\nmargin_m = 0\ninclusion = []\n"):
        scenario = desk.load(toml=toml)
        assert (scenario.fence, scenario.rally) == (None, ())


def test_a_height_limit_is_told_to_be_the_plans_alone(desk):
    """Nobody must believe that the vehicle has it."""
    for autopilot, name in (("ardupilot", "FENCE_ALT_MAX"), ("px4", "GF_MAX_VER_DIST")):
        scenario = desk.load(toml=f'[fence]\nmax_alt_rel_m = 120\n[vehicle]\nautopilot = "{autopilot}"\n')
        (warning,) = scenario.warnings
        assert warning.code == "not-carried"
        assert name in warning.message


@pytest.mark.parametrize(
    ("toml", "code", "words"),
    [
        ("fence = 3\n", "wrong-type", "fence: found 3; allowed is one table [fence]"),
        (
            "[fence]\nmargin_m = -1\n",
            "out-of-range",
            "[fence] margin_m: found -1; allowed is a number from 0",
        ),
        ("[fence]\nmax_alt_rel_m = 0\n", "out-of-range", "[fence] max_alt_rel_m: found 0; allowed is"),
        ("[fence]\nmargin = 1\n", "unknown-key", "[fence] margin: is not known; nearest is margin_m"),
        ("[fence]\nincluson = 1\n", "unknown-key", "nearest is inclusion"),
        ("[fence]\ninclusion = 3\n", "wrong-type", "fence.inclusion: found 3; allowed is a list of tables"),
        (
            "[fence.inclusion]\nx = 1\n",
            "wrong-type",
            "found a table; allowed is a list of tables, each headed [[",
        ),
        ("[[fence.inclusion]]\n", "area", "[[fence.inclusion]] 1: neither is there; an area is either"),
        ("[[fence.inclusion]]\npolygon_deg = []\ncircle = 3\n", "area", "both are there"),
        ("[[fence.inclusion]]\npolygon_deg = 3\n", "wrong-type", "found 3; allowed is a list of vertices"),
        (
            "[[fence.inclusion]]\npolygon_deg = []\n",
            "wrong-type",
            "found a list; allowed is a list of vertices",
        ),
        (
            "[[fence.exclusion]]\ncircle = 3\n",
            "wrong-type",
            "[[fence.exclusion]] 1 circle: found 3; allowed is {",
        ),
        (f"{AREA}colour = 1\n", "unknown-key", "[[fence.inclusion]] 1 colour: is not known"),
        (AREA.replace("[46.52, 7.53]", "7"), "wrong-type", "polygon_deg vertex 3: found 7; allowed is [lat"),
        (AREA.replace("46.52, 7.53", "7"), "wrong-type", "vertex 3: found a list of 1; allowed is [lat"),
        (AREA.replace("46.52, 7.53", "91, 7"), "out-of-range", "vertex 3 lat_deg: found 91; allowed is"),
        (AREA.replace("46.52, 7.53", "nan, 7"), "out-of-range", "vertex 3 lat_deg: found nan; allowed is"),
        (AREA.replace("46.52, 7.53", "46, true"), "out-of-range", "vertex 3 lon_deg: found true; allowed is"),
        (
            AREA.replace(", [46.52, 7.53], [46.49, 7.53]", ""),
            "vertices",
            "2 vertices; at least 3 make an area",
        ),
        (AREA.replace("7.53]]", "7.53], [46.49, 7.48]]"), "vertices", "the last vertex repeats the first"),
        (
            AREA.replace("[46.52, 7.48], [46.52, 7.53]", "[46.52, 7.53], [46.52, 7.48]"),
            "self-crossing",
            "[[fence.inclusion]] 1: its sides meet: vertex 1 to 2 and vertex 3 to 4",
        ),
        (
            CIRCLE.replace("100", "0"),
            "out-of-range",
            "1 circle radius_m: found 0; allowed is a number above 0",
        ),
        (CIRCLE.replace("100", "inf"), "out-of-range", "1 circle radius_m: found inf; allowed is"),
        (
            CIRCLE.replace("radius_m", "radius"),
            "",
            "1 circle radius_m: is missing; needed is a number above 0",
        ),
        ("rally = 3\n", "wrong-type", "rally: found 3; allowed is a list of tables, each headed [[rally]]"),
        ("[rally]\nlat_deg = 1\n", "wrong-type", "rally: found a table; allowed is a list of tables"),
        (RALLY.replace("46.502", "91"), "out-of-range", "[[rally]] 1 lat_deg: found 91; allowed is"),
        (
            RALLY.replace("alt_rel_m = 30\n", ""),
            "missing-key",
            "[[rally]] 1 alt_rel_m: is missing; needed is",
        ),
        (
            RALLY.replace("30", "0"),
            "out-of-range",
            "[[rally]] 1 alt_rel_m: found 0; allowed is a number above 0",
        ),
        (RALLY.replace('"barn"', "3"), "out-of-range", "[[rally]] 1 name: found 3; allowed is text"),
        (
            RALLY.replace("30", "30.5"),
            "rally-fraction",
            "[[rally]] 1 alt_rel_m: an altitude of 30.5 m has a frac",
        ),
        (RALLY.replace("46.502", "7.502"), "too-far", "[[rally]] 1: 7.502, 7.499 is 4,"),
    ],
)
def test_each_fault_has_its_place_and_what_is_allowed(desk, toml, code, words):
    """One fault, one problem, but a misspelt needed key, which is also missing."""
    found = desk.problems(home="", toml=toml + HOME_SECTION)
    assert len(found) == (2 if code == "" else 1), found
    assert any(words in text for _, text in found), found
    assert code in {"", *(code for code, _ in found)}


HOME_SECTION = "[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600\n"


@pytest.mark.parametrize(
    ("toml", "code", "words"),
    [
        (AREA.replace("7.48", "7.501"), "fence-breach", "[home]: lies 76.8 m outside [[fence.inclusion]] 1"),
        (AREA.replace("7.48", "7.49998"), "fence-margin", "[home]: lies within 1.5 m of the border of"),
        (
            CIRCLE.replace("46.51, lon_deg = 7.52", "46.5, lon_deg = 7.5"),
            "fence-breach",
            "[home]: lies 100.0 m inside",
        ),
        (AREA + RALLY.replace("7.499", "7.47"), "fence-breach", "[[rally]] 1: lies 767"),
        (
            "[fence]\nmax_alt_rel_m = 99\n",
            "fence-height",
            "[vehicle] altitude_m: found 100; [fence] max_alt_rel_m = 99",
        ),
        (
            "[fence]\nmax_alt_rel_m = 12\n[vehicle]\naltitude_m = 10\n",
            "fence-height",
            "[vehicle] altitude_m: with default parameters ArduPilot returns at 15 m or higher; [fence]",
        ),
        (
            "[fence]\nmax_alt_rel_m = 101\n" + RALLY.replace("30", "102"),
            "fence-height",
            "[[rally]] 1 alt_rel_m: found 102; [fence] max_alt_rel_m = 101 is the limit",
        ),
    ],
)
def test_what_is_at_odds_with_the_rest_is_found(desk, toml, code, words):
    """Home and rally points in the fence, heights below its limit."""
    found_code, text = desk.only_problem(toml=toml)
    assert found_code == code
    assert words in text


def test_latitude_and_longitude_swapped_are_asked_about(desk):
    """An exclusion somewhere off Somalia would never bind, and nobody would notice."""
    swapped = CIRCLE.replace("46.51, lon_deg = 7.52", "7.52, lon_deg = 46.51")
    code, text = desk.only_problem(toml=swapped)
    assert code == "too-far"
    assert "[[fence.exclusion]] 1: 7.52, 46.51 is 5," in text
    assert text.endswith("are latitude and longitude the wrong way round?")


def test_margin_zero_lets_home_stand_near_the_border(desk):
    """The margin is the user's choice."""
    near = AREA.replace("7.48", "7.49998")
    assert desk.load(toml=f"[fence]\nmargin_m = 1.4\n{near}").fence is not None


def test_a_landing_elsewhere_has_no_return_height(desk):
    """Only a return to launch climbs."""
    toml = '[fence]\nmax_alt_rel_m = 12\n[vehicle]\naltitude_m = 10\nend = "land"\n'
    assert len(desk.load(toml=toml).warnings) == 1


def test_faults_everywhere_are_told_in_one_pass(desk):
    """Areas, rally points, options and users' problems together."""
    found = desk.problems(
        "name,lat_deg,lon_deg\nAnna,91,7\n",
        toml="[fence]\nmargin_m = -1\n"
        + AREA.replace("46.52, 7.53", "91, 7")
        + CIRCLE.replace("100", "0")
        + RALLY.replace("30", "-3"),
    )
    assert len(found) == 5


WORDS = st.sampled_from(
    ["46.5", "7.5", "-1", "nan", "1e400", "true", "'x'", "[]", "{}", "[1, 2]", "[[1, 2]]", "9" * 30]
)
ENTRIES = st.builds(
    lambda head, pairs: head + "".join(f"{json.dumps(key)} = {value}\n" for key, value in pairs.items()),
    st.sampled_from(
        ["[[fence.inclusion]]\n", "[[fence.exclusion]]\n", "[[rally]]\n", "[fence]\n", "[[fence]]\n"]
    ),
    st.dictionaries(
        st.sampled_from(
            [
                "polygon_deg",
                "circle",
                "lat_deg",
                "lon_deg",
                "alt_rel_m",
                "radius_m",
                "name",
                "margin_m",
                "inclusion",
                "x",
            ]
        ),
        WORDS | st.lists(WORDS, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
        max_size=4,
    ),
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(ENTRIES, max_size=4))
def test_any_entries_are_a_scenario_or_one_input_error(desk, entries):
    """Never anything else, and every problem can be printed."""
    path = desk.write(toml="".join(entries))
    try:
        load_scenario(path)
    except InputError as error:
        for problem in error.problems:
            str(problem).encode()
