"""Degrees, minutes, seconds; UTM; MGRS: against pyproj and the letter of each form, and what is refused."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mgrs import MGRS
from pyproj import Transformer

from mavplan.geo import geodesic_distance_m
from mavplan.scenario.coordinates import (
    band_fault,
    parse_angle,
    parse_mgrs,
    parse_utm,
    utm_to_degrees,
)
from mavplan.scenario.reference import keys_of

LAT, LON = keys_of("home")["lat_deg"], keys_of("home")["lon_deg"]
NORTH, EAST = 46 + 30 / 60 + 12.5 / 3600, 7 + 5 / 60 + 0.25 / 3600


@pytest.mark.parametrize(
    "text",
    [
        "46°30'12.5\"N", "46° 30′ 12.5″ N", "N 46 30 12.5", "N46°30'12.5", "46 30 12.5 n", "46:30:12.5",
        "46d30m12.5s N",         "+46 30 12.5", "46º 30’ 12.5” N", "46°30'12.5''N", " 46 30.208333333333 N ",
    ],
)  # fmt: skip
def test_every_way_of_writing_the_same_latitude_gives_it(text):
    assert parse_angle(text, LAT) == pytest.approx(NORTH, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("7°5'0.25\"E", EAST),
        ("W 7 5 0.25", -EAST),
        ("-7 5 0.25", -EAST),
        ("7.5E", 7.5),
        ("7.5°", 7.5),
        ("180 W", -180),
    ],
)
def test_longitudes_have_their_own_letters(text, degrees):
    assert parse_angle(text, LON) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("46 60 N", "below 60"),
        ("46 30 61", "below 60"),
        ("46.5 30 N", "only the last"),
        ("46 30.5 12 N", "only the last"),
        ("-46 30 N", "one sign or one letter"),
        ("N 46 30 N", "one sign or one letter"),
        ("46 30 E", "the letter of lat_deg is N or S"),
    ],
)
def test_an_angle_that_contradicts_itself_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        parse_angle(text, LAT)


@pytest.mark.parametrize(
    "text", ["", "north", "46,5", "46.5 north", "46 30 12 5", "4 6 3 0 1", "0x10", "nan", "1e1", "46°°"]
)
def test_what_is_no_angle_is_left_to_the_number_reader(text):
    assert parse_angle(text, LAT) is None


@given(st.floats(-90, 90), st.integers(0, 3))
def test_an_angle_written_in_parts_comes_back(lat_deg, form):
    size, letter = abs(lat_deg), "S" if lat_deg < 0 else "N"
    minutes = (size - int(size)) * 60
    seconds = (minutes - int(minutes)) * 60
    if f"{minutes:.9f}".startswith("60") or f"{seconds:.9f}".startswith("60"):
        return
    text = [
        f"{size:.12f} {letter}",
        f"{int(size)}°{minutes:.9f}'{letter}",
        f"{int(size)}°{int(minutes)}'{seconds:.9f}\"{letter}",
        f"{letter}{int(size)} {int(minutes)} {seconds:.9f}",
    ][form]
    assert parse_angle(text, LAT) == pytest.approx(lat_deg, abs=1e-9)


@given(st.floats(-79, 83), st.floats(-179.9, 179.9))
def test_mgrs_comes_back_within_half_its_square(lat_deg, lon_deg):
    # Just south of the equator the mgrs library rounds the northing up to 10,000 km, which no square has.
    assume(not -2e-4 < lat_deg < 0)
    for digits, within_m in ((5, 0.8), (4, 8.0)):
        text = MGRS().toMGRS(lat_deg, lon_deg, MGRSPrecision=digits)
        back = parse_mgrs(text)
        assert geodesic_distance_m(lat_deg, lon_deg, *back) < within_m


@given(st.floats(-79.9, 83.9), st.integers(1, 60), st.floats(-3, 3))
def test_utm_is_what_pyproj_makes_of_it(lat_deg, zone, off_deg):
    lon_deg = -183 + 6 * zone + off_deg
    north = lat_deg >= 0
    to = Transformer.from_crs(4326, (32600 if north else 32700) + zone, always_xy=True)
    east_m, north_m = to.transform(lon_deg, lat_deg)
    if not 0 <= north_m < 9_999_999:
        return
    place = parse_utm(f"{zone} {'north' if north else 'south'} {east_m:.3f} {north_m:.3f}")
    back_lat, back_lon = utm_to_degrees([place])
    assert geodesic_distance_m(lat_deg, lon_deg, float(back_lat[0]), float(back_lon[0])) < 0.01


@pytest.mark.parametrize(
    "text",
    [
        "32T 461344 5145745",
        "32 T 461344 5145745",
        "32T 461344mE 5145745mN",
        "32t 461344.0, 5145745.0",
        "32 north 461344 5145745",
        "32N 461344 5145745",
    ],
)
def test_utm_is_taken_as_maps_and_receivers_write_it(text):
    lat_deg, lon_deg = utm_to_degrees([parse_utm(text)])
    assert (lat_deg[0], lon_deg[0]) == pytest.approx((46.4648, 8.4965), abs=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("32S 461344 3745745", "32 north or 32 south"),
        ("61 north 461344 5145745", "no place in a UTM zone"),
        ("32 north 46134 5145745", "no place"),
        ("32 north 461344 10000000", "no place"),
        ("461344 5145745", "allowed is zone"),
        ("32I 461344 5145745", "allowed is zone"),
        ("32T 461344", "allowed is zone"),
        ("", "allowed is zone"),
    ],
)
def test_utm_that_is_no_place_or_two_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        parse_utm(text)


@pytest.mark.parametrize(
    "text",
    [
        "32TMT",
        "32TMT 61 45",
        "32TMT 613445",
        "32TMT 12345 678",
        "32IMT 6134 4574",
        "99TMT 6134 4574",
        "x",
        "",
    ],
)
def test_mgrs_that_is_coarse_or_no_square_is_refused(text):
    with pytest.raises(ValueError, match="MGRS"):
        parse_mgrs(text)


def test_a_place_outside_its_band_is_told():
    assert band_fault("T", 46.5) == ""
    assert band_fault("", 46.5) == ""
    assert band_fault("U", 46.5) == "lies at latitude 46.500, not in band U (48 to 56)"
