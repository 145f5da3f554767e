"""Progress: a bar with the time left on a terminal, nothing elsewhere."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.cli import console
from mavplan.cli.console import progress, time_left_s
from mavplan.comparison import compare
from tests.support import make_scenario


@given(st.floats(0.01, 1), st.floats(0, 1e5), st.floats(0, 1e5))
def test_the_time_left_is_never_negative_and_falls_as_time_goes_by(done, taken_s, since_s):
    left_s = time_left_s(done, taken_s, since_s)
    assert 0 <= left_s <= time_left_s(done, taken_s, 0.0)


def test_after_a_quarter_in_a_minute_three_minutes_are_left():
    assert time_left_s(0.25, 60.0, 0.0) == pytest.approx(180.0)
    assert time_left_s(0.25, 60.0, 30.0) == pytest.approx(150.0)


@pytest.fixture
def terminal(monkeypatch):
    """Standard error taken for a terminal."""
    monkeypatch.setattr(console, "is_terminal", lambda stream: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")


def test_on_a_terminal_a_bar_tells_the_part_done_and_the_time_left(terminal, capfd):
    with progress("planning") as move:
        move(1, 4)
    shown = capfd.readouterr()
    assert "planning" in shown.err
    assert "25%" in shown.err
    assert "left" in shown.err
    assert shown.out == ""


def test_until_something_is_done_the_time_gone_by_is_shown(terminal, capfd):
    with progress("asking"):
        pass
    assert "0:00" in capfd.readouterr().err


def test_nothing_to_do_is_no_division_by_nothing(terminal, capfd):
    with progress("planning") as move:
        move(0, 0)
    assert "planning" in capfd.readouterr().err


def test_elsewhere_nothing_is_shown(capfd):
    with progress("planning") as move:
        move(1, 4)
    assert capfd.readouterr() == ("", "")


def test_a_comparison_tells_progress_that_only_grows_up_to_its_last_part():
    told = []
    compare(
        make_scenario([[0, 0], [900, 0], [500, 800]], clusters="auto"),
        lambda done, todo: told.append(done / todo),
    )
    assert told == sorted(told)
    assert told[0] < 0.2
    assert 0.8 < told[-1] <= 1
