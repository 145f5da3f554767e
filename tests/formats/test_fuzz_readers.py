"""Good files with something wrong in them, and any bytes at all: the readers give a value or one InputError, and end.

Each file is damaged in two ways: in its bytes (as a disc or a hasty editor does), and in its values (as another program
does: another type, a number out of all range, a key more or less, everything nested in itself).
"""

import copy
import json
import math
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.formats import read_mission, write_mission
from mavplan.formats.beside import plan_path, read_known_mission, remember_vehicle, remembered_vehicle
from mavplan.formats.checks import reader_problems
from mavplan.link.protocol import Address
from mavplan.link.report import UploadReport
from mavplan.mission.model import Mission
from mavplan.scenario import load_scenario

VALLEY = Path(__file__).resolve().parents[2] / "missions/valley"
FUZZ = settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
SUFFIXES = pytest.mark.parametrize("suffix", [".plan", ".waypoints"])

STRANGE = [
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        2**31,
        2**63,
        -(2**200),
        10**400,
        0.5,
        -0.0,
        1e39,
        1e308,
        math.nan,
        math.inf,
    ),
    *("", "0", "nan", "\x00", "\ud800", "é" * 300, "-Infinity", "../../etc/passwd"),
    *([], {}, [[]], [None], {"": {}}, [1, 2], [1, 2, 3, 4, 5, 6, 7, 8]),
]
TOKENS = [
    *(
        b"\x00",
        b"\xff",
        b"\xef\xbb\xbf",
        b"\n",
        b"\r",
        b"\t",
        b",",
        b'"',
        b"'",
        b"{",
        b"}",
        b"[",
        b"]",
        b"=",
        b"#",
    ),
    *(
        b"NaN",
        b"Infinity",
        b"1e999",
        b"-",
        b"9" * 5000,
        b"[" * 3000,
        b'{"a":' * 3000,
        b"\\ud800",
        b"\xed\xa0\x80",
    ),
    *(b"QGC WPL 110\n", b"nan\t", b"0x10", b"1_0", "٣".encode(), b"[[rally]]\n", b"[fence]\n", b"inf"),
]


def damaged_bytes(data: bytes, chance: random.Random) -> bytes:
    """A few stretches of the text cut out, doubled, swapped, overwritten, or something put in."""
    for _ in range(chance.randint(1, 4)):
        at, to = sorted(chance.randrange(len(data) + 1) for _ in range(2))
        to = min(to, at + chance.choice([1, 2, 10, 1000]))
        put = chance.choice([b"", data[at:to] * 2, chance.choice(TOKENS), chance.randbytes(to - at)])
        data = data[:at] + put + data[to:]
        if not data:
            break
    return data


def places_in(tree: object, at: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """The way to every value in a tree of dicts and lists."""
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [at, *(place for key, value in inside for place in places_in(value, (*at, key)))]


def damaged_tree(tree: object, chance: random.Random) -> object:
    """A few values replaced, taken out, given another name, or put inside each other."""
    tree = copy.deepcopy(tree)
    for _ in range(chance.randint(1, 3)):
        *way, last = chance.choice(places_in(tree)[1:] or [("nothing",)])
        holder = tree
        for key in way:
            holder = holder[key]
        if not isinstance(holder, dict | list) or last == "nothing":
            return chance.choice(STRANGE)
        match chance.randrange(5):
            case 0:
                del holder[last]
            case 1 if isinstance(holder, dict):
                holder[f"{last}x"] = holder.pop(last)
            case 2:
                holder[last] = copy.deepcopy(tree)
            case 3 if isinstance(holder, list):
                holder.extend(copy.deepcopy(holder[:50]))
            case _:
                holder[last] = copy.deepcopy(chance.choice(STRANGE))
    return tree


def as_json(tree: object) -> bytes:
    return json.dumps(tree).encode("utf-8", "surrogatepass")


def reads_or_says_why(read, path):
    """Call a reader; what it raises must be an InputError of printable sentences. Return what it read, or None."""
    try:
        return read(path)
    except InputError as error:
        found = error
    assert found.problems
    assert all(problem.message and "\n" not in problem.message for problem in found.problems)
    assert str(found).encode("utf-8")
    return None


def values_of(mission: Mission) -> str:
    """All values of all items; NaN is like NaN, and -0 like 0."""
    rows = [
        (i.command, i.frame, *i.params, i.lat_e7, i.lon_e7, i.alt_m, i.autocontinue) for i in mission.items
    ]
    return repr([[value + 0.0 for value in row] for row in rows])


def look_at(path: Path) -> None:
    mission = reads_or_says_why(read_mission, path)
    reads_or_says_why(reader_problems, path)
    if mission is not None:  # then it can be written again, and comes back the same
        assert isinstance(mission, Mission)
        again = path.with_name("again.plan")
        if reads_or_says_why(lambda to: write_mission(mission, to), again) is not None:
            assert values_of(read_mission(again)) == values_of(mission)


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """A mission with a fence and rally points in both formats, and a plan beside it."""
    from tests.link.fenced import fenced

    folder = tmp_path_factory.mktemp("fuzz")
    mission = fenced("ardupilot", 3)
    for suffix in (".plan", ".waypoints"):
        write_mission(mission, folder / f"good{suffix}")
    (folder / "good.mavplan.json").write_text('{"autopilot": "ardupilot", "stops": [{"items": [1, 2]}]}')
    return folder


@SUFFIXES
@FUZZ
@given(data=st.binary(max_size=400))
def test_any_bytes_as_a_mission(files, suffix, data):
    path = files / f"any{suffix}"
    path.write_bytes(data)
    look_at(path)


@SUFFIXES
@FUZZ
@given(seed=st.integers(0, 2**32))
def test_a_mission_file_damaged_in_its_bytes(files, suffix, seed):
    path = files / f"bytes{suffix}"
    path.write_bytes(damaged_bytes((files / f"good{suffix}").read_bytes(), random.Random(seed)))
    look_at(path)


@FUZZ
@given(seed=st.integers(0, 2**32))
def test_a_plan_damaged_in_its_values(files, seed):
    path = files / "values.plan"
    path.write_bytes(
        as_json(damaged_tree(json.loads((files / "good.plan").read_bytes()), random.Random(seed)))
    )
    look_at(path)


@FUZZ
@given(seed=st.integers(0, 2**32))
def test_waypoints_damaged_in_their_values(files, seed):
    chance = random.Random(seed)
    lines = [line.split("\t") for line in (files / "good.waypoints").read_text().splitlines()]
    for _ in range(chance.randint(1, 3)):
        row = chance.choice(lines)
        row[chance.randrange(len(row))] = str(chance.choice(STRANGE))
    path = files / "values.waypoints"
    path.write_bytes("\n".join("\t".join(line) for line in lines).encode("utf-8", "surrogatepass"))
    look_at(path)


def reported() -> UploadReport:
    return UploadReport(1, "px4", Address(1, 1), None, 7, 1.0, 2.0, 1, 1, ())


def look_beside(mission_file: Path) -> None:
    """The plan beside a mission only adds to it: whatever is in it, the mission can be read and the upload told."""
    assert read_known_mission(mission_file).items
    assert isinstance(remembered_vehicle(mission_file), dict)
    assert all(problem.severity == "warning" for problem in remember_vehicle(mission_file, reported()))
    assert isinstance(remembered_vehicle(mission_file), dict)


@FUZZ
@given(seed=st.integers(0, 2**32), of_values=st.booleans())
def test_a_damaged_plan_beside_a_mission_does_not_keep_it_from_being_read(files, seed, of_values):
    chance, good = random.Random(seed), (files / "good.mavplan.json").read_bytes()
    mission_file = files / "beside.waypoints"
    mission_file.write_bytes((files / "good.waypoints").read_bytes())
    damaged = as_json(damaged_tree(json.loads(good), chance)) if of_values else damaged_bytes(good, chance)
    plan_path(mission_file).write_bytes(damaged)
    look_beside(mission_file)


@pytest.mark.parametrize(
    "text",
    [
        b'{"autopilot": []}',
        b'{"autopilot": {}}',
        b"[" * 100_000,
        b'{"a":' * 100_000,
        b'{"name": "\\ud800"}',
        b'{"vehicle": 3}',
        b"\xff\xfe",
        b"9" * 5000,
    ],
    ids=["list", "object", "deep", "deep-object", "half-a-character", "number", "utf-16", "digits"],
)
def test_a_strange_plan_beside_a_mission_does_not_keep_it_from_being_read(files, text):
    mission_file = files / "strange.waypoints"
    mission_file.write_bytes((files / "good.waypoints").read_bytes())
    plan_path(mission_file).write_bytes(text)
    look_beside(mission_file)


@pytest.fixture
def desk(tmp_path) -> Path:
    """The valley's scenario and users, and the same users as GeoJSON."""
    for name in ("scenario.toml", "users.csv"):
        (tmp_path / name).write_bytes((VALLEY / name).read_bytes())
    return tmp_path


FENCED = b"""
[fence]
margin_m = 5.0
[[fence.inclusion]]
vertices = [{lat_deg = 46.57, lon_deg = 7.89}, {lat_deg = 46.61, lon_deg = 7.89}, {lat_deg = 46.60, lon_deg = 7.93}]
[[rally]]
lat_deg = 46.5831
lon_deg = 7.9099
alt_rel_m = 60.0
"""


@FUZZ
@given(seed=st.integers(0, 2**32))
def test_a_scenario_damaged_in_its_bytes(desk, seed):
    good = (VALLEY / "scenario.toml").read_bytes() + FENCED
    (desk / "scenario.toml").write_bytes(damaged_bytes(good, random.Random(seed)))
    reads_or_says_why(load_scenario, desk / "scenario.toml")


@FUZZ
@given(seed=st.integers(0, 2**32))
def test_users_damaged_in_their_bytes(desk, seed):
    (desk / "users.csv").write_bytes(damaged_bytes((VALLEY / "users.csv").read_bytes(), random.Random(seed)))
    reads_or_says_why(load_scenario, desk / "scenario.toml")


def geojson() -> dict[str, object]:
    """The valley's users as a FeatureCollection."""
    header, *rows = (line.split(",") for line in (VALLEY / "users.csv").read_text().splitlines())
    users = [dict(zip(header, row, strict=True)) for row in rows]
    return {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "properties": {"name": user["name"], "demand_mbit": float(user["demand_mbit"] or 1)},
                "geometry": {
                    "type": "Point",
                    "coordinates": [float(user["lon_deg"]), float(user["lat_deg"])],
                },
            }
            for user in users
        ],
    }


@FUZZ
@given(seed=st.integers(0, 2**32), of_values=st.booleans())
def test_geojson_users_damaged_in_their_values_and_bytes(desk, seed, of_values):
    chance, good = random.Random(seed), geojson()
    damaged = as_json(damaged_tree(good, chance)) if of_values else damaged_bytes(as_json(good), chance)
    (desk / "users.geojson").write_bytes(damaged)
    text = (
        (VALLEY / "scenario.toml")
        .read_text()
        .replace("users.csv", "users.geojson")
        .replace('"given"', '"auto"')
    )
    (desk / "scenario.toml").write_text(text)
    reads_or_says_why(load_scenario, desk / "scenario.toml")
