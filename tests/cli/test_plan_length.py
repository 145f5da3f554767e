"""``plan --planner length``: what it says of its bound, and ``check``, which proves it anew from the file."""

import json
import re

import pytest


@pytest.fixture
def planned(mavplan, gallery):
    """The object and the file of the valley's shortest path."""

    def run(*options):
        ran = mavplan(
            "plan",
            gallery / "valley/scenario.toml",
            "--planner",
            "length",
            "-o",
            "v.plan",
            "--json",
            *options,
        )
        assert ran.code == 0, ran.err
        return json.loads(ran.out), ran.err

    return run


@pytest.fixture
def checked(mavplan, tmp_path):
    """Check v.plan after a change to its plan."""

    def run(change):
        file = tmp_path / "v.mavplan.json"
        content = json.loads(file.read_text())
        change(content)
        file.write_text(json.dumps(content))
        return mavplan("check", "v.plan", "--no-flight")

    return run


def test_the_object_says_plan_bound_and_gap(planned):
    found, err = planned()
    bound = found["bound"]
    assert bound["objective"] == "tour_m"
    assert bound["bound"] <= bound["plan"] <= bound["bound"] * (1 + 2e-6)
    assert bound["proved"] is True
    assert bound["plan"] > found["length_m"]
    assert "not-proved" not in err


def test_the_table_says_that_the_path_is_the_shortest(mavplan, gallery):
    ran = mavplan("plan", gallery / "valley/scenario.toml", "--planner", "length")
    assert re.search(r"path [\d,]+ m, with the way home [\d,]+ m, proved the shortest,", ran.out)


def test_a_search_that_is_cut_off_says_the_gap(mavplan, gallery):
    scenario = gallery / "hppp60/scenario.toml"
    ran = mavplan("plan", scenario, "--planner", "length", "--time-limit", "0")
    assert ran.code == 0
    assert re.search(r"with the way home [\d,]+ m, nothing proved of how much is left", ran.out)
    assert "[planner] time_limit_s: the search for the shortest path was cut off after 0 s" in ran.err


@pytest.mark.parametrize("limit", ["-1", "x", "1e9"])
def test_a_limit_that_is_none_is_refused(mavplan, gallery, limit):
    ran = mavplan("plan", gallery / "valley/scenario.toml", "--planner", "length", "--time-limit", limit)
    assert ran.code == 2
    assert "--time-limit" in ran.err


def test_check_proves_the_bound_anew(planned, checked):
    planned()
    ran = checked(lambda _: None)
    assert ran.code == 0, ran.err
    assert re.search(r"plan: path and way home [\d,.]+ m, proved anew: at least [\d,.]+ m", ran.out)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda content: content["certificate"].update(bound=1e6), "that it says"),
        (lambda content: content["certificate"]["branches"].pop(), "branch"),
        (lambda content: content["certificate"].update(kind="guess"), "guess"),
        (lambda content: content["bound"].update(objective="path_m"), "another kind of path"),
        (lambda content: content["bound"].update(plan=100.0), "more than"),
        (lambda content: content.pop("bound"), "no bound"),
        (lambda content: content["users"][0].update(lat_deg=content["users"][0]["lat_deg"] + 0.02), ""),
    ],
)
def test_a_proof_that_is_tampered_with_is_found(planned, checked, change, words):
    planned()
    ran = checked(change)
    assert ran.code == 6
    assert "certificate" in ran.err
    assert words in ran.err


def test_a_plan_without_a_proof_is_checked_as_ever(mavplan, gallery):
    assert mavplan("plan", gallery / "valley/scenario.toml", "--clusters", "3", "-o", "v.plan").code == 0
    ran = mavplan("check", "v.plan", "--no-flight")
    assert ran.code == 0, ran.err
    assert "proved anew" not in ran.out
