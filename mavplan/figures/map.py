"""The map of one plan: users, pairs, coverage, reference and flown path, numbered stops; after the paper's figure 6."""

from typing import TYPE_CHECKING

import numpy as np

from mavplan.planners.trajectory import Trajectory
from mavplan.scenario.model import Floats, Users

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    ax.plot(*trajectory.path_m.T, color=PATH, linewidth=1.4, zorder=3, label="path")
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
    number_stops(ax, stops, hold_s)
    reach = trajectory.radius_m
    ax.update_datalim(np.vstack([stops - reach, stops + reach]))
    ax.set_aspect("equal", adjustable="box")
    ax.autoscale_view()
    ax.set_xlabel("east of home [m]")
    ax.set_ylabel("north of home [m]")
    return ax


def number_stops(ax: "Axes", stops_m: Floats, hold_s: Floats | None) -> None:
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
