"""The map of a proof: the flown track over the planned stops, users coloured by whether their demand was met."""

from typing import TYPE_CHECKING

import numpy as np

from mavplan.figures.fonts import shown_name
from mavplan.figures.labels import Labels
from mavplan.figures.map import BESIDE_DOT_PT, HOME, LABELLED_USERS, draw_way_home, finish, number_stops
from mavplan.figures.surroundings import surroundings
from mavplan.geo import LocalPlane
from mavplan.radio import Channel
from mavplan.scenario.model import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mavplan.proof.model import Proof
    from mavplan.stored_plan import StoredPlan

# Okabe and Ito's palette, as in the map of a plan; the markers tell them apart in grey.
MET, SHORT, TRACK, UNKNOWN = "#0072B2", "#D55E00", "#009E73", "#CC79A7"


def draw_proof_map(ax: "Axes", proof: "Proof", labels: Labels) -> "Axes":
    """Draw a proof, in metres east and north of home; ``labels`` takes the numbers and names of the map."""
    from matplotlib.collections import EllipseCollection, LineCollection

    users = proof.plan.scenario.users
    stops_m, reach_m = planned_m(proof), _reach_m(proof)
    across = np.full(len(stops_m), 2 * reach_m)
    ax.add_collection(
        EllipseCollection(
            across, across, np.zeros(len(stops_m)), units="xy", offsets=stops_m, offset_transform=ax.transData,
            facecolors=MET, edgecolors=MET, alpha=0.05, zorder=0,
        )
    )  # fmt: skip
    out_m, back_m = planned_ways_m(proof.plan)
    ax.plot(*out_m.T, "--", color="0.5", linewidth=1.1, zorder=1, label="planned")
    draw_way_home(ax, back_m, "planned way home")
    xy_m = proof.path_xyz_m[:, :2]
    pieces = np.stack([xy_m[:-1], xy_m[1:]], axis=1)
    for which, colour, style, label in (
        (proof.known, TRACK, "-", "flown"),
        (~proof.known, UNKNOWN, ":", "no positions"),
    ):
        if which.any():
            ax.add_collection(
                LineCollection(
                    list(pieces[which]),
                    colors=colour,
                    linestyles=style,
                    linewidths=1.3,
                    zorder=2,
                    label=label,
                )
            )
    size = 26 if len(users) <= LABELLED_USERS else 10
    for which, colour, marker, label in (
        (proof.met, MET, "o", "demand met"),
        (~proof.met, SHORT, "X", "short"),
    ):
        if which.any():
            place = users.xy_m[which]
            ax.scatter(
                place[:, 0], place[:, 1], s=size * (1 if marker == "o" else 2.5), color=colour, marker=marker,
                edgecolors="white", linewidths=0.5, zorder=5, label=label,
            )  # fmt: skip
    ax.scatter(0, 0, s=90, color=HOME, marker="^", edgecolors="white", zorder=4, label="home")
    labels.dots_m += [users.xy_m, np.zeros((1, 2))] if len(users) <= LABELLED_USERS else []
    held_s = np.array([round(stop.held_s, 1) for stop in proof.stops])
    number_stops(labels, stops_m, held_s, [stop.name for stop in proof.plan.stops])
    _name_users(labels, proof)
    around = surroundings(proof.plan.scenario)
    ax.update_datalim(around.framed(drawn_m(proof)))
    return finish(ax, around)


def drawn_m(proof: "Proof") -> Floats:
    """Return (K, 2) points, metres, that the map must hold."""
    stops_m, reach_m = planned_m(proof), _reach_m(proof)
    flown_m, users_m = proof.path_xyz_m[:, :2], proof.plan.scenario.users.xy_m
    return np.vstack([stops_m - reach_m, stops_m + reach_m, flown_m, users_m, *planned_ways_m(proof.plan)])


def planned_ways_m(plan: "StoredPlan") -> tuple[Floats, Floats]:
    """Return the planned way from home to the last stop, and from there home, with the points that they turn at.

    (K, 2) metres each; the second is empty where the plan does not return.
    """
    home = plan.scenario.home
    places = [(stop.items.first, stop.lat_deg, stop.lon_deg) for stop in plan.stops]
    places += [(turn.item, turn.lat_deg, turn.lon_deg) for turn in plan.turns]
    items, lat_deg, lon_deg = zip(*sorted(places), strict=True)
    way_m = LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(lat_deg, lon_deg)
    behind = items.index(max(stop.items.first for stop in plan.stops)) + 1
    above_home = np.zeros((1, 2))
    out_m = np.vstack([above_home, way_m[:behind]])
    if plan.scenario.vehicle.end != "rtl":
        return out_m, np.empty((0, 2))
    return out_m, np.vstack([way_m[behind - 1 :], above_home])


def _reach_m(proof: "Proof") -> float:
    scenario = proof.plan.scenario
    return Channel(scenario.radio, scenario.vehicle.altitude_m, scenario.d2d).radius_m


def planned_m(proof: "Proof") -> Floats:
    """Return (M, 2) the planned stops in metres."""
    home = proof.plan.scenario.home
    return LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(
        [stop.lat_deg for stop in proof.plan.stops], [stop.lon_deg for stop in proof.plan.stops]
    )


def named_users(proof: "Proof") -> list[int]:
    """Return the users that are named: all, or those that are short where they are many; those that are short first."""
    short = np.flatnonzero(~proof.met).tolist()
    met = np.flatnonzero(proof.met).tolist() if len(proof.met) <= LABELLED_USERS else []
    return [*short[:LABELLED_USERS], *met]


def _name_users(labels: Labels, proof: "Proof") -> None:
    """Write the names of users beside them, with what they lack."""
    users = proof.plan.scenario.users
    for user in named_users(proof):
        lacking = "" if proof.met[user] else f", −{proof.short_bit[user] / 1e6:,.3g} Mbit"
        labels.add(
            shown_name(users.names[user], user + 1) + lacking, users.xy_m[user], away_pt=BESIDE_DOT_PT,
            color="0.35" if proof.met[user] else SHORT,
        )  # fmt: skip
