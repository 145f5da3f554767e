"""The map of a proof: the flown track over the planned stops, users coloured by whether their demand was met."""

from typing import TYPE_CHECKING

import numpy as np

from mavplan.figures.map import HOME, LABELLED_USERS, number_stops
from mavplan.geo import LocalPlane
from mavplan.radio import Channel
from mavplan.scenario.model import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mavplan.proof.model import Proof

# Okabe and Ito's palette, as in the map of a plan; the markers tell them apart in grey.
MET, SHORT, TRACK, UNKNOWN = "#0072B2", "#D55E00", "#009E73", "#CC79A7"


def draw_proof_map(ax: "Axes", proof: "Proof") -> "Axes":
    """Draw a proof, in metres east and north of home."""
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
    ax.plot(*np.vstack(([0.0, 0.0], stops_m)).T, "--", color="0.6", linewidth=1, zorder=1, label="planned")
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
    _name_users(ax, proof)
    number_stops(ax, stops_m, np.array([round(stop.held_s, 1) for stop in proof.stops]))
    ax.update_datalim(drawn_m(proof))
    ax.set_aspect("equal", adjustable="box")
    ax.autoscale_view()
    ax.set_xlabel("east of home [m]")
    ax.set_ylabel("north of home [m]")
    return ax


def drawn_m(proof: "Proof") -> Floats:
    """Return (K, 2) points, metres, that the map must hold."""
    stops_m, reach_m = planned_m(proof), _reach_m(proof)
    return np.vstack(
        [stops_m - reach_m, stops_m + reach_m, proof.path_xyz_m[:, :2], proof.plan.scenario.users.xy_m]
    )


def _reach_m(proof: "Proof") -> float:
    scenario = proof.plan.scenario
    return Channel(scenario.radio, scenario.vehicle.altitude_m, scenario.d2d).radius_m


def planned_m(proof: "Proof") -> Floats:
    """Return (M, 2) the planned stops in metres."""
    home = proof.plan.scenario.home
    return LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(
        [stop.lat_deg for stop in proof.plan.stops], [stop.lon_deg for stop in proof.plan.stops]
    )


def _name_users(ax: "Axes", proof: "Proof") -> None:
    """Write the names of all users, or of those that are short where they are many, with what they lack."""
    users = proof.plan.scenario.users
    named = range(len(users)) if len(users) <= LABELLED_USERS else np.flatnonzero(~proof.met)[:LABELLED_USERS]
    for user in named:
        name = users.names[user].replace("$", r"\$")
        lacking = "" if proof.met[user] else f", −{proof.short_bit[user] / 1e6:,.3g} Mbit"
        ax.annotate(
            name + lacking, users.xy_m[user], (4, 4), textcoords="offset points", fontsize=6,
            color="0.35" if proof.met[user] else SHORT, zorder=6,
        )  # fmt: skip
