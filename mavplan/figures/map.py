"""The map of one plan: users, pairs, coverage, reference and flown path, numbered stops; after the paper's figure 6.

And what stands round it: no-fly zones, fence, rally points, the way home.
"""

from typing import TYPE_CHECKING

import numpy as np

from mavplan.figures.fonts import drawable, shortened, shown_name
from mavplan.figures.labels import BELOW, Labels
from mavplan.figures.surroundings import Surroundings, draw_surroundings, surroundings
from mavplan.geo import LocalPlane
from mavplan.mission.model import Command
from mavplan.scenario.model import Floats, Scenario

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from mavplan.plan import Plan

# Okabe and Ito's palette: told apart by colour-blind eyes and in grey.
AIR, D2D, PATH, REFERENCE, HOME = "#0072B2", "#D55E00", "#000000", "#999999", "#009E73"
WAY_HOME = "0.45"
LABELLED_USERS = 40
"""With more users than this their names would cover the map."""
BESIDE_DOT_PT, BESIDE_STOP_PT, DIGIT_PT = 4.5, 8.0, 2.5
"""How far a label stands from the middle of a user's dot, and of a stop's number, for each further digit more."""


def draw_map(ax: "Axes", plan: "Plan", labels: Labels, *, holds: bool = True) -> "Axes":
    """Draw a plan over its users, in metres east and north of home.

    Parameters
    ----------
    ax
        Where to draw; its aspect becomes equal.
    plan
        What was planned.
    labels
        Takes the numbers and names of the map, to be put in place when the figure has its layout.
    holds
        Whether the seconds of each stop stand beside its number, with the name of one that is pinned.
    """
    from matplotlib.collections import EllipseCollection, LineCollection

    users, trajectory = plan.scenario.users, plan.trajectory
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
    draw_way_home(ax, way_home_m(plan))
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
    labels.dots_m += [users.xy_m, np.zeros((1, 2))] if len(users) <= LABELLED_USERS else []
    number_stops(labels, stops, plan.holds.stored_s if holds else None, plan.pinned_names)
    if len(users) <= LABELLED_USERS:
        for number, (name, place) in enumerate(zip(users.names, users.xy_m, strict=True), start=1):
            labels.add(shown_name(name, number), place, away_pt=BESIDE_DOT_PT)
    around = surroundings(plan.scenario)
    ax.update_datalim(around.framed(drawn_m(plan)))
    return finish(ax, around)


def names_on(scenario: Scenario) -> list[str]:
    """Return the names that stand on the map of a plan of a scenario: of users where they are few, of pinned stops."""
    users = scenario.users.names if len(scenario.users) <= LABELLED_USERS else ()
    return [*users, *(stop.name for stop in scenario.stops)]


def drawn_m(plan: "Plan") -> Floats:
    """Return (K, 2) points, metres, that the map of a plan must hold."""
    trajectory = plan.trajectory
    stops_m, reach_m = trajectory.stops_m, trajectory.radius_m
    return np.vstack(
        [stops_m - reach_m, stops_m + reach_m, trajectory.path_m, plan.scenario.users.xy_m, way_home_m(plan)]
    )


def way_home_m(plan: "Plan") -> Floats:
    """Return (K, 2) the way back from the last stop to home in metres; empty where the mission does not return."""
    if plan.scenario.vehicle.end != "rtl":
        return np.empty((0, 2))
    home, last = plan.scenario.home, plan.built.stop_items[-1].hold
    turns = [item for item in plan.built.mission.items[last + 1 :] if item.command == Command.NAV_WAYPOINT]
    turns_m = LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(
        [item.lat_deg for item in turns], [item.lon_deg for item in turns]
    )
    return np.vstack([plan.trajectory.stops_m[-1:], turns_m.reshape(-1, 2), np.zeros((1, 2))])


def draw_way_home(ax: "Axes", way_m: Floats, label: str = "way home") -> None:
    """Draw the way home, if there is one, with what the legend calls it."""
    if len(way_m):
        ax.plot(*way_m.T, ":", color=WAY_HOME, linewidth=1.3, zorder=2.5, label=label)


def finish(ax: "Axes", around: Surroundings) -> "Axes":
    """Set scale and limits of a map, and draw what stands round the flight within them."""
    ax.set_aspect("equal", adjustable="box")
    ax.autoscale_view()
    draw_surroundings(ax, around)
    ax.set_xlabel("east of home [m]")
    ax.set_ylabel("north of home [m]")
    return ax


def number_stops(
    labels: Labels, stops_m: Floats, hold_s: Floats | None, pinned: "Sequence[str | None]"
) -> None:
    """Write each stop's number at its place, and its hold beside it.

    Parameters
    ----------
    stops_m
        (M, 2) the stops in flying order.
    hold_s
        (M,) seconds; None: no holds are written.
    pinned
        M names, empty or None for stops that are not pinned.
    """
    crowded = len(stops_m) > LABELLED_USERS
    for index, place in enumerate(stops_m):
        name = pinned[index]
        labels.add_number(str(index + 1), place, size=5 if crowded else 8, square=bool(name))
        if hold_s is not None and not crowded:
            words = f"{shortened(name)}, " if name and drawable(name) else ""
            away_pt = BESIDE_STOP_PT + DIGIT_PT * (len(str(index + 1)) - 1)
            text = f"{words}{hold_s[index]:g} s"
            labels.add(text, place, away_pt=away_pt, around=BELOW, size=7, color="black")
    if any(pinned):
        labels.ax.scatter([], [], s=55, color=PATH, marker="s", label="pinned stop")
