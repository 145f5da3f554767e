"""The page itself: `ReportContent` into one HTML text with its style, its script and its drawings inside."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from mavplan import __version__
from mavplan.report.axes import clock_step_s, marks, round_step
from mavplan.report.rows import ReportContent

if TYPE_CHECKING:
    from jinja2 import Template

MARGIN = 0.04
"""Part of a map's width that is left free about what is drawn."""
MAP_PX = 900.0
"""Width of the map that signs are sized for, until the page knows its own."""
COLOURS = 6
"""Of flights, in ``page.css``."""


@dataclass(frozen=True, eq=False)
class Flight:
    """A flight on the page.

    Attributes
    ----------
    c
        What is shown of it.
    key
        Before the numbers of its stops, where there are several.
    first_user
        Number of its first user on the page.
    colour
        Of its path, from 1; 0 where it is the only one.
    """

    c: ReportContent
    key: str
    first_user: int
    colour: int

    def label(self, number: int) -> str:
        """Return how a stop is called on the page."""
        return f"{self.key}{number}"


def render(*contents: ReportContent, title: str = "") -> str:
    """Return the page.

    Parameters
    ----------
    contents
        The flights that are shown, at least one, in the plane of the first; all of it is escaped.
    title
        Heading of the page. Default: the first flight's.
    """
    contents = _one_after_the_other(contents)
    flights, offset = [], 0
    for number, content in enumerate(contents, start=1):
        several = len(contents) > 1
        colour = (number - 1) % COLOURS + 1 if several else 0
        flights.append(Flight(content, f"{number}." if several else "", offset, colour))
        offset += len(content.users)
    end_s = max(content.start_s + content.mission_s for content in contents)
    heights = [h for content in contents for _, h in (*content.profile, *content.ground)]
    low, high = min(0.0, *heights), max(*heights, *(content.altitude_m for content in contents))
    stops = [stop for content in contents for stop in content.stops]
    return _template().render(
        title=title or contents[0].title,
        flights=flights,
        c=contents[0],
        several=len(contents) > 1,
        lead=_lead(contents),
        facts=_facts(contents),
        warnings=_warnings(contents),
        users=offset,
        stops=len(stops),
        named=any(stop.name for stop in stops),
        in_flight=any(content.in_flight for content in contents),
        d2d=any(user.d2d for content in contents for user in content.users),
        areas=[*dict.fromkeys(area for content in contents for area in content.areas)],
        view=_view(contents),
        time_marks=marks(end_s, 12, clock_step_s),
        height_marks=_height_marks(low, max(heights)),
        span_s=end_s or 1.0,
        low=low,
        high=low + 1.1 * ((high - low) or 1.0),
        version=__version__,
    )


def _one_after_the_other(contents: Sequence[ReportContent]) -> tuple[ReportContent, ...]:
    """Return the flights with starts after the first of all, each round behind the one before."""
    begins_s: dict[int, float] = {}
    end_s = 0.0
    for number in sorted({content.round for content in contents}):
        begins_s[number] = end_s
        own = [content for content in contents if content.round == number]
        end_s += max(content.start_s + content.mission_s for content in own)
    return tuple(replace(content, start_s=begins_s[content.round] + content.start_s) for content in contents)


def _lead(contents: Sequence[ReportContent]) -> str:
    """Return the sentence under the heading."""
    planners = list(dict.fromkeys(content.planner.upper() for content in contents))
    autopilots = list(dict.fromkeys(content.autopilot for content in contents))
    users = len({user.name for content in contents for user in content.users})
    stops = sum(len(content.stops) for content in contents)
    flights = ""
    if len(contents) > 1:
        flights = f" in {len(contents)} {'sorties' if contents[0].sorties else 'flights'}"
    return (
        f"{' and '.join(planners)} for {' and '.join(autopilots)}: {_counted(users, 'user')}, "
        f"{_counted(stops, 'stop')}{flights}"
    )


def _counted(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _facts(contents: Sequence[ReportContent]) -> list[tuple[str, str, str]]:
    """Return the figures at the top: what, how much, and beside it in small."""
    first = contents[0]
    back_m = math.fsum(content.back_m for content in contents)
    demands = math.fsum(content.demand_mbit for content in contents)
    found = [
        ("Flight", clock(math.fsum(content.flight_s for content in contents)), ""),
        ("Hover", clock(math.fsum(content.hover_s for content in contents)), ""),
        (
            "Path",
            f"{math.fsum(content.length_m for content in contents):,.0f} m",
            f"and {back_m:,.0f} m back" if back_m else "",
        ),
        (
            "Altitude",
            _range([content.altitude_m for content in contents]),
            f"above {'the ground' if first.ground else 'home'}",
        ),
        ("Coverage radius", _range([content.radius_m for content in contents]), ""),
        ("Demand", f"{demands:,.0f} Mbit", first.service),
    ]
    air_s = math.fsum(content.mission_s for content in contents)
    if len(contents) == 1 or first.sorties:
        found.insert(0, ("Mission" if len(contents) == 1 else "In the air", clock(air_s), ""))
    else:
        done_s = max(content.start_s + content.mission_s for content in contents)
        found.insert(0, ("All done", clock(done_s), f"{clock(air_s)} in the air"))
    used = [content.used_wh for content in contents if content.used_wh is not None]
    if len(used) == len(contents):
        battery = f"of {first.battery_wh:,.0f}" if len(contents) == 1 and first.battery_wh else ""
        found.append(("Energy", f"{math.fsum(used):,.1f} Wh", battery))
    return found


def _range(values_m: Sequence[float]) -> str:
    low, high = f"{min(values_m):,.0f}", f"{max(values_m):,.0f}"
    return f"{low} m" if low == high else f"{low}–{high} m"


def _warnings(contents: Sequence[ReportContent]) -> list[str]:
    """Return what to know before the flight, each once; where not all flights say it, with the first's name."""
    left = dict.fromkeys(name for content in contents for name in content.not_served)
    found = [f"Not served: {', '.join(left)}."] if left else []
    for text in dict.fromkeys(text for content in contents for text in content.warnings):
        said_by = [content for content in contents if text in content.warnings]
        found.append(text if len(said_by) == len(contents) else f"{said_by[0].flight}: {text}")
    return found


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


def _height_marks(low: float, high: float) -> list[float]:
    """Return the marks of heights above home, also below it where the flight or the ground is."""
    if low >= 0:
        return marks(high, 4)
    step = round_step(high - low, 5)
    return [step * number for number in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _view(contents: Sequence[ReportContent]) -> dict[str, Any]:
    """Return the map's frame in metres, north up (y grows southwards), and metres a pixel to begin with."""
    points: list[tuple[float, float]] = []
    lows, highs = [], []
    for content in contents:
        points += [*content.path_m, *((user.x_m, user.y_m) for user in content.users)]
        for area in content.areas:
            points += area.ring_m
        stops = np.array([(stop.x_m, stop.y_m) for stop in content.stops])
        lows.append(stops.min(axis=0) - content.radius_m)
        highs.append(stops.max(axis=0) + content.radius_m)
    places = np.array(points)
    low = np.minimum(places.min(axis=0), np.min(lows, axis=0))
    high = np.maximum(places.max(axis=0), np.max(highs, axis=0))
    size = np.maximum(high - low, 10.0)
    low, size = low - MARGIN * size.max(), size + 2 * MARGIN * size.max()
    return {
        "x": float(low[0]),
        "y": float(-(low[1] + size[1])),
        "width": float(size[0]),
        "height": float(size[1]),
        "metres_a_pixel": float(size[0] / MAP_PX),
    }
