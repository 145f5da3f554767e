"""Pictures as bytes: whole figures for a plan or a comparison, by the suffix of the file they are for."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan.errors import InputError, Problem
from mavplan.figures.map import draw_map
from mavplan.planners.trajectory import Trajectory
from mavplan.scenario.model import Floats, Users

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mavplan.comparison import Comparison
    from mavplan.plan import Plan
    from mavplan.proof.model import Proof

PICTURES = (".png", ".svg", ".pdf")


def check_picture(path: Path) -> None:
    """Raise an `InputError` where a file is no picture that can be drawn, or matplotlib is missing."""
    if path.suffix.lower() not in PICTURES:
        message = f"{path.suffix or 'a name without suffix'} is no picture format: {', '.join(PICTURES)}"
        raise InputError([Problem(str(path), message, "format")])
    _figure((1.0, 1.0))


def draw_plan(plan: "Plan", path: Path) -> bytes:
    """Return the map of a plan.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    figure = _figure(_size_in(plan.scenario.users, plan.trajectory))
    draw_map(figure.add_subplot(), plan.scenario.users, plan.trajectory, plan.holds.stored_s)
    trajectory = plan.trajectory
    figure.suptitle(
        f"{trajectory.planner.upper()}, {len(trajectory.stop_at)} stops for {len(plan.scenario.users)} users: "
        f"{plan.forecast.flight_s / 60:.1f} min flight + {plan.holds.hover_s / 60:.1f} min hover",
        fontsize=10,
    )
    _legend(figure)
    return _saved(figure, path)


def draw_proof(proof: "Proof", path: Path) -> bytes:
    """Return the map of a proof: the track over the plan, and who is short.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    from mavplan.figures.proof_map import draw_proof_map, drawn_m

    figure = _figure(_fitting_in(np.ptp(drawn_m(proof), axis=0)))
    draw_proof_map(figure.add_subplot(), proof)
    met, users = int(proof.met.sum()), len(proof.met)
    held = sum(stop.span is not None for stop in proof.stops)
    figure.suptitle(
        f"{met} of {users} users received what they need; {held} of {len(proof.stops)} stops held, "
        f"{proof.flight.flown_s / 60:.1f} min flown",
        fontsize=10,
    )
    _legend(figure)
    return _saved(figure, path)


def draw_comparison(comparison: "Comparison", path: Path) -> bytes:
    """Return the maps of all planners side by side, on the same scale.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    figure = _figure((11.0, 10.0))
    axes = figure.subplots(2, (len(comparison.plans) + 1) // 2, sharex=True, sharey=True).flat
    for ax, plan, row in zip(axes, comparison.plans, comparison.rows, strict=False):
        draw_map(ax, plan.scenario.users, plan.trajectory)
        index = "" if row.joint_index is None else f", ρe {row.joint_index:.2f}"
        ax.set_title(
            f"{row.planner.upper()}: {row.stops} stops, {row.length_m:,.0f} m, "
            f"{row.sum_rate_bit_s_hz:.1f} bit/s/Hz{index}",
            fontsize=9,
        )
        ax.label_outer()
    _legend(figure)
    return _saved(figure, path)


def _figure(size_in: tuple[float, float]) -> "Figure":
    """Return an empty figure, made without matplotlib's global state."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("pictures need matplotlib: pip install 'mavplan[figures]'") from error
    return Figure(figsize=size_in, layout="constrained")


def _size_in(users: Users, trajectory: Trajectory) -> tuple[float, float]:
    """Return width and height in inches that fit what is drawn, with a scale alike on both axes."""
    return _fitting_in(np.ptp(np.vstack([users.xy_m, trajectory.path_m]), axis=0) + 2 * trajectory.radius_m)


def _fitting_in(extent_m: Floats) -> tuple[float, float]:
    """Return width and height in inches for so many metres east and north."""
    width_m, height_m = np.maximum(extent_m, 1.0)
    scale = 8.0 / max(width_m, height_m)
    return max(6.5, width_m * scale + 1.0), max(5.0, height_m * scale + 1.2)


def _legend(figure: "Figure") -> None:
    """Put one legend for all axes below them."""
    entries: dict[str, Any] = {}
    columns = 6 if figure.get_figwidth() > 8 else 3
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=columns, frameon=False, fontsize=8
    )


def _saved(figure: "Figure", path: Path) -> bytes:
    """Return the figure as the bytes of a file; no date inside, so that the same plan is the same file."""
    content = io.BytesIO()
    file_format = path.suffix.lower()[1:]
    metadata: dict[str, Any] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[file_format]
    figure.savefig(content, format=file_format, dpi=150, metadata=metadata)
    return content.getvalue()
