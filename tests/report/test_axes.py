"""Marks on scales: round steps, few enough, from 0 to the end."""

from hypothesis import given
from hypothesis import strategies as st

from mavplan.report.axes import CLOCK_STEPS_S, clock_step_s, marks, round_step


@given(st.floats(1e-3, 1e7), st.integers(2, 20))
def test_steps_are_round_and_no_more_than_asked_for(span, most):
    step = round_step(span, most)
    assert span / step <= most * (1 + 1e-6)
    digits = f"{step:e}".split("e")[0].rstrip("0").rstrip(".")
    assert digits in {"1", "2", "5"}
    assert span / step > most / 5 * (1 - 1e-6), "a finer step would have done"


@given(st.floats(1, 500_000), st.integers(2, 20))
def test_clock_steps_are_a_clocks(span_s, most):
    step = clock_step_s(span_s, most)
    assert step * most >= span_s
    assert step in CLOCK_STEPS_S or step % 86_400 == 0


def test_marks_reach_from_0_to_the_end():
    assert marks(100.0, 4) == [0, 50, 100]
    assert marks(1430.0, 12, clock_step_s)[:3] == [0, 120, 240]
    assert marks(0.0, 4) == [0.0]
