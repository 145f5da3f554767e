"""Pictures as bytes: whole figures for a plan or a comparison, by the suffix of the file they are for."""

import io
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.figures.fonts import quiet, undrawable
from mavplan.figures.labels import Labels, place_labels
from mavplan.figures.map import draw_map, drawn_m, names_on
from mavplan.figures.surroundings import surroundings
from mavplan.scenario.model import Floats, Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mavplan.comparison import Comparison
    from mavplan.plan import Plan
    from mavplan.proof.model import Proof

PICTURES = (".png", ".svg", ".pdf")
DPI = 150
PAGE_IN = 11.0
"""Width of the maps of a comparison together."""
PANEL_HEIGHT_IN, PANEL_WIDTH_IN = 4.8, 2.6
"""One map of a comparison is at most so high, and at least so wide: its title needs that."""
WIDE = 1.9
"""Maps that are so much wider than high stand two in a row instead of three."""
TICK_IN = 0.6
"""Room for the number of one tick."""
LEGEND_ENTRY_IN = 1.45
"""Width of a column of the legend."""


def check_picture(path: Path) -> None:
    """Raise an `InputError` where a file is no picture that can be drawn, or matplotlib is missing."""
    if path.suffix.lower() not in PICTURES:
        message = f"{path.suffix or 'a name without suffix'} is no picture format: {', '.join(PICTURES)}"
        raise InputError([Problem(str(path), message, "format")])
    _figure((1.0, 1.0))


def plan_names(scenarios: Iterable[Scenario]) -> tuple[Problem, ...]:
    """Return a warning of the names that no font here can draw on the maps of plans of these scenarios."""
    return undrawable([name for scenario in scenarios for name in names_on(scenario)])


def proof_names(proof: "Proof") -> tuple[Problem, ...]:
    """Return a warning of the names that no font here can draw on the map of a proof."""
    from mavplan.figures.proof_map import named_users

    scenario = proof.plan.scenario
    users = [scenario.users.names[user] for user in named_users(proof)]
    return undrawable([*users, *(stop.name for stop in scenario.stops)])


def draw_plan(plan: "Plan", path: Path) -> bytes:
    """Return the map of a plan.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    return _saved(plan_figure(plan), path)


def plan_figure(plan: "Plan") -> "Figure":
    """Return the map of a plan as a figure, its labels in place."""
    figure = _figure((6.5, 5.0))
    ax = figure.add_subplot()
    labels = Labels(ax)
    draw_map(ax, plan, labels)
    trajectory = plan.trajectory
    figure.suptitle(
        f"{trajectory.planner.upper()}, {len(trajectory.stop_at)} stops for {len(plan.scenario.users)} users: "
        f"{plan.forecast.flight_s / 60:.1f} min flight + {plan.holds.hover_s / 60:.1f} min hover",
        fontsize=10,
    )
    return _one_map(figure, labels)


def draw_proof(proof: "Proof", path: Path) -> bytes:
    """Return the map of a proof: the track over the plan, and who is short.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    return _saved(proof_figure(proof), path)


def proof_figure(proof: "Proof") -> "Figure":
    """Return the map of a proof as a figure, its labels in place."""
    from mavplan.figures.proof_map import draw_proof_map

    figure = _figure((6.5, 5.0))
    ax = figure.add_subplot()
    labels = Labels(ax)
    draw_proof_map(ax, proof, labels)
    met, users = int(proof.met.sum()), len(proof.met)
    held = sum(stop.span is not None for stop in proof.stops)
    figure.suptitle(
        f"{met} of {users} users received what they need; {held} of {len(proof.stops)} stops held, "
        f"{proof.flight.flown_s / 60:.1f} min flown",
        fontsize=10,
    )
    return _one_map(figure, labels)


def draw_comparison(comparison: "Comparison", path: Path) -> bytes:
    """Return the maps of all planners side by side, on the same scale.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    return _saved(comparison_figure(comparison), path)


def comparison_figure(comparison: "Comparison") -> "Figure":
    """Return the maps of all planners side by side as a figure, its labels in place."""
    around = surroundings(comparison.plans[0].scenario)
    width_m, height_m = _extent_m(
        np.vstack([around.framed(drawn_m(plan)) for plan in comparison.plans])
    ).tolist()
    columns = 2 if width_m > WIDE * height_m else 3
    rows = -(-len(comparison.plans) // columns)
    scale = min(PAGE_IN / columns / width_m, PANEL_HEIGHT_IN / height_m)
    panel_in = max(width_m * scale, PANEL_WIDTH_IN), height_m * scale
    legend_in = 0.9
    figure = _figure((columns * (panel_in[0] + 0.15) + 0.7, rows * (panel_in[1] + 0.5) + legend_in))
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).flat
    labels = []
    for ax, plan, row in zip(panels, comparison.plans, comparison.rows, strict=False):
        labels.append(Labels(ax))
        draw_map(ax, plan, labels[-1], holds=False)
        index = "" if row.joint_index is None else f", ρe {row.joint_index:.2f}"
        ax.set_title(
            f"{row.planner.upper()}: {row.stops} stops, {row.length_m:,.0f} m\n"
            f"{row.sum_rate_bit_s_hz:.1f} bit/s/Hz{index}",
            fontsize=9,
        )
        ax.tick_params(labelsize=8)
        for axis, long_in in (("x", width_m * scale), ("y", height_m * scale)):
            ax.locator_params(axis=axis, nbins=int(np.clip(long_in / TICK_IN, 1, 6)))
        ax.label_outer()
    for ax in list(panels)[len(comparison.plans) :]:
        ax.remove()
    _legend(figure)
    place_labels(figure, labels)
    return figure


def _figure(size_in: tuple[float, float]) -> "Figure":
    """Return an empty figure, made without matplotlib's global state."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("pictures need matplotlib: pip install 'mavplan[figures]'") from error
    return Figure(figsize=size_in, dpi=DPI, layout="constrained")


def _one_map(figure: "Figure", labels: Labels) -> "Figure":
    """Give a figure of one map its size and legend, a scale alike on both axes, and put its labels in place."""
    (west, east), (south, north) = labels.ax.get_xlim(), labels.ax.get_ylim()
    width_m, height_m = _extent_m(np.array([[west, south], [east, north]])).tolist()
    scale = 8.0 / max(width_m, height_m)
    figure.set_size_inches(max(6.5, width_m * scale + 1.0), max(4.5, height_m * scale + 1.4))
    _legend(figure)
    place_labels(figure, [labels])
    return figure


def _extent_m(points_m: Floats) -> Floats:
    """Return width and height in metres, at least 1, of what holds these points."""
    extent_m: Floats = np.maximum(np.ptp(points_m, axis=0), 1.0)
    return extent_m


def _legend(figure: "Figure") -> None:
    """Put one legend for all axes below them."""
    entries: dict[str, Any] = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    columns = max(2, int(figure.get_figwidth() / LEGEND_ENTRY_IN))
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=columns, frameon=False, fontsize=8
    )


def _saved(figure: "Figure", path: Path) -> bytes:
    """Return the figure as the bytes of a file; no date, no chance in it: the same plan is the same file."""
    from matplotlib import rc_context

    content = io.BytesIO()
    file_format = path.suffix.lower()[1:]
    metadata: dict[str, Any] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[file_format]
    with quiet(), rc_context({"svg.hashsalt": "mavplan"}):
        figure.savefig(content, format=file_format, dpi=DPI, metadata=metadata)
    return content.getvalue()
