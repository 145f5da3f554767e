"""scenario.toml: what is read, and each thing that can be wrong with it."""

import numpy as np
import pytest

from mavplan.errors import InputError
from mavplan.scenario import UNPAIRED, Scenario, load_scenario

from .conftest import HOME

OK = "name,lat_deg,lon_deg\nAnna,46.501,7.501\n"


def test_a_scenario_of_users_and_home_takes_every_default(desk):
    """Only users and [home] are needed; the rest is the stand-in radio at 1 MHz, H 100 m and 10 Mbit a user."""
    scenario = desk.load()
    assert isinstance(scenario, Scenario)
    assert scenario.users.names == ("Anna", "Ben")
    assert scenario.radio.bandwidth_hz == 1e6
    assert scenario.vehicle.altitude_m == 100
    assert scenario.users.demand_bit.tolist() == [10e6, 10e6]
    assert scenario.d2d.matching == "none"
    assert scenario.users.mate.tolist() == [UNPAIRED, UNPAIRED]
    assert scenario.warnings == ()
    # 0.001 degrees of latitude at 46.5 degrees are 111.2 m, of longitude 76.8 m
    assert scenario.users.xy_m[0] == pytest.approx([76.76, 111.16], abs=0.05)


def test_every_section_is_read(desk):
    """A key of each section arrives where it belongs."""
    scenario = desk.load(
        toml="""
[radio]
tx_power_dbm = 17
[d2d]
range_m = 50.5
[vehicle]
autopilot = "px4"
acceleration_m_s2 = 0
[service]
mode = "tdma"
demand_mbit = 3
[planner]
clusters = 4
seed = 7
"""
    )
    assert scenario.radio.tx_power_dbm == 17
    assert scenario.d2d.range_m == 50.5
    assert (scenario.vehicle.autopilot, scenario.vehicle.acceleration_m_s2) == ("px4", 0)
    assert scenario.service.mode == "tdma"
    assert scenario.users.demand_bit.tolist() == [3e6, 3e6]
    assert (scenario.planner.clusters, scenario.planner.seed) == (4, 7)


def test_the_users_file_stands_relative_to_the_scenario(desk, monkeypatch, tmp_path):
    """The present folder does not matter."""
    path = desk.write()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert len(load_scenario(path).users) == 2


@pytest.mark.parametrize(
    ("toml", "code", "words"),
    [
        (
            "[radio]\nbandwidth_hz = 0",
            "out-of-range",
            "[radio] bandwidth_hz: found 0; allowed is a number above 0 (Hz)",
        ),
        ("[radio]\nbandwidth_hz = -1.5", "out-of-range", "found -1.5"),
        ("[radio]\nbandwidth_hz = inf", "out-of-range", "found inf"),
        ("[radio]\nnoise_dbm = nan", "out-of-range", "[radio] noise_dbm: found nan"),
        ('[radio]\nbandwidth_hz = "1e6"', "out-of-range", 'found "1e6"; allowed is a number above 0'),
        ("[radio]\nbandwidth_hz = true", "out-of-range", "found true"),
        ("[radio]\nbandwidth_hz = [1]", "out-of-range", "found a list"),
        ("[radio]\nbandwidth_hz = {a = 1}", "out-of-range", "found a table"),
        ("[radio]\nbandwidth_hz = 2020-01-01", "out-of-range", "found 2020-01-01"),
        (f"[radio]\ntx_power_dbm = 1{'0' * 400}", "out-of-range", "found a number of more than sixty digits"),
        (
            "[radio]\nbandwith_hz = 1e6",
            "unknown-key",
            "[radio] bandwith_hz: is not known; nearest is bandwidth_hz",
        ),
        ("[radio]\nspeed_m_s = 5", "unknown-key", "[radio] speed_m_s: is not known; it belongs in [vehicle]"),
        ("[radio]\nqqqq = 5", "unknown-key", "known are tx_power_dbm, ref_gain_db, noise_dbm"),
        ("[vehicel]\nspeed_m_s = 5", "unknown-key", "vehicel: is not known; nearest is vehicle"),
        ("[d2d]\nmatching = 'all'", "out-of-range", 'found "all"; allowed is "auto" or "given" or "none"'),
        ("[vehicle]\nend = 'RTL'", "out-of-range", 'found "RTL"; allowed is "rtl" or "land" or "stay"'),
        ("[vehicle]\nspeed_m_s = 51", "out-of-range", "a number above 0 and at most 50 (m/s)"),
        ("[vehicle]\nreserve_fraction = 1", "out-of-range", "of at least 0 and below 1"),
        ("[planner]\nclusters = 0", "out-of-range", 'a whole number of at least 1, or "auto"'),
        ("[planner]\nclusters = 'many'", "out-of-range", 'found "many"'),
        ("[planner]\nclusters = 2.5", "out-of-range", "found 2.5"),
        ("[planner]\nseed = -1", "out-of-range", "found -1"),
        ("[planner]\nname = 'TLOAIC'", "unknown-planner", 'found "TLOAIC"; allowed is one of tloaik'),
        ("[planner]\nname = 'TLOAIC'", "unknown-planner", "nearest is tloaik"),
        ("[planner]\nname = 3", "out-of-range", "found 3; allowed is text"),
        ("[columns]\nname = 3", "out-of-range", "[columns] name: found 3; allowed is text"),
        ("[[radio]]\nbandwidth_hz = 1", "wrong-type", "a list of tables; allowed is one table [radio]"),
        ("[service]\ndemand_mbit = -1", "out-of-range", "[service] demand_mbit: found -1"),
    ],
)
def test_a_bad_value_is_named_with_its_place_and_what_is_allowed(desk, toml, code, words):
    """One sentence: file, section, key, value, what is allowed; nothing of the validating library shows."""
    found_code, text = desk.only_problem(OK, toml)
    assert found_code == code
    assert text.startswith("scenario.toml, ")
    assert words in text
    assert "pydantic" not in text.lower()
    assert "http" not in text
    assert "input" not in text


@pytest.mark.parametrize(
    ("home", "words"),
    [
        ("", "scenario.toml: [home] is missing; it needs lat_deg, lon_deg and alt_amsl_m"),
        ("home = 3", "scenario.toml, home: found 3; allowed is one table [home]"),
        (
            HOME.replace("46.5", "91"),
            "[home] lat_deg: found 91; allowed is a number from -90 to 90 (degrees)",
        ),
        (
            HOME.replace("7.5", "-180.01"),
            "[home] lon_deg: found -180.01; allowed is a number from -180 to 180",
        ),
        (
            "[home]\nlat_deg=46.5\nlon_deg=7.5",
            "[home] alt_amsl_m: is missing; needed is a number from -500 to 9,000",
        ),
    ],
)
def test_home_must_be_whole(desk, home, words):
    """Each way in which [home] can be wrong."""
    assert words in desk.only_problem(OK, home=home)[1]


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        (b"users = users.csv", "scenario.toml, line 1: is not valid TOML: Invalid value (column 9)"),
        (b"users = 'u.csv'\n[home\n", "scenario.toml, line 2: is not valid TOML"),
        (b"a = 1\na = 2\n", "Cannot overwrite a value"),
        (b"\xff\xfeu\x00", "scenario.toml, line 1: byte 0xff is not UTF-8; it looks like UTF-16"),
        (b"a = 1\nb = '\xe9'\n", "scenario.toml, line 2: byte 0xe9 is not UTF-8"),
        (b"x = " + b"[" * 10_000, "scenario.toml: is not TOML that can be read"),
        (b"x = 1" + b"0" * 5000, "scenario.toml: is not TOML that can be read"),
        (b"#" * (1024 * 1024 + 1), "has 1,048,577 bytes; at most 1,048,576 are read"),
    ],
)
def test_a_file_that_is_no_toml_is_said_with_its_line(desk, toml, words):
    """Syntax, encoding and size."""
    assert words in desk.only_problem(OK, toml)[1]


def test_a_byte_order_mark_is_no_problem(desk):
    """Editors on Windows put one in front."""
    text = f'users = "users.csv"\n{HOME}'.encode("utf-8-sig")
    assert len(desk.load(OK.encode("utf-8-sig"), text).users) == 1


def test_a_missing_scenario_or_folder_is_said(desk, tmp_path):
    """No traceback for a path with nothing, or a folder, behind it."""
    for path, words in (
        (tmp_path / "none.toml", "there is no such file"),
        (tmp_path, "is a folder, not a file"),
    ):
        with pytest.raises(InputError, match=words):
            load_scenario(path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "users is missing; name the users file"),
        ("users = 3", "users: found 3; allowed is the name of a file"),
        ('users = " "', "users: found"),
        ('users = "none.csv"', "none.csv: there is no such file"),
        ('users = "."', "is a folder, not a file"),
        ('users = "users.xlsx"', "there is no such file"),
        ('users = "https://example.org/users.csv"', "it names a file on this machine: nothing is fetched"),
        ('users = "/vsizip/users.zip"', "it names a file on this machine: nothing is fetched"),
        ('users = "a\\u0000b.csv"', "is no name that a file can have"),
    ],
)
def test_the_users_file_must_be_named_and_there(desk, line, words):
    """Each way in which the users file can be missing."""
    assert words in desk.only_problem(None, f"{line}\n{HOME}".encode())[1]


def test_a_terrain_without_a_file_is_an_error_and_an_empty_table_none(desk):
    """Whoever gives a clearance must not believe that it is kept."""
    assert desk.load(toml="[terrain]\n").terrain is None
    code, text = desk.only_problem(OK, "[terrain]\nclearance_m = 40.0\n")
    assert code == "missing-key"
    assert "[terrain] file: is missing; name the terrain" in text


def test_a_battery_needs_a_mass_and_a_mass_no_battery(desk):
    """Of a battery alone nobody could say what is left in it."""
    code, text = desk.only_problem(OK, "[vehicle]\nbattery_wh = 99.0\n")
    assert code == "missing-key"
    assert "[vehicle] mass_kg: is missing; battery_wh needs the take-off mass (kg)" in text
    assert desk.load(OK, "[vehicle]\nbattery_wh = 99.0\nmass_kg = 2.0\n").warnings == ()
    assert desk.load(OK, "[vehicle]\nmass_kg = 2.0\n").warnings == ()


def test_an_altitude_without_coverage_names_the_one_below_which_there_is_some(desk):
    """(γ0/γ_th)^(1/α) by hand: 20 − 70 + 105.3045 − 3 = 52.3045 dB, 10^(5.23045/2) = 412.3 m, less 1 m of drift."""
    code, text = desk.only_problem(OK, "[vehicle]\naltitude_m = 411.4\n")
    assert code == "no-coverage"
    assert "[vehicle] altitude_m: found 411.4" in text
    assert "positive only below 411.3 m" in text
    assert desk.load(OK, "[vehicle]\naltitude_m = 411.2\n").vehicle.altitude_m == 411.2
    exact = "[vehicle]\naltitude_m = 412.2\nposition_error_m = 0\n"
    assert desk.load(OK, exact).vehicle.altitude_m == 412.2


def test_users_beyond_100_km_are_refused_with_their_distance(desk):
    """0.9 degrees of latitude are 100.06 km at 46.5 degrees north."""
    code, text = desk.only_problem("name,lat_deg,lon_deg\nFar,47.4,7.5\nNear,47.398,7.5\n")
    assert code == "too-far"
    assert text.startswith("users.csv, line 2: Far is 100.1 km from home; at most 100 km is allowed")


def test_swapped_coordinates_are_guessed(desk):
    """The commonest slip is named where it would explain the distance."""
    text = desk.only_problem("name,lat_deg,lon_deg\nFar,7.5,46.5\n")[1]
    assert "are latitude and longitude the wrong way round?" in text


@pytest.mark.parametrize(
    ("vehicle", "farthest_m"),
    [
        ("endurance_s = 500\nreserve_fraction = 0.2", 2000 + 400),
        ("endurance_s = 500\nreserve_fraction = 0", 2500 + 400),
        ("endurance_s = 500\nreserve_fraction = 0.2\nspeed_m_s = 5", 1000 + 400),
        ("endurance_s = 500\nreserve_fraction = 0.2\nend = 'land'", 4000 + 400),
        ("endurance_s = 500\nreserve_fraction = 0.2\nend = 'stay'", 4000 + 400),
        ("endurance_s = 500\nreserve_fraction = 0.2\n[d2d]\nmatching = 'auto'", 2000 + 400 + 200),
    ],
)
def test_endurance_limits_how_far_users_can_be(desk, vehicle, farthest_m):
    """Out and back at full speed on what the reserve leaves, and the coverage radius (400 m) beyond."""
    north_deg = [(farthest_m + more) / 111_170 for more in (-20, 20)]  # metres in a degree at 46.5 north
    users = "name,lat_deg,lon_deg\n" + "".join(
        f"{name},{46.5 + d:.6f},7.5\n" for name, d in zip(("Near", "Far"), north_deg, strict=True)
    )
    code, text = desk.only_problem(users, f"[vehicle]\nposition_error_m = 0\n{vehicle}\n")
    assert code == "beyond-endurance"
    assert text.startswith("users.csv, line 3: Far is ")
    assert f"{farthest_m:,} m in all" in text


def test_a_mate_within_reach_is_enough(desk):
    """The far member of a pair is served through the near one."""
    users = "name,lat_deg,lon_deg,pair\nNear,46.5210,7.5,a\nFar,46.5225,7.5,a\n"
    toml = "[vehicle]\nendurance_s = 500\nreserve_fraction = 0.2\n"
    assert desk.load(users, toml).users.mate.tolist() == [1, 0]
    assert desk.only_problem(users, toml + "[d2d]\nmatching = 'none'\n")[0] == "beyond-endurance"


@pytest.mark.parametrize(
    ("lat_deg", "vehicle", "words"),
    [
        (48.5, "", "all 4 users are 222.4 to 222.7 km from here; at most 100 km is allowed: is home right?"),
        (
            46.9,
            "endurance_s = 500",
            "all 4 users are 44.5 to 44.8 km from here; [vehicle] endurance_s = 500 less",
        ),
    ],
)
def test_where_everybody_is_too_far_home_is_asked_about_once(desk, lat_deg, vehicle, words):
    rows = "".join(f"u{i},{lat_deg + i / 1000},7.5\n" for i in range(4))
    code, text = desk.only_problem(f"name,lat_deg,lon_deg\n{rows}", f"[vehicle]\n{vehicle}\n")
    assert code == "too-far"
    assert text.startswith(f"scenario.toml, [home]: {words}")


def test_keys_in_a_misspelt_table_are_looked_at_too(desk):
    found = [text for _, text in desk.problems(OK, "[vehicel]\nendurence_s = 5\nspeed_m_s = 8\n")]
    assert found == [
        "scenario.toml, vehicel: is not known; nearest is vehicle",
        "scenario.toml, [vehicel] endurence_s: is not known; nearest is endurance_s",
    ]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("altitude_m = 47,3080", "a decimal comma? write 47.3080"),
        ("altitude_m = 100 m", "a number stands without its unit: write 100"),
        ("altitude_m = 100m # above home", "a number stands without its unit: write 100"),
        ("end = rtl", "a word stands in quotation marks"),
    ],
)
def test_a_slip_that_is_no_toml_is_told_in_words(desk, line, words):
    code, text = desk.only_problem(OK, f"[vehicle]\n{line}\n")
    assert code == "syntax"
    assert text.endswith(f"; {words}")


@pytest.mark.parametrize(("name", "words"), [("u.kml", "holds users"), ("m.plan", "is a mission")])
def test_another_kind_of_file_is_told_for_what_it_is(tmp_path, name, words):
    (tmp_path / name).write_text("<kml/>")
    with pytest.raises(InputError, match=f"{words}, not a scenario"):
        load_scenario(tmp_path / name)


def test_all_faults_of_both_files_come_in_one_report(desk):
    """Ten faults, ten sentences, one error."""
    found = desk.problems(
        "name,lat_deg,lon_deg,demand_mbit,pair\nA,91,7.5,1,x\nA,46.5,nan,1,\nB,46.5,7.5,-4,\nC,12,7.5,1,\n",
        "homme = 1\n[radio]\nbandwith_hz = 1\n[vehicle]\naltitude_m = 9000\nend = 'x'\n[planner]\nclusters = -1\n",
        home="[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 9999\n",
    )
    text = "\n".join(line for _, line in found)
    for words in (
        "[home] alt_amsl_m: found 9999",
        "[home] homme: is not known",
        "[radio] bandwith_hz: is not known; nearest is bandwidth_hz",
        '[vehicle] end: found "x"',
        "[planner] clusters: found -1",
        'line 3, column name: found "A", the name of line 2 too',
        'line 2, column lat_deg: found "91"; allowed is a number from -90 to 90 (degrees)',
        'line 3, column lon_deg: found "nan"',
        'line 4, column demand_mbit: found "-4"; allowed is a number from 0 to 1,000,000,000 (Mbit)',
        'line 2, column pair: the pair id "x" stands there once',
    ):
        assert words in text
    assert len(found) == 10


def test_faults_in_the_users_do_not_hide_an_altitude_too_high(desk):
    """What can still be checked is checked, also the distance of users whose rows are sound."""
    users = "name,lat_deg,lon_deg\nA,91,7.5\nB,12,7.5\n"
    codes = [code for code, _ in desk.problems(users, "[vehicle]\naltitude_m = 5000\n")]
    assert sorted(codes) == ["no-coverage", "out-of-range", "too-far"]


def test_thousands_of_the_same_fault_are_summed_up(desk):
    """Twenty of a kind, then how many more; another kind is not lost among them."""
    rows = "".join(f"u{i},91,7.5,1\n" for i in range(1960)) + "last,46.5,7.5,-1\n"
    found = desk.problems("name,lat_deg,lon_deg,demand_mbit\n" + rows)
    assert len(found) == 22
    assert found[20][1] == "users.csv: and 1,940 more like this"
    assert found[21][1].startswith("users.csv, line 1,962, column demand_mbit: found")


def test_pairs_are_matched_as_asked(desk):
    """given, auto and none on the same four users; without [d2d] the pair column decides."""
    users = "name,lat_deg,lon_deg,pair\nA,46.5,7.5,x\nB,46.5,7.501,y\nC,46.501,7.5,y\nD,46.501,7.501,x\n"
    mates = {
        toml: desk.load(users, toml).users.mate.tolist()
        for toml in ("", "[d2d]\nmatching='given'", "[d2d]\nmatching='auto'", "[d2d]\nmatching='none'")
    }
    assert mates[""] == mates["[d2d]\nmatching='given'"] == [3, 2, 1, 0]
    assert mates["[d2d]\nmatching='auto'"] == [1, 0, 3, 2]
    assert mates["[d2d]\nmatching='none'"] == [-1] * 4
    assert desk.load(users).d2d.matching == "given"


def test_a_given_pair_beyond_the_range_is_taken_apart_with_a_warning(desk):
    """Both names and the distance are said."""
    users = "name,lat_deg,lon_deg,pair\nA,46.5,7.5,x\nB,46.502,7.5,x\n"
    scenario = desk.load(users)
    assert scenario.users.mate.tolist() == [UNPAIRED, UNPAIRED]
    (warning,) = scenario.warnings
    assert "the pair A and B is 222.3 m apart, beyond the D2D range of 200 m" in warning.message
    assert desk.load(users, "[d2d]\nrange_m = 223").users.mate.tolist() == [1, 0]


def test_the_arrays_have_the_types_that_planners_expect(desk):
    """float64 and int64, (N,) and (N, 2)."""
    users = desk.load().users
    assert users.xy_m.shape == (2, 2)
    for array in (users.xy_m, users.lat_deg, users.lon_deg, users.demand_bit):
        assert array.dtype == np.float64
    assert users.mate.dtype == np.int64


def test_a_wind_against_which_no_way_is_made_is_refused(desk):
    code, text = desk.only_problem(OK, "[wind]\nspeed_m_s = 11.0\n")
    assert code == "wind"
    assert "ardupilot makes 11.8 m/s through the air" in text
    assert desk.load(OK, "[wind]\nspeed_m_s = 6.0\nfrom_deg = 270.0\n").wind.from_deg == 270.0
