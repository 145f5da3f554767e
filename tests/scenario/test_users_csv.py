"""Users from CSV: what is taken, and each thing that can be wrong in a row."""

import pytest

HEAD = "name,lat_deg,lon_deg,demand_mbit,pair\n"


def test_columns_of_any_name_order_and_number_are_mapped(desk):
    """A file as its owner keeps it, with other columns in between, is usable as it is."""
    users = 'ID,Breite,Länge,Bemerkung,Bedarf\nHütte,46.501,7.502,"a, b",3.5\n'
    toml = '[columns]\nname = "ID"\nlat_deg = "Breite"\nlon_deg = "Länge"\ndemand_mbit = "Bedarf"\n'
    loaded = desk.load(users, toml).users
    assert loaded.names == ("Hütte",)
    assert (loaded.lat_deg[0], loaded.lon_deg[0], loaded.demand_bit[0]) == (46.501, 7.502, 3.5e6)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_the_header_shows_the_delimiter(desk, delimiter, newline):
    """Comma, semicolon and tab, with any line end, blank lines anywhere."""
    rows = ["", "name,lat_deg,lon_deg", "Anna,46.501,7.501", ",,", "", "Ben,46.502,7.502", ""]
    text = newline.join(rows).replace(",", delimiter)
    assert desk.load(text).users.names == ("Anna", "Ben")


def test_names_are_found_whatever_their_case_and_tidied(desk):
    """`Name` is `name`; surplus white space goes."""
    assert desk.load("LAT_DEG, Name ,Lon_Deg\n46.5,  Anna   Berg ,7.5\n").users.names == ("Anna Berg",)


def test_users_without_names_are_numbered(desk):
    """Without the column all of them, with an empty cell that one."""
    assert desk.load("lat_deg,lon_deg\n46.5,7.5\n46.5,7.5\n").users.names == ("user-1", "user-2")
    assert desk.load("name,lat_deg,lon_deg\nAnna,46.5,7.5\n,46.5,7.5\n").users.names == ("Anna", "user-2")


def test_an_empty_demand_is_the_default_and_said(desk):
    """Who brings none, and what is taken."""
    scenario = desk.load(HEAD + "A,46.5,7.5,4,\nB,46.5,7.5, ,\n", "[service]\ndemand_mbit = 7\n")
    assert scenario.users.demand_bit.tolist() == [4e6, 7e6]
    (warning,) = scenario.warnings
    assert "B: [service] demand_mbit is taken, 7 Mbit" in warning.message


@pytest.mark.parametrize("text", ["46.5", "+46.5", " 46.5 ", "046.50", "4.65e1", "46.5e0"])
def test_plain_decimal_numbers_are_taken(desk, text):
    """With sign, zeros, exponent or blanks round them."""
    assert desk.load(f"name,lat_deg,lon_deg\nA,{text},7.5\n").users.lat_deg[0] == 46.5


@pytest.mark.parametrize(
    ("row", "code", "words"),
    [
        (
            "A,91,7.5,1,",
            "out-of-range",
            'column lat_deg: found "91"; allowed is a number from -90 to 90 (degrees)',
        ),
        ("A,-90.0001,7.5,1,", "out-of-range", 'found "-90.0001"'),
        (
            "A,46.5,181,1,",
            "out-of-range",
            'column lon_deg: found "181"; allowed is a number from -180 to 180',
        ),
        ("A,nan,7.5,1,", "out-of-range", 'column lat_deg: found "nan"'),
        ("A,46.5,-inf,1,", "out-of-range", 'column lon_deg: found "-inf"'),
        ("A,46.5,7.5,1e999,", "out-of-range", 'column demand_mbit: found "1e999"'),
        ("A,46.5,7.5,-0.1,", "out-of-range", 'column demand_mbit: found "-0.1"; allowed is a number from 0'),
        ("A,north,7.5,1,", "out-of-range", 'found "north", which is not a plain decimal number'),
        ("A,46.5 north,7.5,1,", "out-of-range", "which is not a plain decimal number"),
        ("A,4_6,7.5,1,", "out-of-range", "which is not a plain decimal number"),
        ("A,0x2e,7.5,1,", "out-of-range", "which is not a plain decimal number"),
        ("A,٤٦,7.5,1,", "out-of-range", "which is not a plain decimal number"),
        ('A,"46,5",7.5,1,', "out-of-range", 'found "46,5", a decimal comma; write a point: 46.5'),
        ("A,,7.5,1,", "missing-value", "column lat_deg: nothing stands there"),
        (
            "A,46,5,7,5,1,",
            "cell-count",
            "found 7 cells; the header has 5 columns; numbers take a decimal point",
        ),
        ("46.5,7.5,1,", "cell-count", "found 4 cells; the header has 5 columns"),
        ('A,"46.5,7.5,1,', "syntax", "is not valid CSV"),
        ("A,46.5,7.5,1,p", "unmatched-pair", 'the pair id "p" stands there once (in line 2)'),
        ("A\x00,46.5,7.5,1,", "bad-text", "with characters that cannot be written"),
        ("A\x1b[31m,46.5,7.5,1,", "bad-text", "with characters that cannot be written"),
    ],
)
def test_a_bad_row_is_named_with_line_column_and_value(desk, row, code, words):
    """One fault, one sentence."""
    found_code, text = desk.only_problem(HEAD + row + "\n")
    assert found_code == code
    assert text.startswith("users.csv, line 2")
    assert words in text
    assert text.isprintable()


def test_lines_are_counted_as_an_editor_counts_them(desk):
    """Quoted line breaks and blank lines before the fault do not shift its number."""
    users = 'name,lat_deg,lon_deg\n"A\nB",46.5,7.5\n\nC,99,7.5\n'
    assert desk.only_problem(users)[1].startswith("users.csv, line 5, column lat_deg")


@pytest.mark.parametrize(
    ("users", "words"),
    [
        ("", "users.csv: is empty; a header line and a user a line are expected"),
        ("\n\n ,,\n", "users.csv: is empty"),
        (HEAD, "users.csv: holds no users; at least one is needed"),
        ("name,name,lat_deg,lon_deg\n", "users.csv, line 1: the column name is there twice"),
        (
            "name,lat,lon_deg\nA,46.5,7.5\n",
            "users.csv: there is no column lat_deg; those there: name, lat, lon_deg; nearest is lat; "
            "if another holds it, say which in [columns] lat_deg",
        ),
        (
            "lat_deg,lon_deg,Name,NAME\n46.5,7.5,A,B\n",
            "Name, NAME could all be name: say which in [columns] name",
        ),
        ("name,lat_deg,lon_deg\nÄ,46.5,7.5\n".encode("latin-1"), "users.csv, line 2: byte 0xc4 is not UTF-8"),
        ("name,lat_deg,lon_deg\n".encode("utf-16"), "it looks like UTF-16"),
    ],
)
def test_a_file_that_is_no_list_of_users_is_refused(desk, users, words):
    """Empty, without rows, without a column, in another encoding."""
    assert words in desk.only_problem(users)[1]


def test_an_empty_users_file_is_said_though_the_scenario_has_faults_too(desk):
    """One file's faults do not hide the other's."""
    assert [code for code, _ in desk.problems("", "[radio]\nx = 1\n")] == ["unknown-key", "empty"]


@pytest.mark.parametrize("key", ["name", "demand_mbit", "pair", "lat_deg"])
def test_a_mapped_column_must_be_there_as_it_is_spelt(desk, key):
    """Also those that could be left out: whoever maps one means it."""
    users = "Nome,lat_deg,lon_deg\nA,46.5,7.5\n"
    code, text = desk.only_problem(users, f'[columns]\n{key} = "nome"\n')
    assert code == "missing-column"
    assert (
        f"there is no column nome, which [columns] {key} names; those there: Nome, lat_deg, lon_deg" in text
    )
    assert "nearest is Nome" in text


def test_given_pairs_need_a_pair_column(desk):
    """`given` without the column is an error; `none` and `auto` do not look at it."""
    users = "name,lat_deg,lon_deg\nA,46.5,7.5\n"
    assert desk.only_problem(users, "[d2d]\nmatching = 'given'\n")[0] == "missing-column"
    lonely = "name,lat_deg,lon_deg,pair\nA,46.5,7.5,x\n"
    for matching in ("none", "auto"):
        assert len(desk.load(lonely, f"[d2d]\nmatching = '{matching}'\n").users) == 1


def test_a_pair_is_exactly_two(desk):
    """Three with the same id are named with their lines; empty cells are nobody's pair."""
    rows = "A,46.5,7.5,1,t\nB,46.5,7.5,1,t\nC,46.5,7.5,1,t\nD,46.5,7.5,1,\nE,46.5,7.5,1,\n"
    text = desk.only_problem(HEAD + rows)[1]
    assert 'the pair id "t" stands there 3 times (in lines 2, 3, 4); a pair is exactly two users' in text


def test_duplicate_names_are_named_with_both_lines(desk):
    """A generated name counts too."""
    text = desk.only_problem("name,lat_deg,lon_deg\nuser-2,46.5,7.5\n,46.5,7.5\n")[1]
    assert text == 'users.csv, line 3, column name: found "user-2", the name of line 2 too; names must differ'


def test_a_users_file_that_is_too_large_is_not_read(desk, monkeypatch):
    """The size is checked before the content."""
    monkeypatch.setattr("mavplan.scenario.users.MAX_BYTES", 10)
    assert "at most 10 are read" in desk.only_problem()[1]
