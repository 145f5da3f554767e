"""The pictures: what stands in them is the table."""

import dataclasses

import numpy as np
import pytest

from mavplan.study.intervals import Interval
from mavplan.study.settings import Settings
from mavplan.study.summary import Line

pytest.importorskip("matplotlib", reason="pictures need matplotlib (extra 'figures')")

from matplotlib.figure import Figure

from mavplan.figures.study import draw_curves, draw_differences, render_study, slice_of


def line(mean_users, planner, value, *, clusters=4, half=0.1, threshold=3.0):
    """A line whose quantities all have the same interval."""
    found = Interval(value, value - half, value + half) if half else Interval(value, None, None)
    return Line(mean_users, 100.0, threshold, clusters, planner, 9, 8.0, 3.0, found, found, found, None, None)


LINES = [
    line(lam, name, base + lam / 100)
    for lam in (15.0, 20.0)
    for name, base in (("tloaik", 0.4), ("sbw", 1.0))
]


def test_a_curve_a_planner_with_its_interval_as_a_band():
    ax = draw_curves(Figure().add_subplot(), LINES, "mean_users", "length")
    curves = {curve.get_label(): curve for curve in ax.get_lines()}
    np.testing.assert_allclose(curves["TLOAIK"].get_xydata(), [[15, 0.55], [20, 0.6]])
    np.testing.assert_allclose(curves["SBW"].get_xydata(), [[15, 1.15], [20, 1.2]])
    bands = [band.get_paths()[0].vertices for band in ax.collections]
    assert [(band[:, 1].min(), band[:, 1].max()) for band in bands] == [
        pytest.approx((0.45, 0.7)),
        pytest.approx((1.05, 1.3)),
    ]


def test_the_differences_are_drawn_but_for_that_to_the_benchmark():
    gain = Interval(0.2, 0.1, 0.3)
    lines = [
        dataclasses.replace(line(lam, "boaik", 2.0), less="stoaik", rho_e_difference=gain)
        for lam in (15.0, 20.0)
    ]
    lines += [
        dataclasses.replace(line(15.0, "tloaik", 2.0), less="sbw", rho_e_difference=gain),
        line(15.0, "sbw", 1.0),
    ]
    ax = draw_differences(Figure().add_subplot(), lines, "mean_users")
    (curve,) = ax.get_legend_handles_labels()[0]
    assert curve.get_label() == "BOAIK − STOAIK"
    np.testing.assert_allclose(curve.get_xydata(), [[15, 0.2], [20, 0.2]])


def test_one_place_or_one_draw_can_be_drawn_too():
    ax = draw_curves(
        Figure().add_subplot(), [line(15.0, "tloaik", 1.0), line(15.0, "x", 2.0, half=0)], "clusters", "rho_e"
    )
    assert len(ax.get_lines()) == 2
    assert len(ax.collections) == 1


def test_what_is_not_on_the_axis_is_held_at_the_regime_or_at_the_least_value():
    both = [line(16.0, "sbw", 1.0, clusters=k, threshold=t) for k in (2, 4) for t in (0.0, 20.0)]
    assert [(one.clusters, one.snr_threshold_db) for one in slice_of(both, "snr_threshold_db")] == [
        (4, 0.0),
        (4, 20.0),
    ]
    assert [(one.clusters, one.snr_threshold_db) for one in slice_of(both, "clusters")] == [
        (2, 0.0),
        (4, 0.0),
    ]


@pytest.mark.parametrize("file_format", ["png", "svg", "pdf"])
def test_the_same_study_is_the_same_picture(file_format):
    wanted = Settings(mean_users=(15.0, 20.0), seeds=(0,))
    first = render_study(LINES, wanted, file_format)
    assert list(first) == [f"figure-8.{file_format}", f"figure-9.{file_format}"]
    assert render_study(LINES, wanted, file_format) == first
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[file_format]
    assert all(content.startswith(start) for content in first.values())
