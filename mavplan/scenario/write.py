"""A scenario as text: ``scenario.toml`` with every value and its unit, and ``users.csv``. Both can be read back."""

import csv
import io
import json
from typing import Any

from mavplan.geo import E7
from mavplan.mission.geofence import Fence, FenceArea, FenceCircle
from mavplan.scenario.model import UNPAIRED, Scenario, Users
from mavplan.scenario.reference import SECTIONS, Key, keys_of

_COLUMN = 34
"""Where remarks begin."""


def scenario_toml(scenario: Scenario, users_file: str, remark: str) -> str:
    """Return a ``scenario.toml``.

    Parameters
    ----------
    scenario
        What it holds; its users are written by `users_csv`.
    users_file
        The users file's name.
    remark
        What stands at the head of the file, one or more lines.
    """
    given: dict[str, Any] = {
        "home": scenario.home,
        "radio": scenario.radio,
        "d2d": scenario.d2d,
        "vehicle": scenario.vehicle,
        "service": scenario.service,
        "wind": scenario.wind,
        "fence": scenario.fence_options,
        "planner": scenario.planner,
    }
    if scenario.terrain_options.file is not None:
        given["terrain"] = scenario.terrain_options
    lines = [*(f"# {line}".rstrip() for line in remark.splitlines()), "", f"users = {_value(users_file)}"]
    for name in (name for name in SECTIONS if name in given):
        lines += ["", f"[{name}]"]
        auto = ["altitude_m"] if name == "vehicle" and scenario.search_altitude else []
        lines += [
            _line(key, "auto" if key.name in auto else getattr(given[name], key.name))
            for key in keys_of(name).values()
        ]
        if name == "fence" and scenario.fence is not None:
            for area in _areas(scenario.fence):
                side = "inclusion" if area.inclusion else "exclusion"
                lines += ["", f"[[fence.{side}]]", _area(area)]
    for area in _areas(scenario.no_fly) if scenario.no_fly is not None else ():
        lines += ["", "[[no_fly]]", _area(area), *([f"name = {_value(area.name)}"] if area.name else [])]
    for point in scenario.rally:
        lines += [
            "",
            "[[rally]]",
            f"lat_deg = {_degrees(point.lat_e7)}",
            f"lon_deg = {_degrees(point.lon_e7)}",
        ]
        lines += [f"alt_rel_m = {_value(point.alt_rel_m)}"]
        lines += [f"name = {_value(point.name)}"] if point.name else []
    for vehicle in scenario.vehicles:
        lines += ["", "[[vehicles]]"]
        values = {key: getattr(vehicle, key) for key in keys_of("vehicles")}
        lines += [f"{key} = {_value(value)}" for key, value in values.items() if value not in (None, "")]
    for stop in scenario.stops:
        lines += ["", "[[stops]]"]
        values = {key: getattr(stop, key) for key in keys_of("stops")}
        if stop.user is not None:
            values = {key: value for key, value in values.items() if key not in ("lat_deg", "lon_deg")}
        lines += [f"{key} = {_value(value)}" for key, value in values.items() if value not in (None, "")]
    return "\n".join(lines) + "\n"


def users_csv(users: Users) -> str:
    """Return a ``users.csv``: names, degrees, demands in Mbit, pair ids and priorities where there are any."""
    text = io.StringIO()
    paired = bool((users.mate != UNPAIRED).any())
    writer = csv.writer(text, lineterminator="\n")
    weighted = users.priority is not None
    head = ["name", "lat_deg", "lon_deg", "demand_mbit"]
    writer.writerow([*head, *(["pair"] if paired else []), *(["priority"] if weighted else [])])
    for number, name in enumerate(users.names):
        mate = int(users.mate[number])
        pair = "" if mate == UNPAIRED else f"pair-{min(number, mate) + 1}"
        figures = (users.lat_deg[number], users.lon_deg[number], users.demand_bit[number] / 1e6)
        weight = [] if users.priority is None else [repr(float(users.priority[number]))]
        row = [name, *(repr(float(value)) for value in figures), *([pair] if paired else []), *weight]
        writer.writerow(row)
    return text.getvalue()


def _line(key: Key, value: Any) -> str:
    """Return one key with its value and what it may be; commented out where nothing is set."""
    shown = f"# {key.name} = ..." if value is None else f"{key.name} = {_value(value)}"
    unset = "; not set" if value is None else ""
    return f"{shown:<{_COLUMN}} # {key.allowed_with_unit}{unset}"


def _value(value: Any) -> str:
    """Return a value as TOML has it."""
    match value:
        case bool():
            return "true" if value else "false"
        case list():
            return f"[{', '.join(_value(part) for part in value)}]"
        case str():
            # A JSON string is a TOML string, but for the one control character that JSON leaves alone.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case _:
            return repr(value)


def _degrees(e7: int) -> str:
    return repr(e7 / E7)


def _areas(fence: Fence) -> tuple[FenceArea, ...]:
    return (*fence.polygons, *fence.circles)


def _area(area: FenceArea) -> str:
    """Return an area as a key of its table."""
    if isinstance(area, FenceCircle):
        place = f"lat_deg = {_degrees(area.lat_e7)}, lon_deg = {_degrees(area.lon_e7)}"
        return f"circle = {{ {place}, radius_m = {_value(area.radius_m)} }}"
    vertices = ", ".join(f"[{_degrees(lat)}, {_degrees(lon)}]" for lat, lon in area.vertices_e7)
    return f"polygon_deg = [{vertices}]"
