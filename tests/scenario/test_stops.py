"""``[[stops]]``: places where the vehicle must stop, read, checked and written again."""

import pytest

from mavplan.errors import InputError
from mavplan.scenario import PinnedStop, load_scenario
from mavplan.scenario.write import scenario_toml, users_csv

HEAD = 'users = "users.csv"\n[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600.0\n'
PLACE = "[[stops]]\nlat_deg = 46.502\nlon_deg = 7.51\n"


def load(folder, stops):
    (folder / "users.csv").write_text("name,lat_deg,lon_deg\npost,46.5,7.5\nb,46.501,7.5\n")
    (folder / "scenario.toml").write_text(HEAD + stops)
    return load_scenario(folder / "scenario.toml")


def test_pinned_stops_are_read_and_written_again(tmp_path):
    text = PLACE + 'name = "marker"\nhold_s = 30\norder = 2\n[[stops]]\nuser = "post"\norder = "first"\n'
    found = load(tmp_path, text)
    assert found.stops == (
        PinnedStop(46.502, 7.51, None, "marker", 30.0, 2),
        PinnedStop(46.5, 7.5, "post", "post", 0.0, "first"),
    )
    (tmp_path / "again.toml").write_text(scenario_toml(found, "again.csv", "again"))
    (tmp_path / "again.csv").write_text(users_csv(found.users))
    assert load_scenario(tmp_path / "again.toml").stops == found.stops


def test_a_stop_without_a_name_is_called_by_its_place_in_the_list(tmp_path):
    assert [stop.name for stop in load(tmp_path, PLACE).stops] == ["pinned 1"]


@pytest.mark.parametrize(
    ("stops", "code"),
    [
        (PLACE + 'user = "post"\n', "stop-place"),
        ("[[stops]]\nlat_deg = 46.5\n", "stop-place"),
        ('[[stops]]\nname = "nowhere"\n', "stop-place"),
        ('[[stops]]\nuser = "pots"\n', "unknown-user"),
        (PLACE + "hold_s = -1\n", "out-of-range"),
        (PLACE + 'order = "second"\n', "out-of-range"),
        (PLACE + "order = 0\n", "out-of-range"),
        (PLACE + "altitude_m = 50\n", "unknown-key"),
        (PLACE + PLACE, "duplicate"),
        (PLACE + 'order = 1\n[[stops]]\nuser = "b"\norder = 1\n', "duplicate"),
        (PLACE + 'name = "b"\n[[stops]]\nuser = "b"\n', "duplicate"),
        ("[[stops]]\nlat_deg = 7.51\nlon_deg = 46.502\n", "too-far"),
        ("[stops]\nlat_deg = 46.5\n", "wrong-type"),
    ],
)
def test_what_is_wrong_with_a_pinned_stop_is_said(tmp_path, stops, code):
    with pytest.raises(InputError) as raised:
        load(tmp_path, stops)
    assert [problem.code for problem in raised.value.problems] == [code]
