"""Names on pictures: bounded, in a font that has them, or as a number with one sentence that says so."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.figures import fonts
from tests.figures.conftest import CHINESE, LONG


def columns(text):
    """Width in columns of a terminal, as Unicode has it."""
    return sum(2 if unicodedata.east_asian_width(char) in "WF" else 1 for char in text)


def test_a_long_name_is_cut_and_ends_in_an_ellipsis():
    shown = fonts.shown_name(LONG, 1)
    assert shown == "Die lange Wegstrecke hint…"
    assert columns(shown) == fonts.MOST_COLUMNS
    assert columns(fonts.shortened(CHINESE * 9)) <= fonts.MOST_COLUMNS


def test_a_name_that_is_short_stays_as_it_is():
    assert fonts.shown_name("Pfarrhaus Öttl $1_x^2$", 1) == "Pfarrhaus Öttl $1_x^2$"


@given(st.text())
def test_every_name_is_drawn_on_one_line_of_bounded_width(name):
    shown = fonts.shown_name(name, 7)
    assert "\n" not in shown
    assert "\x1b" not in shown
    assert sum(not unicodedata.combining(char) for char in shown) <= fonts.MOST_COLUMNS
    assert fonts.drawable(shown)


def test_names_that_no_font_has_are_told_in_one_sentence_and_drawn_as_numbers(matplotlib_alone):
    assert fonts.shown_name(CHINESE, 6) == "#6"
    (problem,) = fonts.undrawable(["Öttl", CHINESE, "東京", CHINESE])
    assert problem.severity == "warning"
    assert f"cannot draw {CHINESE}, 東京: the picture has numbers" in str(problem)
    assert "\n" not in str(problem)
    assert fonts.undrawable(["Öttl", "Pfarr\u200bhaus"]) == ()


def test_of_many_names_that_no_font_has_some_are_named_and_all_counted(matplotlib_alone):
    (problem,) = fonts.undrawable([f"東{number}" for number in range(12)])
    assert "東4 and 7 more" in problem.message


def test_a_family_that_has_what_the_own_font_lacks_is_fallen_back_to(monkeypatch):
    monkeypatch.setattr(fonts, "FALLBACKS", ("No Such Family", "STIXGeneral"))
    fonts.families.cache_clear()
    try:
        only_there = sorted(fonts._characters("STIXGeneral") - fonts._characters(fonts.OWN))
        char = next(char for char in only_there if char.isprintable() and unicodedata.category(char) != "Co")
        assert "No Such Family" not in fonts.families()
        assert fonts.families_for(f"a{char}") == [fonts.OWN, "STIXGeneral"]
        assert fonts.drawable(f"a{char}")
        assert fonts.families_for("Öttl") == [fonts.OWN]
    finally:
        fonts.families.cache_clear()


def test_the_font_that_draws_boxes_for_everything_is_none_of_them():
    assert not any("Last Resort" in family for family in fonts.families())


@pytest.mark.parametrize("raised", [ValueError, OSError, RuntimeError])
def test_a_font_that_cannot_be_read_has_no_characters(monkeypatch, raised):
    import matplotlib.font_manager

    def broken(*_args, **_options):
        raise raised("broken")

    monkeypatch.setattr(matplotlib.font_manager, "get_font", broken)
    fonts._characters.cache_clear()
    try:
        assert fonts._characters(fonts.OWN) == frozenset()
    finally:
        fonts._characters.cache_clear()
