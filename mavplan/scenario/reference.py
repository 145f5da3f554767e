"""What each key of ``scenario.toml`` may be, read off the types in `mavplan.scenario.sections`.

Messages, the documentation and the template are held to these descriptions, so that a range is written once.
"""

import dataclasses
import math
import types
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import annotated_types
from pydantic.fields import FieldInfo

from mavplan.scenario.report import figure
from mavplan.scenario.sections import (
    D2D,
    Circle,
    Columns,
    FenceOptions,
    FleetVehicle,
    Home,
    OrAuto,
    PinnedStop,
    PlannerOptions,
    Radio,
    Rally,
    Service,
    TerrainOptions,
    UserValues,
    Vehicle,
    Vertex,
    Wind,
)

SECTIONS: dict[str, type[Any]] = {
    "home": Home,
    "columns": Columns,
    "radio": Radio,
    "d2d": D2D,
    "vehicle": Vehicle,
    "service": Service,
    "wind": Wind,
    "fence": FenceOptions,
    "terrain": TerrainOptions,
    "planner": PlannerOptions,
}
"""Tables of ``scenario.toml`` by name, in the order in which they are documented."""

LISTED: dict[str, type[Any]] = {
    "fence.circle": Circle,
    "fence.vertex": Vertex,
    "rally": Rally,
    "vehicles": FleetVehicle,
    "stops": PinnedStop,
    "user": UserValues,
}
"""Tables of which there may be many, and what an entry consists of."""

AREA_LISTS = ("inclusion", "exclusion")
"""Keys of ``[fence]`` that are lists of areas."""

AREA_KEYS = ("polygon_deg", "circle")
"""Keys of an area, of which each has exactly one."""

NO_FLY_KEYS = (*AREA_KEYS, "file", "name")
"""Keys of a no-fly zone: an area, or a file of them, and what to call it."""

_UNITS = (
    ("_m_s2", "m/s²"),
    ("_m_s", "m/s"),
    ("_dbm", "dBm"),
    ("_db", "dB"),
    ("_deg", "degrees"),
    ("_mbit", "Mbit"),
    ("_hz", "Hz"),
    ("_wh", "Wh"),
    ("_kg", "kg"),
    ("_m", "m"),
    ("_s", "s"),
)


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a section.

    Attributes
    ----------
    section, name
        Where it stands.
    unit
        Read off the name's ending; empty where there is none.
    allowed
        What it may be, in words that end a sentence.
    required
        Whether there is no default.
    default
        Value where the file does not say; None also where it then depends.
    low, high, open_low, open_high
        Range of a number and whether its ends are outside; infinite where there is none.
    """

    section: str
    name: str
    unit: str
    allowed: str
    required: bool
    default: object
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    open_high: bool = False

    @property
    def place(self) -> str:
        """``[section] name``."""
        return f"[{self.section}] {self.name}"

    @property
    def allowed_with_unit(self) -> str:
        """``allowed`` with the unit behind it."""
        return f"{self.allowed} ({self.unit})" if self.unit else self.allowed

    def holds(self, value: float) -> bool:
        """Return whether a finite number lies in the range."""
        above = value > self.low if self.open_low else value >= self.low
        below = value < self.high if self.open_high else value <= self.high
        return math.isfinite(value) and above and below


@cache
def keys_of(section: str) -> dict[str, Key]:
    """Return the keys of a section, or of an entry of a list, by name and in its order."""
    kind = SECTIONS[section] if section in SECTIONS else LISTED[section]
    hints = get_type_hints(kind, include_extras=True)
    found = {}
    for item in dataclasses.fields(kind):
        allowed, limits = _describe(hints[item.name])
        required = item.default is dataclasses.MISSING
        found[item.name] = Key(
            section,
            item.name,
            next(
                (unit for ending, unit in _UNITS if item.name.endswith(ending) and section != "columns"), ""
            ),
            allowed,
            required,
            None if required else item.default,
            *limits,
        )
    return found


_Limits = tuple[float, float, bool, bool]
_NO_LIMITS: _Limits = (-math.inf, math.inf, False, False)


def _describe(hint: Any) -> tuple[str, _Limits]:
    """Return what a type allows, in words, and the range of its number."""
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        parts = [_describe(part) for part in get_args(hint) if part is not type(None)]
        return ", or ".join(text for text, _ in parts), parts[0][1]
    if origin is Literal:
        return " or ".join(f'"{choice}"' for choice in get_args(hint)), _NO_LIMITS
    if origin is Annotated:
        base, *extras = get_args(hint)
        limits = _limits(extras)
        auto = ', or "auto"' if any(isinstance(extra, OrAuto) for extra in extras) else ""
        return _NOUNS[base] + _range_words(limits) + auto, limits
    return _NOUNS[hint], _NO_LIMITS


_NOUNS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    str: "text",
    bool: "true or false",
    list[str]: "a list of text",
}


def _limits(extras: list[Any]) -> _Limits:
    low, high, open_low, open_high = _NO_LIMITS
    for bound in (entry for extra in extras if isinstance(extra, FieldInfo) for entry in extra.metadata):
        match bound:
            case annotated_types.Ge(ge=value):
                low = float(value)  # type: ignore[arg-type]
            case annotated_types.Gt(gt=value):
                low, open_low = float(value), True  # type: ignore[arg-type]
            case annotated_types.Le(le=value):
                high = float(value)  # type: ignore[arg-type]
            case annotated_types.Lt(lt=value):
                high, open_high = float(value), True  # type: ignore[arg-type]
    return low, high, open_low, open_high


def _range_words(limits: _Limits) -> str:
    low, high, open_low, open_high = limits
    if low == -math.inf and high == math.inf:
        return ""
    if high == math.inf:
        return f" above {figure(low)}" if open_low else f" of at least {figure(low)}"
    if not (open_low or open_high):
        return f" from {figure(low)} to {figure(high)}"
    start = f"above {figure(low)}" if open_low else f"of at least {figure(low)}"
    return f" {start} and " + (f"below {figure(high)}" if open_high else f"at most {figure(high)}")
