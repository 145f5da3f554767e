"""The page as text: whole, closed to the outside, and deaf to what a name says."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavplan.report.page import cells, clock, figure, render

VOID = {"meta", "input", "link", "br", "circle", "line", "polyline", "polygon", "path", "rect"}


class Page(HTMLParser):
    """Tags balanced, attributes and text gathered."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.names, self.urls, self.words = [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        self.urls += [value for name, value in attrs if name in {"src", "href", "action", "data"}]
        assert not any(name.startswith("on") for name, _ in attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.names.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] not in {"script", "style"}:
            self.words.append(data)


def test_the_page_is_whole_and_fetches_nothing(valley):
    _, content = valley
    text = render(replace(content, warnings=("speed_m_s: is fast",)))
    page = Page(text)
    assert page.urls == []
    assert not re.search(r"(https?:)?//[a-z]|url\(|@import|\bfetch\(|XMLHttpRequest|import\(", text)
    assert page.names.count("table") == 4
    assert "speed_m_s: is fast" in "".join(page.words)
    assert len(text) < 100_000


def test_rounds_of_sorties_follow_one_another(valley):
    _, content = valley
    flights = [
        replace(content, flight="a", mission_s=600.0),
        replace(content, flight="b", mission_s=900.0, start_s=10.0),
        replace(content, flight="c", mission_s=300.0, start_s=5.0, round=2),
    ]
    words = " ".join(Page(render(*flights)).words)
    assert f"All done {clock(910.0 + 305.0)}" in " ".join(words.split())
    assert clock(915.0) in words  # when the flight of the second round starts


def test_the_same_plan_is_the_same_page(valley):
    _, content = valley
    assert render(content) == render(content)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.text(max_size=40)
    | st.sampled_from(["<script>alert(1)</script>", "</title>", '"><b>', "{{ 1 }}", "</style>"])
)
def test_no_name_of_a_user_or_title_becomes_markup(valley, name):
    _, content = valley
    plain = Page(render(content))
    users = tuple(replace(user, name=name) for user in content.users)
    named = replace(content, title=name, users=users, pairs=())
    page = Page(render(named))
    assert page.names.count("script") == 1
    without_pairs = Page(render(replace(content, pairs=())))
    assert page.names == without_pairs.names
    assert len(plain.names) >= len(page.names)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0, "0:00"), (59.6, "1:00"), (61, "1:01"), (3599, "59:59"), (3600, "1:00:00"), (36_061, "10:01:01")],
)
def test_times_read_as_on_a_clock(seconds, words):
    assert clock(seconds) == words


def test_figures_have_separators_and_no_value_is_a_dash():
    assert figure(1234567.8, 1) == "1,234,567.8"
    assert figure(None) == "–"
    assert cells(-0.001) in {"0", "-0"}
    assert cells(1234.5) == "1234.5"
