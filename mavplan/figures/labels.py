"""Names beside their places, none over another: each where there is room, or left out where there is none.

A name stands nearer to its own place than to any other, so that nobody takes it for a neighbour's.

Labels take no part in the layout of a figure: they never make its axes smaller. They are put in place last, when the
axes have their size.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from mavplan.figures.fonts import families_for, quiet
from mavplan.scenario.model import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

AROUND = ((1, 1), (1, 0), (1, -1), (-1, 1), (-1, 0), (-1, -1), (0, 1), (0, -1))
"""Where a name may stand, east and north of its place, in the order in which it is tried."""
BELOW = ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, -1), (1, 1), (-1, 1))
"""The same for the hold of a stop, which only other stops could be taken for the owner of."""
ALIGNED: dict[int, Literal["left", "center", "right"]] = {1: "left", 0: "center", -1: "right"}
DOT_PT = 3.0
"""Half the side of what a user's dot takes."""
FURTHER_PT = 7.0
"""How much further from its place a label is tried where that lies under a stop's number."""
GAP_PT = 1.0
"""Kept free round every label."""


@dataclass(eq=False)
class Labels:
    """The labels of one map until they are put in place.

    Attributes
    ----------
    ax
        The map.
    numbers
        Stop numbers, which stay where they are and are covered by nothing.
    waiting
        Labels to be put in place, the most important first, each with how far from its place in points it stands at
        least, east or north, and where it may.
    dots_m
        Places that no label may cover.
    """

    ax: "Axes"
    numbers: list["Annotation"] = field(default_factory=list)
    waiting: list[tuple["Annotation", float, tuple[tuple[int, int], ...]]] = field(default_factory=list)
    dots_m: list[Floats] = field(default_factory=list)

    def add_number(self, text: str, place_m: Floats, *, size: float, square: bool) -> None:
        """Write a stop's number at its place; in a square for one that is pinned."""
        shape = "square,pad=0.3" if square else "circle,pad=0.25"
        number = self.ax.annotate(
            text, (place_m[0], place_m[1]), ha="center", va="center", fontsize=size, color="white", zorder=6,
            bbox={"boxstyle": shape, "facecolor": "black", "edgecolor": "white", "linewidth": 0.8},
        )  # fmt: skip
        number.set_in_layout(False)
        self.numbers.append(number)

    def add(
        self,
        text: str,
        place_m: Floats,
        *,
        away_pt: float,
        around: tuple[tuple[int, int], ...] = AROUND,
        size: float = 6,
        color: str = "0.35",
    ) -> None:
        """Write a text beside a place, wherever there will be room."""
        from matplotlib.patheffects import withStroke

        label = self.ax.annotate(
            text, (place_m[0], place_m[1]), (0, 0), textcoords="offset points", fontsize=size, color=color, zorder=7,
            fontfamily=families_for(text), parse_math=False, va="center",
            path_effects=[withStroke(linewidth=2, foreground="white")],
        )  # fmt: skip
        label.set_in_layout(False)
        self.waiting.append((label, away_pt, around))

    def place(self) -> None:
        """Put every label where it covers nothing; take away those for which there is no room."""
        frame = np.array(self.ax.get_window_extent().extents)
        point = self.ax.figure.dpi / 72  # pixels
        numbers = np.array([_extents(number) for number in self.numbers]).reshape(-1, 4)
        stops = (numbers[:, :2] + numbers[:, 2:]) / 2
        places_m = np.vstack([np.empty((0, 2)), *self.dots_m])
        dots = self.ax.transData.transform(places_m).reshape(-1, 2)
        half = DOT_PT * point
        taken = [*numbers, *np.hstack([dots - half, dots + half])]
        boxes = np.array(taken).reshape(-1, 4)
        for label, away_pt, around in self.waiting:
            west, south, east, north = _extents(label)
            size = np.array([east - west, north - south])
            middle = self.ax.transData.transform(label.xy)
            under = _covers(np.hstack([middle, middle]), numbers)
            for further_pt, side in itertools.product((0.0, FURTHER_PT) if under else (0.0,), around):
                away = (away_pt + further_pt) * point
                centre = middle + np.array(side) * (away + size / 2)
                box = np.hstack([centre - size / 2, centre + size / 2])
                wide = box + GAP_PT * point * np.array([-1, -1, 1, 1])
                others = stops if around is BELOW else dots
                if _inside(wide, frame) and not _covers(wide, boxes) and _belongs(box, middle, others):
                    label.set_position((side[0] * away / point, side[1] * (away + size[1] / 2) / point))
                    label.set_horizontalalignment(ALIGNED[side[0]])
                    boxes = np.vstack([boxes, box])
                    break
            else:
                label.remove()


def place_labels(figure: "Figure", labels: Sequence[Labels]) -> None:
    """Lay a figure out and put the labels of its maps in place; its layout is final after that."""
    with quiet():
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for of_map in labels:
            of_map.place()


def _extents(label: "Annotation") -> Floats:
    """Return west, south, east and north of a text with the box round it, in pixels."""
    patch = label.get_bbox_patch()
    extent = label.get_window_extent() if patch is None else patch.get_window_extent()
    return np.array(extent.extents, dtype=np.float64)


def _inside(box: Floats, frame: Floats) -> bool:
    return bool((box[:2] >= frame[:2]).all() and (box[2:] <= frame[2:]).all())


def _belongs(box: Floats, middle: Floats, others: Floats) -> bool:
    """Return whether none of (K, 2) other places is nearer to a box than its own; a pixel is no difference."""
    places = np.vstack([middle, others])
    away = np.hypot(*(places - np.clip(places, box[:2], box[2:])).T)
    return bool(away[0] <= away.min() + 1.0)


def _covers(box: Floats, boxes: Floats) -> bool:
    """Return whether a box covers a part of any of (K, 4) others."""
    return bool(((boxes[:, :2] < box[2:]) & (boxes[:, 2:] > box[:2])).all(axis=1).any())
