"""The map of one plan: users, pairs, coverage, reference and flown path, numbered stops; after the paper's figure 6."""

import io
from typing import TYPE_CHECKING

import numpy as np

from mavplan.errors import InputError
from mavplan.planners.trajectory import Trajectory
from mavplan.scenario.model import Floats, Users

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mavplan.plan import Plan

# Okabe and Ito's palette: told apart by colour-blind eyes and in grey.
AIR, D2D, PATH, REFERENCE, HOME = "#0072B2", "#D55E00", "#000000", "#999999", "#009E73"
LABELLED_USERS = 40
"""With more users than this their names would cover the map."""


def draw_map(ax: "Axes", users: Users, trajectory: Trajectory, hold_s: Floats | None = None) -> "Axes":
    """Draw a trajectory over its users, in metres east and north of home.

    Parameters
    ----------
    ax
        Where to draw; its aspect becomes equal.
    users, trajectory
        What was planned, for whom.
    hold_s
        (M,) seconds at each stop, written beside its number where given.
    """
    from matplotlib.collections import EllipseCollection, LineCollection

    stops, assignment = trajectory.stops_m, trajectory.assignment
    across = np.full(len(stops), 2 * trajectory.radius_m)
    ax.add_collection(
        EllipseCollection(
            across, across, np.zeros(len(stops)), units="xy", offsets=stops, offset_transform=ax.transData,
            facecolors=AIR, edgecolors=AIR, alpha=0.06, zorder=0,
        )
    )  # fmt: skip
    first = np.flatnonzero(users.mate > np.arange(len(users)))
    pairs = np.stack([users.xy_m[first], users.xy_m[users.mate[first]]], axis=1)
    if len(pairs):
        ax.add_collection(LineCollection(list(pairs), colors=D2D, linewidths=1.2, zorder=2))
        ax.plot([], [], color=D2D, linewidth=1.2, label="D2D pair")
    if len(trajectory.reference_m):
        ax.plot(*trajectory.reference_m.T, "--", color=REFERENCE, linewidth=1, zorder=1, label="reference")
    ax.plot(
        *trajectory.path_m.T, color=PATH, linewidth=1.4, zorder=3, label=f"path, {trajectory.length_m:,.0f} m"
    )
    on_air, relayed = users.xy_m[~assignment.d2d & assignment.served], users.xy_m[assignment.d2d]
    size = 26 if len(users) <= LABELLED_USERS else 9
    ax.scatter(on_air[:, 0], on_air[:, 1], s=size, color=AIR, zorder=4, label="served from the air")
    if len(relayed):
        ax.scatter(
            relayed[:, 0],
            relayed[:, 1],
            s=size,
            color=D2D,
            marker="D",
            zorder=4,
            label="served by D2D",
        )
    ax.scatter(0, 0, s=90, color=HOME, marker="^", zorder=5, label="home")
    if len(users) <= LABELLED_USERS:
        for name, place in zip(users.names, users.xy_m, strict=True):
            ax.annotate(
                name.replace("$", r"\$"), place, (4, 4), textcoords="offset points", fontsize=6, color="0.35"
            )
    _number_stops(ax, stops, hold_s)
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    ax.set_xlabel("east of home [m]")
    ax.set_ylabel("north of home [m]")
    return ax


def _number_stops(ax: "Axes", stops_m: Floats, hold_s: Floats | None) -> None:
    """Write each stop's number, and its hold, at its place."""
    from matplotlib.patheffects import withStroke

    crowded = len(stops_m) > LABELLED_USERS
    outline = [withStroke(linewidth=2.5, foreground="white")]
    for index, place in enumerate(stops_m):
        ax.annotate(
            str(index + 1), place, ha="center", va="center", fontsize=5 if crowded else 8, color="white", zorder=6,
            bbox={"boxstyle": "circle,pad=0.25", "facecolor": PATH, "edgecolor": "white", "linewidth": 0.8},
        )  # fmt: skip
        if hold_s is not None and not crowded:
            ax.annotate(
                f"{hold_s[index]:g} s", place, (0, -13), textcoords="offset points",
                ha="center", va="top", fontsize=7, zorder=6, path_effects=outline,
            )  # fmt: skip


def _figure_size(users: Users, trajectory: Trajectory) -> tuple[float, float]:
    """Return width and height in inches that fit what is drawn, with a scale alike on both axes."""
    drawn = np.vstack([users.xy_m, trajectory.path_m])
    width_m, height_m = np.ptp(drawn, axis=0) + 2 * trajectory.radius_m
    scale = 8.0 / max(width_m, height_m)
    return max(6.5, width_m * scale + 1.0), max(5.0, height_m * scale + 1.2)


def render_plan(plan: "Plan", file_format: str) -> bytes:
    """Return the picture of a plan as the bytes of a ``png``, ``svg`` or ``pdf``.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("pictures need matplotlib: pip install 'mavplan[figures]'") from error
    figure = Figure(figsize=_figure_size(plan.scenario.users, plan.trajectory), layout="constrained")
    ax = draw_map(figure.add_subplot(), plan.scenario.users, plan.trajectory, plan.holds.stored_s)
    trajectory = plan.trajectory
    ax.set_title(
        f"{trajectory.planner.upper()}, {len(trajectory.stops_m)} stops for {len(plan.scenario.users)} users: "
        f"{plan.forecast.flight_s / 60:.1f} min flight + {plan.holds.hover_s / 60:.1f} min hover",
        fontsize=10,
    )
    figure.legend(loc="outside lower center", ncols=6, frameon=False, fontsize=8)
    content = io.BytesIO()
    # No date inside: the same plan is the same file.
    metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[file_format]
    figure.savefig(content, format=file_format, dpi=150, metadata=metadata)
    return content.getvalue()
