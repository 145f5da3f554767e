"""Users from KML, KMZ, GPX and XLSX: what people's programs write, and each thing that can be wrong in it."""

import contextlib
import io
import re
import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.scenario import kinds

KML_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder>'
)
KML_TAIL = "</Folder></Document></kml>"
GPX_HEAD = (
    '<?xml version="1.0"?>\n<gpx version="1.1" creator="eTrex 10" xmlns="http://www.topografix.com/GPX/1/1">'
)


def placemark(inside="<Point><coordinates>7.501,46.501,0</coordinates></Point>", name="Anna"):
    return f"<Placemark><name>{name}</name>{inside}</Placemark>"


def kml(*placemarks):
    return KML_HEAD + "".join(placemarks) + KML_TAIL


def wpt(lat="46.501", lon="7.501", inside="<name>Anna</name>"):
    return f'<wpt lat="{lat}" lon="{lon}">{inside}</wpt>'


def gpx(*parts):
    return GPX_HEAD + "".join(parts) + "</gpx>"


def zipped(entries):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return packed.getvalue()


def spoilt(packed):
    """The archive with a wrong byte in its packed data, so that a checksum fails."""
    return packed[:60] + bytes([packed[60] ^ 0xFF]) + packed[61:]


def cell(at, value):
    if isinstance(value, str):
        text = value.replace("&", "&amp;").replace("<", "&lt;")
        return f'<c r="{at}" t="inlineStr"><is><t>{text}</t></is></c>'
    return f'<c r="{at}"><v>{value}</v></c>'


def xlsx(*sheets, hidden=()):
    """A workbook by the letter of ECMA-376, as small as it can be; each sheet is a list of rows."""
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    entries = {
        "[Content_Types].xml": '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Override PartName="/xl/workbook.xml" ContentType='
        '"application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/></Types>',
        "_rels/.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        f'<Relationship Id="r" Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
    }
    listed, related = "", ""
    for number, rows in enumerate(sheets, start=1):
        state = ' state="hidden"' if number in hidden else ""
        listed += f'<sheet name="Sheet{number}" sheetId="{number}" r:id="r{number}"{state}/>'
        related += (
            f'<Relationship Id="r{number}" Type="{office}/worksheet" Target="worksheets/sheet{number}.xml"/>'
        )
        body = "".join(
            f'<row r="{n}">'
            + "".join(cell(f"{'ABCDEFGH'[c]}{n}", v) for c, v in enumerate(row) if v is not None)
            + "</row>"
            for n, row in enumerate(rows, start=1)
        )
        entries[f"xl/worksheets/sheet{number}.xml"] = (
            f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>'
        )
    entries["xl/workbook.xml"] = (
        f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>{listed}</sheets></workbook>'
    )
    entries["xl/_rels/workbook.xml.rels"] = (
        f'<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{related}</Relationships>'
    )
    return zipped(entries)


TABLE = [
    ["name", "lat_deg", "lon_deg", "demand_mbit", "pair"],
    ["Anna", 46.501, 7.501, 3.5, 7],
    ["Ben", "46.502", "7.502", None, "7"],
]


# -- what is taken ---------------------------------------------------------------------------------------------


def test_kml_placemarks_are_users_with_their_data(desk):
    """Names, extended data of both kinds, folders, a multi-geometry of one point."""
    data = '<ExtendedData><Data name="need"><value>3.5</value></Data></ExtendedData>'
    schema = '<ExtendedData><SchemaData><SimpleData name="need">4</SimpleData></SchemaData></ExtendedData>'
    point = "<MultiGeometry><Point><coordinates>\n 7.502,46.502 </coordinates></Point></MultiGeometry>"
    text = kml(
        placemark(data + "<Point><coordinates>7.501,46.501,0</coordinates></Point>"),
        placemark(schema + point, "Ben"),
    )
    users = desk.load(text, '[columns]\ndemand_mbit = "need"\n', name="users.kml").users
    assert users.names == ("Anna", "Ben")
    assert users.lat_deg.tolist() == [46.501, 46.502]
    assert users.lon_deg.tolist() == [7.501, 7.502]
    assert users.demand_bit.tolist() == [3.5e6, 4e6]


def test_kmz_is_its_one_document(desk):
    packed = zipped({"doc.kml": kml(placemark()), "files/icon.png": b"\x89PNG", "files/more.kml": "<kml/>"})
    assert desk.load(packed, name="users.kmz").users.names == ("Anna",)


def test_gpx_waypoints_are_users_and_tracks_are_passed_over_with_a_word(desk):
    scenario = desk.load(gpx(wpt(), wpt(inside="<ele>650</ele>"), "<trk><trkseg/></trk>"), name="users.gpx")
    assert scenario.users.names == ("Anna", "user-2")
    assert [problem.code for problem in scenario.warnings] == ["not-used"]
    assert "its 1 tracks are not read" in str(scenario.warnings[0])


def test_xlsx_rows_are_users_numbers_as_numbers_or_text(desk):
    scenario = desk.load(xlsx([[], *TABLE, [], ["Cleo", 46.503, 7.503]]), name="users.xlsx")
    assert scenario.users.names == ("Anna", "Ben", "Cleo")
    assert scenario.users.mate.tolist() == [1, 0, -1]
    assert scenario.users.demand_bit.tolist() == [3.5e6, 10e6, 10e6]


def test_of_several_sheets_the_first_visible_one_with_cells_is_read_and_said(desk):
    scenario = desk.load(xlsx([["secret"]], [], TABLE, [["notes"]], hidden={1}), name="users.xlsx")
    assert scenario.users.names == ("Anna", "Ben")
    assert "only its first sheet is read, Sheet3; the others are Sheet4" in str(scenario.warnings[0])


@pytest.mark.parametrize("name", ["users.csv", "users.data", "users"])
@pytest.mark.parametrize(
    "content", [kml(placemark()), gpx(wpt()), xlsx(TABLE), zipped({"doc.kml": kml(placemark())})]
)
def test_the_content_says_the_format_whatever_the_name(desk, name, content):
    scenario = desk.load(content, name=name)
    assert scenario.users.names[0] == "Anna"
    assert any("by its content" in str(problem) for problem in scenario.warnings) == (name == "users.csv")


def test_a_table_is_read_as_one_whatever_its_ending(desk):
    assert desk.load("name,lat_deg,lon_deg\nAnna,46.5,7.5\n", name="users.tsv").users.names == ("Anna",)
    assert desk.load("name,lat_deg,lon_deg\nAnna,46.5,7.5\n", name="users.dat").users.names == ("Anna",)
    warned = desk.load("name,lat_deg,lon_deg\nAnna,46.5,7.5\n", name="users.xlsx").warnings
    assert "is CSV by its content" in str(warned[0])


def test_positions_in_utm_and_mgrs_replace_degrees(desk):
    for head, place in (
        ("utm", "32 north 461344 5145745"),
        ("MGRS", "32TMS6134445745"),
        ("Ort", "32TMS 61344 45745"),
    ):
        toml = '[columns]\nmgrs = "Ort"\n' if head == "Ort" else ""
        home = "[home]\nlat_deg = 46.46\nlon_deg = 8.5\nalt_amsl_m = 600\n"
        users = desk.load(f"name,{head}\nAnna,{place}\n", toml, home).users
        assert (users.lat_deg[0], users.lon_deg[0]) == pytest.approx((46.4648, 8.4965), abs=1e-3)


def test_degrees_minutes_seconds_are_read_in_a_table(desk):
    users = desk.load('name,lat_deg,lon_deg\nAnna,"46°30\'36""N",7 30 36 E\n').users
    assert (users.lat_deg[0], users.lon_deg[0]) == pytest.approx((46.51, 7.51), abs=1e-9)


def test_a_grid_column_beside_degrees_is_not_used_and_a_mapped_one_says_so(desk):
    text = "name,lat_deg,lon_deg,utm\nAnna,46.5,7.5,nonsense\n"
    assert desk.load(text).warnings == ()
    assert "[columns] utm: is not used" in str(desk.load(text, '[columns]\nutm = "utm"\n').warnings[0])


# -- what is refused: one sentence each -------------------------------------------------------------------------

LAUGHS = '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>'
ENTITY = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY x SYSTEM "file:///etc/passwd">]>'

# fmt: off
LOTS = '<ExtendedData><Data name="demand_mbit"><value>lots</value></Data></ExtendedData>'
BAD_KML = {
    "empty": ("", "is empty"),
    "cut off": (kml(placemark())[:-30], "is not valid XML"),
    "not closed": (KML_HEAD + "<Placemark>", "is not valid XML"),
    "billion laughs": (LAUGHS + "<kml>&b;</kml>", "document type or entities"),
    "file entity": (ENTITY + "<kml><Placemark><name>&x;</name></Placemark></kml>", "document type or entities"),
    "doctype": ('<!DOCTYPE kml SYSTEM "http://example.org/x.dtd"><kml/>', "document type or entities"),
    "network link": (kml("<NetworkLink><Link><href>http://example.org</href></Link></NetworkLink>"), "NetworkLink"),
    "no placemark": (KML_HEAD + KML_TAIL, "holds no users"),
    "line": (kml(placemark("<LineString><coordinates>7,46 7,47</coordinates></LineString>")), "has a LineString"),
    "polygon": (kml(placemark("<Polygon/>")), "has a Polygon"),
    "no geometry": (kml(placemark("")), "has no place"),
    "two points": (kml(placemark("<Point><coordinates>7,46</coordinates></Point>" * 2)), "has 2 points"),
    "no coordinates": (kml(placemark("<Point/>")), "allowed is longitude,latitude"),
    "one number": (kml(placemark("<Point><coordinates>7.5</coordinates></Point>")), "allowed is longitude,latitude"),
    "words": (kml(placemark("<Point><coordinates>7.5,north</coordinates></Point>")), "not a plain decimal number"),
    "latitude 91": (kml(placemark("<Point><coordinates>7.5,91</coordinates></Point>")), "a number from -90 to 90"),
    "nan": (kml(placemark("<Point><coordinates>nan,46.5</coordinates></Point>")), "not a plain decimal number"),
    "swapped": (kml(placemark("<Point><coordinates>46.501,7.501</coordinates></Point>")), "km from home"),
    "twice the name": (kml(placemark(), placemark()), "names must differ"),
    "deep": (KML_HEAD + "<Folder>" * 100 + "</Folder>" * 100 + KML_TAIL, "nested more than"),
    "unknown encoding": (b'<?xml version="1.0" encoding="klingon"?><kml></kml>', "is not"),
    "wrong encoding": (kml(placemark(name="Zürich")).encode("latin-1"), "is not valid XML"),
    "demand": (kml(placemark(LOTS + "<Point><coordinates>7,46</coordinates></Point>")), "not a plain decimal number"),
}
BAD_GPX = {
    "cut off": (gpx(wpt())[:-8], "is not valid XML"),
    "billion laughs": (LAUGHS + "<gpx>&b;</gpx>", "document type or entities"),
    "file entity": (ENTITY + "<gpx><wpt lat='46' lon='7'><name>&x;</name></wpt></gpx>", "document type or entities"),
    "only a track": (gpx("<trk><trkseg><trkpt lat='46.5' lon='7.5'/></trkseg></trk>"), "holds 1 tracks, no waypoints"),
    "routes and tracks": (gpx("<rte/><rte/><trk/>"), "holds 2 routes and 1 tracks"),
    "nothing": (gpx(), "holds no users"),
    "no latitude": (gpx("<wpt lon='7.5'/>"), "nothing stands there"),
    "no longitude": (gpx("<wpt lat='46.5'/>"), "nothing stands there"),
    "empty latitude": (gpx(wpt(lat="")), "nothing stands there"),
    "latitude 91": (gpx(wpt(lat="91")), "a number from -90 to 90"),
    "longitude 181": (gpx(wpt(lon="181")), "a number from -180 to 180"),
    "infinite": (gpx(wpt(lat="inf")), "not a plain decimal number"),
    "nan": (gpx(wpt(lat="nan")), "not a plain decimal number"),
    "comma": (gpx(wpt(lat="46,5")), "a decimal comma"),
    "letters": (gpx(wpt(lat="46.5N")), "not a plain decimal number"),
    "twice the name": (gpx(wpt(), wpt()), "names must differ"),
    "swapped": (gpx(wpt("7.5", "46.5")), "km from home"),
    "text after": (gpx(wpt()) + "more", "is not valid XML"),
    "two roots": (gpx(wpt()) + gpx(wpt()), "is not valid XML"),
    "attribute twice": ("<gpx><wpt lat='46.5' lat='46.6' lon='7.5'/></gpx>", "is not valid XML"),
    "null": (gpx(wpt()).replace("Anna", "An\0na"), "is not valid XML"),
    "unbound prefix": ("<x:gpx ><wpt/></x:gpx>", "is not valid XML"),
}
HEADER = ["name", "lat_deg", "lon_deg"]
GOOD_ROW = ["Anna", 46.5, 7.5]
BAD_XLSX = {
    "cut off": (xlsx(TABLE)[:-100], "damaged zip archive"),
    "cut short": (xlsx(TABLE)[:40], "damaged zip archive"),
    "no workbook": (zipped({"a.txt": "x"}), "is a zip archive of"),
    "open document": (zipped({"mimetype": "x", "content.xml": "<x/>"}), "OpenDocument"),
    "excel 97": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600, "Excel 97"),
    "workbook is text": (zipped({"xl/workbook.xml": "hello"}), "is not XLSX that can be read"),
    "workbook of nothing": (zipped({"xl/workbook.xml": ""}), "is not XLSX that can be read"),
    "bomb": (zipped({"xl/workbook.xml": "<x/>", "xl/sheet1.xml": b"0" * 2_000_000}), "grows more than 300 times"),
    "no cells": (xlsx([]), "is empty"),
    "only a header": (xlsx([HEADER]), "holds no users"),
    "column twice": (xlsx([["name", "name", "lat_deg", "lon_deg"], ["A", "B", 46.5, 7.5]]), "is there twice"),
    "no latitude": (xlsx([["name", "lon_deg"], ["A", 7.5]]), "there is no column lat_deg"),
    "empty latitude": (xlsx([HEADER, ["A", None, 7.5]]), "nothing stands there"),
    "latitude 91": (xlsx([HEADER, ["A", 91, 7.5]]), "a number from -90 to 90"),
    "words": (xlsx([HEADER, ["A", "north", 7.5]]), "not a plain decimal number"),
    "comma": (xlsx([HEADER, ["A", "46,5", 7.5]]), "a decimal comma"),
    "twice the name": (xlsx([HEADER, GOOD_ROW, GOOD_ROW]), "names must differ"),
    "far": (xlsx([HEADER, ["A", -46.5, 7.5]]), "km from home"),
    "demand": (xlsx([[*HEADER, "demand_mbit"], [*GOOD_ROW, "lots"]]), "not a plain decimal number"),
    "negative demand": (xlsx([[*HEADER, "demand_mbit"], [*GOOD_ROW, -1]]), "a number from 0"),
    "pair once": (xlsx([[*HEADER, "pair"], [*GOOD_ROW, 1]]), "a pair is exactly two users"),
    "control characters": (xlsx([HEADER, ["A\x9bB", 46.5, 7.5]]), "cannot be written"),
    "entity": (zipped({"xl/workbook.xml": LAUGHS + "<workbook>&b;</workbook>"}), "XLSX that can be read|is empty"),
}
# fmt: on
BAD = [
    pytest.param(f"users.{kind}", content, words, id=f"{kind}, {name}")
    for kind, cases in (("kml", BAD_KML), ("gpx", BAD_GPX), ("xlsx", BAD_XLSX))
    for name, (content, words) in cases.items()
]


@pytest.mark.parametrize(("name", "content", "words"), BAD)
def test_a_bad_file_is_one_sentence_that_names_it(desk, name, content, words):
    code, text = desk.only_problem(content, name=name)
    assert code
    assert text.startswith(name)
    assert re.search(words, text), text
    assert "\n" not in text
    assert text.isprintable()


def test_there_are_twenty_malformed_inputs_for_each_reader():
    assert min(len(BAD_KML), len(BAD_GPX), len(BAD_XLSX)) >= 20


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (zipped({"a.kml": kml(), "b.kml": kml()}), "one KML document is expected"),
        (zipped({"doc.kml": kml(placemark())})[:-9], "damaged zip archive"),
        (zipped({"doc.kml": b" " * 3_000_000}), "grows more than 300 times"),
        (spoilt(zipped({"doc.kml": kml(placemark())})), "damaged zip archive"),
        ("<html><body>404</body></html>", "is a web page"),
        ("<other/>", "neither KML nor GPX"),
    ],
)
def test_a_bad_archive_or_page_is_refused(desk, content, words):
    _, text = desk.only_problem(content, name="users.kmz")
    assert words in text


def test_archives_with_too_much_in_them_are_not_unpacked(desk, monkeypatch):
    monkeypatch.setattr(kinds, "MAX_ENTRIES", 5)
    _, text = desk.only_problem(xlsx(TABLE, TABLE), name="users.xlsx")
    assert "unpacks to" in text
    monkeypatch.setattr(kinds, "MAX_ENTRIES", 100)
    monkeypatch.setattr(kinds, "MAX_UNPACKED_BYTES", 100)
    assert "at most 100 bytes" in desk.only_problem(xlsx(TABLE), name="users.xlsx")[1]


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(
        [xlsx(TABLE), zipped({"doc.kml": kml(placemark())}), kml(placemark()).encode(), gpx(wpt()).encode()]
    ),
    st.data(),
)
def test_a_damaged_file_is_read_or_refused_never_a_traceback(desk, content, data):
    damaged = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(damaged)) | st.just(len(damaged)))
    with contextlib.suppress(InputError):
        assert len(desk.load(bytes(damaged[:cut]), name="users.any").users) >= 1
