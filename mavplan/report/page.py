"""The page itself: `ReportContent` into one HTML text with its style, its script and its drawings inside."""

import math
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan import __version__
from mavplan.errors import Problem
from mavplan.report.axes import clock_step_s, marks, round_step
from mavplan.report.content import ReportContent

if TYPE_CHECKING:
    from jinja2 import Template

MARGIN = 0.04
"""Part of a map's width that is left free about what is drawn."""
MAP_PX = 900.0
"""Width of the map that signs are sized for, until the page knows its own."""


def render(content: ReportContent, warnings: Sequence[Problem] = ()) -> str:
    """Return the page.

    Parameters
    ----------
    content
        What is shown; all of it is escaped.
    warnings
        What the people who fly it should know, first on the page.
    """
    return _template().render(
        c=content,
        warnings=warnings,
        view=_view(content),
        time_marks=marks(content.mission_s, 12, clock_step_s),
        height_marks=_height_marks(content),
        low=min(0.0, *(height for _, height in (*content.profile, *content.ground))),
        version=__version__,
    )


@cache
def _template() -> "Template":
    from jinja2 import Environment, StrictUndefined, select_autoescape

    folder = files("mavplan.report")
    environment = Environment(
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"clock": clock, "figure": figure, "cells": cells}
    environment.globals |= {
        name: (folder / f"page.{name}").read_text(encoding="utf-8") for name in ("css", "js")
    }
    return environment.from_string((folder / "page.html.jinja").read_text(encoding="utf-8"))


def clock(seconds: float) -> str:
    """Return seconds as m:ss, from an hour as h:mm:ss."""
    whole = round(seconds)
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def figure(value: float | None, digits: int = 0) -> str:
    """Return a number with separators, a dash for none."""
    return "–" if value is None else f"{value:,.{digits}f}"


def cells(value: float) -> str:
    """Return a coordinate of a drawing, centimetres kept."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _height_marks(content: ReportContent) -> list[float]:
    """Return the marks of heights above home, also below it where the flight or the ground is."""
    heights = [height for _, height in (*content.profile, *content.ground)]
    low, high = min(0.0, *heights), max(heights)
    if low >= 0:
        return marks(high, 4)
    step = round_step(high - low, 5)
    return [step * number for number in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _view(content: ReportContent) -> dict[str, Any]:
    """Return the map's frame in metres, north up (y grows southwards), and metres a pixel to begin with."""
    points = [*content.path_m, *((user.x_m, user.y_m) for user in content.users)]
    for area in content.areas:
        points += area.ring_m
    places = np.array(points)
    stops = np.array([(stop.x_m, stop.y_m) for stop in content.stops])
    low = np.minimum(places.min(axis=0), stops.min(axis=0) - content.radius_m)
    high = np.maximum(places.max(axis=0), stops.max(axis=0) + content.radius_m)
    size = np.maximum(high - low, 10.0)
    low, size = low - MARGIN * size.max(), size + 2 * MARGIN * size.max()
    return {
        "x": float(low[0]),
        "y": float(-(low[1] + size[1])),
        "width": float(size[0]),
        "height": float(size[1]),
        "metres_a_pixel": float(size[0] / MAP_PX),
    }
