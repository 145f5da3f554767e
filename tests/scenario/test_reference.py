"""Template and documentation against the sections themselves: every key, unit, range and default is written once."""

import dataclasses
import re
import tomllib
from pathlib import Path

import pytest
from pydantic import ValidationError

from mavplan.cli.init import template_text
from mavplan.planners import PLANNERS
from mavplan.scenario import load_scenario
from mavplan.scenario.reference import AREA_KEYS, LISTED, NO_FLY_KEYS, SECTIONS, keys_of
from mavplan.scenario.report import figure

DOCS = Path(__file__).resolve().parents[2] / "docs/scenario.md"
LISTED_THINGS = [key for kind in ("rally", "vehicles", "stops") for key in keys_of(kind).values()]
ALL_KEYS = [key for section in SECTIONS for key in keys_of(section).values()]


def template_with_everything():
    """The template with its commented keys taken in, and the comment beside each key."""
    lines, comments, section = [], {}, ""
    for line in template_text("scenario.toml").splitlines():
        text = re.sub(r"^# (?=[a-z_0-9]+ = |\[\[)", "", line)
        if header := re.match(r"\[\[?([a-z0-9_.]+)\]", text):
            section = header[1]
        if key := re.match(r"([a-z_0-9]+) = [^#]*(#.*)?$", text):
            comments[section, key[1]] = key[2] or ""
        lines.append(text)
    return tomllib.loads("\n".join(lines)), comments


def test_the_template_documents_every_key_and_no_other():
    """What sections.py knows stands in the template, and nothing else does."""
    data, _ = template_with_everything()
    assert data.pop("users") == "users.csv"
    (rally,) = data.pop("rally")
    assert set(rally) == set(keys_of("rally"))
    (vehicle,) = data.pop("vehicles")
    assert set(vehicle) == set(keys_of("vehicles"))
    at_place, above_user = data.pop("stops")
    assert set(at_place) | set(above_user) == set(keys_of("stops"))
    (zone,) = data.pop("no_fly")
    assert set(zone) <= set(NO_FLY_KEYS)
    ((polygon,), (circle,)) = (data["fence"].pop("inclusion"), data["fence"].pop("exclusion"))
    assert set(polygon) | set(circle) == {"polygon_deg", "circle"}
    assert set(circle["circle"]) == set(keys_of("fence.circle"))
    assert {(section, key) for section, table in data.items() for key in table} == {
        (key.section, key.name) for key in ALL_KEYS
    }


@pytest.mark.parametrize("key", LISTED_THINGS, ids=lambda key: key.place)
def test_the_template_says_range_and_unit_of_a_listed_things_keys(key):
    """Its comments as the section has them."""
    _, comments = template_with_everything()
    assert key.allowed_with_unit in comments[key.section, key.name]


@pytest.mark.parametrize("key", ALL_KEYS, ids=lambda key: key.place)
def test_the_template_says_default_range_and_unit(key):
    """Each commented value is the default, and its comment says what is allowed in which unit."""
    data, comments = template_with_everything()
    if key.default is not None:
        assert data[key.section][key.name] == key.default
    if key.place == "[planner] name":
        assert all(name in comments["planner", "name"] for name in PLANNERS)
    if key.section == "columns":
        assert data["columns"][key.name] == key.name
    else:
        assert key.allowed_with_unit in comments[key.section, key.name]


def test_the_template_with_everything_in_is_a_good_scenario(tmp_path):
    """No commented value is out of its range, nor at odds with another, but the endurance: one user is beyond it."""
    text = template_text("scenario.toml").replace("endurance_s = 1200.0", "endurance_s = 1500.0")
    text = text.replace('# file = "N56W004.hgt"', "")  # the one thing that does not come with it
    text = re.sub(r"^# (?=(?!clearance_m|datum)[a-z_0-9]+ = |\[\[)", "", text, flags=re.MULTILINE)
    text = text.replace("[terrain]", "")
    (tmp_path / "scenario.toml").write_text(text, encoding="utf-8")
    (tmp_path / "users.csv").write_text(template_text("users.csv"), encoding="utf-8")
    scenario = load_scenario(tmp_path / "scenario.toml")
    assert len(scenario.fence.polygons) == len(scenario.fence.circles) == len(scenario.rally) == 1


def test_only_needed_keys_are_not_commented_out():
    """The template as it is sets users and [home] and leaves the rest to the defaults."""
    data = tomllib.loads(template_text("scenario.toml"))
    assert {section for section, table in data.items() if table} == {"users", "home"}


def documented():
    """The tables of docs/scenario.md: (section, key) → (unit, default, allowed)."""
    rows, section = {}, ""
    for line in DOCS.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            header = re.match(r"## `\[\[?([a-z0-9_.]+)\]", line)
            section = header[1] if header else ""
        if section and (cells := re.match(r"\| `([a-z_0-9]+)` \|([^|]*)\|([^|]*)\|([^|]*)\|[^|]+\|$", line)):
            rows[section, cells[1]] = tuple(cell.strip() for cell in cells.groups()[1:])
    return rows


def test_the_documentation_has_every_key_and_no_other():
    """One row a key; an area's two keys stand under inclusion."""
    known = {(key.section, key.name) for key in (*ALL_KEYS, *LISTED_THINGS)}
    areas = {("fence.inclusion", key) for key in AREA_KEYS} | {("no_fly", key) for key in NO_FLY_KEYS}
    assert documented().keys() == known | areas


@pytest.mark.parametrize("key", [*ALL_KEYS, *LISTED_THINGS], ids=lambda key: key.place)
def test_the_documentation_says_unit_default_and_range(key):
    """As the sections have them."""
    unit, default, allowed = documented()[key.section, key.name]
    assert unit == key.unit
    assert allowed == key.allowed
    if key.required:
        assert default == "needed"
    elif key.default is not None:
        value = key.default
        assert default == (figure(value) if isinstance(value, int | float) else value or "none")
    else:
        assert default not in ("", "needed")


LISTED_KEYS = [key for kind in LISTED for key in keys_of(kind).values()]


@pytest.mark.parametrize(
    "key", [key for key in (*ALL_KEYS, *LISTED_KEYS) if key.low > -1e300], ids=lambda key: key.place
)
def test_the_described_range_is_the_one_that_is_checked(key):
    """Values on and beside both ends: the description and the section agree."""
    kind = {**SECTIONS, **LISTED}[key.section]
    needed = {item.name: 1.0 for item in dataclasses.fields(kind) if item.default is dataclasses.MISSING}
    whole = "whole number" in key.allowed
    for end in (key.low, key.high):
        if abs(end) > 1e300:
            continue
        step = 1 if whole else max(abs(end), 1.0) * 1e-9
        for value in (int(end) - 1, int(end), int(end) + 1) if whole else (end - step, end, end + step):
            try:
                kind(**(needed | {key.name: value}))
                taken = True
            except ValidationError:
                taken = False
            inside = key.low < value < key.high or (
                (value == int(key.low) and not key.open_low) or (value == key.high and not key.open_high)
            )
            if not whole:
                assert key.holds(value) == inside
            assert taken == inside, (key, value)
