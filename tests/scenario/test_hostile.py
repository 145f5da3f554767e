"""Whatever bytes stand in either file: a scenario or one InputError that can be printed, never anything else."""

import json

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.scenario import load_scenario

from .conftest import HOME

EASY = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

SCENARIO_WORDS = st.sampled_from(
    [
        "users",
        "=",
        '"users.csv"',
        "\n",
        "[home]",
        "[radio]",
        "[[d2d]]",
        "lat_deg",
        "bandwidth_hz",
        "1e400",
        "nan",
        "-1",
        "x",
        "{",
        "}",
        "[",
        "]",
        ".",
        ",",
        "'",
        '"""',
        "2020-01-01",
        "true",
        "[columns]",
        "name",
        "\x00",
        "\u202e",
        "0x1",
        "clusters",
    ]
)
CSV_WORDS = st.sampled_from(
    [
        "name",
        "lat_deg",
        "lon_deg",
        "pair",
        ",",
        ";",
        "\t",
        "\n",
        "\r",
        '"',
        "46.5",
        "7.5",
        "nan",
        "1e999",
        "",
        "\x00",
        "\ufeff",
        "'",
        "x",
        "-",
        "91",
        "demand_mbit",
        " ",
        "\u2028",
        "\x1b",
    ]
)
JSON_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=6)
    | st.sampled_from(["Point", "Feature", "FeatureCollection", "MultiPoint", 46.5, 7.5, "46.5", 10**320]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                [
                    "type",
                    "features",
                    "geometry",
                    "properties",
                    "coordinates",
                    "crs",
                    "name",
                    "demand_mbit",
                    "pair",
                ]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


def read(path):
    problems = ()
    try:
        scenario = load_scenario(path)
    except InputError as error:
        problems = error.problems
    else:
        assert len(scenario.users) >= 1
        for name in scenario.users.names:
            name.encode()
        return
    assert problems
    for problem in problems:
        assert problem.severity == "error"
        assert problem.message
        str(problem).encode()


@EASY
@given(st.binary(max_size=300) | st.lists(SCENARIO_WORDS, max_size=30).map(lambda w: " ".join(w).encode()))
def test_any_bytes_as_a_scenario(desk, data):
    """Random bytes and scrambled TOML."""
    read(desk.write(toml=data))


@EASY
@given(st.binary(max_size=300) | st.lists(CSV_WORDS, max_size=60).map(lambda w: "".join(w).encode()))
def test_any_bytes_as_a_csv(desk, data):
    """Random bytes and scrambled CSV."""
    read(desk.write(data))


@EASY
@given(st.lists(st.lists(CSV_WORDS, min_size=4, max_size=4), max_size=5))
def test_any_cells_under_a_good_header(desk, rows):
    """Every row has its four cells, whatever is in them."""
    cells = "\n".join(",".join(json.dumps(cell) for cell in row) for row in rows)
    read(desk.write(f"name,lat_deg,lon_deg,pair\n{cells}\n"))


@EASY
@given(st.binary(max_size=200) | JSON_VALUES.map(lambda value: json.dumps(value).encode()))
def test_any_bytes_as_geojson(desk, data):
    """Random bytes and any JSON with GeoJSON's words in it."""
    read(desk.write(data, name="users.geojson"))


@EASY
@given(
    st.lists(
        st.fixed_dictionaries(
            {"type": st.just("Feature"), "geometry": JSON_VALUES, "properties": JSON_VALUES}
        ),
        max_size=3,
    )
)
def test_any_features_in_a_good_collection(desk, features):
    """Any geometry and any properties."""
    read(desk.write(json.dumps({"type": "FeatureCollection", "features": features}), name="users.geojson"))


@EASY
@given(
    st.sampled_from(["home", "columns", "radio", "d2d", "vehicle", "service", "planner", "fence", "x"]),
    st.text(st.characters(codec="utf-8", exclude_characters="\r\n"), max_size=8),
    st.sampled_from(
        [
            "1",
            "-1",
            "nan",
            "inf",
            "'a'",
            "true",
            "[]",
            "{}",
            "1e308",
            "9" * 400,
            "2020-01-01T00:00:00Z",
            "[[1]]",
        ]
    ),
)
def test_any_key_in_any_section(desk, section, key, value):
    """Quoted keys of any characters with values of every type."""
    read(
        desk.write(toml=f"[{section}]\n{json.dumps(key)} = {value}\n", home="" if section == "home" else HOME)
    )
