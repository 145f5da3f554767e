"""Problems: how values are shown, what is counted, what is nearest."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.errors import InputError
from mavplan.scenario.report import MAX_OF_A_KIND, Report, figure, nearest, shown


@given(st.integers(0, 60), st.integers(0, 60))
def test_problems_of_a_kind_are_cut_and_counted(ones, twos):
    """Each kind keeps its first twenty, and the sums always come out."""
    report = Report()
    for i in range(max(ones, twos)):
        if i < ones:
            report.error(f"file, line {i}", "one", "code", "one")
        if i < twos:
            report.warning(f"file, line {i}", "two", "code", "two")
    for count, message, severity in ((ones, "one", "error"), (twos, "two", "warning")):
        of_kind = [problem for problem in report.problems() if problem.severity == severity]
        kept = [problem for problem in of_kind if problem.message == message]
        assert len(kept) == min(count, MAX_OF_A_KIND)
        more = [problem.message for problem in of_kind if problem.message != message]
        assert more == ([f"and {count - MAX_OF_A_KIND} more like this"] if count > MAX_OF_A_KIND else [])
    assert report.count == ones + twos


def test_only_errors_are_raised():
    """A warning alone stops nothing, and is not among the errors."""
    report = Report()
    report.warning("a", "told", "w")
    report.raise_errors()
    report.error("b", "wrong", "e")
    with pytest.raises(InputError) as caught:
        report.raise_errors()
    assert [problem.code for problem in caught.value.problems] == ["e"]
    assert [problem.code for problem in report.warnings()] == ["w"]


@given(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.text()) | st.binary()
)
def test_any_value_can_be_shown(value):
    """Short, printable, on one line."""
    text = shown(value)
    assert text.isprintable()
    assert 0 < len(text) < 500


def test_values_look_as_in_the_file():
    """Text in quotes, true and false as TOML and JSON write them."""
    assert [shown(value) for value in ("a", True, None, 1.5, [1], {})] == [
        '"a"',
        "true",
        "nothing",
        "1.5",
        "a list",
        "a table",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.8, "0.8"), (1e6, "1,000,000"), (-105.3045, "-105.3045"), (2.0**63, "9,223,372,036,854,775,808")],
)
def test_figures_are_written_as_people_write_them(value, text):
    """Thousands apart, no exponent where it can be helped."""
    assert figure(value) == text


def test_the_nearest_name_ignores_case_and_is_none_when_nothing_is_near():
    """`Bandwith_HZ` is bandwidth_hz; `zzz` is nothing."""
    assert nearest("Bandwith_HZ", ["noise_dbm", "bandwidth_hz"]) == "bandwidth_hz"
    assert nearest("zzz", ["noise_dbm", "bandwidth_hz"]) is None
